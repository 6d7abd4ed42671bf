// SPDX-License-Identifier: Apache-2.0
// exchange: what can be seen and measured of the thread in a Snapshot: how long a piece of it is, which strand lies where. For
// callers that handle it: the scripted surgeon, the help that hands without hardware get.
#pragma once
#include <cstddef>
#include <cstdint>

#include "exchange/snapshot.h"

namespace catgut {

// Everything but the next two is of the active suture. Places along its thread_order.
size_t node_of(const Snapshot& seen, uint32_t slot);
Vec3 node_at(const Snapshot& seen, size_t node);
// [m] along the thread as it lies, between two nodes (in any order).
float length_between(const Snapshot& seen, size_t a, size_t b);
// The node `far` [m] along the thread from node `from`, toward the needle (way = 1) or the free end (way = -1); stops at an end
// or where the thread was cut.
size_t node_along(const Snapshot& seen, size_t from, float far, int way);
// Suture points of all sutures, one suture after the other.
size_t suture_point_count(const Snapshot& seen);
const SuturePointView& suture_point_at(const Snapshot& seen, size_t i);
// [N] in the thread's last pair, at the needle: what a hand that holds the needle feels of its strand.
float needle_tension(const Snapshot& seen);
uint32_t locked_throws(const Snapshot& seen);  // of the suture in hand; not those that are not yet set
// The first and the last suture point's nodes; both 0 when there is none.
size_t first_point_node(const Snapshot& seen);
size_t last_point_node(const Snapshot& seen);

}  // namespace catgut
