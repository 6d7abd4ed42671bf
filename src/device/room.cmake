# SPDX-License-Identifier: Apache-2.0
if(NOT CATGUT_HAPTICS)  # mouse, gamepad and the bridge to other programs need no library
  foreach(driver touch force_dimension haply)
    set_source_files_properties(${PROJECT_SOURCE_DIR}/src/device/${driver}.cpp PROPERTIES HEADER_FILE_ONLY ON)
  endforeach()
  return()
endif()
set_source_files_properties(${PROJECT_SOURCE_DIR}/src/device/drivers.cpp PROPERTIES COMPILE_DEFINITIONS CATGUT_WITH_HAPTICS)
# The Haply service speaks JSON over WebSocket: Boost.Beast and nlohmann-json, headers only, in one file.
find_package(Boost 1.74 REQUIRED)
find_package(nlohmann_json REQUIRED)
target_link_libraries(catgut_device PRIVATE Boost::headers nlohmann_json::nlohmann_json)
# libsodium: the bridge's handshake and sealed packets.
find_path(SODIUM_INCLUDE sodium.h REQUIRED)
find_library(SODIUM_LIBRARY sodium REQUIRED)
target_include_directories(catgut_device PRIVATE ${SODIUM_INCLUDE})
target_link_libraries(catgut_device PRIVATE ${SODIUM_LIBRARY})
# Build time matters more than run time. GCC's thread sanitizer warns of fences in Asio; only one thread uses it here.
set_source_files_properties(${PROJECT_SOURCE_DIR}/src/device/haply.cpp PROPERTIES
  COMPILE_OPTIONS "-O1;$<$<CXX_COMPILER_ID:GNU>:-Wno-tsan>")
