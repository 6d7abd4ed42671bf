// SPDX-License-Identifier: Apache-2.0
// physical/quiet: whether a strand of the thread has been quiet for its window, and may sleep (physical/sleep). Reads what
// Sleep noted at the beginning of the window, the thread and the wall.
#pragma once
#include "physical/carry.h"

namespace catgut::physical {

// Beside a motion of the wall: no node has moved, and no tension has changed, by more than SleepModel allows.
bool is_quiet(const Model& model, const State& state, uint32_t strand, const Carry& by);
// The same of a tied loop with slack (SleepModel::slack).
bool is_slack_and_quiet(const Model& model, const State& state, uint32_t strand, const Carry& by);
// No tension of the strand is above SleepModel::slack.
bool is_slack(const Model& model, const thread::State& thread, const Sleep::Strand& strand);
// Whether it touches itself beyond its outer holes.
bool has_knot(const thread::State& thread, const Sleep::Strand& strand);
// How far [m] nodes of the knot are from where a rigid motion of the knot has taken them since `from` (root mean square: nodes
// tremble by themselves): thread that slips through it, or a knot that is drawn tight. No knot: 1.
float knot_change(const thread::State& thread, const Sleep::Strand& strand, std::span<const Vec3> from);
// [m] From hole to hole along the strand, and from the last one back to the first.
float loop_length(const Model& model, const State& state, uint32_t strand);

}  // namespace catgut::physical
