// SPDX-License-Identifier: Apache-2.0
// tests/suture: jaws that hold needle or thread, at the grasped position and angle.
#include <gtest/gtest.h>

#include "rig.h"

namespace catgut {
namespace {

struct Hands : Rig {
  using Rig::Rig;
  // A tool frame at place `at` (0 swage .. 1 tip) of the needle, turned by `turn`.
  Pose at_needle(float at, Quat turn) { return {needle_point(model->solver.needle_arc[0], needle(), at * kPi), turn}; }
  void show(size_t hand, const Pose& pose, float jaw) {
    input.hand[hand].connected = 1;
    input.hand[hand].pose = pose;
    input.hand[hand].jaw = jaw;
    tick();
  }
  void close(size_t hand) {
    for (float jaw : {0.6f, 0.3f, 0.0f}) input.hand[hand].jaw = jaw, tick();
  }
  void open(size_t hand) {
    for (float jaw : {0.3f, 0.6f, 1.0f}) input.hand[hand].jaw = jaw, tick();
  }
  Pose relative(size_t hand) { return inverse(solver().body[hand].pose()) * needle().pose(); }
};

void expect_same(const Pose& a, const Pose& b) {
  EXPECT_LT(distance(a.p, b.p), 0.0001f);
  EXPECT_LT(length(rotation_vector(a.q * conjugate(b.q))), 0.5f * kPi / 180);
}

TEST(Grasp, holds_the_needle_where_and_at_the_angle_it_was_caught) {
  for (const float at : {0.15f, 0.4f, 0.9f}) {
    Hands r;
    r.wait(0.3f);
    r.show(0, r.at_needle(at, axis_angle(normalized(Vec3{1, 2, 3}), 0.7f + at)), 1);
    EXPECT_EQ(r.suture().instrument[0].held, Held::nothing) << "an open jaw holds nothing";
    r.close(0);
    ASSERT_EQ(r.count(EventKind::needle_grasped), 1u);
    EXPECT_EQ(r.suture().instrument[0].held, Held::needle);
    EXPECT_NEAR(r.suture().instrument[0].at, at, 0.02f);
    const Pose caught = r.relative(0);
    // Gently up, about and round: 5 cm/s, 0.6 rad/s.
    const Pose start = r.input.hand[0].pose;
    for (int i = 0; i < 120; ++i) {
      const float t = static_cast<float>(i) / 60;
      r.input.hand[0].pose = {start.p + Vec3{0.02f * std::sin(t), 0.04f * t, 0.02f * (1 - std::cos(t))},
                              normalized(axis_angle({0, 1, 0}, 0.5f * std::sin(t)) * start.q)};
      r.tick();
      if (HasFatalFailure()) return;
      expect_same(r.relative(0), caught);
    }
    EXPECT_LT(distance(r.solver().body[0].x, r.input.hand[0].pose.p), 0.001f);
  }
}

TEST(Grasp, opening_drops_the_needle) {
  Hands r;
  r.wait(0.3f);
  r.show(0, r.at_needle(0.5f, {}), 1);
  r.close(0);
  const Pose start = r.input.hand[0].pose;
  for (int i = 1; i <= 30; ++i) r.input.hand[0].pose.p = start.p + Vec3{0, 0.001f * static_cast<float>(i), 0}, r.tick();
  const float up = r.needle().x.y;
  r.open(0);
  EXPECT_EQ(r.count(EventKind::needle_released), 1u);
  EXPECT_EQ(r.suture().instrument[0].held, Held::nothing);
  EXPECT_EQ(r.solver().weld.size(), 2u) << "only the two hands' own";
  // The jaw opens and the needle falls back to the drape.
  for (int i = 1; i <= 20; ++i) r.input.hand[0].pose.p.z += 0.002f, r.tick();
  r.wait(1.0f);
  EXPECT_LT(r.needle().x.y, up - 0.02f);
  EXPECT_GT(r.needle().x.y, r.model->solver.ground - 0.001f) << "not through the drape";
}

TEST(Grasp, a_jaw_out_of_reach_catches_nothing) {
  Hands r;
  r.wait(0.2f);
  Pose pose = r.at_needle(0.5f, {});
  pose.p.y += 0.006f;
  r.show(0, pose, 1);
  r.close(0);
  EXPECT_EQ(r.suture().instrument[0].held, Held::nothing);
  // A closed jaw grasps nothing when moved onto the needle.
  r.input.hand[0].pose.p.y -= 0.006f;
  r.wait(0.2f);
  EXPECT_EQ(r.suture().instrument[0].held, Held::nothing);
}

TEST(Grasp, both_tools_hold_the_needle_while_it_is_handed_over) {
  Hands r;
  r.wait(0.3f);
  r.show(0, r.at_needle(0.3f, {}), 1);
  r.close(0);
  const Pose start = r.input.hand[0].pose;
  for (int i = 1; i <= 60; ++i) r.input.hand[0].pose.p = start.p + Vec3{0, 0.0008f * static_cast<float>(i), 0}, r.tick();
  r.show(1, r.at_needle(0.9f, axis_angle({0, 0, 1}, 0.5f)), 1);
  r.close(1);
  EXPECT_EQ(r.suture().instrument[0].held, Held::needle);
  EXPECT_EQ(r.suture().instrument[1].held, Held::needle);
  EXPECT_EQ(r.solver().weld.size(), 4u);
  const Pose first = r.relative(0), second = r.relative(1);
  r.wait(0.3f);
  expect_same(r.relative(0), first);
  expect_same(r.relative(1), second);
  r.open(0);
  EXPECT_EQ(r.suture().instrument[0].held, Held::nothing);
  EXPECT_EQ(r.suture().instrument[1].held, Held::needle);
  r.input.hand[0].pose.p.y += 0.03f;
  r.wait(0.5f);
  expect_same(r.relative(1), second);
  r.open(1);
  EXPECT_EQ(r.solver().weld.size(), 2u);
}

TEST(Grasp, holds_and_releases_the_nearest_thread) {
  Hands r;
  r.wait(0.3f);
  const size_t node = 60;
  const uint32_t slot = r.thread().order[node];
  const Vec3 at = xyz(r.solver().x[slot]);
  r.show(1, {at + Vec3{0, 0.0005f, 0}, {}}, 1);
  r.close(1);
  ASSERT_EQ(r.count(EventKind::thread_grasped), 1u);
  EXPECT_EQ(r.suture().instrument[1].held, Held::thread);
  const uint32_t held = r.suture().instrument[1].slot;
  EXPECT_LE(distance(xyz(r.solver().x[held]), r.solver().body[1].x),
            distance(xyz(r.solver().x[slot]), r.solver().body[1].x) + 1e-4f);
  // Paper 2.3: particles in a jaw, and three neighbors a side, do not collide.
  const size_t n = r.node_of(held);
  for (size_t i = n - 3; i <= n + 3; ++i)
    EXPECT_EQ(r.collides()[r.thread().order[i] - r.model->solver.strand[0].first_slot], 0);
  for (int i = 1; i <= 60; ++i) {
    r.input.hand[1].pose.p.y += 0.0006f;
    r.tick();
    EXPECT_LT(distance(xyz(r.solver().x[held]), r.solver().body[1].x), 0.003f);
  }
  EXPECT_GT(xyz(r.solver().x[held]).y, at.y + 0.03f);
  r.open(1);
  EXPECT_EQ(r.count(EventKind::thread_released), 1u);
  EXPECT_EQ(r.thread().hold.size(), 1u);
  EXPECT_EQ(r.collides()[held - r.model->solver.strand[0].first_slot], 1);
  // The jaw opens; thread is light and heavily damped, but it sinks.
  const float high = xyz(r.solver().x[held]).y;
  for (int i = 0; i < 20; ++i) r.input.hand[1].pose.p.z += 0.002f, r.tick();
  r.wait(1.0f);
  EXPECT_LT(xyz(r.solver().x[held]).y, high - 0.01f);
}

// The tail can be pulled too: thread passes the other way, toward the free end.
TEST(Grasp, pulling_the_tail_passes_thread_toward_the_free_end) {
  Hands r;
  r.wait(0.2f);
  const Place p = r.place(0.4f);
  r.whole_bite(p);
  r.draw(p, 0.08f, 1.0f);
  const size_t first = r.node_of_point(0);
  ASSERT_GT(first, 30u);
  const uint32_t slot = r.thread().order[first - 12];
  r.show(0, {xyz(r.solver().x[slot]), {}}, 1);
  r.close(0);
  ASSERT_EQ(r.suture().instrument[0].held, Held::thread);
  const size_t before = r.node_of_point(0);
  const Vec3 way = normalized(p.out + 0.5f * p.up - 0.5f * p.along);
  // The needle's end moves by as much as the tail is pulled.
  Pose needle = r.circle();
  for (int i = 0; i < 120; ++i) {
    r.input.hand[0].pose.p += way * 0.0003f;
    needle.p -= normalized(p.out + 0.4f * p.up) * 0.0003f;
    r.needle_to(needle, 1.0f / 60);
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(r.node_of_point(0), before);
  ASSERT_NE(r.last(EventKind::particle_passed), nullptr);
  EXPECT_EQ(r.last(EventKind::particle_passed)->value, -1.0f);
  EXPECT_TRUE(r.order_is_whole());
}

// A tool at the rim, its jaws on the wall, pointing down at it.
Pose at_rim(Hands& r, float angle) {
  const Place p = r.place(angle, 0.003f);
  return {p.at, from_axes(p.along, cross(p.out, p.along), p.out)};
}

TEST(Grasp, a_jaw_that_closes_on_the_wall_holds_the_tissue_and_draws_it_along) {
  Hands r;
  r.wait(0.3f);
  r.show(1, at_rim(r, 1.1f), 1);
  r.close(1);
  ASSERT_EQ(r.count(EventKind::tissue_grasped), 1u);
  ASSERT_EQ(r.suture().instrument[1].held, Held::tissue);
  const uint32_t particle = r.suture().instrument[1].slot;
  const Vec3 before = xyz(r.x()[particle]);
  const Pose start = r.input.hand[1].pose;
  const Vec3 out = normalized(Vec3{start.p.x, 0, start.p.z});
  for (int i = 1; i <= 60; ++i) r.input.hand[1].pose.p = start.p + out * (0.0001f * static_cast<float>(i)), r.tick();
  r.wait(0.3f);
  EXPECT_GT(dot(xyz(r.x()[particle]) - before, out), 0.003f) << "the wall follows a pull of 6 mm";
  // Two-way: the tissue holds the hand back, on the line of the pull.
  EXPECT_LT(dot(r.solver().body[1].x - r.input.hand[1].pose.p, out), -1e-5f);
  r.open(1);
  EXPECT_EQ(r.count(EventKind::tissue_released), 1u);
  EXPECT_FLOAT_EQ(r.last(EventKind::tissue_released)->value, 0.0f);
  r.input.hand[1].connected = 0;
  r.wait(1.5f);
  EXPECT_LT(distance(xyz(r.x()[particle]), before), 0.001f) << "let go, the wall returns";
}

TEST(Grasp, tissue_slips_out_of_a_jaw_that_is_torn_away) {
  Hands r;
  r.wait(0.3f);
  r.show(1, at_rim(r, 1.1f), 1);
  r.close(1);
  ASSERT_EQ(r.suture().instrument[1].held, Held::tissue);
  const Pose start = r.input.hand[1].pose;
  const Vec3 out = normalized(Vec3{start.p.x, 0, start.p.z});
  for (int i = 1; i <= 90; ++i) r.input.hand[1].pose.p = start.p + out * (0.001f * static_cast<float>(i)), r.tick();
  ASSERT_EQ(r.count(EventKind::tissue_released), 1u);
  EXPECT_GT(r.last(EventKind::tissue_released)->value, r.model->suture.instrument[1].tissue_grip);
}

}  // namespace
}  // namespace catgut
