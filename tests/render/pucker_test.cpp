// SPDX-License-Identifier: Apache-2.0
// tests/render: folds of a gathered opening. No graphics driver is needed.
#include "render/pucker.h"

#include <gtest/gtest.h>

#include <cmath>

#include "scene.h"

namespace catgut {
namespace {

TEST(Pucker, KnowsTheWayRoundAnOrgan) {
  const TestField field = make_test_field();
  const VisibleMesh& mesh = field.model.body[0];
  const RoundOrgan round = round_organ(mesh);
  ASSERT_EQ(round.next.size(), mesh.position.size());
  EXPECT_NEAR(round.length, 2 * kPi * 0.020f, 0.02f * 2 * kPi * 0.020f);
  size_t with_next = 0;
  for (size_t v = 0; v < mesh.position.size(); ++v) {
    const Vec3 p = mesh.position[v], radial = normalized(Vec3{p.x, 0, p.z});
    EXPECT_GT(dot(round.outward[v], radial), 0.9f);  // away from the lumen on both sides and on the cut
    if (round.next[v] == RoundOrgan::kNone) continue;
    ++with_next;
    EXPECT_NEAR(mesh.position[round.next[v]].y, p.y, 1e-4f);
  }
  EXPECT_GT(with_next, mesh.position.size() * 9 / 10);
}

// The folded wall is as long as the wall at rest, up to the share that the fold may take.
TEST(Pucker, FoldsTakeUpTheLengthThatTheOpeningLost) {
  const float round = 0.126f;
  std::vector<Gather> gather;
  for (int i = 0; i < 24; ++i) gather.push_back({float(i) / 24, float(i + 1) / 24, i % 2 == 0});
  for (const float ratio : {0.9f, 0.8f, 0.7f}) {
    double length = 0;
    constexpr int n = 24 * 200;
    float before = fold_at(gather, 0, ratio, round).out;
    for (int i = 1; i <= n; ++i) {
      const float out = fold_at(gather, float(i) / n, ratio, round).out;
      length += std::hypot(double(out - before), double(ratio * round / n));
      before = out;
    }
    EXPECT_GT(length, double(ratio * round) * (1 + 0.4 * (1 / double(ratio) - 1))) << ratio;
    EXPECT_LT(length, 1.02 * double(round)) << ratio;
  }
  EXPECT_EQ(fold_at(gather, 0.3f, 1.0f, round).out, 0);
  EXPECT_EQ(fold_at({}, 0.3f, 0.5f, round).out, 0);
  // Out where the thread is in the wall, in where it runs over it; none at a suture point.
  EXPECT_GT(fold_at(gather, 0.5f / 24, 0.5f, round).out, 0.0005f);
  EXPECT_LT(fold_at(gather, 1.5f / 24, 0.5f, round).out, -0.0005f);
  EXPECT_NEAR(fold_at(gather, 1.0f / 24, 0.5f, round).out, 0, 1e-5f);
}

TEST(Pucker, ContinuesAcrossTheSeam) {
  const std::vector<Gather> gather{{0.95f, 1.05f, true}};
  EXPECT_GT(fold_at(gather, 0.02f, 0.5f, 0.126f).out, 0.0002f);
  EXPECT_GT(fold_at(gather, 0.98f, 0.5f, 0.126f).out, 0.0002f);
  EXPECT_EQ(fold_at(gather, 0.2f, 0.5f, 0.126f).out, 0);
}

}  // namespace
}  // namespace catgut
