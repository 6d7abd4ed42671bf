// app/window: how long it takes from a hand's motion to what came of it.
#pragma once
#include <cstdint>
#include <vector>

#include "runtime/live.h"

namespace catgut {

struct Latency {
  // After a picture of `status` has been handed to the driver.
  void picture(const LiveStatus& status);
  void report(int pictures, double seconds) const;  // a line or two on standard error

 private:
  uint64_t shown_ns_ = 0;
  std::vector<float> to_tick_ms_, to_picture_ms_;
};

}  // namespace catgut
