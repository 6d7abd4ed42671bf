// SPDX-License-Identifier: Apache-2.0
// tests/technique: the rules of Connell and stay (paper 2.5.2, 2.5.3, figures 12 to 14), on rows of points alone.
#include "technique/seam.h"

#include <cstring>
#include <set>

#include "stitch_rig.h"

namespace catgut {
namespace {

// Figure 13's two soft bodies: p1..p8 of SB1 and p9..p16 of SB2; p1..p4 and p9..p12 are their edges, face to face, 3 mm apart
// along them and 9 mm across.
struct TwoEdges : StitchRig {
  SeamModel model;
  SeamState state;
  std::array<uint32_t, 17> p{};

  explicit TwoEdges(bool connell = true) {
    model.connell = connell;
    for (uint32_t k = 1; k <= 16; ++k) {
      const bool second = k > 8, behind = (k - 1) % 8 > 3;
      const float side = second ? 1.0f : -1.0f, along = 0.003f * static_cast<float>((k - 1) % 4);
      p[k] = particle({side * (behind ? 0.0085f : 0.0045f), 0, along});
      if (!behind) model.rim[second].push_back(p[k]);
    }
  }
  void tick(int times = 1) {
    for (int i = 0; i < times; ++i) StitchRig::tick(model, state, seam);
  }
  void ticks_following(int times) {
    for (int i = 0; i < times; ++i) tick(), follow();
  }
  // Two passes through the first body; the second leaves it at `out`.
  void through_first(uint32_t out) {
    pass(0, p[5], kOut, p[6], kIn);
    pass(0, p[6], kIn, out, kOut);
    tick();
  }
  // Figure 13 (a) to (c): the thread crosses at p1-p9 and comes back at p12-p4.
  void figure_13() {
    through_first(p[1]);
    pass(1, p[9], kOut, p[14], kIn);
    tick();
    pass(1, p[14], kIn, p[12], kOut);
    tick();
    pass(0, p[4], kOut, p[8], kIn);
    tick();
  }
};

// "If the two most recent suture points are on the same soft body, the thread is simply pulled through without closing the gap
// between tissues yet."
TEST(Midpoint, none_while_the_thread_stays_on_one_body) {
  TwoEdges t;
  t.through_first(t.p[1]);
  t.point[1].span = 0.001f;
  t.tick(200);
  EXPECT_TRUE(t.plan.pair.empty());
  EXPECT_TRUE(t.faults(Fault::wrong_body).empty());
}

// Figure 12 (c): "Since the last two suture points were placed on different soft bodies, the midpoint of the two suture points
// is calculated. (d) p2 and p10 are pulled to their midpoint."
TEST(Midpoint, made_where_the_thread_crosses) {
  TwoEdges t;
  t.through_first(t.p[2]);
  t.pass(1, t.p[10], kOut, t.p[14], kIn);
  t.tick();
  ASSERT_EQ(t.plan.pair.size(), 1u);
  EXPECT_EQ(t.plan.pair[0].midpoint, 1u);
  EXPECT_EQ(t.plan.pair[0].a.particle[0], t.p[2]);
  EXPECT_EQ(t.plan.pair[0].b.particle[0], t.p[10]);
  EXPECT_FLOAT_EQ(t.plan.pair[0].start, 0.009f);
  EXPECT_FLOAT_EQ(t.plan.pair[0].end, t.model.gap);
  const Vec3 before = 0.5f * (xyz(t.x[t.p[2]]) + xyz(t.x[t.p[10]]));
  t.point[3].span = 0.0005f;
  t.ticks_following(120);
  EXPECT_NEAR(t.gap(0), t.model.gap, 1e-6f);
  EXPECT_LT(distance(before, 0.5f * (xyz(t.x[t.p[2]]) + xyz(t.x[t.p[10]]))), 1e-6f);
  t.tick(10);
  EXPECT_EQ(t.plan.pair.size(), 1u) << "once for each crossing";
}

TEST(Midpoint, waits_for_the_bite_to_be_complete) {
  TwoEdges t;
  t.through_first(t.p[2]);
  t.pass(1, t.p[10], kOut, t.p[14], kIn);
  t.bite.back().complete = false;  // the needle can still be withdrawn
  t.tick(5);
  EXPECT_TRUE(t.plan.pair.empty());
  t.bite.back().complete = true;
  t.tick();
  EXPECT_EQ(t.plan.pair.size(), 1u);
}

// The needle strains the thread as it leaves: the span is short then, and springs back to the distance of the edges. Measured
// at that moment alone, no pull would ever count.
TEST(Midpoint, closes_after_the_needle_strained_the_thread) {
  TwoEdges t;
  t.through_first(t.p[2]);
  t.pass(1, t.p[10], kOut, t.p[14], kIn, 0.008f);  // between edges 9 mm apart
  t.tick();
  float& span = t.point[3].span;
  span = 0.0092f;
  t.tick(60);
  EXPECT_EQ(t.plan.pair[0].progress, 0);
  span = 0.0085f;  // drawn through by half a millimeter
  t.tick(60);
  EXPECT_GT(t.plan.pair[0].progress, 0.05f);
}

// "Each pair is pulled to the midpoint of the pair as the needle pulls the thread through."
TEST(Midpoint, follows_the_thread_both_ways_and_never_faster_than_tissue) {
  TwoEdges t;
  t.through_first(t.p[2]);
  t.pass(1, t.p[10], kOut, t.p[14], kIn, 0.1f);
  t.tick();
  float& span = t.point[3].span;
  for (float slack : {0.1f, 0.05f, 0.0091f}) {
    span = slack;
    t.tick(100);
    EXPECT_EQ(t.plan.pair[0].progress, 0) << "slack is pulled out before anything moves";
  }
  float before = 0;
  for (span = 0.009f; span > 0.0015f; span -= 0.0005f) {
    t.tick(60);
    const float now = t.plan.pair[0].progress;
    EXPECT_GT(now, before - 1e-6f);
    EXPECT_NEAR(now, (0.009f - span) / 0.0075f, 1e-3f);
    before = now;
  }
  span = 0.0015f;  // the part round the two edges
  t.tick(60);
  EXPECT_FLOAT_EQ(t.plan.pair[0].progress, 1);
  span = 0.005f;  // the thread is loosened again
  t.tick(60);
  EXPECT_NEAR(t.plan.pair[0].progress, 0.004f / 0.0075f, 1e-3f);
  span = 0.0005f;
  before = t.plan.pair[0].progress;
  for (int i = 0; i < 10; ++i) {
    t.tick();
    EXPECT_LE(t.plan.pair[0].progress, before + t.model.fastest * kTick + 1e-6f);
    before = t.plan.pair[0].progress;
  }
}

TEST(Midpoint, a_thread_that_is_already_short_begins_where_it_is) {
  TwoEdges t;
  t.through_first(t.p[2]);
  t.pass(1, t.p[10], kOut, t.p[14], kIn, 0.006f);  // shorter than the 9 mm across
  t.tick(100);
  EXPECT_EQ(t.plan.pair[0].progress, 0);
  t.point[3].span = 0.0015f;
  t.tick(100);
  EXPECT_FLOAT_EQ(t.plan.pair[0].progress, 1);
}

// Figure 13: "(c) Since two mp have been found, a line between mp1 and mp2 is found and then segmented. The closest particle to
// each segment from both soft bodies is found."
TEST(InBetween, figure_13_pairs_p2_with_p10_and_p3_with_p11) {
  TwoEdges t;
  t.figure_13();
  ASSERT_EQ(t.plan.pair.size(), 4u);
  const auto is = [&](size_t row, uint32_t a, uint32_t b, uint32_t midpoint) {
    EXPECT_EQ(t.plan.pair[row].a.particle[0], t.p[a]) << row;
    EXPECT_EQ(t.plan.pair[row].b.particle[0], t.p[b]) << row;
    EXPECT_EQ(t.plan.pair[row].midpoint, midpoint) << row;
  };
  is(0, 1, 9, 1);
  is(1, 12, 4, 1);  // in the order of the thread
  is(2, 2, 10, 0);
  is(3, 3, 11, 0);
}

// "(d) The suture points p4 and p12 are pulled toward mp2. At the same time, the particles for each segment are pulled
// together."
TEST(InBetween, pairs_close_together_with_the_later_midpoint) {
  TwoEdges t;
  t.figure_13();
  t.point[3].span = 0.0005f;  // the first crossing is tightened
  t.ticks_following(120);
  EXPECT_FLOAT_EQ(t.plan.pair[0].progress, 1);
  for (size_t row : {1u, 2u, 3u}) EXPECT_EQ(t.plan.pair[row].progress, 0) << row;
  t.point[7].span = 0.004f;
  t.ticks_following(120);
  EXPECT_GT(t.plan.pair[1].progress, 0.3f);
  for (size_t row : {2u, 3u}) EXPECT_EQ(t.plan.pair[row].progress, t.plan.pair[1].progress) << row;
  t.point[7].span = 0.0005f;
  t.ticks_following(120);
  for (size_t row = 0; row < 4; ++row) EXPECT_NEAR(t.gap(row), t.model.gap, 1e-6f) << row;
  EXPECT_EQ(t.count(EventKind::seam_closed), 4u) << "each reported once";
}

TEST(InBetween, no_particle_is_in_two_pairs) {
  TwoEdges t;
  t.model.step = 0.001f;  // finer than the edge's particles
  t.figure_13();
  std::set<uint32_t> seen;
  for (const ClosurePlan::Pair& p : t.plan.pair)
    if (!p.midpoint) {
      EXPECT_TRUE(seen.insert(p.a.particle[0]).second);
      EXPECT_TRUE(seen.insert(p.b.particle[0]).second);
    }
  EXPECT_EQ(seen.size(), 8u) << "p1 to p4 and p9 to p12";
}

TEST(Knotted, holds_what_was_made_before_it) {
  TwoEdges t;
  t.through_first(t.p[1]);
  t.pass(1, t.p[9], kOut, t.p[14], kIn);
  t.tick();
  t.point[3].span = 0.0005f;
  t.tick(120);
  t.lock();
  t.tick();
  t.point[3].span = 0.1f;
  t.tick(120);
  EXPECT_FLOAT_EQ(t.plan.pair[0].progress, 1);
  // The seam continues after a tied first crossing.
  t.pass(1, t.p[14], kIn, t.p[12], kOut);
  t.pass(0, t.p[4], kOut, t.p[8], kIn);
  t.tick();
  ASSERT_EQ(t.plan.pair.size(), 4u);
  t.point[7].span = 0.0005f;
  t.tick(120);
  EXPECT_FLOAT_EQ(t.plan.pair[3].progress, 1);
  t.point[7].span = 0.1f;
  t.tick(120);
  EXPECT_EQ(t.plan.pair[3].progress, 0) << "no knot after these";
  EXPECT_FLOAT_EQ(t.plan.pair[0].progress, 1);
}

TEST(Knotted, stays_closed_when_the_next_suture_is_taken_and_opens_untied) {
  for (const bool tied : {true, false}) {
    SCOPED_TRACE(tied);
    TwoEdges t;
    t.figure_13();
    t.point[3].span = t.point[7].span = 0.0005f;
    t.tick(120);
    if (tied) t.lock(), t.tick();
    t.fresh_suture();
    t.tick(120);
    for (const ClosurePlan::Pair& p : t.plan.pair) EXPECT_EQ(p.progress, tied ? 1 : 0);
    // The next suture's first midpoint has no predecessor: there is no line to another suture's.
    t.pass(0, t.p[5], kOut, t.p[2], kOut);
    t.pass(1, t.p[10], kOut, t.p[14], kIn);
    t.tick();
    EXPECT_EQ(t.plan.pair.size(), 5u);
  }
}

TEST(Knotted, a_stitch_that_is_cut_through_opens) {
  TwoEdges t;
  t.figure_13();
  t.point[3].span = t.point[7].span = 0.0005f;
  t.tick(120);
  t.lock();
  t.tick();
  t.now.add({EventKind::technique_fault, 0, 7, 0, {}, Fault::cut_in_stitch});
  t.tick(120);
  for (const ClosurePlan::Pair& p : t.plan.pair) EXPECT_EQ(p.progress, 0);
}

// --- the order of the bites ------------------------------------------------------------------------------------------------

// A bite as a letter: A outside in on the first body, a inside out; B and b on the second; S, T through the serosa alone.
std::vector<Pass> order(const char* letters) {
  std::vector<Pass> pass;
  for (const char* c = letters; *c; ++c) {
    const bool second = *c == 'B' || *c == 'b' || *c == 'T', in = *c == 'a' || *c == 'b', out = *c == 'A' || *c == 'B';
    pass.push_back({static_cast<uint32_t>(pass.size()), second ? 1u : 0u, in, out});
  }
  return pass;
}
std::string judge(const char* letters, Fault (*rule)(std::span<const Pass>)) {
  const std::vector<Pass> pass = order(letters);
  std::string out;
  for (size_t n = 1; n <= pass.size(); ++n) {
    const Fault f = rule(std::span(pass.data(), n));
    out += f == Fault::none ? '.' : f == Fault::wrong_body ? 'x' : 'l';
  }
  return out;
}

// "The needle is passed through one soft body (creating a suture point), then through the same soft body again for a second
// bite, and then the needle crosses over and goes through the other soft body, and so on in an alternating sequence."
TEST(ConnellOrder, in_and_out_then_across) {
  EXPECT_EQ(judge("AaBbAaBbAa", judge_connell), "..........");
  EXPECT_EQ(judge("BbAaBb", judge_connell), "......") << "either side may be first";
}

TEST(ConnellOrder, one_mistake_is_one_fault) {
  EXPECT_EQ(judge("ABbAa", judge_connell), ".x...") << "crossed over after a single bite";
  EXPECT_EQ(judge("AaAaBb", judge_connell), "..x...") << "twice in and out on the same side";
  EXPECT_EQ(judge("AabBAa", judge_connell), "..ll..") << "in from the lumen on the far side: the edge turns out";
  EXPECT_EQ(judge("AaSaBb", judge_connell), "..x...");
  EXPECT_EQ(judge("SaBb", judge_connell), "l...") << "serosa alone";
  EXPECT_EQ(judge("aABb", judge_connell), "ll..") << "begun from inside";
  EXPECT_EQ(judge("AA", judge_connell), ".l");
}

// "Stay sutures are created with a single bite through two different bowels."
TEST(StayOrder, one_side_then_the_other) {
  for (const char* good : {"ST", "TS", "Ab", "AB", "AaBb", "AaT"})
    EXPECT_EQ(judge(good, judge_stay), std::string(strlen(good), '.'));
  EXPECT_EQ(judge("STS", judge_stay), "..x");
  EXPECT_EQ(judge("SSS", judge_stay), "..x");
}

TEST(ConnellOrder, is_told_with_the_bite_and_stops_nothing) {
  TwoEdges t;
  t.pass(0, t.p[5], kOut, t.p[6], kIn);
  t.tick();
  t.pass(1, t.p[9], kOut, t.p[14], kIn);
  t.tick(5);
  t.pass(1, t.p[14], kOut, t.p[12], kIn);  // outside in instead of inside out
  t.tick(5);
  EXPECT_EQ(t.faults(Fault::wrong_body), Bites{1});
  EXPECT_EQ(t.faults(Fault::wrong_layer), Bites{2});
  EXPECT_EQ(t.plan.pair.size(), 1u) << "it is drawn together all the same";
}

TEST(BegunKnot, wants_bites_in_two_walls_and_the_needle_out) {
  TwoEdges t(false);
  t.begin_knot(3);
  t.tick();
  EXPECT_EQ(t.faults(Fault::knot_without_bite), Bites{3});
  t.pass(0, t.p[5], kOut, t.p[2], kOut);
  t.begin_knot();
  t.tick();
  EXPECT_EQ(t.faults(Fault::one_wall_only), Bites{0});
  t.begin_knot();
  t.tick();
  EXPECT_EQ(t.faults(Fault::one_wall_only), Bites{0}) << "reported once";
  t.pass(1, t.p[10], kOut, t.p[14], kOut);
  t.needle_in_tissue = true;
  t.begin_knot();
  t.tick();
  EXPECT_EQ(t.faults(Fault::needle_in_tissue), Bites{1});
  t.fresh_suture();
  t.tick();
  t.needle_in_tissue = false;
  t.begin_knot();
  t.tick();
  EXPECT_EQ(t.faults(Fault::knot_without_bite).size(), 2u) << "a new suture, a new mistake";
}

// The suture room reports it in scenes without a technique too.
TEST(Stay, what_was_told_in_the_tick_is_not_told_again) {
  TwoEdges t(false);
  t.pass(0, t.p[5], kOut, t.p[2], kOut);
  t.pass(1, t.p[10], kOut, t.p[14], kOut);
  t.needle_in_tissue = true;
  t.now.add({EventKind::technique_fault, 0, 1, 0, {}, Fault::needle_in_tissue});
  t.begin_knot();
  t.tick(2);
  EXPECT_EQ(t.faults(Fault::needle_in_tissue), Bites{1});
}

// Figure 14: one bite through each, approximated, tied.
TEST(Stay, a_good_one_has_no_fault) {
  TwoEdges t(false);
  t.pass(0, t.p[5], kOut, t.p[2], kOut);
  t.tick();
  t.pass(1, t.p[10], kOut, t.p[14], kOut);
  t.tick();
  t.point[1].span = 0.0005f;
  t.ticks_following(120);
  t.begin_knot();
  t.lock();
  t.tick();
  EXPECT_EQ(t.count(EventKind::technique_fault), 0u);
  ASSERT_EQ(t.plan.pair.size(), 1u);
  EXPECT_LT(t.gap(0), 0.001f);
}

}  // namespace
}  // namespace catgut
