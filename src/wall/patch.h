// SPDX-License-Identifier: Apache-2.0
// wall/patch: a face as a bilinear patch of four corners or a triangle of three, in the coordinates of wall::Point.
#pragma once
#include "core/math.h"

namespace catgut::wall {

struct Patch {
  Vec3 p[4];
  bool quad = true;
  Vec3 at(float xi, float eta) const {
    if (!quad) return p[0] * (1 - 0.5f * (xi + eta)) + p[1] * (0.5f * xi) + p[2] * (0.5f * eta);
    const float a = 1 - xi, b = 1 + xi, c = 1 - eta, d = 1 + eta;
    return (p[0] * (a * c) + p[1] * (b * c) + p[2] * (b * d) + p[3] * (a * d)) * 0.25f;
  }
  Vec3 along_xi(float eta) const {
    return quad ? ((p[1] - p[0]) * (1 - eta) + (p[2] - p[3]) * (1 + eta)) * 0.25f : (p[1] - p[0]) * 0.5f;
  }
  Vec3 along_eta(float xi) const {
    return quad ? ((p[3] - p[0]) * (1 - xi) + (p[2] - p[1]) * (1 + xi)) * 0.25f : (p[2] - p[0]) * 0.5f;
  }
};

// The place on a patch that is nearest to a point, in its coordinates.
void nearest(const Patch& patch, Vec3 target, float& xi, float& eta);

}  // namespace catgut::wall
