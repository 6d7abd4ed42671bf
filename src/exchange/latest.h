// SPDX-License-Identifier: Apache-2.0
// exchange: a wait-free triple buffer for the newest value, between one writer and one reader. The writer fills one slot, the
// reader reads another, and the third has the newest complete value. Values that the reader did not fetch in time are
// overwritten. (Data that must not be lost goes through exchange/ring.)
//
// No allocation and no lock. A payload with vectors keeps their memory between rounds: refill the draft instead of building
// a new one.
#pragma once
#include <array>
#include <atomic>
#include <cstdint>

namespace catgut {

template <typename T>
class Latest {
 public:
  Latest() = default;
  explicit Latest(const T& start) { slot_.fill(start); }
  Latest(const Latest&) = delete;
  Latest& operator=(const Latest&) = delete;

  // Writer only. The draft holds a value published two or three rounds ago; publish() makes it the newest and returns
  // another one.
  T& draft() { return slot_[draft_]; }
  void publish() { draft_ = middle_.exchange(draft_ | kFresh, std::memory_order_acq_rel) & kSlot; }

  // Reader only. Fetches the newest value; false if there is none since the last call. seen() stays valid and unchanged
  // until the next call.
  bool update() {
    if (!(middle_.load(std::memory_order_relaxed) & kFresh)) return false;
    seen_ = middle_.exchange(seen_, std::memory_order_acq_rel) & kSlot;
    return true;
  }
  const T& seen() const { return slot_[seen_]; }

 private:
  static constexpr uint32_t kSlot = 3, kFresh = 4;
  static_assert(std::atomic<uint32_t>::is_always_lock_free);
  std::array<T, 3> slot_{};
  alignas(64) uint32_t draft_ = 0;               // of the writer
  alignas(64) std::atomic<uint32_t> middle_{1};  // slot, and whether it is unread
  alignas(64) uint32_t seen_ = 2;                // of the reader
};

}  // namespace catgut
