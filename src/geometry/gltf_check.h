// SPDX-License-Identifier: Apache-2.0
// geometry/gltf_check: checks a glTF or GLB file before assimp reads it. A kilobyte can make assimp allocate gigabytes. Nodes
// that share children double at every level, sparse accessors declare any length, and deeply nested JSON overflows its stack.
#pragma once
#include <string>

namespace catgut {

// Throws InputError where the file is not JSON, nests deeper than 64, or is not glTF 2. Nodes must form a tree of depth 256 or
// less, with at most `kMostGltfValues` of geometry. A file that passes takes less than 512 MB and two
// seconds to read, except compressed meshes (KHR_draco_mesh_compression), whose size only their decoder knows.
void check_gltf(const std::string& path);

constexpr double kMostGltfValues = 6e6;  // vertices of all attributes, and indices, over all primitives

}  // namespace catgut
