// SPDX-License-Identifier: Apache-2.0
// exchange: local contact model for one hand until the next tick. Physics is slow and a hand is fast: a force held for a frame
// adds energy to the hand. The simulation therefore sends a model of the force nearby: how it changes when the hand moves,
// where contact ends, its friction, and when it expires. The servo evaluates it a thousand times per second
// (haptic/force_model). Self-contained, no pointers. World frame, SI units; forces act on the hand.
#pragma once
#include <cstdint>

#include "core/sym3.h"

namespace catgut {

constexpr float kNoCap = 1000;  // [N] above the force of any device

struct ForcePatch {
  uint64_t tick = 0;
  uint32_t epoch = 0;  // counts jumps in time (restart, undo): earlier patches are void
  uint32_t discontinuity_id =
      0;                 // counts discontinuities (puncture, grasp, release): the new patch is not blended with the old
  uint64_t time_ns = 0;  // on the servo's clock, when the physics had finished it
  float period = 0;      // [s] between two ticks
  float expiry = 0.03f;  // [s] maximum age (Force Dimension's watchdog: 31.9 ms at most)

  // The linear part: force + stiffness (point - x) - damping v. Stiffness and damping are symmetric and positive semidefinite.
  Vec3 point;      // [m] position of the hand
  Vec3 force;      // [N] there, without friction
  Sym3 stiffness;  // [N/m] as rendered to the hand: the tissue in series with the coupling
  Sym3 damping;    // [N s/m]

  // Range of validity: where normal . (x - point) < gap; beyond that the tool has left the tissue and the force is zero. A zero
  // normal: everywhere (needle, tissue or thread is held).
  Vec3 normal;    // unit, out of the tissue
  float gap = 0;  // [m]

  // Friction, computed in the servo because a slow loop cannot: at most
  // drag + coefficient * (force along normal), along `along`; in the contact plane if that is zero.
  float coefficient = 0;
  float drag = 0;             // [N]
  float presliding = 0.001f;  // [m] presliding length
  float viscous = 0;          // [N s/m] while it slides
  Vec3 along;                 // unit or zero

  // The tip is about to puncture. When the force against `pierce` exceeds pierce_force, the servo immediately reduces it to
  // pierce_keep of that, and the physics follows. pierce_force 0: no puncture possible.
  Vec3 pierce;               // unit, direction of the tip's motion
  float pierce_force = 0;    // [N]
  float pierce_keep = 0.4f;  // of the force

  // For display: the force of the thread on this hand, already included above.
  Vec3 thread_direction;     // unit, direction of the pull on the hand; zero: no thread
  float thread_tension = 0;  // [N]

  float cap = kNoCap;  // [N] maximum force, besides the limits of the device; 0: no force, torque or grip at all

  // For devices with motors for rotation. The force above acts at point + lever, rigidly attached to the hand: its torque about
  // the hand is lever x force, and a rotation of the hand moves the place where the force acts. `couple` is the torque besides,
  // with a spring about its own axis. Recomputed in each tick; not part of the state.
  Quat turn;                   // orientation of the hand
  Vec3 lever;                  // [m] from the hand, at that orientation
  Vec3 couple;                 // [N m]
  float couple_stiffness = 0;  // [N m/rad] about `couple`

  // For grippers: what the jaws hold pushes the fingers apart, from jaw `grip_from` (ToolInput::jaw) down. 0: the jaws are
  // empty.
  float grip_from = 0;
  float grip_stiffness = 0;  // [N] per unit of jaw
};

}  // namespace catgut
