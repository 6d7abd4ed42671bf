// geometry/closest: the point of a triangle mesh nearest to a given one.
#pragma once
#include <cstdint>
#include <vector>

#include "geometry/mesh.h"

namespace catgut {

// The point of triangle a b c nearest to p (Ericson 2005, section 5.1.5).
Vec3 closest_point_on_triangle(Vec3 p, Vec3 a, Vec3 b, Vec3 c);

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
