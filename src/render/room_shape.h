// SPDX-License-Identifier: Apache-2.0
// render/room_shape: the operating room around the field, for the wearer of a headset, who looks past the drape: the table's
// cloth down to the floor, floor, walls, ceiling and the lamp. Plain geometry. Its light is part of its colors.
#pragma once
#include "render/shapes.h"

namespace catgut {

// [m] in the world, around the drape's center. lamp: unit, from the work to the main lamp.
// cloth: false where the scene has its own drape.
Shape room_shape(Vec3 center, Vec3 lamp, bool cloth);

}  // namespace catgut
