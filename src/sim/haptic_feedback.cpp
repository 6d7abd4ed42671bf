// SPDX-License-Identifier: Apache-2.0
// sim/haptic_feedback: see the header. Sources of the numbers: docs/references.md.
#include "sim/haptic_feedback.h"

#include <algorithm>
#include <cmath>

#include "sim/model.h"
#include "sim/state.h"
#include "suture/forces.h"

namespace catgut {
namespace {

// The last quarter of a tick's substeps: recent, and long enough to average contacts that alternate between two substeps.
constexpr int kLastPart = 4;
// [N/m] before any estimate: the response of the generated bowel to a blunt tool is 60 to 120 (tests/sim/haptic_feedback_test).
// Tissue held in its plane responds with 800 to 1400 under a point load (docs/references.md), about half of that near a
// free edge.
constexpr float kBlunt = 100, kTissue = 600;
constexpr float kTimeConstant = 0.06f;   // [s] time constant of exponential forgetting
constexpr float kPriorWeight = 0.0001f;  // [m] of motion that weighs as much as the prior
constexpr float kMinForce = 0.005f;      // [N] smaller forces are ignored
// [N] between which a load that comes from nothing is let in: of a needle outside of its track, of a thread.
constexpr float kNeedleFrom = 0.02f, kNeedleWhole = 0.1f, kThreadFrom = 0.005f, kThreadWhole = 0.04f;
constexpr float kLongest = 0.15f, kBluntLever = 0.01f;  // [m] of an instrument; of its jaws
// [N] on the fingers when they shut on it, from where the jaws grasp (a third of their travel): 4 N for a needle or a thread,
// 1.4 N for the wall. Chosen: within 8 N of a gripper, and 860 N/m of its 2000 N/m.
constexpr float kGripSteel = 12, kGripTissue = 4;
constexpr float kLook = 0.008f;  // [m] search distance for the next contact; margin of the broad phase

Vec3 thread_on_tool(const SolverState& s, const Strand& strand, const ThreadHold& hold) {
  const size_t i = node_of(strand, hold.slot);
  if (i == strand.order.size()) return {};
  const auto place = [&](size_t at) { return thread_position(strand, at, s.x.data(), s.body); };
  Vec3 force;
  if (i > 0) force += normalized(place(i - 1) - place(i)) * strand.tension[i - 1];
  if (i < strand.tension.size()) force += normalized(place(i + 1) - place(i)) * strand.tension[i];
  return force;
}

// Along the needle's shaft toward its tip, at the tissue of a track point.
Vec3 along_shaft(const Model& model, const SolverState& s, const NeedleTrackConstraint& c) {
  const NeedleArc& arc = model.solver.needle_arc[c.suture];
  const RigidBody& needle = s.body[model.solver.needle_body(c.suture)];
  return rotate(needle.q, arc.tangent(arc.nearest(to_local(needle.pose(), position_of(c.point, s.x.data())))));
}

Sym3 across(Vec3 n, float k) { return identity(k) + outer(n, -k); }
constexpr float series(float a, float b) { return a * b / (a + b); }

// 0 below `from`, 1 from `whole` on, linear between: a force that passes a threshold makes no step in the hand.
float onset(float force, float from, float whole) { return std::clamp((force - from) / (whole - from), 0.0f, 1.0f); }

// Force of the wall on the needle tip of a suture that passes through it (suture/forces).
NeedleResistance resistance_now(const Model& model, const State& state, size_t which, float tension) {
  const SolverModel& m = model.solver;
  const SolverState& s = state.solver;
  const uint32_t body = m.needle_body(which);
  const RigidBody& needle = s.body[body];
  const Suture& suture = state.suture.suture[which];
  const NeedleArc& arc = m.needle_arc[which];
  const auto along = [&](const BiteEnd& end) {
    return arc.radius * arc.nearest(to_local(needle.pose(), position_of(end.point, s.x.data())));
  };
  const float tip_at = arc.radius * arc.arc;
  float embedded = 0, indented = -1, to_exit = -1;
  for (const OpenBite& open : suture.open) {
    const Bite& bite = suture.bite[open.bite];
    const float from = open.phase == NeedlePhase::back_in ? 0 : along(bite.entry),
                to = bite.has_exit ? along(bite.exit) : tip_at;
    embedded += std::max(0.0f, to - from);
  }
  const bool tip_in = phase_of(suture) == NeedlePhase::tip_in;
  if (tip_in && suture.attached) {
    for (const Attachment& a : s.attach)
      if (a.body == static_cast<int>(body)) indented = distance(transform(needle.pose(), a.target), suture.attached_from);
  } else if (tip_in) {
    SurfaceHit hit;
    const Vec3 heading = rotate(needle.q, arc.tangent(arc.arc));
    // Only when it leaves: near the surface of entry the tip points the other way.
    if (nearest_surface(m, state.scratch.candidates, s.x.data(), needle_tip(arc, needle), kLook, hit) &&
        dot(heading, hit.normal) > 0.2f)
      to_exit = std::max(0.0f, -hit.distance);
  }
  return needle_resistance(indented, model.suture.release_distance, to_exit, embedded, tip_in, tension);
}

}  // namespace

void begin_haptics(State& state) {
  for (ToolReaction& t : state.haptics.tool) t = {};
}

void accumulate_haptics(const Model& model, State& state, int i) {
  const int first = model.substeps - std::max(1, model.substeps / kLastPart) + 1;
  if (i < first) return;
  const SolverModel& m = model.solver;
  const SolverState& s = state.solver;
  const float inv_h2 = 1 / (m.h * m.h);
  for (size_t k = 0; k < kMaxHands; ++k) {
    ToolReaction& t = state.haptics.tool[k];
    const int body = state.hand[k].instrument;
    if (body < 0) continue;
    const Weld& weld = s.weld[static_cast<size_t>(body)];
    const BodyContact& on = state.scratch.on_body[static_cast<size_t>(body)];
    t.pressing += on.pressing * inv_h2;
    t.rubbing += on.rubbing * inv_h2;
    t.pressed += on.pressed * inv_h2;
    t.by_tool += on.by_tool * inv_h2;
    t.thread += (on.linear - on.pressing - on.rubbing) * inv_h2;
    t.all += on.linear * inv_h2;
    t.torque += on.angular * inv_h2;
    const Quat turned = s.body[static_cast<size_t>(body)].q;
    // A force on the tool at a point of its own frame.
    const auto add = [&t, &turned](Vec3& path, Vec3 force, Vec3 local) {
      path += force, t.all += force;
      t.torque += cross(rotate(turned, local), force);
    };
    for (const Strand& strand : s.strand)
      for (const ThreadHold& h : strand.hold)
        if (h.body == body) add(t.thread, thread_on_tool(s, strand, h), h.local);
    for (const Attachment& a : s.attach)
      if (a.body == body) add(t.held, a.lambda * -inv_h2, a.target);
    const InstrumentState& hand = state.suture.instrument[static_cast<size_t>(body)];
    if (hand.held == Held::needle) {
      const int needle = static_cast<int>(m.needle_body(hand.suture));
      for (const Weld& w : s.weld)
        if (w.a == needle && w.b == body) {
          add(t.needle, w.lambda * -inv_h2, w.local_b.p);
          t.torque += w.angular_lambda * -inv_h2;
        }
      for (const NeedleTrackConstraint& c : s.channel)  // the track's push on the tissue, negated: on the needle
        if (c.suture == hand.suture) t.drag += along_shaft(model, s, c) * (-c.drag_lambda * inv_h2);
    }
    t.hand += weld.lambda * -inv_h2;
    t.wrist += weld.angular_lambda * -inv_h2;
    t.at += weld.target.p;
    t.substeps += 1;
  }
}

namespace {

Vec3 load_of(const ToolReaction& t) {
  return t.substeps > 0 ? (t.pressing + t.thread + t.held + t.needle - t.drag) / t.substeps : Vec3{};
}

void update_stiffness_estimate(StiffnessEstimate& f, const ToolReaction& t, uint32_t discontinuity_id, float dt) {
  const float keep = portable::exp(-dt / kTimeConstant);
  const Vec3 force = load_of(t), point = t.substeps > 0 ? t.at / t.substeps : f.point;
  const bool loaded = length(force) > kMinForce;
  if (discontinuity_id != f.discontinuity_id || !loaded) {
    f.work = f.travel = 0;
  } else if (f.loaded) {
    Vec3 dx = point - f.point, df = force - f.force;
    if (length2(t.pressing) > 0 && length2(t.held) + length2(t.needle) + length2(t.thread) == 0) {
      const Vec3 n = normalized(force);  // a surface is stiff along its normal only
      dx = n * dot(dx, n), df = n * dot(df, n);
    }
    f.work = keep * f.work - dot(df, dx);
    f.travel = keep * f.travel + length2(dx);
  }
  f.point = point, f.force = force, f.discontinuity_id = discontinuity_id, f.loaded = loaded;
}

// [N/m] as rendered to the hand; `before`: prior value, before contact.
float learned(const StiffnessEstimate& f, float before, float coupling) {
  return std::clamp((f.work + before * kPriorWeight * kPriorWeight) / (f.travel + kPriorWeight * kPriorWeight), 0.0f, coupling);
}

// Where the forces on a tool act together: the lever of a single force with their torque. The torque along the force, and that
// of a lever longer than an instrument, is a couple.
void add_rotation(const Model& model, const State& state, size_t k, ForcePatch& p) {
  const SolverState& s = state.solver;
  const ToolReaction& sum = state.haptics.tool[k];
  const size_t tool = static_cast<size_t>(state.hand[k].instrument);
  p.turn = state.hand[k].pose.q;
  if (sum.substeps == 0) return;
  const Vec3 force = sum.all / sum.substeps, torque = sum.torque / sum.substeps;
  const float size2 = length2(force);
  if (size2 < kMinForce * kMinForce) return;
  p.lever = cross(force, torque) / size2;
  if (const float l = length(p.lever); l > kLongest) p.lever *= kLongest / l;
  // What is felt of the force is felt of the couple: loads begin without a step.
  p.couple = (torque - cross(p.lever, force)) * std::min(1.0f, length(p.force) / std::sqrt(size2));
  const Vec3 axis = normalized(p.couple);
  const InstrumentState& hand = state.suture.instrument[tool];
  float spring = kBlunt * kBluntLever * kBluntLever;  // [N m/rad] of tissue on both sides of the jaws
  if (hand.held == Held::needle)
    for (const NeedleTrackConstraint& c : s.channel)
      if (c.suture == hand.suture) {
        const Vec3 moves = cross(axis, position_of(c.point, s.x.data()) - s.body[tool].x);
        spring += dot(moves, across(along_shaft(model, s, c), series(kTissue, 1 / std::max(1e-6f, c.compliance))) * moves);
      }
  p.couple_stiffness = series(spring, 1 / model.hand_angular_compliance);
}

// What the jaws hold pushes them apart. They closed on it where they grasp.
void add_grip(const Model& model, const InstrumentState& hand, uint32_t tool, ForcePatch& p) {
  if (hand.held == Held::nothing) return;
  p.grip_from = model.suture.instrument[tool].jaw.closed;
  p.grip_stiffness = hand.held == Held::tissue ? kGripTissue : kGripSteel;
}

void count_changes(State& state) {
  for (const Event& e : state.event) {
    std::array<bool, kMaxHands> felt{};
    switch (e.kind) {
      case EventKind::needle_grasped:
      case EventKind::needle_released:
      case EventKind::thread_grasped:
      case EventKind::thread_released:
      case EventKind::tissue_grasped:
      case EventKind::tissue_released:
      case EventKind::loop_formed:
      case EventKind::loop_released:
      case EventKind::instrument_taken:
      case EventKind::instrument_laid_down:
      case EventKind::instrument_parked:
        if (e.who < kMaxHands) felt[e.who] = true;
        break;
      case EventKind::tip_entered:
      case EventKind::particle_released:
      case EventKind::tip_exited:
      case EventKind::bite_withdrawn:
        for (const InstrumentState& i : state.suture.instrument)
          if (i.place == InstrumentPlace::hand && i.held == Held::needle) felt[i.hand] = true;
        break;
      case EventKind::thread_cut:
      case EventKind::suture_loaded:
        felt.fill(true);
        break;
      case EventKind::technique_fault:
        if (e.fault == Fault::thread_broken || e.fault == Fault::bite_torn_out) felt.fill(true);
        break;
      default:
        break;
    }
    for (size_t k = 0; k < kMaxHands; ++k) state.haptics.discontinuity_id[k] += felt[k];
  }
}

// The force patch of hand k, without rotation and grip.
ForcePatch linear_patch(const Model& model, const State& state, size_t k) {
  const SolverModel& m = model.solver;
  const SolverState& s = state.solver;
  const ToolReaction& sum = state.haptics.tool[k];
  const float part = sum.substeps > 0 ? 1 / sum.substeps : 0, coupling = 1 / model.hand_compliance;
  ForcePatch p;
  p.tick = state.tick;
  p.discontinuity_id = state.haptics.discontinuity_id[k];
  p.period = model.dt;
  p.expiry = std::max(p.expiry, 2 * model.dt);  // two periods are normal jitter
  p.point = sum.substeps > 0 ? sum.at * part : state.hand[k].pose.p;
  if (state.hand[k].instrument < 0) return p;
  const uint32_t tool = static_cast<uint32_t>(state.hand[k].instrument);
  if (!s.body_collides[tool]) return p;  // no hand connected
  const InstrumentState& hand = state.suture.instrument[tool];

  const Vec3 pressing = sum.pressing * part, thread = sum.thread * part, held = sum.held * part,
             needle = (sum.needle - sum.drag) * part;
  if (length(thread) > kMinForce) p.thread_direction = normalized(thread), p.thread_tension = length(thread);

  // Stiffness at the tool: the response of each load path per meter [N/m].
  Sym3 stiff;
  bool both_ways = false;
  float by_needle = 0;
  if (hand.held == Held::tissue) {
    stiff += identity(series(kTissue, 1 / model.suture.tissue_compliance));
    both_ways = true;
  }
  const bool in_channel =
      std::any_of(s.channel.begin(), s.channel.end(), [&](const NeedleTrackConstraint& c) { return c.suture == hand.suture; });
  const Suture& suture = state.suture.suture[hand.suture];
  if (hand.held == Held::needle) by_needle = in_channel ? 1 : onset(length(needle), kNeedleFrom, kNeedleWhole);
  if (by_needle > 0) {
    for (const NeedleTrackConstraint& c : s.channel)
      if (c.suture == hand.suture)
        stiff += across(along_shaft(model, s, c), series(kTissue, 1 / std::max(1e-6f, c.compliance)));
    if (suture.attached) stiff += identity(by_needle * series(kTissue, 1 / std::max(1e-6f, model.suture.attach_compliance)));
    if (!in_channel) stiff += outer(normalized(needle), by_needle * kTissue);  // the shaft lies against tissue
    both_ways = true;
    const NeedleArc& arc = m.needle_arc[hand.suture];
    p.along = rotate(s.body[m.needle_body(hand.suture)].q, arc.tangent(hand.at * arc.arc));
  }
  const float by_thread = onset(length(thread), kThreadFrom, kThreadWhole);
  if (by_thread > 0) {
    // Taut thread is as stiff as the tissue that it is attached to, along its direction, unless it slides there.
    bool slides = false;
    for (size_t i = 0; i < s.strand.size(); ++i)
      for (const ThreadAnchor& a : s.strand[i].anchor)
        if (hand.held != Held::thread || hand.suture == i) slides = slides || a.slipping != 0;
    if (!slides) stiff += outer(normalized(thread), by_thread * kTissue);
    both_ways = true;
  }

  // Rigid against rigid: the stiffness is that of the hand coupling.
  const float behind = 2 * sum.by_tool > sum.pressed ? coupling : kBlunt;
  p.force = pressing + thread * by_thread + held + needle * by_needle;
  const StiffnessEstimate& felt = state.haptics.stiffness[k];
  if (both_ways) {
    if (length(pressing) > kMinForce) stiff += outer(normalized(pressing), behind);
    p.stiffness = in_series(stiff, coupling);
    // Directions come from the constraints that load the tool, stiffness from the online estimate.
    const std::array<float, 3> stiffest = eigen(p.stiffness).value;
    const float guess = std::max({stiffest[0], stiffest[1], stiffest[2]});
    if (guess > 1) p.stiffness = clamp_eigenvalues(p.stiffness * (learned(felt, guess, coupling) / guess), 0, coupling);
    if (!model.physical && hand.held == Held::needle && !suture.open.empty()) {
      // Across the shaft and in rotation: the solver's reaction. Along the shaft: the wall's force law, no less than
      // the solver's.
      float counter = 0;  // [N] with which another hand holds the tissue
      for (size_t other = 0; other < kMaxHands; ++other) {
        const ToolReaction& o = state.haptics.tool[other];
        if (other != k && o.substeps > 0) counter = std::max(counter, length(o.held) / o.substeps);
      }
      const NeedleResistance r = resistance_now(model, state, hand.suture, counter);
      const float solver = -dot(needle, p.along);
      if (r.spring > solver) p.force -= p.along * (r.spring - solver);
      p.stiffness =
          clamp_eigenvalues(p.stiffness + outer(p.along, series(std::max(1e-3f, r.stiffness), coupling)), 0, coupling);
      p.drag = r.drag;
      p.viscous = kShaftViscous;
      p.presliding = kPresliding;
      p.pierce = p.along;
      p.pierce_force = std::max(r.pierce, r.pierce > 0 ? solver : 0);
      p.pierce_keep = kPunctureKeep;
    }
    return p;
  }
  const float push = length(pressing);
  if (push > kMinForce) {
    const Vec3 n = pressing / push;
    p.normal = n;
    // Squeezed from several sides, the tool is supported in both directions: motion away from one side loads the other.
    if (push < 0.5f * sum.pressed * part) p.normal = {};
    const float slope = std::max(1.0f, learned(felt, series(behind, coupling), coupling));
    p.stiffness = length2(p.normal) > 0 ? outer(n, slope) : identity(slope);
    p.gap = push / slope;
    p.coefficient = m.friction.tool;
    p.force = pressing;
    return p;
  }

  // No contact: the plane where contact would begin. The tool is at the hand's pose.
  p.force = {};
  float nearest = kLook;
  Vec3 meets;  // the tool's nearest point
  for (const ToolCandidate& c : state.scratch.candidates.tool) {
    if (c.body != tool) continue;
    const Capsule& capsule = m.body[c.body].capsule[c.capsule];
    const Pose pose = s.body[c.body].pose();
    const Vec3 a = transform(pose, capsule.a), b = transform(pose, capsule.b), at = xyz(s.x[c.particle]);
    const Vec3 away = a + (b - a) * closest_on_segment(at, a, b) - at;
    const float gap = length(away) - capsule.radius - m.collision.tool_radius;
    if (gap < nearest) nearest = gap, p.normal = normalized(away), meets = at + away - p.normal * capsule.radius;
  }
  float stands = kBlunt;
  for (const ToolPair& c : state.scratch.candidates.tool_pair) {
    if (c.a != tool && c.b != tool) continue;
    const bool first = c.a == tool;
    const uint32_t to = first ? c.b : c.a;
    const Capsule &mine = m.body[tool].capsule[first ? c.capsule_a : c.capsule_b],
                  &other = m.body[to].capsule[first ? c.capsule_b : c.capsule_a];
    const Pose here = s.body[tool].pose(), there = s.body[to].pose();
    const Vec3 a0 = transform(here, mine.a), a1 = transform(here, mine.b), b0 = transform(there, other.a),
               b1 = transform(there, other.b);
    const auto [at, on] = closest_on_segments(a0, a1, b0, b1);
    const Vec3 away = lerp(a0, a1, at) - lerp(b0, b1, on);
    const float gap = length(away) - mine.radius - other.radius;
    if (gap < nearest) {
      nearest = gap, stands = coupling, p.normal = normalized(away);
      meets = lerp(a0, a1, at) - p.normal * mine.radius;
    }
  }
  if (nearest < kLook) {
    p.lever = meets - s.body[tool].x;
    p.point = state.hand[k].pose.p - p.normal * std::max(0.0f, nearest);
    p.stiffness = outer(p.normal, series(stands, coupling));
    p.coefficient = m.friction.tool;
  }
  return p;
}

ForcePatch haptic_patch(const Model& model, const State& state, size_t k) {
  ForcePatch p = linear_patch(model, state, k);
  const int tool = state.hand[k].instrument;
  if (tool < 0 || !state.solver.body_collides[static_cast<size_t>(tool)]) return p;
  add_rotation(model, state, k, p);
  add_grip(model, state.suture.instrument[static_cast<size_t>(tool)], static_cast<uint32_t>(tool), p);
  return p;
}

}  // namespace

void finish_haptics(const Model& model, State& state) {
  count_changes(state);
  for (size_t k = 0; k < kMaxHands; ++k)
    update_stiffness_estimate(state.haptics.stiffness[k], state.haptics.tool[k], state.haptics.discontinuity_id[k], model.dt);
  for (size_t k = 0; k < kMaxHands; ++k) state.haptics.patch[k] = haptic_patch(model, state, k);
}

}  // namespace catgut
