// SPDX-License-Identifier: Apache-2.0
// geometry/closest: nearest points of segments and triangles, and of a triangle mesh.
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "geometry/mesh.h"

namespace catgut {

// Parameter (0..1) of the point of segment a-b nearest to p.
inline float closest_on_segment(Vec3 p, Vec3 a, Vec3 b) {
  const Vec3 d = b - a;
  return std::clamp(dot(p - a, d) / std::max(length2(d), 1e-16f), 0.0f, 1.0f);
}

// The point of triangle a b c nearest to p (Ericson 2005, section 5.1.5), and its barycentric weights.
struct ClosestOnTriangle {
  Vec3 point;
  std::array<float, 3> weight;
};
ClosestOnTriangle closest_on_triangle(Vec3 p, Vec3 a, Vec3 b, Vec3 c);

// A tree of boxes over a mesh that must outlive it unchanged.
class SurfaceTree {
 public:
  struct Hit {
    Vec3 point;             // [m]
    uint32_t triangle = 0;  // the lowest index among equally near ones
    float distance2 = 0;    // [m^2]
  };
  explicit SurfaceTree(const TriangleMesh& mesh);  // at least one triangle
  Hit nearest(Vec3 p) const;

 private:
  struct Node {
    Vec3 low, high;
    uint32_t first, count;  // leaf: triangles order_[first..]; inner node: count 0, children first and first + 1
  };
  void build(uint32_t node, uint32_t first, uint32_t last);
  const TriangleMesh& mesh_;
  std::vector<uint32_t> order_;
  std::vector<Node> node_;
};

}  // namespace catgut
