// SPDX-License-Identifier: Apache-2.0
// wall/patch: see the header.
#include "wall/patch.h"

#include <algorithm>
#include <cmath>

namespace catgut::wall {
namespace {

// Begins with the foot on a parallelogram.
void nearest_by_newton(const Patch& patch, Vec3 target, float& xi, float& eta) {
  xi = eta = patch.quad ? 0.0f : 0.6f;
  for (int i = 0; i < 5; ++i) {
    const Vec3 a = patch.along_xi(eta), b = patch.along_eta(xi), r = target - patch.at(xi, eta);
    const float aa = dot(a, a), bb = dot(b, b), ab = dot(a, b), det = aa * bb - ab * ab;
    if (!(det > 1e-12f * aa * bb)) return;
    const float low = patch.quad ? -1.0f : 0.0f, high = patch.quad ? 1.0f : 2.0f, x0 = xi, y0 = eta;
    xi = std::clamp(xi + (bb * dot(r, a) - ab * dot(r, b)) / det, low, high);
    eta = std::clamp(eta + (dot(r, b) - ab * (xi - x0)) / bb, low, high);
    if (!patch.quad) eta = std::min(eta, 2 - xi);
    xi = std::clamp(x0 + (dot(r, a) - ab * (eta - y0)) / aa, low, patch.quad ? high : 2 - eta);
    if (std::abs(xi - x0) + std::abs(eta - y0) < 1e-4f) return;
  }
}

}  // namespace

// A patch that is twisted has several feet, and Newton's steps may end at none of them: on crumpled walls one of 200 such feet
// was off by 0.05 to 1.5 mm. From the nearest of 25 points a descent along each coordinate in turn finds the foot there.
void nearest(const Patch& patch, Vec3 target, float& xi, float& eta) {
  nearest_by_newton(patch, target, xi, eta);
  const auto& p = patch.p;
  const auto far2 = [&](float x, float y) { return length2(patch.at(x, y) - target); };
  if (!patch.quad) {  // on an obtuse triangle they may end beside the foot on an edge
    for (size_t k = 0; k < 3; ++k) {
      constexpr float kCorner[3][2] = {{0, 0}, {2, 0}, {0, 2}};
      const Vec3 edge = p[(k + 1) % 3] - p[k];
      const float u = std::clamp(dot(target - p[k], edge) / std::max(length2(edge), 1e-20f), 0.0f, 1.0f);
      const float x = std::lerp(kCorner[k][0], kCorner[(k + 1) % 3][0], u),
                  y = std::lerp(kCorner[k][1], kCorner[(k + 1) % 3][1], u);
      if (far2(x, y) < far2(xi, eta)) xi = x, eta = y;
    }
    return;
  }
  constexpr float kTwisted = 0.2f;  // of the diagonals' length: distance of their middles, twice
  const float diagonals2 = 0.5f * (length2(p[2] - p[0]) + length2(p[3] - p[1]));
  if (length2(p[0] - p[1] + p[2] - p[3]) < kTwisted * kTwisted * diagonals2) return;
  float x = 0, y = 0, least = 1e9f;
  for (int i = -2; i <= 2; ++i)
    for (int k = -2; k <= 2; ++k)
      if (const float d = far2(0.5f * static_cast<float>(i), 0.5f * static_cast<float>(k)); d < least)
        x = 0.5f * static_cast<float>(i), y = 0.5f * static_cast<float>(k), least = d;
  for (int i = 0; i < 12; ++i) {
    const float x0 = x, y0 = y;
    const Vec3 a = patch.along_xi(y);
    x = std::clamp(x + dot(target - patch.at(x, y), a) / std::max(length2(a), 1e-20f), -1.0f, 1.0f);
    const Vec3 b = patch.along_eta(x);
    y = std::clamp(y + dot(target - patch.at(x, y), b) / std::max(length2(b), 1e-20f), -1.0f, 1.0f);
    if (std::abs(x - x0) + std::abs(y - y0) < 1e-4f) break;
  }
  if (far2(x, y) < far2(xi, eta)) xi = x, eta = y;
}

}  // namespace catgut::wall
