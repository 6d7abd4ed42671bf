// SPDX-License-Identifier: Apache-2.0
// tests/physical: a sleeping thread beside one that never sleeps: a tool, a load and a hand that moves find the same thread.
#include "physical/sleep.h"

#include <gtest/gtest.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "physical/carry.h"
#include "physical/physical.h"
#include "physical/quiet.h"
#include "validation/suture_scenes.h"

namespace catgut::physical {
namespace {

using validation::Sewn;

// A small piece of wall, held, far away from everything.
wall::Wall far_wall() {
  wall::SheetShape shape;
  shape.width = 0.02f, shape.height = 0.02f, shape.columns = 5, shape.rows = 5;
  wall::Spec spec;
  spec.mesh = wall::sheet(shape);
  for (size_t c = 0; c < spec.mesh.held.size(); ++c) {
    spec.mesh.held[c] = 1;
    spec.mesh.outer[c].z -= 1, spec.mesh.inner[c].z -= 1;
  }
  spec.mesh.held[12] = 0;
  return wall::build_wall(spec);
}

// 30 mm of thread on a plane, and a tool above it whose tip points down.
struct OnDrape {
  Model model;
  State state;
  std::unique_ptr<Scratch> scratch;
  Jobs jobs{1};
  thread::Plane drape;
  std::vector<HandTarget> target;
  explicit OnDrape(bool sleep) {
    const wall::Wall w = far_wall();
    model = make_model(w, validation::knot_settings(0.3f));
    model.thread.gravity = {0, -2, 0}, model.sleep.on = sleep;
    model.bodies.body.push_back(make_tool({}));
    state.wall = w.state;
    std::vector<Vec3> path;
    for (int i = 0; i <= 60; ++i) path.push_back({0.5e-3f * static_cast<float>(i), 0.175e-3f, 0});
    state.thread = thread::make_state(path);
    state.bodies.body.resize(1);
    drape.offset = 0, drape.friction = 0.3f;
    target.resize(1);
    target[0].connected = true;
    place({0.015f, 0.02f, -0.01f});
    place_body(model.bodies.body[0], state.bodies.body[0], target[0].pose, 0);
    scratch = std::make_unique<Scratch>(model, state);
  }
  void place(Vec3 p) { target[0].pose = {p, axis_angle({1, 0, 0}, -0.5f * kPi)}; }
  void step() {
    Hands hands;
    hands.targets = target, hands.plane = &drape;
    physical::step(model, state, *scratch, hands, jobs);
  }
  void rest(int steps) {
    for (int i = 0; i < steps; ++i) step();
  }
  // Down to the drape beside the thread, then across it by 6 mm.
  void sweep() {
    for (int i = 0; i <= 100; ++i) place({0.015f, 0.02f - 0.0175f * static_cast<float>(i) / 100, -0.01f}), step();
    for (int i = 0; i <= 200; ++i) place({0.015f, 0.0025f, -0.01f + 0.016f * static_cast<float>(i) / 200}), step();
  }
};

TEST(Sleep, a_tool_moves_a_sleeping_thread_as_it_moves_one_that_is_awake) {
  OnDrape asleep(true), awake(false);
  asleep.rest(600), awake.rest(600);
  EXPECT_TRUE(asleep.state.sleep.all());
  EXPECT_FALSE(awake.state.sleep.all());
  asleep.sweep(), awake.sweep();
  EXPECT_FALSE(asleep.state.sleep.all());
  float moved = 0, apart = 0;
  for (size_t i = 0; i < awake.state.thread.nodes(); ++i) {
    moved = std::max(moved, awake.state.thread.position(i).z);
    apart = std::max(apart, distance(awake.state.thread.position(i), asleep.state.thread.position(i)));
  }
  EXPECT_GT(moved, 3e-3f);
  EXPECT_LT(apart, 0.03f * moved);
  asleep.place({0.015f, 0.03f, 0.006f});
  asleep.rest(900);
  EXPECT_TRUE(asleep.state.sleep.all());
}

// The last segment of a thread broke: its last node falls alone while all other thread is asleep. It had no segment and so no
// mass.
TEST(Sleep, a_node_that_broke_off_falls_beside_a_thread_that_sleeps) {
  OnDrape scene(true);
  scene.rest(600);
  ASSERT_TRUE(scene.state.sleep.all());
  thread::State& thread = scene.state.thread;
  const size_t last = thread.nodes() - 1;
  thread.x.set(last, thread.x.at(last) + Vec3{0, 1, 0});
  thread.broken[last - 1] = 1;
  bool alone = false;
  for (int i = 0; i < 6000 && !(i > 100 && scene.state.sleep.all()); ++i) {
    scene.step();
    ASSERT_TRUE(is_finite(thread.position(last))) << i;
    alone = alone || (scene.state.sleep.strand[0].asleep && !scene.state.sleep.strand[1].asleep);
  }
  EXPECT_TRUE(alone);
  EXPECT_NEAR(thread.position(last).y, 0.175e-3f, 0.1e-3f);
}

// A square knot, tightened; then both load ends are drawn apart by springs.
struct Knotted {
  Sewn s;
  uint32_t load_a, load_b;
  explicit Knotted(bool sleep) {
    const thread::Settings settings = validation::knot_settings(0.3f);
    validation::Tightened tight(validation::lay_knot(validation::square(), settings.material.diameter, 0.5e-3f));
    validation::tighten(settings, tight, 2);
    const validation::LaidKnot& knot = tight.knot;
    const wall::Wall w = far_wall();
    s.model = make_model(w, settings);
    // A loaded knot creeps by some micrometers in a window, for seconds: here it may sleep in spite of that.
    s.model.sleep.on = sleep, s.model.sleep.still = 20e-6f, s.model.sleep.steady = 0.02f;
    s.state.wall = w.state, s.state.thread = knot.state;
    s.start();
    load_a = knot.load_a, load_b = knot.load_b;
    s.hold.clear();
    for (const uint32_t node : {load_a, load_b, knot.tail_a(), knot.tail_b()}) {
      thread::Hold h;  // the tails gently: they would swing for seconds
      h.node = node, h.from = h.to = knot.state.position(node), h.stiffness = s.hold.size() < 2 ? 500.0f : 20.0f;
      s.hold.push_back(h);
    }
    const Vec3 apart = normalized(s.hold[0].to - s.hold[1].to) * 2e-3f;
    const Vec3 loaded[2] = {s.hold[0].to + apart, s.hold[1].to - apart};
    s.move_holds(loaded, 0.1f);
    s.run(4.0f);
  }
  // Draws the load ends apart; returns the force [N] at each step.
  std::vector<float> draw() {
    std::vector<float> force;
    for (int i = 0; i < 250; ++i) {
      for (size_t k = 0; k < 2; ++k) {
        thread::Hold& h = s.hold[k];
        const Vec3 out = normalized(s.hold[k].to - s.hold[1 - k].to);
        h.from = h.to, h.to = h.to + out * 2e-5f;
      }
      s.run(0.001f);
      force.push_back(s.end_force(0));
    }
    return force;
  }
};

TEST(Sleep, a_sleeping_knot_holds_as_one_that_is_awake) {
  Knotted asleep(true), awake(false);
  EXPECT_TRUE(asleep.s.state.sleep.all());
  EXPECT_FALSE(awake.s.state.sleep.all());
  const std::vector<float> a = asleep.draw(), b = awake.draw();
  EXPECT_FALSE(asleep.s.state.sleep.all());
  const float most = *std::max_element(b.begin(), b.end());
  EXPECT_GT(most, 0.5f);
  EXPECT_NEAR(*std::max_element(a.begin(), a.end()), most, 0.02f * most);
  EXPECT_NEAR(a.back(), b.back(), 0.02f * most);
}

// Its nodes turn and move as one: no change. Thread on one side of the knot, drawn 30 um along itself while the rest stays, as
// if it slipped: a change well above what trembling nodes make (2 um).
TEST(Sleep, a_knot_that_slips_is_told_from_one_that_is_moved) {
  const thread::Settings settings = validation::knot_settings(0.3f);
  validation::Tightened tight(validation::lay_knot(validation::square(), settings.material.diameter, 0.5e-3f));
  validation::tighten(settings, tight, 2);
  const thread::State tied = tight.knot.state;
  const Sleep::Strand all{0, static_cast<uint32_t>(tied.nodes()) - 1};
  ASSERT_TRUE(has_knot(tied, all));
  std::vector<Vec3> from(tied.nodes());
  for (size_t i = 0; i < from.size(); ++i) from[i] = tied.position(i);
  thread::State moved = tied;
  const Quat turn = axis_angle(normalized(Vec3{1, -2, 0.5f}), 0.3f);
  for (size_t i = 0; i < from.size(); ++i)
    moved.x.set(i, rotate(turn, from[i]) + Vec3{0.004f, 0, 0.001f}), moved.fine.set(i, {});
  EXPECT_LT(knot_change(moved, all, from), 1e-6f);
  thread::State slipped = tied;
  for (size_t i = 0; i < tied.nodes() / 2; ++i) slipped.x.set(i, from[i] + normalized(from[i + 1] - from[i]) * 30e-6f);
  const float change = knot_change(slipped, all, from);
  std::printf("30 um through the knot: %.1f um\n", 1e6 * static_cast<double>(change));
  EXPECT_GT(change, 10e-6f) << "SleepModel::slack_knot";
}

// A stitch whose ends are held taut: its force on the wall lasts while it sleeps.
TEST(Sleep, a_taut_stitch_holds_the_wall_where_it_was_and_a_copy_wakes_to_the_bit) {
  Sewn s = validation::interrupted({});
  s.model.lip_contact = false;
  const Vec3 to[2] = {s.hold[0].to + Vec3{1.5e-3f, 0, 0}, s.hold[1].to + Vec3{1.5e-3f, 0, 0}};
  s.move_holds(to, 0.05f);
  for (int i = 0; i < 30 && !s.state.sleep.all(); ++i) s.run(0.1f);
  ASSERT_TRUE(s.state.sleep.all());
  const float force = s.end_force(0);
  EXPECT_GT(force, 0.05f);
  const wall::Column<wall::Float4> before = s.state.wall.motion.x;
  s.run(0.5f);
  EXPECT_TRUE(s.state.sleep.all());
  for (size_t i = 0; i < before.size(); ++i)
    EXPECT_LT(distance(wall::vec3(before[i]), wall::vec3(s.state.wall.motion.x[i])), 2e-6f);

  Sewn copy = validation::interrupted({});
  copy.model.lip_contact = false;
  copy.state = s.state, copy.hold = s.hold;
  copy.scratch = std::make_unique<Scratch>(copy.model, copy.state);
  copy.jobs = std::make_unique<Jobs>(2);
  const Vec3 on[2] = {to[0] + Vec3{0.5e-3f, 0, 0}, to[1]};
  for (Sewn* w : {&s, &copy}) {
    w->move_holds(on, 0.02f);
    EXPECT_FALSE(w->state.sleep.all());
  }
  EXPECT_EQ(hash_state(s.state), hash_state(copy.state));
  EXPECT_GT(s.end_force(0), force);
}

// Two sheets 0.1 m apart, held at their short sides, each with a strand through two holes; hands on the ends of both.
struct TwoSutures {
  Sewn s;
  explicit TwoSutures(bool sleep) {
    wall::SheetShape shape;
    shape.width = 0.03f, shape.height = 0.02f, shape.columns = 13, shape.rows = 9;
    wall::Spec spec;
    spec.mesh = wall::sheet(shape);
    wall::Mesh other = wall::sheet(shape);
    for (size_t c = 0; c < other.outer.size(); ++c) other.outer[c].y += 0.1f, other.inner[c].y += 0.1f;
    wall::append(spec.mesh, other);
    for (size_t c = 0; c < spec.mesh.held.size(); ++c) spec.mesh.held[c] = std::abs(spec.mesh.outer[c].x - 0.015f) > 0.0149f;
    spec.drag = 20;
    const wall::Wall w = wall::build_wall(spec);
    s.model = make_model(w, validation::knot_settings(0.3f));
    s.model.sleep.on = sleep;
    s.state.wall = w.state;
    std::vector<Vec3> path;
    std::vector<int32_t> hole;
    size_t first_nodes = 0;
    std::vector<uint32_t> ends;
    for (const float y : {0.0103f, 0.1103f}) {
      std::vector<Vec3> stop;
      for (const auto& [x, zeta] : {std::pair{0.011f, 1.0f}, {0.011f, -1.0f}, {0.019f, -1.0f}, {0.019f, 1.0f}}) {
        Hole h = validation::hole_at(w, {x, y, 0.00125f * zeta}, zeta);
        h.within = (x < 0.015f) == (zeta > 0);
        stop.push_back(mouth(s.model, s.state, h)), s.state.hole.push_back(h);
      }
      stop.insert(stop.begin(), stop[0] + Vec3{-0.005f, 0, 0.02f}), stop.push_back(stop.back() + Vec3{0.005f, 0, 0.02f});
      ends.push_back(static_cast<uint32_t>(std::count(hole.begin(), hole.end(), -1)));
      for (size_t i = 0; i + 1 < stop.size(); ++i) {
        const int parts = std::max(3, static_cast<int>(distance(stop[i], stop[i + 1]) / 0.5e-3f));
        for (int n = i == 0 ? 0 : 1; n < parts; ++n)
          path.push_back(lerp(stop[i], stop[i + 1], static_cast<float>(n) / static_cast<float>(parts))), hole.push_back(-1);
        path.push_back(stop[i + 1]);
        hole.push_back(i + 2 < stop.size() ? static_cast<int32_t>(s.state.hole.size() - 4 + i) : -1);
      }
      ends.push_back(static_cast<uint32_t>(std::count(hole.begin(), hole.end(), -1) - 1));
      if (first_nodes == 0) first_nodes = ends.back() + 1;
    }
    s.state.thread = thread::make_laced_state(path, hole, 0.15f);
    s.state.thread.broken[first_nodes - 1] = 1, s.state.thread.rest[first_nodes - 1] = 0.5e-3f;
    s.start();
    s.hold.clear();
    for (const uint32_t node : ends) {
      thread::Hold h;
      h.node = node, h.from = h.to = s.state.thread.position(node), h.stiffness = 500;
      s.hold.push_back(h);
    }
  }
  // Draws one end out by 4 mm; the force [N] on it and on its other end, step by step.
  std::vector<float> draw(size_t end) {
    std::vector<float> force;
    for (int i = 0; i < 200; ++i) {
      s.hold[end].from = s.hold[end].to, s.hold[end].to.z += 2e-5f;
      s.run(0.001f);
      force.push_back(s.end_force(static_cast<int>(end))), force.push_back(s.end_force(static_cast<int>(end ^ 1)));
    }
    return force;
  }
};

TEST(Sleep, a_suture_is_drawn_beside_one_that_sleeps_as_if_none_slept_and_then_the_other_wakes) {
  TwoSutures some(true), none(false);
  for (TwoSutures* t : {&some, &none}) t->s.run(1);
  ASSERT_TRUE(some.s.state.sleep.all());
  for (const size_t end : {size_t{3}, size_t{1}}) {
    const std::vector<float> a = some.draw(end), b = none.draw(end);
    const Sleep& z = some.s.state.sleep;
    ASSERT_EQ(z.strand.size(), 2u);
    EXPECT_FALSE(z.strand[end / 2].asleep);
    EXPECT_EQ(z.strand[1 - end / 2].asleep, end == 3);  // the first has been at rest for too short a time
    const float most = *std::max_element(b.begin(), b.end());
    EXPECT_GT(most, 0.1f);
    float off = 0;
    for (size_t i = 0; i < a.size(); ++i) off = std::max(off, std::abs(a[i] - b[i]));
    std::printf("largest force %.3f N, difference %.4f N\n", static_cast<double>(most), static_cast<double>(off));
    EXPECT_LT(off, 0.02f * most);
  }
  // A copy gives the same bits with another number of workers.
  TwoSutures copy(true);
  copy.s.state = some.s.state, copy.s.hold = some.s.hold;
  copy.s.scratch = std::make_unique<Scratch>(copy.s.model, copy.s.state);
  copy.s.jobs = std::make_unique<Jobs>(2);
  some.s.run(0.6f), copy.s.run(0.6f);
  EXPECT_EQ(hash_state(some.s.state), hash_state(copy.s.state));
}

// Two strands on the drape, 3 mm apart. Forceps draw the middle of one across the other.
std::vector<Vec3> drag_across(bool sleep) {
  OnDrape d(sleep);
  std::vector<Vec3> path;
  for (int k = 0; k < 2; ++k)
    for (int i = 0; i <= 60; ++i) path.push_back({0.5e-3f * static_cast<float>(i), 0.175e-3f, 3e-3f * static_cast<float>(k)});
  d.state.thread = thread::make_state(path);
  d.state.thread.broken[60] = 1, d.state.thread.rest[60] = 0.5e-3f;
  d.scratch = std::make_unique<Scratch>(d.model, d.state);
  d.rest(600);
  EXPECT_EQ(d.state.sleep.all(), sleep);
  std::vector<thread::Hold> hold(1);
  hold[0].node = 30, hold[0].stiffness = 200, hold[0].to = d.state.thread.position(30);
  bool alone = false;
  for (int i = 0; i < 300; ++i) {
    hold[0].from = hold[0].to, hold[0].to.z += 2e-5f;
    Hands hands;
    hands.targets = d.target, hands.plane = &d.drape, hands.holds = hold;
    step(d.model, d.state, *d.scratch, hands, d.jobs);
    if (i == 20) alone = d.state.sleep.any();  // 0.4 mm: only the first strand has moved
  }
  EXPECT_EQ(alone, sleep);
  EXPECT_FALSE(d.state.sleep.any());
  std::vector<Vec3> at;
  for (size_t i = 61; i < 122; ++i) at.push_back(d.state.thread.position(i));
  return at;
}

TEST(Sleep, a_strand_that_is_drawn_across_a_sleeping_one_takes_it_along) {
  const std::vector<Vec3> asleep = drag_across(true), awake = drag_across(false);
  float moved = 0, apart = 0;
  for (size_t i = 0; i < awake.size(); ++i) {
    moved = std::max(moved, awake[i].z - 3e-3f), apart = std::max(apart, distance(awake[i], asleep[i]));
  }
  std::printf("moved %.2f mm, difference %.3f mm\n", 1e3 * static_cast<double>(moved), 1e3 * static_cast<double>(apart));
  EXPECT_GT(moved, 1e-3f);
  EXPECT_LT(apart, 0.05f * moved);
}

// A strand through four holes near the free end of a sheet that is held at its other end. Its ends hang free.
struct OnATongue {
  Sewn s;
  uint32_t tip = 0;  // column in the middle of the free edge
  explicit OnATongue(bool sleep, float tail = 0.008f) {
    wall::SheetShape shape;
    shape.width = 0.05f, shape.height = 0.02f, shape.columns = 21, shape.rows = 9;
    wall::Spec spec;
    spec.mesh = wall::sheet(shape);
    for (size_t c = 0; c < spec.mesh.held.size(); ++c) spec.mesh.held[c] = spec.mesh.outer[c].x < 1e-4f;
    spec.drag = 20;
    const wall::Wall w = wall::build_wall(spec);
    s.model = make_model(w, validation::knot_settings(0.3f));
    s.model.thread.hole_grip = 0.02f;  // as in scenes: slack thread stays in its holes
    s.model.sleep.on = sleep;
    s.state.wall = w.state;
    std::vector<Vec3> path, stop;
    std::vector<int32_t> hole;
    for (const auto& [x, zeta] : {std::pair{0.038f, 1.0f}, {0.038f, -1.0f}, {0.046f, -1.0f}, {0.046f, 1.0f}}) {
      Hole h = validation::hole_at(w, {x, 0.0101f, 0.00125f * zeta}, zeta);
      h.within = (x < 0.04f) == (zeta > 0);
      stop.push_back(mouth(s.model, s.state, h)), s.state.hole.push_back(h);
    }
    stop.insert(stop.begin(), stop[0] + Vec3{-0.002f, 0, tail}), stop.push_back(stop.back() + Vec3{0.002f, 0, tail});
    for (size_t i = 0; i + 1 < stop.size(); ++i) {
      const int parts = std::max(3, static_cast<int>(distance(stop[i], stop[i + 1]) / 0.5e-3f));
      for (int n = i == 0 ? 0 : 1; n < parts; ++n)
        path.push_back(lerp(stop[i], stop[i + 1], static_cast<float>(n) / static_cast<float>(parts))), hole.push_back(-1);
      path.push_back(stop[i + 1]), hole.push_back(i + 2 < stop.size() ? static_cast<int32_t>(i) : -1);
    }
    s.state.thread = thread::make_laced_state(path, hole, 0.15f);
    s.start();
    s.hold.clear();
    for (uint32_t c = 0; c < spec.mesh.outer.size(); ++c)
      if (distance(spec.mesh.outer[c], {0.05f, 0.01f, 0}) < distance(spec.mesh.outer[tip], {0.05f, 0.01f, 0})) tip = c;
  }
  void pull(Vec3 force) { s.wall_pull = {{wall::at_column(tip, 0), force}}; }
  Vec3 node(size_t i) const { return s.state.thread.position(i); }
  void run_over(thread::Plane& drape, int steps) {
    Hands hands;
    hands.plane = &drape, hands.wall_pulls = s.wall_pull;
    for (int i = 0; i < steps; ++i) step(s.model, s.state, *s.scratch, hands, *s.jobs);
  }
};

// It rides on the tongue while it sleeps, as if it were awake, and a copy does so to the bit.
TEST(Sleep, a_strand_that_sleeps_in_its_wall_is_carried_along) {
  OnATongue asleep(true), awake(false);
  for (OnATongue* t : {&asleep, &awake}) t->s.run(2);
  ASSERT_TRUE(asleep.s.state.sleep.all());
  const Vec3 start = asleep.node(0);
  int slept = 0;
  for (int i = 1; i <= 100; ++i) {  // slowly: thread that is awake has a drag
    for (OnATongue* t : {&asleep, &awake}) t->pull({0, 0, 1.2e-5f * static_cast<float>(i)}), t->s.run(0.08f);
    slept += asleep.s.state.sleep.all();
  }
  EXPECT_EQ(slept, 100);
  OnATongue copy(true);
  copy.s.state = asleep.s.state, copy.s.scratch = std::make_unique<Scratch>(copy.s.model, copy.s.state);
  copy.s.jobs = std::make_unique<Jobs>(2), copy.s.wall_pull = asleep.s.wall_pull;
  for (OnATongue* t : {&asleep, &awake, &copy}) t->s.run(0.5f);
  EXPECT_EQ(hash_state(asleep.s.state), hash_state(copy.s.state));
  const float way = distance(asleep.node(0), start);
  float apart = 0;
  // Between the holes. Tails that are awake do not turn with the wall at once: they lag by 1.6 mm, because of their drag.
  const std::vector<thread::Eyelet>& hole = asleep.s.state.thread.eyelet;
  for (size_t i = hole.front().segment + 1; i <= hole.back().segment; ++i)
    apart = std::max(apart, distance(asleep.node(i), awake.node(i)));
  std::printf("carried by %.2f mm, at most %.0f um from where it is awake\n", 1e3 * static_cast<double>(way),
              1e6 * static_cast<double>(apart));
  EXPECT_GT(way, 1e-3f);
  EXPECT_LT(apart, 0.05f * way);
  // It wakes where the wall is strained beside it, or a hand comes.
  asleep.s.hold.resize(1);
  asleep.s.hold[0].node = 0, asleep.s.hold[0].from = asleep.s.hold[0].to = asleep.node(0), asleep.s.hold[0].stiffness = 100;
  asleep.s.run(0.001f);
  EXPECT_FALSE(asleep.s.state.sleep.any());
}

// A stitch that is tied on the tongue and let go, with its tails cut.
struct TiedOnATongue {
  OnATongue tied{false, 0.06f};
  explicit TiedOnATongue(float tension) {  // [N] of both hands in each throw
    validation::Tying t;
    t.center = {0.042f, 0.0101f, 0.0016f}, t.up = {0, 0, 1}, t.across = {-1, 0, 0}, t.tension = tension;
    tied.s.hold.resize(2);
    tied.s.hold[0].node = 0, tied.s.hold[1].node = static_cast<uint32_t>(tied.s.state.thread.nodes()) - 1;
    for (thread::Hold& h : tied.s.hold) h.from = h.to = tied.s.state.thread.position(h.node);
    for (const validation::Throw& one : validation::three_throws()) validation::tie_throw(tied.s, t, one);
    validation::let_go(tied.s);
    thread::State& whole = tied.s.state.thread;
    whole.broken[88] = whole.broken[whole.segments() - 89] = 1;
    tied.s.run(12);  // they unbend
  }
};
// The same once more, with strands that sleep or do not.
struct Stitched {
  OnATongue on;
  Stitched(const TiedOnATongue& from, bool sleep) : on(sleep, 0.06f) {
    on.s.state = from.tied.s.state, on.s.scratch = std::make_unique<Scratch>(on.s.model, on.s.state);
    on.s.run(3);
  }
  Vec3 place(size_t hole) const { return mouth(on.s.model, on.s.state, on.s.state.hole[hole]); }
  float width() const { return distance(place(0), place(3)); }
  bool carried() const { return is_carried(on.s.state, on.s.state.sleep.strand.size() > 1 ? 1 : 0); }
  // Draws its outer holes apart, up to 0.5 N; `beside` [N] acts on the tip meanwhile. Returns by how much they part [m].
  float draw_apart(Vec3 beside) {
    const float before = width();
    for (int i = 1; i <= 100; ++i) {
      const Vec3 apart = normalized(place(3) - place(0)) * (5e-3f * static_cast<float>(i));
      on.pull(beside);
      for (const size_t hole : {0, 3})
        on.s.wall_pull.push_back({wall::weights(on.s.model.wall, on.s.state.wall.topology, on.s.state.hole[hole].place),
                                  hole == 0 ? -apart : apart});
      on.s.run(0.005f);
    }
    on.s.run(0.5f);
    return width() - before;
  }
  float tension() const {
    const thread::State& t = on.s.state.thread;
    return t.tension[(t.eyelet[1].segment + t.eyelet[2].segment) / 2];
  }
};

// It is carried; then its holes are drawn apart. It bears what one bears that never sleeps.
TEST(Sleep, a_tied_stitch_that_was_carried_holds_as_one_that_is_awake) {
  if (!std::getenv("CATGUT_LONG")) GTEST_SKIP() << "CATGUT_LONG=1 runs it";
  const TiedOnATongue tied(1);
  float wider[2], way[2], tension[2];
  int carried = 0;
  for (const bool sleep : {false, true}) {
    Stitched o(tied, sleep);
    const Vec3 start = o.place(3);
    for (int i = 1; i <= 100; ++i) {
      o.on.pull({0, 0, 8e-6f * static_cast<float>(i)}), o.on.s.run(0.06f);
      carried += sleep && o.carried() && distance(o.place(3), start) > 50e-6f;
    }
    way[sleep] = distance(o.place(3), start);
    wider[sleep] = o.draw_apart({0, 0, 8e-4f}), tension[sleep] = o.tension();
  }
  std::printf(
      "carried at %d of 100 looks, by %.2f mm (awake %.2f); 0.5 N: wider by %.3f mm (awake %.3f), %.3f N (awake %.3f)\n",
      carried, 1e3 * static_cast<double>(way[1]), 1e3 * static_cast<double>(way[0]), 1e3 * static_cast<double>(wider[1]),
      1e3 * static_cast<double>(wider[0]), static_cast<double>(tension[1]), static_cast<double>(tension[0]));
  EXPECT_GE(carried, 5);
  EXPECT_GT(tension[0], 0.2f);
  EXPECT_NEAR(tension[1], tension[0], 0.03f * tension[0]);
  EXPECT_NEAR(wider[1], wider[0], 0.15f * wider[0]);
}

// The tissue beside it is worked on for five seconds. It has slack, and sleeps most of that time; its holes stay where those of
// one are that never sleeps, and then it bears what that one bears.
TEST(Sleep, a_tied_stitch_with_slack_sleeps_while_its_wall_is_worked_on) {
  if (!std::getenv("CATGUT_LONG")) GTEST_SKIP() << "CATGUT_LONG=1 runs it";
  const TiedOnATongue tied(0.5f);
  float wider[2], tension[2], most = 0, strained = 0;
  std::vector<float> width[2];
  int slept = 0;
  constexpr int kLooks = 500;
  for (const bool sleep : {false, true}) {
    Stitched o(tied, sleep);
    const float start = o.width();
    for (int i = 1; i <= kLooks; ++i) {
      const float at = static_cast<float>(i) / 200, swing = std::sin(2 * kPi * at) + 0.5f * std::sin(5.3f * kPi * at);
      o.on.pull(Vec3{0.01f, 0.004f, 6e-5f} * swing), o.on.s.run(0.01f);
      width[sleep].push_back(o.width());
      slept += sleep && o.carried();
      strained = std::max(strained, std::abs(o.width() - start));
    }
    wider[sleep] = o.draw_apart({}), tension[sleep] = o.tension();
  }
  for (size_t i = 0; i < kLooks; ++i) most = std::max(most, std::abs(width[1][i] - width[0][i]));
  std::printf(
      "slept at %d of %d looks; its holes parted by up to %.0f um, within %.0f um of awake; "
      "0.5 N: wider by %.3f mm (awake %.3f), %.3f N (awake %.3f)\n",
      slept, kLooks, 1e6 * static_cast<double>(strained), 1e6 * static_cast<double>(most), 1e3 * static_cast<double>(wider[1]),
      1e3 * static_cast<double>(wider[0]), static_cast<double>(tension[1]), static_cast<double>(tension[0]));
  EXPECT_GT(slept, kLooks / 2) << "none, if only the rule for taut strands is left";
  EXPECT_LT(most, 20e-6f);
  EXPECT_NEAR(tension[1], tension[0], 0.03f * tension[0]);
  EXPECT_NEAR(wider[1], wider[0], 0.15f * wider[0]);
}

TEST(Sleep, a_strand_wakes_when_its_wall_carries_it_onto_the_drape) {
  OnATongue t(true);
  thread::Plane drape;
  drape.normal = {0, 0, 1}, drape.offset = -2.6e-3f;  // below the thread on the sheet's lower face, by 1 mm
  const auto run = [&](int steps) { t.run_over(drape, steps); };
  run(2000);
  ASSERT_TRUE(t.s.state.sleep.all());
  float lowest = 1;
  bool slept = true;
  for (int i = 1; i <= 100; ++i) {
    t.pull({0, 0, -2e-5f * static_cast<float>(i)}), run(50);
    if (!t.s.state.sleep.all()) slept = false;
    for (size_t k = 0; k < t.s.state.thread.nodes(); ++k) lowest = std::min(lowest, t.node(k).z - drape.offset);
  }
  EXPECT_FALSE(slept);
  EXPECT_GT(lowest, 0.3f * t.s.model.thread.material.diameter) << "the drape holds it";
}

TEST(Sleep, a_strand_wakes_when_the_wall_is_strained_beside_it) {
  OnATongue t(true);
  t.s.run(2);
  ASSERT_TRUE(t.s.state.sleep.all());
  t.pull({2, 0, 0});
  t.s.run(0.1f);
  EXPECT_FALSE(t.s.state.sleep.any());
}

// A rigid motion is found whole, and what is left is strain.
TEST(Sleep, the_motion_of_a_wall_is_found_whole) {
  OnATongue t(true);
  t.s.run(2);
  ASSERT_TRUE(t.s.state.sleep.all());
  const SleepModel& model = t.s.model.sleep;
  wall::State moved = t.s.state.wall;
  const Quat turn = axis_angle(normalized(Vec3{1, 2, -1}), 0.4f);
  const Vec3 by{0.003f, -0.002f, 0.004f};
  for (size_t i = 0; i < moved.motion.x.size(); ++i) {
    const Vec3 p = rotate(turn, wall::vec3(moved.motion.x[i]));
    moved.motion.x[i] = wall::float4(i % 2 == 0 ? p + by : p);
  }
  const Carry c = carry_of(model, t.s.state.sleep.watched, moved, 0);
  const Vec3 node = t.node(3);
  EXPECT_LT(distance(c.place(node), rotate(turn, node) + by), 0.5e-6f);
  EXPECT_LT(distance(c.before(c.place(node)), node), 0.1e-6f);
  EXPECT_LT(c.strain, 0.5e-6f);
  const auto loaded = std::find_if(t.s.state.sleep.watched.begin(), t.s.state.sleep.watched.end(),
                                   [&](const Sleep::Watched& w) { return w.may_move < model.nearby; });
  ASSERT_NE(loaded, t.s.state.sleep.watched.end());
  moved.motion.x[2 * loaded->column] = wall::float4(wall::vec3(moved.motion.x[2 * loaded->column]) + Vec3{0, 0, 1e-4f});
  EXPECT_GT(carry_of(model, t.s.state.sleep.watched, moved, 0).strain, 0.6e-4f);
}

// One strand is drawn over the drape while others wait, which were laid down bent, each 14 cm long. They unbend for tens of
// seconds, ever more slowly, because the drag of scenes is high; but nothing depends on where they lie.
TEST(Sleep, bent_strands_that_wait_sleep_soon_and_cost_little) {
  const auto milliseconds = [](size_t waiting, size_t& asleep) {
    OnDrape d(true);
    d.model.thread.damping = 30, d.model.thread.gravity = {0, -0.1f, 0};
    std::vector<Vec3> path;
    for (size_t k = 0; k <= waiting; ++k)
      for (int i = 0; i <= 200; ++i) {
        const float along = 0.7e-3f * static_cast<float>(i),
                    bend = k == 0 ? 0 : 10e-3f * std::sin(kPi * static_cast<float>(i) / 200);
        path.push_back({along, 0.175e-3f, 0.02f * static_cast<float>(k) + bend});
      }
    d.state.thread = thread::make_state(path);
    for (size_t k = 0; k < waiting; ++k) d.state.thread.broken[201 * k + 200] = 1, d.state.thread.rest[201 * k + 200] = 0.7e-3f;
    d.place({0, 0.1f, -0.1f});
    d.scratch = std::make_unique<Scratch>(d.model, d.state);
    d.rest(1000);
    std::vector<thread::Hold> hold(1);
    hold[0].node = 0, hold[0].stiffness = 200, hold[0].to = d.state.thread.position(0);
    asleep = static_cast<size_t>(std::count_if(d.state.sleep.strand.begin(), d.state.sleep.strand.end(),
                                               [](const Sleep::Strand& k) { return k.asleep; }));
    EXPECT_EQ(asleep, waiting + 1);
    std::vector<double> ms;
    for (int i = 0; i < 200; ++i) {
      hold[0].from = hold[0].to, hold[0].to.x -= 2e-5f;
      Hands hands;
      hands.targets = d.target, hands.plane = &d.drape, hands.holds = hold;
      timespec a, b;
      clock_gettime(CLOCK_THREAD_CPUTIME_ID, &a);
      step(d.model, d.state, *d.scratch, hands, d.jobs);
      clock_gettime(CLOCK_THREAD_CPUTIME_ID, &b);
      ms.push_back(1e3 * static_cast<double>(b.tv_sec - a.tv_sec) + 1e-6 * static_cast<double>(b.tv_nsec - a.tv_nsec));
    }
    asleep = 0;
    for (const Sleep::Strand& k : d.state.sleep.strand) asleep += k.asleep;
    std::sort(ms.begin(), ms.end());
    return ms[100];
  };
  size_t asleep = 0;
  const double alone = milliseconds(0, asleep), beside = milliseconds(8, asleep);
  std::printf("%.3f ms, beside 8 that wait %.3f ms\n", alone, beside);
  EXPECT_EQ(asleep, 8u);
  EXPECT_LT(beside, 2 * alone);  // all awake: 9 times
}

}  // namespace
}  // namespace catgut::physical
