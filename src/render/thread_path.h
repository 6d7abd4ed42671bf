// SPDX-License-Identifier: Apache-2.0
// render/thread_path: keeps a drawn thread on the outside of what it lies on. Physics holds the thread's particles away from
// the collision shapes; the drawn wall, cloth and instruments differ from these by up to a few millimeters, so that a thread
// drawn through its particles would sink into them. Plain geometry, no graphics library; [m] throughout.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/math.h"
#include "render/shapes.h"

namespace catgut {

// Points in cells of a regular grid, for the nearest one within a short distance.
class PointGrid {
 public:
  // reach: [m] of near(). Points that are not finite or 10 m away are ignored.
  void build(std::span<const Vec3> point, float reach);
  // Calls visit(index, squared distance) for each point within the reach of p.
  template <typename Visit>
  void near(Vec3 p, Visit&& visit) const {
    if (order_.empty() || !is_finite(p)) return;
    const int x = column(p.x - low_.x, size_[0]), y = column(p.y - low_.y, size_[1]), z = column(p.z - low_.z, size_[2]);
    if (x < -1 || y < -1 || z < -1 || x > size_[0] || y > size_[1] || z > size_[2]) return;
    for (int k = std::max(0, z - 1); k <= std::min(size_[2] - 1, z + 1); ++k)
      for (int j = std::max(0, y - 1); j <= std::min(size_[1] - 1, y + 1); ++j)
        for (int i = std::max(0, x - 1); i <= std::min(size_[0] - 1, x + 1); ++i) {
          const size_t c = (size_t(k) * size_t(size_[1]) + size_t(j)) * size_t(size_[0]) + size_t(i);
          for (uint32_t n = first_[c]; n < first_[c + 1]; ++n)
            if (const float d2 = length2(point_[order_[n]] - p); d2 < reach_ * reach_) visit(order_[n], d2);
        }
  }

 private:
  int column(float x, int count) const {
    const float c = std::floor(x / cell_);
    return c < -2 ? -2 : c > float(count) + 1 ? count + 1 : int(c);
  }
  std::span<const Vec3> point_;
  float cell_ = 1, reach_ = 1;  // [m]
  Vec3 low_;
  int size_[3] = {0, 0, 0};
  std::vector<uint32_t> first_, order_, cell_of_;
};

// The space that a drawn instrument fills, as rounded rectangles across its shaft: of its fixed part, and of the half that
// opens toward +x (the other mirrors it). Between the jaws counts as inside: a thread wound round open jaws lies round both.
struct ToolHull {
  static constexpr float kFrom = -0.004f, kStep = 0.002f;  // [m] along the shaft
  std::vector<float> body_x, body_y, half_x, half_y;       // [m] half axes per step; 0: nothing there
  float pivot = 0, opening = 0;                            // of the ToolShape
};
ToolHull tool_hull(const ToolShape& shape);
// Half axes at z of the tool's frame, jaws open by `jaw` 0..1; {0, 0} beyond its ends.
std::array<float, 2> hull_at(const ToolHull& hull, float z, float jaw);
// p [world] moved across the shaft until it is `clearance` outside the hull; unchanged if it is outside.
Vec3 outside_tool(const ToolHull& hull, const Pose& pose, float jaw, Vec3 p, float clearance);

}  // namespace catgut
