// SPDX-License-Identifier: Apache-2.0
// sim/stitch_pull: what a stitch holds, tried on a copy of the state. Physical mechanics.
#pragma once
#include <cstddef>

#include "core/jobs.h"

namespace catgut {

struct Model;
struct State;

struct StitchPull {
  float slip = 0;  // [m] by which its holes in the two walls move apart while the force stays: a knot that holds gives nothing
  float tension = 0;  // [N] largest of the thread between its first and its last hole, at the end; 0 if it lost a hole
};
// With all hands away, the two walls are pulled apart at the holes of this suture. The force on either wall grows to `force`
// [N] in half a second. The walls follow for a quarter, and the slip is measured in one second more. Walls are those of
// SuturePointView; with one wall, the first half of the holes is pulled from the second. The suture has two holes at least.
StitchPull pull_stitch(const Model& model, const State& state, size_t suture, float force, Jobs& jobs);

}  // namespace catgut
