# SPDX-License-Identifier: Apache-2.0
# Mesh files are read by assimp; only mesh_io.cpp includes it.
find_package(assimp REQUIRED)
target_link_libraries(catgut_geometry ${kind} fmt::fmt assimp::assimp)
