// SPDX-License-Identifier: Apache-2.0
// suture/loop: reads thread and tools; freezes loops on them (paper 2.4, figure 10).
//
// A surgeon wraps the thread round the needle holder before grasping the other end. Detection uses the projection of the thread
// onto the plane across the tool, in which the tool is a point, its tip. Does the thread cross itself there, and does it
// enclose the tip? Two more tests reject false positives of the projection. Does the thread touch the tool? Are its ends
// side by side, or is it a stretched spiral?
#include "suture/loop.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace catgut {
namespace {

constexpr size_t kMostCorners = 512;        // of the thread on one tool: a longer run is a tangle; only its beginning is tested
constexpr size_t kFewest = 3;               // minimum particles of a loop: thread between two is straight
constexpr float kOwnStrands = 0.012f;       // [m] of thread on either side that belong to a loop: jaws do not grasp them
constexpr float kWide = 0.95f;              // a jaw opened this far drops the loop round it
constexpr size_t kSeveral = 6;              // particles that must touch before a rejection is reported,
constexpr float kMostOfATurn = 1.5f * kPi;  // [rad] and the angle round the tool that they must reach
constexpr double kParallel = 1e-12;  // [m^2] thread parallel to the tool is a point in the projection and crosses nothing

// A corner of the thread's projection onto the plane across the tool.
struct Corner {
  double x = 0, y = 0;                 // [m] the tool is at 0, 0
  double depth_in = 0, depth_out = 0;  // [m] along the tool, of the thread before and after this corner
  size_t node = 0;                     // of the thread at this corner, or the last one before it
  int closed = 0;                      // turns closed before it
};

// Touching. A loop is a polygon with corners one spacing apart, and thread is stiff. Even a tight one stands off the tool by
// 0.5 mm at its corners, a slack one by 2 mm. So touching means within `reach` of the surface. Beyond the tip there is
// no tool: thread there slips off, at any distance.
bool touches(const LoopTool& tool, Vec3 p, float reach) {
  if (p.z < 0) return false;
  for (const Capsule& c : tool.capsule) {
    const float t = closest_on_segment(p, c.a, c.b), far = c.radius + reach;
    if (length2(p - (c.a + (c.b - c.a) * t)) <= far * far) return true;
  }
  return false;
}

// Where segment p-q crosses segment a-b: at s of a-b and t of p-q. Each segment includes its beginning but not its end, so
// that a crossing at a corner counts once.
bool cross(const Corner& a, const Corner& b, const Corner& p, const Corner& q, double& s, double& t) {
  const double ux = b.x - a.x, uy = b.y - a.y, vx = q.x - p.x, vy = q.y - p.y, wx = p.x - a.x, wy = p.y - a.y;
  const double area = ux * vy - uy * vx;
  if (std::abs(area) < kParallel) return false;
  s = (wx * vy - wy * vx) / area;
  t = (wx * uy - wy * ux) / area;
  return s >= 0 && s < 1 && t >= 0 && t < 1;
}

// Even-odd rule (Shimrat 1962). A ray from the tip crosses the polygon's sides an odd number of times if the tip is inside.
// twice_area: positive for a polygon that runs counter-clockwise as seen from the hand.
bool tip_inside(std::span<const Corner> polygon, double& twice_area) {
  bool inside = false;
  twice_area = 0;
  for (size_t i = 0, j = polygon.size() - 1; i < polygon.size(); j = i++) {
    const Corner &a = polygon[j], &b = polygon[i];
    twice_area += a.x * b.y - a.y * b.x;
    if ((a.y > 0) == (b.y > 0)) continue;
    if (a.x + (b.x - a.x) * (-a.y) / (b.y - a.y) > 0) inside = !inside;
  }
  return inside;
}

// The verdict of the later test: a loop rejected by depth is closer to a loop than a run without a
// crossing.
bool better(const LoopVerdict& a, const LoopVerdict& b) {
  if (a.wraps != b.wraps) return a.wraps > b.wraps;
  return a.wraps == 0 && a.reason > b.reason;
}

// One run of consecutive particles that touch the tool, traversed pair by pair in order. Every pair is tested against all pairs
// before it. At a crossing, the thread between the crossing pairs is a closed polygon in the projection. The loop is evaluated,
// then removed, and traversal continues from the crossing. Every polygon is therefore simple, and the even-odd rule is exact (a
// double turn as one polygon would count as outside). Turns add up to the winding number, and a later loop is found like
// the first.
void judge_run(const LoopTool& tool, const Vec4* x, std::span<const uint32_t> order, size_t begin, size_t end, float pair,
               LoopVerdict& best) {
  // One more particle on each side: the crossing itself may lie in a pair that is partly off the tool.
  const size_t from = begin > 0 ? begin - 1 : begin, to = std::min(order.size(), end + 1);
  std::array<Corner, kMostCorners> path;
  size_t corners = 0;
  LoopVerdict turns;  // consecutive turns of equal sense are one loop
  int closed = 0;
  double angle = 0;
  for (size_t i = from; i < to && corners + 2 < kMostCorners; ++i) {
    const Vec3 p = to_local(tool.pose, xyz(x[order[i]]));
    const Corner next{double{p.x}, double{p.y}, double{p.z}, double{p.z}, i, closed};
    if (i > from) {
      const Corner& was = path[corners - 1];
      angle += portable::atan2(was.x * next.y - was.y * next.x, was.x * next.x + was.y * next.y);
    }
    best.round = std::max(best.round, static_cast<float>(std::abs(angle)));
    // The pair may cross several: nearest crossing first.
    while (corners >= 3) {
      double at = 2, along = 0;
      size_t crossed = 0;
      for (size_t k = 0; k + 2 < corners; ++k) {
        double s = 0, t = 0;
        if (cross(path[k], path[k + 1], path[corners - 1], next, s, t) && t < at) at = t, along = s, crossed = k;
      }
      if (at > 1) break;
      const Corner &a = path[crossed], &b = path[crossed + 1], &p0 = path[corners - 1];
      Corner crossing;
      crossing.x = p0.x + (next.x - p0.x) * at;
      crossing.y = p0.y + (next.y - p0.y) * at;
      crossing.depth_in = a.depth_out + (b.depth_in - a.depth_out) * along;
      crossing.depth_out = p0.depth_out + (next.depth_in - p0.depth_out) * at;
      crossing.node = i - 1;
      const size_t first = a.node + 1, last = i - 1;
      const int between = 1 + closed - a.closed;  // turns of thread between its two strands
      path[corners] = crossing;
      double twice_area = 0;
      const bool inside = tip_inside({path.data() + crossed + 1, corners - crossed}, twice_area);
      // First check: the loop encircles the tool, seen from the tip. Second check: at the crossing, its ends are within one
      // pair of particles along the tool for each turn between them. Beyond that it is a spiral, which does not form a knot:
      // when pulled, it runs along the tool and closes on nothing. The distance is measured at the crossing, not at the
      // particles next to it. The answer therefore does not depend on where along the thread the particles
      // lie.
      const double depth = std::abs(crossing.depth_out - crossing.depth_in);
      if (!inside || last < first + kFewest - 1) {
        LoopVerdict v;
        v.reason = LoopReason::tip_outside;
        if (better(v, best)) best.reason = v.reason;
      } else if (depth > double{pair} * between) {
        LoopVerdict v;
        v.reason = LoopReason::too_deep;
        if (better(v, best)) best.reason = v.reason;
      } else {
        const int32_t way = twice_area > 0 ? 1 : -1;
        if (turns.wraps == 0 || turns.turn != way) {
          turns = {};
          turns.first = first;
          turns.turn = way;
        }
        turns.reason = LoopReason::none;
        turns.first = std::min(turns.first, first);
        turns.last = last;
        ++turns.wraps;
        crossing.closed = ++closed;
        if (better(turns, best)) {
          turns.touching = best.touching, turns.round = best.round;
          best = turns;
        }
      }
      path[crossed + 1] = crossing;
      corners = crossed + 2;
    }
    path[corners++] = next;
  }
}

}  // namespace

LoopVerdict find_loop(const Vec4* x, std::span<const uint32_t> order, const LoopTool& tool, float pair, float reach) {
  LoopVerdict best;
  for (size_t i = 0; i < order.size();) {
    size_t end = i;
    while (end < order.size() && touches(tool, to_local(tool.pose, xyz(x[order[end]])), reach)) ++end;
    best.touching = std::max(best.touching, end - i);
    if (end - i >= kFewest) judge_run(tool, x, order, i, end, pair, best);
    i = end + 1;
  }
  return best;
}

namespace {

// Locked by something other than the loop round that tool.
bool is_held_elsewhere(const Strand& t, uint32_t slot, int body) {
  return is_anchored(t, slot) || std::any_of(t.hold.begin(), t.hold.end(), [&](const ThreadHold& h) {
           return h.slot == slot && !(h.body == body && h.kind == HoldKind::loop);
         });
}

// The verdict on one strand, and which strand that is.
struct Found {
  LoopVerdict verdict;
  uint32_t suture = 0;
};

// Figure 10 on every stretch of free thread of a strand. A suture point, a jaw and a cut end a stretch: thread beyond them
// cannot be pulled through a loop. Adds to previous results.
void look(const SutureContext& c, uint32_t suture, uint32_t who, Found& best) {
  const Strand& t = c.solver.strand[suture];
  const LoopTool tool{c.solver.body[who].pose(), c.model.body[who].capsule};
  for (size_t begin = 0, end = 0; begin + 1 < t.order.size(); begin = end) {
    end = begin + 1;
    while (end + 1 < t.order.size() && !t.cut[end - 1] && !is_held_elsewhere(t, t.order[end], static_cast<int>(who))) ++end;
    // Both ends of the stretch belong to it, unless the thread is cut there.
    const size_t last = t.cut[end - 1] ? end - 1 : end;
    LoopVerdict v = find_loop(c.solver.x.data(), {t.order.data() + begin, last - begin + 1}, tool,
                              c.suture.loop_depth * c.model.strand[suture].spacing, c.suture.loop_reach);
    v.first += begin, v.last += begin;
    v.touching = std::max(v.touching, best.verdict.touching), v.round = std::max(v.round, best.verdict.round);
    if (better(v, best.verdict)) best = {v, suture};
    best.verdict.touching = v.touching, best.verdict.round = v.round;
  }
}

// Chirality: that of the half knot which the loop becomes. Its two strands leave the tissue, and the one that the tool grasps
// is pulled through the loop along the tool, from tip to hand. The sign of the half knot is the sense in which the other one,
// traversed outward too, turns about that direction. It is independent of which end was wrapped and of the tool's direction.
// Two throws with equal signs are a granny knot, with opposite signs a square knot. The list runs from free end to needle:
// outward on the needle's side of the stitch, inward on the free end's.
int32_t handedness(const Strand& t, const LoopVerdict& v) {
  for (size_t i = 0; i < v.first; ++i)
    for (const ThreadAnchor& a : t.anchor)
      if (a.slot == t.order[i]) return v.turn;
  return t.anchor.empty() ? v.turn : -v.turn;
}

Vec3 middle(const OneSuture& s, const LoopVerdict& v) {
  Vec3 sum{};
  for (size_t i = v.first; i <= v.last; ++i) sum += s.at(s.strand.order[i]);
  return sum / static_cast<float>(v.last - v.first + 1);
}

// "All the particles in the loop are attached to the tool using particle attachments. This prevents the user from undoing the
// loop."
void freeze(OneSuture& s, uint32_t who, const LoopVerdict& v, int32_t chirality) {
  Strand& t = s.strand;
  ToolLoop& loop = s.all.state.loop[who];
  const Pose tool = s.all.solver.body[who].pose();
  for (size_t i = v.first; i <= v.last; ++i) {
    const uint32_t slot = t.order[i];
    if (!is_held(t, slot)) t.hold.push_back({slot, static_cast<int>(who), to_local(tool, s.at(slot)), HoldKind::loop});
  }
  const size_t first = loop.wraps > 0 ? std::min(v.first, node_of(t, loop.first)) : v.first;
  const size_t last = loop.wraps > 0 ? std::max(v.last, node_of(t, loop.last)) : v.last;
  loop.first = t.order[first], loop.last = t.order[last];
  loop.wraps = v.wraps;
  loop.chirality = chirality;
  loop.suture = s.index;
  loop.reported = LoopReason::none;
  s.all.report_tool(s.index, EventKind::loop_formed, who, loop.wraps, static_cast<float>(chirality), middle(s, v));
}

// One tool. An existing loop on it grows by newly wrapped thread, of the same suture only.
void find_loops_on(SutureContext& c, uint32_t who) {
  ToolLoop& loop = c.state.loop[who];
  const InstrumentState& hand = c.state.instrument[who];
  const InstrumentModel& kind = c.suture.instrument[who];
  const Vec3 at = c.solver.body[who].x;
  const bool opened = loop.jaw < kWide && hand.jaw >= kWide && hand.held == Held::nothing;
  const bool closes = loop.jaw > kind.jaw.closed && hand.jaw <= kind.jaw.closed;
  loop.jaw = hand.jaw;
  if (loop.wraps > 0) {
    const Strand& t = c.solver.strand[loop.suture];
    const float pull = tension_outside(t, node_of(t, loop.first), node_of(t, loop.last));
    if (opened || pull > kind.thread_grip) {
      const uint32_t suture = loop.suture;
      release_loop(c, who);
      c.report_tool(suture, EventKind::loop_released, who, 0, opened ? 0 : pull, at);
      return;
    }
  }
  // A tool that holds something cannot have a loop. Thread round a needle holder that drives the needle is not a
  // loop. Jaws that hold this thread have no other end to pull through.
  const bool free = hand.held == Held::nothing;
  if (!c.solver.body_collides[who] || !(free || (closes && hand.held == Held::thread))) return;
  Found found;
  for (uint32_t k = 0; k < c.solver.strand.size(); ++k)
    if (loop.wraps == 0 || loop.suture == k) look(c, k, who, found);
  const LoopVerdict& v = found.verdict;
  if (v.touching == 0) loop.reported = LoopReason::none;
  if (v.wraps == 0) {
    loop.ignored_until_clear = 0;
    // Thread still being wrapped has not crossed itself yet: no rejection is reported before the jaws close on the other end.
    if (loop.wraps == 0 && v.touching >= kSeveral && v.reason != loop.reported &&
        (v.reason != LoopReason::no_crossing || (closes && v.round > kMostOfATurn))) {
      loop.reported = v.reason;
      c.report_tool(found.suture, EventKind::loop_rejected, who, 0, 0, at, Fault::none, v.reason);
    }
    return;
  }
  OneSuture s(c, found.suture);
  const int32_t chirality = handedness(s.strand, v);
  if (!free || loop.ignored_until_clear) return;
  if (loop.wraps > 0) {
    // The frozen turns are detected again, with turns added since.
    const bool same =
        chirality == loop.chirality && v.first <= node_of(s.strand, loop.last) && node_of(s.strand, loop.first) <= v.last;
    if (!same || v.wraps <= loop.wraps) return;
  }
  freeze(s, who, v, chirality);
}

}  // namespace

bool beside_loop(const Strand& t, const ToolLoop& loop, uint32_t slot) {
  if (loop.wraps == 0) return false;
  const size_t i = node_of(t, slot), first = node_of(t, loop.first), last = node_of(t, loop.last);
  if (i >= first && i <= last) return true;
  float apart = 0;
  for (size_t k = std::min(i, last); k < std::max(i, first); ++k)
    if (k < first || k >= last) apart += t.rest[k];
  return apart < kOwnStrands;
}

void release_loop(SutureContext& c, uint32_t who) {
  ToolLoop& loop = c.state.loop[who];
  release_holds(c.solver.strand[loop.suture], static_cast<int>(who), HoldKind::loop);
  const float jaw = loop.jaw;
  loop = {};
  loop.jaw = jaw;
  loop.ignored_until_clear = 1;
}

void find_loops(SutureContext& c) {
  for (uint32_t who = 0; who < c.state.loop.size(); ++who) find_loops_on(c, who);
}

}  // namespace catgut
