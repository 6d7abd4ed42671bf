// SPDX-License-Identifier: Apache-2.0
// exchange: a box for the newest value, between one writer and one reader that never wait for each other: three slots, of which
// the writer fills one, the reader looks at one, and the third is the newest that was finished. What the reader did not come
// for in time is written over: newest wins. (What must not be lost goes through exchange/ring.)
//
// No allocation and no lock. A payload with vectors keeps their memory from one round to the next: fill the draft again instead
// of building another.
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

  // Writer only. The draft holds whatever was published two or three rounds ago; publish() makes it the newest and gives
  // another one.
  T& draft() { return slot_[draft_]; }
  void publish() { draft_ = middle_.exchange(draft_ | kFresh, std::memory_order_acq_rel) & kSlot; }

  // Reader only. Turns to the newest value; false when there is none since the last call. seen() stays valid, and unchanged,
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
  alignas(64) std::atomic<uint32_t> middle_{1};  // slot, and whether the reader has not had it yet
  alignas(64) uint32_t seen_ = 2;                // of the reader
};

}  // namespace catgut
