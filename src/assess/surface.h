// SPDX-License-Identifier: Apache-2.0
// assess: the tissue's surface at rest: distances below the serosa, and directions of the surface. Reads PictureModel.
#pragma once
#include <memory>
#include <vector>

#include "exchange/picture.h"
#include "geometry/closest.h"

namespace catgut::assess {

struct SurfacePoint {
  Vec3 point, normal;  // [m] nearest point; unit, outward, interpolated between vertices
  float below = 0;     // [m] distance below it, along its normal; negative: outside
  bool valid = false;
};

// Of every wall: its serosa, and its whole surface. Copies share the constant data.
class RestSurface {
 public:
  explicit RestSurface(const PictureModel& picture);
  SurfacePoint serosa(uint32_t wall, Vec3 at_rest) const;
  SurfacePoint nearest(uint32_t wall, Vec3 at_rest) const;

 private:
  struct Part {
    TriangleMesh mesh;
    std::vector<Vec3> normal;  // per vertex
    std::unique_ptr<SurfaceTree> tree;
  };
  using Parts = std::vector<Part>;
  static SurfacePoint find(const Parts& parts, uint32_t wall, Vec3 p);
  std::shared_ptr<const Parts> serosa_, whole_;
};

}  // namespace catgut::assess
