// SPDX-License-Identifier: Apache-2.0
// tests/technique: the rules of the Lembert suture (paper 2.5.4, figure 15), on rings of points alone.
#include "technique/lembert.h"

#include <set>

#include "stitch_rig.h"

namespace catgut {
namespace {

constexpr float kDegree = kPi / 180;
Vec3 on_ring(float radius, float degrees) {
  return {radius * std::cos(degrees * kDegree), 0, -radius * std::sin(degrees * kDegree)};
}

struct TwoRings : StitchRig {
  LembertModel model;
  LembertState state;

  TwoRings(int outer = 56, int inner = 35) {
    for (int i = 0; i < outer; ++i) model.outer.push_back(particle(on_ring(0.0178f, 360.0f * static_cast<float>(i) / outer)));
    for (int i = 0; i < inner; ++i) model.inner.push_back(particle(on_ring(0.0125f, 360.0f * static_cast<float>(i) / inner)));
  }
  void tick(int times = 1) {
    for (int i = 0; i < times; ++i) StitchRig::tick(model, state, lembert);
  }
  // Bites through outer and inner layer at an angle.
  void stitch(float degrees) {
    const Vec3 down{0, -0.003f, 0};
    pass(0, particle(on_ring(0.020f, degrees) + down), kIn, particle(on_ring(0.0178f, degrees) + down), kOut);
    pass(1, particle(on_ring(0.0125f, degrees) + down), kOut, particle(on_ring(0.0103f, degrees) + down), kIn);
  }
  // Stitched, tied with `throws` throws, cut, and the next one loaded.
  void suture(float degrees, int throws = 2) {
    stitch(degrees);
    tick();
    begin_knot();
    for (int i = 0; i < throws; ++i) lock(), tick();
    now.add({EventKind::thread_cut, 0, 0, 0.005f, {}});
    tick(100);
    fresh_suture();
    tick();
  }
  // This is suture 1 of two, on the same rings; the other one is as it stands.
  void suture_of_two(const TwoRings& other) {
    own_suture = 1;
    x = other.x;
    plan_of = {other.plan, {}};
    state_of.resize(2);
    state_of[0].lembert = other.state;
  }
  float degrees_of(uint32_t i) const { return std::atan2(-x[i].z, x[i].x) / kDegree; }
  float degrees_of(const EmbeddedPoint& p) const {
    const Vec3 at = position_of(p, x.data());
    return std::atan2(-at.z, at.x) / kDegree;
  }
  std::vector<uint32_t> in_pairs(const std::vector<uint32_t>& group) const {
    std::vector<uint32_t> found;
    for (uint32_t i : group)
      if (std::any_of(plan.pair.begin(), plan.pair.end(),
                      [&](auto& p) { return p.a.particle[0] == i || p.b.particle[0] == i; }))
        found.push_back(i);
    return found;
  }
};

// "If the angle between v1 and vp and the angle between v2 and vp equals the angle between v1 and v2, then the particle is
// between sp1 and sp2."
TEST(AngleRule, tells_between_from_beside) {
  const Vec3 up{0, 1, 0};
  for (float turn = 0; turn < 360; turn += 23) {
    const Vec3 v1 = on_ring(0.02f, turn + 20), v2 = on_ring(0.01f, turn + 90);
    for (float a = 0; a < 360; a += 5) {
      if (a == 20 || a == 90) continue;
      EXPECT_EQ(is_between(v1, v2, on_ring(0.015f, turn + a) + up * (0.0001f * a), up), a > 20 && a < 90) << turn << " " << a;
      EXPECT_EQ(is_between(v2, v1, on_ring(0.015f, turn + a), up), a > 20 && a < 90);
    }
  }
}

// Figure 15, with its own numbers: p7 is stitched, p2 of the outer and p12 of the inner layer are the closest; then p10 is
// stitched, with p10 and p15 the closest; p13 lies between, as do p8, p9 and p14.
TEST(Figure15, pairs_as_drawn) {
  StitchRig rig;
  LembertModel model;
  LembertState state;
  std::array<uint32_t, 20> p{};
  const auto add = [&](uint32_t k, bool outer, float degrees) {
    p[k] = rig.particle(on_ring(outer ? 0.018f : 0.012f, degrees));
    (outer ? model.outer : model.inner).push_back(p[k]);
  };
  add(1, true, 110), add(2, true, 90), add(8, true, 72), add(9, true, 50), add(10, true, 30), add(3, true, 0),
      add(4, true, -90);
  add(5, true, 180);
  add(11, false, 110), add(12, false, 90), add(13, false, 66), add(14, false, 48), add(15, false, 30), add(16, false, 0);
  add(17, false, -90), add(18, false, 180);
  p[7] = rig.particle(on_ring(0.015f, 90));
  const auto stitch = [&](uint32_t k) {
    rig.pass(0, p[k], kIn, p[k], kOut);
    rig.pass(1, p[k], kOut, p[k], kIn);
    rig.tick(model, state, lembert);
    EXPECT_EQ(rig.plan.pair.size(), state.row.size());
    for (int i = 0; i < 2; ++i) rig.lock(), rig.tick(model, state, lembert);
  };
  stitch(7);
  ASSERT_EQ(rig.plan.pair.size(), 1u) << "(b) p2 and p12 are pulled toward p7, nothing else";
  EXPECT_EQ(rig.plan.pair[0].a.particle[0], p[2]);
  EXPECT_EQ(rig.plan.pair[0].b.particle[0], p[12]);
  EXPECT_EQ(rig.plan.pair[0].midpoint, 1u);
  rig.fresh_suture();
  rig.tick(model, state, lembert);
  stitch(10);
  EXPECT_EQ(rig.plan.pair[1].a.particle[0], p[10]);
  EXPECT_EQ(rig.plan.pair[1].b.particle[0], p[15]);
  EXPECT_EQ(rig.plan.pair[1].midpoint, 1u);
  ASSERT_EQ(rig.plan.pair.size(), 4u) << "(d) all particles between p7 and p10, each in one pair";
  EXPECT_EQ(rig.plan.pair[2].a.particle[0], p[8]);
  EXPECT_EQ(rig.plan.pair[2].b.particle[0], p[13]);
  EXPECT_EQ(rig.plan.pair[3].a.particle[0], p[9]);
  EXPECT_EQ(rig.plan.pair[3].b.particle[0], p[14]);
  for (size_t row : {2u, 3u}) EXPECT_EQ(rig.plan.pair[row].midpoint, 0u);
  EXPECT_EQ(rig.count(EventKind::technique_fault), 0u);
}

// "When a knot is pulled tight, the inner and outer layers must be pulled together around the created suture point."
TEST(Lembert, nothing_closes_before_the_knot_locks) {
  TwoRings t;
  t.stitch(40);
  t.tick(60);
  t.begin_knot();
  t.knot.push_back({});
  t.knot[0].throws = 1;  // tightening
  t.tick(60);
  EXPECT_TRUE(t.plan.pair.empty());
  t.knot.clear();
  t.lock();
  t.tick();
  ASSERT_EQ(t.plan.pair.size(), 1u);
  EXPECT_NEAR(t.degrees_of(t.plan.pair[0].a), 40, 4);
  EXPECT_NEAR(t.degrees_of(t.plan.pair[0].b), 40, 1) << "between particles too, which are 10 degrees apart";
  float before = t.plan.pair[0].progress;
  for (int i = 0; i < 120; ++i) {
    t.tick();
    t.follow();
    EXPECT_LE(t.plan.pair[0].progress, before + t.model.fastest * kTick + 1e-6f);
    before = t.plan.pair[0].progress;
  }
  EXPECT_FLOAT_EQ(before, 1);
  EXPECT_NEAR(t.gap(0), t.model.gap, 1e-6f);
  EXPECT_EQ(t.count(EventKind::seam_closed), 1u);
}

// Stitches closer together than particles: none pulls a particle to a second target, and each holds its place.
TEST(Lembert, stitches_closer_than_particles_share_their_pairs) {
  TwoRings t;
  for (int k = 0; k < 8; ++k) t.suture(40 + 2.5f * static_cast<float>(k));
  std::set<uint32_t> outer;
  for (const ClosurePlan::Pair& p : t.plan.pair) EXPECT_TRUE(outer.insert(p.a.particle[0]).second);
  EXPECT_LT(t.plan.pair.size(), 6u) << "four particles of the outer ring, 6.4 degrees apart";
  for (uint32_t k = 0; k < 8; ++k) {
    const float at = 40 + 2.5f * static_cast<float>(k);
    EXPECT_NEAR(t.degrees_of(t.plan.pair[t.state.stitch[k].row].a), at, 3.3f);
    EXPECT_NEAR(t.degrees_of(t.plan.pair[t.state.stitch[k].row].b), at, 6.5f);
  }
  // A shared pair opens when the last of its stitches releases, not before.
  const uint32_t row = t.state.stitch[1].row;
  ASSERT_EQ(t.state.stitch[2].row, row);
  t.tick(100);
  t.state.stitch[1].holds = 0;
  t.tick(200);
  EXPECT_FLOAT_EQ(t.plan.pair[row].progress, 1);
  for (LembertStitch& s : t.state.stitch)
    if (s.row == row) s.holds = 0;
  t.tick(200);
  EXPECT_FLOAT_EQ(t.plan.pair[row].progress, 0);
}

// "If multiple Lembert sutures are made close together, the bowel's flesh between the two sutures should also be pulled
// closed."
TEST(Lembert, all_particles_between_two_neighbors_are_covered) {
  TwoRings t;
  t.suture(10);
  EXPECT_EQ(t.plan.pair.size(), 1u);
  t.suture(82);
  for (const auto& group : {t.model.outer, t.model.inner}) {
    const std::vector<uint32_t> paired = t.in_pairs(group);
    for (uint32_t i : group) {
      const float a = t.degrees_of(i);
      const bool found = std::find(paired.begin(), paired.end(), i) != paired.end();
      if (a > 10.5f && a < 81.5f) { EXPECT_TRUE(found) << a; }
      if (a < 0 || a > 92) { EXPECT_FALSE(found) << a; }
    }
  }
  // Each with its nearest of the other layer, no pair twice.
  std::set<std::pair<uint32_t, uint32_t>> seen;
  for (const ClosurePlan::Pair& p : t.plan.pair) {
    EXPECT_TRUE(seen.insert({p.a.particle[0], p.b.particle[0]}).second);
    EXPECT_LT(std::abs(t.degrees_of(p.a.particle[0]) - t.degrees_of(p.b.particle[0])), 5.2f);
  }
}

// The same two stitches, each with a needle and thread of its own: what lies between them is closed all the same, once, and
// opens when the stitch of the other suture no longer holds.
TEST(Lembert, neighbors_are_those_of_every_suture) {
  TwoRings one;
  one.suture(10), one.suture(82);
  TwoRings a, b;
  a.suture(10);
  b.suture_of_two(a);
  b.suture(82);
  EXPECT_EQ(a.plan.pair.size() + b.plan.pair.size(), one.plan.pair.size());
  std::set<std::pair<uint32_t, uint32_t>> want, got;
  for (const ClosurePlan::Pair& p : one.plan.pair) want.insert({p.a.particle[0], p.b.particle[0]});
  for (const auto* plan : {&a.plan, &b.plan})
    for (const ClosurePlan::Pair& p : plan->pair) got.insert({p.a.particle[0], p.b.particle[0]});
  EXPECT_EQ(got, want);
  for (const ClosurePlan::Pair& p : b.plan.pair) EXPECT_FLOAT_EQ(p.progress, 1);
  b.state_of[0].lembert.stitch[0].holds = 0;
  b.tick(200);
  for (size_t r = 0; r < b.plan.pair.size(); ++r)
    EXPECT_FLOAT_EQ(b.plan.pair[r].progress, b.plan.pair[r].midpoint ? 1.0f : 0.0f) << r;
}

TEST(Lembert, stitches_far_apart_are_no_neighbors) {
  TwoRings t;
  t.suture(0);
  t.suture(135);  // 2.36 rad
  EXPECT_EQ(t.plan.pair.size(), 2u);
}

// Five sutures, as in section 3.4, close the whole ring, in any order.
TEST(Lembert, five_close_the_ring) {
  for (const auto& order : {std::array{0, 1, 2, 3, 4}, std::array{0, 2, 4, 1, 3}}) {
    TwoRings t;
    for (int k : order) t.suture(72.0f * static_cast<float>(k));
    for (int i = 0; i < 200; ++i) t.tick();
    EXPECT_EQ(t.in_pairs(t.model.outer).size(), t.model.outer.size());
    EXPECT_EQ(t.in_pairs(t.model.inner).size(), t.model.inner.size());
    for (const ClosurePlan::Pair& p : t.plan.pair) EXPECT_FLOAT_EQ(p.progress, 1);
    EXPECT_EQ(t.count(EventKind::technique_fault), 0u);
    EXPECT_EQ(std::count_if(t.plan.pair.begin(), t.plan.pair.end(), [](auto& p) { return p.midpoint == 1; }), 5);
    EXPECT_LE(t.plan.pair.size(), t.model.outer.size() + t.model.inner.size());
  }
}

TEST(Lembert, tied_through_one_layer_draws_nothing) {
  TwoRings t;
  t.pass(0, t.particle(on_ring(0.02f, 5)), kIn, t.particle(on_ring(0.0178f, 5)), kOut);
  t.tick();
  t.lock();
  t.tick(20);
  EXPECT_EQ(t.faults(Fault::one_wall_only), Bites{0});
  EXPECT_TRUE(t.plan.pair.empty());
  t.lock();
  t.tick(5);
  t.fresh_suture();
  t.tick(5);
  EXPECT_EQ(t.count(EventKind::technique_fault), 1u);
}

TEST(Lembert, too_few_throws_do_not_hold) {
  for (const bool cut : {true, false}) {
    SCOPED_TRACE(cut);
    TwoRings t;
    t.suture(0);
    t.stitch(60);
    t.tick();
    t.lock();
    t.tick(100);
    EXPECT_FLOAT_EQ(t.plan.pair.back().progress, 1);
    EXPECT_EQ(t.count(EventKind::technique_fault), 0u) << "there may be more to come";
    if (cut) t.now.add({EventKind::thread_cut, 0, 0, 0.005f, {}});
    else t.fresh_suture();
    t.tick(100);
    EXPECT_EQ(t.faults(Fault::too_few_throws), Bites{0});
    if (cut) t.fresh_suture();
    t.tick(5);
    EXPECT_EQ(t.faults(Fault::too_few_throws).size(), 1u) << "reported once";
    EXPECT_FLOAT_EQ(t.plan.pair[0].progress, 1) << "the good one holds";
    for (size_t row = 1; row < t.plan.pair.size(); ++row) EXPECT_EQ(t.plan.pair[row].progress, 0) << row;
    // A stitch that does not hold has no neighbors.
    const size_t rows = t.plan.pair.size();
    t.suture(120);
    for (size_t row = rows; row < t.plan.pair.size(); ++row) EXPECT_EQ(t.state.row[row].other == 1, false);
  }
}

TEST(Lembert, begun_knots_want_a_bite_and_the_needle_out) {
  TwoRings t;
  t.begin_knot(1);
  t.tick();
  EXPECT_EQ(t.faults(Fault::knot_without_bite), Bites{1});
  t.stitch(0);
  t.needle_in_tissue = true;
  t.begin_knot();
  t.tick();
  EXPECT_EQ(t.faults(Fault::needle_in_tissue), Bites{1});
}

TEST(Lembert, needs_two_layers) {
  LembertModel model;
  LembertState state;
  ClosurePlan plan;
  EventList events;
  lembert(model, state, {}, plan, events);
  EXPECT_TRUE(plan.pair.empty());
}

}  // namespace
}  // namespace catgut
