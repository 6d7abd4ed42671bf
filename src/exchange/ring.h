// SPDX-License-Identifier: Apache-2.0
// exchange: a wait-free queue of fixed size between one writer and one reader. It never drops an element:
// when it is full, push() returns false and the writer decides. For commands and events; poses use exchange/latest.
#pragma once
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace catgut {

template <typename T, size_t kSize>
class Ring {
  static_assert(kSize > 0 && (kSize & (kSize - 1)) == 0, "a power of two");

 public:
  // Writer only. False: the queue is full and the value was not added.
  bool push(const T& value) {
    const uint64_t put = put_.load(std::memory_order_relaxed);
    if (put - taken_.load(std::memory_order_acquire) == kSize) return false;
    slot_[put % kSize] = value;
    put_.store(put + 1, std::memory_order_release);
    return true;
  }

  // Reader only. False: the queue is empty.
  bool pop(T& value) {
    const uint64_t taken = taken_.load(std::memory_order_relaxed);
    if (taken == put_.load(std::memory_order_acquire)) return false;
    value = slot_[taken % kSize];
    taken_.store(taken + 1, std::memory_order_release);
    return true;
  }

 private:
  std::array<T, kSize> slot_{};
  alignas(64) std::atomic<uint64_t> put_{0};    // written by the writer only
  alignas(64) std::atomic<uint64_t> taken_{0};  // written by the reader only
};

}  // namespace catgut
