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
  std::vector<float> edge_distance;     // [m] per column: to the nearest edge of its part of the wall, at rest
  std::vector<float> face_radius;       // [m] at rest, about the middle of its corners, thickness included
};
Surface make_surface(const wall::Model& model, const wall::State& state);

// A column of a face.
uint32_t column_of(const wall::Model& model, const wall::State& state, uint32_t face);

struct Foot {
  uint32_t patch = 0;
  wall::Point point;
  Vec3 at, facing;       // [m]; unit normal of the patch there, outward
  Vec3 normal;           // unit: outside, from the foot to the query point; inside, `facing`
  float gap = 0;         // [m] negative inside
  bool on_edge = false;  // the foot lies on the patch's border
};
Foot nearest_on_patch(const wall::Model& model, const wall::State& state, const Surface& surface, uint32_t patch, Vec3 p);

// A box about one face of the wall in the present step. A lower bound of a distance saves most exact searches.
struct FaceBox {
  uint32_t step = 0;             // SurfaceSearch::step in which it was made
  Vec3 center, a, b, n;          // [m]; unit axes, n along the mean director
  float half_a = 0, half_b = 0;  // [m]
  float low[2]{}, high[2]{};     // [m] along n: of the inner and of the outer face
  float speed = 0;               // [m/s] maximum of its corners
};

// Which faces are near which nodes and columns. Lists are kept until something has moved half their margin.
struct SurfaceSearch {
  float margin = 2e-3f;  // [m]
  std::vector<Vec3> node_listed, wall_listed;
  std::vector<uint32_t> node_first, node_face;      // per thread node
  std::vector<uint32_t> column_first, column_face;  // per column: faces of other parts of the wall
  std::vector<Vec3> center;                         // [m] per face
  std::vector<float> radius;
  uint32_t version = 0;
  uint32_t step = 0;         // counts steps, for the boxes
  std::vector<FaceBox> box;  // per face, made on first use in a step
  void reserve(const wall::Model& model, const wall::State& state, size_t nodes);
};
const FaceBox& box_of(const wall::Model& model, const wall::State& state, SurfaceSearch& search, uint32_t face);
// At most the distance [m] from p to the face's patches of one side: -1 inner, 1 outer, 0 any.
float least_distance(const FaceBox& box, Vec3 p, int side);

// Once per step, before the searches of that step.
void find_near(const wall::Model& model, const wall::State& state, const Surface& surface, const thread::State& thread,
               SurfaceSearch& search);

// Contacts of wall with wall, in front of the solver's contacts of this step.
void find_lips(const wall::Model& model, const wall::State& state, const Surface& surface, SurfaceSearch& search,
               float friction, wall::ContactSolver& solver);

}  // namespace catgut::physical
