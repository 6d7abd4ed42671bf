// SPDX-License-Identifier: Apache-2.0
// render/shapes: needle, needle holder and forceps; see shapes.h. Sizes follow common surgical instruments:
// a 180 mm Mayo-Hegar needle holder, 120 mm Adson and 160 mm DeBakey forceps.
#include <cmath>
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

// A loft through sections that a smooth curve joins, `per_span` pieces between two.
void add_smooth_loft(Shape& shape, std::span<const Section> through, Vec3 color, float squareness = 4, int per_span = 6) {
  std::vector<Vec3> center, half;
  for (const Section& s : through) center.push_back(s.center), half.push_back({s.half_x, s.half_y, 0});
  std::vector<Vec3> at, size;
  smooth_curve(center, per_span, at);
  smooth_curve(half, per_span, size);
  std::vector<Section> section(at.size());
  for (size_t i = 0; i < at.size(); ++i) section[i] = {at[i], size[i].x, size[i].y};
  add_loft(shape, section, color, squareness);
}

void mark_hatched(Shape& shape, float value) { shape.hatched.resize(shape.position.size(), value); }

// Mayo-Hegar, 180 mm: short jaws with carbide inserts, box joint with screw, ratchet, gold rings (which mark the carbide).
ToolShape needle_driver() {
  const Vec3 steel = srgb(214, 217, 222), carbide = srgb(112, 114, 118), gold = srgb(218, 176, 88), dark = srgb(52, 54, 58);
  ToolShape tool;
  tool.pivot = 26 * mm;
  tool.opening = 0.16f;
  // One jaw: flat inside at x = 0, round outside, the grasp point a little behind the tip.
  const Section jaw[] = {
      {{0.95f * mm, 0, -2.5f * mm}, 0.45f * mm, 0.75f * mm}, {{1.05f * mm, 0, -2.1f * mm}, 0.68f * mm, 1.05f * mm},
      {{1.15f * mm, 0, -1.0f * mm}, 0.82f * mm, 1.22f * mm}, {{1.3f * mm, 0, 4 * mm}, 0.98f * mm, 1.45f * mm},
      {{1.65f * mm, 0, 11 * mm}, 1.34f * mm, 1.85f * mm},    {{2.05f * mm, 0, 17 * mm}, 1.75f * mm, 2.25f * mm},
      {{2.3f * mm, 0, 22 * mm}, 2.0f * mm, 2.5f * mm},       {{2.2f * mm, 0, 27 * mm}, 2.1f * mm, 2.6f * mm}};
  add_smooth_loft(tool.half, jaw, steel, 3);
  mark_hatched(tool.half, 0);
  // The insert stands a hair proud of its pocket, whose edge shows as a dark line.
  const Section pocket[] = {{{0.42f * mm, 0, -2.42f * mm}, 0.16f * mm, 0.95f * mm},
                            {{0.42f * mm, 0, 13.6f * mm}, 0.16f * mm, 1.72f * mm}};
  add_loft(tool.half, pocket, dark, 8);
  mark_hatched(tool.half, 0);
  const Section insert[] = {{{0.26f * mm, 0, -2.35f * mm}, 0.25f * mm, 0.84f * mm},
                            {{0.26f * mm, 0, 13.3f * mm}, 0.25f * mm, 1.58f * mm}};
  add_loft(tool.half, insert, carbide, 8);
  mark_hatched(tool.half, 1);
  // In reality the shank of the other side belongs to this jaw; drawn on its own side, the crossing is hidden in the box joint.
  const Section shank[] = {{{1.75f * mm, 0, 29 * mm}, 1.9f * mm, 2.3f * mm}, {{2.3f * mm, 0, 42 * mm}, 2.0f * mm, 2.2f * mm},
                           {{3.6f * mm, 0, 65 * mm}, 1.95f * mm, 2.1f * mm}, {{5.6f * mm, 0, 95 * mm}, 1.8f * mm, 2.0f * mm},
                           {{8.4f * mm, 0, 128 * mm}, 1.7f * mm, 1.9f * mm}, {{10.6f * mm, 0, 144 * mm}, 1.7f * mm, 1.9f * mm},
                           {{13.2f * mm, 0, 153 * mm}, 1.9f * mm, 1.9f * mm}};
  add_smooth_loft(tool.half, shank, steel, 2.4f);
  mark_hatched(tool.half, 0);
  add_ring(tool.half, {17.5f * mm, 0, 165.5f * mm}, 10.5f * mm, 14 * mm, 2.0f * mm, gold);
  mark_hatched(tool.half, 0);
  // The ratchet: a bar from each shank, toothed where they meet.
  const Section bar[] = {{{5.2f * mm, 0.9f * mm, 134 * mm}, 5.4f * mm, 0.8f * mm},
                         {{5.2f * mm, 0.9f * mm, 138.5f * mm}, 5.4f * mm, 0.8f * mm}};
  add_loft(tool.half, bar, steel, 6);
  mark_hatched(tool.half, 0);
  const Section teeth[] = {{{1.8f * mm, 0, 134.4f * mm}, 2.2f * mm, 0.25f * mm},
                           {{1.8f * mm, 0, 138.1f * mm}, 2.2f * mm, 0.25f * mm}};
  add_loft(tool.half, teeth, steel, 8);
  mark_hatched(tool.half, 1);
  const Section joint[] = {{{0, 0, 17.5f * mm}, 2.6f * mm, 2.2f * mm}, {{0, 0, 19 * mm}, 3.6f * mm, 2.75f * mm},
                           {{0, 0, 22 * mm}, 4.35f * mm, 3.0f * mm},   {{0, 0, 27 * mm}, 4.6f * mm, 3.05f * mm},
                           {{0, 0, 32 * mm}, 4.3f * mm, 3.0f * mm},    {{0, 0, 36 * mm}, 3.6f * mm, 2.75f * mm},
                           {{0, 0, 40 * mm}, 3.0f * mm, 2.3f * mm}};
  add_smooth_loft(tool.body, joint, steel, 5);
  for (const float s : {-1.0f, 1.0f}) {
    // The edges of the slot through which one half passes the other, the screw and the screw's slot.
    for (const float side : {-1.0f, 1.0f}) {
      const Section edge[] = {{{side * 2.9f * mm, s * 2.92f * mm, 20.5f * mm}, 0.07f * mm, 0.14f * mm},
                              {{side * 1.9f * mm, s * 2.94f * mm, 34 * mm}, 0.07f * mm, 0.14f * mm}};
      add_loft(tool.body, edge, dark, 6);
    }
    const Vec3 pin[] = {
        {0, s * 2.8f * mm, 26 * mm}, {0, s * 3.12f * mm, 26 * mm}, {0, s * 3.2f * mm, 26 * mm}, {0, s * 3.22f * mm, 26 * mm}};
    const float r[] = {2.1f * mm, 2.1f * mm, 1.9f * mm, 0.2f * mm};
    add_tube(tool.body, pin, r, 24, srgb(186, 188, 194));
    const Section slot[] = {{{0, s * 3.21f * mm, 24.5f * mm}, 0.2f * mm, 0.04f * mm},
                            {{0, s * 3.21f * mm, 27.5f * mm}, 0.2f * mm, 0.04f * mm}};
    add_loft(tool.body, slot, dark, 8);
  }
  return tool;
}

// Adson, 120 mm: a broad, ridged grip that narrows abruptly to fine tips with one tooth into two.
ToolShape forceps() {
  const Vec3 steel = srgb(212, 215, 221), shade = srgb(150, 153, 158);
  ToolShape tool;
  tool.pivot = 112 * mm;
  tool.opening = 0.036f;
  const Section arm[] = {
      {{0.5f * mm, 0, -1.5f * mm}, 0.35f * mm, 0.5f * mm}, {{0.65f * mm, 0, -0.4f * mm}, 0.55f * mm, 0.72f * mm},
      {{0.95f * mm, 0, 6 * mm}, 0.62f * mm, 0.85f * mm},   {{1.7f * mm, 0, 14 * mm}, 0.68f * mm, 1.1f * mm},
      {{2.7f * mm, 0, 22 * mm}, 0.72f * mm, 1.7f * mm},    {{3.7f * mm, 0, 29 * mm}, 0.72f * mm, 4.2f * mm},
      {{4.5f * mm, 0, 36 * mm}, 0.72f * mm, 5.8f * mm},    {{5.4f * mm, 0, 50 * mm}, 0.72f * mm, 6.1f * mm},
      {{5.5f * mm, 0, 68 * mm}, 0.72f * mm, 5.9f * mm},    {{4.4f * mm, 0, 88 * mm}, 0.75f * mm, 4.9f * mm},
      {{2.4f * mm, 0, 106 * mm}, 0.85f * mm, 4.2f * mm},   {{0.9f * mm, 0, 118 * mm}, 0.9f * mm, 3.8f * mm}};
  add_smooth_loft(tool.half, arm, steel, 4.5f);
  for (size_t i = 0; i < tool.half.position.size(); ++i)  // the tips grip with their inner faces
    tool.half.hatched.push_back(tool.half.position[i].z < 5 * mm && tool.half.normal[i].x < -0.4f ? 1.0f : 0.0f);
  // Fine cross ridges for thumb and finger, raised on the grip's outer face.
  for (int i = 0; i < 14; ++i) {
    const float z = (38 + 2.3f * float(i)) * mm, x = (4.62f + 0.9f * std::sin(0.11f * float(i) + 0.05f)) * mm;
    const Section ridge[] = {{{x + 0.45f * mm, 0, z}, 0.42f * mm, 4.9f * mm},
                             {{x + 0.62f * mm, 0, z + 0.55f * mm}, 0.44f * mm, 4.9f * mm},
                             {{x + 0.5f * mm, 0, z + 1.1f * mm}, 0.42f * mm, 4.9f * mm}};
    add_loft(tool.half, ridge, shade, 6);
  }
  mark_hatched(tool.half, 0);
  const Section tooth[] = {{{0.32f * mm, 0.32f * mm, -1.45f * mm}, 0.34f * mm, 0.10f * mm},
                           {{0.42f * mm, 0.32f * mm, -0.5f * mm}, 0.42f * mm, 0.16f * mm}};
  add_loft(tool.half, tooth, steel, 2);
  mark_hatched(tool.half, 0);
  const Section end[] = {{{0, 0, 111 * mm}, 1.5f * mm, 3.9f * mm},
                         {{0, 0, 117 * mm}, 1.7f * mm, 3.6f * mm},
                         {{0, 0, 121 * mm}, 1.3f * mm, 2.6f * mm}};
  add_smooth_loft(tool.body, end, steel);
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
  add_smooth_loft(tool.half, arm, steel, 4.5f);
  for (size_t i = 0; i < tool.half.position.size(); ++i)
    tool.half.hatched.push_back(tool.half.position[i].z < 18 * mm && tool.half.normal[i].x < -0.4f ? 1.0f : 0.0f);
  // Flutes along the grip.
  for (const float y : {-2.1f, -1.05f, 0.0f, 1.05f, 2.1f}) {
    const Section flute[] = {{{5.0f * mm, y * mm, 64 * mm}, 0.42f * mm, 0.32f * mm},
                             {{5.9f * mm, y * mm, 80 * mm}, 0.42f * mm, 0.34f * mm},
                             {{5.85f * mm, y * mm, 96 * mm}, 0.42f * mm, 0.34f * mm}};
    add_smooth_loft(tool.half, flute, grip, 3);
  }
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

// A ball of folded gauze between the rings of a sponge forceps.
ToolShape swab() {
  const Vec3 steel = srgb(214, 217, 222), gauze = srgb(232, 230, 220), damp = srgb(214, 176, 164);
  ToolShape tool;
  tool.pivot = 45 * mm;
  add_ball(tool.gauze, {0, 0, 4.4f * mm}, 4.4f * mm, gauze);
  for (int i = 0; i < 9; ++i) {  // folds
    const float a = 2.4f * float(i), z = (1.2f + 0.8f * float(i)) * mm,
                r = 2.4f * mm * std::sqrt(1 - std::pow(float(i) / 4.6f - 0.9f, 2.0f));
    add_ball(tool.gauze, {r * std::cos(a), r * std::sin(a), z}, 2.3f * mm, i < 3 ? damp : gauze);
  }
  mark_hatched(tool.gauze, 1);  // dull
  const Vec3 arm[] = {{3.9f * mm, 0, 2.5f * mm},
                      {4.6f * mm, 0, 7 * mm},
                      {4.2f * mm, 0, 13 * mm},
                      {2.4f * mm, 0, 24 * mm},
                      {1.5f * mm, 0, 44 * mm}};
  add_line_tube(tool.half, arm, 0.8f * mm, 1.6f * mm, steel);
  add_ring_handles(tool, 45 * mm, 170 * mm, steel, steel, true);
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

Shape needle_shape(const SuturePicture& model, float least_radius) {
  constexpr int n = 64;
  std::vector<Vec3> center;
  std::vector<float> radius;
  const float wire = model.needle_wire_radius, r = model.needle_radius;
  for (int i = 0; i <= n; ++i) {
    const float s = float(i) / n, phi = s * model.needle_arc;
    center.push_back({r * std::cos(phi), r * std::sin(phi), 0});
    // The swage is drilled and slightly thicker than its thread; the last fifth tapers to the point.
    const float to_tip = (1 - s) / 0.2f;
    const float taper = to_tip < 1 ? 0.04f + 0.96f * std::sqrt(to_tip) * (1.5f - 0.5f * to_tip) : s < 0.06f ? 1.08f : 1.0f;
    radius.push_back(std::max(wire * taper, least_radius * std::min(0.5f + 0.5f * taper, 0.1f + 8 * to_tip)));
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
      {"needle_holder", needle_driver}, {"forceps", forceps}, {"debakey", debakey},     {"allis", allis},
      {"scissors", scissors},           {"cautery", cautery}, {"retractor", retractor}, {"swab", swab}};
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
