// SPDX-License-Identifier: Apache-2.0
// tests/assess: a stitched session made by construction (made_session.h): its known numbers are measured, and 29 kinds of
// errors are put in one by one and found.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <functional>
#include <set>

#include "assess/feedback.h"
#include "assess/metrics.h"
#include "assess/rubric.h"
#include "made_session.h"

namespace catgut::assess {
namespace {

using namespace made;

TEST(GroundTruth, bites_within_a_tenth_of_a_millimeter_and_one_degree) {
  // Every tenth in every build, all with CATGUT_LONG=1 (the nightly run).
  const size_t every = std::getenv("CATGUT_LONG") ? 1 : 10;
  size_t checked = 0;
  for (const double near : {1.5, 3.0, 5.0})
    for (const double length : {3.0, 7.0})
      for (const double tilt : {90.0, 60.0, 35.0})
        for (const double depth : {0.4, 0.9, 1.5})
          for (const double angle : {-30.0, 11.0, 140.0}) {
            if (checked++ % every != 0) continue;
            Session s;
            Plan p;
            p.wall = static_cast<uint32_t>(checked / every % 2);
            p.edge_in = near + length, p.edge_out = near, p.angle_in = p.angle_out = angle;
            p.tilt = tilt, p.tip_depth = depth;
            s.bite(p);
            const Result r = s.result();
            ASSERT_EQ(r.bite.size(), 1u);
            const Bite& b = r.bite[0];
            EXPECT_NEAR(b.edge_in, near + length, 0.1);
            EXPECT_NEAR(b.edge_out, near, 0.1);
            EXPECT_NEAR(b.length, length, 0.1);
            EXPECT_NEAR(b.entry_angle, tilt, 1) << "angle " << angle;
            EXPECT_NEAR(b.exit_angle, tilt, 1) << "angle " << angle;
            EXPECT_NEAR(b.edge_angle, 90, 1);
            EXPECT_NEAR(b.depth, depth, 0.1) << near << ' ' << length << ' ' << tilt << ' ' << angle;
          }
  EXPECT_EQ(checked, 162u);
}

TEST(GroundTruth, spacing_and_direction_along_the_edge) {
  for (const double apart : {3.0, 5.0, 9.0})
    for (const double oblique : {0.0, 2.0, 4.0}) {  // [mm] along the edge within a bite
      Session s;
      const double per_mm = 1 / static_cast<double>(kRadius * 1000) * 57.29577951308232;
      Plan p;
      p.edge_in = 8, p.edge_out = 4;
      p.angle_in = 0, p.angle_out = oblique * per_mm;
      s.bite(p);
      p.angle_in = (oblique + apart) * per_mm, p.angle_out = (2 * oblique + apart) * per_mm;
      s.bite(p);
      const Result r = s.result();
      EXPECT_NEAR(r.bite[1].spacing, apart, 0.1);
      EXPECT_NEAR(r.bite[0].edge_angle, std::atan2(4.0, oblique) * 57.29577951308232, 1);
    }
}

TEST(GroundTruth, both_sides_of_a_stitch) {
  for (const double offset : {0.0, 1.0, 3.0})
    for (const double more : {0.0, 1.0, 2.5}) {
      Session s;
      Plan left, right;
      left.edge_in = 8, left.edge_out = 4;
      right.wall = 1, right.edge_in = 4 + more, right.edge_out = 8 + more;
      right.angle_in = right.angle_out = offset / static_cast<double>(kRadius * 1000) * 57.29577951308232;
      s.bite(left), s.bite(right);
      const Result r = s.result();
      EXPECT_NEAR(r.value("mirror_edge"), more, 0.1);
      EXPECT_NEAR(r.value("mirror_offset"), offset, 0.1);
    }
}

TEST(GroundTruth, what_a_hand_holds) {
  for (const double at : {0.2, 0.5})
    for (const double angle : {90.0, 70.0, 45.0}) {
      Session s;
      Plan p;
      p.grasp_at = at, p.grasp_angle = angle;
      s.bite(p);
      EXPECT_NEAR(s.result().bite[0].grasp_at, at, 1e-6);
      EXPECT_NEAR(s.result().bite[0].grasp_angle, angle, 1);
    }
}

// The phases of a bite and of a knot, in ticks of the made session.
TEST(GroundTruth, times_of_phases) {
  Session s;
  const uint64_t start = s.facts().first;
  Plan p;
  s.bite(p);
  const Result first = s.result();
  EXPECT_NEAR(first.value("handling_time"), static_cast<double>(first.bite[0].entered - start) * kDt, 1e-9);
  EXPECT_NEAR(first.value("handling_time"), 6 * kDt, 1e-9) << "a tick with the hands, five with the needle";
  EXPECT_NEAR(first.value("withdrawal_time"), 20 * kDt, 1e-9) << "twenty ticks from the tip's exit to the end";
  s.tick(90);
  s.bite(p);
  const Metric* handling = s.result().find("handling_time");
  ASSERT_EQ(handling->sample.size(), 2u);
  EXPECT_NEAR(handling->sample[1].value, (90 + 10) * kDt, 1e-9) << "from the end of the first bite";
  EXPECT_TRUE(std::isnan(s.result().value("finish_time"))) << "nothing is cut";
  s.knot(kSquare);
  s.tick(120);
  s.happen(EventKind::thread_cut, 0, 0.005f);
  s.tick();
  EXPECT_NEAR(s.result().value("finish_time"), 121 * kDt, 1e-9);
}

TEST(GroundTruth, tissue_that_moves_with_the_needle) {
  for (const double shift : {0.0, 0.5, 3.0}) {
    Session s;
    Plan p;
    p.shift = shift;
    s.bite(p);
    EXPECT_NEAR(s.result().value("tissue_shift"), shift, 0.01);
  }
}

TEST(GroundTruth, smoothness_of_driving) {
  Session smooth, shaken;
  Plan p;
  p.sweep = 100;  // far, for the rounding of positions
  smooth.bite(p);
  EXPECT_NEAR(smooth.result().value("drive_ldlj"), -std::log(204.8), 0.1) << "minimum jerk: Balasubramanian 2015";
  p.wander = 0.3;
  shaken.bite(p);
  EXPECT_LT(shaken.result().value("drive_ldlj"), smooth.result().value("drive_ldlj") - 1);
}

TEST(GroundTruth, a_needle_that_is_turned_back_and_forth) {
  for (const double rock : {10.0, 30.0}) {
    Session s;
    Plan p;
    p.tilt = 60, p.rock = rock;  // in at 60 degrees and out at 60: 120 degrees of turn
    s.bite(p);
    EXPECT_NEAR(s.result().value("drive_turn"), (120 + 2 * rock) / 120, 0.01);
  }
}

TEST(GroundTruth, approach_of_the_tip) {
  // Two legs of 12 mm and 9 mm at a right angle: 21 mm for a distance of 15 mm.
  for (const bool bent : {false, true}) {
    Session s;
    Pose& needle = s.seen().active().needle.pose;
    const Vec3 from = needle.p;
    for (int k = 1; k <= 21; ++k) {
      const float a = static_cast<float>(bent ? std::min(k, 12) : k) * 1e-3f,
                  b = static_cast<float>(bent ? std::max(k - 12, 0) : 0) * 1e-3f;
      needle.p = from + Vec3{a, b, 0};
      s.tick();
    }
    // The judged part begins where the tip is at least 10 mm away: at the corner's side, 5 mm before it.
    const double distance = std::hypot(5.0, 9.0), expected = bent ? (5 + 9) / distance : 1;
    s.happen(EventKind::tip_entered, 0);
    s.seen().active().bite.emplace_back();
    s.seen().active().bite.back().entry = needle.p;
    s.tick();
    ASSERT_EQ(s.facts().open.size(), 1u);
    EXPECT_NEAR(s.facts().open[0].approach, expected, 1e-3);
  }
}

TEST(GroundTruth, change_of_force_and_turn_of_a_hand) {
  Session s;
  s.twist = 0.01f;  // [rad] per tick
  // Up to 4 N and down again, 2 N/s: in steps of 0.1 s.
  for (int k = 0; k <= 240; ++k) {
    SuturePointView p;
    p.position = s.moved({});
    p.tension_needle = static_cast<float>(2 * (k < 120 ? k : 240 - k)) / 60;
    s.seen().active().suture_point.assign(1, p);
    s.tick();
  }
  EXPECT_NEAR(s.result().value("force_rate"), 2, 0.05);
  EXPECT_NEAR(s.result().value("thread_impulse"), 0.5 * 4 * 4, 0.05) << "4 s, 4 N at their middle";
  const double turned = static_cast<double>(s.facts().last - s.facts().first) * 0.01 * 57.29577951308232;
  EXPECT_NEAR(s.result().value("rotation"), turned, 4) << "samples every 0.1 s: up to 5 ticks, 2.9 degrees, are not in it";
}

// --- injected errors ---------------------------------------------------------------------------------------------------

struct Injected {
  const char* name;
  const char* item;  // of the rubric, that must lose points
  std::function<void(Script&)> put;
};

Script changed(const std::function<void(Script&)>& put) {
  Script s;
  put(s);
  return s;
}

const std::vector<Injected>& injected() {
  static const std::vector<Injected> all{
      {"entry too near", "edge_near", [](Script& s) { s.bite[1].edge_in = 0.6; }},
      {"exit too near", "edge_near", [](Script& s) { s.bite[0].edge_out = 0.6; }},
      {"entry too far", "edge_far", [](Script& s) { s.bite[0].edge_in = 13; }},
      {"exit too far", "edge_far", [](Script& s) { s.bite[1].edge_out = 13; }},
      {"too wide a spacing", "spacing",
       [](Script& s) {
         for (size_t i : {2u, 3u}) s.bite[i].angle_in += 17, s.bite[i].angle_out += 17;
       }},
      {"too narrow a spacing", "spacing",
       [](Script& s) {
         for (size_t i : {2u, 3u}) s.bite[i].angle_in -= 8, s.bite[i].angle_out -= 8;
       }},
      {"too shallow", "layers", [](Script& s) { s.bite[2].tip_depth = 0.12; }},
      {"full thickness where it must not be", "full", [](Script& s) { s.bite[0].through = true; }},
      {"oblique entry", "entry_angle", [](Script& s) { s.bite[1].tilt = 40; }},
      {"oblique to the edge", "edge_angle", [](Script& s) { s.bite[0].angle_out += 9; }},
      {"unequal sides", "mirror_edge", [](Script& s) { s.bite[1].edge_in += 2.5, s.bite[1].edge_out += 2.5; }},
      {"offset sides", "mirror_offset", [](Script& s) { s.bite[1].angle_in += 9, s.bite[1].angle_out += 9; }},
      {"repeated bite", "attempts", [](Script& s) { s.bite[2].attempts = 3; }},
      {"needle off its curve", "needle_wander", [](Script& s) { s.bite[3].wander = 3; }},
      {"needle held at its tip", "grasp_at", [](Script& s) { s.bite[0].grasp_at = 0.9; }},
      {"needle held askew", "grasp_angle", [](Script& s) { s.bite[0].grasp_angle = 50; }},
      {"needle grasped again and again", "needle_grasps", [](Script& s) { s.bite[0].grasps = 6; }},
      {"granny knot", "square", [](Script& s) { s.knot[1].chirality = s.knot[2].chirality = 1; }},
      {"too few throws", "throws", [](Script& s) { s.knot.resize(1); }},
      {"one wrap in the first throw", "first_wraps", [](Script& s) { s.knot[0].wraps = 1; }},
      {"air knot", "knot_gap", [](Script& s) { s.knot[0].gap = 0.004f; }},
      {"air between throws", "throw_gap", [](Script& s) { s.knot[1].gap = 0.004f; }},
      {"loose knot", "knot_tension", [](Script& s) { s.knot[0].tension = 0.02f; }},
      {"knot pulled too hard", "knot_tension", [](Script& s) { s.knot[0].tension = 6; }},
      {"tail too short", "tail", [](Script& s) { s.tail = 0.0005f; }},
      {"tail too long", "tail", [](Script& s) { s.tail = 0.03f; }},
      {"gap left", "gap", [](Script& s) { s.gap = 3.5; }},
      {"lost loop", "undone_throws", [](Script& s) { s.after = [](Session& x) { x.happen(EventKind::loop_released); }; }},
      {"wrong order", "order_errors",
       [](Script& s) { s.after = [](Session& x) { x.happen(EventKind::bite_out_of_order, 1); }; }},
      {"wrong wall", "order_errors",
       [](Script& s) { s.after = [](Session& x) { x.happen(EventKind::technique_fault, 1, 0, Fault::wrong_body); }; }},
      {"cut before the knot", "faults",
       [](Script& s) { s.after = [](Session& x) { x.happen(EventKind::technique_fault, 1, 0, Fault::cut_before_knot); }; }},
      {"needle slipped", "slips", [](Script& s) { s.after = [](Session& x) { x.happen(EventKind::needle_released, 0, 5); }; }},
      {"missed grasp", "missed_grasps", [](Script& s) { s.after = [](Session& x) { x.grasp_nothing(); }; }},
      {"thread pulled too hard", "overloads", [](Script& s) { s.after = [](Session& x) { x.tension(5); }; }},
      {"tissue torn from a grasp", "tissue_slips",
       [](Script& s) { s.after = [](Session& x) { x.happen(EventKind::tissue_released, 0, 4); }; }},
      {"tissue pulled too hard", "grasp_force", [](Script& s) { s.after = [](Session& x) { x.pull_tissue(9); }; }},
      {"everted edge", "eversion", [](Script& s) { s.after = [](Session& x) { x.lean(60); }; }},
      {"narrowed lumen", "lumen", [](Script& s) { s.after = [](Session& x) { x.narrow(0.6f); }; }},
      {"tremor", "tremor", [](Script& s) { s.before = [](Session& x) { x.shake = 0.0005f; }; }},
      {"both hands wait", "pause", [](Script& s) { s.before = [](Session& x) { x.all_idle = true; }; }},
  };
  return all;
}

// The shipped rubric of an interrupted stitch, with one more item for sero-muscular bites.
const Rubric& interrupted() {
  static const Rubric r = [] {
    Rubric made = read_rubric("interrupted_tie");
    RubricItem full;
    full.key = "full", full.title = "never through the wall", full.metric = "depth";
    full.full = full.half = {0, 0.99};
    made.item.push_back(full);
    return made;
  }();
  return r;
}

std::string list(const Score& s) {
  std::string out;
  for (const LostPoint& l : s.lost) out += "  " + l.item + ": " + l.why + "\n";
  return out;
}

TEST(InjectedErrors, none_is_found_in_clean_runs) {
  // Clean variants: everything within the bands.
  for (int k = 0; k < 20; ++k) {
    Script s;
    const double d = k / 20.0;
    for (Plan& p : s.bite) p.tip_depth = 1.1 + 0.4 * d, p.tilt = 90 - 15 * d;
    for (KnotThrow& t : s.knot) t.tension = static_cast<float>(0.5 + d);
    const Result r = s.run();
    Score score = mark(interrupted(), r);
    // The stitch takes 4 to 8 mm, as a Lembert does: entry and exit each from the edge are not judged here.
    std::erase_if(score.lost, [](const LostPoint& l) { return l.item == "edge_in" || l.item == "edge_out"; });
    EXPECT_TRUE(score.lost.empty()) << "variant " << k << "\n" << list(score);
  }
}

TEST(InjectedErrors, each_is_found) {
  EXPECT_GE(injected().size(), 25u);
  Rubric rubric = interrupted();
  std::erase_if(rubric.item, [](const RubricItem& i) { return i.key == "edge_in" || i.key == "edge_out"; });
  RubricItem near, far;
  near.key = near.metric = "edge_near", near.title = "near end", near.full = near.half = {2, 5};
  far.key = far.metric = "edge_far", far.title = "far end", far.full = far.half = {6, 10};
  rubric.item.push_back(near), rubric.item.push_back(far);
  for (const Injected& e : injected()) {
    const Score score = mark(rubric, changed(e.put).run());
    const auto found = std::find_if(score.lost.begin(), score.lost.end(), [&](const LostPoint& l) { return l.item == e.item; });
    ASSERT_NE(found, score.lost.end()) << e.name << " is not found\n" << list(score);
    EXPECT_GT(found->points, 0) << e.name;
    EXPECT_GT(found->tick, 0u) << e.name;
    EXPECT_NE(found->why.find("required"), std::string::npos) << e.name;
  }
}

// --- feedback while sewing -----------------------------------------------------------------------------------------------

TEST(Feedback, cues_give_the_numbers_of_a_bite_that_would_begin_now) {
  const CueSource source = cue_source(world().picture, static_cast<double>(kWall) * 1000);
  const auto text_of = [](const std::vector<Cue>& cues, std::string_view name) {
    for (const Cue& c : cues)
      if (c.text.rfind(name, 0) == 0) return c;
    return Cue{"none", false};
  };
  Session s;
  s.aim(0, 4, 75);
  const std::vector<Cue> good = cues_now(interrupted(), source, world().picture, s.seen());
  const auto number_of = [](const Cue& c, size_t skip) { return std::strtod(c.text.c_str() + skip, nullptr); };
  EXPECT_NEAR(number_of(text_of(good, "edge"), 5), 4, 0.11) << text_of(good, "edge").text;
  EXPECT_TRUE(text_of(good, "edge").good);
  EXPECT_NEAR(number_of(text_of(good, "entry angle"), 12), 75, 1);
  s.aim(1, 9, 30);
  const std::vector<Cue> bad = cues_now(interrupted(), source, world().picture, s.seen());
  EXPECT_NEAR(number_of(text_of(bad, "edge"), 5), 9, 0.11) << text_of(bad, "edge").text;
  EXPECT_FALSE(text_of(bad, "edge").good);
  EXPECT_FALSE(text_of(bad, "entry angle").good);
  SuturePointView pulled;
  pulled.tension_needle = 3;
  s.seen().active().suture_point.push_back(pulled);
  EXPECT_FALSE(text_of(cues_now(interrupted(), source, world().picture, s.seen()), "thread 3.0 N").good);
  s.seen().tool[0].held = Held::nothing;
  s.seen().active().suture_point.clear();
  EXPECT_TRUE(cues_now(interrupted(), source, world().picture, s.seen()).empty()) << "without a needle in a hand: silence";
}

TEST(Feedback, a_remark_follows_the_stitch_that_left_its_band) {
  Session s;
  Plan good;
  good.edge_in = 4, good.edge_out = 3.5, good.wall = 0;
  s.bite(good);
  const uint64_t first = s.seen().tick;
  const std::vector<Remark> nothing_wrong = remarks_since(interrupted(), s.facts(), 0);
  ASSERT_EQ(nothing_wrong.size(), 1u) << nothing_wrong[0].text;
  EXPECT_TRUE(nothing_wrong[0].good);
  Plan far = good;
  far.edge_in = 13, far.angle_in = far.angle_out = 12;
  s.bite(far);
  const std::vector<Remark> wrong = remarks_since(interrupted(), s.facts(), first);
  ASSERT_FALSE(wrong.empty());
  EXPECT_NE(wrong[0].text.find("13"), std::string::npos) << wrong[0].text;
  for (const Remark& r : wrong) EXPECT_TRUE(!r.good && r.tick > first) << r.text;
}

TEST(Feedback, facts_taken_back_and_continued_give_the_bytes_of_the_straight_way) {
  Session straight, detour;
  Plan a, b, c;
  a.edge_in = 4, b.edge_in = 12, b.attempts = 3, c.edge_in = 5, c.angle_in = c.angle_out = 15;
  straight.bite(a), detour.bite(a);
  const Session then = detour;
  detour.bite(b);
  detour.tension(5);
  EXPECT_NE(result_json(detour.result()), result_json(then.result()));
  detour.go_back_to(then);
  EXPECT_EQ(result_json(detour.result()), result_json(then.result()));
  straight.bite(c), detour.bite(c);
  EXPECT_EQ(result_json(detour.result()), result_json(straight.result()));
}

TEST(Result, equal_sessions_give_equal_bytes) {
  const Script s;
  EXPECT_EQ(result_json(s.run()), result_json(s.run()));
  EXPECT_EQ(result_csv(s.run()), result_csv(s.run()));
}

}  // namespace
}  // namespace catgut::assess
