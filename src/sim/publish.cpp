// SPDX-License-Identifier: Apache-2.0
// sim/publish: reads the state after a tick, writes the Snapshot for rendering, surgeon and host. Does not change the state.
#include <algorithm>

#include "sim/model.h"
#include "sim/physical.h"
#include "sim/state.h"

namespace catgut {

namespace {

void publish_hands(const Model& model, const State& state, Snapshot& out) {
  const SolverState& s = state.solver;
  const float inv_h2 = 1.0f / (model.solver.h * model.solver.h);
  out.instrument.resize(model.solver.instruments());
  for (size_t i = 0; i < out.instrument.size(); ++i) {
    const InstrumentState& tool = state.suture.instrument[i];
    InstrumentView& v = out.instrument[i];
    v.pose = s.body[i].pose();
    v.jaw = tool.jaw;
    v.place = tool.place;
    v.hand = tool.hand;
    v.held = tool.held;
    v.held_slot = tool.slot;
    v.pull = {};
    for (const Attachment& a : s.attach)
      if (a.body == static_cast<int>(i)) v.pull += a.lambda * inv_h2;
  }
  for (size_t k = 0; k < kMaxHands; ++k) {
    ToolView& t = out.tool[k];
    t = {};
    t.pose = t.hand = state.hand[k].pose;
    t.instrument = state.hand[k].instrument;
    out.patch[k] = state.haptics.patch[k];
    if (t.instrument < 0) continue;
    const size_t i = static_cast<size_t>(t.instrument);
    const InstrumentState& tool = state.suture.instrument[i];
    t.pose = s.body[i].pose();
    t.jaw = tool.jaw;
    t.held = tool.held;
    t.held_at = tool.at;
    t.held_slot = tool.slot;
    t.held_suture = tool.suture;
    for (const Strand& strand : s.strand)
      for (const ThreadHold& h : strand.hold) t.held_strands += h.body == t.instrument && h.kind == HoldKind::jaw;
    const ToolLoop& loop = state.suture.loop[i];
    t.loop_wraps = loop.wraps;
    t.loop_handed = loop.chirality;
    t.loop_suture = loop.suture;
    t.loop_first = loop.first;
    t.loop_last = loop.last;
    // The weld's multiplier acts on the tool; the reaction acts on the hand.
    t.force = s.weld[i].lambda * -inv_h2;
    t.torque = s.weld[i].angular_lambda * -inv_h2;
  }
}

void publish_knots(const State& state, size_t which, SutureView& out) {
  const Suture& suture = state.suture.suture[which];
  const std::vector<ThreadAnchor>& anchor = state.solver.strand[which].anchor;
  const Vec4* x = state.solver.x.data();
  out.knot.clear();
  for (const Knot& k : suture.knot) {
    KnotView v;
    v.phase = k.phase;
    v.position = position_of(k.target, x);
    if (k.phase == KnotPhase::tightening && k.begun == 0) v.position += normalized(k.from) * k.left;
    v.throws = k.throws;
    v.thrown = k.thrown;
    if (suture.point.size() > 1)
      v.way = normalized(
          position_of(anchor[suture.point.back().anchor], x) - position_of(anchor[suture.point.front().anchor], x), {1, 0, 0});
    out.knot.push_back(v);
  }
}

void publish_bites(const Model& model, const State& state, size_t which, SutureView& out) {
  const Suture& suture = state.suture.suture[which];
  const Strand& strand = state.solver.strand[which];
  const std::vector<Triangle>& surface = model.solver.collision.surface;
  const Vec4* x = state.solver.x.data();
  out.suture_point.clear();
  for (const SuturePoint& p : suture.point) {
    const ThreadAnchor& a = strand.anchor[p.anchor];
    const Bite& bite = suture.bite[p.bite];
    out.suture_point.push_back({position_of(a.point, x), p.bite, p.exit, a.slot, a.tension_needle, a.tension_free,
                                model.wall[surface[(p.exit ? bite.exit : bite.entry).triangle][0]]});
  }
  out.bite.clear();
  for (const Bite& b : suture.bite) {
    const uint32_t in = surface[b.entry.triangle][0], through = surface[b.exit.triangle][0];
    const auto inside = [&](uint32_t i) { return model.layer[i] == static_cast<uint8_t>(TissueLayer::mucosa); };
    const Vec3 entry = position_of(b.entry.point, x), exit = position_of(b.exit.point, x);
    out.bite.push_back({entry, exit, b.depth, b.has_exit, b.complete, model.wall[in], inside(in), inside(through), entry, exit,
                        b.torn, b.torn_out});
    if (b.torn > 0)
      out.bite.back().entry_made = position_of(b.entry_made.point, x),
      out.bite.back().exit_made = position_of(b.exit_made.point, x);
  }
  out.seam.clear();
  for (const ClosurePlan::Pair& p : state.plan[which].pair)
    out.seam.push_back({position_of(p.a, x), position_of(p.b, x), p.start, p.progress, p.midpoint != 0});
}

void publish_suture(const Model& model, const State& state, size_t which, SutureView& out) {
  const Suture& suture = state.suture.suture[which];
  const Strand& strand = state.solver.strand[which];
  const RigidBody& needle = state.solver.body[model.solver.needle_body(which)];
  // The published pose is at the circle's center, the reference point of rendering and plans.
  out.needle.pose = {transform(needle.pose(), model.solver.needle_arc[which].center), needle.q};
  out.needle.in_tissue = !suture.open.empty();
  out.needle.bite = suture.open.empty() ? 0 : suture.open.back().bite;
  out.thread_order = strand.order;
  out.thread_tension = strand.tension;
  out.thread_cut = strand.cut;
  out.thread_rest = 0;
  for (size_t i = 0; i < strand.rest.size(); ++i)
    if (!strand.cut[i]) out.thread_rest += strand.rest[i];
  out.needle_on_thread = is_swaged(strand);
  publish_bites(model, state, which, out);
  if (model.physical) publish_holes(model, state, which, out);
  publish_knots(state, which, out);
}

void publish_settled(const Model& model, const State& state, Snapshot& out) {
  const SolverState& s = state.solver;
  out.settled.clear();
  const auto place = [&](const BakedNode& n) {
    const uint32_t c = model.solver.shape.cluster_of[n.particle];
    const Quat q{s.rotation.x[c], s.rotation.y[c], s.rotation.z[c], s.rotation.w[c]};
    return xyz(s.x[n.particle]) + rotate(q, n.offset);
  };
  for (const BakedSuture& stitch : state.suture.settled) {
    SettledView v;
    for (const BakedNode& n : stitch.node) v.node.push_back(place(n));
    for (const BakedNode& n : stitch.knot) v.knot.push_back(place(n));
    out.settled.push_back(std::move(v));
  }
}

// From the solver's numbers of particles to those that nothing ever changes (public_index).
void use_public_numbers(const Model& built, const Model& model, Snapshot& out) {
  const auto renumber = [&](uint32_t& i) { i = public_index(built, model, i); };
  const auto tissue = static_cast<std::ptrdiff_t>(built.solver.tissue);
  std::rotate(out.particle.begin() + tissue, out.particle.begin() + model.solver.tissue, out.particle.end());
  out.rotation.insert(out.rotation.begin() + tissue, built.solver.count - built.solver.tissue, Quat{});
  for (InstrumentView& v : out.instrument) renumber(v.held_slot);
  for (ToolView& t : out.tool) renumber(t.held_slot), renumber(t.loop_first), renumber(t.loop_last);
  for (SutureView& u : out.suture) {
    for (uint32_t& slot : u.thread_order) renumber(slot);
    for (SuturePointView& p : u.suture_point) renumber(p.anchored);
  }
  for (Event& e : out.event)
    if (names_particle(e)) renumber(e.which);
}

}  // namespace

PictureModel picture_model(const Model& model) { return model.picture; }

void publish(const Model& built, const State& state, Snapshot& out) {
  const Model& model = current_model(built, state);
  const SolverModel& m = model.solver;
  const SolverState& s = state.solver;
  out.tick = state.tick;
  out.time_s = static_cast<double>(state.tick) / model.scene.solver.tick_rate;
  out.topology = {state.topology.version, model.pieces, {}};
  if (state.divided)
    out.topology.picture = DividedPicture(std::shared_ptr<const PictureModel>(state.divided, &state.divided->picture));
  out.particle.resize(m.count);
  for (uint32_t i = 0; i < m.count; ++i) out.particle[i] = xyz(s.x[i]);
  out.rotation.resize(m.tissue);
  for (uint32_t i = 0; i < m.tissue; ++i) {
    const uint32_t c = m.shape.cluster_of[i];
    out.rotation[i] = {s.rotation.x[c], s.rotation.y[c], s.rotation.z[c], s.rotation.w[c]};
  }
  publish_hands(model, state, out);
  out.suture.resize(s.strand.size());
  for (size_t k = 0; k < s.strand.size(); ++k) publish_suture(model, state, k, out.suture[k]);
  out.active_suture = state.suture.active;
  publish_settled(model, state, out);
  const std::vector<uint32_t>& rim = model.technique.purse_string.rim_inner;
  out.opening_area = rim.empty() ? 0 : opening_area(rim, s.x.data());
  out.closure = 0;
  for (const ClosurePlan& plan : state.plan) out.closure = std::max(out.closure, plan.progress);
  out.event = state.event.list;
  out.scar.clear();
  out.wound = {};
  const Cutting& cutting = state.physical.cutting;
  if (cutting.picture) publish_cut(model, state, out);
  for (size_t i = 0; i < cutting.mode.size(); ++i) {
    out.instrument[i].pen = cutting.mode[i];
    const bool burns = cutting.mode[i] != PenMode::off && cutting.excision.touching;
    out.instrument[i].burning = burns ? static_cast<float>(state.tick - cutting.stroke.began) * model.dt : 0;
  }
  if (!model.source.empty()) use_public_numbers(built, model, out);
}

}  // namespace catgut
