// SPDX-License-Identifier: Apache-2.0
// tests/surgeon: threads with throws that are known, as curves.
#pragma once
#include <cmath>
#include <vector>

#include "core/math.h"

namespace catgut {

// Both strands of a throw twist about each other along an axis: half_turns 3 are one wrap, 1 is a mere crossing.
struct Laid {
  int half_turns = 3, hand = 1;
  float radius = 0.5e-3f, half_length = 2e-3f;  // [m]
};

inline void add_line(std::vector<Vec3>& curve, Vec3 to) {
  const Vec3 from = curve.back();
  for (int i = 1; i <= 20; ++i) curve.push_back(lerp(from, to, static_cast<float>(i) / 20));
}

// A thread through a bite at the origin, below; throws one above the other. Tail to the left or right, wherever it comes out.
inline std::vector<Vec3> tied(const std::vector<Laid>& throws, float tail, float strand) {
  std::vector<Vec3> side[2];  // upward from the bite
  side[0] = {{-3e-3f, 0, 0}}, side[1] = {{3e-3f, 0, 0}};
  float y = 2e-3f;
  size_t from_left = 0;
  for (const Laid& t : throws) {
    y += t.radius + 1e-3f;
    const float turn = static_cast<float>(t.hand) * kPi * static_cast<float>(t.half_turns);
    const auto at = [&](float s, float phase) {  // s 0..1 from left to right
      const float angle = phase + turn * s;
      return Vec3{(2 * s - 1) * t.half_length, y + t.radius * std::sin(angle), -t.radius * std::cos(angle)};
    };
    add_line(side[from_left], at(0, -0.5f * kPi)), add_line(side[1 - from_left], at(1, 0.5f * kPi));
    for (int i = 1; i <= 120; ++i) {
      const float s = static_cast<float>(i) / 120;
      side[from_left].push_back(at(s, -0.5f * kPi)), side[1 - from_left].push_back(at(1 - s, 0.5f * kPi));
    }
    if (t.half_turns % 2 != 0) from_left = 1 - from_left;
    y += t.radius + 1e-3f;
  }
  const auto out = [&](size_t k, float far) {
    const float way = from_left == k ? -1.0f : 1.0f;
    add_line(side[k], side[k].back() + Vec3{0.8f * way, 0.5f, 0.3f * way} * far);
  };
  out(0, tail), out(1, strand);
  std::vector<Vec3> thread(side[0].rbegin(), side[0].rend());
  add_line(thread, {0, -4e-3f, 0}), add_line(thread, side[1].front());
  thread.insert(thread.end(), side[1].begin() + 1, side[1].end());
  return thread;
}

}  // namespace catgut
