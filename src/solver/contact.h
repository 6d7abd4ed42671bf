// SPDX-License-Identifier: Apache-2.0
// solver/contact: unilateral contact with Coulomb friction in positions. Tissue on tissue, tools on tissue and on each other,
// thread (as capsules) on tools, on itself and on the tissue's surface, and the drape under everything. Normal part: C = gap >=
// 0, resolved at once (contacts are hard). Friction undoes the slip since the start of the substep, at most friction times the
// normal correction.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "solver/collide.h"

namespace catgut {

struct Friction {
  float tissue = 0, tool = 0, thread = 0;
};
// The force of contacts on each body in this substep: positional impulse sums [kg m]; divide by h^2 for newtons.
struct BodyContact {
  Vec3 linear, angular;
  // Of `linear`, the part of tissue and of the other tool: normal and tangential; and the sum of normal impulses regardless of
  // direction. For callers that render friction themselves.
  Vec3 pressing, rubbing;
  float pressed = 0, by_tool = 0;  // `by_tool`: part of `pressed` from the other tool
};

struct ContactView {  // input of a contact kernel, gathered once per substep
  Vec4* x;
  const Vec4* prev;
  const float* inv_mass;
  const std::vector<RigidModel>* model;
  std::vector<RigidBody>* body;
  std::vector<BodyContact>* on_body;
  uint32_t first_slot;  // of the first strand
  std::span<const Strand> strand;
  std::span<const StrandModel> strand_model;
  const int32_t* node_of_slot;  // per thread slot (relative to first_slot); -1: not in its strand
  const uint8_t* locked;        // likewise: an anchor or a hold sets its position
};

// One sweep each; returns the number of touching candidates.
uint32_t solve_tissue_pairs(const ContactView& v, const TissueCollision& tissue, const std::vector<PairCandidate>& list,
                            float friction);
uint32_t solve_tools_on_tissue(const ContactView& v, const TissueCollision& tissue, const std::vector<ToolCandidate>& list,
                               float friction);
// Tools on each other, rigid. Overlap from this substep is resolved in it, whichever side the axes are on now. Earlier overlap
// (hands that connect inside each other) is resolved at 0.1 mm per substep, to avoid a jerk. Impulses accumulate over the
// sweeps of a substep and may decrease in a later sweep. Sweeps that alternate with the hand welds then converge to the
// balance of both. most_press [kg m]: maximum impulse of a pair. Above it the tools slip past each other. Without force
// feedback nothing stops a hand, and interlocked tools would tear what they hold.
uint32_t solve_tools_on_tools(const ContactView& v, std::vector<ToolPair>& list, float friction, float most_press);
// Only segments that lie on the drape at height `ground` [m], if the strand's own solve handles the others.
uint32_t solve_thread_on_tools(const ContactView& v, const std::vector<ThreadToolCandidate>& list, float friction,
                               float ground);
// Adds those others to ThreadScratch::touch of their strand: segments near a tool, above the drape. Thread squeezed between
// drape and tool is excluded: no solution exists between two rigid surfaces, and a direct solve would eject it sideways.
void find_thread_touch(const ContactView& v, const std::vector<ThreadToolCandidate>& list, float ground,
                       std::vector<ThreadScratch>& scratch);
uint32_t solve_thread_on_tissue(const ContactView& v, const TissueCollision& tissue,
                                const std::vector<ThreadTissueCandidate>& list, float friction);
uint32_t solve_thread_on_thread(const ContactView& v, const std::vector<ThreadPairCandidate>& list, float friction);
// The drape: a horizontal plane at height `ground` [m] for threads and needles.
// body_force [N]: see SolverState.
uint32_t solve_ground(const ContactView& v, const std::vector<Vec3>& body_force, float ground, float friction);

}  // namespace catgut
