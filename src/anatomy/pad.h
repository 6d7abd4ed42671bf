// SPDX-License-Identifier: Apache-2.0
// anatomy/pad: one lip of a slit in a flat pad of skin, at rest: the first exercise of a suturing course. Two of them, face to
// face, are a pad with a slit. Needs no external mesh.
#pragma once
#include <string>

#include "anatomy/body.h"

namespace catgut {

struct PadShape {
  std::string name = "skin";
  int particles = 700;           // exact; odd counts get one particle inside the far border
  float length = 0.030f;         // [m] from the slit to the far border
  float width = 0.060f;          // [m] along the slit
  float thickness = 0.004f;      // [m]
  Vec3 position;                 // [m] middle of the slit's edge, on the skin's surface
  Vec3 axis{1, 0, 0};            // horizontal direction that the cut face looks to; any length
  float density = 1050;          // [kg/m^3]
  float pinned_length = 0.012f;  // [m] width of the far border that is fixed; 0: none
};

// Particles run row by row from the slit: upper side (even index, layer serosa: the skin), then lower side (odd index). rim[0]
// is the border of the cut face: along the skin's edge and back along the lower edge, on `outer` and `inner` alike. Throws
// InputError for a shape that cannot be built.
BodyRest make_pad(const PadShape& shape);

}  // namespace catgut
