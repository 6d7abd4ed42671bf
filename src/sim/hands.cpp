// SPDX-License-Identifier: Apache-2.0
// sim/hands: see the header.
#include "sim/hands.h"

#include <algorithm>

#include "sim/clamps.h"
#include "sim/model.h"
#include "sim/state.h"

namespace catgut {
namespace {

constexpr float kOpenWeld = -1;  // Weld::compliance of an instrument without a hand
// [m] from the hand to the grasp point of a parked instrument that it takes. The handles are a shaft's length away from
// the jaws. Chosen.
constexpr float kReach = 0.15f;
// [m] between grasp points: nearer to a parked instrument, a hand has no room for another one. Chosen.
constexpr float kRoom = 0.02f;

void place_at(RigidBody& body, const Pose& pose) {
  body = {};
  body.x = body.prev_x = pose.p;
  body.q = body.prev_q = pose.q;
}

void report(State& state, EventKind kind, uint8_t hand, size_t instrument, float value = 0) {
  const bool known = instrument < state.suture.instrument.size();
  state.event.add({kind, hand, static_cast<uint32_t>(instrument), value,
                   known ? state.solver.body[instrument].x : state.hand[hand].pose.p});
}

void put_on_tray(const Model& model, State& state, size_t i) {
  state.suture.instrument[i] = {};
  state.solver.weld[i].target = model.tray[i];
  state.solver.weld[i].compliance = model.hand_compliance;
  state.solver.weld[i].local_a = {};
  state.solver.body_collides[i] = 0;
  state.solver.body_force[i] = {};
  place_at(state.solver.body[i], model.tray[i]);
}

// `pose`: the pose of the instrument at that moment; its offset in the hand's frame is kept.
void put_in_hand(State& state, size_t i, size_t hand, const Pose& pose, float jaw) {
  HandState& h = state.hand[hand];
  InstrumentState& tool = state.suture.instrument[i];
  h.instrument = static_cast<int>(i);
  h.grip = h.pose == pose ? Pose{} : inverse(h.pose) * pose;
  tool.place = InstrumentPlace::hand;
  tool.hand = static_cast<uint8_t>(hand);
  tool.latched = tool.held == Held::tissue;
  tool.jaw = tool.latched ? tool.jaw : jaw;
  state.solver.weld[i].local_a = h.grip == Pose{} ? Pose{} : inverse(h.grip);
  state.solver.body_force[i] = {};
}

// Its weight, or the pull of its cord, which slackens as the instrument goes with it.
void load_parked(const Model& model, State& state, size_t i) {
  const Cord& cord = model.cord[i];
  const Vec3 weight = model.solver.gravity / model.solver.body[i].inv_mass;
  const float gone = dot(state.solver.body[i].x - state.suture.instrument[i].parked_at, normalized(cord.pull, {}));
  const float slack = length2(cord.pull) == 0 ? 1 : cord.stretch > 0 ? std::clamp(gone / cord.stretch, 0.0f, 1.0f) : 0;
  state.solver.body_force[i] = lerp(cord.pull, weight, slack);
}

void park_here(const Model& model, State& state, size_t i) {
  InstrumentState& tool = state.suture.instrument[i];
  tool.place = InstrumentPlace::parked;
  tool.hand = kNoHand;
  tool.jaw = 0;
  state.solver.weld[i].compliance = kOpenWeld;
  state.solver.body_collides[i] = 1;
  tool.parked_at = state.solver.body[i].x;
  load_parked(model, state, i);
}

void lay_down(const Model& model, State& state, size_t hand) {
  const size_t i = static_cast<size_t>(state.hand[hand].instrument);
  SutureContext sewing{model.solver, state.solver, state.scratch, model.suture, state.suture, state.event};
  release(sewing, static_cast<uint32_t>(i), 0);
  if (state.suture.loop[i].wraps > 0) {
    release_loop(sewing, static_cast<uint32_t>(i));
    report(state, EventKind::loop_released, static_cast<uint8_t>(hand), 0);
  }
  report(state, EventKind::instrument_laid_down, static_cast<uint8_t>(hand), i);
  put_on_tray(model, state, i);
  state.hand[hand].instrument = -1;
  state.hand[hand].grip = {};
}

bool has_room(const State& state, const HandState& hand) {
  for (size_t p = 0; p < state.suture.instrument.size(); ++p)
    if (state.suture.instrument[p].place == InstrumentPlace::parked && distance(state.solver.body[p].x, hand.pose.p) < kRoom)
      return false;
  return true;
}

// A clamp that an assistant has closed on tissue.
bool is_held_by_assistant(const State& state, size_t i) {
  if (i >= state.suture.instrument.size()) return false;
  const InstrumentState& tool = state.suture.instrument[i];
  return tool.place == InstrumentPlace::hand && tool.hand >= 2 && tool.held == Held::tissue;
}

bool carry_out(const Model& model, State& state, const TickInput& input, const Command& c) {
  if (c.kind == CommandKind::cut || c.kind == CommandKind::new_suture) return true;  // stages of their own
  if (moves_clamp(c.kind)) return has_clamp(model, c.argument);                      // before each step
  const size_t hand = c.hand, i = c.argument;
  if (hand >= kMaxHands || !input.hand[hand].connected) return false;
  HandState& h = state.hand[hand];
  const auto is_at = [&](InstrumentPlace place) {
    return i < state.suture.instrument.size() && state.suture.instrument[i].place == place;
  };
  const auto take = [&](const Pose& pose) {
    put_in_hand(state, i, hand, pose, input.hand[hand].jaw);
    state.solver.body_collides[i] = 1;
    report(state, EventKind::instrument_taken, c.hand, i);
    return true;
  };
  switch (c.kind) {
    case CommandKind::take:
    case CommandKind::unpark:
      if (h.instrument >= 0) return false;
      if (is_at(InstrumentPlace::parked) || (c.kind == CommandKind::unpark && is_held_by_assistant(state, i))) {
        const Pose pose = state.solver.body[i].pose();
        if (distance(pose.p, h.pose.p) > kReach) return false;
        if (is_at(InstrumentPlace::hand)) state.hand[state.suture.instrument[i].hand].instrument = -1;
        return take(pose);
      }
      if (c.kind == CommandKind::unpark || !is_at(InstrumentPlace::tray) || !has_room(state, h)) return false;
      place_at(state.solver.body[i], h.pose);
      return take(h.pose);
    case CommandKind::swap:
      if (!is_at(InstrumentPlace::tray) || !has_room(state, h)) return false;
      if (h.instrument >= 0) lay_down(model, state, hand);
      place_at(state.solver.body[i], h.pose);
      return take(h.pose);
    case CommandKind::lay_down:
      if (h.instrument < 0) return false;
      lay_down(model, state, hand);
      return true;
    case CommandKind::park: {
      if (h.instrument < 0) return false;
      const size_t own = static_cast<size_t>(h.instrument);
      if (!model.suture.instrument[own].can(kClamp) || state.suture.instrument[own].held == Held::nothing) return false;
      park_here(model, state, own);
      h.instrument = -1;
      h.grip = {};
      report(state, EventKind::instrument_parked, c.hand, own);
      return true;
    }
    default:
      return c.kind == CommandKind::none;  // handled by another stage
  }
}

}  // namespace

void lay_out_instruments(const Model& model, State& state) {
  const size_t n = model.solver.instruments();
  state.suture.instrument.assign(n, {});
  state.suture.loop.assign(n, {});
  for (size_t i = 0; i < n; ++i) {
    Weld w;
    w.a = static_cast<int>(i);
    state.solver.weld.push_back(w);
    put_on_tray(model, state, i);
  }
  for (size_t k = 0; k < kMaxHands; ++k) {
    state.hand[k].pose = model.hand_start[k];
    if (model.hand_instrument[k] < 0) continue;
    const size_t i = static_cast<size_t>(model.hand_instrument[k]);
    place_at(state.solver.body[i], model.hand_start[k]);
    put_in_hand(state, i, k, model.hand_start[k], 1);
    state.solver.weld[i].target = model.hand_start[k];
  }
  for (const ParkedStart& p : model.parked) {
    place_at(state.solver.body[p.instrument], p.pose);
    Attachment a;
    a.point = p.point;
    a.body = static_cast<int>(p.instrument);
    a.compliance = model.suture.tissue_compliance;
    state.solver.attach.push_back(a);
    state.suture.instrument[p.instrument].held = Held::tissue;
    state.suture.instrument[p.instrument].slot = p.particle;
    park_here(model, state, p.instrument);
  }
}

void drop_instrument(const Model& model, State& state, size_t i) { put_on_tray(model, state, i); }

void meet_hands(State& state, const TickInput& input) {
  for (size_t k = 0; k < kMaxHands; ++k) {
    HandState& hand = state.hand[k];
    const bool connected = input.hand[k].connected != 0;
    if (hand.instrument >= 0) state.solver.body_collides[static_cast<size_t>(hand.instrument)] = connected;
    if (!connected || hand.known) continue;
    hand.known = 1;
    hand.pose = input.hand[k].pose;
    // A product with zero grip would round the hand's orientation.
    if (hand.instrument >= 0)
      place_at(state.solver.body[static_cast<size_t>(hand.instrument)],
               hand.grip == Pose{} ? hand.pose : hand.pose * hand.grip);
  }
}

void handle_instruments(const Model& model, State& state, const TickInput& input) {
  for (const Command& c : input.commands)
    if (!carry_out(model, state, input, c)) {
      const auto hand = static_cast<uint8_t>(c.hand % kMaxHands);
      const bool from_tray = c.kind == CommandKind::take || c.kind == CommandKind::swap;
      report(state, EventKind::instrument_refused, hand, c.argument, from_tray && !has_room(state, state.hand[hand]) ? 1 : 0);
    }
  for (size_t i = 0; i < state.suture.instrument.size(); ++i)
    if (state.suture.instrument[i].place == InstrumentPlace::parked) load_parked(model, state, i);
}

void follow_hands(const Model& model, State& state, const TickInput& input, float part) {
  for (size_t k = 0; k < kMaxHands; ++k) {
    if (state.hand[k].instrument < 0) continue;
    const Pose& from = state.hand[k].pose;
    const Pose& to = input.hand[k].connected ? input.hand[k].pose : from;
    Weld& weld = state.solver.weld[static_cast<size_t>(state.hand[k].instrument)];
    weld.target = {lerp(from.p, to.p, part), nlerp(from.q, to.q, part)};
    weld.compliance = model.hand_compliance;
    weld.angular_compliance = model.hand_angular_compliance;
  }
}

void remember_hands(State& state, const TickInput& input) {
  for (size_t k = 0; k < kMaxHands; ++k)
    if (input.hand[k].connected) state.hand[k].pose = input.hand[k].pose;
}

}  // namespace catgut
