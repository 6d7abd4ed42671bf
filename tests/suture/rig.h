// SPDX-License-Identifier: Apache-2.0
// tests/suture: a whole scene in which a ghost drives the needle. The ghost is one more weld of the needle to a pose in the
// world, so that a test prescribes the needle's motion. Jaws, hands and mechanics are the real ones.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <vector>

#include "sim/model.h"
#include "sim/state.h"

namespace catgut {

inline SceneSpec plain_scene() {
  SceneSpec s;
  s.name = "rig";
  s.body.resize(1);
  s.body[0].haustra = 0;
  return s;
}

// A point on the serosa, its outward normal, the bite direction along the rim, the direction to the rim.
struct Place {
  Vec3 at, out, along, up;
};

struct Rig {
  std::shared_ptr<const Model> model;
  StatePtr state;
  Jobs jobs{1};
  std::vector<Event> seen;  // all events so far
  TickInput input;
  int ghost = -1;  // index of its weld

  explicit Rig(const SceneSpec& scene = plain_scene()) : model(build_model(scene)), state(initial_state(*model)) {
    for (ToolInput& h : input.hand) h.connected = 0;
  }
  SolverState& solver() { return state->solver; }
  SutureState& suture() { return state->suture; }
  Strand& thread() { return state->solver.strand[0]; }
  // Per thread slot (relative): whether it collides.
  std::vector<uint8_t> collides() {
    std::vector<uint8_t> flag(model->solver.strand[0].count);
    collision_flags(model->solver.strand[0], thread(), flag);
    return flag;
  }
  const Vec4* x() { return state->solver.x.data(); }
  SutureContext context(EventList& events) {
    return {model->solver, state->solver, state->scratch, model->suture, state->suture, events};
  }
  SutureContext context() { return context(state->event); }
  Suture& sewn() { return state->suture.suture[0]; }
  uint32_t needle_body() { return model->solver.needle_body(0); }
  RigidBody& needle() { return state->solver.body[needle_body()]; }
  Vec3 tip() { return needle_tip(model->solver.needle_arc[0], needle()); }

  void tick() {
    input.tick = state->tick;
    step(*model, *state, input, jobs);
    seen.insert(seen.end(), state->event.begin(), state->event.end());
    ASSERT_TRUE(state_is_valid(*model, *state)) << "at tick " << state->tick;
  }
  // One tick in which a hand has a command.
  void order(CommandKind kind, size_t hand, uint16_t argument = 0) {
    input.commands.push({kind, static_cast<uint8_t>(hand), argument});
    tick();
    input.commands.clear();
  }
  void wait(float seconds) {
    for (int i = static_cast<int>(std::lround(seconds / model->dt)); i > 0 && !testing::Test::HasFatalFailure(); --i) tick();
  }
  size_t count(EventKind kind) const {
    return static_cast<size_t>(std::count_if(seen.begin(), seen.end(), [&](const Event& e) { return e.kind == kind; }));
  }
  const Event* last(EventKind kind) const {
    for (size_t i = seen.size(); i-- > 0;)
      if (seen[i].kind == kind) return &seen[i];
    return nullptr;
  }

  // --- the ghost ---
  void hold_needle() {
    Weld w;
    w.a = static_cast<int>(needle_body());
    w.target = needle().pose();
    w.compliance = 1e-5f;
    w.angular_compliance = 1e-3f;
    ghost = static_cast<int>(solver().weld.size());
    solver().weld.push_back(w);
  }
  void let_go() {
    std::erase_if(solver().weld, [&](const Weld& w) { return w.a == static_cast<int>(needle_body()) && w.b < 0; });
    ghost = -1;
  }
  // Moves the ghost linearly to `goal` (frame at the needle's circle's center).
  void needle_to(const Pose& circle, float seconds) {
    if (ghost < 0) hold_needle();
    const Pose goal{circle.p - rotate(circle.q, model->solver.needle_arc[0].center), circle.q};
    const Pose from = solver().weld[static_cast<size_t>(ghost)].target;
    const int ticks = std::max(1, static_cast<int>(std::lround(seconds / model->dt)));
    for (int i = 1; i <= ticks && !testing::Test::HasFatalFailure(); ++i) {
      const float part = static_cast<float>(i) / static_cast<float>(ticks);
      solver().weld[static_cast<size_t>(ghost)].target = {lerp(from.p, goal.p, part), nlerp(from.q, goal.q, part)};
      tick();
    }
  }
  Pose circle() { return {transform(needle().pose(), model->solver.needle_arc[0].center), needle().q}; }

  // --- bites ---
  // At `angle` round the opening, `below` the rim.
  Place place(float angle, float below = 0.005f) {
    const Vec3 radial{std::cos(angle), 0, -std::sin(angle)};
    SurfaceHit hit;
    const Vec3 outside = radial * (model->scene.body[0].radius + 0.0005f) - Vec3{0, below, 0};
    EXPECT_TRUE(nearest_surface(model->solver, state->scratch.candidates, x(), outside, 0.008f, hit));
    const Vec3 out = normalized(Vec3{hit.normal.x, 0, hit.normal.z}), up{0, 1, 0};
    return {hit.point, out, cross(out, up), up};
  }
  // The needle's circle with the tip `psi` past the deepest point of a bite at `p`; the circle reaches `deep` below the
  // surface.
  Pose circle_at(const Place& p, float psi, float deep = 0.0011f) const {
    const Vec3 axis_x = p.out * std::cos(psi) - p.along * std::sin(psi);
    return {p.at + p.out * (model->scene.needle.radius - deep), from_axes(axis_x, cross(p.up, axis_x), p.up)};
  }
  void approach(const Place& p, float deep = 0.0011f) {
    hold_needle();
    Place away = p;
    away.at += p.out * 0.05f + p.up * 0.02f;
    needle_to(circle_at(away, -1.3f, deep), 1.0f);
    away.at = p.at + p.out * 0.02f;
    needle_to(circle_at(away, -1.3f, deep), 0.4f);
    needle_to(circle_at(p, -1.0f, deep), 0.4f);
  }
  // Turns the needle about its circle from psi to psi at about 3.6 rad/s (30 mm/s of the tip).
  void drive(const Place& p, float from, float to, float deep = 0.0011f, float rate = 3.6f) {
    const int steps = std::max(1, static_cast<int>(std::ceil(std::abs(to - from) / 0.06f)));
    for (int i = 1; i <= steps && !testing::Test::HasFatalFailure(); ++i)
      needle_to(circle_at(p, from + (to - from) * static_cast<float>(i) / static_cast<float>(steps), deep),
                std::abs(to - from) / static_cast<float>(steps) / rate);
  }
  void whole_bite(const Place& p, float deep = 0.0011f) {
    approach(p, deep);
    drive(p, -1.0f, 4.3f, deep);
  }
  // Pulls the needle away from the tissue, `meters` outward over `seconds`.
  void draw(const Place& p, float meters, float seconds) {
    Pose to = circle();
    to.p += normalized(p.out + 0.4f * p.up) * meters;
    needle_to(to, seconds);
  }

  // --- the thread ---
  size_t node_of(uint32_t slot) {
    return static_cast<size_t>(std::find(thread().order.begin(), thread().order.end(), slot) - thread().order.begin());
  }
  size_t node_of_point(size_t k) { return node_of(thread().anchor[sewn().point[k].anchor].slot); }
  Vec3 point_at(size_t k) { return position_of(thread().anchor[sewn().point[k].anchor].point, x()); }
  double rest_length() { return std::accumulate(thread().rest.begin(), thread().rest.end(), 0.0); }
  bool order_is_whole() {
    std::vector<uint32_t> order = thread().order;
    std::sort(order.begin(), order.end());
    for (size_t i = 0; i < order.size(); ++i)
      if (order[i] != model->solver.strand[0].first_slot + i) return false;
    return order.size() == model->solver.strand[0].count;
  }
  bool nothing_left_of_a_bite() {
    return solver().channel.empty() && !sewn().attached && phase_of(sewn()) == NeedlePhase::outside &&
           solver().body_collides[needle_body()] == 1 &&
           std::none_of(solver().attach.begin(), solver().attach.end(), [](const Attachment& a) { return a.body >= 0; });
  }
};

// --- placed directly, weightless: every length is known ---
inline SceneSpec weightless(int particles) {
  SceneSpec s = plain_scene();
  s.solver.gravity = {};
  s.thread.particles = particles;
  s.technique.name = "none";
  return s;
}

// Locks node `node` of the order to the tissue particle nearest to `at`: the paper's suture point, the case of one weight 1.
inline void lock(Rig& rig, size_t node, Vec3 at) {
  const int near = nearest_particle(rig.model->solver.collision, rig.state->scratch.candidates, rig.x(), at, 0.01f);
  ASSERT_GE(near, 0);
  Bite bite;
  bite.entry.point = bite.exit.point = particle_point(static_cast<uint32_t>(near));
  bite.complete = bite.has_exit = true;
  ThreadAnchor a;
  a.slot = rig.thread().order[node];
  a.point = bite.entry.point;
  a.friction = rig.model->suture.pass_tension;
  a.capstan_friction = rig.model->suture.capstan_friction;
  set(rig.solver().x[a.slot], position_of(a.point, rig.x()));
  rig.sewn().point.push_back(
      {static_cast<uint32_t>(rig.sewn().bite.size()), false, static_cast<uint32_t>(rig.thread().anchor.size())});
  rig.sewn().bite.push_back(bite);
  rig.thread().anchor.push_back(a);
}

// Lays nodes first..last (inclusive) at even spacing along `way` from `from`, starting `skip` spacings away.
inline void lay(Rig& rig, size_t first, size_t last, Vec3 from, Vec3 way, int direction) {
  const float spacing = rig.model->solver.strand[0].spacing;
  for (size_t i = first; i <= last; ++i) {
    const size_t steps = direction > 0 ? i - first + 1 : last - i + 1;
    set(rig.solver().x[rig.thread().order[i]], from + way * (spacing * static_cast<float>(steps)));
    rig.solver().v[rig.thread().order[i]] = {};
  }
}
// Puts the needle's swage at the thread's last node and has the ghost hold it there.
inline void put_needle(Rig& rig, Vec3 swage) {
  RigidBody& needle = rig.needle();
  needle.q = {};
  needle.x = swage - rig.model->solver.needle_arc[0].point(0);
  needle.prev_x = needle.x, needle.prev_q = needle.q;
  needle.v = needle.omega = {};
  rig.hold_needle();
  set(rig.solver().x[rig.thread().order.back()], swage);
}

// --- scissors ---
// Hand 1, free of everything, cuts at `at`.
inline void snip(Rig& r, Vec3 at, size_t hand = 1, uint16_t suture = 0) {
  r.input.hand[hand].connected = 1;
  r.input.hand[hand].pose = {at, axis_angle({1, 0, 0}, -0.5f * kPi)};
  RigidBody& b = r.solver().body[hand];
  b = {};
  b.x = b.prev_x = at, b.q = b.prev_q = r.input.hand[hand].pose.q;
  r.state->hand[hand].pose = r.input.hand[hand].pose;
  r.state->hand[hand].known = 1;
  r.order(CommandKind::cut, hand, suture);
  r.input.hand[hand].pose.p += Vec3{0, 0.1f, 0};
  b.x = b.prev_x = r.input.hand[hand].pose.p;
  r.state->hand[hand].pose = r.input.hand[hand].pose;
  r.tick();
}
inline Vec3 between(Rig& r, size_t node, float s = 0.5f) {
  return lerp(xyz(r.x()[r.thread().order[node]]), xyz(r.x()[r.thread().order[node + 1]]), s);
}

}  // namespace catgut
