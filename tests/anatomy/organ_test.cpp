// SPDX-License-Identifier: Apache-2.0
#include "anatomy/organ.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <numeric>

#include "anatomy/wall.h"
#include "body_checks.h"
#include "core/check.h"
#include "geometry/polygon.h"

namespace catgut {
namespace {

// A bent tube with (near and far) open ends or a closed egg, written as OBJ.
std::string write_obj(const std::string& name, bool open_near, bool open_far) {
  const auto folder = std::filesystem::path(CATGUT_BINARY_DIR) / "test_meshes";
  std::filesystem::create_directories(folder);
  const std::string path = (folder / name).string();
  std::ofstream out(path);
  constexpr int along = 24, round = 32;
  for (int i = 0; i < along; ++i) {
    const double t = i / double(along - 1);
    double r = 0.02 + 0.003 * t;
    if (!open_near) r *= std::sqrt(std::min(1.0, (t + 0.01) * 4));
    if (!open_far) r *= std::sqrt(std::min(1.0, (1.01 - t) * 4));
    for (int j = 0; j < round; ++j) {
      const double a = 2 * 3.14159265358979 * j / round;
      out << "v " << r * std::cos(a) + 0.03 * t * t << " " << 0.09 * t << " " << r * std::sin(a) << "\n";
    }
  }
  for (int i = 0; i + 1 < along; ++i) {
    for (int j = 0; j < round; ++j) {
      const int a = 1 + i * round + j, b = 1 + i * round + (j + 1) % round;
      out << "f " << a << " " << b << " " << b + round << " " << a + round << "\n";
    }
  }
  int top = along * round;
  for (const bool far : {false, true}) {
    if (far ? open_far : open_near) continue;
    out << "v " << (far ? 0.03 : 0.0) << " " << (far ? 0.0915 : -0.0015) << " 0\n";
    ++top;
    const int base = far ? 1 + (along - 1) * round : 1;
    for (int j = 0; j < round; ++j) out << "f " << top << " " << base + j << " " << base + (j + 1) % round << "\n";
  }
  return path;
}

OrganImport organ(const std::string& mesh, int particles) {
  OrganImport o;
  o.mesh = mesh;
  o.particles = particles;
  o.position = {0.01f, 0.05f, -0.02f};
  o.axis = {0.2f, 1, 0.3f};
  return o;
}

size_t held(const BodyRest& body) { return static_cast<size_t>(std::accumulate(body.pinned.begin(), body.pinned.end(), 0)); }

void expect_placed(const BodyRest& body, const OrganImport& o) {
  const auto loop = points(body, body.rim[0].outer);
  EXPECT_LT(distance(loop_center(loop), o.position), 0.001f);
  EXPECT_GT(dot(loop_normal(loop), normalized(o.axis)), 0.99f);
  for (const uint32_t v : body.rim[0].outer) EXPECT_FALSE(body.pinned[v]);
}

TEST(Organ, TubeKeepsBothRims) {
  const std::string path = write_obj("bent.obj", true, true);
  for (const int n : {401, 1185, 1228, 4054}) {
    SCOPED_TRACE(n);
    const OrganImport o = organ(path, n);
    const BodyRest body = import_organ(o);
    expect_sound(body, static_cast<size_t>(n));
    EXPECT_EQ(euler_characteristic(body.surface), 0);
    ASSERT_EQ(body.rim.size(), 2u);
    EXPECT_NEAR(loop_length(points(body, body.rim[0].outer)), 2 * kPi * 0.023f, 0.003f);  // the longest
    expect_placed(body, o);
    EXPECT_GT(held(body), 10u);
    EXPECT_LT(held(body), body.position.size() / 3);
    for (const uint32_t v : body.rim[1].outer) EXPECT_TRUE(body.pinned[v]);
  }
}

TEST(Organ, TextureHasNoTornTriangles) {
  const BodyRest body = import_organ(organ(write_obj("bent.obj", true, true), 1228));
  for (const Triangle& t : body.visible.triangle) {
    for (int k = 0; k < 3; ++k) {
      const auto &a = body.visible.uv[t[k]], &b = body.visible.uv[t[(k + 1) % 3]];
      ASSERT_LT(std::abs(a[0] - b[0]), 0.3f);
      ASSERT_LT(std::abs(a[1] - b[1]), 0.6f);
    }
  }
}

TEST(Organ, RimIsChosenByIndex) {
  OrganImport o = organ(write_obj("bent.obj", true, true), 600);
  o.rim = 1;
  const BodyRest body = import_organ(o);
  EXPECT_NEAR(loop_length(points(body, body.rim[0].outer)), 2 * kPi * 0.02f, 0.003f);
  expect_placed(body, o);
  o.rim = 2;
  try {
    import_organ(o);
    FAIL();
  } catch (const InputError& e) { EXPECT_NE(std::string(e.what()).find("choose 0 to 1"), std::string::npos) << e.what(); }
}

TEST(Organ, PouchIsHeldAtItsBottom) {
  const OrganImport o = organ(write_obj("pouch.obj", false, true), 1185);
  const BodyRest body = import_organ(o);
  expect_sound(body, 1185);
  ASSERT_EQ(body.rim.size(), 1u);
  EXPECT_EQ(euler_characteristic(body.surface), 2);
  expect_placed(body, o);
  EXPECT_GT(held(body), 4u);
  EXPECT_TRUE(body.pinned.back());  // the odd one
}

TEST(Organ, ClosedSurfaceHasNoRim) {
  const BodyRest body = import_organ(organ(write_obj("egg.obj", false, false), 800));
  expect_sound(body, 800);
  EXPECT_TRUE(body.rim.empty());
  EXPECT_EQ(euler_characteristic(body.surface), 4);  // two spheres
  EXPECT_GT(held(body), 0u);
}

TEST(Organ, RefusesAWallThatDoesNotFit) {
  OrganImport o = organ(write_obj("bent.obj", true, true), 600);
  o.wall = 0.03f;
  EXPECT_THROW(import_organ(o), InputError);
  o = organ("", 600);
  EXPECT_THROW(import_organ(o), InputError);
}

TEST(Organ, RealColon) {
  const std::string path = std::string(CATGUT_SOURCE_DIR) + "/../shared/organs/large_intestine_female.glb";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no organ file at " << path;
  for (const std::string node : {"VH_F_rectum", "VH_F_sigmoid_colon", "VH_F_hepatic_flexure_of_colon"}) {
    SCOPED_TRACE(node);
    const OrganImport o = organ(path + "#" + node, 1228);
    const BodyRest body = import_organ(o);
    expect_sound(body, 1228);
    ASSERT_EQ(body.rim.size(), node == "VH_F_rectum" ? 1u : 2u);
    expect_placed(body, o);
    const auto loop = points(body, body.rim[0].outer);
    std::printf("%s: rim %.1f mm of %zu, wall %.1f cm^3, %zu held, %zu visible\n", node.c_str(), 1e3 * loop_length(loop),
                loop.size(), 1e6 * total_tet_volume(body), held(body), body.visible.position.size());
  }
}

// A V with a wall of 2.5 mm on its concave side: the wall is thin in the bend, full a few millimeters away, and never
// inverted.
TEST(Wall, ThinsInASharpBendInsteadOfRefusing) {
  TriangleMesh sheet;
  constexpr int kAcross = 31, kRows = 12;
  for (int j = 0; j < kRows; ++j)
    for (int i = 0; i < kAcross; ++i) {
      const float x = 0.0007f * static_cast<float>(i - kAcross / 2);
      sheet.position.push_back({x, 0.001f * static_cast<float>(j), 0.002f * std::exp(-x * x / (0.0019f * 0.0019f))});
    }
  for (uint32_t j = 0; j + 1 < kRows; ++j)
    for (uint32_t i = 0; i + 1 < kAcross; ++i) {
      const uint32_t a = j * kAcross + i, b = a + kAcross;
      sheet.triangle.push_back({a, a + 1, b + 1}), sheet.triangle.push_back({a, b + 1, b});
    }
  const BodyRest body = thicken(sheet, wall_directions(sheet, 0.0025f), {});
  float thinnest = 1, thickest = 0;
  for (size_t v = 0; v < sheet.position.size(); ++v) {
    const float t = distance(body.position[2 * v], body.position[2 * v + 1]);
    thinnest = std::min(thinnest, t), thickest = std::max(thickest, t);
  }
  for (const Tet& t : body.tet) EXPECT_GT(tet_volume(body.position, t), 0);
  EXPECT_LT(thinnest, 0.0020f);
  EXPECT_NEAR(thickest, 0.0025f, 1e-6f);
}

}  // namespace
}  // namespace catgut
