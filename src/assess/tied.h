// SPDX-License-Identifier: Apache-2.0
// assess: knots of physical mechanics. There a throw is not locked by an event: a knot is the shape of the thread. Reads a
// Snapshot, names the knot by thread/observe; docs/assessment.md, "Knots of physical mechanics".
#pragma once
#include <vector>

#include "assess/result.h"
#include "exchange/picture.h"
#include "exchange/snapshot.h"

namespace catgut::assess {

// At most one knot per suture, as it lies now: tick and moments are those of the Snapshot; tension and duration of its throws
// are kNotObserved. The gap of the first throw is half of the loop's length beyond the tight one: along the thread from the
// first suture point to the last, and straight back. Tens of milliseconds: for the end of a session.
std::vector<Knot> tied_knots(const PictureModel& picture, const Snapshot& seen);

}  // namespace catgut::assess
