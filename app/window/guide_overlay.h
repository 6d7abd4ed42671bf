// SPDX-License-Identifier: Apache-2.0
// app/window: the planned bite over the image: the circle that the needle's tip should follow, its entry and its exit (blue:
// within tolerance, orange: outside). The line of a planned cut.
#pragma once
#include <span>

#include "device/steer.h"
#include "runtime/planned_line.h"
#include "window/layout.h"

namespace catgut {

// area: of the window, which `view` fills.
void guide_overlay(const BiteGuide& guide, const ViewFrame& view, const PictureModel& picture, const Snapshot& seen,
                   const PanelRect& area);

void line_overlay(std::span<const LinePiece> line, const ViewFrame& view, const PanelRect& area);

}  // namespace catgut
