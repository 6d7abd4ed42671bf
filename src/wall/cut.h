// SPDX-License-Identifier: Apache-2.0
// wall/cut: divides the wall anywhere. A cut removes links between the cells of the faces' rasters (wall/raster). Where they
// divide a face, each part becomes an element with the face's shape at rest, the part's share of mass and stiffness (of
// stiffness an eighth at least), and copies of the columns ("virtual nodes"). Two elements share a copy where a link over their
// common edge is left. Rest shapes, frames and velocities are kept, so no element is ever badly shaped and mass is exact.
// Cutting only removes links, so the old factor remains a valid bound of the stiffness, but for slivers, which stay below the
// limit of the step. Copies share its row, plus a diagonal part for their relative motion. A new factor is made when a piece
// comes free, or on request.
//
// The lips follow the path within half a cell (a sixteenth of an element's edge). The closed end of a slit reaches to the
// last edge of a face that the path crossed: a slit that ends within a face opens only up to its edge.
#pragma once
#include <array>
#include <span>

#include "wall/points.h"
#include "wall/wall.h"

namespace catgut::wall {

struct Mark {
  uint32_t face = 0, link = 0;  // wall/raster
};

// Appends the links that the path from one material point to another crosses, on the shortest way over the faces between.
// Returns false, and appends nothing, for points that are more than `kMaxWay` faces apart, or on different pieces of the mesh.
constexpr uint32_t kMaxWay = 8;
bool trace(const Model& model, const Point& from, const Point& to, std::vector<Mark>& marks);
// Rest position of a material point on the mid-surface [m].
Vec3 rest_place(const Model& model, const Point& point);

struct CutResult {
  uint32_t columns = 0;  // added
  bool divided = false;  // the topology has changed
  bool freed = false;    // a piece came free, and the factor was made again
  bool refused = false;  // more fragments than there is room for; nothing was changed
};
// Removes links. The scratch grows with the columns. Links that are gone already, and those whose removal would free crumbs of
// less than three cells, are left out.
CutResult cut_links(const Model& model, State& state, Scratch& scratch, std::span<const Mark> marks);
// Fragments that a wall has room for.
inline size_t max_fragments(const Model& m) { return m.lane_of_face.size() + 256; }

// Cuts along whole edges (pairs of columns of the present topology). Returns the added columns. A column is divided only where
// the cut separates its faces: the inner end of a slit stays connected.
uint32_t cut(const Model& model, State& state, Scratch& scratch, std::span<const std::array<uint32_t, 2>> edge);

// The factor of the present topology. Independent of the motion: it may be computed elsewhere from a copy of the topology and
// installed between two steps.
void refactor(const Model& model, State& state, Scratch& scratch);

// The topology that `cut` and `factored` of the given one describe, to the bit. For loading: only those two lists are saved.
void restore(const Model& model, Topology& topology);

// The pieces of the wall: per column, the smallest column of its piece.
std::vector<uint32_t> pieces(const State& state);
uint32_t count_pieces(const State& state);

}  // namespace catgut::wall
