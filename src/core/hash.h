// SPDX-License-Identifier: Apache-2.0
// core/hash: the 64-bit hash (XXH3) of a state, a chunk of a recording or a cache key. Same bits on every machine.
#pragma once
// By memcpy: other methods read through a pointer of another type; when inlined into code that wrote floats, GCC may reorder
// the read.
#define XXH_FORCE_MEMORY_ACCESS 0
#define XXH_INLINE_ALL
#include <xxhash.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace catgut {

inline uint64_t hash_bytes(const void* data, size_t bytes, uint64_t seed = 0) {
  return XXH3_64bits_withSeed(data, bytes, seed);
}

// The same for bytes in pieces of any size.
class Hasher {
 public:
  Hasher() { XXH3_64bits_reset(&state_); }
  void bytes(const void* data, size_t count) {
    if (count > buffer_.size() - used_) flush();
    if (count > buffer_.size()) {
      XXH3_64bits_update(&state_, data, count);
      return;
    }
    std::memcpy(buffer_.data() + used_, data, count);
    used_ += count;
  }
  uint64_t digest() {
    flush();
    return XXH3_64bits_digest(&state_);
  }

 private:
  void flush() {
    XXH3_64bits_update(&state_, buffer_.data(), used_);
    used_ = 0;
  }
  XXH3_state_t state_;
  std::array<std::byte, 1024> buffer_;  // most pieces are single numbers
  size_t used_ = 0;
};

}  // namespace catgut
