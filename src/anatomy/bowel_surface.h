// SPDX-License-Identifier: Apache-2.0
// anatomy/bowel_surface: the smooth outer surface of the generated bowel as a function of s and angle. s: distance along
// the profile from the near end [m]. angle: about the axis [rad]. Particles and visible mesh are both sampled from it.
#pragma once
#include <vector>

#include "anatomy/bowel.h"
#include "geometry/mesh.h"

namespace catgut {

class BowelSurface {
 public:
  explicit BowelSurface(const BowelShape& shape);   // the shape must have been checked
  double profile_length() const { return total_; }  // [m] along the outside from the near end to the far end
  double ring_radius(double s) const;               // [m] distance from the axis without relief
  double depth(double s) const;                     // [m] along the axis from the near end, 0..length
  Vec3 point(double s, double angle) const;         // [m] on the outside
  Vec3 normal(double s, double angle) const;        // unit, outward

 private:
  struct P3 {
    double x, y, z;  // along e1, e2 and the axis
  };
  P3 local(double s, double angle) const;
  double relief(double s, double angle) const;  // [m] outward, never positive
  void profile(double s, double& z, double& r, double& nz, double& nr) const;
  Vec3 to_world(P3 p) const;

  BowelShape shape_;
  Vec3 e1_, e2_, axis_;
  double total_ = 0, near_dome_ = 0, far_dome_ = 0;  // [m] arc lengths of profile and domes (0 where open)
  double dome_height_ = 0;
  double straight_ = 0, turn_ = 0, lumen_ = 0;  // [m] folded: height of the straight tubes, radius of the turn, of the lumen
  std::vector<double> dome_arc_;  // arc length of a dome's quarter ellipse from its top, over equal steps of its angle
};

// Its visible mesh: outside and inside with about `vertices` vertices, rounded rim edges in addition, not yet bound to
// particles. everted: the mucosa is outside.
VisibleMesh bowel_picture(const BowelShape& shape, const BowelSurface& surface, int vertices, bool everted);

}  // namespace catgut
