# SPDX-License-Identifier: Apache-2.0
# The library that other programs link: every room at or below `procedure`, in one archive, with the headers that
# include/catgut/catgut.h reaches. Installed as component "library".
get_property(library_rooms GLOBAL PROPERTY CATGUT_BELOW_procedure)
list(PREPEND library_rooms procedure)
set(library_objects "")
foreach(room ${library_rooms})
  list(APPEND library_objects $<TARGET_OBJECTS:catgut_${room}>)
endforeach()
add_library(catgut STATIC ${library_objects})
add_library(catgut::catgut ALIAS catgut)
set_target_properties(catgut PROPERTIES LINKER_LANGUAGE CXX)
target_include_directories(catgut PUBLIC
  $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include> $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/src>
  $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
target_link_libraries(catgut PUBLIC catgut_numerics Threads::Threads)
find_package(assimp REQUIRED)
find_package(hwy CONFIG REQUIRED)
target_link_libraries(catgut PRIVATE fmt::fmt assimp::assimp hwy::hwy)

# Programs in the build folder find the scenes like installed programs: in share/catgut of a folder above them.
file(MAKE_DIRECTORY ${CMAKE_BINARY_DIR}/share/catgut)
file(CREATE_LINK ${PROJECT_SOURCE_DIR}/scenes ${CMAKE_BINARY_DIR}/share/catgut/scenes SYMBOLIC)
file(CREATE_LINK ${PROJECT_SOURCE_DIR}/surveys ${CMAKE_BINARY_DIR}/share/catgut/surveys SYMBOLIC)
file(CREATE_LINK ${PROJECT_SOURCE_DIR}/procedures ${CMAKE_BINARY_DIR}/share/catgut/procedures SYMBOLIC)
file(CREATE_LINK ${PROJECT_SOURCE_DIR}/languages ${CMAKE_BINARY_DIR}/share/catgut/languages SYMBOLIC)
file(CREATE_LINK ${PROJECT_SOURCE_DIR}/rubrics ${CMAKE_BINARY_DIR}/share/catgut/rubrics SYMBOLIC)

include(CMakePackageConfigHelpers)
set(config_folder ${CMAKE_INSTALL_LIBDIR}/cmake/catgut)
configure_package_config_file(packaging/catgut-config.cmake.in ${PROJECT_BINARY_DIR}/packaging/catgut-config.cmake
  INSTALL_DESTINATION ${config_folder})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/packaging/catgut-config-version.cmake COMPATIBILITY SameMinorVersion)
file(RELATIVE_PATH CATGUT_PC_PREFIX /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
list(JOIN CATGUT_NUMERIC_FLAGS " " CATGUT_PC_FLAGS)
configure_file(packaging/catgut.pc.in ${PROJECT_BINARY_DIR}/packaging/catgut.pc @ONLY)

install(TARGETS catgut catgut_numerics EXPORT catgut
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT library)
install(EXPORT catgut NAMESPACE catgut:: FILE catgut-targets.cmake DESTINATION ${config_folder} COMPONENT library)
install(FILES ${PROJECT_BINARY_DIR}/packaging/catgut-config.cmake ${PROJECT_BINARY_DIR}/packaging/catgut-config-version.cmake
  DESTINATION ${config_folder} COMPONENT library)
install(FILES ${PROJECT_BINARY_DIR}/packaging/catgut.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT library)
install(CODE "set(catgut_source \"${PROJECT_SOURCE_DIR}\")
set(catgut_binary \"${PROJECT_BINARY_DIR}\")
set(catgut_include \"${CMAKE_INSTALL_INCLUDEDIR}\")" COMPONENT library)
install(SCRIPT cmake/install_headers.cmake COMPONENT library)
install(DIRECTORY scenes procedures languages rubrics surveys DESTINATION ${CMAKE_INSTALL_DATADIR}/catgut COMPONENT data FILES_MATCHING PATTERN "*.toml")
