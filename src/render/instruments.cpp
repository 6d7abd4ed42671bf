// SPDX-License-Identifier: Apache-2.0
// render/shapes: needle, needle holder and forceps; see shapes.h. Sizes follow common surgical instruments:
// a 180 mm needle holder with gold rings, 150 mm tissue forceps.
#include <vector>

#include "render/shapes.h"

namespace catgut {
namespace {

constexpr float mm = 0.001f;

void add_line_tube(Shape& shape, std::span<const Vec3> through, float r0, float r1, Vec3 color) {
  std::vector<Vec3> center;
  smooth_curve(through, 8, center);
  std::vector<float> radius(center.size());
  for (size_t i = 0; i < center.size(); ++i) radius[i] = r0 + (r1 - r0) * float(i) / float(center.size() - 1);
  add_tube(shape, center, radius, 14, color);
}

void add_ring(Shape& shape, Vec3 center, float rx, float rz, float wire, Vec3 color) {
  std::vector<Vec3> points;
  for (int i = 0; i <= 40; ++i) {
    const float a = 2 * kPi * float(i) / 40;
    points.push_back(center + Vec3{rx * std::cos(a), 0, rz * std::sin(a)});
  }
  const std::vector<float> radius(points.size(), wire);
  add_tube(shape, points, radius, 12, color);
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
  // In reality the shank of the other side belongs to this jaw; drawn on its own side, the crossing is hidden in the box joint.
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

// Long, slim, without teeth: two parallel rows of fine ridges at flat tips.
ToolShape debakey() {
  const Vec3 steel = srgb(206, 210, 218), grip = srgb(120, 126, 136);
  ToolShape tool;
  tool.pivot = 150 * mm;
  tool.opening = 0.03f;
  const Section arm[] = {{{0.5f * mm, 0, -1.5f * mm}, 0.4f * mm, 1.0f * mm}, {{0.6f * mm, 0, 18 * mm}, 0.5f * mm, 1.1f * mm},
                         {{1.8f * mm, 0, 40 * mm}, 0.7f * mm, 1.8f * mm},    {{4.4f * mm, 0, 60 * mm}, 0.8f * mm, 3.4f * mm},
                         {{5.4f * mm, 0, 90 * mm}, 0.8f * mm, 4.4f * mm},    {{3.0f * mm, 0, 130 * mm}, 0.8f * mm, 4.2f * mm},
                         {{0.9f * mm, 0, 158 * mm}, 0.9f * mm, 3.2f * mm}};
  add_loft(tool.half, arm, steel);
  for (size_t i = 0; i < tool.half.position.size(); ++i)
    tool.half.hatched.push_back(tool.half.position[i].z < 18 * mm && tool.half.normal[i].x < -0.4f ? 1.0f : 0.0f);
  const Section hold[] = {{{5.9f * mm, 0, 64 * mm}, 0.5f * mm, 3.2f * mm}, {{5.9f * mm, 0, 96 * mm}, 0.5f * mm, 3.8f * mm}};
  add_loft(tool.half, hold, grip);
  const Section end[] = {{{0, 0, 150 * mm}, 1.5f * mm, 3.6f * mm}, {{0, 0, 160 * mm}, 1.5f * mm, 2.8f * mm}};
  add_loft(tool.body, end, steel);
  return tool;
}

// The two shanks with finger rings of clamps and scissors; `ratchet`: the catch between them.
void add_ring_handles(ToolShape& tool, float joint, float length, Vec3 steel, Vec3 ring, bool ratchet) {
  const Vec3 shank[] = {{1.6f * mm, 0, joint + 4 * mm},
                        {3.0f * mm, 0, joint + 0.3f * (length - joint)},
                        {6.0f * mm, 0, joint + 0.7f * (length - joint)},
                        {11 * mm, 0, length - 14 * mm}};
  add_line_tube(tool.half, shank, 2.0f * mm, 1.7f * mm, steel);
  add_ring(tool.half, {14 * mm, 0, length}, 9.5f * mm, 12 * mm, 1.8f * mm, ring);
  const Section box[] = {{{0, 0, joint - 4 * mm}, 2.4f * mm, 2.0f * mm},
                         {{0, 0, joint}, 3.6f * mm, 2.6f * mm},
                         {{0, 0, joint + 5 * mm}, 2.6f * mm, 2.1f * mm}};
  add_loft(tool.body, box, steel, 5);
  if (!ratchet) return;
  const Section teeth[] = {{{4 * mm, 0, length - 22 * mm}, 4.5f * mm, 0.8f * mm},
                           {{4 * mm, 0, length - 18 * mm}, 4.5f * mm, 0.8f * mm}};
  add_loft(tool.half, teeth, steel);
}

// Jaws that bow apart and meet in broad, toothed ends.
ToolShape allis() {
  const Vec3 steel = srgb(224, 222, 214), teeth = srgb(150, 146, 138);
  ToolShape tool;
  tool.pivot = 45 * mm;
  tool.opening = 0.18f;
  const Vec3 bow[] = {{0.9f * mm, 0, 0.5f * mm}, {3.4f * mm, 0, 9 * mm}, {4.0f * mm, 0, 22 * mm}, {1.4f * mm, 0, 43 * mm}};
  add_line_tube(tool.half, bow, 1.0f * mm, 1.7f * mm, steel);
  tool.half.hatched.resize(tool.half.position.size(), 0);
  const Section end[] = {{{0.7f * mm, 0, -1.2f * mm}, 0.6f * mm, 3.0f * mm}, {{0.8f * mm, 0, 1.2f * mm}, 0.7f * mm, 2.6f * mm}};
  add_loft(tool.half, end, teeth);
  tool.half.hatched.resize(tool.half.position.size(), 1);
  add_ring_handles(tool, 45 * mm, 150 * mm, steel, steel, true);
  return tool;
}

ToolShape scissors() {
  const Vec3 steel = srgb(226, 228, 232), black = srgb(44, 46, 52);
  ToolShape tool;
  tool.pivot = 40 * mm;
  tool.opening = 0.22f;
  const Section blade[] = {{{0.3f * mm, 0, -3 * mm}, 0.25f * mm, 0.4f * mm},
                           {{0.6f * mm, 0, 4 * mm}, 0.5f * mm, 1.2f * mm},
                           {{1.3f * mm, 0, 22 * mm}, 1.1f * mm, 1.9f * mm},
                           {{1.9f * mm, 0, 42 * mm}, 1.8f * mm, 2.3f * mm}};
  add_loft(tool.half, blade, steel);
  add_ring_handles(tool, 40 * mm, 145 * mm, steel, black, false);
  return tool;
}

// A pencil of plastic with a flat steel tip, its buttons and its cable.
ToolShape cautery() {
  const Vec3 plastic = srgb(34, 84, 150), tip = srgb(190, 188, 180), yellow = srgb(236, 200, 60), blue = srgb(90, 170, 230);
  ToolShape tool;
  const Section blade[] = {{{0, 0, -1 * mm}, 0.25f * mm, 0.9f * mm}, {{0, 0, 18 * mm}, 0.35f * mm, 1.2f * mm}};
  add_loft(tool.body, blade, tip);
  const Section collar[] = {{{0, 0, 17 * mm}, 1.8f * mm, 1.8f * mm}, {{0, 0, 27 * mm}, 4.2f * mm, 4.2f * mm}};
  add_loft(tool.body, collar, srgb(230, 230, 226), 2.5f);
  const Section barrel[] = {{{0, 0, 26 * mm}, 4.6f * mm, 4.6f * mm},
                            {{0, 0, 60 * mm}, 5.4f * mm, 5.4f * mm},
                            {{0, 0, 140 * mm}, 4.4f * mm, 4.4f * mm}};
  add_loft(tool.body, barrel, plastic, 2.5f);
  const Section cut[] = {{{0, 5.0f * mm, 40 * mm}, 1.8f * mm, 1.0f * mm}, {{0, 5.2f * mm, 47 * mm}, 1.8f * mm, 1.0f * mm}};
  add_loft(tool.body, cut, yellow);
  const Section coagulate[] = {{{0, 5.3f * mm, 50 * mm}, 1.8f * mm, 1.0f * mm},
                               {{0, 5.4f * mm, 57 * mm}, 1.8f * mm, 1.0f * mm}};
  add_loft(tool.body, coagulate, blue);
  const Vec3 cable[] = {{0, 0, 138 * mm}, {4 * mm, -8 * mm, 165 * mm}, {16 * mm, -30 * mm, 195 * mm}};
  add_line_tube(tool.body, cable, 1.8f * mm, 1.8f * mm, srgb(40, 42, 46));
  return tool;
}

// A flat blade, bent over at its end, on a long handle.
ToolShape retractor() {
  const Vec3 steel = srgb(214, 217, 222);
  ToolShape tool;
  const Section hook[] = {{{0, -9 * mm, 1 * mm}, 5.5f * mm, 0.7f * mm},
                          {{0, -2 * mm, -1 * mm}, 5.8f * mm, 0.8f * mm},
                          {{0, 0, 3 * mm}, 5.8f * mm, 1.0f * mm}};
  add_loft(tool.body, hook, steel);
  const Section blade[] = {{{0, 0, 2 * mm}, 5.8f * mm, 0.8f * mm},
                           {{0, 0, 40 * mm}, 5.4f * mm, 0.9f * mm},
                           {{0, 0, 70 * mm}, 3.2f * mm, 1.6f * mm},
                           {{0, 0, 150 * mm}, 3.4f * mm, 2.2f * mm}};
  add_loft(tool.body, blade, steel);
  return tool;
}

}  // namespace

Shape needle_shape(const SuturePicture& model) {
  constexpr int n = 64;
  std::vector<Vec3> center;
  std::vector<float> radius;
  const float wire = model.needle_wire_radius, r = model.needle_radius;
  for (int i = 0; i <= n; ++i) {
    const float s = float(i) / n, phi = s * model.needle_arc;
    center.push_back({r * std::cos(phi), r * std::sin(phi), 0});
    // The swage is drilled and slightly thicker than its thread; the last fifth tapers to the point.
    const float to_tip = (1 - s) / 0.2f;
    radius.push_back(wire * (to_tip < 1  ? 0.04f + 0.96f * std::sqrt(to_tip) * (1.5f - 0.5f * to_tip)
                             : s < 0.06f ? 1.08f
                                         : 1.0f));
  }
  Shape shape;
  add_tube(shape, center, radius, 12, srgb(228, 230, 234));
  return shape;
}

ToolShape tool_shape(const InstrumentPicture& instrument) {
  struct Row {
    const char* kind;
    ToolShape (*shape)();
  };
  static constexpr Row kRow[] = {
      {"needle_holder", needle_driver}, {"forceps", forceps}, {"debakey", debakey},    {"allis", allis},
      {"scissors", scissors},           {"cautery", cautery}, {"retractor", retractor}};
  for (const Row& row : kRow)
    if (instrument.kind == row.kind) return row.shape();
  ToolShape tool;
  for (const InstrumentPicture::Rod& rod : instrument.outline) {
    const Vec3 ends[] = {rod.a, lerp(rod.a, rod.b, 0.5f), rod.b};
    const float radius[] = {rod.radius, rod.radius, rod.radius};
    add_tube(tool.body, ends, radius, 14, srgb(200, 202, 208));
  }
  return tool;
}

}  // namespace catgut
