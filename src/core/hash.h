// core/hash: the 64-bit hash (XXH3) that stamps a state, a chunk of a recording or a cache key. Same bits on every machine.
#pragma once
#define XXH_INLINE_ALL
#include <xxhash.h>

#include <cstddef>
#include <cstdint>

namespace catgut {

inline uint64_t hash_bytes(const void* data, size_t bytes, uint64_t seed = 0) {
  return XXH3_64bits_withSeed(data, bytes, seed);
}

}  // namespace catgut
