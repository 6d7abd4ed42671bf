// SPDX-License-Identifier: Apache-2.0
// validation: whole sutures. The thread is laid through the wall, drawn and tied; then the hands are gone for four seconds.
// What is measured is seen from outside: gaps and openings, before and after, with the thread and without it.
#include <algorithm>
#include <cmath>
#include <string>

#include "thread/observe.h"
#include "validation/checks.h"
#include "validation/suture_scenes.h"

namespace catgut::validation {
namespace {

double wide(float x) { return static_cast<double>(x); }
float smallest(const std::vector<float>& v) { return *std::min_element(v.begin(), v.end()); }

struct Outcome {
  float laid = 0, tied = 0, away = 0, removed = 0;  // [m] gap at the stitch: at first, hands on, hands gone 4 s, no thread
  float tension = 0;                                // [N] of the loop between the tubes, hands gone
  thread::KnotName seen = thread::KnotName::none;
};

// One stitch between two tubes, 3 mm apart.
Outcome tie_stitch(Throws throws, float friction, float tension, bool remove) {
  Stitch q;
  q.friction = friction;
  Sewn s = interrupted(q);
  Outcome out;
  out.laid = smallest(gaps(s));
  Tying t;
  t.center = {0.0203f, 0, 0}, t.tension = tension;
  for (const Throw& one : throws) tie_throw(s, t, one);
  out.tied = smallest(gaps(s));
  let_go(s);
  s.run(3.9f);
  out.away = smallest(gaps(s));
  const thread::State& thread = s.state.thread;
  if (thread.eyelet.size() == 4) out.tension = thread.tension[(thread.eyelet[1].segment + thread.eyelet[2].segment) / 2];
  out.seen = thread::observe(s.model.thread, thread).name;
  if (!remove) return out;
  remove_thread(s);
  s.run(1.5f);
  out.removed = smallest(gaps(s));
  return out;
}

}  // namespace

void check_interrupted(Lines& out, bool nightly) {
  // Silk. Below 0.26 two throws of this polygon do not lock (docs/thread.md), and the stitch gives back tension.
  // Drawn with 3 N and more, both ends may tear these bites out, whatever the thread.
  const std::string who = "closure/interrupted/three throws, square, friction 0.3, 2.5 N, ";
  const Outcome square = tie_stitch(three_throws(), 0.3f, 2.5f, true);
  out.add(who + "gap at the stitch, hands gone 4 s", 0, wide(square.away), 1e-3, "m", "closed: at most 1 mm");
  out.add(who + "change of the gap since the hands let go", 0, wide(square.away - square.tied), 0.2e-3, "m", "holds: 0.2 mm");
  out.add(who + "gap with the thread removed", wide(square.laid), wide(square.removed), 0.05, "m", "as it was before");
  const auto grows = [&](const char* name, Throws throws, float friction, float tension) {
    const Outcome o = tie_stitch(std::move(throws), friction, tension, false);
    out.add(std::string("closure/interrupted/") + name + ", hands gone 4 s: opens again, 1 for yes", 1,
            o.away > square.away + 1e-3f ? 1 : 0, 0, "", "a knot that does not hold; gap beyond the square knot's by 1 mm");
  };
  if (nightly) grows("one throw", single_throw(), 0.3f, 2.5f);
  if (nightly) grows("granny, friction 0.1, 2 N", granny(), 0.1f, 2);
  if (nightly) grows("two throws, square, friction 0.1, 2 N", validation::square(), 0.1f, 2);
}

void check_purse_string(Lines& out) {
  for (const bool tied : {false, true}) {
    Stitch q;
    q.hole_friction = 0.1f, q.tail = 0.12f;
    Sewn s = purse_string(q, 10);
    const double whole = opening(s);
    draw_purse(s, 3, 2);
    const double drawn = opening(s) / whole;
    if (tied) {
      Tying t;
      t.center = {0.0203f, 0, -q.bite}, t.across = {0, 1, 0}, t.tension = 3;
      for (const Throw& one : three_throws()) tie_throw(s, t, one);
    }
    const double held = opening(s) / whole;
    let_go(s);
    s.run(3.9f);
    const double away = opening(s) / whole;
    if (!tied) {
      out.add("closure/purse-string/ten passages, drawn with 3 N: opening that is left", 0, drawn, 0.3, "",
              "gathers: below 30 %");
      out.add("closure/purse-string/untied, hands gone 4 s: opening", 1, away, 0.05, "", "opens again");
    } else {
      out.add("closure/purse-string/tied with three throws, hands gone 4 s: opening", 0, away, 0.3, "", "stays below 30 %");
      out.add("closure/purse-string/tied, change since the hands let go", 0, away - held, 0.05, "", "holds");
    }
  }
}

// A thread over a tube, its two ends drawn about at random: it never sinks in and never comes out on the other side.
void check_lying(Lines& out, bool nightly) {
  const int pushes = nightly ? 1000 : 30;
  wall::TubeShape shape;
  shape.around = 24, shape.rings = 12, shape.length = 0.04f;
  wall::Spec spec;
  spec.mesh = wall::tube(shape);
  spec.drag = 20;
  // Both ends of the tube are held.
  for (size_t c = 0; c < spec.mesh.held.size(); ++c) spec.mesh.held[c] = c < 24 || c + 24 >= spec.mesh.held.size();
  const wall::Wall w = wall::build_wall(spec);
  Sewn s;
  s.model = physical::make_model(w, knot_settings(0.2f));
  s.state.wall = w.state;
  const float r = 0.02f + 0.5f * s.model.thread.material.diameter;
  std::vector<Stop> course{{{r, -0.02f, -0.02f}}};
  for (int i = 0; i <= 24; ++i) {
    const float a = kPi * static_cast<float>(i) / 24;
    course.push_back({{1.01f * r * std::cos(a), 1.01f * r * std::sin(a), -0.02f}});
  }
  course.push_back({{-r, -0.02f, -0.02f}});
  s.state.thread = lay_course(course, 0.5e-3f, 0);
  s.start();
  s.hold.clear();
  s.pull = {{0, {0, -0.6f, 0}}, {static_cast<uint32_t>(s.state.thread.nodes()) - 1, {0, -0.6f, 0}}};
  float deepest = 0, under = 0;
  const auto look = [&] {
    // Every node against every patch, whatever the simulation lists.
    for (uint32_t i = 0; i < s.state.thread.nodes(); ++i) {
      const Vec3 p = s.state.thread.position(i);
      if (p.z > -0.002f || p.z < -0.038f) continue;
      physical::Foot best;
      best.gap = 1;
      for (uint32_t q = 0; q < s.model.surface.patch.size(); ++q) {
        const physical::Foot foot = nearest_on_patch(s.model.wall, s.state.wall, s.model.surface, q, p);
        if (std::abs(foot.gap) < std::abs(best.gap)) best = foot;
      }
      deepest = std::max(deepest, 0.5f * s.model.thread.material.diameter - best.gap);
      if (s.model.surface.patch[best.patch].side < 0 || best.gap < -1e-3f) ++under;
    }
  };
  s.run(0.5f);
  look();
  out.add("closure/surface/thread over a tube, 0.6 N at both ends: overlap", 0, wide(deepest), 0.05e-3, "m", "lies on it");
  out.add("closure/surface/the same, force on each end's node", 0.6, wide(s.state.thread.tension[3]), 0.01, "N", "equilibrium");
  uint32_t random = 7;
  const auto draw = [&] {
    return random = random * 1664525u + 1013904223u, static_cast<float>(random >> 8) / 8388608.0f - 1.0f;
  };
  const physical::State lying = s.state;
  // All contacts together carry what both ends are pulled with.
  Vec3 carried{};
  for (const thread::SoftContact& c : s.state.contact) carried += c.normal * c.normal_impulse + c.friction_impulse;
  carried = carried / (s.model.thread.substep * s.model.thread.substep);
  out.add("closure/surface/the same, force of the wall on the thread", 1.2, wide(carried.y), 0.01, "N", "equilibrium");
  for (int push = 0; push < pushes; ++push) {
    if (push % 5 == 0) s.state = lying;  // later it has been drawn off the tube
    for (thread::Pull& p : s.pull) p.force = {1.5f * draw(), -0.8f + 0.7f * draw(), 0.5f * draw()};
    s.run(0.02f);
    look();
  }
  const std::string name = "closure/surface/" + std::to_string(pushes) + " random pulls of up to 2 N, ";
  out.add(name + "largest overlap", 0, wide(deepest), 0.3e-3, "m", "never inside");
  out.add(name + "nodes on the wrong side", 0, wide(under), 0, "", "nothing passes");
}

}  // namespace catgut::validation
