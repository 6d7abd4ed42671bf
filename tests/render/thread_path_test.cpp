// SPDX-License-Identifier: Apache-2.0
// tests/render: a drawn thread lies on instruments and tissue, not in them. No graphics driver is needed.
#include "render/thread_path.h"

#include <gtest/gtest.h>

#include <cmath>

#include "winding.h"

namespace catgut {
namespace {

// The instrument as drawn, in its own frame, jaws open by `jaw`.
Shape drawn(const ToolShape& tool, float jaw) {
  Shape all = tool.body;
  for (const float side : {1.0f, -1.0f}) {
    const Quat turn = axis_angle({0, 1, 0}, -side * tool.opening * jaw);
    const Pose hinge{Vec3{0, 0, tool.pivot} - rotate(turn, {0, 0, tool.pivot}), turn};
    add_shape(all, moved(side > 0 ? tool.half : mirrored_x(tool.half), hinge));
  }
  return all;
}

class Instruments : public testing::TestWithParam<const char*> {};

// Turns of thread as physics holds them: round the instrument's collision capsule, which is thinner than what is drawn.
TEST_P(Instruments, NoTurnOfThreadIsInsideTheDrawnInstrument) {
  InstrumentPicture picture;
  picture.kind = GetParam();
  const ToolShape tool = tool_shape(picture);
  const ToolHull hull = tool_hull(tool);
  int touched = 0;
  const Pose pose{{0.01f, 0.02f, -0.03f}, axis_angle(normalized(Vec3{1, 2, 3}), 0.7f)};
  for (const float jaw : {0.0f, 0.4f, 1.0f}) {
    const Shape shape = drawn(tool, jaw);
    int before = 0, after = 0;
    for (int i = 0; i < 120; ++i) {
      const float a = 2 * kPi * float(i) / 24, z = 0.003f + 0.012f * float(i) / 120;
      const Vec3 local{0.00135f * std::cos(a), 0.00135f * std::sin(a), z};
      before += winding(shape, local) > 0.5f;
      const Vec3 moved = outside_tool(hull, pose, jaw, transform(pose, local), 0.00015f);
      const Vec3 q = to_local(pose, moved);
      after += winding(shape, q) > 0.5f;
      EXPECT_LT(distance(q, local), 0.014f);  // round the open jaws of an Allis clamp
      EXPECT_NEAR(q.z, z, 1e-5f);             // across the shaft only: a turn stays where it was along it
    }
    EXPECT_EQ(after, 0) << GetParam() << ", jaws " << jaw;
    touched += before;
  }
  if (GetParam() != std::string("debakey")) {  // its tips are thinner than the capsule
    EXPECT_GT(touched, 0) << "the test's turns do not touch the instrument";
  }
}

INSTANTIATE_TEST_SUITE_P(All, Instruments, testing::Values("needle_holder", "forceps", "debakey", "allis", "scissors"));

TEST(Hull, LeavesAPointOutsideAlone) {
  InstrumentPicture picture;
  picture.kind = "needle_holder";
  const ToolHull hull = tool_hull(tool_shape(picture));
  for (const Vec3 p : {Vec3{0, 0.02f, 0.01f}, Vec3{0.03f, 0, 0.05f}, Vec3{0, 0, -0.02f}, Vec3{0, 0, 0.5f}})
    EXPECT_EQ(distance(outside_tool(hull, {}, 0.5f, p, 0.0002f), p), 0);
}

TEST(PointGridNear, FindsWhatASearchOfAllPointsFinds) {
  std::vector<Vec3> point;
  uint32_t seed = 1;
  const auto next = [&] { return float((seed = seed * 1664525u + 1013904223u) >> 8) / 16777216.0f; };
  for (int i = 0; i < 4000; ++i) point.push_back({0.1f * next() - 0.03f, 0.06f * next(), 0.002f * next()});
  PointGrid grid;
  grid.build(point, 0.004f);
  for (int i = 0; i < 200; ++i) {
    const Vec3 p{0.12f * next() - 0.04f, 0.07f * next(), 0.01f * next() - 0.004f};
    size_t want = 0, found = 0;
    for (const Vec3 q : point) want += distance(p, q) < 0.004f;
    grid.near(p, [&](uint32_t, float) { ++found; });
    EXPECT_EQ(found, want);
  }
  point = {{NAN, 0, 0}, {0, 1e30f, 0}, {0.01f, 0, 0}};
  grid.build(point, 0.004f);
  int found = 0;
  grid.near({0.011f, 0, 0}, [&](uint32_t i, float) { found += i == 2 ? 1 : 100; });
  EXPECT_EQ(found, 1);
  grid.build({}, 0.004f);
  grid.near({}, [](uint32_t, float) { FAIL(); });
}

}  // namespace
}  // namespace catgut
