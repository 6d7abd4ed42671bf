# SPDX-License-Identifier: Apache-2.0
# The words of its messages.
target_link_libraries(catgut_anatomy ${kind} fmt::fmt)
