// SPDX-License-Identifier: Apache-2.0
// exchange: measures of the thread in a Snapshot: the length of a piece, the arrangement of strands. For the scripted surgeon
// and for assisted hands.
#pragma once
#include <cstddef>
#include <cstdint>

#include "exchange/snapshot.h"

namespace catgut {

// All but four refer to the active suture. Positions along its thread_order.
size_t node_of(const Snapshot& seen, uint32_t slot);
Vec3 node_at(const Snapshot& seen, size_t node);
// [m] path length along the thread between two nodes (in any order).
float length_between(const Snapshot& seen, size_t a, size_t b);
// The node `far` [m] along the thread from node `from`, toward the needle (way = 1) or the free end (way = -1). Stops at an end
// or at a cut.
size_t node_along(const Snapshot& seen, size_t from, float far, int way);
// Suture points of all sutures, one suture after the other.
size_t suture_point_count(const Snapshot& seen);
const SuturePointView& suture_point_at(const Snapshot& seen, size_t i);
// The thread is cut between its last hole and the needle: the stitch is finished.
bool is_cut_off(const SutureView& suture);
// [N] in the thread's last pair, at the needle: the load of a hand that holds the needle.
float needle_tension(const Snapshot& seen);
// [N] largest tension of all threads, without the first `skip` segments of the active suture. Above what a hand holds itself it
// says that its jaws hold a strand of a stitch too.
float largest_tension(const Snapshot& seen, size_t skip);
uint32_t locked_throws(const Snapshot& seen);  // of the active suture; not those that are not locked yet
// The first and the last suture point's nodes; both 0 when there is none.
size_t first_point_node(const Snapshot& seen);
size_t last_point_node(const Snapshot& seen);
// [m] middle of what tail and strand have in contact near `stitch`: the knot. `stitch` if they do not touch there.
Vec3 knot_center(const Snapshot& seen, Vec3 stitch);

}  // namespace catgut
