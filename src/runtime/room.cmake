target_compile_definitions(catgut_runtime PRIVATE CATGUT_VERSION="${PROJECT_VERSION}")
target_link_libraries(catgut_runtime PRIVATE fmt::fmt)
find_package(nlohmann_json REQUIRED)
target_link_libraries(catgut_runtime PRIVATE nlohmann_json::nlohmann_json)
