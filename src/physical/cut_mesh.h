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

enum class CutSide : uint8_t { outer, inner, cut_edge, rim };
struct CutMesh {
  uint32_t version = 0;  // of the topology
  struct Vertex {
    wall::Weights at;   // wall::place gives its position
    wall::Point point;  // for char (burnt_at) and textures: a place within the part
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
CutMesh make_cut_mesh(const Model& model, const State& state, bool layers = true);

}  // namespace catgut::physical
