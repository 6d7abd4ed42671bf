// SPDX-License-Identifier: Apache-2.0
// core/random: a small counter-free generator (PCG32, O'Neill 2014) whose whole state is one integer, so that it can be saved,
// hashed and replayed. Not cryptographic.
#pragma once
#include <cstdint>

namespace catgut {

struct Random {
  uint64_t state = 0x853c49e6748fea9bULL;
  explicit Random(uint64_t seed = 0) : state(seed * 6364136223846793005ULL + 0x9e3779b97f4a7c15ULL) { next(); }
  uint32_t next() {
    const uint64_t old = state;
    state = old * 6364136223846793005ULL + 1442695040888963407ULL;
    const uint32_t x = static_cast<uint32_t>(((old >> 18) ^ old) >> 27), r = static_cast<uint32_t>(old >> 59);
    return (x >> r) | (x << ((-r) & 31));
  }
  // Uniform in [0, 1).
  float uniform() { return static_cast<float>(next() >> 8) * (1.0f / 16777216.0f); }
  // Near-normal, mean 0, standard deviation 1 (sum of twelve uniforms: bounded by 6, as a hand's tremor should be).
  float normal() {
    float s = -6;
    for (int i = 0; i < 12; ++i) s += uniform();
    return s;
  }
};

}  // namespace catgut
