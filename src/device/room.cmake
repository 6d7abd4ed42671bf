# The Haply service speaks JSON over WebSocket: Boost.Beast and nlohmann-json, headers only, in one file.
find_package(Boost 1.74 REQUIRED)
find_package(nlohmann_json REQUIRED)
target_link_libraries(catgut_device PRIVATE Boost::headers nlohmann_json::nlohmann_json)
set_source_files_properties(${PROJECT_SOURCE_DIR}/src/device/haply.cpp PROPERTIES COMPILE_OPTIONS -O1)  # quick to build matters more
