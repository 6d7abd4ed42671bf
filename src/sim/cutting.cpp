// SPDX-License-Identifier: Apache-2.0
// sim/cutting: commands and the pen's stage. See the header.
#include "sim/cutting.h"

#include <algorithm>
#include <cmath>

#include "sim/model.h"
#include "sim/state.h"

namespace catgut {
namespace {

uint8_t hand_of(const State& state, size_t instrument) { return state.suture.instrument[instrument].hand; }

void report(State& state, EventKind kind, size_t instrument, uint32_t which, float value, Vec3 where,
            Fault fault = Fault::none) {
  Event e;
  e.kind = kind, e.who = hand_of(state, instrument), e.which = which, e.value = value, e.where = where, e.fault = fault;
  state.event.add(e);
}

// [m] from the rim of the first body, along its axis, at rest.
float from_rim(const CutLine& line, const Model& model, const wall::Point& point) {
  return dot(line.rim - wall::rest_place(model.physical->world.wall, point), line.axis);
}

// [m] from the planned line; -1: there is none for this place.
float from_line(const Model& model, const wall::Point& point) {
  const std::optional<CutLine> line = cut_line(model.scene);
  const uint32_t column = model.physical->world.wall.mesh.face[point.face][0];
  if (!line || 2 * column >= static_cast<uint32_t>(model.scene.body.front().particles)) return -1;
  return std::abs(from_rim(*line, model, point) - line->from_rim);
}

Vec3 place_of(const Model& model, const State& state, const wall::Point& point) {
  const wall::State& wall = state.physical.world.wall;
  return wall::place(wall::weights(model.physical->world.wall, wall.topology, point), wall.motion);
}

const std::vector<uint32_t>& pieces_of(const Model& model, const State& state) {
  return physical::surface_of(model.physical->world, state.physical.world).piece;
}
uint32_t count_pieces(const Model& model, const State& state) {
  const std::vector<uint32_t>& piece = pieces_of(model, state);
  uint32_t count = 0;
  for (uint32_t c = 0; c < piece.size(); ++c) count += piece[c] == c;
  return count;
}

// Of the pieces beside the last cut: the lightest that nothing holds, with its mass and its center of mass.
void report_freed(const Model& model, State& state, size_t instrument, uint32_t face) {
  const wall::Model& m = model.physical->world.wall;
  const wall::State& wall = state.physical.world.wall;
  const wall::Topology& t = wall.topology;
  const std::vector<uint32_t>& piece = pieces_of(model, state);
  struct Piece {
    bool beside = false, held = false;
    float mass = 0;
    Vec3 moment;
  };
  std::vector<Piece> of(piece.size());
  for (uint32_t c = 0; c < piece.size(); ++c) {
    Piece& p = of[piece[c]];
    p.held = p.held || t.slot[c] == wall::kNone;
    p.mass += t.mass[c], p.moment += wall::vec3(wall.motion.x[2 * c]) * t.mass[c];
    const auto& corner = m.mesh.face[face];
    p.beside = p.beside || std::find(corner.begin(), corner.end(), t.source[c]) != corner.end();
  }
  const Piece* freed = nullptr;
  for (const Piece& p : of)
    if (p.beside && !p.held && p.mass > 0 && (!freed || p.mass < freed->mass)) freed = &p;
  if (!freed) return;
  Cutting& c = state.physical.cutting;
  const Vec3 center = freed->moment / freed->mass;
  if (freed->mass > c.freed_mass) c.freed_mass = freed->mass, c.freed_at = center;
  report(state, EventKind::piece_freed, instrument, c.pieces, freed->mass, center);
}

// What has come free has no supply: its vessels are empty.
void starve(const Model& model, State& state) {
  const wall::Topology& t = state.physical.world.wall.topology;
  const std::vector<uint32_t>& piece = pieces_of(model, state);
  std::vector<uint8_t> supplied(piece.size(), 0);
  for (uint32_t c = 0; c < piece.size(); ++c)
    if (t.slot[c] == wall::kNone) supplied[piece[c]] = 1;
  for (physical::Bleed& b : state.physical.cutting.excision.bleed)
    if (!supplied[piece[wall::weights(model.physical->world.wall, t, b.at).column[0]]]) b.open = 0;
}

// Sutures whose thread runs through a hole near a place that was cut through.
void watch_sutures(const Model& model, State& state, size_t instrument, const wall::Point& at) {
  const wall::Model& m = model.physical->world.wall;
  const thread::State& t = state.physical.world.thread;
  const Vec3 cut = wall::rest_place(m, at);
  for (const thread::Eyelet& e : t.eyelet) {
    const physical::Hole& hole = state.physical.world.hole[e.point];
    if (hole.out || length2(wall::rest_place(m, hole.place) - cut) > kBesideSuture * kBesideSuture) continue;
    const uint32_t suture = model.solver.strand_of(model.solver.tissue + e.segment);
    uint8_t& reported = state.physical.cutting.cut_at_suture[suture];
    if (!reported)
      report(state, EventKind::technique_fault, instrument, suture, 0, place_of(model, state, at), Fault::cut_at_suture);
    reported = 1;
  }
}

// A place where the wall is cut through now, and what is wrong with it.
void report_through(const Model& model, State& state, size_t instrument, const wall::Point& at, bool divided) {
  Cutting& c = state.physical.cutting;
  const uint32_t which = static_cast<uint32_t>(instrument);
  const float off = from_line(model, at);
  const auto fault = [&](Fault kind, float value) {
    report(state, EventKind::technique_fault, instrument, which, value, place_of(model, state, at), kind);
  };
  if (!c.stroke.through) report(state, EventKind::wall_cut_through, instrument, which, off, place_of(model, state, at));
  c.stroke.through = c.opened = true;
  if (off > kOffLine && !c.stroke.off_line) fault(Fault::cut_off_line, off);
  c.stroke.off_line = off > (c.stroke.off_line ? 0.8f : 1.0f) * kOffLine;
  if (off < 0 && cut_line(model.scene) && !c.stroke.inner && c.pieces <= model.scene.body.size())
    c.stroke.inner = true, fault(Fault::inner_wall_cut, 0);
  watch_sutures(model, state, instrument, at);
  if (!divided) return;
  const uint32_t before = c.pieces;
  c.pieces = count_pieces(model, state);
  if (c.pieces > before) report_freed(model, state, instrument, at.face), starve(model, state);
}

void switch_on(State& state, size_t instrument, PenMode mode) {
  Cutting& c = state.physical.cutting;
  c.mode[instrument] = mode;
  c.stroke = {state.tick, 0, false, false, false};
  report(state, EventKind::pen_activated, instrument, static_cast<uint32_t>(instrument),
         mode == PenMode::cut ? kCutPower : kCoagulatePower, state.physical.world.bodies.body[instrument].pose.p);
}
void switch_off(const Model& model, State& state, size_t instrument) {
  Cutting& c = state.physical.cutting;
  if (c.mode[instrument] == PenMode::off) return;
  const Vec3 tip = state.physical.world.bodies.body[instrument].pose.p;
  const uint32_t which = static_cast<uint32_t>(instrument);
  if (c.mode[instrument] == PenMode::cut && c.stroke.deepest > 0 && !c.stroke.through)
    report(state, EventKind::wall_scored, instrument, which, c.stroke.deepest, tip);
  c.mode[instrument] = PenMode::off;
  report(state, EventKind::pen_deactivated, instrument, which, static_cast<float>(state.tick - c.stroke.began) * model.dt, tip);
}

}  // namespace

Cutting start_cutting(const Model& model) {
  Cutting c;
  const std::vector<InstrumentModel>& kind = model.suture.instrument;
  if (std::none_of(kind.begin(), kind.end(), [](const InstrumentModel& k) { return k.can(kCutTissue); })) return c;
  c.mode.assign(kind.size(), PenMode::off), c.shut.assign(kind.size(), 1);
  c.pulled.assign(kind.size(), 0), c.cut_at_suture.assign(model.solver.strand.size(), 0);
  c.pieces = wall::count_pieces(model.physical->start.wall);
  return c;
}

bool cutting_fits(const Model& model, const Cutting& c) {
  if (c.mode.empty()) return start_cutting(model).mode.empty();
  const physical::Excision& e = c.excision;
  const wall::Model& wall = model.physical->world.wall;
  const size_t faces = wall.lane_of_face.size();
  const auto good = [&](const wall::Point& p) {
    return p.face < faces && std::abs(p.xi) <= 2 && std::abs(p.eta) <= 2 && std::abs(p.zeta) <= 1;
  };
  const auto good_groove = [&](const physical::Groove& g) {
    return g.face < faces && g.link < wall::raster(wall.mesh.face[g.face][3] != wall::kNone).links;
  };
  if (c.mode.size() != model.suture.instrument.size() || c.shut.size() != c.mode.size() || c.pulled.size() != c.mode.size() ||
      c.cut_at_suture.size() != model.solver.strand.size() || e.passed.size() != e.burnt.size() ||
      (!e.passed.empty() && e.passed.size() != faces) || e.heat.warmer.size() != e.heat.damage.size() ||
      (!e.heat.warmer.empty() && e.heat.warmer.size() != faces) || e.heat.warm.size() > faces)
    return false;
  for (size_t i = 0; i < e.heat.warm.size(); ++i)
    if (e.heat.warmer.empty() || e.heat.warm[i] >= faces || (i > 0 && e.heat.warm[i] <= e.heat.warm[i - 1])) return false;
  for (const PenMode mode : c.mode)
    if (mode > PenMode::coagulate) return false;
  if (e.passed.empty() && (!e.groove.empty() || !e.path.empty() || !e.bleed.empty() || e.touching)) return false;
  return e.groove.size() <= physical::kMaxGroove && e.path.size() <= physical::kMaxTipPath &&
         e.bleed.size() <= physical::kMaxBleed && (!e.touching || good(e.last)) &&
         std::all_of(e.path.begin(), e.path.end(), good) && std::all_of(e.groove.begin(), e.groove.end(), good_groove) &&
         std::all_of(e.bleed.begin(), e.bleed.end(), [&](const physical::Bleed& b) { return good(b.at); });
}

void switch_pens(const Model& model, State& state, TickInput& input) {
  Cutting& c = state.physical.cutting;
  if (c.mode.empty()) return;
  CommandList others;
  for (const Command& command : input.commands) {
    const bool toggles = command.kind == CommandKind::cut || command.kind == CommandKind::new_suture;
    const bool pedal = command.kind == CommandKind::set_pen && command.argument <= static_cast<int>(PenMode::coagulate);
    const PenMode wanted = pedal                              ? static_cast<PenMode>(command.argument)
                           : command.kind == CommandKind::cut ? PenMode::cut
                                                              : PenMode::coagulate;
    const bool known = (toggles || pedal) && command.hand < kMaxHands && input.hand[command.hand].connected;
    const int held = known ? state.hand[command.hand].instrument : -1;
    if (held < 0 || !model.suture.instrument[static_cast<size_t>(held)].can(kCauterize)) {
      others.push(command);
      continue;
    }
    const bool on = c.mode[static_cast<size_t>(held)] == wanted;
    if (pedal && on) continue;
    for (size_t i = 0; i < c.mode.size(); ++i) switch_off(model, state, i);
    if (!on && wanted != PenMode::off) switch_on(state, static_cast<size_t>(held), wanted);
  }
  input.commands = others;
  // A pen that was laid down, or whose hand is gone, is off.
  for (uint32_t i = 0; i < c.mode.size(); ++i) {
    const InstrumentState& tool = state.suture.instrument[i];
    if (tool.place != InstrumentPlace::hand || !input.hand[tool.hand].connected) switch_off(model, state, i);
  }
}

void use_pens(const Model& model, State& state, physical::Scratch& scratch, float h) {
  Cutting& c = state.physical.cutting;
  if (c.mode.empty()) return;
  physical::Pen pen;
  size_t active = 0;
  for (size_t i = 0; i < c.mode.size(); ++i) {
    if (c.mode[i] == PenMode::off) continue;
    active = i;
    pen.tip = state.physical.world.bodies.body[i].pose.p;
    pen.coagulate = c.mode[i] == PenMode::coagulate;
    pen.power = pen.coagulate ? kCoagulatePower : kCutPower;
  }
  const physical::PenStep did = use_pen(kExciseLaw, model.physical->world, state.physical.world, scratch, c.excision, pen, h);
  c.stroke.deepest = std::max(c.stroke.deepest, did.deepest);
  if (did.through > 0) report_through(model, state, active, did.at, did.cut.divided);
}

void use_scissors(const Model& model, State& state, physical::Scratch& scratch) {
  Cutting& c = state.physical.cutting;
  const physical::Model& m = model.physical->world;
  for (size_t i = 0; i < c.mode.size(); ++i) {
    const InstrumentModel& kind = model.suture.instrument[i];
    if (!kind.can(kCutTissue) || kind.can(kCauterize)) continue;
    const InstrumentState& tool = state.suture.instrument[i];
    if (tool.place != InstrumentPlace::hand) c.shut[i] = 1;
    else if (tool.jaw >= kind.jaw.open) c.shut[i] = 0;
    if (c.shut[i] || tool.jaw > kind.jaw.closed) continue;
    c.shut[i] = 1;
    // The blades meet along the tool's axis, from the pivot to the tips. What of it lies in the wall is divided.
    const Pose& pose = state.physical.world.bodies.body[i].pose;
    std::vector<wall::Point> path;
    physical::SnipStep did;
    bool cut = false, divided = false;
    const auto divide = [&] {
      if (path.size() > 1) {
        const physical::SnipStep part = snip(kExciseLaw, m, state.physical.world, scratch, c.excision, path);
        did.length += part.length, did.at = part.at, cut = cut || part.length > 0, divided = divided || part.cut.divided;
      }
      path.clear();
    };
    constexpr float kApart = 0.2e-3f, kBeside = 0.3e-3f;  // [m] between places; outside the wall, still between the blades
    for (float z = kind.body.capsule.front().b.z; z > 0; z -= kApart) {
      const Vec3 p = transform(pose, {0, 0, z});
      wall::Point at = physical::nearest_foot(m, state.physical.world, p, kBeside).point;
      at.zeta = 0;
      if (distance(place_of(model, state, at), p) < 0.5f * m.wall.laminate.thickness + kBeside) path.push_back(at);
      else divide();
    }
    divide();
    if (!cut) continue;
    const Stroke pen = c.stroke;
    c.stroke = {};
    report(state, EventKind::tissue_snipped, i, static_cast<uint32_t>(i), did.length, place_of(model, state, did.at));
    report_through(model, state, i, did.at, divided);
    c.stroke = pen;
  }
}

void watch_pulls(const Model& model, State& state) {
  Cutting& c = state.physical.cutting;
  const std::optional<CutLine> line = cut_line(model.scene);
  if (!c.opened || !line) return;
  if (std::any_of(c.mode.begin(), c.mode.end(), [](PenMode m) { return m != PenMode::off; })) return;  // traction while cutting
  const wall::Topology& t = state.physical.world.wall.topology;
  for (size_t i = 0; i < c.pulled.size(); ++i) {
    const physical::Body& body = state.physical.world.bodies.body[i];
    if (body.grip.what != physical::Gripped::tissue) c.pulled[i] = 0;
    if (body.grip.what != physical::Gripped::tissue || c.pulled[i]) continue;
    const float force = length(body.hand_force);
    const wall::Point& held = body.grip.point[0].tissue;
    if (force < kPulledForce || from_line(model, held) < 0 || from_rim(*line, model, held) > line->from_rim) continue;
    // Attached: its piece of the wall is one with tissue that is held in place.
    const std::vector<uint32_t>& piece = pieces_of(model, state);
    const uint32_t own = piece[wall::weights(model.physical->world.wall, t, held).column[0]];
    bool attached = false;
    for (uint32_t k = 0; k < piece.size() && !attached; ++k) attached = piece[k] == own && t.slot[k] == wall::kNone;
    if (!attached) continue;
    c.pulled[i] = 1;
    report(state, EventKind::technique_fault, i, static_cast<uint32_t>(i), force, body.pose.p, Fault::pulled_attached);
  }
}

std::optional<CutLine> cut_line(const SceneSpec& scene) {
  if ((scene.surgeon.plan != "excision" && scene.surgeon.plan != "altemeier") || scene.body.empty()) return {};
  return CutLine{scene.body.front().position, normalized(scene.body.front().axis), scene.surgeon.edge_distance};
}

bool is_charred(const Model& model, const State& state, const wall::Point& point) {
  return burnt_at(model.physical->world, state.physical.cutting.excision, point) > kCharred;
}

}  // namespace catgut
