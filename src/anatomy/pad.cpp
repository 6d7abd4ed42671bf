// SPDX-License-Identifier: Apache-2.0
// anatomy/pad: a flat sheet of rows parallel to the slit, thickened downward by anatomy/wall. Reads a PadShape.
#include "anatomy/pad.h"

#include <fmt/format.h>

#include <cmath>

#include "anatomy/sheet_picture.h"
#include "anatomy/wall.h"
#include "core/check.h"

namespace catgut {
namespace {

constexpr int kFewest = 120, kMost = 200000;

void check(const PadShape& p) {
  const auto refuse = [&](const std::string& what, const std::string& next) { throw InputError(p.name, what, next); };
  if (p.particles < kFewest || p.particles > kMost)
    refuse(fmt::format("{} particles cannot make a pad", p.particles), fmt::format("give {} to {}", kFewest, kMost));
  if (!(p.length >= 0.004f && p.length <= 1) || !(p.width >= 0.004f && p.width <= 1))
    refuse(fmt::format("length {} m and width {} m are out of range", p.length, p.width), "give meters: 0.004..1");
  if (!(p.thickness >= 1e-4f && p.thickness <= 0.5f * std::min(p.length, p.width)))
    refuse(fmt::format("a thickness of {} m does not fit the pad", p.thickness), "give 0.0001 m to half its length");
  if (!is_finite(p.position)) refuse("the position is not a number", "give three numbers in meters");
  if (!is_finite(p.axis) || length(Vec3{p.axis.x, 0, p.axis.z}) < 1e-6f)
    refuse("the axis is not horizontal", "give the direction that the cut face looks to, e.g. [1, 0, 0]");
  if (!(p.density > 0) || !std::isfinite(p.density))
    refuse(fmt::format("density {} kg/m^3 is out of range", p.density), "give a positive number, e.g. 1050");
  if (!(p.pinned_length >= 0 && p.pinned_length <= p.length))
    refuse(fmt::format("pinned_length {} m is out of range", p.pinned_length), "give 0 to the pad's length");
}

struct Row {
  uint32_t first;
  int count;
};

// Rows of `n` vertices in all, nearly square; what is left over goes to the rows at the far border, one each.
std::vector<Row> lay_rows(const PadShape& p, int n) {
  int rows = std::max(3, static_cast<int>(std::lround(std::sqrt(static_cast<float>(n) * p.length / p.width))));
  while (n / rows < 3) --rows;
  std::vector<Row> out;
  uint32_t first = 0;
  for (int i = 0; i < rows; ++i) {
    const int count = n / rows + (rows - 1 - i < n % rows);
    out.push_back({first, count});
    first += static_cast<uint32_t>(count);
  }
  return out;
}

// Fills the strip between two rows, always with the shorter of the two possible next edges.
void zip(const Row& a, const Row& b, std::vector<Triangle>& triangle) {
  const auto at = [](int i, const Row& r) { return static_cast<float>(i) / static_cast<float>(r.count - 1); };
  for (int i = 0, j = 0; i + 1 < a.count || j + 1 < b.count;) {
    const uint32_t va = a.first + static_cast<uint32_t>(i), vb = b.first + static_cast<uint32_t>(j);
    const bool step_a =
        j + 1 >= b.count || (i + 1 < a.count && std::abs(at(i + 1, a) - at(j, b)) <= std::abs(at(j + 1, b) - at(i, a)));
    if (step_a) triangle.push_back({va, vb, va + 1}), ++i;
    else triangle.push_back({va, vb, vb + 1}), ++j;
  }
}

}  // namespace

BodyRest make_pad(const PadShape& shape) {
  check(shape);
  const Vec3 up{0, 1, 0}, ahead = normalized(Vec3{shape.axis.x, 0, shape.axis.z}), side = cross(ahead, up);
  const std::vector<Row> rows = lay_rows(shape, shape.particles / 2);
  TriangleMesh sheet;
  std::vector<float> depth;  // [m] from the slit
  for (size_t i = 0; i < rows.size(); ++i)
    for (int j = 0; j < rows[i].count; ++j) {
      const float d = shape.length * static_cast<float>(i) / static_cast<float>(rows.size() - 1);
      const float t = static_cast<float>(j) / static_cast<float>(rows[i].count - 1) - 0.5f;
      sheet.position.push_back(shape.position - ahead * d + side * (t * shape.width));
      depth.push_back(d);
    }
  for (size_t i = 0; i + 1 < rows.size(); ++i) zip(rows[i], rows[i + 1], sheet.triangle);
  // Counter-clockwise seen from above.
  const Triangle& t = sheet.triangle.front();
  if (dot(cross(sheet.position[t[1]] - sheet.position[t[0]], sheet.position[t[2]] - sheet.position[t[0]]), up) < 0)
    for (Triangle& each : sheet.triangle) std::swap(each[1], each[2]);

  WallSpec wall{shape.name, shape.thickness, shape.density, shape.particles % 2 == 1, 0};
  wall.extra_triangle = static_cast<uint32_t>(sheet.triangle.size()) - 1;
  BodyRest body = thicken(sheet, std::vector<Vec3>(sheet.position.size(), up), wall);
  body.name = shape.name;
  for (size_t v = 0; v < depth.size(); ++v)
    body.pinned[2 * v] = body.pinned[2 * v + 1] = shape.pinned_length > 0 && depth[v] >= shape.length - shape.pinned_length;
  if (wall.extra_particle) body.pinned.back() = shape.pinned_length > 0;

  Rim face;
  const uint32_t n = static_cast<uint32_t>(rows[0].count);
  for (uint32_t v = 0; v < n; ++v) face.outer.push_back(2 * v);
  for (uint32_t v = n; v-- > 0;) face.outer.push_back(2 * v + 1);
  face.inner = face.outer;
  body.rim = {face};

  body.visible = sheet_picture(sheet, body, depth);
  // A flat sheet has no center line to wind the texture round.
  for (size_t k = 0; k < body.visible.position.size(); ++k) {
    const Vec3 d = body.visible.position[k] - shape.position;
    const float below = std::max(0.0f, -d.y);  // the cut faces
    body.visible.uv[k] = {(below - dot(d, ahead)) / 0.01f, dot(d, side) / 0.01f};
  }
  return body;
}

}  // namespace catgut
