// SPDX-License-Identifier: Apache-2.0
// solver/tissue_pairs: broad phase of tissue against tissue. Candidates are found with a margin and kept until something has
// moved by more than half of it. Most substeps only check the distance moved, and only blocks that have moved are searched
// again. A pair that touches when its contacts are solved is always listed. A pair that comes into contact during that solve
// may not be. The list is therefore part of the result. It is a pure function of the positions at which each particle was last
// searched (`origin`), which are state: all pairs within the margin there, sorted. It does not depend on the number of
// workers, nor on a save and load.
#pragma once
#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/jobs.h"
#include "geometry/mesh.h"
#include "solver/particles.h"

namespace catgut {

constexpr uint32_t kBlock = 16;  // particles in a block, and blocks in a group
constexpr float kNowhere = std::numeric_limits<float>::quiet_NaN();

// Collision data of the tissue. Consecutive particles must be neighbors in space, which bodies guarantee: the search uses
// boxes of 16 particles and boxes of 16 such boxes.
struct TissueCollision {
  uint32_t particles = 0;
  std::vector<float> radius;      // [m] per particle, against other tissue
  std::vector<uint32_t> body;     // per particle
  std::vector<float> rest_reach;  // [m] per particle: same-body particles nearer than this at rest never collide
  std::vector<Triangle> surface;
  std::vector<uint32_t> ring_first;  // per particle: first of its triangles in ring, size particles + 1
  std::vector<uint32_t> ring;        // triangles around each particle
  // Blocks with particles that never collide with some of a block's own: neighbors in the wall. First entry of each block in
  // `exclusion`, size blocks + 1, ascending; the block itself is the first.
  struct ExclusionMask {
    uint32_t block;
    std::array<uint16_t, kBlock> allowed;  // bit j of allowed[i]: particle i of the one and j of the other may touch, i < j
  };
  std::vector<uint32_t> exclusion_first;
  std::vector<ExclusionMask> exclusion;
  float tool_radius = 0.0006f;  // [m] of a particle against tools
  float largest_radius = 0;
  float pair_margin = 0.002f;  // [m] pairs with a gap below this are candidates
};
TissueCollision make_tissue_collision(std::span<const Vec4> rest, std::span<const float> radius, std::span<const uint32_t> body,
                                      std::span<const float> rest_reach, std::vector<Triangle> surface);

struct PairCandidate {
  uint32_t a, b;
};  // tissue particles, a < b

// Boxes by components; padded to whole groups of 16 with NaN boxes, which overlap nothing.
struct Boxes {
  std::array<Column<float>, 3> lower, upper;  // [m]
  void resize(size_t count);
};
struct BlockBoxes {
  uint32_t blocks = 0, groups = 0;
  Boxes block, group;
};

// Working memory: never saved. All but `boxes` and `moved` is derived from the origins, and rebuilt from them when `filled` is
// not set. A block that has hardly moved keeps its origins when others are searched again.
struct PairSearch {
  std::vector<PairCandidate> pair;
  bool filled = false;       // the members below match the origins
  BlockBoxes boxes;          // as of the last call of make_boxes
  std::vector<float> moved;  // [m] distance of particles from their origins (furthest_move): one per part of the tissue
  BlockBoxes built;          // around the origins
  BlockBoxes swept;          // around the origins before and after the current search
  // The origins by components, padded to whole blocks with NaN positions: these are near nothing, however large the
  // coordinates in a damaged state.
  std::array<Column<float>, 3> at;
  Column<float> radius;
  std::vector<std::vector<PairCandidate>> of_block;  // pairs whose first particle is in it
  struct Near {
    uint32_t block;
    const uint16_t* allowed;  // as in ExclusionMask; null: every pair
  };
  struct Part {              // for a group of blocks
    uint32_t moved = 0;      // bit k: its block k is searched again
    std::vector<Near> near;  // blocks near the current one, and their boxes
    Boxes near_box;
  };
  std::vector<Part> part;
};

void make_boxes(const TissueCollision& tissue, const Vec4* x, BlockBoxes& boxes, Jobs& jobs);
// [m] upper bound of the displacement of n particles, tight where neighbors move alike. The length of the vector of the largest
// displacements along each axis.
float furthest_move(const Vec4* x, const Vec4* from, size_t n);
// Whether search.pair may lack a pair that touches, given search.moved.
bool pairs_are_stale(const TissueCollision& tissue, const PairSearch& search);
// Lists the pairs of the origins as they are.
void list_tissue_pairs(const TissueCollision& tissue, const Column<Vec4>& origin, PairSearch& search, Jobs& jobs);
// Sets the origins of what has moved to x [m], per tissue particle, and lists their pairs.
void find_tissue_pairs(const TissueCollision& tissue, const Vec4* x, Column<Vec4>& origin, PairSearch& search, Jobs& jobs);

// Calls with(block) for every block whose box overlaps the box from..to, in ascending order.
template <class With>
void for_blocks_near(const BlockBoxes& b, Vec3 from, Vec3 to, With&& with) {
  auto meets = [&](const Boxes& box, size_t k) {
    return box.lower[0][k] <= to.x && from.x <= box.upper[0][k] && box.lower[1][k] <= to.y && from.y <= box.upper[1][k] &&
           box.lower[2][k] <= to.z && from.z <= box.upper[2][k];
  };
  for (uint32_t g = 0; g < b.groups; ++g) {
    if (!meets(b.group, g)) continue;
    const uint32_t end = b.blocks < (g + 1) * kBlock ? b.blocks : (g + 1) * kBlock;
    for (uint32_t k = g * kBlock; k < end; ++k)
      if (meets(b.block, k)) with(k);
  }
}
// [m^2] squared distance of a point to the box of a block.
inline float distance_to_block2(const BlockBoxes& b, uint32_t k, Vec3 p) {
  auto outside = [&](size_t axis, float at) {
    const float below = b.block.lower[axis][k] - at, above = at - b.block.upper[axis][k], d = below > above ? below : above;
    return d > 0 ? d * d : 0.0f;
  };
  return outside(0, p.x) + outside(1, p.y) + outside(2, p.z);
}

}  // namespace catgut
