// SPDX-License-Identifier: Apache-2.0
// physical/rigid_fit: the turn that takes points best, by least squares, from where they were to where they are.
#pragma once
#include <cmath>

#include "core/math.h"
#include "core/sym3.h"
#include "physical/body_internal.h"

namespace catgut::physical {

// each(visit) calls visit(was, is) for every point, seen from the middle of all of them [m]. Points on a line leave the turn
// about it open; then it is none.
template <typename Each>
Quat best_turn(Each each) {
  constexpr int kSteps = 4;  // of a Newton iteration that doubles the digits each time
  // a x = b for a positive definite matrix; nothing where it is singular.
  const auto solved = [](const Sym3& a, Vec3 b) {
    const Vec3 x{a.xx, a.xy, a.xz}, y{a.xy, a.yy, a.yz}, z{a.xz, a.yz, a.zz};
    const float volume = dot(x, cross(y, z));
    if (!(std::abs(volume) > 1e-30f)) return Vec3{};
    return (cross(y, z) * b.x + cross(z, x) * b.y + cross(x, y) * b.z) / volume;
  };
  Quat turn;
  for (int i = 0; i < kSteps; ++i) {
    Sym3 inertia;
    Vec3 moment{};
    each([&](Vec3 was, Vec3 is) {
      const Vec3 arm = rotate(turn, was);
      inertia += identity(length2(arm)) + outer(arm, -1);
      moment += cross(arm, is - arm);
    });
    turn = turned(turn, solved(inertia, moment));
  }
  return turn;
}

}  // namespace catgut::physical
