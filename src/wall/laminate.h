// SPDX-License-Identifier: Apache-2.0
// wall/laminate: the layers of an organ's wall as one plate. Membrane (A), coupling (B) and bending (D) stiffness of classical
// laminate theory (Jones, Mechanics of Composite Materials, 1999, chapter 4). Thickness, transverse shear, and the stiff
// branch of a J-shaped stress-strain curve (Terry et al. 2014: toe and stiff moduli of bowel along and around).
#pragma once
#include <array>
#include <span>
#include <string>
#include <vector>

#include "core/math.h"

namespace catgut::wall {

// One layer, linear and orthotropic in its plane. "Along" and "around" are the organ's directions; `angle` turns the layer.
struct Layer {
  std::string name = "wall";
  float thickness = 0.0025f;  // [m]
  float e_along = 6e5f;       // [Pa]
  float e_around = 6e5f;      // [Pa]
  float poisson = 0.45f;      // contraction around when stretched along; below 0.5
  float shear = 0;            // [Pa] in the plane; 0: isotropic from the geometric mean of the moduli
  float angle = 0;            // [rad] from "along" toward "around"
  float stiff_along = 0;      // [Pa] modulus beyond `knee`; 0: none
  float stiff_around = 0;     // [Pa]
  float knee_along = 0.3f;    // engineering strain at which fibers along straighten
  float knee_around = 0.3f;
};

// Sums over the layers, per unit area of mid-surface. Indices: 0 along, 1 around, 2 shear (engineering).
struct Laminate {
  float thickness = 0;                                 // [m]
  std::array<std::array<double, 3>, 3> a{}, b{}, d{};  // [N/m], [N], [N m]
  double thick = 0;                                    // [N/m] penalty on thickness strain about plane stress
  std::array<double, 2> contraction{};                 // thickness strain per strain along, around, in plane stress
  std::array<double, 2> shear{};                       // [N/m] transverse, along and around, with the factor 5/6
  std::array<double, 2> stiff{};                       // [N/m] added to a(0,0), a(1,1) beyond the knee
  std::array<double, 2> knee{};                        // strain
};

// `layer` from the inner face (mucosa) to the outer one (serosa). Throws InputError naming `where` for moduli, ratios or
// thicknesses outside the physical range.
Laminate laminate(std::span<const Layer> layer, const std::string& where = "wall");

// The four layers of a bowel wall from mucosa to serosa with the given total thickness and mean moduli. Shares of thickness
// and stiffness: submucosa and muscle carry the load (Egorov et al. 2002); the shares are an assumption, see docs/wall.md.
std::vector<Layer> bowel_layers(float thickness, float e_along, float e_around, float poisson);

}  // namespace catgut::wall
