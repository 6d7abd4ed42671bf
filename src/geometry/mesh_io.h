// SPDX-License-Identifier: Apache-2.0
// geometry/mesh_io: reads a surface from a mesh file and reports what is unusable.
#pragma once
#include <string>
#include <utility>

#include "geometry/mesh.h"

namespace catgut {

// "path#node" -> {path, node}; without '#' the node is empty. The last '#' counts.
std::pair<std::string, std::string> split_mesh_path(const std::string& mesh);

// The triangles of one node of a glTF, GLB, OBJ or STL file, in meters and the file's frame (the node's transform applied; a
// group node gives all of its children), cleaned as in mesh_clean: equal positions welded, one connected
// manifold piece (the outer one where the file contains both sides of a wall), all triangles oriented outward. node
// may be empty when the file has only one. Throws InputError: file missing or unreadable, kind of file unknown, node missing or
// not chosen (the message lists them), no triangles, no area, a size that is not meters (bounding box diagonal outside 5 mm ..
// 2 m; the message guesses the unit), and everything clean_mesh refuses.
TriangleMesh read_mesh(const std::string& path, const std::string& node);

}  // namespace catgut
