// SPDX-License-Identifier: Apache-2.0
// physical/lacing: the thread follows its needle into the holes. When the swage has passed a hole of a channel, the thread gets
// an Eyelet there. Reads channels; writes State::hole and the thread's eyelets.
#pragma once
#include "physical/physical.h"

namespace catgut::physical {

// At the end of a step, for every needle with a thread.
void lace_threads(const Model& model, State& state);

}  // namespace catgut::physical
