// SPDX-License-Identifier: Apache-2.0
// runtime: what a pen has done to the tissue, measured on the drawn surface alone: its pieces by flood fill, where its cut
// edges are, and what it encloses. Reads a Snapshot whose topology has a picture; all zero without one.
#pragma once
#include "exchange/picture.h"
#include "exchange/snapshot.h"
#include "sim/scene.h"

namespace catgut {

struct CutMeasures {
  uint32_t pieces = 0;
  double deviation = 0;  // [m] largest distance of a cut edge from the line, at rest
  double way = 0;        // [m] displacement of the piece with the first body's rim
  double mass = 0;       // [kg] what the surface encloses at rest, all pieces
  double eversion = 0;   // [rad] by which the cut edge that stays is turned outward against rest, at most; 0 with one piece
  // An anastomosis: from the rim of the second body to the cut edge of the first, without the piece that has its rim.
  double ring_gap = 0;        // [m] the largest, round the rim; 0 with one body, or one piece
  double stitch_gap = 0;      // [m] the largest where a stitch crosses from one wall to the other
  double stitch_tension = 0;  // [N] of the thread where it crosses, the smallest of all stitches; 0 without one
};
CutMeasures measure_cut(const SceneSpec& scene, const Snapshot& seen);

}  // namespace catgut
