// SPDX-License-Identifier: Apache-2.0
// device: a 1 kHz timer for backends whose library has no scheduler of its own.
#pragma once
#include <pthread.h>

#include <chrono>
#include <thread>

namespace catgut {

// Real-time priority for the calling thread, if permitted. Not an error otherwise.
inline void go_first() {
  sched_param first{};
  first.sched_priority = 50;
  pthread_setschedparam(pthread_self(), SCHED_FIFO, &first);
}

struct Beat {
  std::chrono::steady_clock::time_point next = std::chrono::steady_clock::now();
  // Until the next millisecond. Missed ones are skipped: a hand cannot use ten samples at once.
  void wait() {
    next += std::chrono::milliseconds(1);
    const auto now = std::chrono::steady_clock::now();
    if (next < now) next = now;
    else std::this_thread::sleep_until(next);
  }
};

}  // namespace catgut
