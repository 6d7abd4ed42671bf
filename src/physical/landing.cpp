// SPDX-License-Identifier: Apache-2.0
// physical/landing: see the header.
#include "physical/landing.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "physical/body_internal.h"

namespace catgut::physical {
namespace {

constexpr int kRounds = 5;       // over contacts that share a node, or a tool
constexpr float kStill = 1e-4f;  // [rad] of jaws from where they shall be

// Puts nodes elsewhere. The pairs of the thread are looked at again when nodes have moved.
struct Mover {
  thread::State& t;
  float moved = 0;  // [m] all together: no node has moved farther
  void move(uint32_t node, Vec3 by) {
    t.x.set(node, t.x.at(node) + by);
    moved += length(by);
  }
  ~Mover() {
    if (moved == 0) return;
    t.travel += moved;
    for (float& left : t.budget) left -= 2 * moved;
  }
};

// Thread that a loose needle, or a tool that holds nothing, has hit otherwise than it was shown to (show_bodies). Jaws that
// move press thread, and so do jaws on their inner side. No mover: the tool goes, not the thread.
bool put_apart(const Model& m, State& s, const Scratch& k, const Hands& hands, size_t pair, Mover* mover) {
  const uint32_t part = thread::partner_of(s.thread.key[pair]) - thread::kTool, b = k.bodies.tool_body[part];
  const BodyModel& model = m.bodies.body[b];
  Body& body = s.bodies.body[b];
  const thread::Crossing& c = s.thread.crossing[pair];
  const thread::ToolCapsule& tool = k.bodies.tool[part];
  const bool still = b >= hands.targets.size() || std::abs(hands.targets[b].opening - body.opening) < kStill;
  const bool rigid = model.falls ? k.bodies.moving[b].loose : still && body.grip.what == Gripped::nothing;
  if (!rigid || c.touch == thread::Touch::unknown) return false;
  const auto first = std::find(k.bodies.tool_body.begin(), k.bodies.tool_body.end(), b) - k.bodies.tool_body.begin();
  const BodyCapsule& capsule = model.thread_capsule[part - static_cast<size_t>(first)];
  const Vec3 a = transform(body.pose, local(model, model.sphere[capsule.a], body.opening)),
             z = transform(body.pose, local(model, model.sphere[capsule.b], body.opening));
  const float ra = tool.radius, rb = ra + tool.widens, r = 0.5f * m.thread.material.diameter;
  const uint32_t node = thread::segment_of(s.thread.key[pair]);
  const Vec3 p = s.thread.position(node), q = s.thread.position(node + 1);
  const float reach = 0.5f * (distance(p, q) + distance(a, z)) + r + std::max(ra, rb);
  if (length2(p + q - a - z) > 4 * reach * reach) return false;
  float along = 0, at = 0;
  nearest_of_segments(p, q, a, z, along, at);
  // A crossing knows on which side of each other they belong.
  Vec3 apart = lerp(p, q, along) - lerp(a, z, at), normal = normalized(apart, c.normal);
  if (dot(normal, c.normal) < -0.3f) normal = -normal;
  const float jaw = model.sphere[capsule.a].jaw;
  if (jaw != 0 && dot(normal, rotate(body.pose.q, {-jaw, 0, 0})) > 0.3f) return false;
  const float out = r + ra + (rb - ra) * at - dot(apart, normal) - kOnBodyLands;
  if (out <= 0) return false;
  const Vec3 by = normal * std::min(out, kFarthestOut);
  const auto presses = [&](const Row& row) {
    return (row.a == b || row.b == b) && row.kind == Row::Kind::contact && kind_of(row.key) != kDrapeRow &&
           dot(row.impulse, row.axis) > 0;
  };
  // A needle that nothing holds up goes instead: thread that is moved is stretched.
  const bool is_free = model.falls && std::none_of(k.bodies.row.begin(), k.bodies.row.end(), presses);
  if (is_free || (!mover && !model.falls)) body.pose.p -= by;
  else if (mover) mover->move(node, by), mover->move(node + 1, by);
  return true;
}

// A node for which another face may be the nearest one now. [m] by which the wall has landed beside it, or it has slid itself,
// which the thread's step knows.
constexpr float kBeside = 0.15e-3f, kSlid = 0.375e-3f;
void put_off_wall(const Model& m, State& s, const Scratch& k, const thread::SoftContact& c, Mover& mover) {
  const Surface& surface = surface_of(m, s);
  const float r = 0.5f * m.thread.material.diameter;
  const Vec3 p = s.thread.position(c.node);
  Foot best;
  float far = 1e-3f;
  for (uint32_t f = k.search.node_first[c.node]; f < k.search.node_first[c.node + 1]; ++f)
    for (uint32_t q = surface.first_of_face[k.search.node_face[f]]; q < surface.first_of_face[k.search.node_face[f] + 1]; ++q) {
      const Foot foot = nearest_on_patch(m.wall, s.wall, surface, q, p);
      if (const float d = distance(foot.at, p); d < far && dot(foot.facing, c.normal) > -0.2f) best = foot, far = d;
    }
  // From deep within nothing says which way is out.
  const float out = r - best.gap - kThreadLands;
  if (far < 1e-3f && out > 0 && best.gap > -r) mover.move(c.node, best.normal * std::min(out, kFarthestOut));
}

// The nearest place of the wall to a sphere of a tool, among the faces near that; no patch: none within reach.
Foot nearest_of_near(const Model& m, const State& s, const BodiesScratch& k, uint32_t body, Vec3 p, float reach) {
  const Surface& surface = surface_of(m, s);
  constexpr float kMoved = 2e-3f;  // [m] by a face, at most, since its center was noted
  Foot best;
  best.patch = wall::kNone;
  float far = reach;
  for (const uint32_t f : k.around[body].face) {
    const float ball = k.face_radius[f] + reach + kMoved;
    if (length2(k.face_center[f] - p) > ball * ball) continue;
    for (uint32_t q = surface.first_of_face[f]; q < surface.first_of_face[f + 1]; ++q) {
      const Foot foot = outer_foot(m.wall, s.wall, surface, q, p);
      const float d = distance(foot.at, p);
      // At an edge, of the patch that the sphere is in front of.
      const bool same = best.patch != wall::kNone && d < far + 1e-7f;
      if (d < far - 1e-7f || (same && dot(p - foot.at, foot.facing) > dot(p - best.at, best.facing)))
        best = foot, far = std::min(far, d);
    }
  }
  return best;
}

}  // namespace

void put_tools_out(const Model& m, State& s, const Scratch& k) {
  for (uint32_t b = 0; b < s.bodies.body.size(); ++b) {
    const BodyModel& tool = m.bodies.body[b];
    Body& body = s.bodies.body[b];
    if (tool.falls || !k.bodies.around[b].made) continue;
    bool moved = true;
    for (int round = 0; round < kRounds && std::exchange(moved, false); ++round)
      for (uint32_t i = 0; i < tool.sphere.size(); ++i) {
        const BodySphere& sphere = tool.sphere[i];
        if (sphere.radius <= kToolLands || (i < 64 && body.skip >> i & 1)) continue;
        const Vec3 at = transform(body.pose, local(tool, sphere, body.opening));
        const Foot foot = nearest_of_near(m, s, k.bodies, b, at, sphere.radius - kToolLands);
        if (foot.patch == wall::kNone || foot.gap <= 0) continue;
        // Half of it in each round: between two walls, and with a wall between its jaws, it comes to lie in the middle.
        body.pose.p += foot.normal * std::min(0.5f * (sphere.radius - kToolLands - foot.gap), kFarthestOut);
        moved = true;
      }
  }
}

void put_thread_out(const Model& m, State& s, const Scratch& k, const Hands& hands) {
  Mover mover{s.thread};
  const bool asleep = s.sleep.any();
  const auto put_all_apart = [&](Mover* by) {
    bool moved = false;
    for (size_t i = 0; i < s.thread.key.size(); ++i)
      if (thread::partner_of(s.thread.key[i]) >= thread::kTool && !(asleep && s.sleep.at(thread::segment_of(s.thread.key[i]))))
        moved |= put_apart(m, s, k, hands, i, by);
    return moved;
  };
  for (int round = 0; round < kRounds; ++round)
    if (!put_all_apart(&mover)) break;
  // The wall that has come farther toward a node than the thread's step foresaw.
  for (const thread::SoftContact& c : k.contact) {
    const Vec3 beside = k.coupling.now(c.point, s.wall) - (k.coupling.at[c.point] + k.moved[c.point]);
    const float nearer = dot(beside, c.normal), out = std::min(nearer, nearer - c.gap - kThreadLands);
    if (out > 0) mover.move(c.node, c.normal * std::min(out, kFarthestOut));
    const Vec3 went = s.thread.v.at(c.node) * m.wall.step;
    if (length2(beside) > kBeside * kBeside || length2(went) > kSlid * kSlid) put_off_wall(m, s, k, c, mover);
  }
  // Thread between a tool and the wall: the tool goes. It may have come into other thread by that.
  if (mover.moved > 0 && put_all_apart(nullptr)) put_all_apart(&mover);
}

}  // namespace catgut::physical
