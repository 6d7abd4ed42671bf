// SPDX-License-Identifier: Apache-2.0
// physical/landing: see the header.
#include "physical/landing.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "physical/body_internal.h"

namespace catgut::physical {
namespace {

constexpr int kRounds = 5;        // over contacts that share a node, or a tool
constexpr float kStill = 1e-4f;   // [rad] of jaws from where they shall be
constexpr float kClosed = 0.01f;  // [rad]

// Puts nodes elsewhere. The pairs of the thread are looked at again when nodes have moved.
struct Mover {
  thread::State& t;
  std::vector<Vec3>& put;  // [m] per node: by which it was moved
  float moved = 0;         // [m] all together: no node has moved farther
  void move(uint32_t node, Vec3 by) {
    by = clamped(put[node] + by, kFarthestOut) - put[node];
    t.x.set(node, t.x.at(node) + by);
    put[node] += by, moved += length(by);
  }
  ~Mover() {
    if (moved == 0) return;
    t.travel += moved;
    for (float& left : t.budget) left -= 2 * moved;
  }
};

// The part of a body that the thread sees as one cone, where it is now.
struct Part {
  float jaw = 0;         // of a sphere
  Vec3 a, z;             // [m]
  float ra = 0, rb = 0;  // [m]
};
Part part_of(const Model& m, const State& s, const BodiesScratch& k, uint32_t index) {
  const uint32_t b = k.tool_body[index];
  const BodyModel& model = m.bodies.body[b];
  const Body& body = s.bodies.body[b];
  const auto first = std::find(k.tool_body.begin(), k.tool_body.end(), b) - k.tool_body.begin();
  const BodyCapsule& capsule = model.thread_capsule[index - static_cast<size_t>(first)];
  const BodySphere &from = model.sphere[capsule.a], &to = model.sphere[capsule.b];
  const float ra = k.tool[index].radius;
  return {static_cast<float>(from.jaw), transform(body.pose, local(model, from, body.opening)),
          transform(body.pose, local(model, to, body.opening)), ra, ra + k.tool[index].widens};
}

// Thread that a loose needle, or a tool that holds nothing, has hit otherwise than it was shown to (show_bodies). Jaws that
// move press thread. No mover: the tool goes, not the thread. side: of the tool, where the thread belongs; zero: where it is.
bool put_apart(const Model& m, State& s, const Scratch& k, const Hands& hands, uint32_t node, uint32_t index, Vec3 side,
               Mover* mover) {
  const uint32_t b = k.bodies.tool_body[index];
  const BodyModel& model = m.bodies.body[b];
  Body& body = s.bodies.body[b];
  const bool still = b >= hands.targets.size() || std::abs(hands.targets[b].opening - body.opening) < kStill;
  const bool rigid = model.falls ? k.bodies.moving[b].loose : still && body.grip.what == Gripped::nothing;
  if (!rigid) return false;
  const auto [jaw, a, z, ra, rb] = part_of(m, s, k.bodies, index);
  const float r = 0.5f * m.thread.material.diameter;
  const Vec3 p = s.thread.position(node), q = s.thread.position(node + 1);
  const float reach = 0.5f * (distance(p, q) + distance(a, z)) + r + std::max(ra, rb);
  if (length2(p + q - a - z) > 4 * reach * reach) return false;
  float along = 0, at = 0;
  nearest_of_segments(p, q, a, z, along, at);
  Vec3 apart = lerp(p, q, along) - lerp(a, z, at), normal = normalized(apart, side);
  if (dot(normal, side) < -0.3f) normal = -normal;
  // Between closed jaws lies half of it in each. Where instruments pass through each other, a strand in both gives way.
  const bool between = jaw != 0 && dot(normal, rotate(body.pose.q, {-jaw, 0, 0})) > 0.3f;
  if (between && body.opening > kClosed && !m.bodies.pair_contact) return false;
  const float out = r + ra + (rb - ra) * at - dot(apart, normal) - (between ? kBetweenLands : kOnBodyLands);
  if (out <= 0) return false;
  const Vec3 by = normal * std::min(out, kFarthestOut);
  const auto presses = [&](const Row& row) {
    return (row.a == b || row.b == b) && row.kind == Row::Kind::contact && kind_of(row.key) != kDrapeRow &&
           dot(row.impulse, row.axis) > 0;
  };
  // A needle that nothing holds up goes instead: thread that is moved is stretched. With one that is held up, what presses it.
  const bool is_free = model.falls && std::none_of(k.bodies.row.begin(), k.bodies.row.end(), presses);
  if (mover && !is_free) {
    mover->move(node, by), mover->move(node + 1, by);
    return true;
  }
  body.pose.p -= by;
  for (uint32_t other = 0; !is_free && model.falls && other < s.bodies.body.size(); ++other) {
    const auto on_it = [&](const Row& row) { return presses(row) && !row.on_wall && (row.a == other || row.b == other); };
    if (other != b && std::any_of(k.bodies.row.begin(), k.bodies.row.end(), on_it)) s.bodies.body[other].pose.p -= by;
  }
  return true;
}

// A node for which another face may be the nearest one now. [m] by which the wall has landed beside it, or a tool has put it
// elsewhere; or it has slid itself, which the thread's step knows.
constexpr float kBeside = 0.15e-3f, kSlid = 0.375e-3f, kDeep = 0.4e-3f, kRests = 0.05e-3f;
void put_off_wall(const Model& m, State& s, const Scratch& k, uint32_t node, Vec3 outward, Mover& mover) {
  const Surface& surface = surface_of(m, s);
  const float r = 0.5f * m.thread.material.diameter;
  const Vec3 p = s.thread.position(node);
  NearestFoot nearest;
  nearest.best.gap = 1e-3f;
  for (uint32_t f = k.search.node_first[node]; f < k.search.node_first[node + 1]; ++f)
    for (uint32_t q = surface.first_of_face[k.search.node_face[f]]; q < surface.first_of_face[k.search.node_face[f] + 1]; ++q) {
      const Foot foot = nearest_on_patch(m.wall, s.wall, surface, q, p);
      if (dot(foot.facing, outward) > -0.2f) nearest.offer(foot, p);
    }
  nearest.settle_side(m.wall, s.wall, surface, p);
  const Foot& best = nearest.best;
  // From deep within, only a face that looks as the last one says which way is out.
  const float out = r - best.gap - kThreadLands;
  const float deepest = dot(best.normal, outward) > 0.5f ? kDeep : r;
  if (nearest.shared > 0 && out > 0 && best.gap > -deepest) mover.move(node, best.normal * std::min(out, kFarthestOut));
}

// A node that was put off one side of a fold, `from` where it was before: it slides along that side, out of the fold, as far as
// the other side asks for, in front of which it was.
void keep_before_other_side(const Model& m, State& s, const Scratch& k, uint32_t node, Vec3 from, Mover& mover) {
  constexpr float kSharpest = -0.9f;  // cosine between the normals: from a closed fold it cannot slide
  const Vec3 to = s.thread.position(node), off = normalized(to - from);
  const Surface& surface = surface_of(m, s);
  const float r = 0.5f * m.thread.material.diameter;
  NearestFoot nearest;
  nearest.best.gap = 1e-3f;
  for (uint32_t f = k.search.node_first[node]; f < k.search.node_first[node + 1]; ++f)
    for (uint32_t q = surface.first_of_face[k.search.node_face[f]]; q < surface.first_of_face[k.search.node_face[f] + 1]; ++q) {
      const Foot foot = nearest_on_patch(m.wall, s.wall, surface, q, to);
      if (dot(foot.facing, off) > -0.2f || dot(from - foot.at, foot.facing) < 0) continue;
      nearest.offer(foot, to);
    }
  const Foot& other = nearest.best;
  const float along = dot(other.facing, off), out = r - other.gap - kThreadLands;
  if (nearest.shared > 0 && out > 0 && along > kSharpest)
    mover.move(node, clamped((other.facing - along * off) * (out / (1 - along * along)), kFarthestOut));
}

// The nearest place of the wall to a sphere of a tool, among the faces near its run; no patch: none within reach. moved [m]: by
// the wall, at most, since the balls round its faces were made.
Foot nearest_of_near(const Model& m, const State& s, const BodiesScratch& k, uint32_t body, uint32_t sphere, Vec3 p,
                     float reach, float moved) {
  const Surface& surface = surface_of(m, s);
  Foot best;
  best.patch = wall::kNone;
  float far = reach;
  const BodiesScratch::Around& around = k.around[body];
  for (const uint32_t f : around.faces(around.run[sphere / kRun])) {
    const float far_off = 1.001f * (k.ball[f].radius + reach + moved);
    if (length2(k.ball[f].center - p) > far_off * far_off) continue;
    for (uint32_t q = surface.first_of_face[f]; q < surface.first_of_face[f + 1]; ++q) {
      const Foot foot = nearest_on_patch(m.wall, s.wall, surface, q, p);
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
  const float wall_moved = moved_since(s.wall, k.search);
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
        const Foot foot = nearest_of_near(m, s, k.bodies, b, i, at, sphere.radius - kToolLands, wall_moved);
        if (foot.patch == wall::kNone || foot.gap <= 0) continue;
        // Half of it in each round: between two walls, and with a wall between its jaws, it comes to lie in the middle.
        body.pose.p += foot.normal * std::min(0.5f * (sphere.radius - kToolLands - foot.gap), kFarthestOut);
        moved = true;
      }
    // Jaws that stand over a wall which is too thick for them: the tool goes back along its shaft, toward its wider end.
    float deepest = 0;
    for (uint32_t i = 0; tool.hinge_z > 0 && moved && i < tool.sphere.size(); ++i) {
      const BodySphere& sphere = tool.sphere[i];
      if (sphere.jaw == 0 || sphere.radius <= kOverLands || (i < 64 && body.skip >> i & 1)) continue;
      const Vec3 at = transform(body.pose, local(tool, sphere, body.opening));
      const Foot foot = nearest_of_near(m, s, k.bodies, b, i, at, sphere.radius - kOverLands, wall_moved);
      if (foot.patch != wall::kNone && foot.gap > 0) deepest = std::max(deepest, sphere.radius - kOverLands - foot.gap);
    }
    if (deepest > 0 && body.opening > kClosed)
      body.pose.p += rotate(body.pose.q, {0, 0, 1}) * std::min(2 * deepest / body.opening, kFarthestOut);
  }
}

void put_thread_out(const Model& m, State& s, Scratch& k, const Hands& hands) {
  k.put.assign(s.thread.nodes(), {});
  thread::State& t = s.thread;
  Mover mover{t, k.put};
  constexpr float kElsewhere = 0.1e-3f, kLongest = 2e-3f;  // [m] the latter: of a segment and the thread's radius
  const float r = 0.5f * m.thread.material.diameter;
  const auto is_own = [](const thread::ToolCapsule& c, uint32_t segment) {
    return segment >= c.own_first && segment <= c.own_last;
  };
  const bool asleep = s.sleep.any();
  const auto each_awake = [&](auto&& visit) {
    const uint32_t segments = static_cast<uint32_t>(t.segments());
    if (!asleep)
      for (uint32_t i = 0; i < segments; ++i) visit(i);
    for (const Sleep::Strand& strand : s.sleep.strand)
      for (uint32_t i = strand.first; asleep && !strand.asleep && i <= strand.last && i < segments; ++i) visit(i);
  };
  // Segments with a node that was put elsewhere by now.
  float listed = -1;  // Mover::moved then
  const auto list_put = [&] {
    if (listed == mover.moved) return;
    listed = mover.moved, k.put_segment.clear();
    each_awake([&](uint32_t i) {
      if (std::max(length2(k.put[i]), length2(k.put[i + 1])) >= kElsewhere * kElsewhere) k.put_segment.push_back(i);
    });
  };
  const auto put_all_apart = [&](Mover* by) {
    bool moved = false;
    for (size_t i = 0; i < t.key.size(); ++i) {
      const uint32_t segment = thread::segment_of(t.key[i]), partner = thread::partner_of(t.key[i]);
      if (partner < thread::kTool || t.crossing[i].touch == thread::Touch::unknown || (asleep && s.sleep.at(segment))) continue;
      moved |= put_apart(m, s, k, hands, segment, partner - thread::kTool, t.crossing[i].normal, by);
    }
    // What was not near each other before one of them was put elsewhere.
    for (uint32_t index = 0; index < k.bodies.tool_body.size(); ++index) {
      const Body& body = s.bodies.body[k.bodies.tool_body[index]];
      const bool tool_is = length2(body.pose.p - body.shown.p) > kElsewhere * kElsewhere;
      if (!tool_is && mover.moved == 0) continue;
      const Part part = part_of(m, s, k.bodies, index);
      const float far = 0.5f * distance(part.a, part.z) + std::max(part.ra, part.rb) + kLongest;
      const auto look = [&](uint32_t i) {
        if (t.broken[i] || length2(t.x.at(i) - (part.a + part.z) * 0.5f) > far * far ||
            std::binary_search(t.key.begin(), t.key.end(), i << 16 | (thread::kTool + index)) ||
            is_own(k.bodies.tool[index], i))
          return;
        moved |= put_apart(m, s, k, hands, i, index, {}, by);
      };
      if (tool_is) {
        each_awake(look);
        continue;
      }
      list_put();
      for (size_t n = 0; n < k.put_segment.size(); ++n) {
        const uint32_t i = k.put_segment[n];
        look(i);
        if (listed == mover.moved) continue;
        list_put();
        n = static_cast<size_t>(std::upper_bound(k.put_segment.begin(), k.put_segment.end(), i) - k.put_segment.begin()) - 1;
      }
    }
    return moved;
  };
  // The wall that has come farther toward a node than the thread's step foresaw, or to which a tool has moved the node.
  const auto put_all_off_wall = [&] {
    for (const thread::SoftContact& c : k.contact) {
      const Vec3 from = t.position(c.node);
      const Vec3 beside = k.coupling.now(c.point, s.wall) - (k.coupling.at[c.point] + k.moved[c.point]) - k.put[c.node];
      const float nearer = dot(beside, c.normal), out = std::min(nearer, nearer - c.gap - kThreadLands);
      if (out > 0) mover.move(c.node, c.normal * std::min(out, kFarthestOut));
      const float went2 = length2(s.thread.v.at(c.node) * m.wall.step), beside2 = length2(beside);
      const auto in_its_patch = [&] {
        return nearest_on_patch(m.wall, s.wall, surface_of(m, s), c.patch, t.position(c.node)).gap < r - kThreadLands;
      };
      if (beside2 > kBeside * kBeside || went2 > kSlid * kSlid ||
          ((beside2 > kRests * kRests || went2 > kRests * kRests) && in_its_patch()))
        put_off_wall(m, s, k, c.node, c.normal, mover);
      if (length2(t.position(c.node) - from) > kBeside * kBeside) keep_before_other_side(m, s, k, c.node, from, mover);
    }
    for (uint32_t i = 0, at = 0; mover.moved > 0 && i < t.nodes(); ++i) {
      while (at < k.contact.size() && k.contact[at].node < i) ++at;
      if ((at < k.contact.size() && k.contact[at].node == i) || length2(k.put[i]) < kElsewhere * kElsewhere) continue;
      put_off_wall(m, s, k, i, normalized(-k.put[i]), mover);
    }
  };
  // Thread between a tool and the wall: then the tool goes, and all is looked at once more.
  for (int pass = 0; pass < 2; ++pass) {
    for (int round = 0; round < kRounds; ++round)
      if (!put_all_apart(&mover)) break;
    put_all_off_wall();
    if (mover.moved == 0 || !put_all_apart(nullptr)) break;
  }
}

}  // namespace catgut::physical
