// SPDX-License-Identifier: Apache-2.0
// exchange: what a hand may feel until the next tick. Physics is slow and a hand is fast: a force that is held for a frame
// pumps energy into the hand, so the simulation never sends a force. It sends the neighborhood of one: how force changes when
// the hand moves, where contact ends, how it rubs, and until when all this may be believed. The servo evaluates it a thousand
// times a second (haptic/force_model). Self-contained, no pointers. World frame, SI units; forces act on the hand.
#pragma once
#include <cstdint>

#include "core/sym3.h"

namespace catgut {

struct ForcePatch {
  uint64_t tick = 0;
  uint32_t epoch = 0;  // counts jumps in time (begin again, undo): what was felt before is void
  uint32_t discontinuity_id =
      0;                 // counts what changes at once (pierced, taken, let go): the new patch is not blended with the old
  uint64_t time_ns = 0;  // on the servo's clock, when the physics was done with it
  float period = 0;      // [s] between two ticks
  float expiry = 0.03f;  // [s] of age from which it is no longer believed (Force Dimension's watchdog: 31.9 ms at most)

  // The linear part: force + stiffness (point - x) - damping v. Stiffness and damping are symmetric and positive semidefinite.
  Vec3 point;      // [m] where the hand was
  Vec3 force;      // [N] there, without friction
  Sym3 stiffness;  // [N/m] as the hand feels it: the tissue behind the coupling
  Sym3 damping;    // [N s/m]

  // Where it holds: where normal . (x - point) < gap; beyond that the tool has left the tissue and nothing is felt. A zero
  // normal: everywhere (needle, tissue or thread is held).
  Vec3 normal;    // unit, out of the tissue
  float gap = 0;  // [m]

  // Friction, worked out in the servo because it is what a slow loop cannot do: Dahl's model, at most
  // drag + coefficient * (force along normal), along `along`, or in the plane of contact where that is zero.
  float coefficient = 0;
  float drag = 0;             // [N]
  float presliding = 0.001f;  // [m] over which it builds up
  float viscous = 0;          // [N s/m] while it rubs
  Vec3 along;                 // unit or zero

  // The tip is about to go through: when the force against `pierce` grows beyond pierce_force the servo lets it drop at once to
  // pierce_keep of that, and the physics catches up. pierce_force 0: nothing to pierce.
  Vec3 pierce;               // unit, the way the tip moves
  float pierce_force = 0;    // [N]
  float pierce_keep = 0.4f;  // of the force

  // For who looks on: what the thread does to this hand, already part of the above.
  Vec3 thread_direction;     // unit, the way it pulls the hand; zero: no thread
  float thread_tension = 0;  // [N]

  float cap = 3.3f;  // [N] never more than this
};

}  // namespace catgut
