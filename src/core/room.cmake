# SPDX-License-Identifier: Apache-2.0
# The last search path of core/data: an installed prefix, never the source folder.
set_source_files_properties(${PROJECT_SOURCE_DIR}/src/core/data.cpp PROPERTIES
  COMPILE_DEFINITIONS "CATGUT_INSTALLED_SHARE=\"${CMAKE_INSTALL_FULL_DATADIR}\"")
