# SPDX-License-Identifier: Apache-2.0
target_link_libraries(catgut_assess PRIVATE fmt::fmt)
find_package(nlohmann_json REQUIRED)
target_link_libraries(catgut_assess PRIVATE nlohmann_json::nlohmann_json)
target_compile_options(catgut_assess PRIVATE -O1)  # build time matters more than run time
