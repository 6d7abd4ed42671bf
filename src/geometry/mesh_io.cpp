// SPDX-License-Identifier: Apache-2.0
// geometry/mesh_io: reads surfaces through assimp. Reads files; throws InputError.
#include "geometry/mesh_io.h"

#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <assimp/DefaultIOSystem.h>
#include <algorithm>
#include <assimp/Importer.hpp>
#include <cctype>
#include <filesystem>
#include <vector>

#include "core/check.h"
#include "geometry/gltf_check.h"
#include "geometry/mesh_clean.h"

namespace catgut {

namespace {

constexpr uintmax_t kLargestMeshFile = 64u << 20;  // [byte]: a file of this size can be read within 512 MB

struct Found {
  const aiNode* node;
  aiMatrix4x4 to_scene;
};

bool has_triangles(const aiScene& scene, const aiNode& node) {
  for (unsigned i = 0; i < node.mNumMeshes; ++i) {
    if (scene.mMeshes[node.mMeshes[i]]->mPrimitiveTypes & aiPrimitiveType_TRIANGLE) return true;
  }
  return false;
}

void list_nodes(const aiNode& node, const aiMatrix4x4& parent, std::vector<Found>& out) {
  const aiMatrix4x4 here = parent * node.mTransformation;
  out.push_back({&node, here});
  for (unsigned i = 0; i < node.mNumChildren; ++i) list_nodes(*node.mChildren[i], here, out);
}

std::string names(const aiScene& scene, const std::vector<Found>& nodes) {
  std::string text;
  int shown = 0, total = 0;
  for (const Found& f : nodes) {
    if (!has_triangles(scene, *f.node)) continue;
    if (++total > 10) continue;
    text += (shown++ ? ", " : "") + std::string(f.node->mName.C_Str());
  }
  if (total > shown) text += fmt::format(" and {} more", total - shown);
  return text;
}

void append(const aiScene& scene, const Found& found, TriangleMesh& mesh) {
  for (unsigned i = 0; i < found.node->mNumMeshes; ++i) {
    const aiMesh& part = *scene.mMeshes[found.node->mMeshes[i]];
    const uint32_t first = static_cast<uint32_t>(mesh.position.size());
    for (unsigned v = 0; v < part.mNumVertices; ++v) {
      const aiVector3D p = found.to_scene * part.mVertices[v];
      mesh.position.push_back({p.x, p.y, p.z});
    }
    for (unsigned f = 0; f < part.mNumFaces; ++f) {
      const aiFace& face = part.mFaces[f];
      if (face.mNumIndices != 3) continue;  // points and lines
      mesh.triangle.push_back({first + face.mIndices[0], first + face.mIndices[1], first + face.mIndices[2]});
    }
  }
}

// A mesh file may refer to others (buffers, materials). Only regular files of its own folder are opened: no device or endless
// pipe, nothing of another folder.
class OwnFolder : public Assimp::DefaultIOSystem {
 public:
  explicit OwnFolder(const std::string& mesh) : folder_(folder(mesh)) {}
  bool Exists(const char* file) const override { return allowed(file) && DefaultIOSystem::Exists(file); }
  Assimp::IOStream* Open(const char* file, const char* mode) override {
    return allowed(file) ? DefaultIOSystem::Open(file, mode) : nullptr;
  }

 private:
  static std::filesystem::path folder(const std::string& file) {
    std::error_code ignored;
    return std::filesystem::weakly_canonical(std::filesystem::absolute(file, ignored), ignored).parent_path();
  }
  bool allowed(const char* file) const {
    std::error_code error;
    return std::filesystem::is_regular_file(file, error) && std::filesystem::file_size(file, error) <= kLargestMeshFile &&
           folder(file) == folder_;
  }
  std::filesystem::path folder_;
};

void check_size(float size, const std::string& where) {
  if (size >= 0.005f && size <= 2) return;
  const char* unit = "unknown unit: scale it to the size of the organ";
  if (size > 2 && size < 20) unit = "looks like centimeters: scale by 0.01";
  else if (size >= 20 && size <= 2000) unit = "looks like millimeters: scale by 0.001";
  else if (size > 2000 && size <= 2e6f) unit = "looks like micrometers: scale by 0.000001";
  else if (size >= 5e-6f && size < 0.005f) unit = "looks like kilometers: scale by 1000";
  throw InputError(where, fmt::format("the surface measures {:.4g} m from corner to corner; an organ has 0.005 to 2 m", size),
                   fmt::format("{} when exporting", unit));
}

}  // namespace

std::pair<std::string, std::string> split_mesh_path(const std::string& mesh) {
  const size_t at = mesh.rfind('#');
  if (at == std::string::npos) return {mesh, ""};
  return {mesh.substr(0, at), mesh.substr(at + 1)};
}

TriangleMesh read_mesh(const std::string& path, const std::string& node) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  if (!fs::is_regular_file(path, ignored)) throw InputError(path, "no such mesh file", "check the path");
  std::string kind = fs::path(path).extension().string();
  std::transform(kind.begin(), kind.end(), kind.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (kind != ".gltf" && kind != ".glb" && kind != ".obj" && kind != ".stl") {
    throw InputError(path, fmt::format("unsupported mesh format \"{}\"", kind), "export it as .glb, .gltf, .obj or .stl");
  }
  if (fs::file_size(path, ignored) > kLargestMeshFile)
    throw InputError(path, "the mesh file is larger than 64 MB", "export the organ's surface alone, with fewer triangles");
  if (kind == ".gltf" || kind == ".glb") check_gltf(path);
  Assimp::Importer importer;
  importer.SetIOHandler(new OwnFolder(path));  // the importer deletes it
  const aiScene* scene = importer.ReadFile(path, aiProcess_Triangulate);
  if (!scene || !scene->mRootNode) {
    std::string reason = importer.GetErrorString();
    std::replace(reason.begin(), reason.end(), '\n', ' ');
    throw InputError(path, "cannot be read as a mesh (" + reason + ")",
                     "check that it opens in a mesh viewer, then export it again");
  }
  std::vector<Found> nodes;
  list_nodes(*scene->mRootNode, aiMatrix4x4(), nodes);
  std::vector<Found> chosen;
  const std::string where = node.empty() ? path : path + "#" + node;
  if (node.empty()) {
    for (const Found& f : nodes) {
      if (has_triangles(*scene, *f.node)) chosen.push_back(f);
    }
    if (chosen.size() > 1) {
      throw InputError(path, fmt::format("the file has {} surfaces: {}", chosen.size(), names(*scene, nodes)),
                       "name one of them with path#node");
    }
  } else {
    const auto match = std::find_if(nodes.begin(), nodes.end(), [&](const Found& f) { return node == f.node->mName.C_Str(); });
    if (match == nodes.end()) {
      const std::string list = names(*scene, nodes);
      throw InputError(path, fmt::format("no node \"{}\"", node),
                       "choose one of: " + (list.empty() ? "(none has triangles)" : list));
    }
    // list_nodes is depth first, so a node and its subtree are contiguous in the list.
    for (auto f = match; f != nodes.end(); ++f) {
      const aiNode* up = f->node;
      while (up && up != match->node) up = up->mParent;
      if (!up) break;
      if (has_triangles(*scene, *f->node)) chosen.push_back(*f);
    }
  }
  TriangleMesh mesh;
  for (const Found& f : chosen) append(*scene, f, mesh);
  for (Vec3 p : mesh.position) {
    if (!is_finite(p)) throw InputError(where, "a vertex is not a number", "export it again");
  }
  if (mesh.triangle.empty())
    throw InputError(where, "no triangles", "export a surface mesh, not points, lines or a scene without shapes");
  if (diagonal(mesh) > 0) check_size(diagonal(mesh), where);
  return clean_mesh(mesh, where);
}

}  // namespace catgut
