# SPDX-License-Identifier: Apache-2.0
target_link_libraries(catgut_procedure PRIVATE fmt::fmt)
target_compile_options(catgut_procedure PRIVATE -O1)  # parsers and reports: build time matters more than run time
