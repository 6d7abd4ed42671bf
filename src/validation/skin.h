// SPDX-License-Identifier: Apache-2.0
// validation/skin: the outer surface of a wall, its faces and rims, as triangles, and what lies inside. Inside is what the
// surface goes round, by its winding number (Jacobson et al. 2013, 10.1145/2461912.2461916), so it does not matter which face
// is nearest, or how one is folded or sheared. For walls that are not cut.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "physical/physical.h"

namespace catgut::validation {

class Skin {
 public:
  Skin(const physical::Model& model, const wall::State& rest);
  // The wall is now like this.
  void follow(const physical::Model& model, const wall::State& state);
  // How often the surface goes round a point: 1 inside, 0 outside; between them near the open end where the wall is held.
  float winding(Vec3 p) const;
  bool inside(Vec3 p) const { return winding(p) > 0.5f; }

 private:
  struct Piece {  // of the surface: a triangle, or a quadrilateral as two
    std::array<Vec3, 4> corner;
    uint32_t count = 4;
    bool turned = false;  // its corners go round clockwise, seen from outside
    Vec3 center, area;    // [m], [m2] outward
    float radius = 0;     // [m] about the center
    float warp = 0;       // [m] from a parallelogram
  };
  std::vector<Piece> piece_;
};

}  // namespace catgut::validation
