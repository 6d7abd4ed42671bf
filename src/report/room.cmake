# SPDX-License-Identifier: Apache-2.0
if(NOT CATGUT_STORE)
  return()
endif()
find_package(nlohmann_json REQUIRED)
target_link_libraries(catgut_report PRIVATE fmt::fmt nlohmann_json::nlohmann_json)
target_compile_options(catgut_report PRIVATE -O1)  # parsers and pages: build time matters more than run time
# D3 draws the charts. It is taken from Debian's package and becomes part of the program, as a report must be one file.
find_file(D3_MIN_JS d3.min.js PATHS /usr/share/nodejs/d3/dist /usr/share/javascript/d3 NO_DEFAULT_PATH)
if(NOT D3_MIN_JS)
  message(FATAL_ERROR "Reports need D3: apt install node-d3, or configure with -DCATGUT_STORE=OFF.")
endif()
set(web ${PROJECT_SOURCE_DIR}/web)
set_source_files_properties(${PROJECT_SOURCE_DIR}/src/report/assets.cpp PROPERTIES
  COMPILE_DEFINITIONS "CATGUT_WEB=\"${web}\";CATGUT_D3=\"${D3_MIN_JS}\""
  OBJECT_DEPENDS "${D3_MIN_JS};${web}/style.css;${web}/charts.js;${web}/report.js;${web}/educator.js;${web}/survey.js")
