// SPDX-License-Identifier: Apache-2.0
// solver/thread: the suture thread as an XPBD chain (paper 2.1, 2.3). Distance constraints between neighbors, cosine bending
// on triplets, and a direct tridiagonal solve along the whole thread. A Gauss-Seidel chain of 175 particles at the paper's
// three sweeps stretches by 18 %.
//
// At an anchor the thread can slide. Rest length moves from the pair on one side to the pair on the other, until the tensions
// differ by no more than the friction. Sliding is solved inside the tridiagonal system, so the total rest length is constant
// and the motion continuous.
#pragma once
#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "solver/bend.h"
#include "solver/strand.h"
#include "solver/thread_columns.h"
#include "solver/thread_touch.h"

namespace catgut {

// The slide at one anchor within a substep.
struct SlideState {
  float step = 0, total = 0;  // [m] of this Newton step, of the substep
  bool fixed = false;         // at a bound in this step
  bool stopped = false;       // friction stopped it: the anchor sticks
  bool dragged = false;       // the friction of this substep has been applied
};

struct ThreadScratch {
  // Per node of the order.
  PaddedColumn<float> x, y, z;              // [m]
  PaddedColumn<float> w;                    // [1/kg] inverse mass; of the tissue where anchored, 0 where held
  PaddedColumn<float> is_free;              // 1 where the node is a particle of its own, 0 where anchored or held
  std::vector<int32_t> anchor_at, hold_at;  // index of its anchor, of its hold, or -1
  // W of the node as its two pairs see it: n0 W n0, n1 W n1, n0 W n1 with n0, n1 the pairs' directions.
  PaddedColumn<float> mass_before, mass_after, across;
  // An impulse p moves a free node by w (side p + tilt (p.t) t), with t the sum of the pairs' directions (see find_masses).
  PaddedColumn<float> side, tilt;
  std::vector<uint32_t> constrained;  // nodes that are anchored or held: few
  // Per pair.
  PaddedColumn<float> rest, tension, intact;  // copies of the thread's; intact: 0 where it is cut
  PaddedColumn<float> nx, ny, nz;             // unit direction toward the needle; 0 where cut
  PaddedColumn<float> inv_length;             // [1/m]
  PaddedColumn<float> alpha, residual;        // [m/N / s^2], [m]
  PaddedColumn<float> lambda;                 // cleared at the start of a substep
  PaddedColumn<float> step;                   // its change in this Newton step
  std::vector<uint64_t> violated;             // a bit per pair
  PartitionedTridiagonal<double, 1> stretch;
  PartitionedTridiagonal<float, 3> motion;
  BendScratch bend;
  std::vector<SlideState> slide;      // per anchor
  std::vector<Vec3> waiting;          // per anchor: impulse not yet applied to its tissue [kg m]
  std::vector<uint32_t> anchor_node;  // per anchor
  std::vector<int32_t> node_of_slot;  // index in the order of each slot (relative to first_slot)
  // Of smooth_motion, per node: previous position, displacement without weight, final displacement.
  PaddedColumn<float> from_x, from_y, from_z, gone_x, gone_y, gone_z, moved_x, moved_y, moved_z;
  PaddedColumn<float> stiff;  // per pair
  // Written by the contact stage of the substep, read by solve_thread.
  std::vector<ThreadTouch> touch;
  float touch_friction = 0;          // coefficient of Coulomb friction
  std::vector<ToolPush> on_tool;     // per body
  std::vector<Vec3> load;            // per body: force of the tensions on it [N]
  std::vector<NodeContact> contact;  // nodes of these segments
  std::vector<int32_t> contact_at;   // per node: index of its contact, or -1
  void resize(uint32_t count);
};

// A node's position, and the directions of the pairs before and after it; zero where there is none.
inline Vec3 node(const ThreadScratch& s, size_t i) { return {s.x[i], s.y[i], s.z[i]}; }
inline void put_node(ThreadScratch& s, size_t i, Vec3 p) { s.x[i] = p.x, s.y[i] = p.y, s.z[i] = p.z; }
inline Vec3 way_after(const ThreadScratch& s, size_t i) { return {s.nx[i], s.ny[i], s.nz[i]}; }
inline Vec3 way_before(const ThreadScratch& s, size_t i) { return i > 0 ? way_after(s, i - 1) : Vec3{}; }
// The positional impulse of the pairs' steps on a node [kg m].
inline Vec3 impulse_on(const ThreadScratch& s, size_t i) {
  return way_before(s, i) * (i > 0 ? s.step[i - 1] : 0) - way_after(s, i) * s.step[i];
}

// One substep's solve: bending sweeps, direct solve, distance sweeps. Expects cleared multipliers in scratch. Moves thread
// particles, the tissue under anchors and the bodies that hold it. Writes tensions and the slide of every anchor. x: predicted
// positions; before: those at the start of the substep; h [s].
void solve_thread(const StrandModel& model, Strand& thread, ThreadScratch& scratch, Vec4* x, const Vec4* before,
                  const float* inv_mass, const std::vector<RigidModel>& body_model, std::vector<RigidBody>& body, float h);

// One cosine bending constraint (paper 2.1): C = u.v - cos(theta0) with theta0 = pi (straight). Moves the three points by XPBD.
// Straight (u.v = -1) needs no gradient; fully folded (u.v = +1) has none and is left to other constraints.
void solve_bend(Vec3& a, Vec3& b, Vec3& c, float wa, float wb, float wc, float compliance, float h, float& lambda);

// XPBD's multiplier step of one distance constraint (Macklin et al. 2016, eq. 18): length l, rest length, generalized inverse
// mass w [1/kg], alpha = compliance / h^2, multiplier so far lambda. Any real type: the sweeps run it in float, `catgut
// validate` in double too.
template <typename Real>
constexpr Real distance_step(Real l, Real rest, Real w, Real alpha, Real lambda) {
  return (-(l - rest) - alpha * lambda) / (w + alpha);
}

}  // namespace catgut
