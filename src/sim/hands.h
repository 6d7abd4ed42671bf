// SPDX-License-Identifier: Apache-2.0
// sim/hands: hands and the instruments they hold. Reads TickInput; writes State::hand, the pose and hand of every
// InstrumentState, and the welds that hold instruments. suture/grasp handles the jaws.
#pragma once
#include "exchange/tool_input.h"

namespace catgut {

struct Model;
struct State;

// Places every instrument as the scene defines: in a hand, on the tray, or parked on tissue.
void lay_out_instruments(const Model& model, State& state);
// Once per tick, before everything else. When a hand connects, its instrument is placed at the hand's pose; it is not
// dragged there through the tissue.
void meet_hands(State& state, const TickInput& input);
// Once per tick: processes take, swap, lay_down, park and unpark in order, and loads what is parked. Each emits an event. A
// command that is invalid (hand not empty or not connected, instrument in use or out of reach, not a clamp, nothing held) emits
// instrument_refused.
void handle_instruments(const Model& model, State& state, const TickInput& input);
// Without a hand it falls: it is back on its tray, open.
void drop_instrument(const Model& model, State& state, size_t instrument);
// Before every substep: an instrument follows its hand through a spring. `part` (0..1) is the fraction of the tick; the hand
// pose is interpolated linearly over the tick.
void follow_hands(const Model& model, State& state, const TickInput& input, float part);
// At the end of a tick: stores the hand poses.
void remember_hands(State& state, const TickInput& input);

}  // namespace catgut
