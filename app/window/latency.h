// SPDX-License-Identifier: Apache-2.0
// app/window: how long it takes from a hand's motion to what came of it.
#pragma once
#include <cstdint>
#include <vector>

#include "runtime/live.h"

namespace catgut {

struct Latency {
  // After a picture of `status` has been handed to the driver.
  void picture(const LiveStatus& status);
  // A table on standard error: motion read -> tick that has it begins -> its snapshot is ready -> its picture is handed over.
  void report(int pictures, double seconds) const;

 private:
  uint64_t shown_ns_ = 0;
  std::vector<float> to_tick_ms_, in_tick_ms_, to_picture_ms_, all_ms_;
};

}  // namespace catgut
