// SPDX-License-Identifier: Apache-2.0
// physical/bleed: see the header.
#include "physical/bleed.h"

#include <algorithm>
#include <cmath>

namespace catgut::physical {
namespace {

constexpr float kLeast = 1e-11f;  // [m3/s] less is nothing

uint32_t mixed(uint32_t a, uint32_t b) {
  uint32_t h = a * 0x9e3779b1u ^ (b + 0x7f4a7c15u) * 0x85ebca6bu;
  h ^= h >> 15, h *= 0x2c1b3c6du, h ^= h >> 12;
  return h * 0x297a2d39u ^ h >> 16;
}

Vec3 on_lattice(const wall::Model& m, uint32_t face, bool quad, wall::LatticePoint p) {
  wall::Point at{face, 0, 0, 0};
  wall::to_natural(quad, p, at.xi, at.eta);
  return wall::rest_place(m, at);
}

// [m] of the cut that removes a link. A link over an edge has two halves.
float length_of(const wall::Model& m, wall::Mark mark) {
  const bool quad = m.mesh.face[mark.face][3] != wall::kNone;
  const wall::Raster& r = wall::raster(quad);
  if (mark.link >= r.inner) {
    const uint32_t n = quad ? 4 : 3, e = (mark.link - r.inner) / wall::kRaster;
    const auto middle = [&](uint32_t k) {
      const uint32_t c = m.mesh.face[mark.face][k % n];
      return (m.mesh.outer[c] + m.mesh.inner[c]) * 0.5f;
    };
    return 0.5f * distance(middle(e), middle(e + 1)) / wall::kRaster;
  }
  wall::LatticePoint a, b;
  wall::border_of(quad, r.link[mark.link], a, b);
  return distance(on_lattice(m, mark.face, quad, a), on_lattice(m, mark.face, quad, b));
}

}  // namespace

float vessel_flow(const BleedModel& law, float diameter) {
  const float d2 = diameter * diameter;
  return kPi * law.pressure * d2 * d2 / (128 * law.viscosity * law.length);
}

void open_vessel(const BleedModel& law, const wall::Model& m, wall::Mark mark, bool by_heat, std::vector<Bleed>& bleed) {
  const uint32_t dice = mixed(mark.face, mark.link);
  const float chance = length_of(m, mark) / law.spacing;
  if (static_cast<float>(dice >> 8) >= chance * 16777216.0f || bleed.size() >= kMaxBleed) return;
  const float diameter = law.diameter[dice % law.diameter.size()];
  if (by_heat && diameter <= law.closed_by_cut) return;
  const bool quad = m.mesh.face[mark.face][3] != wall::kNone;
  const wall::Raster& r = wall::raster(quad);
  Bleed b;
  b.at.face = mark.face;
  wall::to_natural(quad, r.center[r.link[mark.link].a], b.at.xi, b.at.eta);
  b.open = vessel_flow(law, diameter);
  bleed.push_back(b);
}

void coagulate(const BleedModel& law, const wall::Model& m, Vec3 tip, float h, std::vector<Bleed>& bleed) {
  for (Bleed& b : bleed) {
    if (!(b.open > 0) || length2(wall::rest_place(m, b.at) - tip) > law.coagulate_reach * law.coagulate_reach) continue;
    b.heated += h;
    if (b.heated >= law.coagulate_time) b.open = 0;
  }
}

void bleed_on(const BleedModel& law, const wall::Model& m, std::span<const Pressure> pressure, float h,
              std::vector<Bleed>& bleed) {
  for (Bleed& b : bleed) {
    const Vec3 at = wall::rest_place(m, b.at);
    bool pressed = false;
    for (const Pressure& p : pressure) {
      if (length2(p.at - at) > p.radius * p.radius) continue;
      pressed = pressed || p.presses;
      if (p.absorbs) b.on_wall = 0;
    }
    if (pressed && b.open > 0) {
      b.pressed += h;
      if (b.pressed >= law.press_time) b.open = 0;
    }
    b.open -= b.open * std::min(1.0f, h / law.clot_time);
    if (b.open < kLeast) b.open = 0;
    b.flow = pressed ? 0 : b.open;
    b.lost += b.flow * h, b.on_wall += b.flow * h;
  }
}

Stain stain_of(const BleedModel& law, Vec3 vessel, float on_wall, Vec3 down) {
  const float radius = std::sqrt(std::max(on_wall, 0.0f) / (kPi * law.film));
  if (radius <= law.stain) return {vessel, down, 0, radius};
  const float run = (on_wall / law.film - kPi * law.stain * law.stain) / (2 * law.stain);
  return {vessel, down, std::min(law.run, run), law.stain};
}

}  // namespace catgut::physical
