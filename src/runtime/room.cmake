# SPDX-License-Identifier: Apache-2.0
target_compile_definitions(catgut_runtime PRIVATE CATGUT_VERSION="${PROJECT_VERSION}")
target_link_libraries(catgut_runtime PRIVATE fmt::fmt)
find_package(nlohmann_json REQUIRED)
target_link_libraries(catgut_runtime PRIVATE nlohmann_json::nlohmann_json)
target_compile_options(catgut_runtime PRIVATE -O1)  # parsers and reports: build time matters more than run time
