// SPDX-License-Identifier: Apache-2.0
// device: where the next bite should go, as a circle for the needle: for the help that brings a held needle there, for the
// ghost that is drawn, and for telling a user how near the tip is to it. Plain data and arithmetic.
#pragma once
#include "exchange/picture.h"
#include "exchange/snapshot.h"

namespace catgut {

// The needle turns about cross(along, out); its tip goes in along `along` and is deepest at `at - out * depth`.
struct BiteGuide {
  Vec3 at, out, along;          // [m] on the surface as it is now, unit, unit
  float length = 0, depth = 0;  // [m] from where the tip goes in to where it comes out; below the surface
};

// [rad] of the needle from where its tip meets the surface to where it is deepest.
float half_bite(const PictureModel& picture, const BiteGuide& guide);
// The needle with its tip `psi` [rad] past the deepest place; `away` [m] outward of the tissue.
Pose needle_on(const PictureModel& picture, const BiteGuide& guide, float psi, float away = 0);
inline Vec3 entry_of(const BiteGuide& g) { return g.at - g.along * (0.5f * g.length); }
inline Vec3 exit_of(const BiteGuide& g) { return g.at + g.along * (0.5f * g.length); }
// Place s of the needle's arc, 0 swage .. 1 tip.
Vec3 on_needle(const PictureModel& picture, const Pose& needle, float s);

}  // namespace catgut
