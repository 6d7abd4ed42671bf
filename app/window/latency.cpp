// app/window: see latency.h.
#include "window/latency.h"

#include <algorithm>
#include <cstdio>

#include "runtime/tally.h"

namespace catgut {

void Latency::picture(const LiveStatus& s) {
  const uint64_t newest = std::max(s.input_time_ns[0], s.input_time_ns[1]);
  if (newest == 0 || newest == shown_ns_) return;
  shown_ns_ = newest;
  to_tick_ms_.push_back(s.hand_to_tick_ms);
  to_picture_ms_.push_back(static_cast<float>(wall_ns() - newest) * 1e-6f);
}

void Latency::report(int pictures, double seconds) const {
  std::fprintf(stderr, "catgut: %d pictures in %.1f s\n", pictures, seconds);
  if (to_picture_ms_.empty()) return;
  const Spread tick = spread_of(to_tick_ms_), picture = spread_of(to_picture_ms_);
  std::fprintf(
      stderr,
      "catgut: from reading a motion to the end of its tick %.1f ms, to its picture being drawn %.1f ms (medians of %zu; "
      "99 %%: %.1f, %.1f)\n",
      tick.median, picture.median, to_picture_ms_.size(), tick.p99, picture.p99);
}

}  // namespace catgut
