// SPDX-License-Identifier: Apache-2.0
// physical/heat: temperature and heat damage of the wall beside a pen's tip, per cell of the faces' rasters, as means over the
// thickness. Reads the tip's power; writes Heat.
//
// The tip heats the cells round it; conduction spreads the heat over links that no cut has removed. At 100 degrees the rest of
// the power goes into steam. Damage: the Arrhenius integral of Henriques (Arch Pathol 1947;43:489-502), 1 where
// tissue is destroyed: one second at 60 degrees. Published spread beside a monopolar tip: Sutton et al. 2010, 10.1002/bjs.6901.
// Assumptions: the shares of the power that heat the tissue, the radii of the heated spot, and the cooling by blood and air.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/reflect.h"
#include "wall/cut.h"
#include "wall/reflect.h"

namespace catgut::physical {

struct HeatModel {
  float diffusivity = 1.4e-7f;                             // [m2/s] of water-rich tissue
  float capacity = 3.8e6f;                                 // [J/(m3 K)]
  float share_cut = 0.1f, share_coagulate = 0.5f;          // of the power
  float radius_cut = 0.4e-3f, radius_coagulate = 1.2e-3f;  // [m] of the heated spot
  float cooling = 60;                                      // [s] in which the rest of the body takes the heat away
};
constexpr float kBody = 310.15f, kBoiling = 63;  // [K]; [K] above it

struct Heat {
  std::vector<std::array<float, wall::kCells>> warmer;  // [K] above the body, per face and cell; empty: nothing was heated
  std::vector<std::array<float, wall::kCells>> damage;  // Arrhenius integral
  std::vector<uint32_t> warm;                           // faces that are not at the body's temperature, in order
  float spread = 0;                                     // [m] largest distance of a destroyed cell from the tip's path
  float area = 0;                                       // [m2] destroyed
};
constexpr void reflect(auto& a, Like<Heat> auto& h) { a(h.warmer), a(h.damage), a(h.warm), a(h.spread), a(h.area); }

// The tip at a material point for h seconds.
void heat_at(const HeatModel& law, const wall::Model& wall, const wall::Point& tip, float power, bool coagulate, float h,
             Heat& heat);
// Working memory of `conduct`.
struct HeatScratch {
  std::vector<uint32_t> active;                       // warm faces and their neighbors
  std::vector<std::array<float, wall::kCells>> next;  // [K] of them
};
// Conduction, cooling and damage in h seconds. path: places of the tip.
void conduct(const HeatModel& law, const wall::Model& wall, const wall::Topology& topology, std::span<const wall::Point> path,
             float h, HeatScratch& scratch, Heat& heat);

}  // namespace catgut::physical
