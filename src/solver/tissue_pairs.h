// SPDX-License-Identifier: Apache-2.0
// solver/tissue_pairs: which particles of the tissue may touch each other. Candidates are found with a margin and kept until
// something has moved by more than half of it, so most substeps only check the distance moved, and then only blocks that have
// moved are searched again. A pair that touches when its contacts are solved is always listed; a pair that comes to touch while
// they are solved may not be. The list is therefore part of the result, and it is a pure function of the positions at which
// each particle was last searched (`origin`), which are state: all pairs within margin there, sorted. Neither the number of
// workers nor a save and load in between changes it.
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

// What of the tissue collides. Consecutive particles must be neighbors in space, which bodies promise: the search goes by
// boxes round 16 of them and round 16 such boxes.
struct TissueCollision {
  uint32_t particles = 0;
  std::vector<float> radius;      // [m] per particle, against other tissue
  std::vector<uint32_t> body;     // per particle
  std::vector<float> rest_reach;  // [m] per particle: same-body particles nearer than this at rest never collide
  std::vector<Triangle> surface;
  std::vector<uint32_t> ring_first;  // per particle: first of its triangles in ring, size particles + 1
  std::vector<uint32_t> ring;        // triangles around each particle
  // Blocks with particles that never collide with some of a block's own: neighbors in the wall. First of a block's in kin,
  // size blocks + 1, ascending, the block itself the first of them.
  struct ExclusionMask {
    uint32_t block;
    std::array<uint16_t, kBlock> allowed;  // bit j of may[i]: particle i of the one and j of the other may touch, i < j
  };
  std::vector<uint32_t> exclusion_first;
  std::vector<ExclusionMask> exclusion;
  float tool_radius = 0.0006f;  // [m] of a particle against tools
  float largest_radius = 0;
  float pair_margin = 0.002f;  // [m] pairs this much further apart than touching are candidates
};
TissueCollision make_tissue_collision(std::span<const Vec4> rest, std::span<const float> radius, std::span<const uint32_t> body,
                                      std::span<const float> rest_reach, std::vector<Triangle> surface);

struct PairCandidate {
  uint32_t a, b;
};  // tissue particles, a < b

// Boxes by components; padded to whole groups of 16 with boxes of no numbers, which nothing meets.
struct Boxes {
  std::array<Column<float>, 3> lower, upper;  // [m]
  void resize(size_t count);
};
struct BlockBoxes {
  uint32_t blocks = 0, groups = 0;
  Boxes block, group;
};

// Working memory: never saved. All but `boxes` and `moved` is derived from the origins and made from them when `filled` is not
// set. A block that has hardly moved keeps its origins when others are searched again.
struct PairSearch {
  std::vector<PairCandidate> pair;
  bool filled = false;       // what follows is that of the origins
  BlockBoxes boxes;          // as of the last call of make_boxes
  std::vector<float> moved;  // [m] distance of particles from their origins (furthest_move): one for each part of the tissue
  BlockBoxes built;          // around the origins
  BlockBoxes swept;          // around the origins before and after the search that is continuing
  // The origins by components, padded to whole blocks with places that are not numbers: near nothing, however far away a
  // damaged state may have put its particles.
  std::array<Column<float>, 3> at;
  Column<float> radius;
  std::vector<std::vector<PairCandidate>> of_block;  // pairs whose first particle is in it
  struct Near {
    uint32_t block;
    const uint16_t* allowed;  // as in Kin; null: every pair
  };
  struct Part {              // for a group of blocks
    uint32_t moved = 0;      // bit k: its block k is looked for again
    std::vector<Near> near;  // blocks near the one that is looked at, and their boxes
    Boxes near_box;
  };
  std::vector<Part> part;
};

void make_boxes(const TissueCollision& tissue, const Vec4* x, BlockBoxes& boxes, Jobs& jobs);
// [m] no less than the furthest that any of n particles has moved, and not much more where neighbors move alike: the length of
// the furthest moves along each axis.
float furthest_move(const Vec4* x, const Vec4* from, size_t n);
// Whether search.pair may lack a pair that touches, given search.moved.
bool pairs_are_stale(const TissueCollision& tissue, const PairSearch& search);
// Lists the pairs of the origins as they are.
void list_tissue_pairs(const TissueCollision& tissue, const Column<Vec4>& origin, PairSearch& search, Jobs& jobs);
// Moves the origins of what has moved to x [m], per tissue particle, and lists their pairs.
void find_tissue_pairs(const TissueCollision& tissue, const Vec4* x, Column<Vec4>& origin, PairSearch& search, Jobs& jobs);

// Calls with(block) for every block whose box meets the box from..to, in ascending order.
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
