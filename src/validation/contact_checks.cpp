// SPDX-License-Identifier: Apache-2.0
// validation: tools, needles and thread pushed, dragged, dropped and pulled at random against the wall of a tube, from outside
// and through its opening. Seen from outside: no axis of a capsule and no segment of thread crosses the middle of the wall, and
// no sphere lies deeper in the wall than the bound.
#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include "core/random.h"
#include "physical/physical.h"
#include "validation/checks.h"
#include "validation/contact_scenes.h"

namespace catgut::validation {

using physical::BodyModel;
using physical::Foot;

ContactBench::ContactBench(uint64_t s) : seed(s) {
  wall::TubeShape shape;
  shape.length = 0.05f, shape.rings = 14, shape.held_rings = 2;
  wall::Spec spec;
  spec.mesh = wall::tube(shape);
  spec.drag = 20;
  const wall::Wall w = wall::build_wall(spec);
  model = physical::make_model(w, knot_settings(0.3f));
  model.thread.gravity = model.bodies.gravity = {0, -9.81f, 0};
  physical::ToolShape blunt;
  blunt.tip_radius = 1.6e-3f, blunt.hinge_radius = 2.4e-3f;
  model.bodies.body = {physical::make_tool(blunt), physical::make_needle_body({})};
  model.needles.needle = {physical::make_needle({}, 1)};
  model.needles.law.puncture = 1e3f;  // nothing may cross
  rest.wall = w.state;
  rest.bodies.body.resize(2), rest.needle.resize(1);
  std::vector<Vec3> path;  // across the tube's top, ends hanging down beside it
  for (int i = 0; i < 120; ++i) {
    const float along = 0.5e-3f * static_cast<float>(i - 60), angle = std::clamp(along / 0.0205f, -1.2f, 1.2f);
    const float down = std::abs(along) - 0.0205f * std::abs(angle);
    path.push_back(Vec3{std::sin(angle), std::cos(angle), 0} * 0.0205f +
                   Vec3{std::copysign(down * std::cos(1.2f), angle), -down * std::sin(1.2f), -0.02f});
  }
  rest.thread = thread::make_state(path);
  state = rest;
  target.resize(2);
  scratch = std::make_unique<physical::Scratch>(model, rest);
}

Vec3 ContactBench::direction() {
  for (;;) {
    const Vec3 v{2 * random.uniform() - 1, 2 * random.uniform() - 1, 2 * random.uniform() - 1};
    if (length2(v) < 1 && length2(v) > 0.01f) return normalized(v);
  }
}

void ContactBench::step() {
  physical::Hands hands;
  hands.targets = target, hands.pulls = pull;
  physical::step(model, state, *scratch, hands, jobs);
}

namespace {

// The segment p q crosses the triangle a b c.
bool crosses(Vec3 p, Vec3 q, Vec3 a, Vec3 b, Vec3 c) {
  const Vec3 d = q - p, e = b - a, f = c - a, h = cross(d, f);
  const float det = dot(e, h);
  if (std::abs(det) < 1e-16f) return false;
  const Vec3 r = p - a;
  const float u = dot(r, h) / det;
  const Vec3 g = cross(r, e);
  const float v = dot(d, g) / det, t = dot(f, g) / det;
  return u >= 0 && v >= 0 && u + v <= 1 && t >= 0 && t <= 1;
}

}  // namespace

void ContactBench::look() {
  const wall::Model& wm = model.wall;
  const wall::State& ws = state.wall;
  const uint32_t faces = static_cast<uint32_t>(wm.lane_of_face.size());
  const auto corner = [&](uint32_t f, size_t k) {
    const uint32_t lane = wm.lane_of_face[f];
    return wall::vec3(ws.motion.x[2 * ws.topology.corners[lane / wall::kLanesOfBlock].column[k][lane % wall::kLanesOfBlock]]);
  };
  center.resize(faces), radius.resize(faces);
  for (uint32_t f = 0; f < faces; ++f) {
    center[f] = (corner(f, 0) + corner(f, 1) + corner(f, 2) + corner(f, 3)) * 0.25f;
    radius[f] = 0;
    for (size_t k = 0; k < 4; ++k) radius[f] = std::max(radius[f], distance(center[f], corner(f, k)));
  }
  const auto passes = [&](Vec3 p, Vec3 q) {
    const Vec3 middle = (p + q) * 0.5f;
    const float half = 0.5f * distance(p, q);
    for (uint32_t f = 0; f < faces; ++f) {
      if (length2(center[f] - middle) > (radius[f] + half) * (radius[f] + half)) continue;
      if (crosses(p, q, corner(f, 0), corner(f, 1), corner(f, 2)) || crosses(p, q, corner(f, 0), corner(f, 2), corner(f, 3)))
        return true;
    }
    return false;
  };
  const auto overlap = [&](Vec3 p, float r) {
    Foot best;
    float far = 1;
    for (uint32_t f = 0; f < faces; ++f) {
      const float reach = radius[f] + 4e-3f;
      if (length2(center[f] - p) > reach * reach) continue;
      for (uint32_t q = model.surface.first_of_face[f]; q < model.surface.first_of_face[f + 1]; ++q) {
        const Foot foot = outer_foot(wm, ws, model.surface, q, p);
        const float d = distance(foot.at, p);
        const bool clearer = d < far + 1e-7f && dot(p - foot.at, foot.facing) > dot(p - best.at, best.facing);
        if (d < far - 1e-7f || clearer) best = foot, far = std::min(far, d);
      }
    }
    // Outside, beyond an edge, where no facing decides.
    if (far > 0.9f || (best.on_edge && best.gap < 0)) return 0.0f;
    // A face folded or sheared so far that its directors lie in it has no inside.
    wall::Weights up = wall::weights(wm, ws.topology, best.point), mid = up;
    up.zeta = 1, mid.zeta = 0;
    const float height = std::abs(dot(wall::place(up, ws.motion) - wall::place(mid, ws.motion), best.facing));
    if (model.surface.patch[best.patch].side != 0 && height < 0.25f * wm.laminate.thickness) {
      folded += far < r + 1e-4f;
      return 0.0f;
    }
    return r - best.gap;
  };
  for (uint32_t b = 0; b < 2; ++b) {
    const BodyModel& m = model.bodies.body[b];
    const physical::Body& body = state.bodies.body[b];
    const auto at = [&](uint32_t s) { return transform(body.pose, local(m, m.sphere[s], body.opening)); };
    for (uint32_t s = 0; s < m.sphere.size(); ++s)
      if (m.sphere[s].radius > 0) deepest[b] = std::max(deepest[b], overlap(at(s), m.sphere[s].radius));
    for (const physical::BodyCapsule& c : m.capsule) passed[b] += passes(at(c.a), at(c.b));
    fastest = std::max(fastest, length(body.velocity)), strongest = std::max(strongest, length(body.force));
  }
  const float r = 0.5f * model.thread.material.diameter;
  for (uint32_t i = 0; i < state.thread.nodes(); ++i) {
    deepest[2] = std::max(deepest[2], overlap(state.thread.position(i), r));
    if (i > 0) passed[2] += passes(state.thread.position(i - 1), state.thread.position(i));
  }
}

bool ContactBench::clear(const Pose& tool, float opening) const {
  const BodyModel &m = model.bodies.body[0], &needle = model.bodies.body[1];
  const auto hits = [&](Vec3 p, float r) {
    return std::any_of(m.capsule.begin(), m.capsule.end(), [&](const physical::BodyCapsule& c) {
      const Vec3 a = transform(tool, local(m, m.sphere[c.a], opening)), b = transform(tool, local(m, m.sphere[c.b], opening));
      const float at = std::clamp(dot(p - a, b - a) / length2(b - a), 0.0f, 1.0f);
      return distance(p, lerp(a, b, at)) < std::max(m.sphere[c.a].radius, m.sphere[c.b].radius) + r + 0.5e-3f;
    });
  };
  for (const thread::State* t : {&state.thread, &rest.thread})
    for (uint32_t i = 0; i < t->nodes(); ++i)
      if (hits(t->position(i), 0.5f * model.thread.material.diameter)) return false;
  return std::none_of(needle.sphere.begin(), needle.sphere.end(), [&](const physical::BodySphere& s) {
    return hits(transform(state.bodies.body[1].pose, s.at), std::abs(s.radius));
  });
}

void ContactBench::event(float max_force, float max_speed) {
  // Each group of five starts from rest with its own numbers, so that it can be repeated alone.
  if (events % 5 == 0) state = rest, random = Random(seed * 1000003 + static_cast<uint64_t>(events));
  ++events;
  passed[0] = passed[1] = passed[2] = folded = 0;
  std::fill(std::begin(deepest), std::end(deepest), 0.0f);
  pull.clear(), target.assign(2, {});
  BodyModel& tool = model.bodies.body[0];
  tool.max_force = max_force * (0.25f + 0.75f * random.uniform());
  const float opening = random.uniform() < 0.5f ? 0.0f : 0.2f * random.uniform();
  // The needle falls on the tube, or is thrown at it.
  if (events % 5 == 1 || random.uniform() < 0.3f) {
    const Vec3 d = direction();
    Pose needle{Vec3{0.016f * d.x, 0.034f, -0.02f + 0.016f * d.z}, normalized(Quat{d.x, d.y, d.z, random.uniform()})};
    physical::move_body(model, state, 1, needle, 0);
    state.bodies.body[1].velocity = Vec3{0, -max_speed * random.uniform(), 0};
    state.bodies.body[1].spin = direction() * (20 * random.uniform());
  }
  // The tool starts clear of everything: outside, or in front of the opening.
  Vec3 from, mark, aim;
  Pose pose;
  for (bool found = false; !found;) {
    const bool inside = random.uniform() < 0.25f;
    const float angle = 2 * kPi * random.uniform();
    const Vec3 out{std::cos(angle), std::sin(angle), 0};
    mark = inside ? out * 0.02f + Vec3{0, 0, -0.005f - 0.01f * random.uniform()}
                  : out * 0.02f + Vec3{0, 0, -0.036f * random.uniform()};
    from = inside ? Vec3{0, 0, 0.012f} : out * 0.034f + Vec3{0, 0, mark.z} + direction() * 0.006f;
    aim = normalized(mark + direction() * 0.004f - from);
    const Vec3 x = any_perpendicular(aim);
    pose = {from, from_axes(x, cross(-aim, x), -aim)};
    found = clear(pose, opening);
  }
  physical::move_body(model, state, 0, pose, opening);
  // Where an earlier event has left the tube or the needle in the way, the event begins from rest.
  look();
  if (deepest[0] > 0 || passed[0] > 0 || deepest[1] > 0.1e-3f || passed[1] > 0) {
    const physical::Body falling = state.bodies.body[1];
    state = rest;
    physical::move_body(model, state, 0, pose, opening);
    physical::move_body(model, state, 1, falling.pose, 0);
    state.bodies.body[1].velocity = falling.velocity, state.bodies.body[1].spin = falling.spin;
    look();
    if (deepest[1] > 0 || passed[1] > 0) physical::move_body(model, state, 1, {{0, 0.08f, -0.02f}, {}}, 0);
  }
  passed[0] = passed[1] = passed[2] = folded = 0;
  std::fill(std::begin(deepest), std::end(deepest), 0.0f);
  const float speed = max_speed * (0.02f + 0.98f * random.uniform() * random.uniform());
  const Vec3 drag = normalized(cross(aim, direction())) * (random.uniform() < 0.5f ? speed : 0.0f);
  for (const uint32_t end : {0u, static_cast<uint32_t>(state.thread.nodes()) - 1})
    pull.push_back({end, direction() * (0.5f * random.uniform()) + Vec3{0, -0.3f, 0}});
  const float depth = distance(from, mark) + 0.012f;
  float gone = 0;
  for (int i = 0; i < 80; ++i) {
    const float move = std::min(speed * 1e-3f, depth - gone);
    gone += move;
    pose.p += aim * move;
    if (gone > distance(from, mark)) pose.p += drag * 1e-3f;
    target[0] = {pose, true, opening, 0};
    step();
    if (i % 4 == 3) look();
    if (watch) watch();
  }
}

void check_contacts(Lines& out, bool nightly) {
  const int events = nightly ? 10000 : 24;
  ContactBench bench(11);
  float deepest[3] = {};
  int passed[3] = {}, folded = 0;
  for (int i = 0; i < events; ++i) {
    bench.event(8, 1);
    for (size_t b = 0; b < 3; ++b) deepest[b] = std::max(deepest[b], bench.deepest[b]), passed[b] += bench.passed[b] > 0;
    folded += bench.folded > 0;
  }
  const std::string name = "contact/" + std::to_string(events) + " pushes, drags, drops and pulls to 8 N and 1 m/s, ";
  const char* who[3] = {"tool", "needle", "thread"};
  for (size_t b = 0; b < 3; ++b) {
    out.add(name + who[b] + ": events in which it crossed the wall", 0, passed[b], 0, "", "nothing passes");
    out.add(name + who[b] + ": overlap, on faces that are in order", 0, static_cast<double>(deepest[b]), 0.3e-3, "m",
            "at most 0.3 mm");
  }
  if (!nightly) return;
  out.add(name + "events in which something touched a face of the wall that was folded, its directors in its plane", 0, folded,
          0, "", "the wall's elements stay in order");
}

}  // namespace catgut::validation
