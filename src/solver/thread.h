// solver/thread: the suture thread as an XPBD chain (paper 2.1, 2.3): distance constraints between neighbours, cosine bending
// on triplets, and a direct tridiagonal solve along the whole thread, because a Gauss-Seidel chain of 175 particles at the
// paper's three sweeps stretches by 18 %.
//
// Particles keep their slot for life; `order` lists slots from the free end to the needle. A slot can be
//   free      a particle of its own,
//   anchored  locked to a point of the tissue: a suture point (its position and inverse mass are the tissue's), or
//   held      locked to a place on a rigid body: the needle's swage, a tool's jaw.
// At an anchor the thread can slide: rest length moves from the pair on one side to the pair on the other, and slides
// until the tensions differ by no more than the friction. Sliding is solved inside the tridiagonal system, so the total rest
// length never changes and nothing jumps.
#pragma once
#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "solver/attach.h"
#include "solver/bend.h"
#include "solver/thread_columns.h"
#include "solver/thread_touch.h"

namespace catgut {

struct ThreadModel {
  uint32_t first_slot = 0;  // of the thread's particles in the columns
  uint32_t count = 0;
  float spacing = 0;             // [m] rest distance of neighbours at the start
  float radius = 0;              // [m]
  float inv_mass = 0;            // [1/kg] of a free particle
  float stretch_compliance = 0;  // [m/N] per segment of length `spacing`
  float bend_compliance = 0;     // [1/J]
  int bend_sweeps = 1, distance_sweeps = 1;
  bool direct = true;
  Vec3 gravity;  // [m/s^2] that the predicted positions contain
};

// A suture point's hold on the thread.
struct ThreadAnchor {
  uint32_t slot = 0;
  TissuePoint point;
  Vec3 offset;                  // [m] world, from that point: a knot on its way to the tissue, else zero
  bool knotted = false;         // a locked knot's: the thread never slides here
  float friction = 0;           // [N] tension difference beyond which thread slides, at no tension
  float capstan = 0;            // and so much more per newton of tension: coefficient of friction times the angle it bends by
  int slipping = 0;             // +1: toward the needle, -1: toward the free end, 0: stuck
  bool blocked_needle = false;  // no particle left to pass toward the needle / toward the free end
  bool blocked_free = false;
  float tension_needle = 0, tension_free = 0;  // [N] of the pairs on its two sides, written by solve_thread
  float threshold() const { return friction + capstan * std::max(0.0f, std::min(tension_needle, tension_free)); }
};

enum class HoldKind : uint32_t { swage, jaw, loop };  // the needle's own end, a closed jaw, a loop frozen round a tool

struct ThreadHold {
  uint32_t slot = 0;
  int body = 0;
  Vec3 local;  // [m] body frame
  HoldKind kind = HoldKind::jaw;
};

inline Vec3 position_of(const ThreadAnchor& a, const Vec4* x) { return position_of(a.point, x) + a.offset; }

struct Thread {
  std::vector<uint32_t> order;       // slots, free end first
  std::vector<float> rest;           // [m] per pair (order[i], order[i + 1])
  std::vector<uint8_t> cut;          // per pair: 1 where the thread was cut through; nothing acts across
  std::vector<ThreadAnchor> anchor;  // in the order in which they were made
  std::vector<ThreadHold> hold;
  std::vector<float> tension;  // [N] per pair, of the last substep; negative: compressed
};

// The slide at one anchor within a substep.
struct SlideState {
  float step = 0, total = 0;  // [m] of this Newton step, of the substep
  bool fixed = false;         // at a bound in this step
  bool stopped = false;       // friction stopped it: the anchor sticks
  bool dragged = false;       // the friction of this substep has been spent
};

struct ThreadScratch {
  // Per node of the order.
  PaddedColumn<float> x, y, z;              // [m]
  PaddedColumn<float> w;                    // [1/kg] inverse mass; of the tissue where anchored, 0 where held
  PaddedColumn<float> loose;                // 1 where the node is a particle of its own, 0 where anchored or held
  std::vector<int32_t> anchor_at, hold_at;  // index of its anchor, of its hold, or -1
  // W of the node as its two pairs see it: n0 W n0, n1 W n1, n0 W n1 with n0, n1 the pairs' directions.
  PaddedColumn<float> mass_before, mass_after, across;
  // An impulse p moves a loose node by w (side p + tilt (p.t) t), with t the sum of the pairs' directions (see find_masses).
  PaddedColumn<float> side, tilt;
  std::vector<uint32_t> heavy;  // nodes that are anchored or held: few
  // Per pair.
  PaddedColumn<float> rest, tension, keep;  // copies of the thread's; keep: 0 where it is cut
  PaddedColumn<float> nx, ny, nz;           // unit direction toward the needle; 0 where cut
  PaddedColumn<float> inv_length;           // [1/m]
  PaddedColumn<float> alpha, residual;      // [m/N / s^2], [m]
  PaddedColumn<float> lambda;               // cleared at the start of a substep
  PaddedColumn<float> step;                 // its change in this Newton step
  std::vector<uint64_t> unfit;              // a bit per pair
  Strands<double, 1> stretch;
  Strands<float, 3> motion;
  BendScratch bend;
  std::vector<SlideState> slide;      // per anchor
  std::vector<Vec3> waiting;          // per anchor: impulse that its tissue has yet to get [kg m]
  std::vector<uint32_t> anchor_node;  // per anchor
  std::vector<int32_t> node_of_slot;  // index in the order of each slot (relative to first_slot)
  // Of smooth_motion, per node: where it was, how far it was carried from there without its weight, how far it goes.
  PaddedColumn<float> from_x, from_y, from_z, gone_x, gone_y, gone_z, moved_x, moved_y, moved_z;
  PaddedColumn<float> stiff;  // per pair
  // Written by the contact stage of the substep, read by solve_thread.
  std::vector<ThreadTouch> touch;
  float touch_friction = 0;          // coefficient of Coulomb friction
  std::vector<ToolPush> on_tool;     // per body
  std::vector<Vec3> load;            // per body: what the tensions press on it [N]
  std::vector<NodeContact> contact;  // nodes of these segments
  std::vector<int32_t> contact_at;   // per node: index of its contact, or -1
  void resize(uint32_t count);
};

// A node's position, and the directions of the pairs before and after it; zero where there is none.
inline Vec3 node(const ThreadScratch& s, size_t i) { return {s.x[i], s.y[i], s.z[i]}; }
inline void put_node(ThreadScratch& s, size_t i, Vec3 p) { s.x[i] = p.x, s.y[i] = p.y, s.z[i] = p.z; }
inline Vec3 way_after(const ThreadScratch& s, size_t i) { return {s.nx[i], s.ny[i], s.nz[i]}; }
inline Vec3 way_before(const ThreadScratch& s, size_t i) { return i > 0 ? way_after(s, i - 1) : Vec3{}; }
// The positional impulse that the pairs' steps give a node [kg m].
inline Vec3 impulse_on(const ThreadScratch& s, size_t i) {
  return way_before(s, i) * (i > 0 ? s.step[i - 1] : 0) - way_after(s, i) * s.step[i];
}

// Position of node i of the order, whatever it is locked to.
Vec3 thread_position(const Thread& t, size_t node, const Vec4* x, const std::vector<RigidBody>& body);

// One substep's solve: bending sweeps, direct solve, distance sweeps. Expects cleared multipliers in scratch. Moves thread
// particles, the tissue under anchors and the bodies that hold it; writes tensions and the slide of every anchor. x: predicted
// positions; before: those at the start of the substep; h [s].
void solve_thread(const ThreadModel& model, Thread& thread, ThreadScratch& scratch, Vec4* x, const Vec4* before,
                  const float* inv_mass, const std::vector<RigidModel>& body_model, std::vector<RigidBody>& body, float h);

// One cosine bending constraint (paper 2.1): C = u.v - cos(theta0) with theta0 = pi (straight). Moves the three points by XPBD.
// Straight (u.v = -1) has no gradient and needs none; fully folded (u.v = +1) has none either: it is left to others.
void solve_bend(Vec3& a, Vec3& b, Vec3& c, float wa, float wb, float wc, float compliance, float h, float& lambda);

// XPBD's multiplier step of one distance constraint (Macklin et al. 2016, eq. 18): length l, rest length, generalised inverse
// mass w [1/kg], alpha = compliance / h^2, multiplier so far lambda. Any real type: the sweeps run it in float, `catgut
// validate` in double too.
template <typename Real>
constexpr Real distance_step(Real l, Real rest, Real w, Real alpha, Real lambda) {
  return (-(l - rest) - alpha * lambda) / (w + alpha);
}

float thread_length(const Thread& t, const Vec4* x, const std::vector<RigidBody>& body);

}  // namespace catgut
