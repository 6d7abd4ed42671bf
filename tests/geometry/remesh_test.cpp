// SPDX-License-Identifier: Apache-2.0
#include "geometry/remesh.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <set>

#include "core/check.h"
#include "core/random.h"
#include "geometry/closest.h"
#include "geometry/mesh_io.h"
#include "geometry/polygon.h"
#include "geometry/topology.h"

namespace catgut {
namespace {

// A tube or (closed) an ellipsoid of rings, unevenly sampled on purpose.
TriangleMesh rings(int along, int round, bool closed) {
  TriangleMesh m;
  for (int i = 0; i < along; ++i) {
    float t = static_cast<float>(i) / static_cast<float>(along - 1);
    t = t * (0.6f + 0.4f * t);  // crowded at one end
    for (int j = 0; j < round; ++j) {
      const float a = 2 * kPi * static_cast<float>(j) / static_cast<float>(round);
      const float r = closed ? 0.03f * std::sin(kPi * (0.04f + 0.92f * t)) : 0.02f;
      m.position.push_back(
          {r * std::cos(a), closed ? 0.03f * std::cos(kPi * (0.04f + 0.92f * t)) : -0.07f * t, r * std::sin(a)});
    }
  }
  const auto at = [&](int i, int j) { return static_cast<uint32_t>(i * round + j % round); };
  for (int i = 0; i + 1 < along; ++i) {
    for (int j = 0; j < round; ++j) {
      m.triangle.push_back({at(i, j), at(i + 1, j + 1), at(i + 1, j)});
      m.triangle.push_back({at(i, j), at(i, j + 1), at(i + 1, j + 1)});
    }
  }
  if (closed) {
    for (const int i : {0, along - 1}) {
      const uint32_t top = static_cast<uint32_t>(m.position.size());
      m.position.push_back({0, i == 0 ? 0.03f : -0.03f, 0});
      for (int j = 0; j < round; ++j) {
        if (i == 0) m.triangle.push_back({top, at(i, j + 1), at(i, j)});
        else m.triangle.push_back({top, at(i, j), at(i, j + 1)});
      }
    }
  }
  return m;
}

std::vector<Vec3> points(const TriangleMesh& m, const std::vector<uint32_t>& loop) {
  std::vector<Vec3> p;
  for (uint32_t v : loop) p.push_back(m.position[v]);
  return p;
}

void expect_good(const TriangleMesh& from, const TriangleMesh& to, size_t vertices, float least_angle) {
  ASSERT_EQ(to.position.size(), vertices);
  std::set<std::pair<uint32_t, uint32_t>> seen;
  for (const Triangle& t : to.triangle) {
    for (int k = 0; k < 3; ++k) ASSERT_TRUE(seen.insert({t[k], t[(k + 1) % 3]}).second);
  }
  const SurfaceTree tree(from);
  for (const Vec3 p : to.position) ASSERT_LT(tree.nearest(p).distance2, 1e-12f);
  const MeshQuality q = mesh_quality(to);
  std::printf("%zu vertices: least angle %.1f, mean least %.1f degrees, edges %.2f mean %.2f .. %.2f mm\n", vertices,
              q.least_angle, q.mean_least_angle, 1e3 * q.shortest, 1e3 * q.mean, 1e3 * q.longest);
  EXPECT_GT(q.least_angle, least_angle);
  EXPECT_GT(q.mean_least_angle, 45);
  EXPECT_NEAR(surface_area(to), surface_area(from), 0.05 * surface_area(from));
  const auto a = boundary_loops(from.triangle), b = boundary_loops(to.triangle);
  ASSERT_EQ(a.size(), b.size());
  float total_from = 0, total_to = 0;
  for (const auto& loop : a) total_from += loop_length(points(from, loop));
  for (const auto& loop : b) {
    const auto p = points(to, loop);
    total_to += loop_length(p);
    float low = 1, high = 0;
    for (size_t i = 0; i < p.size(); ++i) {
      low = std::min(low, distance(p[i], p[(i + 1) % p.size()]));
      high = std::max(high, distance(p[i], p[(i + 1) % p.size()]));
    }
    EXPECT_LT(high, 1.2f * low);
  }
  EXPECT_NEAR(total_to, total_from, 0.02 * total_from);
}

TEST(Remesh, ReachesTheCountFromBothSides) {
  const TriangleMesh tube = rings(21, 40, false);
  for (const size_t n : {150u, 592u, 614u, 840u, 2027u}) expect_good(tube, remesh(tube, n, "tube"), n, 25);
}

TEST(Remesh, ClosedSurfaceStaysClosed) {
  const TriangleMesh egg = rings(24, 36, true);
  ASSERT_GT(enclosed_volume(egg), 0);
  for (const size_t n : {200u, 1001u}) {
    const TriangleMesh out = remesh(egg, n, "egg");
    expect_good(egg, out, n, 25);
    EXPECT_EQ(out.triangle.size(), 2 * n - 4);  // Euler: still a sphere
    EXPECT_NEAR(enclosed_volume(out), enclosed_volume(egg), 0.06 * enclosed_volume(egg));
  }
}

TEST(Remesh, SameInputSameBits) {
  const TriangleMesh tube = rings(15, 30, false);
  const TriangleMesh a = remesh(tube, 300, "tube"), b = remesh(tube, 300, "tube");
  EXPECT_EQ(a.triangle, b.triangle);
  EXPECT_TRUE(std::equal(a.position.begin(), a.position.end(), b.position.begin()));
}

TEST(Remesh, RefusesTooFew) { EXPECT_THROW(remesh(rings(15, 30, false), 6, "tube"), InputError); }

TEST(Closest, AgreesWithTryingEverything) {
  const TriangleMesh m = rings(12, 17, true);
  const SurfaceTree tree(m);
  Random random(3);
  for (int k = 0; k < 300; ++k) {
    const Vec3 p = Vec3{random.uniform() - 0.5f, random.uniform() - 0.5f, random.uniform() - 0.5f} * 0.1f;
    float best = 1;
    for (const Triangle& t : m.triangle) {
      best = std::min(best, length2(p - closest_on_triangle(p, m.position[t[0]], m.position[t[1]], m.position[t[2]]).point));
    }
    EXPECT_EQ(tree.nearest(p).distance2, best);
  }
}

TEST(Remesh, RealOrgan) {
  const std::string path = std::string(CATGUT_SOURCE_DIR) + "/../shared/organs/large_intestine_female.glb";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no organ file at " << path;
  // The file contains outside and lumen as two shells; the outer one is used. The rectum is a blind pouch, the sigmoid a tube.
  const auto rims = [](const TriangleMesh& mesh) {
    std::vector<float> mm;
    for (const auto& loop : boundary_loops(mesh.triangle)) mm.push_back(1e3f * loop_length(points(mesh, loop)));
    std::sort(mm.begin(), mm.end());
    return mm;
  };
  const TriangleMesh rectum = read_mesh(path, "VH_F_rectum");
  EXPECT_EQ(rectum.position.size(), 507u);
  ASSERT_EQ(rims(rectum).size(), 1u);
  EXPECT_NEAR(rims(rectum)[0], 128.2, 0.1);
  const TriangleMesh sigmoid = read_mesh(path, "VH_F_sigmoid_colon");
  ASSERT_EQ(rims(sigmoid).size(), 2u);
  EXPECT_NEAR(rims(sigmoid)[0], 128.2, 0.1);
  EXPECT_NEAR(rims(sigmoid)[1], 138.2, 0.1);
  for (const size_t n : {592u, 614u, 2027u}) expect_good(rectum, remesh(rectum, n, "rectum"), n, 10);
  expect_good(sigmoid, remesh(sigmoid, 614, "sigmoid"), 614, 10);
}

}  // namespace
}  // namespace catgut
