// SPDX-License-Identifier: Apache-2.0
// physical/bleed: vessels of the wall that a cut opens, their flow, and what stops it. Reads the places that were divided,
// heated or pressed; writes Excision::bleed.
//
// Flow of an open vessel: Hagen and Poiseuille, pi dp d^4 / (128 viscosity length). 60 mmHg is the pressure in small arteries.
// A circle of 70 mm cut with scissors loses 5 ml/min in the mean. On the VIBe scale (Lewis et al.
// 2017, 10.1016/j.surg.2016.09.022) 1-5 ml/min is mild bleeding and 5-10 ml/min moderate. Assumptions: spacing, diameters and
// length of the vessels, clotting time, film thickness, and the diameter up to which the heat of a cut closes a vessel.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "core/reflect.h"
#include "wall/cut.h"
#include "wall/reflect.h"

namespace catgut::physical {

struct BleedModel {
  float spacing = 6e-3f;                                                  // [m] of a cut between vessels, in the mean
  std::array<float, 4> diameter{0.08e-3f, 0.12e-3f, 0.16e-3f, 0.20e-3f};  // [m] equally frequent
  float pressure = 8e3f;                                                  // [Pa]
  float length = 5e-3f;                                                   // [m] of the vessel up to its opening
  float viscosity = 3.5e-3f;                                              // [Pa s] of blood
  float closed_by_cut = 0.18e-3f;   // [m] vessels up to this diameter are closed by the pen that cuts them
  float coagulate_reach = 1.5e-3f;  // [m] of a coagulating tip
  float coagulate_time = 0.5f;      // [s] of it that closes a vessel
  float clot_time = 180;            // [s] in which the flow of a vessel left alone falls to 1/e
  float press_time = 60;            // [s] of pressure after which a vessel stays closed
  float film = 0.2e-3f;             // [m] thickness of blood on the wall
  float stain = 2e-3f;              // [m] half the width of a stain that runs down
  float run = 20e-3f;               // [m] that it runs down before it drips
};

// A vessel that a cut has opened.
struct Bleed {
  wall::Point at;                 // on the mid-surface, beside the cut
  float open = 0;                 // [m3/s] flow without pressure on it; 0: closed for good
  float flow = 0;                 // [m3/s] now
  float lost = 0;                 // [m3] so far
  float on_wall = 0;              // [m3] of it that was not wiped off
  float heated = 0, pressed = 0;  // [s] by a coagulating tip, by a jaw or a swab
};
constexpr void reflect(auto& a, Like<Bleed> auto& b) {
  a(b.at), a(b.open), a(b.flow), a(b.lost), a(b.on_wall), a(b.heated), a(b.pressed);
}
constexpr size_t kMaxBleed = 256;

// [m3/s] of an open vessel of this diameter.
float vessel_flow(const BleedModel& law, float diameter);
// A cut that has removed this link may have opened a vessel: at the same place in every run. Its number in the mean is the
// length of the link's border over `spacing`, whatever the size of the cells. by_heat: a pen's cut.
void open_vessel(const BleedModel& law, const wall::Model& wall, wall::Mark mark, bool by_heat, std::vector<Bleed>& bleed);
// A coagulating tip at a material point, for h seconds.
void coagulate(const BleedModel& law, const wall::Model& wall, Vec3 tip, float h, std::vector<Bleed>& bleed);

// What presses on the wall.
struct Pressure {
  Vec3 at;           // [m] at rest
  float radius = 0;  // [m]
  bool presses = false, absorbs = false;
};
// h seconds of flow.
void bleed_on(const BleedModel& law, const wall::Model& wall, std::span<const Pressure> pressure, float h,
              std::vector<Bleed>& bleed);

// Blood on the wall at rest: a drop of constant thickness that grows round the vessel, then a strip that runs down.
struct Stain {
  Vec3 vessel, down;          // down: unit, the direction of gravity
  float run = 0, radius = 0;  // [m] of the strip: its length, half its width
  // [m2] square of the distance from the strip's middle line.
  float away2(Vec3 place) const {
    const Vec3 off = place - vessel;
    return length2(off - down * std::clamp(dot(off, down), 0.0f, run));
  }
};
Stain stain_of(const BleedModel& law, Vec3 vessel, float on_wall, Vec3 down);
// 0 .. 1: full within, with a border a quarter of the radius wide.
inline float blood_at(const Stain& s, Vec3 place) {
  return std::clamp((s.radius - std::sqrt(s.away2(place))) / (0.25f * s.radius + 1e-9f), 0.0f, 1.0f);
}

}  // namespace catgut::physical
