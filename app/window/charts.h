// SPDX-License-Identifier: Apache-2.0
// app/window: line charts of results: the unrolled edge with every bite, and the thread's tension
// over time. Drawn with ImGui draw lists into the remaining space of the panel.
#pragma once
#include <imgui.h>

#include <vector>

#include "assess/stitch_map.h"

namespace catgut {

enum class BiteColor { spacing, depth, edge };

// Dark blue over gray to yellow (cividis): monotonic lightness for all types of color vision. part: 0..1.
ImU32 scale_color(float part, float alpha = 1);
// The value that colors a bite, 0..1, and whether it is known.
float bite_part(const StitchBite& bite, BiteColor by, bool& known);

// The edges of all walls side by side, cut open at their start: along the edge to the right, away from it up or down.
void stitch_map_chart(const StitchMap& map, BiteColor by, ImVec2 size);
void scale_legend(BiteColor by, float width);

// from, to: ticks at the left and right end. now: a line there; negative: none.
void tension_chart(const StitchMap& map, uint64_t from, uint64_t to, double now, ImVec2 size, bool labels);

// Events that are marked on a time line, and their marks.
enum class Mark { none, bite, knot, cut, suture, fault };
Mark mark_of(const Event& event);
void draw_mark(ImDrawList& list, ImVec2 at, Mark mark, float size);
void mark_legend();

}  // namespace catgut
