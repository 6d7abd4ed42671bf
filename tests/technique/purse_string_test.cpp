// SPDX-License-Identifier: Apache-2.0
// tests/technique: the purse-string's rules (paper 2.5.1, figure 11), on rings of points alone.
#include "technique/purse_string.h"

#include <gtest/gtest.h>

namespace catgut {
namespace {

// Suture points of `bites` bites round a ring: in and out, `gap` of each step bare.
std::vector<Vec3> ring(int bites, float radius = 0.02f, float inside = 0.5f) {
  std::vector<Vec3> sp;
  for (int b = 0; b < bites; ++b)
    for (int k = 0; k < 2; ++k) {
      const float a = 2 * kPi * (static_cast<float>(b) + inside * static_cast<float>(k)) / static_cast<float>(bites);
      sp.push_back({radius * std::cos(a), 0, radius * std::sin(a)});
    }
  return sp;
}

// "The thread does not cross the opening when sp_i+1 is the closest suture point to sp_i in 3D space from sp_i+1, sp_i+2, and
// sp_i+3."
TEST(Adjacency, holds_for_a_ring_of_twenty_four) {
  EXPECT_EQ(first_out_of_order(ring(12)), -1);
  EXPECT_EQ(first_out_of_order(ring(12, 0.02f, 0.65f)), -1) << "bites longer than the bridges between them";
}

TEST(Adjacency, fails_where_a_chord_crosses_the_opening) {
  for (size_t at = 3; at < 20; ++at) {
    std::vector<Vec3> sp = ring(12);
    sp[at] = {-sp[at].x, sp[at].y, -sp[at].z};  // moved to the other side of the opening
    const int found = first_out_of_order(sp);
    ASSERT_NE(found, -1) << at;
    EXPECT_LE(std::abs(found - static_cast<int>(at)), 1) << at;
  }
}

TEST(Adjacency, fails_where_two_points_are_swapped) {
  std::vector<Vec3> sp = ring(12);
  std::swap(sp[9], sp[11]);
  EXPECT_NE(first_out_of_order(sp), -1);
}

// "If there are not three consecutive points after sp_i, then sp_0 through sp_2 are used."
TEST(Adjacency, past_the_end_the_first_points_follow) {
  const size_t n = 24;
  // The last point followed by sp0, sp1, sp2: the nearest must be sp0.
  std::vector<Vec3> sp = ring(12);
  EXPECT_EQ(first_out_of_order(sp, n - 1), -1);
  sp[0] = {0, 0, 0.5f};  // the first point is far away: sp1 is nearer to the last
  EXPECT_EQ(first_out_of_order(sp, n - 1), static_cast<int>(n) - 1);
  // The last but one is followed by the last, sp0 and sp1.
  sp = ring(12);
  sp[n - 1] = {-0.02f, 0, 0};
  EXPECT_EQ(first_out_of_order(sp, n - 2), static_cast<int>(n) - 2);
}

TEST(Adjacency, says_nothing_about_fewer_than_four_points) {
  for (size_t n = 0; n < 4; ++n) EXPECT_EQ(first_out_of_order(std::vector<Vec3>(n)), -1);
}

// A rim of particles (outer and inner), suture points that are particles of their own, and the technique on its own.
struct Ring {
  PurseStringModel model;
  PurseStringState state;
  ClosurePlan plan;
  std::vector<Vec4> x;
  std::vector<uint32_t> sp;  // particles that are suture points
  EventList events;
  std::vector<Vec3> start;

  explicit Ring(int bites) {
    constexpr int kRim = 48;
    for (int i = 0; i < kRim; ++i) add(0.020f, 2 * kPi * static_cast<float>(i) / kRim, 0, &model.rim_outer);
    for (int i = 0; i < kRim; ++i) add(0.0175f, 2 * kPi * static_cast<float>(i) / kRim, 0, &model.rim_inner);
    for (const Vec3& p : ring(bites, 0.0195f))
      sp.push_back(static_cast<uint32_t>(x.size())), x.push_back(point(p - Vec3{0, 0.004f, 0}));
    for (const Vec4& p : x) start.push_back(xyz(p));
  }
  void add(float r, float a, float y, std::vector<uint32_t>* rim) {
    rim->push_back(static_cast<uint32_t>(x.size()));
    x.push_back(point({r * std::cos(a), y, r * std::sin(a)}));
  }
  void tick(float loop, float dt = 1.0f / 60, size_t points = 1000) {
    std::vector<StitchPoint> point(std::min(points, sp.size()));
    for (size_t k = 0; k < point.size(); ++k) point[k].at = xyz(x[sp[k]]), point[k].point = particle_point(sp[k]);
    TechniqueView view;
    view.point = point;
    view.x = x.data();
    view.loop = loop;
    view.dt = dt;
    purse_string(model, state, view, plan, events);
  }
  float way() const {
    float s = 0;
    for (size_t k = 0; k + 1 < sp.size(); ++k) s += distance(xyz(x[sp[k]]), xyz(x[sp[k + 1]]));
    return s;
  }
  // Tissue that follows the plan at once.
  void follow() {
    for (const ClosurePlan::Pull& p : plan.pull) set(x[p.point.particle[0]], lerp(p.from, p.to, plan.progress));
  }
  size_t count(EventKind kind) const {
    return static_cast<size_t>(std::count_if(events.begin(), events.end(), [&](const Event& e) { return e.kind == kind; }));
  }
};

TEST(RingOfBites, is_not_complete_with_too_few_bites) {
  Ring few(9);
  for (int i = 0; i < 10; ++i) few.tick(0.05f);
  EXPECT_FALSE(few.state.ring_complete);
  EXPECT_TRUE(few.plan.pull.empty()) << "nothing is pulled inward until the very end";
  Ring enough(10);
  enough.tick(1);
  EXPECT_TRUE(enough.state.ring_complete);
  EXPECT_EQ(enough.count(EventKind::ring_complete), 1u);
}

TEST(RingOfBites, is_not_complete_while_it_does_not_go_all_the_way_round) {
  Ring r(14);
  r.tick(1, 1.0f / 60, 20);  // ten bites of fourteen
  EXPECT_FALSE(r.state.ring_complete);
  r.tick(1, 1.0f / 60, 27);  // thirteen and a half: an incomplete bite
  EXPECT_FALSE(r.state.ring_complete);
  r.tick(1);
  EXPECT_TRUE(r.state.ring_complete);
}

TEST(RingOfBites, a_crossing_is_said_and_does_not_stop_anything) {
  Ring r(12);
  std::swap(r.sp[8], r.sp[16]);
  for (size_t n = 1; n <= r.sp.size(); ++n) r.tick(1, 1.0f / 60, n);
  EXPECT_GE(r.count(EventKind::bite_out_of_order), 1u);
  for (const Event& e : r.events)
    if (e.kind == EventKind::bite_out_of_order) { EXPECT_LT(e.which, r.sp.size()); }
}

TEST(RingOfBites, a_good_ring_breaks_no_order) {
  Ring r(12);
  for (size_t n = 1; n <= r.sp.size(); ++n) r.tick(1, 1.0f / 60, n);
  EXPECT_EQ(r.count(EventKind::bite_out_of_order), 0u);
}

// "... without pulling the tissue inward until the very end", "when the thread is tightened".
TEST(Closure, begins_when_the_slack_is_out) {
  Ring r(12);
  r.tick(1);
  r.tick(1.05f * r.way());
  EXPECT_FALSE(r.state.closing);
  EXPECT_TRUE(r.plan.pull.empty());
  r.tick(0.99f * r.way());
  EXPECT_TRUE(r.state.closing);
  EXPECT_EQ(r.plan.pull.size(), 48u + 48u + 24u);
}

// A ring may be complete before the last bite of a plan: that bite's thread then adds to the path, and the ring closes.
TEST(Closure, begins_after_one_bite_more_than_the_ring_needed) {
  Ring r(12);
  for (const float part : {1.0f / 3, 2.0f / 3}) {  // the thirteenth, between the last and the first
    const Vec3 at = lerp(xyz(r.x[r.sp[23]]), xyz(r.x[r.sp[0]]), part);
    r.sp.push_back(static_cast<uint32_t>(r.x.size())), r.x.push_back(point(at));
  }
  r.tick(1, 1.0f / 60, 24);
  ASSERT_TRUE(r.state.ring_complete);
  r.tick(1, 1.0f / 60, 25);
  r.tick(1.05f * r.way());
  EXPECT_FALSE(r.state.closing);
  r.tick(0.99f * r.way());
  EXPECT_TRUE(r.state.closing);
  EXPECT_EQ(r.plan.pull.size(), 48u + 48u + 26u);
  EXPECT_EQ(r.count(EventKind::ring_complete), 1u);
  EXPECT_EQ(r.count(EventKind::bite_out_of_order), 0u);
}

// Figure 11: "Each particle is pulled over time, ensuring all particles arrive at the location simultaneously."
TEST(Closure, all_points_arrive_together) {
  Ring r(12);
  r.tick(1);
  float loop = r.way();
  for (int i = 0; i < 2000 && !r.state.finished; ++i) {
    loop -= 0.0001f;
    r.tick(loop);
    r.follow();
    // At every moment every particle has covered the same fraction of its path: linear in one progress.
    for (const ClosurePlan::Pull& p : r.plan.pull) {
      const float whole = distance(p.from, p.to), gone = distance(p.from, xyz(r.x[p.point.particle[0]]));
      ASSERT_NEAR(gone, r.plan.progress * whole, 1e-6f + 1e-4f * whole);
    }
  }
  ASSERT_TRUE(r.state.finished);
  EXPECT_EQ(r.plan.progress, 1.0f);
  EXPECT_EQ(r.count(EventKind::closure_finished), 1u);
  for (uint32_t i : r.model.rim_inner)
    EXPECT_NEAR(length(Vec3{r.x[i].x, 0, r.x[i].z} - Vec3{r.model.anvil.x, 0, r.model.anvil.z}), r.model.anvil_radius, 1e-4f);
  const size_t events = r.events.size();
  r.tick(loop * 0.5f);
  EXPECT_EQ(r.events.size(), events) << "it is over";
}

TEST(Closure, the_opening_falls_with_the_loop) {
  Ring r(12);
  r.tick(1);
  float loop = r.way(), before = opening_area(r.model.rim_inner, r.x.data());
  const float open = before;
  EXPECT_NEAR(open, kPi * 0.0175f * 0.0175f, 0.01f * open);
  for (int i = 0; i < 2000 && !r.state.finished; ++i) {
    loop -= 0.00005f;
    r.tick(loop);
    r.follow();
    const float area = opening_area(r.model.rim_inner, r.x.data());
    ASSERT_LE(area, before + 1e-9f);
    before = area;
  }
  EXPECT_LT(before, 0.08f * open);
}

TEST(Closure, gives_way_when_the_loop_is_let_out_and_is_never_faster_than_tissue) {
  Ring r(12);
  r.tick(1);
  const float way = r.way(), dt = 1.0f / 60;
  r.tick(0.99f * way);
  float before = r.plan.progress;
  for (int i = 0; i < 20; ++i) {  // the whole loop gone at once
    r.tick(0.55f * way, dt);
    ASSERT_LE(r.plan.progress, before + r.model.fastest * dt + 1e-6f);
    before = r.plan.progress;
  }
  EXPECT_GT(before, 0.1f);
  for (int i = 0; i < 60; ++i) r.tick(way, dt);
  EXPECT_LT(r.plan.progress, 0.01f);
}

TEST(Closure, needs_an_opening) {
  PurseStringModel model;
  PurseStringState state;
  ClosurePlan plan;
  EventList events;
  purse_string(model, state, {}, plan, events);
  EXPECT_TRUE(events.empty());
  EXPECT_TRUE(plan.pull.empty());
}

}  // namespace
}  // namespace catgut
