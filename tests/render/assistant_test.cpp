// SPDX-License-Identifier: Apache-2.0
// tests/render: the assistant's scissors are at a cut that is seen, for a second, and nowhere else.
#include <gtest/gtest.h>

#include "render/assistant.h"

namespace catgut {
namespace {

Snapshot thread_of(size_t nodes) {
  Snapshot seen;
  SutureView& s = seen.active();
  for (uint32_t i = 0; i < nodes; ++i) {
    seen.particle.push_back({0.01f * static_cast<float>(i), 0.02f, 0});
    s.thread_order.push_back(i);
  }
  s.thread_cut.assign(nodes - 1, 0);
  return seen;
}

TEST(AssistantsScissors, AreAtTheCutForASecond) {
  const PictureModel model;
  CutWatch watch;
  Snapshot seen = thread_of(8);
  seen.tick = 10, seen.time_s = 1;
  EXPECT_FALSE(assistants_scissors(watch, model, seen));
  seen.active().thread_cut[3] = 1;
  seen.tick = 16, seen.time_s = 1.1;
  const auto at = assistants_scissors(watch, model, seen);
  ASSERT_TRUE(at);
  EXPECT_LT(distance(at->pose.p, {0.035f, 0.02f, 0}), 1e-5f);
  // The thread lies between the blades: across their shaft, and across the direction in which they close.
  EXPECT_NEAR(rotate(at->pose.q, {1, 0, 0}).x, 0, 1e-4f);
  EXPECT_GT(rotate(at->pose.q, {0, 0, 1}).y, 0.5f) << "held from above";
  seen.tick = 40, seen.time_s = 1.5;
  EXPECT_TRUE(assistants_scissors(watch, model, seen));
  seen.tick = 60, seen.time_s = 1.9;
  const auto later = assistants_scissors(watch, model, seen);
  ASSERT_TRUE(later);
  EXPECT_LT(later->jaw, at->jaw);
  EXPECT_GT(distance(later->pose.p, at->pose.p), 0.03f) << "withdrawn";
  seen.tick = 80, seen.time_s = 2.3;
  EXPECT_FALSE(assistants_scissors(watch, model, seen));
}

TEST(AssistantsScissors, KnowNoCutBeforeTheFirstPictureAndNoneWithScissorsOfTheScene) {
  PictureModel model;
  CutWatch watch;
  Snapshot seen = thread_of(8);
  seen.active().thread_cut[2] = 1;
  EXPECT_FALSE(assistants_scissors(watch, model, seen));
  seen.tick = 5, seen.time_s = 0.1;
  EXPECT_FALSE(assistants_scissors(watch, model, seen));
  seen.active().thread_cut[5] = 1;
  EXPECT_TRUE(assistants_scissors(watch, model, seen));
  seen.tick = 1, seen.time_s = 0.02;  // a recording was rewound
  EXPECT_FALSE(assistants_scissors(watch, model, seen));
  model.instrument.emplace_back().kind = "scissors";
  CutWatch other;
  Snapshot next = thread_of(8);
  EXPECT_FALSE(assistants_scissors(other, model, next));
  next.tick = 3, next.active().thread_cut[1] = 1;
  EXPECT_FALSE(assistants_scissors(other, model, next));
}

}  // namespace
}  // namespace catgut
