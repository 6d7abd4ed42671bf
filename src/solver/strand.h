// SPDX-License-Identifier: Apache-2.0
// solver/strand: one suture thread as data, with all queries and edits of it. Every stage above (suture, sim, validation) uses
// these; solver/thread moves a strand. Paper 2.1 and 2.3.
//
// Particles keep their slot permanently; `order` lists slots from the free end to the needle. A node is an index in `order`, a
// pair joins nodes i and i + 1. A slot can be
//   free      a particle of its own,
//   anchored  locked to a point of the tissue: a suture point (its position and inverse mass are the tissue's), or
//   held      locked to a place on a rigid body: the needle's swage, a tool's jaw.
//
// Collision flags are not state. They follow from order, anchors and holds (collision_flags), and the broad phase derives
// them once per tick, so an edit cannot leave them stale.
//
// A second thread model may implement the same queries: it may order, space and move nodes freely, and sets `tension`.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "solver/attach.h"

namespace catgut {

// Constant during a run.
struct StrandModel {
  uint32_t first_slot = 0;  // of the strand's particles in the columns
  uint32_t count = 0;
  float spacing = 0;             // [m] rest distance of neighbors at the start
  float radius = 0;              // [m]
  float inv_mass = 0;            // [1/kg] of a free particle
  float stretch_compliance = 0;  // [m/N] per segment of length `spacing`
  float bend_compliance = 0;     // [1/J]
  int bend_sweeps = 1, distance_sweeps = 1;
  bool direct = true;
  int collision_off = 3;  // nodes on each side of a locked one that do not collide (paper 2.3)
  Vec3 gravity;           // [m/s^2] included in the predicted positions
  bool has(uint32_t slot) const { return slot - first_slot < count; }
};

// An anchor: a suture point's hold on the thread.
struct ThreadAnchor {
  uint32_t slot = 0;
  EmbeddedPoint point;
  Vec3 offset;                  // [m] world, from that point: a knot that moves toward the tissue, else zero
  bool knotted = false;         // of a locked knot: the thread never slides here
  float friction = 0;           // [N] tension difference above which thread slides, at zero tension
  float capstan_friction = 0;   // additional threshold per newton of tension: friction coefficient times bend angle
  int slipping = 0;             // +1: toward the needle, -1: toward the free end, 0: stuck
  bool blocked_needle = false;  // no particle left to pass toward the needle / toward the free end
  bool blocked_free = false;
  float tension_needle = 0, tension_free = 0;  // [N] of the pairs on its two sides, written by solve_thread
  float threshold() const { return friction + capstan_friction * std::max(0.0f, std::min(tension_needle, tension_free)); }
};

enum class HoldKind : uint32_t { swage, jaw, loop };  // the needle's swage, a closed jaw, a loop frozen on a tool

struct ThreadHold {
  uint32_t slot = 0;
  int body = 0;
  Vec3 local;  // [m] body frame
  HoldKind kind = HoldKind::jaw;
};

inline Vec3 position_of(const ThreadAnchor& a, const Vec4* x) { return position_of(a.point, x) + a.offset; }

struct Strand {
  std::vector<uint32_t> order;       // slots, free end first
  std::vector<float> rest;           // [m] per pair (order[i], order[i + 1])
  std::vector<uint8_t> cut;          // per pair: 1 where the thread is cut; no force acts across
  std::vector<ThreadAnchor> anchor;  // in the order in which they were made
  std::vector<ThreadHold> hold;
  std::vector<float> tension;  // [N] per pair, of the last substep; negative: compressed
};

constexpr int kNoAnchor = -1;

// --- queries -----------------------------------------------------------------------------------------------------------
// Node of a slot; order.size() if the strand does not have it.
inline size_t node_of(const Strand& s, uint32_t slot) {
  return static_cast<size_t>(std::find(s.order.begin(), s.order.end(), slot) - s.order.begin());
}
// Row of Strand::anchor that locks a slot, or kNoAnchor.
int anchor_of(const Strand& s, uint32_t slot);
inline bool is_anchored(const Strand& s, uint32_t slot) { return anchor_of(s, slot) != kNoAnchor; }
bool is_held(const Strand& s, uint32_t slot);
bool is_held_by(const Strand& s, uint32_t slot, int body);
bool is_held_by(const Strand& s, uint32_t slot, int body, HoldKind kind);
inline bool is_locked(const Strand& s, uint32_t slot) { return is_anchored(s, slot) || is_held(s, slot); }
// False once the thread is cut from its needle.
bool is_swaged(const Strand& s);

// Whether thread continues from a node toward the needle (direction +1) or the free end (-1), without an end or a cut
// there.
inline bool continues(const Strand& s, size_t node, int direction) {
  return direction > 0 ? node + 1 < s.order.size() && !s.cut[node] : node > 0 && !s.cut[node - 1];
}
// The pair on that side of a node.
inline size_t pair_beside(size_t node, int direction) { return direction > 0 ? node : node - 1; }
// Whether no pair between two nodes is cut.
bool is_whole(const Strand& s, size_t a, size_t b);

// [N] larger tension of the two pairs outside the run of nodes first to last; beyond an end it is zero. At one node: the
// larger of its two sides, which is the load of a jaw there.
float tension_outside(const Strand& s, size_t first, size_t last);
inline float tension_at(const Strand& s, size_t node) { return tension_outside(s, node, node); }
// [m] sum of rest lengths between two nodes (in any order), cut or not; of all pairs.
float rest_between(const Strand& s, size_t a, size_t b);
float rest_length(const Strand& s);

// Position of a node, whatever it is locked to.
Vec3 thread_position(const Strand& s, size_t node, const Vec4* x, const std::vector<RigidBody>& body);
float thread_length(const Strand& s, const Vec4* x, const std::vector<RigidBody>& body);

// Which slots (relative to first_slot) collide: not locked slots, nor `collision_off` neighbors on each side of them; all
// others do (paper 2.3). A loop on a tool keeps colliding, because the next turns lie on the same tool. The loop of a throw
// that moves to the tissue does not: it has left its tool and must not catch on it.
void collision_flags(const StrandModel& model, const Strand& s, std::span<uint8_t> collides);

// --- edits -------------------------------------------------------------------------------------------------------------
// The initial strand: slots in order, uncut, not held.
void reset(const StrandModel& model, Strand& s);
// Moves the particle at node `from` to directly after the particle now at node `after` (figure 8). Every pair gets a rest
// length that preserves the sum. from and after differ; ends of the thread stay ends. If the particle is already directly
// after `after`, nothing changes.
void move_particle(Strand& s, size_t from, size_t after);
// Cuts the pair: both sides are ends from now on.
void cut_pair(Strand& s, size_t pair);
// Removes all holds of this kind by a body.
void release_holds(Strand& s, int body, HoldKind kind);

}  // namespace catgut
