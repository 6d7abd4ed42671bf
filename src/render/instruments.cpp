// render/shapes: needle, needle driver and forceps; see shapes.h. Sizes follow the instruments on a surgeon's table:
// a 180 mm needle holder with gold rings, 150 mm tissue forceps.
#include <vector>

#include "render/shapes.h"

namespace catgut {
namespace {

constexpr float mm = 0.001f;

void add_line_tube(Shape& shape, std::span<const Vec3> through, float r0, float r1, Vec3 colour) {
  std::vector<Vec3> centre;
  smooth_curve(through, 8, centre);
  std::vector<float> radius(centre.size());
  for (size_t i = 0; i < centre.size(); ++i) radius[i] = r0 + (r1 - r0) * float(i) / float(centre.size() - 1);
  add_tube(shape, centre, radius, 14, colour);
}

void add_ring(Shape& shape, Vec3 centre, float rx, float rz, float wire, Vec3 colour) {
  std::vector<Vec3> points;
  for (int i = 0; i <= 40; ++i) {
    const float a = 2 * kPi * float(i) / 40;
    points.push_back(centre + Vec3{rx * std::cos(a), 0, rz * std::sin(a)});
  }
  const std::vector<float> radius(points.size(), wire);
  add_tube(shape, points, radius, 12, colour);
}

ToolShape needle_driver() {
  const Vec3 steel = srgb(222, 224, 228), carbide = srgb(120, 122, 126), gold = srgb(212, 172, 92);
  ToolShape tool;
  tool.pivot = 26 * mm;
  tool.opening = 0.16f;
  // One jaw: flat inside at x = 0, the grasp point a little behind the tip.
  const Section jaw[] = {
      {{1.0f * mm, 0, -2.5f * mm}, 0.62f * mm, 0.9f * mm}, {{1.1f * mm, 0, -1.8f * mm}, 0.78f * mm, 1.15f * mm},
      {{1.25f * mm, 0, 4 * mm}, 0.95f * mm, 1.4f * mm},    {{1.75f * mm, 0, 14 * mm}, 1.45f * mm, 2.0f * mm},
      {{2.3f * mm, 0, 21 * mm}, 2.0f * mm, 2.5f * mm},     {{2.2f * mm, 0, 27 * mm}, 2.1f * mm, 2.7f * mm}};
  add_loft(tool.half, jaw, steel);
  const Section insert[] = {{{0.28f * mm, 0, -2.3f * mm}, 0.26f * mm, 0.82f * mm},
                            {{0.28f * mm, 0, 13 * mm}, 0.26f * mm, 1.5f * mm}};
  tool.half.hatched.resize(tool.half.position.size(), 0);
  add_loft(tool.half, insert, carbide, 8);
  tool.half.hatched.resize(tool.half.position.size(), 1);
  // The shank of the other side belongs to this jaw in life; drawn on its own side, the crossing hides in the box joint.
  const Vec3 shank[] = {{1.9f * mm, 0, 30 * mm},
                        {3.4f * mm, 0, 50 * mm},
                        {5.2f * mm, 0, 90 * mm},
                        {8.5f * mm, 0, 130 * mm},
                        {13 * mm, 0, 152 * mm}};
  add_line_tube(tool.half, shank, 2.3f * mm, 1.9f * mm, steel);
  add_ring(tool.half, {16 * mm, 0, 165 * mm}, 10.5f * mm, 14 * mm, 2.0f * mm, gold);
  const Section joint[] = {{{0, 0, 19.5f * mm}, 3.1f * mm, 2.5f * mm},
                           {{0, 0, 21 * mm}, 4.2f * mm, 3.0f * mm},
                           {{0, 0, 31 * mm}, 4.4f * mm, 3.1f * mm},
                           {{0, 0, 35 * mm}, 3.6f * mm, 2.7f * mm},
                           {{0, 0, 37 * mm}, 2.9f * mm, 2.2f * mm}};
  add_loft(tool.body, joint, steel, 5);
  for (const float s : {-1.0f, 1.0f}) {
    const Vec3 pin[] = {{0, s * 2.8f * mm, 26 * mm}, {0, s * 3.2f * mm, 26 * mm}, {0, s * 3.35f * mm, 26 * mm}};
    const float r[] = {1.9f * mm, 1.9f * mm, 1.5f * mm};
    add_tube(tool.body, pin, r, 16, srgb(160, 162, 168));
  }
  return tool;
}

ToolShape forceps() {
  const Vec3 steel = srgb(218, 220, 225), grip = srgb(150, 153, 158);
  ToolShape tool;
  tool.pivot = 140 * mm;
  tool.opening = 0.03f;
  const Section arm[] = {{{0.6f * mm, 0, -1.5f * mm}, 0.5f * mm, 0.7f * mm}, {{0.75f * mm, 0, 0}, 0.7f * mm, 0.95f * mm},
                         {{1.1f * mm, 0, 8 * mm}, 0.8f * mm, 1.2f * mm},     {{2.3f * mm, 0, 22 * mm}, 0.9f * mm, 1.9f * mm},
                         {{4.6f * mm, 0, 42 * mm}, 0.85f * mm, 3.6f * mm},   {{6.0f * mm, 0, 65 * mm}, 0.8f * mm, 4.9f * mm},
                         {{5.6f * mm, 0, 95 * mm}, 0.8f * mm, 5.1f * mm},    {{3.2f * mm, 0, 125 * mm}, 0.8f * mm, 4.7f * mm},
                         {{1.0f * mm, 0, 142 * mm}, 0.9f * mm, 4.0f * mm},   {{0.9f * mm, 0, 150 * mm}, 0.9f * mm, 3.4f * mm}};
  add_loft(tool.half, arm, steel);
  for (size_t i = 0; i < tool.half.position.size(); ++i)  // the tips grip with their inner faces
    tool.half.hatched.push_back(tool.half.position[i].z < 9 * mm && tool.half.normal[i].x < -0.4f ? 1.0f : 0.0f);
  // Ridges for the fingers.
  for (int i = 0; i < 9; ++i) {
    const float z = (56 + 3.2f * float(i)) * mm;
    const Section ridge[] = {{{6.5f * mm, 0, z}, 0.45f * mm, 3.4f * mm},
                             {{6.5f * mm, 0, z + 1.4f * mm}, 0.45f * mm, 3.4f * mm}};
    add_loft(tool.half, ridge, grip);
  }
  const Section end[] = {{{0, 0, 140 * mm}, 1.6f * mm, 4.1f * mm}, {{0, 0, 151 * mm}, 1.6f * mm, 3.2f * mm}};
  add_loft(tool.body, end, steel);
  return tool;
}

}  // namespace

Shape needle_shape(const PictureModel& model) {
  constexpr int n = 64;
  std::vector<Vec3> centre;
  std::vector<float> radius;
  const float wire = model.needle_wire_radius, r = model.needle_radius;
  for (int i = 0; i <= n; ++i) {
    const float s = float(i) / n, phi = s * model.needle_arc;
    centre.push_back({r * std::cos(phi), r * std::sin(phi), 0});
    // The swage is drilled and a little thicker than the thread it holds; the last fifth tapers to the point.
    const float to_tip = (1 - s) / 0.2f;
    radius.push_back(wire * (to_tip < 1  ? 0.04f + 0.96f * std::sqrt(to_tip) * (1.5f - 0.5f * to_tip)
                             : s < 0.06f ? 1.08f
                                         : 1.0f));
  }
  Shape shape;
  add_tube(shape, centre, radius, 12, srgb(228, 230, 234));
  return shape;
}

ToolShape tool_shape(ToolKind kind) { return kind == ToolKind::needle_driver ? needle_driver() : forceps(); }

}  // namespace catgut
