// SPDX-License-Identifier: Apache-2.0
// tests/assess: cuts made by construction: the bowel of the scene `excision`, moved rigidly, with a cut edge at known distances
// from the rim and with known bridges; and a pen that its commands switch on and off.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>

#include "assess/metrics.h"
#include "assess/rubric.h"
#include "procedure/scene_file.h"
#include "runtime/assessment.h"
#include "sim/simulation.h"

namespace catgut::assess {
namespace {

struct World {
  SceneSpec scene = read_scene("excision");
  PictureModel picture;
  Snapshot start;
  World() {
    const auto model = build_model(scene);
    picture = picture_model(*model);
    publish(*model, *initial_state(*model), start);
  }
};
const World& world() {
  static const World w;
  return w;
}

Facts facts() {
  Setup setup;
  setup.wall = static_cast<double>(world().scene.body[0].wall) * 1000, setup.technique = "none";
  return begin_facts(world().picture, setup);
}

// Points of a cut edge every 0.4 mm round the axis, on both sides of the wall; depth [mm] from the rim by angle [rad], below
// zero where nothing is cut.
Snapshot with_cut(const std::function<double(double)>& depth) {
  const BodySpec& bowel = world().scene.body[0];
  auto picture = std::make_shared<PictureModel>(world().picture);
  VisibleMesh& mesh = picture->body[0];
  const std::vector<uint32_t>& rim = picture->rim[0];
  // Round the rim's own corners, so that a place is on the wall's surface.
  std::vector<Vec3> corner;
  for (const uint32_t i : rim) corner.push_back(picture->particle_rest[i]);
  for (size_t i = 0; i < corner.size(); ++i) {
    const Vec3 a = corner[i], b = corner[(i + 1) % corner.size()];
    const int steps = static_cast<int>(std::ceil(distance(a, b) / 4e-4f));
    for (int k = 0; k < steps; ++k) {
      const Vec3 at = lerp(a, b, static_cast<float>(k) / static_cast<float>(steps));
      double angle = std::atan2(static_cast<double>(at.z), static_cast<double>(at.x));
      if (angle < 0) angle += 6.283185307179586;
      const double d = depth(angle);
      if (d < 0) continue;
      const Vec3 outward = normalized(Vec3{at.x, 0, at.z});
      for (const float in : {0.0f, bowel.wall}) {
        mesh.position.push_back(at - Vec3{0, static_cast<float>(d * 1e-3), 0} - outward * in);
        mesh.layer.push_back(TissueLayer::cut_edge);
        mesh.skin_particle.push_back({rim[i], rim[i], rim[i], rim[i]});
        mesh.skin_weight.push_back({1, 0, 0, 0});
      }
    }
  }
  Snapshot seen = world().start;
  for (Vec3& p : seen.particle) p = rotate(axis_angle({0.3f, 1, 0.2f}, 0.4f), p) + Vec3{0.03f, -0.02f, 0.05f};
  seen.topology.version = 1, seen.topology.pieces = 2;
  seen.topology.picture = decltype(seen.topology.picture)(std::shared_ptr<const PictureModel>(picture));
  return seen;
}

TEST(Cuts, the_distance_from_the_rim_within_a_tenth_of_a_millimeter) {
  for (const double mm : {3.0, 6.0, 9.5}) {
    const Result r = measure(facts(), world().picture, with_cut([&](double) { return mm; }));
    EXPECT_NEAR(r.value("cut_edge"), mm, 0.1);
    EXPECT_LT(r.value("cut_spread"), 0.05);
    EXPECT_EQ(r.value("bridges"), 0);
    EXPECT_EQ(r.value("pieces"), 2);
  }
}

TEST(Cuts, a_spiral_is_uneven) {  // 2 mm in one turn: the standard deviation of a uniform distribution
  const Result r = measure(facts(), world().picture, with_cut([](double angle) { return 5 + 2 * angle / 6.283185307; }));
  EXPECT_NEAR(r.value("cut_edge"), 6, 0.1);
  EXPECT_NEAR(r.value("cut_spread"), 2 / std::sqrt(12.0), 0.05);
}

TEST(Cuts, bridges_are_found_with_their_lengths) {
  const double radius = static_cast<double>(world().scene.body[0].radius) * 1000;
  for (const double mm : {4.0, 10.0}) {
    const double half = 0.5 * mm / radius;
    const auto gap = [&](double angle, double at) { return std::abs(angle - at) < half; };
    const auto cut = [&](double angle) { return gap(angle, 1) || gap(angle, 4) ? -1.0 : 6.0; };
    const Result r = measure(facts(), world().picture, with_cut(cut));
    for (const Metric& m : r.metric) {
      if (m.key != "bridges") continue;
      ASSERT_EQ(m.sample.size(), 2u) << mm;
      for (const Sample& s : m.sample) EXPECT_NEAR(s.value, mm, 1.1) << "stretches of 1 mm";
    }
  }
  // Over the start of the rim too: one bridge, not two.
  const Result r =
      measure(facts(), world().picture, with_cut([](double angle) { return angle < 0.3 || angle > 5.9 ? -1.0 : 6.0; }));
  EXPECT_NEAR(r.value("bridges"), (0.3 + 6.2832 - 5.9) * radius, 1.1);
  // Scored only: nothing is divided.
  const Result scored = measure(facts(), world().picture, with_cut([](double) { return -1.0; }));
  EXPECT_TRUE(std::isnan(scored.value("cut_edge")));
  EXPECT_NEAR(scored.value("bridges"), 2 * 3.14159 * radius, 1);
}

TEST(Cuts, a_cut_that_stops_early_scores_its_part) {
  const Rubric rubric = read_rubric("excision");
  double before = 0;
  for (const double share : {0.0, 0.25, 0.5, 0.75, 1.0}) {
    Snapshot seen = with_cut([&](double angle) { return angle < 6.2832 * share ? 6.0 : -1.0; });
    if (share < 1) seen.topology.pieces = 1;
    const Score s = mark(rubric, measure(facts(), world().picture, seen));
    EXPECT_GE(s.percent, before) << share;
    EXPECT_NEAR(s.completed, std::min(1.0, share * 78 / 70), 0.03) << share;
    EXPECT_TRUE(share > 0 || s.percent == 0);
    EXPECT_TRUE(share == 1 || !s.passed) << share;
    before = s.percent;
  }
}

TEST(Cuts, without_a_cut_nothing_is_observed) {
  const Result r = measure(facts(), world().picture, world().start);
  for (const char* key : {"cut_edge", "cut_spread", "bridges", "energy_time"}) EXPECT_TRUE(std::isnan(r.value(key))) << key;
  EXPECT_FALSE(mark(read_rubric("excision"), r).passed);
  const auto stay = build_model(read_scene("stay"));  // and without a pen neither are pieces
  Snapshot seen;
  publish(*stay, *initial_state(*stay), seen);
  const PictureModel picture = picture_model(*stay);
  EXPECT_TRUE(std::isnan(measure(begin_facts(picture, {}), picture, seen).value("pieces")));
}

TEST(Cuts, the_time_in_which_the_pen_is_switched_on) {
  Facts f = facts();
  Snapshot seen = world().start;
  TickInput input;
  int pen = -1;
  for (size_t i = 0; i < world().picture.instrument.size(); ++i)
    if (world().picture.instrument[i].capabilities & kCauterize) pen = static_cast<int>(i);
  ASSERT_GE(pen, 0);
  ASSERT_EQ(seen.tool[0].instrument, pen) << "the pen is in the right hand";
  const auto ticks = [&](int n, std::vector<Command> commands = {}) {
    for (int i = 0; i < n; ++i) {
      ++seen.tick;
      input.commands.clear();
      for (const Command& c : commands) input.commands.push(c);
      commands.clear();
      note(f, world().picture, seen, input);
    }
  };
  const auto seconds = [&] { return measure(f, world().picture, seen).value("energy_time"); };
  ticks(60);
  EXPECT_EQ(seconds(), 0);
  ticks(60, {{CommandKind::cut, 0, 0}});
  EXPECT_NEAR(seconds(), 1, 1e-9);
  ticks(60, {{CommandKind::new_suture, 0, 0}});  // from cutting to coagulation
  EXPECT_NEAR(seconds(), 2, 1e-9);
  ticks(60, {{CommandKind::new_suture, 0, 0}});  // off
  EXPECT_NEAR(seconds(), 2, 1e-9);
  ticks(60, {{CommandKind::cut, 1, 0}});  // the other hand holds no pen
  EXPECT_NEAR(seconds(), 2, 1e-9);
  ticks(30, {{CommandKind::cut, 0, 0}});
  seen.instrument[static_cast<size_t>(pen)].place = InstrumentPlace::tray;  // laid down: off, also when taken up again
  ticks(30);
  seen.instrument[static_cast<size_t>(pen)].place = InstrumentPlace::hand;
  ticks(30);
  EXPECT_NEAR(seconds(), 2.5, 1e-9);
  // What was undone never happened.
  const Tally then = f;
  ticks(60, {{CommandKind::cut, 0, 0}});
  rewind(f, then);
  EXPECT_NEAR(seconds(), 2.5, 1e-9);
}

TEST(Cuts, blood_and_burns_are_those_of_the_wound) {
  Snapshot seen = with_cut([](double) { return 6.0; });
  const auto value = [&](const char* key) {
    Facts f = begin_facts(world().picture, {});
    TickInput input;
    input.hand[0].connected = 1;
    note(f, world().picture, seen, input);
    return measure(f, world().picture, seen).value(key);
  };
  EXPECT_EQ(value("blood_loss"), 0) << "no vessel was opened";
  seen.wound.bleeding = {{{0.01f, 0, 0}, 2e-8f, 1.5e-6f}, {{0, 0.01f, 0}, 0, 0.25e-6f}};
  seen.wound.thermal_spread = 1.2e-3f, seen.wound.damaged = 80e-6f;
  EXPECT_NEAR(value("blood_loss"), 1.75, 1e-6);
  EXPECT_NEAR(value("thermal_spread"), 1.2, 1e-6);
  EXPECT_NEAR(value("burnt_area"), 80, 1e-4);
}

// The scripted surgeon's excision: all of it a minute of simulated time, so for the nightly tests.
TEST(Cuts, an_excision_is_measured_on_the_tissue_that_was_cut) {
  if (!std::getenv("CATGUT_LONG")) GTEST_SKIP() << "set CATGUT_LONG=1";
  const SceneSpec& scene = world().scene;
  SessionOptions options;
  SessionHooks hooks;
  Assessor assessor(scene);
  assessor.attach(hooks);
  const RunResult run = run_session(scene, options, hooks);
  const Result r = assessor.finish(run, {read_rubric("excision")});
  EXPECT_EQ(r.value("pieces"), 2);
  EXPECT_EQ(r.value("bridges"), 0);
  const double line = static_cast<double>(scene.surgeon.edge_distance) * 1000;
  EXPECT_NEAR(r.value("cut_edge"), line, 0.3);
  for (const Metric& m : r.metric) {
    if (m.key != "cut_edge") continue;
    for (const Sample& s : m.sample) EXPECT_NEAR(s.value, line, 1.5) << s.of << ": the scene's own limit";
  }
  // Once round at the surgeon's speed, and the overlap.
  const double round_s = 6.2832 * static_cast<double>(scene.body[0].radius / scene.surgeon.drive_speed);
  EXPECT_GT(r.value("energy_time"), round_s);
  EXPECT_LT(r.value("energy_time"), 1.2 * round_s);
  EXPECT_TRUE(r.score[0].passed) << r.score[0].verdict;
  std::printf("%.1f %%; cut at %.2f mm (spread %.2f mm), bridges %.1f mm, %.0f pieces, energy for %.1f s\n", r.score[0].percent,
              r.value("cut_edge"), r.value("cut_spread"), r.value("bridges"), r.value("pieces"), r.value("energy_time"));
  std::printf("blood %.2f ml, thermal spread %.2f mm, burnt %.0f mm^2\n", r.value("blood_loss"), r.value("thermal_spread"),
              r.value("burnt_area"));
  for (const LostPoint& l : r.score[0].lost) std::printf("  -%.1f %s\n", l.points, l.why.c_str());
}

}  // namespace
}  // namespace catgut::assess
