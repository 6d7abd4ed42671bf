// SPDX-License-Identifier: Apache-2.0
// exchange: see tying.h.
#include "exchange/tying.h"

#include <algorithm>
#include <cmath>

#include "exchange/strand.h"

namespace catgut {
namespace {

constexpr float kWindRadius = 0.0028f;  // [m] of a wrap's middle line
constexpr float kApart = 0.010f;        // [m] along the tool, between the strand's two ends
constexpr float kLeadBack = 0.004f;     // [m] toward the hand: a slack strand would slide off the tip
constexpr float kShaft = 0.0035f;       // [m] a shaft's radius and the tissue's
constexpr float kNeedleBelow = 0.007f;  // [m] that the needle hangs below its swage
constexpr float kNear = 0.035f;         // [m] round a stitch: tissue below the hands

float highest_near(const PictureModel& picture, const Snapshot& seen, Vec3 p) {
  float y = p.y - kNear;
  for (size_t i = 0; i < picture.particle_rest.size() && i < seen.particle.size(); ++i) {
    const Vec3 d = seen.particle[i] - p;
    if (d.x * d.x + d.z * d.z < kNear * kNear) y = std::max(y, seen.particle[i].y);
  }
  return y;
}

}  // namespace

Vec3 tying_axis(float side) { return normalized(Vec3{side, 0.3f, 0.15f}); }

Quat from_tool_axis(Vec3 z) {
  const Vec3 x = normalized(Vec3{0, 1, 0} - z * z.y);
  return from_axes(x, cross(z, x), z);
}

AcrossTool::AcrossTool(Vec3 along) : z(along), e1(normalized(Vec3{0, 1, 0} - z * z.y)), e2(cross(z, e1)) {}

Vec3 stitch_place(const PictureModel& picture, const Snapshot& seen) {
  if (!seen.active().knot.empty()) return seen.active().knot.back().position;
  if (seen.active().suture_point.empty()) return picture.focus;
  return 0.5f * (seen.active().suture_point.front().position + seen.active().suture_point.back().position);
}

Vec3 needle_swage(const PictureModel& picture, const Snapshot& seen) {
  return transform(seen.active().needle.pose, {picture.suture[seen.active_suture].needle_radius, 0, 0});
}

float feel_strand(float strand, float tension, float dt) {
  return strand + dt * (tension < 0.02f ? 0.012f : tension > 0.1f ? -std::min(0.06f, 0.1f * tension) : 0.0f);
}

void begin_winding(Winding& w, const PictureModel& picture, const Snapshot& seen, float least_free, bool past_knot) {
  const bool from_point = !seen.active().suture_point.empty() && (past_knot || seen.active().knot.empty());
  w.start = from_point ? seen.active().suture_point.back().position : stitch_place(picture, seen);
  // Thread in the knot is no longer available to the hand.
  const float spent = seen.active().suture_point.empty() ? 0 : distance(seen.active().suture_point.back().position, w.start);
  w.reach = std::max(0.03f, length_between(seen, last_point_node(seen), seen.active().thread_order.size() - 1) - spent);
  // High enough that the needle, moving round below on a taut strand, clears the tissue, as far as a short strand allows.
  const float crest = highest_near(picture, seen, w.start), rise = crest - w.start.y;
  w.ground = crest + kNeedleBelow;
  w.height = std::clamp(0.5f * (w.reach + rise + kNeedleBelow), 0.025f, std::max(0.025f, w.reach - least_free));
  w.wound = kTieBefore;
  w.lean = kTieLean;
}

Vec3 winding_axis(const Winding& w, const AcrossTool& across) {
  // The strand rises on the hand's side of the turn and leaves on the tip's: the two never meet.
  return w.start + across.e1 * w.height - across.e2 * (w.way * kWindRadius) - across.z * kApart;
}

Vec3 winding_swage(const Winding& w, const AcrossTool& across, float wound, float& room) {
  const float turned = w.way * wound;
  const Vec3 leave =
      winding_axis(w, across) + kWindRadius * (across.e2 * (w.way * portable::cos(wound)) + across.e1 * portable::sin(wound));
  const Vec3 to = across.e1 * portable::cos(turned) - across.e2 * portable::sin(turned);
  room = to.y < 0 ? std::max(0.012f, (leave.y - w.ground) / -to.y) : 1;
  // The needle's tool comes from the tip's side. A slack strand would slide off there: it is led back.
  return leave + to * std::min(w.free, room) -
         across.z * (room < w.free ? -kLeadBack : std::clamp(w.lean * w.free, -kApart, kApart));
}

void feel_winding(Winding& w, const Snapshot& seen, const AcrossTool& across, float behind, float room, float dt) {
  const float tension = needle_tension(seen);
  if (!((behind < 0.005f && room > w.free) || tension > kTieTooTaut)) return;
  // Before the first throw only friction holds the thread in its holes: use no more than is available.
  const float there_is = w.reach - distance(w.start, winding_axis(w, across)) - kTieWound * std::max(0.0f, w.wound) + 0.002f;
  const float most = seen.active().knot.empty() ? std::max(0.006f, there_is) : w.reach;
  w.free = std::clamp(feel_strand(w.free, tension, dt), 0.006f, most);
}

Vec3 strand_above(const Winding& w, const AcrossTool& across, Vec3 turns) {
  Vec3 above = turns + normalized(across.e1 - 0.4f * across.z) * w.free;
  above.y = std::max(above.y, std::min(w.ground, turns.y + w.free));
  return above;
}

bool best_tail_grip(const PictureModel& picture, const Snapshot& seen, size_t who, float side, TailDepth depth,
                    std::span<const Vec3> tried, TailGrip& out) {
  if (seen.active().suture_point.empty() || seen.active().thread_order.size() < 3) return false;
  const Vec3 knot = stitch_place(picture, seen);
  const size_t point = first_point_node(seen), root = node_along(seen, point, distance(node_at(seen, point), knot), -1);
  const float tail = length_between(seen, 0, root);
  // The distance between tissue and turns is the limit of the jaws.
  const bool loop = seen.tool[who].loop_wraps > 0;
  const float leash = loop ? 0.9f * (length_between(seen, last_point_node(seen), node_of(seen, seen.tool[who].loop_first)) -
                                     distance(node_at(seen, last_point_node(seen)), knot))
                           : 1.0f;
  const Vec3 ways[] = {{side, 0.3f, 0.15f}, {0.8f * side, 0.5f, 0.6f}, {0.5f * side, 0.4f, 1}, {0.7f * side, 1, 0.1f}};
  float best = -1e9f;
  for (size_t i = node_along(seen, root, std::min(loop ? 0.010f : 0.016f, 0.5f * tail), -1); i-- > 1;) {
    if (length_between(seen, 0, i) < 0.2f * tail || (i < seen.active().thread_cut.size() && seen.active().thread_cut[i])) break;
    const Vec3 tip = node_at(seen, i);
    for (const Vec3& way : ways) {
      const Vec3 z = normalized(way);
      // The needle's strand as it will run when the jaws are there: from the knot to the turns behind them.
      const Vec3 run = tip + z * kTieWindAt - knot;
      const float s = std::clamp(dot(tip - knot, run) / std::max(length2(run), 1e-12f), 0.0f, 1.0f);
      float good = loop ? std::min(distance(tip, knot + run * s), kTieClear) / kTieClear : 1;
      if (length(run) > leash) good -= 1 + 100 * (length(run) - leash);
      // Tissue in the path of the shaft.
      for (size_t k = 0; k < picture.particle_rest.size(); ++k) {
        const Vec3 d = seen.particle[k] - tip;
        const float along = dot(d, z);
        if (along > 0.003f && along < 0.06f && length2(d - z * along) < kShaft * kShaft) good -= 0.1f;
      }
      // A tail that has slipped down between the edges is grasped only near the top: below, hands and needle touch tissue.
      good -= depth.worse * std::max(0.0f, knot.y - depth.easy - tip.y);
      // Near the knot there are few obstacles. A position that failed before is skipped.
      const bool failed = std::any_of(tried.begin(), tried.end(), [&](Vec3 p) { return distance(tip, p) < 0.004f; });
      good -= 12 * distance(tip, knot) + (failed ? 0.5f : 0.0f);
      if (good > best) best = good, out = {seen.active().thread_order[i], {tip, from_tool_axis(z)}, tail};
    }
  }
  return best > -1e8f;
}

}  // namespace catgut
