// SPDX-License-Identifier: Apache-2.0
// physical/surface: the wall as a closed surface: outer and inner faces, and the strips at its rims that join them. Finds the
// nearest surface point of thread nodes and of other parts of the wall. Reads the wall's topology and motion.
#pragma once
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "thread/thread.h"
#include "wall/contact.h"
#include "wall/points.h"

namespace catgut::physical {

// A piece of surface: side +1 the outer face, -1 the inner one, 0 the strip at an edge of the face. Of a face that a cut has
// divided: a block of its cells, or the strip where the cut passed between two cells.
struct Patch {
  uint32_t face = 0;  // the element (wall::elements): a whole face, or a fragment
  int side = 1;
  uint32_t edge = 0;
  bool part = false;  // of a fragment
  bool quad = true;
  // In the coordinates of wall::Point. side 0: the ends of the strip, and the center of the cell behind it.
  std::array<std::array<float, 2>, 4> at{};
};
struct Surface {
  std::vector<Patch> patch;
  std::vector<uint32_t> first_of_face;  // patches of an element: both sides, then its strips; one more than elements
  std::vector<uint8_t> ghost;           // per column: only a corner of fragments whose cells do not reach it
  std::vector<uint8_t> at_rim;          // per column
  std::vector<uint32_t> piece;          // per column: its connected part of the wall
  std::vector<float> edge_distance;  // [m] per column: to the nearest edge of its part of the wall, at rest; ghosts: negative
  std::vector<float> face_radius;    // [m] at rest, about the middle of its corners, thickness included
};
Surface make_surface(const wall::Model& model, const wall::State& state);

// Ends of a strip at one side of the wall, and the direction toward that side (a director, not a unit vector).
struct StripEnds {
  Vec3 from, to, up;
};
StripEnds strip_ends(const wall::Model& model, const wall::State& state, const Surface& surface, uint32_t patch, float zeta);

// The patch of side +1 or -1 where a material point lies.
uint32_t patch_at(const wall::Model& model, const wall::State& state, const Surface& surface, const wall::Point& point,
                  int side);

// A column of an element.
uint32_t column_of(const wall::Model& model, const wall::State& state, uint32_t face);

struct Foot {
  uint32_t patch = 0;
  wall::Point point;
  Vec3 at, facing;       // [m]; unit normal of the patch there, outward
  Vec3 normal;           // unit: outside, from the foot to the query point; inside, `facing`
  float gap = 0;         // [m] negative inside
  bool on_edge = false;  // the foot lies on the patch's border
  Vec3 inward;           // [m] then: from there to the middle of the patch
};
// corner: those of a patch of a fragment (PatchBox), where they are known.
Foot nearest_on_patch(const wall::Model& model, const wall::State& state, const Surface& surface, uint32_t patch, Vec3 p,
                      const Vec3* corner = nullptr);

// The foot nearest to a point, patch by patch. Of one place on several patches, that of the patch which the point is most in
// front of.
struct NearestFoot {
  Foot best;
  float front = -1;                   // cosine
  std::array<uint32_t, 8> sharing{};  // patches that have this foot
  uint32_t shared = 0;
  NearestFoot() { best.gap = 1e9f; }
  void offer(const Foot& foot, Vec3 p) {
    constexpr float kSame = 1e-7f;  // [m]
    const float far = std::abs(foot.gap), least = std::abs(best.gap);
    if (far > least + kSame) return;
    const float in_front = dot(normalized(p - foot.at), foot.facing);
    if (far < least - kSame) shared = 0;
    if (shared < sharing.size()) sharing[shared++] = foot.patch;
    if (far > least - kSame && in_front < front) return;
    best = foot, front = in_front;
  }
  // At the corner of a pit a point may be in front of one face and yet inside. The sum of the normals, each times the angle of
  // its patch there, decides (Baerentzen and Aanaes 2005, 10.1109/TVCG.2005.49).
  void settle_side(const wall::Model& model, const wall::State& state, const Surface& surface, Vec3 p);
};

// A box about one face of the wall in the present step. A lower bound of a distance saves most exact searches.
struct FaceBox {
  uint32_t step = 0;             // SurfaceSearch::step in which it was made
  Vec3 center, a, b, n;          // [m]; unit axes, n along the mean director
  float half_a = 0, half_b = 0;  // [m]
  float low[2]{}, high[2]{};     // [m] along n: of the inner and of the outer face
  float speed = 0;               // [m/s] maximum of its corners
};
// The same about one patch of a fragment, with its corners in the order of wall::Patch: its face is often much larger.
struct PatchBox {
  uint32_t step = 0;
  std::array<Vec3, 4> corner;
  Vec3 center, a, b, n;                      // [m]; unit axes
  float half_a = 0, half_b = 0, half_n = 0;  // [m]
  float radius = 0;                          // [m] of the ball about it
  // [m] at most: to the ball, and to the box, which is tighter where a patch is narrow.
  float to_ball(Vec3 p) const { return distance(center, p) * 0.9999f - radius; }
  float to_box(Vec3 p) const;
};
PatchBox patch_box(const wall::Model& model, const wall::State& state, const Patch& patch);

constexpr size_t kClose = 24;
constexpr size_t kGroup = 16;  // faces with neighboring numbers lie together: what is far from all of them is far from each
// Which faces are near which nodes and columns. Lists are kept until something has moved half their margin.
struct SurfaceSearch {
  float margin = 2e-3f;  // [m]
  std::vector<Vec3> node_listed, wall_listed;
  std::vector<uint32_t> node_first, node_face;      // per thread node
  std::vector<uint32_t> near;                       // of a block of nodes
  std::vector<float> far;                           // [m] of a node: at least to each of its faces
  std::vector<uint32_t> column_first, column_face;  // per column: faces of other parts of the wall
  std::vector<Vec3> center;                         // [m] per face
  std::vector<float> radius;
  std::vector<Vec3> group_center;  // [m] of kGroup faces in turn
  std::vector<float> group_radius;
  uint32_t version = 0;
  uint32_t step = 0;                // counts steps, for the boxes
  std::vector<FaceBox> box;         // per face, made on first use in a step
  std::vector<PatchBox> part;       // per patch, likewise; only of fragments
  std::vector<uint32_t> lip_patch;  // per column and zeta: the nearest patch of the last search, which is looked at first
  // Per column and zeta, at the last search: at least as far from it were all patches, and all but that nearest one.
  struct LipBound {
    double moved = 0;               // then
    float least = 0, of_other = 0;  // [m]
  };
  std::vector<LipBound> lip_bound;
  // What was far from everything is not searched again before the wall may have come near.
  std::vector<wall::Float4> seen;  // the wall in the last step
  double moved = 0;                // [m] the longest path that any point of the wall has traveled so far; only grows
  float speed = 0;                 // [m/s] maximum of any point of the wall
  std::vector<double> column_due;  // per column: `moved` at which its lips are searched again
  std::vector<double> node_due;    // per node: the same, less the node's own motion
  std::vector<Vec3> node_seen;     // [m] per node: where it was when it was searched
  // Of a node's faces those that were within `close`; kClose per node. The others are farther until node and wall have moved.
  struct Close {
    Vec3 node;         // [m] then
    double moved = 0;  // then
    float within = 0;  // [m]; 0: not known
    uint32_t count = 0;
  };
  std::vector<Close> close;
  std::vector<uint32_t> close_face;
  std::vector<Close> column_close;  // the same of a column, on both sides of the wall; `node` is not used
  std::vector<uint32_t> column_close_face;
  void reserve(const wall::Model& model, const wall::State& state, size_t nodes);
};
const FaceBox& box_of(const wall::Model& model, const wall::State& state, SurfaceSearch& search, uint32_t face);
// At most the distance [m] from p to the face's patches of one side: -1 inner, 1 outer, 0 any.
inline float least_distance(const FaceBox& box, Vec3 p, int side) {
  const Vec3 q = p - box.center;
  const float h = dot(q, box.n), da = std::max(0.0f, std::abs(dot(q, box.a)) - box.half_a),
              db = std::max(0.0f, std::abs(dot(q, box.b)) - box.half_b);
  const float low = side > 0 ? box.low[1] : side < 0 ? box.low[0] : std::min(box.low[0], box.low[1]);
  const float high = side > 0 ? box.high[1] : side < 0 ? box.high[0] : std::max(box.high[0], box.high[1]);
  const float dn = std::max(0.0f, std::max(low - h, h - high));
  return std::sqrt(da * da + db * db + dn * dn) * 0.9999f;
}
// The same of one patch, whose face has this box.
inline float least_distance(const wall::Model& m, const wall::State& s, const Surface& surface, SurfaceSearch& search,
                            const FaceBox& box, uint32_t index, Vec3 p) {
  const Patch& patch = surface.patch[index];
  const float far = least_distance(box, p, patch.side);
  if (!patch.part) return far;
  PatchBox& part = search.part[index];
  if (part.step != search.step) part = patch_box(m, s, patch), part.step = search.step;
  return std::max(far, part.to_ball(p));
}

// A bound tighter than least_distance, after it: of a fragment's patch; 0 of a whole face. Only for a search that has no use
// for a patch beyond the limit: which patches within reach were looked at decides which of equally near ones is taken.
inline float least_of_part(const Surface& surface, const SurfaceSearch& search, uint32_t patch, Vec3 p) {
  return surface.patch[patch].part && search.part[patch].step == search.step ? search.part[patch].to_box(p) : 0.0f;
}
// The corners of a patch whose box was made in this step; nullptr: not known.
inline const Vec3* corners_in(const SurfaceSearch& search, uint32_t patch) {
  return patch < search.part.size() && search.part[patch].step == search.step ? search.part[patch].corner.data() : nullptr;
}

// Once per step, before everything below: how far the wall moves.
void watch_wall(const wall::State& state, SurfaceSearch& search);
// [m] At most: by any point of the wall since then.
float moved_since(const wall::State& state, const SurfaceSearch& search);
// Once per step, before the searches of that step.
void find_near(const wall::Model& model, const wall::State& state, const Surface& surface, const thread::State& thread,
               SurfaceSearch& search);

// Contacts of wall with wall, in front of the solver's contacts of this step.
void find_lips(const wall::Model& model, const wall::State& state, const Surface& surface, SurfaceSearch& search,
               float friction, wall::ContactSolver& solver);

}  // namespace catgut::physical
