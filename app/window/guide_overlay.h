// SPDX-License-Identifier: Apache-2.0
// app/window: the planned bite over the image: the circle that the needle's tip should follow, its entry and its exit (blue:
// within tolerance, orange: outside).
#pragma once
#include "device/steer.h"

namespace catgut {

// width, height: of the window [pixels].
void guide_overlay(const BiteGuide& guide, const ViewFrame& view, const PictureModel& picture, const Snapshot& seen,
                   float width, float height);

}  // namespace catgut
