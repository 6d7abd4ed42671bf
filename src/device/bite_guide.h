// SPDX-License-Identifier: Apache-2.0
// device: the planned position of the next bite, as a circle for the needle. Used by the assist that moves a held needle there,
// by the displayed ghost needle, and for the distance shown to the user. Plain data and arithmetic.
#pragma once
#include "exchange/picture.h"
#include "exchange/snapshot.h"

namespace catgut {

// The needle turns about cross(along, out); its tip enters along `along` and is deepest at `at - out * depth`.
struct BiteGuide {
  Vec3 at, out, along;          // [m] on the current surface, unit, unit
  float length = 0, depth = 0;  // [m] from entry to exit; below the surface
  uint32_t suture = 0;          // whose needle makes it
};

// [rad] of the needle from where its tip meets the surface to where it is deepest.
float half_bite(const PictureModel& picture, const BiteGuide& guide);
// The needle with its tip `psi` [rad] past the deepest point; `away` [m] outward of the tissue.
Pose needle_on(const PictureModel& picture, const BiteGuide& guide, float psi, float away = 0);
inline Vec3 entry_of(const BiteGuide& g) { return g.at - g.along * (0.5f * g.length); }
inline Vec3 exit_of(const BiteGuide& g) { return g.at + g.along * (0.5f * g.length); }
// Fraction s of the needle's arc, 0 swage .. 1 tip.
Vec3 on_needle(const PictureModel& picture, const Pose& needle, float s, size_t suture = 0);

}  // namespace catgut
