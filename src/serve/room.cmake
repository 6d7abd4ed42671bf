# SPDX-License-Identifier: Apache-2.0
if(NOT CATGUT_STORE)
  return()
endif()
find_package(nlohmann_json REQUIRED)
find_path(HTTPLIB_INCLUDE httplib.h)
find_library(HTTPLIB_LIBRARY cpp-httplib)
find_path(SODIUM_INCLUDE sodium.h)
find_library(SODIUM_LIBRARY sodium)
find_package(OpenSSL)
if(NOT HTTPLIB_INCLUDE OR NOT HTTPLIB_LIBRARY OR NOT SODIUM_LIBRARY OR NOT OPENSSL_FOUND)
  message(FATAL_ERROR "The educator's page needs cpp-httplib and libsodium: apt install libcpp-httplib-dev libsodium-dev, or configure with -DCATGUT_STORE=OFF.")
endif()
target_include_directories(catgut_serve SYSTEM PRIVATE ${HTTPLIB_INCLUDE} ${SODIUM_INCLUDE})
# Debian's library is compiled with these; the header must agree.
target_compile_definitions(catgut_serve PRIVATE CPPHTTPLIB_OPENSSL_SUPPORT CPPHTTPLIB_ZLIB_SUPPORT CPPHTTPLIB_BROTLI_SUPPORT)
target_link_libraries(catgut_serve PRIVATE ${HTTPLIB_LIBRARY} OpenSSL::SSL OpenSSL::Crypto ${SODIUM_LIBRARY} fmt::fmt
  nlohmann_json::nlohmann_json)
target_compile_options(catgut_serve PRIVATE -O1)
