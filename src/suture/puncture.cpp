// suture/puncture: the needle's two triggers (paper 2.2, figures 4 and 5). Reads the needle and the tissue's surface; writes
// bites, the attachment of the nearest particle, the channel in which the shaft runs, and asks for suture points. The tip is
// tracked against the surface itself, so a bite keeps where it went in and out to a fraction of a millimetre; the nearest
// particle is what drags the tissue along, as in the paper.
#include <algorithm>
#include <cmath>

#include "suture/suture.h"

namespace catgut {
namespace {

constexpr float kReach = 0.008f;         // [m] the tip looks this far for the surface
constexpr float kEndReached = 0.0008f;   // [m] along the shaft: an end of the needle is at the hole
constexpr float kNewWall = 0.0015f;      // [m] of shaft beyond the last exit: the tip goes in again, it was not drawn back
constexpr float kHysteresis = 0.00002f;  // [m] so that a tip resting on the surface does not chatter
constexpr float kBackOut = 0.002f;       // [m] of shaft outside the entry again: the thread is no longer in the hole
constexpr float kOnShaft = 0.0015f;      // [m] a hole this near to the shaft has the shaft in it

uint32_t hole_of(uint32_t bite, bool exit) { return 2 * bite + exit; }

ChannelPoint channel_at(const SutureModel& suture, const Bite& bite, uint32_t which, bool exit) {
  const BiteEnd& end = exit ? bite.exit : bite.entry;
  ChannelPoint c;
  c.hole = hole_of(which, exit);
  c.point = end.point;
  c.compliance = suture.channel_compliance;
  c.drag = suture.channel_drag;
  return c;
}

void drop_attachment(const SolverModel& model, SolverState& solver, SutureState& state) {
  if (!state.attached) return;
  std::erase_if(solver.attach, [&](const Attachment& a) { return a.body == static_cast<int>(model.needle_body(0)); });
  state.attached = false;
}

void close_hole(SolverState& solver, uint32_t hole) {
  std::erase_if(solver.channel, [&](const ChannelPoint& c) { return c.hole == hole; });
}

// The newest bite is out again the way it came. Its record stays, marked; everything that held needle or tissue there goes.
void cancel_bite(const SolverModel& model, SolverState& solver, SutureState& state, Vec3 tip, EventList& events) {
  const uint32_t which = state.open.back().bite;
  Bite& bite = state.bite[which];
  drop_attachment(model, solver, state);
  close_hole(solver, hole_of(which, false));
  close_hole(solver, hole_of(which, true));
  bite.cancelled = true;
  bite.has_exit = false;
  state.open.pop_back();
  events.add({EventKind::bite_cancelled, 0, which, bite.depth, tip});
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
  while (count < model.shape.cluster_stride && member[count] < model.tissue) ++count;  // the pad names no particle
  end.point = spread_point({member, count}, rest, at);
}

bool nearest_surface(const SolverModel& model, const Candidates& candidates, const Vec4* x, Vec3 p, float reach,
                     SurfaceHit& hit) {
  const TissueCollision& tissue = model.collision;
  const int near = nearest_particle(tissue, candidates, x, p, reach);
  if (near < 0) return false;
  // Triangles round the nearest particle and round its neighbours: the nearest triangle need not touch the nearest particle.
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
      normal += n;  // on a shared edge or corner: the mean of the faces decides inside or outside
    }
  };
  std::array<uint32_t, 96> seen;
  size_t count = 0;
  auto look_once = [&](uint32_t f) {
    if (std::find(seen.begin(), seen.begin() + static_cast<long>(count), f) != seen.begin() + static_cast<long>(count)) return;
    if (count < seen.size()) seen[count++] = f;
    look(f);
  };
  const size_t centre = static_cast<size_t>(near);
  for (uint32_t r = tissue.ring_first[centre]; r < tissue.ring_first[centre + 1]; ++r)
    for (uint32_t k : tissue.surface[tissue.ring[r]])
      for (uint32_t q = tissue.ring_first[k]; q < tissue.ring_first[k + 1]; ++q) look_once(tissue.ring[q]);
  if (count == 0) return false;
  hit.normal = normalized(normal, {0, 1, 0});
  hit.distance = std::sqrt(best) * (dot(p - hit.point, hit.normal) < 0 ? -1.0f : 1.0f);
  return true;
}

void puncture(const SolverModel& model, SolverState& solver, const SolverScratch& scratch, const SutureModel& suture,
              SutureState& state, EventList& events) {
  const Vec4* x = solver.x.data();
  const NeedleArc& arc = model.needle_arc[0];
  const RigidBody& needle = solver.body[model.needle_body(0)];
  const Vec3 tip = needle_tip(arc, needle);
  SurfaceHit hit;
  const bool near = nearest_surface(model, scratch.candidates, x, tip, kReach, hit);
  const bool was_inside = state.tip_inside;
  const bool inside = near && hit.distance < (was_inside ? kHysteresis : -kHysteresis);
  // A needle that lies about pierces nothing: it weighs a few millinewtons.
  const bool held = std::any_of(solver.weld.begin(), solver.weld.end(),
                                [&](const Weld& w) { return w.a == static_cast<int>(model.needle_body(0)); });
  state.tip_inside = inside && (held || !state.open.empty());
  // [m] along the shaft from the swage to an end of a bite.
  auto along = [&](const BiteEnd& end) { return arc.radius * arc.nearest(to_local(needle.pose(), position_of(end.point, x))); };
  const float tip_at = arc.radius * arc.arc;

  // --- the tip, in the newest wall ---
  const NeedlePhase newest = phase_of(state);
  if (newest == NeedlePhase::tip_in) {
    const uint32_t which = state.open.back().bite;
    Bite& bite = state.bite[which];
    if (inside) bite.depth = std::max(bite.depth, -hit.distance);
    if (state.attached) {
      // Figure 5: dragged beyond the threshold, it is let go and the tissue relaxes.
      const float dragged = distance(xyz(x[bite.nearest]), state.attached_from);
      const auto row = std::find_if(solver.attach.begin(), solver.attach.end(),
                                    [&](const Attachment& a) { return a.body == static_cast<int>(model.needle_body(0)); });
      const float torn = distance(transform(needle.pose(), row->target), state.attached_from);
      if (std::max(dragged, torn) > suture.release_distance) {
        drop_attachment(model, solver, state);
        events.add({EventKind::particle_released, 0, bite.nearest, dragged, xyz(x[bite.nearest])});
      }
    }
    if (!inside) {
      drop_attachment(model, solver, state);
      if (!near || tip_at - along(bite.entry) < kEndReached) {
        cancel_bite(model, solver, state, tip, events);
      } else {
        bite.exit = hit.end;
        spread(model, bite.exit);
        bite.has_exit = true;
        solver.channel.push_back(channel_at(suture, bite, which, true));
        state.open.back().phase = NeedlePhase::through;
        events.add({EventKind::tip_exited, 0, which, bite.depth, hit.point});
      }
    }
  } else if (newest == NeedlePhase::through && tip_at - along(state.bite[state.open.back().bite].exit) < kEndReached &&
             (inside || tip_at - along(state.bite[state.open.back().bite].entry) < kEndReached)) {
    const uint32_t which = state.open.back().bite;
    if (inside) {  // drawn back into the wall
      state.bite[which].has_exit = false;
      close_hole(solver, hole_of(which, true));
      state.open.back().phase = NeedlePhase::tip_in;
    } else {  // torn back through both holes between two substeps: the tip was never seen in the wall
      cancel_bite(model, solver, state, tip, events);
    }
  } else if (held && inside && !was_inside &&
             (newest == NeedlePhase::outside || tip_at - along(state.bite[state.open.back().bite].exit) > kNewWall)) {
    const uint32_t which = static_cast<uint32_t>(state.bite.size());
    Bite bite;
    bite.entry = hit.end;
    spread(model, bite.entry);
    const int nearest = nearest_particle(model.collision, scratch.candidates, x, tip, suture.attach_threshold);
    if (nearest >= 0) bite.nearest = static_cast<uint32_t>(nearest);
    state.bite.push_back(bite);
    state.open.push_back({which, NeedlePhase::tip_in});
    const Vec3 heading = rotate(needle.q, arc.tangent(arc.arc));
    const float angle = portable::acos(std::clamp(-dot(heading, hit.normal), -1.0f, 1.0f));
    events.add({EventKind::tip_entered, 0, which, angle, hit.point});
    if (nearest >= 0) {
      // Figure 4: the nearest particle within X of the tip moves with the tip, by the paper's spring.
      Attachment a;
      a.point = particle_point(bite.nearest);
      a.body = static_cast<int>(model.needle_body(0));
      state.attached_from = xyz(x[bite.nearest]);
      a.target = to_local(needle.pose(), state.attached_from);
      a.compliance = suture.attach_compliance;
      solver.attach.push_back(a);
      state.attached = true;
      events.add({EventKind::particle_attached, 0, bite.nearest, distance(state.attached_from, tip), state.attached_from});
    }
    solver.channel.push_back(channel_at(suture, bite, which, false));
  }

  // --- the back end, in the oldest wall that it has not left ---
  if (!state.open.empty() && state.open.front().phase >= NeedlePhase::through) {
    OpenBite& oldest = state.open.front();
    Bite& bite = state.bite[oldest.bite];
    if (oldest.phase == NeedlePhase::through) {
      // The back-end trigger: the swage has reached the entry, the thread follows through it.
      if (along(bite.entry) <= kEndReached && place_suture_point(model, solver, suture, state, oldest.bite, false, events)) {
        close_hole(solver, hole_of(oldest.bite, false));
        oldest.phase = NeedlePhase::back_in;
      }
    } else {
      const float entry_at = along(bite.entry);
      if (entry_at > kBackOut && entry_at < 0.5f * tip_at &&
          distance(position_of(bite.entry.point, x), needle_point(arc, needle, entry_at / arc.radius)) < kOnShaft) {
        // The back end came out of the entry again: the thread has left the hole, the shaft is in it.
        remove_last_suture_point(model, solver, suture, state);
        solver.channel.push_back(channel_at(suture, bite, oldest.bite, false));
        oldest.phase = NeedlePhase::through;
      } else if (along(bite.exit) <= kEndReached &&
                 place_suture_point(model, solver, suture, state, oldest.bite, true, events)) {
        close_hole(solver, hole_of(oldest.bite, true));
        bite.complete = true;
        const Vec3 out = position_of(bite.exit.point, x);
        events.add({EventKind::bite_completed, 0, oldest.bite, distance(position_of(bite.entry.point, x), out), out});
        state.open.erase(state.open.begin());
      }
    }
  }
  // In the tissue the shaft is held by its channel, not by the surface.
  solver.body_collides[model.needle_body(0)] = state.open.empty();
}

}  // namespace catgut
