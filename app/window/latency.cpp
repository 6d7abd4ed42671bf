// SPDX-License-Identifier: Apache-2.0
// app/window: see latency.h.
#include "window/latency.h"

#include <algorithm>
#include <cstdio>

#include "runtime/metrics_collector.h"

namespace catgut {

void Latency::picture(const LiveStatus& s) {
  if (s.moved_ns == 0 || s.moved_ns == shown_ns_) return;
  shown_ns_ = s.moved_ns;
  const auto ms = [](uint64_t from, uint64_t to) { return to > from ? static_cast<float>(to - from) * 1e-6f : 0.0f; };
  const uint64_t now = wall_ns();
  to_tick_ms_.push_back(ms(s.moved_ns, s.began_ns));
  in_tick_ms_.push_back(ms(s.began_ns, s.ready_ns));
  to_picture_ms_.push_back(ms(s.ready_ns, now));
  all_ms_.push_back(ms(s.moved_ns, now));
}

void Latency::report(int pictures, double seconds) const {
  std::fprintf(stderr, "catgut: %d frames in %.1f s\n", pictures, seconds);
  if (all_ms_.empty()) return;
  std::fprintf(stderr, "catgut: latency [ms] of %zu motions   median     99 %%    worst\n", all_ms_.size());
  const auto row = [](const char* name, const std::vector<float>& v) {
    const Percentiles s = percentiles_of(v);
    std::fprintf(stderr, "catgut:   %-26s %8.1f %8.1f %8.1f\n", name, s.median, s.p99, s.max);
  };
  row("input -> tick", to_tick_ms_);
  row("tick -> snapshot", in_tick_ms_);
  row("snapshot -> frame", to_picture_ms_);
  row("input -> frame", all_ms_);
}

}  // namespace catgut
