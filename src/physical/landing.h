// SPDX-License-Identifier: Apache-2.0
// physical/landing: the end of a step. The thread was stepped before lips and bodies moved the wall and contacts moved a loose
// needle; a tool's contacts are planes, and it has turned or slid beyond them. Where one has landed in another by more than a
// tolerance, it is put outside again: the thread out of wall, needle and tools, a tool out of the wall. Its velocity stays.
// Reads the step's contacts; moves nodes and tools, by half a millimeter at most. Below the tolerance nothing changes.
#pragma once
#include "physical/physical.h"

namespace catgut::physical {

// [m] of overlap that is left to the next step's contacts: of thread in the wall, of thread in a body, of a tool in the wall.
constexpr float kThreadLands = 0.1e-3f, kOnBodyLands = 0.05e-3f, kToolLands = 0.15e-3f;
constexpr float kBetweenLands = 0.2e-3f;  // [m] of thread in a jaw on its inner side
constexpr float kOverLands = 0.25e-3f;    // [m] of a wall in jaws that stand over it
constexpr float kFarthestOut = 0.5e-3f;   // [m] at once

// Before what jaws hold is looked at.
void put_tools_out(const Model& model, State& state, const Scratch& scratch);
// Last of all.
void put_thread_out(const Model& model, State& state, Scratch& scratch, const Hands& hands);

}  // namespace catgut::physical
