// SPDX-License-Identifier: Apache-2.0
// sim/hands: hands and the instruments they have. Reads TickInput; writes State::hand, the place and hand of every
// InstrumentState, and the welds that hold instruments. What the jaws of an instrument do is suture/grasp's.
#pragma once
#include "exchange/tool_input.h"

namespace catgut {

struct Model;
struct State;

// Places every instrument as the scene has it at the start: in a hand, on the tray, or parked on tissue.
void lay_out_instruments(const Model& model, State& state);
// Once a tick, before everything else. A hand that appears is taken over where it is: its instrument is placed there, not
// dragged there through the tissue.
void meet_hands(State& state, const TickInput& input);
// Once a tick: take, swap, lay_down, park and unpark, in their order. Each is reported as an event; one that cannot be carried
// out (hand not empty or not connected, instrument in use or out of reach, not a clamp, nothing held) is instrument_refused.
void handle_instruments(const Model& model, State& state, const TickInput& input);
// Before every substep: an instrument follows its hand through a spring. Between two ticks the hand moves evenly: at `part`
// (0..1) of the tick.
void follow_hands(const Model& model, State& state, const TickInput& input, float part);
// At the end of a tick: remembers where the hands are.
void remember_hands(State& state, const TickInput& input);

}  // namespace catgut
