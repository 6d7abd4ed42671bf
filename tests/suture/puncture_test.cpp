// SPDX-License-Identifier: Apache-2.0
// tests/suture: the needle's triggers (paper 2.2, figures 4 and 5).
#include <gtest/gtest.h>

#include <limits>

#include "rig.h"

namespace catgut {
namespace {

// "As soon as the needle's tip penetrates the soft tissue, the closest soft-body particle within a specified threshold distance
// X of the tip is identified and attached to the needle as illustrated in Fig. 4."
TEST(Figure4, nearest_particle_within_x_is_attached_when_the_tip_enters) {
  Rig rig;
  rig.wait(0.2f);
  const Place p = rig.place(0.4f);
  rig.approach(p);
  ASSERT_EQ(rig.count(EventKind::tip_entered), 0u);
  float psi = -1.0f;
  while (rig.count(EventKind::tip_entered) == 0 && psi < 0) rig.drive(p, psi, psi + 0.06f), psi += 0.06f;
  ASSERT_EQ(rig.count(EventKind::tip_entered), 1u);
  ASSERT_EQ(rig.count(EventKind::particle_attached), 1u);
  const Event& e = *rig.last(EventKind::particle_attached);
  EXPECT_LE(e.value, rig.model->suture.attach_threshold);
  EXPECT_EQ(rig.sewn().bite[0].nearest, e.which);
  // No particle was nearer to the tip. In the few substeps since then, tip and tissue have moved by less than half a
  // millimeter.
  float nearest = std::numeric_limits<float>::max();
  for (uint32_t i = 0; i < rig.model->solver.tissue; ++i)
    nearest = std::min(nearest, distance(xyz(rig.x()[i]), rig.last(EventKind::tip_entered)->where));
  EXPECT_NEAR(e.value, nearest, 0.0005f);
}

// The same figure, exactly: one call of the stage on a tip placed directly, so that nothing has moved between the trigger and
// the search.
TEST(Figure4, the_nearest_is_the_nearest_of_all) {
  Rig rig;
  rig.wait(0.1f);
  rig.hold_needle();
  for (int k = 0; k < 24; ++k) {
    const Place p = rig.place(0.27f * static_cast<float>(k), 0.003f + 0.0007f * static_cast<float>(k % 7));
    const Pose circle = rig.circle_at({p.at - p.out * 0.0004f, p.out, p.along, p.up}, 0, 0);
    SolverState solver = rig.solver();
    RigidBody& needle = solver.body[rig.needle_body()];
    needle.x = circle.p - rotate(circle.q, rig.model->solver.needle_arc[0].center);
    needle.q = circle.q;
    SutureState sutures;
    sutures.suture.resize(1);
    EventList events;
    SutureContext sewing{rig.model->solver, solver, rig.state->scratch, rig.model->suture, sutures, events};
    puncture(sewing);
    const Suture& suture = sutures.suture[0];
    ASSERT_TRUE(suture.attached) << k;
    const Vec3 tip = needle_tip(rig.model->solver.needle_arc[0], needle);
    uint32_t best = 0;
    for (uint32_t i = 0; i < rig.model->solver.tissue; ++i)
      if (distance(xyz(solver.x[i]), tip) < distance(xyz(solver.x[best]), tip)) best = i;
    EXPECT_FLOAT_EQ(distance(xyz(solver.x[suture.bite[0].nearest]), tip), distance(xyz(solver.x[best]), tip)) << k;
    // "Once the closest particle is found, it is constrained to move with the needle tip": from its position, without a jerk.
    const Attachment& a = solver.attach.back();
    EXPECT_EQ(a.body, static_cast<int>(rig.needle_body()));
    EXPECT_EQ(a.point.particle[0], best);
    EXPECT_LT(distance(transform(needle.pose(), a.target), xyz(solver.x[best])), 1e-6f);
    EXPECT_FLOAT_EQ(a.compliance, rig.model->suture.attach_compliance);
  }
}

// It weighs a few millinewtons. When a hand grasps it in place, with its tip in the wall, it is in.
TEST(Figure4, a_needle_that_nobody_holds_pierces_nothing) {
  Rig rig;
  rig.wait(0.1f);
  const Place p = rig.place(0.5f, 0.004f);
  const Pose circle = rig.circle_at({p.at - p.out * 0.0004f, p.out, p.along, p.up}, 0, 0);
  rig.needle().x = circle.p - rotate(circle.q, rig.model->solver.needle_arc[0].center);
  rig.needle().q = circle.q;
  SutureContext sewing = rig.context();
  for (const bool held : {false, false, true}) {
    if (held) rig.hold_needle();
    puncture(sewing);
    EXPECT_EQ(rig.sewn().bite.size(), held ? 1u : 0u);
    EXPECT_EQ(rig.sewn().attached, held);
  }
}

// Figure 4: "The green square represents the threshold range for the closest particle." Outside it nothing is attached.
TEST(Figure4, no_particle_within_x_attaches_none) {
  SceneSpec scene = plain_scene();
  scene.mechanics.attach_threshold = 1e-5f;
  Rig rig(scene);
  rig.wait(0.2f);
  const Place p = rig.place(0.4f);
  rig.approach(p);
  rig.drive(p, -1.0f, 0.0f);
  EXPECT_EQ(rig.count(EventKind::tip_entered), 1u);
  EXPECT_EQ(rig.count(EventKind::particle_attached), 0u);
  EXPECT_FALSE(rig.sewn().attached);
  EXPECT_TRUE(rig.solver().attach.empty());
}

// Figure 5: "When the needle has dragged the attached particle a certain distance beyond its original position, exceeding a
// preset distance threshold, the particle's attachment to the needle is automatically released, allowing the previously
// stretched region of tissue to relax back toward its original shape."
TEST(Figure5, dragged_beyond_the_threshold_it_is_released_and_the_tissue_relaxes) {
  Rig rig;
  rig.wait(1.0f);
  const std::vector<Vec4> before(rig.solver().x.begin(), rig.solver().x.begin() + rig.model->solver.tissue);
  const Place p = rig.place(0.4f);
  rig.approach(p);
  // Into the tissue, and then the tip is dragged along the wall without rotation.
  rig.drive(p, -1.0f, -0.15f);
  ASSERT_EQ(rig.count(EventKind::particle_attached), 1u);
  const uint32_t dragged = rig.last(EventKind::particle_attached)->which;
  Pose on = rig.circle();
  for (int i = 0; i < 60 && rig.count(EventKind::particle_released) == 0; ++i) {
    on.p += p.along * 0.0003f;
    rig.needle_to(on, 1.0f / 60);
  }
  ASSERT_EQ(rig.count(EventKind::particle_released), 1u);
  EXPECT_EQ(rig.last(EventKind::particle_released)->which, dragged);
  EXPECT_FALSE(rig.sewn().attached);
  EXPECT_TRUE(rig.solver().attach.empty());
  // The needle is removed; after two seconds every particle is where it was, to 0.3 mm (the wall is 2.5 mm thick).
  const float psi = -0.15f;
  rig.needle_to(rig.circle_at(p, psi), 0.2f);
  rig.drive(p, psi, -1.2f);
  EXPECT_EQ(rig.count(EventKind::bite_withdrawn), 1u);
  rig.draw(p, 0.03f, 0.3f);
  rig.wait(2.0f);
  float worst = 0;
  for (size_t i = 0; i < before.size(); ++i) worst = std::max(worst, distance(xyz(before[i]), xyz(rig.x()[i])));
  EXPECT_LT(worst, 0.0003f);
}

// "Once the needle's back-end trigger also passes through the tissue, the system marks the completion of that bite of the
// suture. When a bite is completed, the needle creates a suture point." A bite has two holes, so it makes two: entry first,
// then exit.
TEST(Bite, back_end_trigger_completes_it_and_makes_its_suture_points) {
  Rig rig;
  rig.wait(0.2f);
  const Place p = rig.place(0.4f);
  rig.approach(p);
  rig.drive(p, -1.0f, 1.2f);
  ASSERT_EQ(rig.count(EventKind::tip_exited), 1u);
  EXPECT_EQ(rig.count(EventKind::suture_point), 0u) << "no suture point before the back end has gone in";
  EXPECT_EQ(rig.count(EventKind::bite_completed), 0u);
  rig.drive(p, 1.2f, 4.3f);
  ASSERT_EQ(rig.count(EventKind::bite_completed), 1u);
  ASSERT_EQ(rig.sewn().point.size(), 2u);
  EXPECT_FALSE(rig.sewn().point[0].exit);
  EXPECT_TRUE(rig.sewn().point[1].exit);
  EXPECT_GT(rig.node_of_point(1), rig.node_of_point(0)) << "the exit is nearer to the needle";
  EXPECT_TRUE(rig.sewn().bite[0].complete);
  EXPECT_TRUE(rig.nothing_left_of_a_bite());
  EXPECT_TRUE(rig.order_is_whole());
  EXPECT_EQ(rig.count(EventKind::bite_withdrawn), 0u);
}

void expect_like_never_begun(Rig& rig) {
  EXPECT_TRUE(rig.nothing_left_of_a_bite());
  EXPECT_TRUE(rig.thread().anchor.empty());
  EXPECT_TRUE(rig.sewn().point.empty());
  EXPECT_EQ(rig.thread().hold.size(), 1u);  // the swage
  EXPECT_TRUE(std::is_sorted(rig.thread().order.begin(), rig.thread().order.end()));
  for (float r : rig.thread().rest) EXPECT_FLOAT_EQ(r, rig.model->solver.strand[0].spacing);
  EXPECT_EQ(rig.count(EventKind::bite_withdrawn), 1u);
  ASSERT_EQ(rig.sewn().bite.size(), 1u);
  EXPECT_TRUE(rig.sewn().bite[0].canceled);
  EXPECT_FALSE(rig.sewn().bite[0].complete);
  EXPECT_FALSE(rig.sewn().bite[0].has_exit);
  // Collisions are restored: off only for the swaged end and its neighbors.
  const size_t n = rig.thread().order.size();
  for (size_t i = 0; i < n; ++i) EXPECT_EQ(rig.collides()[i], i + 4 < n ? 1 : 0) << i;
}

TEST(Bite, drawn_back_before_the_tip_came_out_leaves_nothing_behind) {
  Rig rig;
  rig.wait(0.2f);
  const Place p = rig.place(0.4f);
  rig.approach(p);
  rig.drive(p, -1.0f, 0.0f);
  ASSERT_EQ(phase_of(rig.sewn()), NeedlePhase::tip_in);
  EXPECT_EQ(rig.solver().channel.size(), 1u);
  EXPECT_EQ(rig.solver().body_collides[rig.needle_body()], 0);
  rig.drive(p, 0.0f, -1.2f);
  expect_like_never_begun(rig);
}

TEST(Bite, drawn_back_after_the_tip_came_out_leaves_nothing_behind) {
  Rig rig;
  rig.wait(0.2f);
  const Place p = rig.place(0.4f);
  rig.approach(p);
  rig.drive(p, -1.0f, 1.2f);
  ASSERT_EQ(phase_of(rig.sewn()), NeedlePhase::through);
  EXPECT_EQ(rig.solver().channel.size(), 2u);
  rig.drive(p, 1.2f, -1.2f);
  expect_like_never_begun(rig);
}

// Pulled back faster than a substep: no substep sees the tip inside the wall.
TEST(Bite, torn_back_in_one_tick_leaves_nothing_behind) {
  Rig rig;
  rig.wait(0.2f);
  const Place p = rig.place(0.4f);
  rig.approach(p);
  rig.drive(p, -1.0f, 1.2f);
  ASSERT_EQ(phase_of(rig.sewn()), NeedlePhase::through);
  rig.drive(p, 1.2f, -1.3f, 0.0011f, 200.0f);
  rig.draw(p, 0.03f, 0.1f);
  rig.wait(0.3f);
  expect_like_never_begun(rig);
}

// Even when the back end has entered and the thread is locked to the entry: the thread comes out with it.
TEST(Bite, drawn_back_after_the_back_end_went_in_frees_the_thread) {
  Rig rig;
  rig.wait(0.2f);
  const Place p = rig.place(0.4f);
  rig.approach(p);
  float psi = 1.2f;
  rig.drive(p, -1.0f, psi);
  while (phase_of(rig.sewn()) == NeedlePhase::through && psi < 4.2f) rig.drive(p, psi, psi + 0.06f), psi += 0.06f;
  ASSERT_EQ(phase_of(rig.sewn()), NeedlePhase::back_in);
  ASSERT_EQ(rig.thread().anchor.size(), 1u);
  const double length = rig.rest_length();
  rig.drive(p, psi, -1.2f);
  rig.draw(p, 0.02f, 0.2f);
  EXPECT_TRUE(rig.nothing_left_of_a_bite());
  EXPECT_TRUE(rig.thread().anchor.empty());
  EXPECT_TRUE(rig.sewn().point.empty());
  EXPECT_EQ(rig.count(EventKind::bite_withdrawn), 1u);
  EXPECT_TRUE(rig.order_is_whole());
  EXPECT_NEAR(rig.rest_length(), length, 1e-6);
  // And the next bite works like the first.
  rig.let_go();
  rig.whole_bite(p);
  EXPECT_EQ(rig.count(EventKind::bite_completed), 1u);
}

// Beyond the paper: a bite stores where the tip crossed the surface, not the nearest particle.
TEST(Bite, keeps_where_the_tip_crossed_the_surface) {
  for (const float angle : {0.3f, 1.9f, 4.0f}) {
    Rig rig;
    rig.wait(0.2f);
    const Place p = rig.place(angle, 0.0045f + 0.0003f * angle);
    rig.approach(p);
    // The tip's path, one tick at a time: the crossing lies between the last tip outside and the first one inside.
    auto crossing = [&](float& psi, EventKind kind, float until) {
      Vec3 before = rig.tip();
      while (rig.count(kind) == 0 && psi < until && !testing::Test::HasFatalFailure()) {
        before = rig.tip();
        rig.drive(p, psi, psi + 0.06f);
        psi += 0.06f;
      }
      return std::pair{before, rig.tip()};
    };
    auto off_segment = [](Vec3 q, std::pair<Vec3, Vec3> s) {
      const Vec3 d = s.second - s.first;
      const float t = std::clamp(dot(q - s.first, d) / length2(d), 0.0f, 1.0f);
      return distance(q, s.first + d * t);
    };
    float psi = -1.0f;
    const auto in = crossing(psi, EventKind::tip_entered, 0.2f);
    ASSERT_EQ(rig.count(EventKind::tip_entered), 1u) << angle;
    const Bite& bite = rig.sewn().bite[0];
    EXPECT_LT(distance(rig.last(EventKind::tip_entered)->where, position_of(bite.entry.point, rig.x())), 0.0005f);
    EXPECT_LT(off_segment(rig.last(EventKind::tip_entered)->where, in), 0.0002f) << angle;
    const auto out = crossing(psi, EventKind::tip_exited, 1.6f);
    ASSERT_EQ(rig.count(EventKind::tip_exited), 1u) << angle;
    EXPECT_LT(off_segment(rig.last(EventKind::tip_exited)->where, out), 0.0002f) << angle;
    // Triangle and weights name the same point as the embedded point, within the embedding's own error under strain.
    for (const BiteEnd* end : {&rig.sewn().bite[0].entry, &rig.sewn().bite[0].exit}) {
      const Triangle& t = rig.model->solver.collision.surface[end->triangle];
      Vec3 on{};
      for (size_t k = 0; k < 3; ++k) on += xyz(rig.model->solver.shape.rest[t[k]]) * end->weight[k];
      EXPECT_LT(distance(on, position_of(end->point, rig.model->solver.shape.rest.data())), 1e-6f);
      EXPECT_NEAR(end->weight[0] + end->weight[1] + end->weight[2], 1.0f, 1e-5f);
    }
    // Requested 1.1 mm below the surface; the wall deforms a little.
    EXPECT_GT(rig.sewn().bite[0].depth, 0.0003f);
    EXPECT_LT(rig.sewn().bite[0].depth, 0.0016f);
  }
}

TEST(Bite, deeper_needle_deeper_bite) {
  float before = 0;
  for (const float deep : {0.0008f, 0.0012f, 0.0016f}) {
    Rig rig;
    rig.wait(0.2f);
    const Place p = rig.place(0.4f);
    rig.approach(p, deep);
    rig.drive(p, -1.0f, 1.3f, deep);
    ASSERT_TRUE(rig.sewn().bite[0].has_exit) << deep;
    EXPECT_GT(rig.sewn().bite[0].depth, before);
    EXPECT_LT(rig.sewn().bite[0].depth, deep + 0.0003f);
    before = rig.sewn().bite[0].depth;
  }
}

// The weights of a suture point: sum 1, exact at rest, exact under every affine motion.
TEST(Percentiles, reproduces_the_place_at_rest_and_under_affine_motion) {
  Rig rig;
  rig.wait(0.1f);
  const ShapeModel& shape = rig.model->solver.shape;
  for (int k = 0; k < 40; ++k) {
    const size_t corner = static_cast<size_t>(k) * 29 % shape.clusters;
    const uint32_t* member = shape.member.data() + corner * shape.cluster_stride;
    uint32_t count = 0;
    while (count < shape.cluster_stride && member[count] < rig.model->solver.tissue) ++count;
    const float f = static_cast<float>(k);
    const Vec3 at = xyz(shape.rest[corner]) + Vec3{0.0007f * std::sin(f), 0.0007f * std::cos(2 * f), 0.0005f * std::sin(3 * f)};
    const EmbeddedPoint t = spread_point({member, count}, shape.rest.data(), at);
    double sum = 0;
    for (uint32_t i = 0; i < t.count; ++i) sum += double{t.weight[i]};
    EXPECT_NEAR(sum, 1.0, 1e-6);
    EXPECT_LT(distance(position_of(t, shape.rest.data()), at), 1e-6f);
    auto affine = [](Vec3 p) {
      return Vec3{1.2f * p.x + 0.3f * p.y - 0.1f * p.z + 0.01f, -0.2f * p.x + 0.8f * p.y + 0.25f * p.z - 0.02f,
                  0.15f * p.x + 1.1f * p.z};
    };
    std::vector<Vec4> moved(shape.rest.begin(), shape.rest.end());
    for (Vec4& p : moved) set(p, affine(xyz(p)));
    EXPECT_LT(distance(position_of(t, moved.data()), affine(at)), 1e-6f);
  }
}

// 2.5.2: "The needle is passed through one soft body (creating a suture point), then through the same soft body again for a
// second bite." A sweep deeper than the wall does both: outside in, then inside out.
TEST(TwoWalls, one_sweep_through_the_lumen_makes_two_bites) {
  SceneSpec scene = plain_scene();
  scene.body[0].wall = 0.0016f;
  Rig rig(scene);
  rig.wait(0.2f);
  const Place p = rig.place(0.4f, 0.006f);
  rig.approach(p, 0.0027f);
  size_t most_open = 0;
  for (float psi = -1.0f; psi < 4.3f; psi += 0.06f) {
    rig.drive(p, psi, psi + 0.06f, 0.0027f);
    most_open = std::max(most_open, rig.sewn().open.size());
  }
  ASSERT_EQ(most_open, 2u) << "the needle was in both walls at once";
  ASSERT_EQ(rig.sewn().bite.size(), 2u);
  EXPECT_TRUE(rig.sewn().bite[0].complete && rig.sewn().bite[1].complete);
  EXPECT_EQ(rig.count(EventKind::bite_completed), 2u);
  ASSERT_EQ(rig.sewn().point.size(), 4u);
  const auto inside = [&](const BiteEnd& end) {
    return rig.model->layer[rig.model->solver.collision.surface[end.triangle][0]] == static_cast<uint8_t>(TissueLayer::mucosa);
  };
  EXPECT_FALSE(inside(rig.sewn().bite[0].entry));
  EXPECT_TRUE(inside(rig.sewn().bite[0].exit));
  EXPECT_TRUE(inside(rig.sewn().bite[1].entry));
  EXPECT_FALSE(inside(rig.sewn().bite[1].exit));
  // The suture points are in order along the thread, from the free end to the needle.
  for (size_t k = 0; k + 1 < 4; ++k) EXPECT_LT(rig.node_of_point(k), rig.node_of_point(k + 1)) << k;
  EXPECT_TRUE(rig.order_is_whole());
  EXPECT_TRUE(rig.nothing_left_of_a_bite());
  EXPECT_NEAR(rig.rest_length(), 174 * 0.0016, 1e-6);
}

TEST(TwoWalls, drawn_back_the_same_way_both_bites_are_canceled) {
  SceneSpec scene = plain_scene();
  scene.body[0].wall = 0.0016f;
  Rig rig(scene);
  rig.wait(0.2f);
  const Place p = rig.place(0.4f, 0.006f);
  rig.approach(p, 0.0027f);
  float psi = -1.0f;
  while (rig.sewn().open.size() < 2 && psi < 1.5f) rig.drive(p, psi, psi + 0.06f, 0.0027f), psi += 0.06f;
  ASSERT_EQ(rig.sewn().open.size(), 2u);
  rig.drive(p, psi, -1.2f, 0.0027f);
  EXPECT_EQ(rig.count(EventKind::bite_withdrawn), 2u);
  EXPECT_TRUE(rig.sewn().point.empty());
  EXPECT_TRUE(rig.nothing_left_of_a_bite());
}

}  // namespace
}  // namespace catgut
