// surgeon/sight: what a surgeon can see and measure of the field, from the Snapshot alone: where a place of the tissue is now,
// how long a piece of thread is, which strand lies where.
#pragma once
#include <vector>

#include "exchange/picture.h"
#include "exchange/snapshot.h"

namespace catgut {

// Where the place that was at `rest` [m] is now, by the nearest particles of wall `wall`; turned (may be null): how the tissue
// there has turned.
Vec3 live_place(const PictureModel& picture, const Snapshot& seen, Vec3 rest, uint32_t wall, Quat* turned);

// An opening at rest: centre, the way out of it, mean radius, length round.
struct OpeningShape {
  Vec3 centre, axis;
  float radius = 0, round = 0;  // [m]
};
OpeningShape opening_shape(const PictureModel& picture, uint32_t wall);

// Places along Snapshot::thread_order.
size_t node_of(const Snapshot& seen, uint32_t slot);
Vec3 node_at(const Snapshot& seen, size_t node);
// [m] along the thread as it lies, between two nodes (in any order).
float length_between(const Snapshot& seen, size_t a, size_t b);
// The node `far` [m] along the thread from node `from`, toward the needle (way = 1) or the free end (way = -1); stops at an end
// or where the thread was cut.
size_t node_along(const Snapshot& seen, size_t from, float far, int way);
// [N] in the thread's last pair, at the needle: what a hand that holds the needle feels of its strand.
float needle_tension(const Snapshot& seen);
uint32_t locked_throws(const Snapshot& seen);  // of all knots of the suture in hand; not those that are not yet set
// The first and the last suture point's nodes; both 0 when there is none.
size_t first_point_node(const Snapshot& seen);
size_t last_point_node(const Snapshot& seen);

}  // namespace catgut
