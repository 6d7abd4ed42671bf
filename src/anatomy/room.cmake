# SPDX-License-Identifier: Apache-2.0
# For the text of messages.
target_link_libraries(catgut_anatomy ${kind} fmt::fmt)
