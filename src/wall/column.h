// SPDX-License-Identifier: Apache-2.0
// wall: storage that SIMD kernels load whole, and the four-lane vector they use for positions and forces.
#pragma once
#include <cstring>
#include <new>
#include <vector>

#include "core/math.h"

namespace catgut::wall {

// (x, y, z, unused); the fourth lane is 0 and stays 0.
struct alignas(16) Float4 {
  float x = 0, y = 0, z = 0, w = 0;
};
constexpr bool operator==(const Float4& a, const Float4& b) { return a.x == b.x && a.y == b.y && a.z == b.z && a.w == b.w; }
constexpr Float4 float4(Vec3 a) { return {a.x, a.y, a.z, 0}; }
constexpr Vec3 vec3(const Float4& a) { return {a.x, a.y, a.z}; }

// The same as one register of the baseline instruction set.
using Lanes = float __attribute__((vector_size(16)));
inline Lanes load(const Float4& a) {
  Lanes v;
  std::memcpy(&v, &a, sizeof v);
  return v;
}
inline void store(Float4& a, Lanes v) { std::memcpy(&a.x, &v, sizeof v); }
inline Lanes splat(float s) { return Lanes{s, s, s, s}; }

// Aligned to a cache line.
template <typename T>
struct CacheLine {
  using value_type = T;
  CacheLine() = default;
  template <typename U>
  CacheLine(const CacheLine<U>&) {}
  T* allocate(size_t n) { return static_cast<T*>(::operator new (n * sizeof(T), std::align_val_t{64})); }
  void deallocate(T* p, size_t) { ::operator delete (p, std::align_val_t{64}); }
  bool operator==(const CacheLine&) const { return true; }
};
template <typename T>
using Column = std::vector<T, CacheLine<T>>;

}  // namespace catgut::wall
