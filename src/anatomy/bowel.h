// SPDX-License-Identifier: Apache-2.0
// anatomy/bowel: makes a piece of large bowel at rest: a tube with a wall, sacculations (haustra) between longitudinal bands
// (taeniae), serosa outside and mucosa inside, open or closed ends. No mesh from outside is needed.
#pragma once
#include <string>

#include "anatomy/body.h"

namespace catgut {

struct BowelShape {
  std::string name = "bowel";
  int particles = 1228;          // exact; odd counts get one particle at mid-wall in the far end
  float radius = 0.020f;         // [m] outer radius
  float length = 0.070f;         // [m] from the near end to the far end, domes of closed ends included
  float wall = 0.0025f;          // [m] thickness
  bool closed_start = false;     // far end closed by a dome
  bool closed_end = false;       // near end (where the procedure works) closed by a dome
  float haustra = 0.0008f;       // [m] depth of folds and bands; fades out toward both ends, so that a rim is a true circle
  int taeniae = 3;               // longitudinal bands, 0..12
  Vec3 position;                 // [m] center of the near end's rim (closed: the top of its dome)
  Vec3 axis{0, 1, 0};            // the way the near end faces; need not be of unit length
  float density = 1050;          // [kg/m^3]
  float pinned_length = 0.008f;  // [m] of the far end that the surroundings hold; 0 holds nothing
  float inner_radius = 0;        // [m] outer radius of a second tube inside the first; 0: none
};

// Particles run ring by ring from the near end; a place on the sheet is two neighboring particles, outer (even index) then
// inner (odd index). rim[0] is the near end, rim[1] the far end, as far as they are open; a rim runs counter-clockwise seen
// from outside its opening. visible: about 20,000 vertices whose outer side passes through the outer particles.
//
// inner_radius > 0: what is left when a prolapsed rectum was cut off (paper 2.5.4). A prolapse is bowel that has slid out
// through itself: the outer tube is rectum turned inside out, so its mucosa is seen from outside; the inner tube is the colon
// that followed, the right way out; between the two, serosa faces serosa. The cut leaves both ends open, their rims level. The
// outer tube is wall 0, with exactly as many particles more as it has more surface, then comes wall 1; far ends are held as
// above. Rims: near end of wall 0, of wall 1, far end of wall 0, of wall 1. A rim's `outer` is always the side away from the
// axis.
//
// The same shape gives the same bits. Throws InputError for a shape that cannot be built.
BodyRest make_bowel(const BowelShape& shape);

}  // namespace catgut
