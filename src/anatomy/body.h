// SPDX-License-Identifier: Apache-2.0
// anatomy: a soft body at rest, made by the bowel generator or by the import of an organ surface.
// The solver moves particles, clusters and surface; the renderer shows the visible mesh.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/math.h"
#include "exchange/picture.h"
#include "geometry/mesh.h"

namespace catgut {

// An opening of the body: particles in order round it, one loop per side of the wall. The first is on the outer side.
struct Rim {
  std::vector<uint32_t> outer, inner;
};

struct BodyRest {
  std::string name;
  std::vector<Vec3> position;   // [m] one per particle, neighbors close in memory (space-filling or lattice order)
  std::vector<float> mass;      // [kg]
  std::vector<uint8_t> pinned;  // 1: fixed, never moves
  std::vector<TissueLayer>
      layer;         // serosa: outer side of the wall, mucosa: inner side; the other way round where the wall is everted
  float radius = 0;  // [m] contact radius of a particle
  std::vector<std::vector<uint32_t>> cluster;  // cluster c is centered on particle c; first member is c; at most 16 members
  std::vector<Tet> tet;                        // the wall's volume: three to a prism, prism after prism
  std::vector<Triangle> surface;               // watertight, particle indices, counter-clockwise seen from outside the tissue
  std::vector<Rim> rim;                        // openings; rim[w] with w < walls is the working rim of wall w
  int walls = 1;                               // 2: a bowel folded into itself; wall 0 is the outer tube, 1 the inner one
  std::vector<uint8_t> wall;                   // per particle: which wall it belongs to; empty: all 0
  VisibleMesh visible;                         // skin_particle indexes this body's particles
};

}  // namespace catgut
