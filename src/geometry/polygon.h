// SPDX-License-Identifier: Apache-2.0
// geometry/polygon: measures of a closed loop of points (the rim of an opening, a loop of thread). The last point joins the
// first.
#pragma once
#include <span>

#include "core/math.h"

namespace catgut {

// [m^2] area of the loop projected on its best-fit plane (half the length of Newell's vector). 0 for fewer than three points.
float loop_area(std::span<const Vec3> loop);
// Unit normal of that plane: the loop runs counter-clockwise about it. {0,0,0} for a loop without area.
Vec3 loop_normal(std::span<const Vec3> loop);
// [m] perimeter of the loop.
float loop_length(std::span<const Vec3> loop);
// [m] center of the loop as a curve (each edge weighted by its length: uneven spacing does not bias it).
Vec3 loop_center(std::span<const Vec3> loop);

}  // namespace catgut
