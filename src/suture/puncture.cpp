// SPDX-License-Identifier: Apache-2.0
// suture/puncture: the needle's two triggers (paper 2.2, figures 4 and 5). Reads the needle and the tissue's surface; writes
// bites, the attachment of the nearest particle, the needle track of the shaft, and requests suture points. The tip is tracked
// against the surface itself, so entry and exit of a bite are accurate to a fraction of a millimeter. The nearest
// particle drags the tissue along, as in the paper.
#include <algorithm>
#include <cmath>

#include "suture/suture.h"

namespace catgut {
namespace {

constexpr float kReach = 0.008f;         // [m] search distance of the tip for the surface
constexpr float kEndReached = 0.0008f;   // [m] along the shaft: an end of the needle is at the hole
constexpr float kNewWall = 0.0015f;      // [m] of shaft beyond the last exit: a new entry rather than a withdrawal
constexpr float kHysteresis = 0.00002f;  // [m] so that a tip resting on the surface does not toggle
constexpr float kBackOut = 0.002f;       // [m] of shaft outside the entry again: the thread has left the hole
constexpr float kOnShaft = 0.0015f;      // [m] a hole within this distance of the shaft contains the shaft

uint32_t hole_of(uint32_t bite, bool exit) { return 2 * bite + exit; }

void open_hole(OneSuture& s, uint32_t which, bool exit) {
  NeedleTrackConstraint c;
  c.suture = s.index;
  c.hole = hole_of(which, exit);
  c.point = (exit ? s.own.bite[which].exit : s.own.bite[which].entry).point;
  c.compliance = s.all.suture.track_compliance;
  c.drag = s.all.suture.track_drag;
  s.all.solver.channel.push_back(c);
}
void close_hole(OneSuture& s, uint32_t which, bool exit) {
  std::erase_if(s.all.solver.channel,
                [&](const NeedleTrackConstraint& c) { return c.suture == s.index && c.hole == hole_of(which, exit); });
}

void drop_attachment(OneSuture& s) {
  if (!s.own.attached) return;
  std::erase_if(s.all.solver.attach, [&](const Attachment& a) { return a.body == static_cast<int>(s.needle); });
  s.own.attached = false;
}

// The newest bite was withdrawn. Its record stays, marked; everything that held needle or tissue there is removed.
void cancel_bite(OneSuture& s, Vec3 tip) {
  const uint32_t which = s.own.open.back().bite;
  Bite& bite = s.own.bite[which];
  drop_attachment(s);
  close_hole(s, which, false);
  close_hole(s, which, true);
  bite.canceled = true;
  bite.has_exit = false;
  s.own.open.pop_back();
  s.report(EventKind::bite_withdrawn, which, bite.depth, tip);
}

// State of a needle's tip in a substep.
struct Tip {
  Vec3 at;
  SurfaceHit hit;  // valid if near
  bool near = false, inside = false, was_inside = false;
  bool held = false;  // a jaw holds the needle
};

// [m] along the shaft from the swage to an end of a bite; of the tip.
float along(const OneSuture& s, const BiteEnd& end) {
  return s.arc.radius * s.arc.nearest(to_local(s.body().pose(), position_of(end.point, s.x())));
}
float tip_along(const OneSuture& s) { return s.arc.radius * s.arc.arc; }

// Figure 5: a particle dragged beyond the threshold is released and the tissue relaxes.
void release_dragged(OneSuture& s, const Bite& bite) {
  if (!s.own.attached) return;
  const float dragged = distance(s.at(bite.nearest), s.own.attached_from);
  const auto row = std::find_if(s.all.solver.attach.begin(), s.all.solver.attach.end(),
                                [&](const Attachment& a) { return a.body == static_cast<int>(s.needle); });
  const float torn = distance(transform(s.body().pose(), row->target), s.own.attached_from);
  if (std::max(dragged, torn) <= s.all.suture.release_distance) return;
  drop_attachment(s);
  s.report(EventKind::particle_released, bite.nearest, dragged, s.at(bite.nearest));
}

// NeedlePhase::tip_in, of the newest wall: the tip moves deeper, exits on the far side, or is withdrawn.
void in_wall(OneSuture& s, const Tip& tip) {
  const uint32_t which = s.own.open.back().bite;
  Bite& bite = s.own.bite[which];
  if (tip.inside) bite.depth = std::max(bite.depth, -tip.hit.distance);
  release_dragged(s, bite);
  if (tip.inside) return;
  drop_attachment(s);
  if (!tip.near || tip_along(s) - along(s, bite.entry) < kEndReached) {
    cancel_bite(s, tip.at);
    return;
  }
  bite.exit = tip.hit.end;
  spread(s.all.model, bite.exit);
  bite.has_exit = true;
  open_hole(s, which, true);
  s.own.open.back().phase = NeedlePhase::through;
  s.report(EventKind::tip_exited, which, bite.depth, tip.hit.point);
}

// NeedlePhase::through, of the newest wall: the tip may be withdrawn. Returns whether it was.
bool drawn_back(OneSuture& s, const Tip& tip) {
  const uint32_t which = s.own.open.back().bite;
  Bite& bite = s.own.bite[which];
  if (tip_along(s) - along(s, bite.exit) >= kEndReached) return false;
  if (!tip.inside && tip_along(s) - along(s, bite.entry) >= kEndReached) return false;
  if (tip.inside) {
    bite.has_exit = false;
    close_hole(s, which, true);
    s.own.open.back().phase = NeedlePhase::tip_in;
  } else {  // pulled back through both holes between two substeps: the tip was never inside the wall
    cancel_bite(s, tip.at);
  }
  return true;
}

// The tip has reached a wall, and the newest one lies far enough behind it: a new bite.
void enter(OneSuture& s, const Tip& tip) {
  const SolverModel& model = s.all.model;
  const uint32_t which = static_cast<uint32_t>(s.own.bite.size());
  Bite bite;
  bite.entry = tip.hit.end;
  spread(model, bite.entry);
  const int nearest = nearest_particle(model.collision, s.all.scratch.candidates, s.x(), tip.at, s.all.suture.attach_threshold);
  if (nearest >= 0) bite.nearest = static_cast<uint32_t>(nearest);
  s.own.bite.push_back(bite);
  s.own.open.push_back({which, NeedlePhase::tip_in});
  const Vec3 heading = rotate(s.body().q, s.arc.tangent(s.arc.arc));
  const float angle = portable::acos(std::clamp(-dot(heading, tip.hit.normal), -1.0f, 1.0f));
  s.report(EventKind::tip_entered, which, angle, tip.hit.point);
  if (nearest >= 0) {
    // Figure 4: the nearest particle within X of the tip moves with the tip, by the paper's spring.
    Attachment a;
    a.point = particle_point(bite.nearest);
    a.body = static_cast<int>(s.needle);
    s.own.attached_from = s.at(bite.nearest);
    a.target = to_local(s.body().pose(), s.own.attached_from);
    a.compliance = s.all.suture.attach_compliance;
    s.all.solver.attach.push_back(a);
    s.own.attached = true;
    s.report(EventKind::particle_attached, bite.nearest, distance(s.own.attached_from, tip.at), s.own.attached_from);
  }
  open_hole(s, which, false);
}

// The oldest wall that the back end has not left. The back-end trigger: when the swage has reached the entry, the thread
// follows through it; when it has reached the exit, the bite is complete.
void move_back_end(OneSuture& s) {
  OpenBite& oldest = s.own.open.front();
  const uint32_t which = oldest.bite;
  Bite& bite = s.own.bite[which];
  if (oldest.phase == NeedlePhase::through) {
    if (along(s, bite.entry) <= kEndReached && place_suture_point(s, which, false)) {
      close_hole(s, which, false);
      oldest.phase = NeedlePhase::back_in;
    }
    return;
  }
  const float entry_at = along(s, bite.entry);
  const Vec3 entry = position_of(bite.entry.point, s.x());
  if (entry_at > kBackOut && entry_at < 0.5f * tip_along(s) &&
      distance(entry, needle_point(s.arc, s.body(), entry_at / s.arc.radius)) < kOnShaft) {
    // The back end has left the entry again: the thread is out of the hole, the shaft is in it.
    remove_last_suture_point(s);
    open_hole(s, which, false);
    oldest.phase = NeedlePhase::through;
  } else if (along(s, bite.exit) <= kEndReached && place_suture_point(s, which, true)) {
    close_hole(s, which, true);
    bite.complete = true;
    const Vec3 out = position_of(bite.exit.point, s.x());
    s.report(EventKind::bite_completed, which, distance(entry, out), out);
    s.own.open.erase(s.own.open.begin());
  }
}

void puncture(OneSuture& s) {
  SutureContext& c = s.all;
  Tip tip;
  tip.at = needle_tip(s.arc, s.body());
  tip.near = nearest_surface(c.model, c.scratch.candidates, s.x(), tip.at, kReach, tip.hit);
  tip.was_inside = s.own.tip_inside;
  tip.inside = tip.near && tip.hit.distance < (tip.was_inside ? kHysteresis : -kHysteresis);
  // A needle at rest punctures nothing: its weight is a few millinewtons.
  tip.held =
      std::any_of(c.solver.weld.begin(), c.solver.weld.end(), [&](const Weld& w) { return w.a == static_cast<int>(s.needle); });
  s.own.tip_inside = tip.inside && (tip.held || !s.own.open.empty());

  const NeedlePhase newest = phase_of(s.own);
  if (newest == NeedlePhase::tip_in) {
    in_wall(s, tip);
  } else if (newest != NeedlePhase::through || !drawn_back(s, tip)) {
    const bool beyond =
        newest == NeedlePhase::outside || tip_along(s) - along(s, s.own.bite[s.own.open.back().bite].exit) > kNewWall;
    if (tip.held && tip.inside && !tip.was_inside && beyond) enter(s, tip);
  }
  if (!s.own.open.empty() && s.own.open.front().phase >= NeedlePhase::through) move_back_end(s);
  // In tissue, the needle track holds the shaft, not the surface.
  c.solver.body_collides[s.needle] = s.own.open.empty();
}

}  // namespace

void spread(const SolverModel& model, BiteEnd& end) {
  const Triangle& t = model.collision.surface[end.triangle];
  const Vec4* rest = model.shape.rest.data();
  Vec3 at{};
  size_t nearest = 0;
  for (size_t k = 0; k < 3; ++k) {
    at += xyz(rest[t[k]]) * end.weight[k];
    if (end.weight[k] > end.weight[nearest]) nearest = k;
  }
  const uint32_t* member = model.shape.member.data() + size_t{model.shape.cluster_of[t[nearest]]} * model.shape.cluster_stride;
  uint32_t count = 0;
  while (count < model.shape.cluster_stride && member[count] < model.tissue) ++count;  // padding is not a particle
  end.point = spread_point({member, count}, rest, at);
}

bool nearest_surface(const SolverModel& model, const Candidates& candidates, const Vec4* x, Vec3 p, float reach,
                     SurfaceHit& hit) {
  const TissueCollision& tissue = model.collision;
  const int near = nearest_particle(tissue, candidates, x, p, reach);
  if (near < 0) return false;
  // Triangles round the nearest particle and round its neighbors: the nearest triangle need not touch the nearest particle.
  float best = 1e30f;
  Vec3 normal{};
  auto look = [&](uint32_t f) {
    const Triangle& t = tissue.surface[f];
    const Vec3 a = xyz(x[t[0]]), b = xyz(x[t[1]]), c = xyz(x[t[2]]);
    const ClosestOnTriangle on = closest_on_triangle(p, a, b, c);
    const float d = length2(on.point - p);
    const Vec3 n = normalized(cross(b - a, c - a));
    if (d < best * 0.9999f - 1e-14f) {
      best = d;
      normal = n;
      hit.point = on.point;
      hit.end.triangle = f;
      hit.end.weight = on.weight;
    } else if (d <= best * 1.0001f + 1e-14f) {
      normal += n;  // on a shared edge or corner: the mean normal decides inside or outside
    }
  };
  std::array<uint32_t, 96> seen;
  size_t count = 0;
  auto look_once = [&](uint32_t f) {
    if (std::find(seen.begin(), seen.begin() + static_cast<long>(count), f) != seen.begin() + static_cast<long>(count)) return;
    if (count < seen.size()) seen[count++] = f;
    look(f);
  };
  const size_t center = static_cast<size_t>(near);
  for (uint32_t r = tissue.ring_first[center]; r < tissue.ring_first[center + 1]; ++r)
    for (uint32_t k : tissue.surface[tissue.ring[r]])
      for (uint32_t q = tissue.ring_first[k]; q < tissue.ring_first[k + 1]; ++q) look_once(tissue.ring[q]);
  if (count == 0) return false;
  hit.normal = normalized(normal, {0, 1, 0});
  hit.distance = std::sqrt(best) * (dot(p - hit.point, hit.normal) < 0 ? -1.0f : 1.0f);
  return true;
}

void puncture(SutureContext& c) {
  for (size_t k = 0; k < c.state.suture.size(); ++k) {
    OneSuture s(c, k);
    puncture(s);
  }
}

}  // namespace catgut
