// SPDX-License-Identifier: Apache-2.0
// wall/raster: every face of the wall as 64 cells of equal parametric area, and the links between them that a cut removes
// ("linked volumes", Frisken-Gibson 1999, doi 10.1109/2945.817350). Quads: 8 x 8 squares. Triangles: 8 rows of 15, 13, ...
// small triangles. A set of cells is one 64-bit word.
//
// Lattice coordinates (u, v): integers, 0 .. kLattice from corner 0 along the edges to corners 1 and 3 (triangle: 2).
// All tests of crossing are exact in 64-bit integers, so that no bridge can be missed between two parts of a path.
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>

#include "wall/mesh.h"

namespace catgut::wall {

constexpr int kRaster = 8;                      // cells along an edge of a face
constexpr uint32_t kCells = kRaster * kRaster;  // of a face
constexpr int32_t kLattice = kRaster * 1536;    // units along an edge
constexpr uint32_t kMaxLinks = 144;             // of a face: 112 between its cells, 32 halves of links over its edges

struct LatticePoint {
  int32_t u = 0, v = 0;
};

struct Raster {
  struct Link {
    uint32_t a = 0, b = kNone;  // cells; kNone: the half of a link over an edge, from the cell's center to the edge
    LatticePoint from, to;
  };
  uint32_t edges = 4, links = 0, inner = 0;  // inner links come first
  std::array<LatticePoint, kCells> center{};
  std::array<Link, kMaxLinks> link{};
  // Per cell: links to other cells (kNone: fewer than four).
  std::array<std::array<uint32_t, 4>, kCells> of_cell{};
  // Half link k along edge e (from corner e to e + 1).
  uint32_t over_edge(uint32_t e, uint32_t k) const { return inner + e * kRaster + k; }
  uint32_t corner_cell(uint32_t corner) const { return link[over_edge(corner, 0)].a; }
};
const Raster& raster(bool quad);

// Cell of a place on a face, in the coordinates of wall::Point.
uint32_t cell_at(bool quad, float xi, float eta);
// Lattice coordinates to those of wall::Point, and back to a place within the face that lies on no line between centers.
inline void to_natural(bool quad, LatticePoint p, float& xi, float& eta) {
  const float s = 2.0f / static_cast<float>(kLattice), off = quad ? 1.0f : 0.0f;
  xi = s * static_cast<float>(p.u) - off, eta = s * static_cast<float>(p.v) - off;
}
LatticePoint to_lattice(bool quad, float xi, float eta);
// A place on edge e, `t` units from its first corner.
LatticePoint on_edge(bool quad, uint32_t e, int32_t t);

// Whether the path from p to q crosses the link. p and q as to_lattice and on_edge (odd t) make them.
bool crosses(const Raster::Link& link, LatticePoint p, LatticePoint q);

// The border between the two cells of an inner link.
void border_of(bool quad, const Raster::Link& link, LatticePoint& a, LatticePoint& b);

// Links that are cut, one bit each.
struct FaceCut {
  std::array<uint64_t, 3> bit{};
  bool has(uint32_t link) const { return bit[link / 64] >> (link % 64) & 1; }
  void set(uint32_t link) { bit[link / 64] |= uint64_t{1} << (link % 64); }
  void clear(uint32_t link) { bit[link / 64] &= ~(uint64_t{1} << (link % 64)); }
  bool any() const { return (bit[0] | bit[1] | bit[2]) != 0; }
};
constexpr bool operator==(const FaceCut& a, const FaceCut& b) { return a.bit == b.bit; }

// A part of a face that cuts divided: an element of its own on copies of the face's columns ("virtual nodes", Molino, Bao,
// Fedkiw 2004, doi 10.1145/1015706.1015734), with the part of the face's mass and stiffness that its cells are.
struct Fragment {
  uint64_t cells = 0;
  uint32_t face = 0, lane = 0;
};
inline float part_of_mass(const Fragment& f) {
  return static_cast<float>(__builtin_popcountll(f.cells)) / static_cast<float>(kCells);
}
// No less than an eighth: some columns of a sliver are held by nothing but its cells. With a sixty-fourth of the stiffness, the
// thread of a stitch turned one cell inside out, and the wall sprang about. Void with a little stiffness is the remedy of the
// finite cell method (Parvizian, Düster, Rank 2007, doi 10.1007/s00466-007-0173-y).
inline float part_of_stiffness(const Fragment& f) { return std::max(part_of_mass(f), 0.125f); }

// The cells that hang together with cell `first`.
uint64_t component(const Raster& raster, const FaceCut& cut, uint32_t first);

}  // namespace catgut::wall
