// SPDX-License-Identifier: Apache-2.0
// render/thread_path: see thread_path.h.
#include "render/thread_path.h"

#include <algorithm>
#include <cmath>

namespace catgut {

void PointGrid::build(std::span<const Vec3> point, float reach) {
  constexpr int kMostCells = 64;  // along an axis; cells grow beyond it
  constexpr float kFar = 10;      // [m]
  constexpr uint32_t kNone = 0xffffffffu;
  const auto valid = [](Vec3 p) { return is_finite(p) && std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) < kFar; };
  point_ = point;
  reach_ = reach;
  order_.clear();
  Vec3 low{kFar, kFar, kFar}, high = -low;
  for (const Vec3 p : point) {
    if (!valid(p)) continue;
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  if (low.x > high.x) return;
  low_ = low;
  cell_ = std::max(reach, std::max({high.x - low.x, high.y - low.y, high.z - low.z}) / kMostCells);
  for (int a = 0; a < 3; ++a) size_[a] = int((high[a] - low[a]) / cell_) + 1;
  const auto index = [&](float x, int axis) { return size_t(std::min(int((x - low[axis]) / cell_), size_[axis] - 1)); };
  const size_t cells = size_t(size_[0]) * size_t(size_[1]) * size_t(size_[2]);
  first_.assign(cells + 1, 0);
  cell_of_.assign(point.size(), kNone);
  for (size_t i = 0; i < point.size(); ++i) {
    const Vec3 p = point[i];
    if (!valid(p)) continue;
    const size_t c = (index(p.z, 2) * size_t(size_[1]) + index(p.y, 1)) * size_t(size_[0]) + index(p.x, 0);
    cell_of_[i] = uint32_t(c);
    ++first_[c + 1];
  }
  for (size_t c = 0; c < cells; ++c) first_[c + 1] += first_[c];
  const uint32_t count = first_[cells];
  order_.resize(count);
  for (size_t i = point.size(); i-- > 0;)
    if (cell_of_[i] != kNone) order_[--first_[cell_of_[i] + 1]] = uint32_t(i);
  // first_[c + 1] is now the start of cell c: shift it back.
  for (size_t c = 0; c < cells; ++c) first_[c] = first_[c + 1];
  first_[cells] = count;
}

ToolHull tool_hull(const ToolShape& shape) {
  ToolHull hull;
  hull.pivot = shape.pivot, hull.opening = shape.opening;
  float end = 0;
  for (const Shape* s : {&shape.body, &shape.half})
    for (const Vec3 p : s->position) end = std::max(end, p.z);
  const size_t steps = size_t((end - ToolHull::kFrom) / ToolHull::kStep) + 2;
  // A triangle may span several steps: its edges are sampled.
  const auto fill = [&](const Shape& s, std::vector<float>& x, std::vector<float>& y) {
    x.assign(steps, 0), y.assign(steps, 0);
    const auto add = [&](Vec3 p) {
      const float at = (p.z - ToolHull::kFrom) / ToolHull::kStep;
      if (at < 0) return;
      const size_t i = std::min(steps - 1, size_t(at));
      x[i] = std::max(x[i], std::abs(p.x)), y[i] = std::max(y[i], std::abs(p.y));
    };
    for (const auto& t : s.triangle)
      for (size_t k = 0; k < 3; ++k) {
        const Vec3 a = s.position[t[k]], b = s.position[t[(k + 1) % 3]];
        const int count = 1 + int(std::abs(b.z - a.z) / (0.5f * ToolHull::kStep));
        for (int i = 0; i <= count; ++i) add(lerp(a, b, float(i) / float(count)));
      }
  };
  fill(shape.body, hull.body_x, hull.body_y);
  fill(shape.half, hull.half_x, hull.half_y);
  return hull;
}

std::array<float, 2> hull_at(const ToolHull& hull, float z, float jaw) {
  const float at = (z - ToolHull::kFrom) / ToolHull::kStep;
  if (!(at >= 0) || at >= float(hull.body_x.size())) return {0, 0};
  const size_t i = size_t(at);
  const float swing = std::abs(hull.pivot - z) * std::tan(hull.opening * std::clamp(jaw, 0.0f, 1.0f));
  float x = 0, y = 0;
  // With the neighbors: an open jaw's parts shift a little along the shaft.
  for (size_t k = i > 0 ? i - 1 : 0; k <= std::min(i + 1, hull.body_x.size() - 1); ++k) {
    x = std::max({x, hull.body_x[k], hull.half_x[k] > 0 ? hull.half_x[k] + swing : 0});
    y = std::max({y, hull.body_y[k], hull.half_y[k]});
  }
  return {x, y};
}

Vec3 outside_tool(const ToolHull& hull, const Pose& pose, float jaw, Vec3 p, float clearance) {
  Vec3 q = rotate(conjugate(pose.q), p - pose.p);
  const auto [hx, hy] = hull_at(hull, q.z, jaw);
  if (hx <= 0 || hy <= 0) return p;
  // A rounded rectangle, a little wider than the instrument's own, as its corners are sharper.
  constexpr float corner = 1.04f;
  const float x = corner * hx + clearance, y = corner * hy + clearance;
  const auto to_sixth = [](float v) { return v * v * v * v * v * v; };
  const float inside = std::pow(to_sixth(q.x / x) + to_sixth(q.y / y), 1.0f / 6);
  if (inside >= 1) return p;
  if (inside < 1e-4f) q.y = y;
  else q.x /= inside, q.y /= inside;
  return pose.p + rotate(pose.q, q);
}

}  // namespace catgut
