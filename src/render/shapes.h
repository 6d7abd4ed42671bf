// SPDX-License-Identifier: Apache-2.0
// render/shapes: triangle meshes from a few numbers: tubes, lofts, tools, needle, drape. Plain geometry, no graphics
// library; [m] throughout, counter-clockwise seen from outside.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "exchange/picture.h"

namespace catgut {

struct Shape {
  std::vector<Vec3> position, normal, tangent;  // tangent: along the u of uv
  std::vector<std::array<float, 2>> uv;
  std::vector<Vec3> color;     // linear
  std::vector<float> hatched;  // 1 on gripping faces of tools; may be shorter than the others, then smooth
  std::vector<std::array<uint32_t, 3>> triangle;
};

Vec3 srgb(int r, int g, int b);  // linear color of 8-bit sRGB values

// A round tube along `center` with a radius per point, `sides` corners and closed ends. u runs along it [m], v round it 0..1.
// The frame is transported along the curve without twist, so a pattern on the tube does not twist.
void add_tube(Shape& shape, std::span<const Vec3> center, std::span<const float> radius, int sides, Vec3 color);

// Cross-sections in the xy plane with rounded corners, joined along their order.
struct Section {
  Vec3 center;
  float half_x = 0, half_y = 0;
};
void add_loft(Shape& shape, std::span<const Section> sections, Vec3 color, float squareness = 4);

void add_ball(Shape& shape, Vec3 center, float radius, Vec3 color);
void add_shape(Shape& to, const Shape& from);
Shape moved(Shape shape, const Pose& pose);
Shape mirrored_x(Shape shape);

// Points of a Catmull-Rom curve through `through`, `per_span` pieces a span, last point included. Written to `out`.
void smooth_curve(std::span<const Vec3> through, int per_span, std::vector<Vec3>& out);

// In the needle's frame. least_radius: [m] of the drawn wire, half of it at the point, so that it never falls between the
// pixels.
Shape needle_shape(const SuturePicture& model, float least_radius = 0);

// A tool in its frame (origin between the jaw tips, shaft along +z): the fixed part, and the half that opens toward +x.
// The other half is the mirror image. The halves rotate about the y axis at z = pivot by up to `opening` radians each.
struct ToolShape {
  Shape body, half;
  Shape gauze;        // fixed part, not of metal
  float pivot = 0;    // [m]
  float opening = 0;  // [rad]
};
// By kind; an instrument of an unknown kind is drawn as its outline.
ToolShape tool_shape(const InstrumentPicture& instrument);

// The sterile drape: a cloth with folds at height center.y, with a hole along an ellipse about (center.x, center.z) that is
// `hole` wide at least; 0: without a hole.
Shape drape_shape(Vec3 center, float hole, float size);
// What lies in the drape's hole round the organ: the fat of the wound's edges.
Shape wound_bed_shape(Vec3 center, float radius);
float hole_radius(float hole, float angle);  // [m] of the ellipse

// A damp gauze swab over the end of an organ that lies on the drape. `body`: its surface; `away`: unit, horizontal, from the
// work to that end. It hangs down to height `ground` on all sides except the one toward the work.
Shape swab_shape(std::span<const Vec3> body, Vec3 away, float ground);
// A roll of gauze under it, from `from` to `to` [m] along `away` from `middle`.
Shape cushion_shape(Vec3 middle, Vec3 away, float from, float to, float top, float ground);

}  // namespace catgut
