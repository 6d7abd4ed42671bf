// SPDX-License-Identifier: Apache-2.0
// solver/particles: the columns that kernels work on. Float32, SI units.
// A position is (x, y, z, 1). The outer product of a position with its rest position then carries the moments,
// the centroid and the count of a cluster in one 64-byte row (see shape_match).
#pragma once
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <new>
#include <vector>

#include "core/math.h"

namespace catgut {

struct alignas(16) Vec4 {
  float x = 0, y = 0, z = 0, w = 0;
};
constexpr Vec3 xyz(const Vec4& a) { return {a.x, a.y, a.z}; }
constexpr Vec4 point(Vec3 a) { return {a.x, a.y, a.z, 1}; }
constexpr void add(Vec4& a, Vec3 d) { a.x += d.x, a.y += d.y, a.z += d.z; }
constexpr void set(Vec4& a, Vec3 v) { a.x = v.x, a.y = v.y, a.z = v.z; }
// A position or velocity as one register: the fourth lane (1, or 0) never changes.
using Four = float __attribute__((vector_size(16)));
inline Four load(const Vec4& a) {
  Four f;
  std::memcpy(&f, &a, sizeof f);
  return f;
}
inline void store(Vec4& a, Four f) { std::memcpy(&a.x, &f, sizeof f); }

// std::vector storage aligned to a cache line, for columns that SIMD kernels load as whole vectors.
template <typename T>
struct CacheAligned {
  using value_type = T;
  CacheAligned() = default;
  template <typename U>
  CacheAligned(const CacheAligned<U>&) {}
  T* allocate(size_t n) { return static_cast<T*>(::operator new (n * sizeof(T), std::align_val_t{64})); }
  void deallocate(T* p, size_t) { ::operator delete (p, std::align_val_t{64}); }
  bool operator==(const CacheAligned&) const { return true; }
};
template <typename T>
using Column = std::vector<T, CacheAligned<T>>;

}  // namespace catgut
