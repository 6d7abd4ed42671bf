// SPDX-License-Identifier: Apache-2.0
// wall/mesh: the mid-surface of a wall as columns (an outer and an inner node each) and faces of three or four columns.
#pragma once
#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "core/math.h"

namespace catgut::wall {

constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();

struct Mesh {
  std::string name = "wall";                  // in messages
  std::vector<Vec3> outer, inner;             // [m] one pair per column
  std::vector<std::array<uint32_t, 4>> face;  // columns, counter-clockwise seen from outside; [3] is kNone for a triangle
  std::vector<Vec3> along;                    // per face: the direction "along" of the laminate
  std::vector<uint8_t> held;                  // per column: 1 where it is fixed
  std::vector<float> foundation;              // [Pa/m] per column, of the bed it lies on; 0: none; an empty list: no bed
};

// Columns in order round each opening, counter-clockwise seen from outside the wall's outer side; the longest rim first.
std::vector<std::vector<uint32_t>> rims(const Mesh& mesh);

// Per face, over each edge (from corner e to e + 1): 4 * face + edge on the other side; kNone: a rim.
std::vector<std::array<uint32_t, 4>> neighbors(const Mesh& mesh);

// A straight tube about `axis` through `center` (middle of its near end), ring by ring from the near end.
struct TubeShape {
  float outer_radius = 0.020f;  // [m]
  float length = 0.070f;        // [m] from the center against the axis
  float thickness = 0.0025f;    // [m]
  int around = 32, rings = 19;
  Vec3 center{0, 0, 0};
  Vec3 axis{0, 0, 1};  // the direction that the near end faces
  int held_rings = 1;  // at the far end
};
Mesh tube(const TubeShape& shape);

// A flat rectangle in the plane z = 0, "along" x; outer side +z; columns row by row along x. Holds nothing.
struct SheetShape {
  float width = 0.06f, height = 0.04f;  // [m] in x, in y
  float thickness = 0.0025f;            // [m]
  int columns = 25, rows = 17;
};
Mesh sheet(const SheetShape& shape);

// Columns and triangles as the bowel generator and the organ import make them. Triangles are joined to well-shaped quads where
// possible. along: the organ's long axis. Throws InputError for inconsistent lists.
Mesh from_triangles(std::span<const Vec3> outer, std::span<const Vec3> inner, std::span<const std::array<uint32_t, 3>> triangle,
                    Vec3 along, const std::string& name);

// One after the other: `more` as a further piece that shares nothing with `mesh`.
void append(Mesh& mesh, const Mesh& more);

}  // namespace catgut::wall
