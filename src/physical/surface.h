// SPDX-License-Identifier: Apache-2.0
// physical/surface: the wall as a closed surface: outer and inner faces, and the strips at its rims that join them. Finds the
// nearest surface point of thread nodes and of other parts of the wall. Reads the wall's topology and motion.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "thread/thread.h"
#include "wall/contact.h"
#include "wall/points.h"

namespace catgut::physical {

// A piece of surface: side +1 the outer face, -1 the inner one, 0 the strip at an edge of the face.
struct Patch {
  uint32_t face = 0;
  int side = 1;
  uint32_t edge = 0;
};
struct Surface {
  std::vector<Patch> patch;
  std::vector<uint32_t> first_of_face;  // patches of a face: both sides, then its strips; one more than faces
  std::vector<uint8_t> at_rim;          // per column
  std::vector<uint32_t> piece;          // per column: its connected part of the wall
  std::vector<float> face_radius;       // [m] at rest, about the middle of its corners, thickness included
};
Surface make_surface(const wall::Model& model, const wall::State& state);

struct Foot {
  uint32_t patch = 0;
  wall::Point point;
  Vec3 at, facing;       // [m]; unit normal of the patch there, outward
  Vec3 normal;           // unit: outside, from the foot to the query point; inside, `facing`
  float gap = 0;         // [m] negative inside
  bool on_edge = false;  // the foot lies on the patch's border
};
Foot nearest_on_patch(const wall::Model& model, const wall::State& state, const Surface& surface, uint32_t patch, Vec3 p);

// Which faces are near which nodes and columns. Lists are kept until something has moved half their margin.
struct SurfaceSearch {
  float margin = 2e-3f;  // [m]
  std::vector<Vec3> node_listed, wall_listed;
  std::vector<uint32_t> node_first, node_face;      // per thread node
  std::vector<uint32_t> column_first, column_face;  // per column: faces of other parts of the wall
  std::vector<Vec3> center;                         // [m] per face
  std::vector<float> radius;
  uint32_t version = 0;
  void reserve(const wall::Model& model, const wall::State& state, size_t nodes);
};
void find_near(const wall::Model& model, const wall::State& state, const Surface& surface, const thread::State& thread,
               SurfaceSearch& search);

// Contacts of wall with wall, in front of the solver's contacts of this step.
void find_lips(const wall::Model& model, const wall::State& state, const Surface& surface, const SurfaceSearch& search,
               float friction, wall::ContactSolver& solver);

}  // namespace catgut::physical
