// SPDX-License-Identifier: Apache-2.0
// physical/excise: an electrosurgical pen whose moving, active tip divides the wall. Reads the tip; writes grooves, char and
// bleeding points, and removes links of the wall (wall/cut) where a groove has become as deep as the wall is thick.
//
// Depth. The power that evaporates tissue makes a groove: depth = efficiency P / (energy kerf speed), from the side where the
// tip is. `energy` is the heat that takes tissue from 37 to 100 degrees and evaporates its water:
// 1050 kg/m3 (3600 J/(kg K) 63 K + 0.75 2.257 MJ/kg) = 2.0 GJ/m3. Assumptions: efficiency, kerf and the widths of char. Heat
// beside the groove: physical/heat. Vessels that it opens: physical/bleed. Grooves from both faces of the wall add up. A tip
// that comes back beside a groove falls into it (`snap`), so that a second pass deepens the first and a circle closes on its
// start.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/reflect.h"
#include "physical/bleed.h"
#include "physical/heat.h"
#include "physical/physical.h"

namespace catgut::physical {

struct ExciseModel {
  float energy = 2.0e9f;     // [J/m3]
  float efficiency = 0.5f;   // part of the power that evaporates tissue when cutting; coagulating: a tenth of it
  float kerf = 0.5e-3f;      // [m] width of the groove
  float window = 0.5e-3f;    // [m] length of the groove behind the tip on which it acts
  float snap = 0.6e-3f;      // [m] a tip so near to an older groove is in it
  float reach = 0.5e-3f;     // [m] a tip farther from the wall does nothing
  float char_cut = 0.3e-3f;  // [m] width of the char on each side
  float char_coagulate = 1.5e-3f;
  float char_time = 0.05f;  // [s] in which the char forms
  BleedModel bleed;
  HeatModel heat;
};

struct Pen {
  Vec3 tip;         // [m]
  float power = 0;  // [W]; 0: not active
  bool coagulate = false;
};

// A link that the tip has passed.
struct Groove {
  uint32_t face = 0, link = 0;
  Vec3 at;                     // [m] where the tip passed it, on the mid-surface at rest
  float outer = 0, inner = 0;  // [m] depth from each face
  bool through = false;
};

struct Excision {
  bool touching = false;
  wall::Point last;  // in the groove; meaningful while touching, as the next
  Vec3 trail;        // [m] a point that follows the tip at kSmoothing; their difference is its direction
  std::vector<Groove> groove;
  std::vector<wall::FaceCut> passed;                   // per face: links that are in `groove`
  std::vector<wall::Point> path;                       // places of the tip, a quarter of a millimeter apart
  std::vector<std::array<float, wall::kCells>> burnt;  // per face: char, 0 .. 1
  std::vector<Bleed> bleed;
  Heat heat;
  uint32_t overflow = 0;  // links that found no room
};
constexpr size_t kMaxGroove = 8192, kMaxTipPath = 4096;

constexpr void reflect(auto& a, Like<Groove> auto& g) { a(g.face), a(g.link), a(g.at), a(g.outer), a(g.inner), a(g.through); }
constexpr void reflect(auto& a, Like<Excision> auto& e) {
  a(e.touching), a(e.last), a(e.trail), a(e.groove), a(e.passed), a(e.path), a(e.burnt), a(e.bleed), a(e.heat), a(e.overflow);
}

// The nearest point of the wall's surface, whatever its side; `gap` is the distance. More than `within` [m]: not searched.
Foot nearest_foot(const Model& model, const State& state, Vec3 p, float within);

// What the pen did in a step.
struct PenStep {
  wall::CutResult cut;
  float deepest = 0;     // [m] of the grooves that became deeper, from both faces together; 0: none did
  uint32_t through = 0;  // links that are cut through now
  wall::Point at;        // of the last of them, on the side of the tip
};
// One step of h seconds, before physical::step. Allocates once, on first use; a cut itself may allocate (wall/cut).
PenStep use_pen(const ExciseModel& law, const Model& model, State& state, Scratch& scratch, Excision& excision, const Pen& pen,
                float h);

// Scissors: what their closed blades divide, from one place of the wall to the next. `Excision` gets its traces and vessels.
struct SnipStep {
  wall::CutResult cut;
  float length = 0;  // [m]
  wall::Point at;    // the last place
};
SnipStep snip(const ExciseModel& law, const Model& model, State& state, Scratch& scratch, Excision& excision,
              std::span<const wall::Point> path);

// Char at a material point, 0 .. 1.
float burnt_at(const Model& model, const Excision& excision, const wall::Point& point);

}  // namespace catgut::physical
