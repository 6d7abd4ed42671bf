// SPDX-License-Identifier: Apache-2.0
// app/xr: see labels.h.
#include "xr/labels.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace catgut::xr {
namespace {

// [m] room. A pixel of 0.3 mm makes lines of 0.65 degrees at the usual distance of the field.
constexpr float kPixel = 0.0003f, kWidth = kPixel * EyeRenderer::kLabelWidth;
constexpr float kAway = 0.045f;          // from the outermost suture point to the ring
constexpr float kAbove = 0.008f;         // of the ring above the highest suture point
constexpr float kMostRadius = 0.24f;     // of the ring, unless the suture points are further out; more labels become smaller
constexpr float kStep = 1.15f * kWidth;  // along the ring from one label to the next

// Angles in the order of `wanted`, ascending, at least `step` apart also across the end of the circle, and together as near to
// `wanted` as that permits (isotonic regression by pooling of neighbors). wanted: [rad], ascending within a turn.
std::vector<float> spread(const std::vector<float>& wanted, float step) {
  const size_t n = wanted.size();
  struct Pool {
    float sum;
    size_t count;
    float mean() const { return sum / static_cast<float>(count); }
  };
  std::vector<Pool> pool;
  for (size_t i = 0; i < n; ++i) {
    pool.push_back({wanted[i] - step * static_cast<float>(i), 1});
    while (pool.size() > 1 && pool[pool.size() - 2].mean() > pool.back().mean()) {
      pool[pool.size() - 2].sum += pool.back().sum, pool[pool.size() - 2].count += pool.back().count;
      pool.pop_back();
    }
  }
  std::vector<float> out;
  for (const Pool& p : pool)
    for (size_t i = 0; i < p.count; ++i) out.push_back(p.mean() + step * static_cast<float>(out.size()));
  // The row is longer than the circle: it is spaced evenly about its middle.
  if (n > 1 && out.back() - out.front() > 2 * kPi - step) {
    const float middle = 0.5f * (out.front() + out.back()), even = 2 * kPi / static_cast<float>(n);
    for (size_t i = 0; i < n; ++i) out[i] = middle + even * (static_cast<float>(i) - 0.5f * static_cast<float>(n - 1));
  }
  return out;
}

}  // namespace

std::vector<Label> place_labels(std::span<const StitchMark> marks, const Place& place, Vec3 eyes) {
  if (marks.size() > EyeRenderer::kMostLabels) marks = marks.last(EyeRenderer::kMostLabels);
  const size_t n = marks.size();
  std::vector<Label> out(n);
  if (n == 0) return out;
  const float scale = 1 / place.loupe;
  Vec3 center;
  float top = -1e9f, extent = 0;
  for (const StitchMark& m : marks)
    for (const Vec3 p : m.at) center += p / static_cast<float>(2 * n), top = std::max(top, p.y);
  for (const StitchMark& m : marks)
    for (const Vec3 p : m.at) extent = std::max(extent, std::hypot(p.x - center.x, p.z - center.z));

  const float needed = static_cast<float>(n) * kStep / (2 * kPi), size = scale * std::min(1.0f, kMostRadius / needed);
  const float radius = std::max(extent + scale * kAway, size * needed);

  // Sorted by direction from the center, starting after the largest gap, where the order of the circle may be cut open.
  std::vector<float> angle(n);
  for (size_t i = 0; i < n; ++i) angle[i] = std::atan2(marks[i].at[0].z - center.z, marks[i].at[0].x - center.x);
  std::vector<size_t> order(n);
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) { return angle[a] < angle[b]; });
  size_t first = 0;
  float widest = -1;
  for (size_t i = 0; i < n; ++i) {
    const float gap = i == 0 ? angle[order[0]] + 2 * kPi - angle[order[n - 1]] : angle[order[i]] - angle[order[i - 1]];
    if (gap > widest) widest = gap, first = i;
  }
  std::rotate(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(first), order.end());
  std::vector<float> wanted(n);
  for (size_t i = 0; i < n; ++i) wanted[i] = angle[order[i]] + (angle[order[i]] < angle[order[0]] ? 2 * kPi : 0.0f);
  const std::vector<float> at = spread(wanted, size * kStep / radius);

  for (size_t i = 0; i < n; ++i) {
    const StitchMark& m = marks[order[i]];
    Label& label = out[order[i]];
    const Vec3 p{center.x + radius * std::cos(at[i]), top + scale * kAbove, center.z + radius * std::sin(at[i])};
    const Vec3 z = normalized(eyes - p, {0, 0, 1}), x = normalized(cross({0, 1, 0}, z), {1, 0, 0});
    label.pose = {p, from_axes(x, cross(z, x), z)};
    label.width = size * kWidth;
    label.point = m.at;
    label.text = m.text;
    label.color = m.color;
  }
  return out;
}

}  // namespace catgut::xr
