// solver/collide: who may touch whom. Candidates are found with a margin and reused until something has moved by more than
// half of it, so most substeps pay only for the check. Candidate lists are sorted by particle, hence the same for any
// number of workers, and a pair that touches is always in the list, so rebuilding sooner or later changes nothing.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "geometry/closest.h"
#include "geometry/mesh.h"
#include "solver/rigid.h"
#include "solver/thread.h"

namespace catgut {

// What of the tissue collides. Block boxes of 16 consecutive particles make the broad phase; consecutive particles must be
// neighbours in space, which bodies promise.
struct TissueCollision {
  uint32_t particles = 0;
  std::vector<float> radius;      // [m] per particle, against other tissue
  std::vector<uint32_t> body;     // per particle
  std::vector<float> rest_reach;  // [m] per particle: same-body particles nearer than this at rest never collide
  std::vector<Triangle> surface;
  std::vector<uint32_t> ring_first;  // per particle: first of its triangles in ring, size particles + 1
  std::vector<uint32_t> ring;        // triangles around each particle
  float tool_radius = 0.0006f;       // [m] of a particle against tools
  float largest_radius = 0;
};
TissueCollision make_tissue_collision(std::span<const Vec4> rest, std::span<const float> radius, std::span<const uint32_t> body,
                                      std::span<const float> rest_reach, std::vector<Triangle> surface);

struct PairCandidate {
  uint32_t a, b;
};  // tissue particles, a < b
struct ToolCandidate {
  uint32_t body, capsule, particle;
};  // tissue particle near a capsule
struct ThreadToolCandidate {
  uint32_t body, capsule, slot;
};  // the segment after `slot` (toward the needle) near a capsule
struct ThreadTissueCandidate {
  uint32_t slot, triangle;
};  // thread particle near the tissue's surface
struct ThreadPairCandidate {
  uint32_t a, b;
};  // segments after slots a and b

struct Candidates {
  std::vector<PairCandidate> pair;
  std::vector<ToolCandidate> tool;
  std::vector<ThreadToolCandidate> thread_tool;
  std::vector<ThreadTissueCandidate> thread_tissue;
  std::vector<ThreadPairCandidate> thread_pair;
  std::vector<Vec4> built_at;        // tissue positions when `pair` was built; empty: build now
  std::vector<Vec3> lower, upper;    // block boxes
  std::vector<uint32_t> near_block;  // working memory
  std::vector<Vec3> middle;
  std::vector<float> x, y, z, radius;
};

constexpr float kPairMargin = 0.002f;  // [m]

// Rebuilds candidates.pair if any particle has moved by more than half the margin since it was built.
void find_tissue_pairs(const TissueCollision& tissue, const Vec4* rest, const Vec4* x, Candidates& c);
// Once a tick: everything that involves tools or thread, with a margin [m] for what may happen within the tick.
// thread_collides: per thread slot (relative to first_slot), 0 where collisions are off (paper 2.3).
void find_tool_and_thread_candidates(const TissueCollision& tissue, const Vec4* x, const ThreadModel& thread_model,
                                     const Thread& thread, std::span<const uint8_t> thread_collides,
                                     const std::vector<RigidModel>& model, const std::vector<RigidBody>& body,
                                     std::span<const uint8_t> body_collides, float margin, Candidates& c);

// Nearest tissue particle to p within `reach`, or -1.
int nearest_particle(const TissueCollision& tissue, const Candidates& c, const Vec4* x, Vec3 p, float reach);
// Parameters (0..1) of the nearest points of segments a0-a1 and b0-b1.
std::pair<float, float> closest_on_segments(Vec3 a0, Vec3 a1, Vec3 b0, Vec3 b1);
void update_boxes(const TissueCollision& tissue, const Vec4* x, Candidates& c);

}  // namespace catgut
