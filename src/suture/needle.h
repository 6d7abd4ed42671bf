// SPDX-License-Identifier: Apache-2.0
// suture/needle: the curved swaged needle as a rigid body, and its pose.
// Frame: the body's origin is the center of mass of the arc; the circle lies in the body's xy plane (see NeedleArc).
#pragma once
#include "solver/attach.h"

namespace catgut {

struct NeedleShape {
  float radius = 0.00828f;       // [m] of the circle
  float arc = kPi;               // [rad]
  float wire_radius = 0.00033f;  // [m]
  float mass = 0.005f;           // [kg]
};

NeedleArc needle_arc(const NeedleShape& shape);
// Inertia of a thin arc of wire; capsules along the shaft except the last fifth before the tip, which must be free to enter.
RigidModel needle_body(const NeedleShape& shape);
inline Vec3 needle_point(const NeedleArc& arc, const RigidBody& needle, float phi) {
  return transform(needle.pose(), arc.point(phi));
}
inline Vec3 needle_tip(const NeedleArc& arc, const RigidBody& needle) { return needle_point(arc, needle, arc.arc); }
inline Vec3 needle_swage(const NeedleArc& arc, const RigidBody& needle) { return needle_point(arc, needle, 0); }

}  // namespace catgut
