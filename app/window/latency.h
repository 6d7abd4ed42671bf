// SPDX-License-Identifier: Apache-2.0
// app/window: latency from a hand's motion to its image.
#pragma once
#include <cstdint>
#include <vector>

#include "runtime/live.h"

namespace catgut {

struct Latency {
  // After a frame of `status` has been submitted to the driver.
  void picture(const LiveStatus& status);
  // A table on standard error: motion read -> start of the tick that has it -> its snapshot ready -> its frame submitted.
  void report(int pictures, double seconds) const;

 private:
  uint64_t shown_ns_ = 0;
  std::vector<float> to_tick_ms_, in_tick_ms_, to_picture_ms_, all_ms_;
};

}  // namespace catgut
