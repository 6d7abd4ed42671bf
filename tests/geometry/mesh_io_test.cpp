// SPDX-License-Identifier: Apache-2.0
#include "geometry/mesh_io.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "core/check.h"
#include "geometry/topology.h"

namespace catgut {
namespace {

std::string file(const std::string& name, const std::string& text) {
  const auto folder = std::filesystem::path(CATGUT_BINARY_DIR) / "test_meshes";
  std::filesystem::create_directories(folder);
  const std::string path = (folder / name).string();
  std::ofstream(path) << text;
  return path;
}

// An open tube along y as OBJ text, `scale` meters to about a decimeter.
std::string tube(double scale, const std::string& name = "tube", int first = 1, double shift = 0) {
  std::string text = "o " + name + "\n";
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 12; ++j) {
      const double a = 2 * 3.14159265 * j / 12;
      text += "v " + std::to_string(scale * (0.2 * std::cos(a) + shift)) + " " + std::to_string(scale * 0.15 * i) + " " +
              std::to_string(scale * 0.2 * std::sin(a)) + "\n";
    }
  }
  for (int i = 0; i < 5; ++i) {
    for (int j = 0; j < 12; ++j) {
      const int a = first + 12 * i + j, b = first + 12 * i + (j + 1) % 12;
      text += "f " + std::to_string(a) + " " + std::to_string(b) + " " + std::to_string(b + 12) + " " + std::to_string(a + 12) +
              "\n";
    }
  }
  return text;
}

std::string refusal(const std::string& path, const std::string& node = "") {
  try {
    read_mesh(path, node);
  } catch (const InputError& e) {
    EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos);
    return e.what();
  }
  return "accepted";
}
#define EXPECT_SAYS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

TEST(MeshIo, SplitsPathAndNode) {
  EXPECT_EQ(split_mesh_path("a/b.glb#colon"), (std::pair<std::string, std::string>{"a/b.glb", "colon"}));
  EXPECT_EQ(split_mesh_path("b.stl"), (std::pair<std::string, std::string>{"b.stl", ""}));
}

TEST(MeshIo, ReadsAnObjTubeFacingOutward) {
  const TriangleMesh mesh = read_mesh(file("tube.obj", tube(0.1)), "");
  EXPECT_EQ(mesh.position.size(), 72u);
  EXPECT_EQ(mesh.triangle.size(), 120u);
  EXPECT_EQ(boundary_loops(mesh.triangle).size(), 2u);
  const auto normal = vertex_normals(mesh);
  for (size_t v = 0; v < normal.size(); ++v) EXPECT_GT(dot(normal[v], Vec3{mesh.position[v].x, 0, mesh.position[v].z}), 0);
}

TEST(MeshIo, WeldsAnStl) {
  const double p[4][3] = {{0, 0, 0}, {0.1, 0, 0}, {0, 0.1, 0}, {0, 0, 0.1}};
  const int f[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 3, 0}};  // the last one has the wrong orientation
  std::string text = "solid corner\n";
  for (const auto& t : f) {
    text += "facet normal 0 0 0\nouter loop\n";
    for (int v : t)
      text += "vertex " + std::to_string(p[v][0]) + " " + std::to_string(p[v][1]) + " " + std::to_string(p[v][2]) + "\n";
    text += "endloop\nendfacet\n";
  }
  const TriangleMesh mesh = read_mesh(file("corner.stl", text + "endsolid corner\n"), "");
  EXPECT_EQ(mesh.position.size(), 4u);
  EXPECT_EQ(mesh.triangle.size(), 4u);
  EXPECT_NEAR(enclosed_volume(mesh), 0.001 / 6, 1e-9);
}

TEST(MeshIo, ChoosesANode) {
  const std::string path = file("two.obj", tube(0.1, "left") + tube(0.1, "right", 73, 1));
  EXPECT_GT(read_mesh(path, "right").position[0].x, 0.05f);
  EXPECT_SAYS(refusal(path), "left, right");
  EXPECT_SAYS(refusal(path, "middle"), "no node \"middle\"");
  EXPECT_SAYS(refusal(path, "middle"), "left, right");
}

TEST(MeshIo, SaysWhatItCannotUse) {
  EXPECT_SAYS(refusal("/no/such/organ.glb"), "no such mesh file");
  EXPECT_SAYS(refusal(file("organ.blend", "x")), ".glb, .gltf, .obj or .stl");
  EXPECT_SAYS(refusal(file("broken.glb", "this is no mesh")), "cannot be read");
  EXPECT_SAYS(refusal(file("mm.obj", tube(100))), "millimeters: scale by 0.001");
  EXPECT_SAYS(refusal(file("cm.obj", tube(10))), "centimeters: scale by 0.01");
  EXPECT_SAYS(refusal(file("km.obj", tube(0.001))), "kilometers: scale by 1000");
  EXPECT_SAYS(refusal(file("flat.obj", "v 0 0 0\nv 0.1 0 0\nv 0.2 0 0\nf 1 2 3\n")), "no area");
  EXPECT_SAYS(refusal(file("points.obj", "v 0 0 0\nv 0.1 0 0\nv 0.2 0 0\np 1 2 3\n")), "triangles");
  EXPECT_SAYS(refusal(file("fins.obj", "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nv 0 -0.1 0\nf 1 2 3\nf 1 2 4\nf 1 2 5\n")),
              "manifold");
  EXPECT_SAYS(refusal(file("pieces.obj", tube(0.1, "both") + tube(0.1, "both", 73, 1).substr(7))),
              "2 separate surfaces side by side");
}

// A kilobyte that declares gigabytes is refused before any allocation.
TEST(MeshIo, RefusesHostileGltfAtOnce) {
  const auto gltf = [&](const std::string& more) {
    return refusal(file("hostile.gltf", "{\"asset\":{\"version\":\"2.0\"}," + more + "}"));
  };
  std::string nodes = "\"scenes\":[{\"nodes\":[0]}],\"nodes\":[";
  for (int i = 1; i <= 30; ++i) nodes += "{\"children\":[" + std::to_string(i) + "," + std::to_string(i) + "]},";
  EXPECT_SAYS(gltf(nodes + "{}]"), "two share a child");
  EXPECT_SAYS(gltf("\"nodes\":[{\"children\":[1]},{\"children\":[0]}]"), "form a ring");
  std::string chain = "\"nodes\":[";
  for (int i = 1; i <= 300; ++i) chain += "{\"children\":[" + std::to_string(i) + "]},";
  EXPECT_SAYS(gltf(chain + "{}]"), "nest deeper than 256");
  EXPECT_SAYS(gltf("\"accessors\":[{\"componentType\":5126,\"count\":300000000,\"type\":\"VEC3\",\"sparse\":{\"count\":1}}],"
                   "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}]"),
              "six million");
  EXPECT_SAYS(gltf("\"extras\":" + std::string(40000, '[') + std::string(40000, ']')), "nests deeper than 64");
  EXPECT_SAYS(gltf("\"asset\":{\"version\":\"1.0\"}"), "names a member twice");
}

TEST(MeshIo, KeepsTheOutsideOfADoubleWall) {
  std::string text = tube(0.1, "wall");
  std::string inner = tube(0.09, "wall", 73).substr(7);  // a second, smaller tube inside the first
  const TriangleMesh mesh = read_mesh(file("double.obj", text + inner), "");
  EXPECT_EQ(mesh.position.size(), 72u);
  float widest = 0;
  for (const Vec3 p : mesh.position) widest = std::max(widest, p.x);
  EXPECT_NEAR(widest, 0.02f, 1e-6f);
}

TEST(MeshIo, DropsSpecks) {
  const std::string speck = "v 0.3 0 0\nv 0.301 0 0\nv 0.3 0.001 0\nf 73 74 75\n";
  EXPECT_EQ(read_mesh(file("speck.obj", tube(0.1) + speck), "").position.size(), 72u);
}

}  // namespace
}  // namespace catgut
