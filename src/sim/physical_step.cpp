// SPDX-License-Identifier: Apache-2.0
// sim/physical_step: THE stage list of physical mechanics, as sim/step is of guided ones. See the header.
#include <algorithm>
#include <cmath>
#include <utility>

#include "sim/clamps.h"
#include "sim/hands.h"
#include "sim/model.h"
#include "sim/physical.h"
#include "sim/state.h"

namespace catgut {

// Workspace of a tick. Nothing in it outlives the tick but the workspace of physical::step.
struct PhysicalScratch {
  physical::Scratch world;
  std::vector<physical::HandTarget> target;  // per body
  std::vector<Vec3> was;                     // [m] per instrument: its place before the hands of this tick
  // What a needle did in a step of this tick.
  struct Puncture {
    uint32_t needle = 0, events = 0, torn = 0;  // torn: the channel, see physical::Needle
    wall::Point entry, exit;
    uint32_t entry_hole = wall::kNone;  // of the first channel: it may be gone at the end of the tick
  };
  std::vector<Puncture> puncture;
  std::vector<float> depth;  // [m] per needle: largest depth of its tip in the tissue in this tick
  thread::Plane drape;
  CutScratch cut;
  PhysicalScratch(const Model& model, const PhysicalState& state) : world(model.physical->world, state.world) {
    target.resize(state.world.bodies.body.size());
    was.resize(model.solver.instruments());
    puncture.reserve(64);
    depth.resize(state.world.needle.size());
    drape = model.physical->drape;
  }
};

namespace {

// An instrument that a hand takes, lays down or meets is somewhere else at once, with empty jaws.
void remember_places(const Model& model, const State& state, PhysicalScratch& k) {
  for (uint32_t i = 0; i < model.solver.instruments(); ++i) k.was[i] = state.solver.body[i].x;
}
void place_again(const Model& model, State& state, const PhysicalScratch& k) {
  for (uint32_t i = 0; i < model.solver.instruments(); ++i) {
    if (k.was[i] == state.solver.body[i].x) continue;
    physical::move_body(model.physical->world, state.physical.world, i, state.solver.body[i].pose(), kWideOpen);
  }
}

// Scissors mark pairs of the strand; the thread breaks there.
void cut_thread(const Model& model, State& state) {
  thread::State& t = state.physical.world.thread;
  for (size_t n = 0; n < state.solver.strand.size(); ++n) {
    const Strand& strand = state.solver.strand[n];
    const size_t first = model.solver.strand[n].first_slot - model.solver.tissue;
    for (size_t i = 0; i < strand.cut.size(); ++i)
      if (strand.cut[i] && !t.broken[first + i]) t.broken[first + i] = 1, t.travel = 1e9f;
  }
}

// --- hands -------------------------------------------------------------------------------------------------------------

// [N] normal force of jaws that hold this: beyond it, times both sides' friction, the thing slides out.
float pinch(const InstrumentModel& kind, physical::Gripped what, float friction) {
  const float pull = what == physical::Gripped::needle   ? kind.needle_grip
                     : what == physical::Gripped::tissue ? kind.tissue_grip
                                                         : kind.thread_grip;
  return pull / (2 * friction);
}

constexpr float kLetGo = 0.3e-3f;  // [m] by which jaws open to let go of what they hold

void set_targets(const Model& model, State& state, const TickInput& input, PhysicalScratch& k) {
  const physical::BodiesModel& bodies = model.physical->world.bodies;
  for (uint32_t i = 0; i < model.solver.instruments(); ++i) {
    physical::HandTarget& t = k.target[i];
    InstrumentState& tool = state.suture.instrument[i];
    const InstrumentModel& kind = model.suture.instrument[i];
    const Weld& weld = state.solver.weld[i];
    t.load = {};
    t.connected = tool.place == InstrumentPlace::hand && state.solver.body_collides[i] != 0;
    if (tool.place == InstrumentPlace::parked) {
      // The ratchet keeps the force of the jaws. A clamp that the scene begins with closes on its tissue in the first tick.
      const bool closes = state.tick == 0 && state.physical.world.bodies.body[i].grip.what == physical::Gripped::nothing;
      t.load = state.solver.body_force[i], t.connected = closes, t.pose = state.solver.body[i].pose(), t.opening = 0;
      t.grip = closes ? pinch(kind, physical::Gripped::tissue, bodies.body[i].grip_friction) : 0, t.may_hold = 4;
    }
    if (tool.place != InstrumentPlace::hand || !t.connected) continue;
    t.pose = weld.target * inverse(weld.local_a);
    if (input.hand[tool.hand].connected) tool.jaw = follow_jaw(tool, kind, input.hand[tool.hand].jaw);
    const physical::Gripped what = state.physical.world.bodies.body[i].grip.what;
    // Fingers that hold something rest where the jaws grasp: from there on they open them by what their stroke is worth.
    const float gap = 2 * bodies.body[i].hinge_z * kWideOpen * (tool.jaw - kind.jaw.closed);
    const bool grips = gap <= (what != physical::Gripped::nothing ? kLetGo : 0);
    t.opening = grips ? 0 : tool.jaw * kWideOpen;
    t.grip = grips ? pinch(kind, what, bodies.body[i].grip_friction) : 0;
    t.may_hold = (kind.can(kHoldNeedle) ? 1u : 0) | (kind.can(kHoldThread) ? 2u : 0) | (kind.can(kHoldTissue) ? 4u : 0);
  }
}

// A needle that no jaws hold and that is in no tissue falls onto the drape, and lies there.
void lay_needles(const Model& model, State& state, PhysicalScratch& k) {
  PhysicalState& p = state.physical;
  for (uint32_t n = 0; n < p.world.needle.size(); ++n) {
    const uint32_t body = model.solver.needle_body(n);
    PhysicalSuture& own = p.suture[n];
    const auto holds = [&](const physical::Body& b) { return b.grip.what == physical::Gripped::needle && b.grip.body == body; };
    const bool free =
        p.world.needle[n].channels == 0 && std::none_of(p.world.bodies.body.begin(), p.world.bodies.body.end(), holds);
    const float above = p.world.bodies.body[body].pose.p.y - model.physical->drape.offset;
    const bool lay = own.lies;
    own.lies = free && (lay || above < 2 * model.physical->world.needles.needle[n].shape.wire_radius);
    if (own.lies && !lay) own.bed = p.world.bodies.body[body].pose;
    k.target[body].connected = own.lies, k.target[body].pose = own.bed;
  }
}

// --- what the world did, where everything else reads it ----------------------------------------------------------------

// What a needle did in this step.
void note_punctures(const State& state, const physical::Model& m, PhysicalScratch& k) {
  const physical::State& w = state.physical.world;
  for (uint32_t n = 0; n < w.needle.size(); ++n) {
    const physical::Needle& needle = w.needle[n];
    if (needle.inside) {
      const physical::Channel& c = needle.channel[needle.channels - 1];
      const float depth = 0.5f * (1 - c.entry_side * needle.tip.zeta) * m.wall.laminate.thickness;
      k.depth[n] = std::max(k.depth[n], depth);
    }
    if (!needle.events || k.puncture.size() == k.puncture.capacity()) continue;
    PhysicalScratch::Puncture& p = k.puncture.emplace_back();
    p.needle = n, p.events = needle.events, p.torn = needle.torn;
    if (needle.channels == 0) continue;
    const physical::Channel& c = needle.channel[needle.channels - 1];
    p.entry = c.point[0], p.exit = c.point[c.count - 1];
    p.entry_hole = needle.channel[0].entry_hole;
  }
}

// Segment i of a strand has broken under load: its value is the tension of the tick before.
void report_broken(State& state, size_t n, size_t i) {
  const Strand& strand = state.solver.strand[n];
  Event e;
  e.kind = EventKind::technique_fault, e.fault = Fault::thread_broken;
  e.who = kNoHand, e.which = strand.order[i], e.value = strand.tension[i], e.suture = static_cast<uint16_t>(n);
  e.where = xyz(state.solver.x[strand.order[i]]);
  state.event.add(e);
}

// Positions, velocities and tensions.
void show(const Model& model, State& state) {
  SolverState& s = state.solver;
  const wall::Motion& wall = state.physical.world.wall.motion;
  const thread::State& t = state.physical.world.thread;
  for (uint32_t c = 0; 2 * c < model.solver.tissue; ++c) {
    const Vec3 x = wall::vec3(wall.x[2 * c]), d = wall::vec3(wall.x[2 * c + 1]), v = wall::vec3(wall.v[2 * c]),
               r = wall::vec3(wall.v[2 * c + 1]);
    set(s.x[2 * c], x + d), set(s.x[2 * c + 1], x - d);
    set(s.v[2 * c], v + r), set(s.v[2 * c + 1], v - r);
  }
  for (uint32_t i = 0; i < t.nodes(); ++i) {
    set(s.x[model.solver.tissue + i], t.position(i));
    set(s.v[model.solver.tissue + i], t.v.at(i));
  }
  for (size_t n = 0; n < s.strand.size(); ++n) {
    Strand& strand = s.strand[n];
    const size_t first = model.solver.strand[n].first_slot - model.solver.tissue;
    for (size_t i = 0; i < strand.rest.size(); ++i) {
      strand.rest[i] = t.rest[first + i];
      if (t.broken[first + i] && !strand.cut[i]) report_broken(state, n, i);
      strand.tension[i] = t.tension[first + i];
      strand.cut[i] = t.broken[first + i];
    }
  }
  for (size_t i = 0; i < s.body.size(); ++i) {
    const physical::Body& b = state.physical.world.bodies.body[i];
    s.body[i] = {b.pose.p, b.pose.q, b.velocity, b.spin, b.pose.p, b.pose.q};
  }
  // Rotations of neighborhoods, which carry points of tissue for the picture and the surgeon's eyes.
  make_shape_rows(model.solver.shape, s.x.data(), state.scratch.shape, 0, model.solver.shape.groups);
  solve_shape_clusters(model.solver.shape, s.rotation, state.scratch.shape, 0, model.solver.shape.clusters);
}

constexpr EventKind kTaken[] = {EventKind::count_, EventKind::needle_grasped, EventKind::thread_grasped,
                                EventKind::tissue_grasped},
                    kLost[] = {EventKind::count_, EventKind::needle_released, EventKind::thread_released,
                               EventKind::tissue_released};
constexpr Held kHeld[] = {Held::nothing, Held::needle, Held::thread, Held::tissue};

// A tissue clamp with a ratchet: a needle holder is none.
bool is_clamp(const Model& model, uint32_t i) {
  const InstrumentModel& kind = model.suture.instrument[i];
  return kind.can(kClamp) && !kind.can(kHoldNeedle);
}

// A closed clamp has lost its tissue. A parked one falls, and is put back on the tray.
void report_torn_out(const Model& model, State& state, uint32_t i) {
  const physical::Body& body = state.physical.world.bodies.body[i];
  Event e;
  e.kind = EventKind::technique_fault, e.fault = Fault::clamp_torn_out;
  e.who = state.suture.instrument[i].hand, e.which = i, e.where = body.pose.p;
  const bool parked = state.suture.instrument[i].place == InstrumentPlace::parked;
  e.value = length(parked ? state.solver.body_force[i] : body.hand_force);
  state.event.add(e);
  if (!parked) return;
  drop_instrument(model, state, i);
  physical::move_body(model.physical->world, state.physical.world, i, model.tray[i], kWideOpen);
}

// What jaws hold, with the events of taking and losing it.
void show_grips(const Model& model, State& state, SutureContext& sewing) {
  const physical::State& w = state.physical.world;
  for (Strand& strand : state.solver.strand)
    std::erase_if(strand.hold, [](const ThreadHold& h) { return h.kind == HoldKind::jaw; });
  for (uint32_t i = 0; i < model.solver.instruments(); ++i) {
    const physical::Body& body = w.bodies.body[i];
    const physical::Grip& grip = body.grip;
    InstrumentState& tool = state.suture.instrument[i];
    const Held before = tool.held, now = kHeld[static_cast<size_t>(grip.what)];
    if (before != Held::nothing && before != now) {
      const bool slipped = tool.jaw <= model.suture.instrument[i].jaw.closed;
      const size_t kind = static_cast<size_t>(std::find(std::begin(kHeld), std::end(kHeld), before) - std::begin(kHeld));
      const bool clamp = is_clamp(model, i) && before == Held::tissue;
      if (clamp && (tool.place == InstrumentPlace::parked || slipped)) report_torn_out(model, state, i);
      sewing.report_tool(before == Held::tissue ? 0 : tool.suture, kLost[kind], i, before == Held::needle ? 0 : tool.slot,
                         slipped ? length(body.force) : 0, body.pose.p);
    }
    tool.held = now;
    if (now == Held::needle) {
      tool.suture = grip.body - model.solver.instruments();
      const NeedleArc& arc = model.solver.needle_arc[tool.suture];
      tool.at = arc.nearest(to_local(w.bodies.body[grip.body].pose, body.pose.p)) / arc.arc;
      if (before != now) state.suture.active = tool.suture;
    } else if (now == Held::thread) {
      tool.slot = model.solver.tissue + grip.node;
      tool.suture = model.solver.strand_of(tool.slot);
      state.solver.strand[tool.suture].hold.push_back({tool.slot, static_cast<int>(i), grip.point[0].in_tool, HoldKind::jaw});
      if (grip.count == 2) {
        const uint32_t slot = model.solver.tissue + grip.body;
        state.solver.strand[model.solver.strand_of(slot)].hold.push_back(
            {slot, static_cast<int>(i), grip.point[1].in_tool, HoldKind::jaw});
      }
    } else if (now == Held::tissue) {
      const wall::Weights at = wall::weights(model.physical->world.wall, w.wall.topology, grip.point[0].tissue);
      const size_t most = static_cast<size_t>(std::max_element(at.weight.begin(), at.weight.end()) - at.weight.begin());
      tool.slot = 2 * w.wall.topology.source[at.column[most]] + (grip.point[0].tissue.zeta < 0 ? 1 : 0);
    }
    // A ratchet closes as far as it can: teeth bruise what they hold.
    if (now == Held::tissue && (before != now || state.tick == 0) && is_clamp(model, i)) {
      const physical::BodyModel& m = model.physical->world.bodies.body[i];
      sewing.report_tool(0, EventKind::tissue_crushed, i, i, grip.force / (2 * m.jaw_width * m.jaw_length), body.pose.p);
    }
    if (now != Held::nothing && before != now)
      sewing.report_tool(now == Held::tissue ? 0 : tool.suture, kTaken[static_cast<size_t>(grip.what)], i,
                         now == Held::needle ? 0 : tool.slot, now == Held::needle ? tool.at : 0, body.pose.p);
  }
}

// The end of a bite at a material point: a triangle of the same side of the surface, and the tissue round it.
BiteEnd bite_end(const Model& model, const State& state, const wall::Point& point) {
  const physical::Model& m = model.physical->world;
  const wall::Motion& motion = state.physical.world.wall.motion;
  const Vec3 at = wall::place(wall::weights(m.wall, state.physical.world.wall.topology, point), motion);
  BiteEnd end;
  SurfaceHit hit;
  if (nearest_surface(model.solver, state.scratch.candidates, state.solver.x.data(), at, 0.008f, hit)) end = hit.end;
  spread(model.solver, end);
  return end;
}

// A suture point where the thread runs through a hole.
void add_point(const Model& model, State& state, SutureContext& sewing, uint32_t n, uint32_t bite, bool exit, uint32_t hole) {
  Suture& suture = state.suture.suture[n];
  Strand& strand = state.solver.strand[n];
  std::vector<uint32_t>& known = state.physical.suture[n].hole;
  if (std::find(known.begin(), known.end(), hole) != known.end()) return;  // the swage went back and forth in it
  ThreadAnchor anchor;
  anchor.slot = model.solver.strand[n].first_slot + model.solver.strand[n].count - 2;
  const BiteEnd& end = exit ? suture.bite[bite].exit : suture.bite[bite].entry;
  anchor.point = end.point;
  strand.anchor.push_back(anchor);
  suture.point.push_back({bite, exit, static_cast<uint32_t>(strand.anchor.size()) - 1});
  known.push_back(hole);
  sewing.report(n, EventKind::suture_point, kNoHand, static_cast<uint32_t>(suture.point.size()) - 1, static_cast<float>(bite),
                position_of(end.point, state.solver.x.data()));
}

// The hole of this strand's thread that has no suture point yet: where its needle came out.
uint32_t new_hole(const Model& model, const State& state, uint32_t n) {
  const StrandModel& strand = model.solver.strand[n];
  const uint32_t first = strand.first_slot - model.solver.tissue;
  const std::vector<uint32_t>& known = state.physical.suture[n].hole;
  for (const thread::Eyelet& e : state.physical.world.thread.eyelet)
    if (e.segment >= first && e.segment < first + strand.count && std::find(known.begin(), known.end(), e.point) == known.end())
      return e.point;
  return wall::kNone;
}

// Bites, suture points and their events, from what the needles did in this tick.
void show_bites(const Model& model, State& state, SutureContext& sewing, const PhysicalScratch& k) {
  const Vec4* x = state.solver.x.data();
  for (const PhysicalScratch::Puncture& p : k.puncture) {
    Suture& suture = state.suture.suture[p.needle];
    const RigidBody& body = state.solver.body[model.solver.needle_body(p.needle)];
    const NeedleArc& arc = model.solver.needle_arc[p.needle];
    const auto report = [&](EventKind kind, uint32_t which, float value, Vec3 where) {
      sewing.report(p.needle, kind, kNoHand, which, value, where);
    };
    if (p.events & physical::kEntered) {
      const uint32_t which = static_cast<uint32_t>(suture.bite.size());
      Bite bite;
      bite.entry = bite.exit = bite_end(model, state, p.entry);
      const Triangle& t = model.solver.collision.surface[bite.entry.triangle];
      bite.nearest = t[0];
      const Vec3 a = xyz(x[t[0]]), normal = normalized(cross(xyz(x[t[1]]) - a, xyz(x[t[2]]) - a));
      const Vec3 heading = rotate(body.q, arc.tangent(arc.arc));
      suture.bite.push_back(bite);
      suture.open.push_back({which, NeedlePhase::tip_in});
      report(EventKind::tip_entered, which, portable::acos(std::clamp(-dot(heading, normal), -1.0f, 1.0f)),
             position_of(bite.entry.point, x));
      if (is_charred(model, state, p.entry))
        sewing.report_fault(p.needle, Fault::bite_in_char, kNoHand, which, position_of(bite.entry.point, x));
    }
    if (suture.open.empty()) continue;
    if (p.events & physical::kLeft) {
      OpenBite& newest = suture.open.back();
      Bite& bite = suture.bite[newest.bite];
      bite.exit = bite_end(model, state, p.exit);
      bite.has_exit = true;
      newest.phase = NeedlePhase::through;
      report(EventKind::tip_exited, newest.bite, bite.depth, position_of(bite.exit.point, x));
      if (is_charred(model, state, p.exit))
        sewing.report_fault(p.needle, Fault::bite_in_char, kNoHand, newest.bite, position_of(bite.exit.point, x));
    }
    if (p.events & physical::kWithdrawn) {
      const uint32_t which = suture.open.back().bite;
      suture.bite[which].canceled = true, suture.bite[which].has_exit = false;
      suture.open.pop_back();
      report(EventKind::bite_withdrawn, which, suture.bite[which].depth, needle_tip(arc, body));
    }
    if ((p.events & physical::kTornOut) && p.torn < suture.open.size()) {
      const uint32_t which = suture.open[p.torn].bite;
      suture.bite[which].canceled = true, suture.bite[which].has_exit = false;
      suture.open.erase(suture.open.begin() + p.torn);
      sewing.report_fault(p.needle, Fault::needle_torn_out, kNoHand, which, needle_tip(arc, body));
    }
    if ((p.events & physical::kThreadIn) && !suture.open.empty() && p.entry_hole != wall::kNone) {
      suture.open.front().phase = NeedlePhase::back_in;
      add_point(model, state, sewing, p.needle, suture.open.front().bite, false, p.entry_hole);
    }
    if ((p.events & physical::kThreadOut) && !suture.open.empty()) {
      const uint32_t which = suture.open.front().bite, hole = new_hole(model, state, p.needle);
      Bite& bite = suture.bite[which];
      if (hole != wall::kNone) add_point(model, state, sewing, p.needle, which, true, hole);
      bite.complete = true;
      suture.open.erase(suture.open.begin());
      const Vec3 out = position_of(bite.exit.point, x);
      report(EventKind::bite_completed, which, distance(position_of(bite.entry.point, x), out), out);
    }
  }
  for (uint32_t n = 0; n < state.suture.suture.size(); ++n) {
    Suture& suture = state.suture.suture[n];
    const physical::Needle& needle = state.physical.world.needle[n];
    if (!suture.open.empty() && needle.inside) {
      OpenBite& newest = suture.open.back();
      Bite& bite = suture.bite[newest.bite];
      bite.depth = std::max(bite.depth, k.depth[n]);
      if (newest.phase == NeedlePhase::through)  // back in its exit
        newest.phase = NeedlePhase::tip_in, bite.has_exit = false;
    }
    suture.tip_inside = needle.inside;
  }
}

// [m] of a slit from which on a bite counts as torn.
constexpr float kTorn = 0.001f;

// Bites whose thread or needle tears the wall: their ends move with the slit. One that is torn out has no suture points any
// more.
void show_tears(const Model& model, State& state, SutureContext& sewing) {
  for (uint32_t n = 0; n < state.suture.suture.size(); ++n) {
    Suture& suture = state.suture.suture[n];
    Strand& strand = state.solver.strand[n];
    const physical::Needle& needle = state.physical.world.needle[n];
    for (uint32_t c = 0; c < std::min<size_t>(needle.channels, suture.open.size()); ++c) {
      const physical::Channel& channel = needle.channel[c];
      if (channel.torn[0] == 0) continue;
      Bite& bite = suture.bite[suture.open[c].bite];
      if (bite.torn == 0) bite.entry_made = bite.entry, bite.exit_made = bite.exit;
      bite.entry = bite_end(model, state, channel.point[0]);
      if (bite.has_exit) bite.exit = bite_end(model, state, channel.point[channel.count - 1]);
      if (std::exchange(bite.torn, std::max(bite.torn, channel.torn[0])) >= kTorn || bite.torn < kTorn) continue;
      sewing.report(n, EventKind::technique_fault, kNoHand, suture.open[c].bite, length(channel.load),
                    position_of(bite.entry.point, state.solver.x.data()), Fault::bite_torn);
    }
    std::vector<uint32_t>& known = state.physical.suture[n].hole;
    for (size_t i = known.size(); i-- > 0;) {
      if (known[i] >= state.physical.world.hole.size()) continue;
      const physical::Hole& hole = state.physical.world.hole[known[i]];
      const SuturePoint point = suture.point[i];
      Bite& bite = suture.bite[point.bite];
      if (hole.torn == 0 && !hole.out) continue;
      if (bite.torn == 0) bite.entry_made = bite.entry, bite.exit_made = bite.exit;
      BiteEnd& end = point.exit ? bite.exit : bite.entry;
      end = bite_end(model, state, hole.place);
      strand.anchor[point.anchor].point = end.point;
      const auto report = [&](Fault fault) {
        sewing.report(n, EventKind::technique_fault, kNoHand, point.bite, length(hole.load),
                      position_of(end.point, state.solver.x.data()), fault);
      };
      // The larger one of its two slits.
      if (std::exchange(bite.torn, std::max(bite.torn, hole.torn)) < kTorn && bite.torn >= kTorn) report(Fault::bite_torn);
      if (!hole.out) continue;
      if (!std::exchange(bite.torn_out, true)) report(Fault::bite_torn_out);
      erase_anchor(strand, suture, point.anchor);
      suture.point.erase(suture.point.begin() + static_cast<std::ptrdiff_t>(i));
      known.erase(known.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }
}

// Where the thread runs through its holes now, and how taut it is there. A point whose hole the thread has left again is gone.
void show_points(const Model& model, State& state, SutureContext& sewing) {
  const thread::State& t = state.physical.world.thread;
  for (uint32_t n = 0; n < state.suture.suture.size(); ++n) {
    Suture& suture = state.suture.suture[n];
    Strand& strand = state.solver.strand[n];
    std::vector<uint32_t>& hole = state.physical.suture[n].hole;
    const uint32_t first = model.solver.strand[n].first_slot, count = model.solver.strand[n].count;
    while (!hole.empty() && hole.back() >= state.physical.world.hole.size()) {
      erase_anchor(strand, suture, suture.point.back().anchor);
      suture.point.pop_back(), hole.pop_back();
      if (!suture.open.empty()) suture.open.front().phase = NeedlePhase::through;
    }
    for (size_t i = 0; i < hole.size();) {
      const auto e =
          std::find_if(t.eyelet.begin(), t.eyelet.end(), [&](const thread::Eyelet& x) { return x.point == hole[i]; });
      if (e == t.eyelet.end()) {  // its end was drawn through
        const uint32_t which = suture.point[i].bite;
        Bite& bite = suture.bite[which];
        erase_anchor(strand, suture, suture.point[i].anchor);
        suture.point.erase(suture.point.begin() + static_cast<std::ptrdiff_t>(i));
        hole.erase(hole.begin() + static_cast<std::ptrdiff_t>(i));
        const auto in_it = [&](const SuturePoint& p) { return p.bite == which; };
        if (!bite.complete || std::any_of(suture.point.begin(), suture.point.end(), in_it)) continue;
        bite.canceled = true, bite.complete = bite.has_exit = false;
        sewing.report(n, EventKind::bite_withdrawn, kNoHand, which, bite.depth,
                      position_of(bite.entry.point, state.solver.x.data()));
        continue;
      }
      ThreadAnchor& a = strand.anchor[suture.point[i].anchor];
      const uint32_t node = e->segment - (first - model.solver.tissue);
      a.slot = first + std::clamp(node, 1u, count - 2);
      a.tension_free = node > 0 ? strand.tension[node - 1] : 0;
      a.tension_needle = node + 1 < strand.tension.size() ? strand.tension[node + 1] : 0;
      ++i;
    }
  }
}

// The sums of sim/haptic_feedback, from the rows of this step.
void sum_haptics(const Model& model, State& state, const PhysicalScratch& k, int step) {
  const float h = model.solver.h;
  for (size_t hand = 0; hand < kMaxHands; ++hand) {
    if (state.hand[hand].instrument < 0) continue;
    const uint32_t i = static_cast<uint32_t>(state.hand[hand].instrument);
    const physical::Body& body = state.physical.world.bodies.body[i];
    Weld& weld = state.solver.weld[i];
    weld.lambda = body.hand_force * (h * h), weld.angular_lambda = body.hand_torque * (h * h);
    if (step <= model.substeps - std::max(1, model.substeps / 4)) continue;
    ToolReaction& t = state.haptics.tool[hand];
    for (const physical::Row& row : k.world.bodies.row) {
      if (row.a != i) continue;
      const Vec3 force = row.impulse / h, normal = row.axis * dot(force, row.axis);
      if (row.kind == physical::Row::Kind::contact)
        t.pressing += normal, t.rubbing += force - normal, t.pressed += length(normal);
      else if (row.kind == physical::Row::Kind::spring) t.thread += force;  // jaws on a thread
      else (row.on_wall ? t.held : t.needle) += force;
    }
    t.thread += body.thread_force;
    t.all += body.force;
    t.torque += physical::torque_about(model.physical->world.bodies.body[i], body, body.pose.p);
    t.hand -= body.hand_force;
    t.wrist -= body.hand_torque;
    t.at += weld.target.p;
    t.substeps += 1;
  }
}

}  // namespace

// Particles move with the wall as it was built: near a cut edge, some of those round a bite have left with the specimen. Holes
// and channels know their places on the cut wall.
void publish_holes(const Model& model, const State& state, size_t which, SutureView& out) {
  const physical::State& world = state.physical.world;
  const Suture& suture = state.suture.suture[which];
  const auto weights = [&](const wall::Point& p) { return wall::weights(model.physical->world.wall, world.wall.topology, p); };
  const auto place = [&](const wall::Point& p) { return wall::place(weights(p), world.wall.motion); };
  const auto organ = [&](const wall::Point& p) { return model.wall[2 * world.wall.topology.source[weights(p).column[0]]]; };
  const auto show_entry = [&](BiteView& b, const wall::Point& p) {
    b.entry = b.entry_made = place(p), b.entry_inside = p.zeta < 0, b.wall = organ(p);
  };
  const auto show_exit = [&](BiteView& b, const wall::Point& p) {
    b.exit = b.exit_made = place(p), b.exit_inside = p.zeta < 0;
  };
  const physical::Needle& needle = world.needle[which];
  for (size_t i = 0; i < std::min<size_t>(suture.open.size(), needle.channels); ++i) {  // both from the swage to the tip
    const physical::Channel& c = needle.channel[i];
    BiteView& b = out.bite[suture.open[i].bite];
    show_entry(b, c.point[0]);
    if (b.has_exit) show_exit(b, c.point[c.count - 1]);
  }
  const std::vector<uint32_t>& hole = state.physical.suture[which].hole;
  for (size_t i = 0; i < hole.size(); ++i) {
    const physical::Hole& h = world.hole[hole[i]];
    SuturePointView& point = out.suture_point[i];
    BiteView& b = out.bite[point.bite];
    point.position = place(h.place), point.wall = organ(h.place);
    if (point.exit) show_exit(b, h.place);
    else show_entry(b, h.place);
    if (h.torn > 0) (point.exit ? b.exit_made : b.entry_made) = place(h.made);
  }
}

void step_physical(const Model& model, State& state, const TickInput& given, Jobs& jobs, StageTimes* times,
                   std::span<const physical::Hands::WallPull> wall_pulls) {
  TickInput input = given;
  switch_pens(model, state, input);
  if (!state.physical.scratch) state.physical.scratch = std::make_shared<PhysicalScratch>(model, state.physical);
  PhysicalScratch& k = *state.physical.scratch;
  find_boxes(model.solver, state.solver, state.scratch, jobs, times);
  remember_places(model, state, k);
  meet_hands(state, input);
  handle_instruments(model, state, input);
  place_again(model, state, k);
  SutureContext sewing{model.solver, state.solver, state.scratch, model.suture, state.suture, state.event};
  cut(sewing, input);
  // Knots are thread here, no objects of the suture: whether a cut end was tied is a question to thread/observe.
  std::erase_if(state.event.list,
                [](const Event& e) { return e.kind == EventKind::technique_fault && e.fault == Fault::cut_before_knot; });
  for (const Command& c : input.commands)
    if (c.kind == CommandKind::new_suture) sewing.refuse(c);  // not with physical mechanics yet
  cut_thread(model, state);
  find_tool_candidates(model.solver, state.solver, state.scratch, std::clamp(0.5f * model.dt, 0.002f, 0.008f), times);
  begin_haptics(state);
  k.puncture.clear(), std::fill(k.depth.begin(), k.depth.end(), 0.0f);
  use_scissors(model, state, k.world);
  const MovingClamps clamps(model, state, input.commands, k.world.wall);
  physical::Hands hands;
  hands.targets = k.target, hands.plane = &k.drape, hands.wall_pulls = wall_pulls;
  for (int i = 1; i <= model.substeps; ++i) {
    StageTimer timer(times, Stage::thread);
    follow_hands(model, state, input, static_cast<float>(i) / static_cast<float>(model.substeps));
    set_targets(model, state, input, k);
    lay_needles(model, state, k);
    use_pens(model, state, k.world, model.solver.h);
    clamps.move(model, state, model.solver.h);
    physical::step(model.physical->world, state.physical.world, k.world, hands, jobs);
    note_punctures(state, model.physical->world, k);
    sum_haptics(model, state, k, i);
  }
  clamps.stop(model, state);
  show(model, state);
  show_grips(model, state, sewing);
  show_bites(model, state, sewing, k);
  show_tears(model, state, sewing);
  show_points(model, state, sewing);
  watch_pulls(model, state);
  bleed(model, state, k.cut);
  renew_cut_picture(model, state, k.cut);
  remember_hands(state, input);
  ++state.tick;
  finish_haptics(model, state);
}

}  // namespace catgut
