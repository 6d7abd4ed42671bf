// SPDX-License-Identifier: Apache-2.0
// solver/collide: broad phase for tools and thread, once per tick. (Tissue against tissue:
// tissue_pairs.)
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "geometry/closest.h"
#include "solver/rigid.h"
#include "solver/thread.h"
#include "solver/tissue_pairs.h"

namespace catgut {

struct ToolCandidate {
  uint32_t body, capsule, particle;
};  // tissue particle near a capsule
struct ThreadToolCandidate {
  uint32_t body, capsule, strand, slot;
};  // the segment after `slot` (toward the needle) near a capsule
struct ThreadTissueCandidate {
  uint32_t strand, slot, triangle;
};  // thread particle near the tissue's surface
struct ThreadPairCandidate {
  uint32_t strand_a, a, strand_b, b;
};  // segments after slots a and b, of one strand or of two

// Capsules of two tools that may touch. They can touch where their axes cross and at each of their four ends. Parallel capsules
// touch at two points, the ends of their overlap, and do not tilt about one.
struct ToolPair {
  uint32_t a, b;                  // bodies
  uint32_t capsule_a, capsule_b;  // their capsules
  // Accumulated positional impulses on b in this substep, per point: crossing, first and second end of a, of b. Cleared at the
  // start of a substep.
  struct Impulse {
    float normal = 0;  // [kg m]
    Vec3 rub;          // [kg m]
  };
  std::array<Impulse, 5> done{};
};

struct Candidates {
  PairSearch tissue;  // its boxes are used by all searches
  std::vector<ToolCandidate> tool;
  std::vector<ThreadToolCandidate> thread_tool;
  std::vector<ThreadTissueCandidate> thread_tissue;
  std::vector<ThreadPairCandidate> thread_pair;
  std::vector<ToolPair> tool_pair;
  // Working memory. Strands are split into runs of kRun segments with a box each: most of a thread is far from everything.
  static constexpr size_t kRun = 8;
  std::vector<uint8_t> collides;        // per thread slot (relative to the first strand's first)
  std::vector<Vec3> run_low, run_high;  // [m] per run, strand after strand
  std::vector<uint32_t> run_first;      // per strand: its first run; one more at the end
  std::vector<uint32_t> near_block;
  std::vector<Vec3> middle;  // [m] per thread slot: twice the middle of the segment after it
};

// Inputs of the search.
struct CollideView {
  const TissueCollision& tissue;
  const Vec4* x;
  std::span<const StrandModel> strand_model;
  std::span<const Strand> strand;
  const std::vector<RigidModel>& model;
  const std::vector<RigidBody>& body;
  std::span<const uint8_t> body_collides;
};
// Finds all candidates that involve tools or thread, with a margin [m] for motion within the tick. c.tissue.boxes must be up
// to date.
void find_tool_and_thread_candidates(const CollideView& v, float margin, Candidates& c);
void find_tool_candidates(const CollideView& v, float margin, Candidates& c);  // those of tools and tissue alone
// Once per tick: capsules of different tools that may touch within it. Tools are bodies whose weight a hand carries; the
// needle is excluded, because jaws close on it.
void find_tool_pairs(const std::vector<RigidModel>& model, const std::vector<RigidBody>& body,
                     std::span<const uint8_t> body_collides, std::vector<ToolPair>& pair);

// Nearest tissue particle to p within `reach`, or -1.
int nearest_particle(const TissueCollision& tissue, const Candidates& c, const Vec4* x, Vec3 p, float reach);
// Parameters (0..1) of the closest points of segments a0-a1 and b0-b1.
std::pair<float, float> closest_on_segments(Vec3 a0, Vec3 a1, Vec3 b0, Vec3 b1);

}  // namespace catgut
