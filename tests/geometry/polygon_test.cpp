// SPDX-License-Identifier: Apache-2.0
#include "geometry/polygon.h"

#include <gtest/gtest.h>

#include <vector>

#include "geometry/topology.h"

namespace catgut {
namespace {

std::vector<Vec3> circle(int n, float r, Vec3 center, Vec3 axis) {
  const Vec3 e1 = any_perpendicular(axis), e2 = cross(axis, e1);
  std::vector<Vec3> loop;
  for (int i = 0; i < n; ++i) {
    const float a = 2 * kPi * static_cast<float>(i) / static_cast<float>(n);
    loop.push_back(center + e1 * (r * std::cos(a)) + e2 * (r * std::sin(a)));
  }
  return loop;
}

TEST(Polygon, CircleFarFromTheOrigin) {
  const Vec3 axis = normalized(Vec3{1, -2, 0.5f}), center{3, 1, -2};
  const auto loop = circle(200, 0.02f, center, axis);
  EXPECT_NEAR(loop_area(loop), 3.14159f * 0.0004f, 1e-6f);
  EXPECT_NEAR(loop_length(loop), 0.12566f, 1e-4f);
  EXPECT_NEAR(dot(loop_normal(loop), axis), 1, 1e-4f);
  EXPECT_LT(distance(loop_center(loop), center), 1e-6f);
}

TEST(Polygon, TooFewPointsHaveNoArea) {
  EXPECT_EQ(loop_area({}), 0);
  const std::vector<Vec3> two{{0, 0, 0}, {1, 0, 0}};
  EXPECT_EQ(loop_area(two), 0);
  EXPECT_EQ(loop_length(two), 2);
  EXPECT_EQ(loop_normal(two), Vec3{});
}

TEST(Topology, RimsRunCounterClockwiseSeenFromTheirOpening) {
  // Four side faces of a box, open at top and bottom (y), counter-clockwise seen from outside.
  TriangleMesh box;
  for (const float y : {1.0f, 0.0f}) { box.position.insert(box.position.end(), {{0, y, 1}, {1, y, 1}, {1, y, 0}, {0, y, 0}}); }
  for (uint32_t i = 0; i < 4; ++i) {
    const uint32_t j = (i + 1) % 4;
    box.triangle.push_back({i, i + 4, j + 4});
    box.triangle.push_back({i, j + 4, j});
  }
  const auto loops = boundary_loops(box.triangle);
  ASSERT_EQ(loops.size(), 2u);
  for (const float up : {1.0f, -1.0f}) {
    std::vector<Vec3> p;
    for (uint32_t v : loops[up > 0 ? 0 : 1]) p.push_back(box.position[v]);
    EXPECT_EQ(p.size(), 4u);
    EXPECT_NEAR(loop_normal(p).y, up, 1e-6f);
  }
  EXPECT_EQ(vertex_neighbors(box.triangle, 8)[0], (std::vector<uint32_t>{1, 3, 4, 5}));
}

}  // namespace
}  // namespace catgut
