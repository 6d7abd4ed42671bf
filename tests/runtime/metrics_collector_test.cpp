// SPDX-License-Identifier: Apache-2.0
// tests/runtime: the results of a run, from synthetic snapshots.
#include "runtime/metrics_collector.h"

#include <gtest/gtest.h>

#include <cmath>

#include "procedure/scene_fields.h"
#include "runtime/report.h"

namespace catgut {
namespace {

struct Judged {
  SceneSpec scene;
  PictureModel picture;
  Snapshot seen;
  std::unique_ptr<MetricsCollector> collector;

  Judged() {
    scene.thread.particles = 11;
    scene.thread.spacing = 0.01f;
    picture.suture[0].thread_count = 11;
    picture.suture[0].thread_spacing = 0.01f;
    for (uint32_t i = 0; i < 11; ++i) {
      seen.particle.push_back({0.01f * static_cast<float>(i), 0, 0});
      seen.active().thread_order.push_back(i);
    }
    collector = std::make_unique<MetricsCollector>(scene, picture);
  }
  void add(EventKind kind, uint32_t which = 0, float value = 0) { seen.event.push_back({kind, 0, which, value, {}}); }
  void add(Fault fault, uint32_t which) { seen.event.push_back({EventKind::technique_fault, 0, which, 0, {}, fault}); }
  void tick() {
    collector->tick(seen);
    seen.event.clear();
  }
  RunResult result() const {
    RunResult r;
    collector->finish(seen, r);
    return r;
  }
};

TEST(MetricsCollector, every_result_has_a_value) {
  const RunResult r = Judged().result();
  for (const ResultName& name : result_names()) EXPECT_TRUE(r.value.count(name.name)) << name.name;
}

TEST(MetricsCollector, knots_and_throws_are_counted_through_settling) {
  Judged j;
  for (uint32_t suture = 0; suture < 5; ++suture) {
    j.add(EventKind::throw_locked, 0), j.tick();
    j.add(EventKind::throw_locked, 0);
    if (suture == 2) j.add(EventKind::throw_locked, 1);  // a second knot on the same thread
    j.tick();
    if (suture == 4) break;
    j.seen.settled.emplace_back();
    j.add(EventKind::suture_baked, suture), j.add(EventKind::suture_loaded, suture), j.tick();
  }
  RunResult r = j.result();
  EXPECT_EQ(r.value["knots"], 6);
  EXPECT_EQ(r.value["throws"], 11);
  EXPECT_EQ(r.value["last_knot_throws"], 2);
  EXPECT_EQ(r.value["sutures"], 5) << "four settled, one in hand";
}

// Knots are numbered from 0 in every suture: the first of one is not a throw more on the first of another.
TEST(MetricsCollector, knots_of_two_sutures_are_counted_apart) {
  Judged j;
  j.seen.suture.resize(2);
  j.picture.suture.resize(2);
  j.picture.suture[1].thread_count = 0;
  j.collector = std::make_unique<MetricsCollector>(j.scene, j.picture);
  const auto add = [&](EventKind kind, uint16_t suture) {
    j.add(kind, 0);
    j.seen.event.back().suture = suture;
    j.tick();
  };
  add(EventKind::throw_locked, 0), add(EventKind::throw_locked, 1), add(EventKind::throw_locked, 1);
  EXPECT_EQ(j.result().value["knots"], 2);
  EXPECT_EQ(j.result().value["throws"], 3);
  EXPECT_EQ(j.result().value["last_knot_throws"], 2);
  EXPECT_EQ(j.result().value["sutures"], 2);
  // One is baked: the throws of the other stay its own.
  j.seen.settled.emplace_back();
  add(EventKind::suture_baked, 1), add(EventKind::suture_loaded, 1), add(EventKind::throw_locked, 0);
  EXPECT_EQ(j.result().value["knots"], 2);
  EXPECT_EQ(j.result().value["last_knot_throws"], 2);
  EXPECT_EQ(j.result().value["sutures"], 2) << "one baked, one tied";
}

// Two square openings face to face, 2 mm apart.
void face_to_face(Judged& j) {
  j.scene.body.assign(2, {});
  for (BodySpec& b : j.scene.body) b.wall = 0.002f;
  j.picture.rim.resize(2);
  for (uint32_t rim = 0; rim < 2; ++rim)
    for (const Vec3 corner : {Vec3{0, 0.010f, 0}, Vec3{0, 0, 0.010f}, Vec3{0, -0.010f, 0}, Vec3{0, 0, -0.010f}}) {
      j.picture.rim[rim].push_back(static_cast<uint32_t>(j.seen.particle.size()));
      j.seen.particle.push_back(corner + Vec3{rim == 0 ? -0.001f : 0.001f, 0, 0});
    }
  j.collector = std::make_unique<MetricsCollector>(j.scene, j.picture);
}

// A loop along both edges crosses the gap once between its bites, and where its ends are tied.
TEST(MetricsCollector, the_gap_of_a_loop_is_the_larger_one_of_its_two_crossings) {
  Judged j;
  face_to_face(j);
  const Vec3 top{0, 0.010f, 0}, near{0, 0, 0.010f};
  for (const auto& [place, wall] : {std::pair{near, 0u}, {near, 0u}, {top, 0u}, {top, 1u}, {near, 1u}, {near, 1u}}) {
    SuturePointView point;
    point.position = place + Vec3{wall == 0 ? -0.005f : 0.005f, 0, 0};
    point.wall = wall;
    j.seen.active().suture_point.push_back(point);
  }
  EXPECT_NEAR(j.result().value["wound_gap"], 0.002, 1e-6);
  EXPECT_NEAR(j.result().value["edge_inversion"], 0, 1e-6);
  Vec3 &right_top = j.seen.particle[j.picture.rim[1][0]], &right_near = j.seen.particle[j.picture.rim[1][1]];
  right_top.x += 0.001f;
  EXPECT_NEAR(j.result().value["wound_gap"], 0.003, 1e-5) << "between the bites";
  right_top.x -= 0.001f, right_near.x += 0.002f;
  EXPECT_NEAR(j.result().value["wound_gap"], 0.004, 1e-4) << "where the ends are tied";
  right_near.z += 0.001f;
  EXPECT_LT(j.result().value["edge_inversion"], -0.0001) << "there, one edge is turned out";
}

// A stitch over the gap on the outer faces.
TEST(MetricsCollector, edges_that_turn_in_and_bites_that_are_too_deep_are_measured) {
  Judged j;
  face_to_face(j);
  j.scene.expect = {{"wound_gap", 0, 0.01}};
  for (const char* name : {"edge_inversion", "wound_gap", "wound_gap_change"})
    EXPECT_TRUE(std::isnan(j.result().value[name])) << name << ": nothing crosses the gap";
  EXPECT_FALSE(j.result().expect[0].ok) << "no thread is no closed wound";
  for (uint32_t wall = 0; wall < 2; ++wall) {
    SuturePointView point;
    point.position = {wall == 0 ? -0.005f : 0.005f, 0.010f, 0};
    point.wall = wall;
    j.seen.active().suture_point.push_back(point);
    BiteView bite;
    bite.wall = wall, bite.complete = true, bite.depth = wall == 0 ? 0.001f : 0.0012f;
    j.seen.active().bite.push_back(bite);
  }
  EXPECT_NEAR(j.result().value["edge_inversion"], 0, 1e-6);
  EXPECT_TRUE(j.result().expect[0].ok);
  Vec3 &left = j.seen.particle[j.picture.rim[0][0]], &right = j.seen.particle[j.picture.rim[1][0]];
  left.y = 0.007f, right.y = 0.008f;
  EXPECT_NEAR(j.result().value["edge_inversion"], 0.002, 1e-5) << "the edge that has turned in less";
  right.y = 0.011f;
  EXPECT_LT(j.result().value["edge_inversion"], -0.0004) << "one is turned out";

  RunResult r = j.result();
  EXPECT_NEAR(r.value["bite_depth_least"], 0.5, 1e-5);
  EXPECT_NEAR(r.value["bite_depth_most"], 0.6, 1e-5);
  EXPECT_EQ(r.value["full_thickness_bites"], 0);
  j.seen.active().bite[0].exit_inside = true;
  r = j.result();
  EXPECT_EQ(r.value["full_thickness_bites"], 1);
  EXPECT_NEAR(r.value["bite_depth_most"], 1, 1e-6);
}

TEST(MetricsCollector, gaps_are_the_widest_at_the_end_and_the_narrowest_at_the_start) {
  Judged j;
  for (const char* name : {"seam_gap", "seam_gap_all", "seam_gap_start"})
    EXPECT_TRUE(std::isnan(j.result().value[name])) << name << " of nothing is not a closed one";
  const auto row = [&](float gap, float start, bool midpoint) {
    j.seen.active().seam.push_back({{}, {gap, 0, 0}, start, 1, midpoint});
  };
  row(0.0005f, 0.010f, true), row(0.0007f, 0.009f, true), row(0.002f, 0.004f, false);
  RunResult r = j.result();
  EXPECT_EQ(r.value["pairs"], 3);
  EXPECT_FLOAT_EQ(static_cast<float>(r.value["seam_gap"]), 0.0007f);
  EXPECT_FLOAT_EQ(static_cast<float>(r.value["seam_gap_all"]), 0.002f);
  EXPECT_FLOAT_EQ(static_cast<float>(r.value["seam_gap_start"]), 0.009f);
}

TEST(MetricsCollector, uneven_ends_are_those_of_the_first_knot) {
  Judged j;
  j.seen.active().suture_point.resize(2);
  j.seen.active().suture_point[0].anchored = 3;  // 30 mm of free end
  j.seen.active().suture_point[1].anchored = 4;  // 60 mm on the needle's side
  j.add(EventKind::throw_started), j.tick();
  j.seen.active().suture_point[1].anchored = 9;
  j.add(EventKind::throw_started), j.tick();
  EXPECT_NEAR(j.result().value["tail_asymmetry"], 1.0 / 3, 1e-6);
  EXPECT_TRUE(std::isnan(Judged().result().value["tail_asymmetry"])) << "no knot";
}

TEST(MetricsCollector, faults_by_name_ends_in_hand_and_the_needle) {
  Judged j;
  j.add(Fault::wrong_body, 2);
  j.add(Fault::wrong_body, 3);
  j.add(Fault::too_few_throws, 0);
  j.add(static_cast<Fault>(77), 0);  // an unknown one
  j.tick();
  j.seen.tool[3].held_strands = 2;  // any hand's
  j.seen.active().needle_on_thread = false;
  RunResult r = j.result();
  EXPECT_EQ(r.value["fault_wrong_body"], 2);
  EXPECT_EQ(r.value["fault_too_few_throws"], 1);
  EXPECT_EQ(r.value["fault_wrong_layer"], 0);
  EXPECT_EQ(r.value["technique_fault"], 4);
  EXPECT_EQ(r.faults, (std::map<std::string, uint64_t>{{"too_few_throws", 1}, {"wrong_body", 2}}));
  EXPECT_EQ(r.value["held_ends"], 2);
  EXPECT_EQ(r.value["needle_detached"], 1);
}

// What a full list left out is not physics: the report says so, and is silent otherwise.
TEST(MetricsCollector, contacts_that_found_no_room_are_reported) {
  Judged run;
  RunResult r = run.result();
  EXPECT_EQ(run_summary(r).find("found no room"), std::string::npos);
  r.value["contacts_dropped"] = 3;
  EXPECT_NE(run_summary(r).find("warning: 3 contacts found no room"), std::string::npos) << run_summary(r);
  EXPECT_NE(run_json(r).find("\"contacts_dropped\": 3"), std::string::npos);
}

TEST(SessionMetrics, the_path_and_force_of_every_hand_count) {
  SessionMetrics m;
  Snapshot seen;
  for (int i = 0; i < 11; ++i) {
    for (size_t k = 0; k < kMaxHands; ++k) {
      seen.tool[k].pose.p.x = 0.001f * static_cast<float>(k) * static_cast<float>(i);
      seen.tool[k].force.y = i == 5 ? static_cast<float>(k) : 0;
    }
    update(m, seen, 0.01f);
  }
  for (size_t k = 0; k < kMaxHands; ++k) {
    EXPECT_NEAR(m.path[k], 0.01f * static_cast<float>(k), 1e-6f) << k;
    EXPECT_FLOAT_EQ(m.peak_force[k], static_cast<float>(k));
  }
}

}  // namespace
}  // namespace catgut
