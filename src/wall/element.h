// SPDX-License-Identifier: Apache-2.0
// wall/element: a solid-shell element on three or four columns of the wall, corotated. A column is a point of the mid-surface
// and a director: half the vector from the inner to the outer face. One formula serves doubles (references, tests) and SIMD
// lanes (the simulation).
//
// Through the thickness the strain is membrane plus zeta times bending (zeta = -1 inner face, 1 outer face). Assumed strains
// keep a coarse mesh from locking: in-plane bending after Pian and Sumihara 1984 (doi 10.1002/nme.1620200911), transverse shear
// sampled on the edges after Dvorkin and Bathe 1984 (doi 10.1108/eb023562) with the mesh-dependent factor of Lyly, Stenberg and
// Vihinen 1993 (doi 10.1016/0045-7825(93)90214-I), thickness strain as a penalty about plane stress. The frame is the polar
// decomposition of the mean deformation. Forces are the exact gradient of the energy, including the rotation of the frame.
// Without it, unequal moduli have no potential, and an element exerts a torque on itself.
#pragma once
#include <array>
#include <cmath>
#include <cstdint>
#include <span>

#include "wall/laminate.h"

namespace catgut::wall {

// Constants of an element in its local frame: x along, y around, z outward. Stiffnesses are integrated over the area; bending
// strain is counted per zeta.
// clang-format off
enum Constant : uint32_t {
  kG11, kG12, kG21, kG22,                  // [1/m] inverse of the mid-surface's tangents
  kA1x, kA1y, kA2x, kA2y,                  // [m] tangents
  kD0x, kD0y, kD0z, kInvD0z,               // [m], [1/m] mean director
  kH1x, kH1y, kH1z, kH2x, kH2y, kH2z,      // [m] warp of the mid-surface (xi eta), director along xi,
  kH3x, kH3y, kH3z, kH4x, kH4y, kH4z,      //     along eta, along xi eta
  kA11, kA12, kA22, kA16, kA26, kA66,      // [J] membrane
  kB11, kB12, kB22, kB16, kB26, kB66,      // [J] membrane and bending
  kE11, kE12, kE22, kE16, kE26, kE66,      // [J] bending
  kStiff1, kKnee1, kStiff2, kKnee2,        // [J], strain
  kThick, kContract1, kContract2,          // [J], ratio, ratio
  kShear1, kShear2,                        // [J] transverse, mean
  kInPlane11, kInPlane12, kInPlane22,      // [N/m] of the warp in the plane
  kTwist11, kTwist12, kTwist22,            // [N/m] of the director's xi eta part in the plane
  kEdge11, kEdge12, kEdge22,               // [N/m^3] transverse shear that varies along the edges
  kThick2, kThick3, kThick4,               // [N/m] thickness that varies over the element
  kConstants
};
// clang-format on

// A vector, a frame and the element's deformation modes, for one number type each; see element_formula.h.
namespace scalar {
inline double above(double a, double b) { return a > b ? 1 : 0; }
inline double absolute(double a) { return std::abs(a); }
inline double larger(double a, double b) { return a > b ? a : b; }
inline double square_root(double a) { return std::sqrt(a); }
inline bool any(double a) { return a > 0; }
#include "wall/element_formula.h"
}  // namespace scalar

struct ElementRest {
  std::array<double, kConstants> constant{};
  scalar::Turn<double> turn{};  // of the local frame, at rest
  double area = 0;              // [m^2]
};

// mid, dir: of three or four columns at rest, counter-clockwise seen from outside; along: a direction that is not the normal.
// Throws InputError naming `where` for an element without area or thickness.
ElementRest element_rest(std::span<const Vec3> mid, std::span<const Vec3> dir, Vec3 along, const Laminate& laminate,
                         const std::string& where);

}  // namespace catgut::wall
