// SPDX-License-Identifier: Apache-2.0
// thread/material: suture materials as data. Every number names its source or is marked as an
// estimate.
#pragma once
#include <cstdint>
#include <span>
#include <string_view>

namespace catgut::thread {

enum class Material : uint8_t { silk, polyglactin_910, polydioxanone, polypropylene };
enum class Size : uint8_t { usp_4_0, usp_3_0, usp_2_0, usp_0 };

// Mechanical properties of a suture. Bending stiffness is an independent number: a braid bends far more easily than a
// solid rod of the same tensile stiffness.
struct Properties {
  Material material{};
  Size size{};
  std::string_view name;        // "silk 3-0"
  float diameter = 0;           // [m]
  float line_density = 0;       // [kg/m] real; the simulation uses more (Settings::free_density)
  float axial_stiffness = 0;    // EA [N]
  float bending_stiffness = 0;  // B [N.m2]
  float elastic_curvature = 0;  // [1/m] of the sharpest bend that springs back; more of it stays. 0: every bend springs back
  float friction = 0;           // coefficient, thread on thread, where it is pressed with `friction_load`
  // [N] Friction grows with less than the load: F = friction N (friction_load / N)^(1/8). 0: Coulomb's, in proportion.
  float friction_load = 0;
  float knot_strength = 0;      // knot-pull strength [N]: a thread bent by a contact breaks at this tension
  float straight_strength = 0;  // [N]
  bool braided = false;
};

std::span<const Properties> materials();  // all sixteen, by material, then from 4-0 to 0
const Properties& properties(Material material, Size size);
// "silk 3-0" or "silk" (3-0). Null when there is no such suture.
const Properties* find_material(std::string_view name);

}  // namespace catgut::thread
