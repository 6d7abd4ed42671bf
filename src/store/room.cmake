# SPDX-License-Identifier: Apache-2.0
# SOCI: one interface to SQLite and PostgreSQL. Debian's package has no CMake configuration.
find_path(SOCI_INCLUDE soci/soci.h)
foreach(part core sqlite3 postgresql)
  find_library(SOCI_${part} soci_${part})
endforeach()
find_path(PQ_INCLUDE libpq-fe.h PATH_SUFFIXES postgresql)
if(NOT SOCI_INCLUDE OR NOT SOCI_core OR NOT SOCI_sqlite3 OR NOT SOCI_postgresql OR NOT PQ_INCLUDE)
  message(FATAL_ERROR "The session store needs SOCI: apt install libsoci-dev libsqlite3-dev libpq-dev, or configure with -DCATGUT_STORE=OFF.")
endif()
target_include_directories(catgut_store SYSTEM PRIVATE ${SOCI_INCLUDE} ${PQ_INCLUDE})
target_link_libraries(catgut_store PRIVATE ${SOCI_sqlite3} ${SOCI_postgresql} ${SOCI_core} fmt::fmt)
target_compile_definitions(catgut_store PRIVATE CATGUT_VERSION="${PROJECT_VERSION}")
target_compile_options(catgut_store PRIVATE -O1)  # the disk dominates
target_compile_options(catgut_store PRIVATE -fno-sanitize=vptr)  # SOCI exports no type information, which this check of UBSan needs
