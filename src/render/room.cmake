# SPDX-License-Identifier: Apache-2.0
# render: PNG through libstb; pictures through Filament when CATGUT_RENDER is on. Video needs only the ffmpeg program at run time.
find_library(STB_LIBRARY stb REQUIRED)
target_link_libraries(catgut_render PRIVATE ${STB_LIBRARY})

if(CATGUT_RENDER)
  # EXACT: filament/egl_platform.cpp declares a class of the library whose header is not installed.
  find_package(filament 1.9.25 EXACT QUIET)
  find_program(MATC matc)
  find_library(EPOXY_LIBRARY epoxy)
  find_library(X11_LIBRARY X11)
  find_path(IMGUI_INCLUDE imgui.h PATH_SUFFIXES imgui)
  if(NOT filament_FOUND OR NOT MATC OR NOT EPOXY_LIBRARY OR NOT X11_LIBRARY OR NOT IMGUI_INCLUDE)
    message(FATAL_ERROR "Pictures need Filament 1.9.25: apt install libfilament-dev libfilament-tools libegl-dev libepoxy-dev libimgui-dev libx11-dev, "
                        "or configure with -DCATGUT_RENDER=OFF to build without pictures.")
  endif()
  file(GLOB filament_sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/src/render/filament/*.cpp)
  file(GLOB materials CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/src/render/filament/materials/*.mat)
  set(material_folder ${PROJECT_BINARY_DIR}/render_materials)
  file(MAKE_DIRECTORY ${material_folder})
  foreach(material ${materials})
    get_filename_component(stem ${material} NAME_WE)
    add_custom_command(
      OUTPUT ${material_folder}/${stem}.inc
      COMMAND ${MATC} -p desktop -a opengl -V skinning,dynamicLighting,fog -f header -o ${material_folder}/${stem}.inc ${material}
      DEPENDS ${material}
      COMMENT "Compiling material ${stem}")
    list(APPEND material_incs ${material_folder}/${stem}.inc)
  endforeach()
  target_sources(catgut_render PRIVATE ${filament_sources} ${material_incs})
  set_source_files_properties(${PROJECT_SOURCE_DIR}/src/render/filament/materials.cpp PROPERTIES OBJECT_DEPENDS "${material_incs}")
  target_compile_definitions(catgut_render PRIVATE CATGUT_WITH_FILAMENT)
  # SYSTEM: Filament's headers warn about what C++17 deprecated.
  get_target_property(filament_include filament::filament INTERFACE_INCLUDE_DIRECTORIES)
  target_include_directories(catgut_render SYSTEM PRIVATE ${filament_include})
  target_include_directories(catgut_render PRIVATE ${material_folder})
  target_link_libraries(catgut_render PRIVATE filament::filament filament::backend filament::utils ${EPOXY_LIBRARY} ${X11_LIBRARY})
  # Panels: filagui contains a complete Dear ImGui. Code that draws panels links it, not the distribution's second copy.
  get_target_property(FILAGUI_LIBRARY filament::filagui IMPORTED_LOCATION_NONE)
  add_library(catgut_panels INTERFACE)
  target_include_directories(catgut_panels SYSTEM INTERFACE ${IMGUI_INCLUDE})
  target_link_libraries(catgut_panels INTERFACE ${FILAGUI_LIBRARY})
  target_link_libraries(catgut_render PRIVATE catgut_panels)
endif()
