// SPDX-License-Identifier: Apache-2.0
// physical/cut_mesh: what to draw of the faces that cuts have divided: both sides of each part, and the cut edge with the
// wall's layers. Reads the wall's topology; writes triangles whose vertices follow the wall. Made again when the topology's
// version has changed; a frame only evaluates `place`. Faces that are whole are drawn as before, those in `hidden` are not.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "physical/physical.h"

namespace catgut::physical {

// The lattice points of a face are the corners of its cells: point (i, j) of wall/raster has number 9 j + i.
constexpr uint32_t kLatticeSide = wall::kRaster + 1, kLatticePoints = kLatticeSide * kLatticeSide;
struct LatticeTable {
  uint32_t corners = 4;                                          // of a cell
  std::array<std::array<uint8_t, 4>, wall::kCells> corner{};     // per cell, counter-clockwise
  std::array<std::array<uint8_t, kLatticeSide>, 4> on_edge{};    // per edge, in the order of its corners
  std::array<std::array<uint8_t, 2>, wall::kMaxLinks> border{};  // per link: ends of the border that it crosses. Half a link:
                                                                 // of the piece of the edge that it reaches
};
const LatticeTable& lattice(bool quad);

enum class CutSide : uint8_t { outer, inner, cut_edge, rim };
struct CutMesh {
  uint32_t version = 0;  // of the topology
  struct Vertex {
    wall::Weights at;      // wall::place gives its position
    wall::Point point;     // for char (burnt_at) and textures: a place within the part
    uint32_t lattice = 0;  // lattice point of the face
  };
  struct Face {
    std::array<uint32_t, 3> vertex{};  // counter-clockwise seen from outside
    CutSide side = CutSide::outer;
    uint8_t layer = 0;  // of a cut edge or rim: index in Model::wall.layer, from mucosa to serosa
  };
  std::vector<Vertex> vertex;
  std::vector<Face> face;
  std::vector<uint32_t> hidden;  // divided faces of the wall, in order
};
// layers: false leaves out the vertices between the two faces on cut edges; their triangles then reach from face to face.
// surface: of the topology.
//
// Diagonals. A warped face of the wall is a bilinear patch. Neighboring cells have opposite diagonals, so that the triangles
// enclose the patch's volume exactly, in 4 x 4 parts as in 8 x 8. Both lips of a cut share their diagonals: no sliver between
// them is counted twice or lost.
CutMesh make_cut_mesh(const Model& model, const wall::Topology& topology, const Surface& surface, bool layers = true);
inline CutMesh make_cut_mesh(const Model& model, const State& state, bool layers = true) {
  return make_cut_mesh(model, state.wall.topology, surface_of(model, state), layers);
}

}  // namespace catgut::physical
