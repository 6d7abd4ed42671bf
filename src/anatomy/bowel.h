// SPDX-License-Identifier: Apache-2.0
// anatomy/bowel: makes a piece of large bowel at rest. A tube with a wall, sacculations (haustra) between longitudinal bands
// (taeniae), serosa outside and mucosa inside, open or closed ends. Needs no external mesh.
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
  Vec3 axis{0, 1, 0};            // direction that the near end faces; any length
  float density = 1050;          // [kg/m^3]
  float pinned_length = 0.008f;  // [m] length of the far end that is fixed; 0: none
  float inner_radius = 0;        // [m] outer radius of a second tube inside the first; 0: none
  bool folded = false;           // the two tubes are one wall, folded at the near end: a prolapse before it is cut
};

// Particles run ring by ring from the near end. A sheet vertex is two neighboring particles, outer (even index) then
// inner (odd index). rim[0] is the near end, rim[1] the far end, if open. A rim runs counter-clockwise seen
// from outside its opening. visible: about 20,000 vertices whose outer side passes through the outer particles.
//
// inner_radius > 0: the remainder after a prolapsed rectum was cut off (paper 2.5.4). A prolapse is bowel that has slid out
// through itself. The outer tube is rectum turned inside out, so its mucosa is visible from outside. The inner tube is the
// colon that followed, not everted; between the two, serosa faces serosa. The cut leaves both ends open, their rims level. The
// outer tube is wall 0, with more particles in proportion to its surface, followed by wall 1; far ends are fixed as
// above. Rims: near end of wall 0, of wall 1, far end of wall 0, of wall 1. A rim's `outer` is always the side away from the
// axis.
//
// folded: the same prolapse before the cut. One wall runs up the colon inside, turns over at the tip and runs down the everted
// rectum outside, mucosa on the side that is visible. Near end: the tip, the turn's highest circle. Both openings are at the
// far end, that of the colon first; both are fixed. wall: one. Even particle indices are on the mucosa's side.
//
// The same shape gives the same bits. Throws InputError for a shape that cannot be built.
BodyRest make_bowel(const BowelShape& shape);

}  // namespace catgut
