// SPDX-License-Identifier: Apache-2.0
// sim/cutting: the stages of physical mechanics in which an active electrosurgical pen or closing scissors divide the wall, and
// in which what they opened bleeds. Reads commands and the poses of instruments; writes the wall's topology (physical/excise)
// and the picture of a wall that was cut. docs/wall.md.
//
// The tip is the origin of the tool frame. Depth follows from power and time. One pen is active at a time: there is one tip.
// Commands of a hand that holds an instrument which cauterizes: `cut` switches cutting on and off, `new_suture` coagulation.
// So the buttons of every device work, and a recording repeats them. `set_pen` is a pedal's: it switches, and does not toggle.
#pragma once
#include <memory>
#include <optional>
#include <vector>

#include "exchange/divided_picture.h"
#include "exchange/picture.h"
#include "exchange/snapshot.h"
#include "exchange/tool_input.h"
#include "physical/excise.h"
#include "physical/reflect.h"

namespace catgut {

struct Model;
struct SceneSpec;
struct State;

constexpr float kCutPower = 40, kCoagulatePower = 30;  // [W] within the settings of general surgery (chosen)

// What a pen has done since it was activated.
struct Stroke {
  uint64_t began = 0;     // tick
  float deepest = 0;      // [m] of its grooves
  bool through = false;   // at one place at least
  bool off_line = false;  // the last place where it went through is off the line
  bool inner = false;     // it has gone through another body than the planned one
};
constexpr void reflect(auto& a, Like<Stroke> auto& s) { a(s.began), a(s.deepest), a(s.through), a(s.off_line), a(s.inner); }

// Working memory of the stages below: its contents never affect their results.
struct CutScratch {
  physical::HeatScratch heat;
  std::vector<physical::Pressure> pressure;
  std::vector<float> flow;  // [m3/s] per vessel, before the tick
  // Of the picture.
  struct ScarPoint {
    float burnt = 0, depth[2] = {0, 0};  // [m] from the outer and from the inner face
    bool through = false;
  };
  std::vector<ScarPoint> point;      // per lattice point of the touched faces
  std::vector<uint32_t> trace, was;  // per face: its place among the touched ones; those of the last tick
  std::vector<physical::Stain> stain;
  std::vector<Scar> scar;
};

struct CutPictureSource;
struct Cutting {
  std::vector<PenMode> mode;  // per instrument; empty: no instrument of the scene cuts tissue
  std::vector<uint8_t> shut;  // per instrument: scissors that have not opened since they closed, or were taken
  physical::Excision excision;
  uint32_t pieces = 0;   // of the wall
  Stroke stroke;         // of the active pen, or the last one
  bool opened = false;   // the wall is cut through somewhere
  float freed_mass = 0;  // [kg] of the heaviest piece that came free
  Vec3 freed_at;         // [m] its center, then
  // Faults that are reported already: per suture, and per instrument until it lets go.
  std::vector<uint8_t> cut_at_suture, pulled;
  // Follows from the above (sim/cut_picture).
  std::vector<uint32_t> touched;  // faces that show a pen's traces, in order
  std::vector<Scar> scar;         // as Snapshot::scar
  uint64_t picture_of = 0;        // what `picture` shows
  DividedPicture picture;
  std::shared_ptr<const CutPictureSource> source;  // null until a pen has touched the wall
};
// A scene without pen and scissors has none of it.
constexpr void reflect(auto& a, Like<Cutting> auto& c) {
  if (c.mode.empty()) {
    a.cache(c.mode), a.cache(c.excision), a.cache(c.pieces), a.cache(c.stroke), a.cache(c.opened), a.cache(c.cut_at_suture);
    a.cache(c.pulled), a.cache(c.shut), a.cache(c.freed_mass), a.cache(c.freed_at);
  } else {
    a(c.mode), a(c.shut), a(c.excision), a(c.pieces), a(c.stroke), a(c.opened), a(c.cut_at_suture), a(c.pulled);
    a(c.freed_mass), a(c.freed_at);
  }
  a.cache(c.touched), a.cache(c.scar), a.cache(c.picture_of), a.cache(c.picture), a.cache(c.source);
}

// --- building, saving --------------------------------------------------------------------------------------------------
Cutting start_cutting(const Model& model);
// Whether a loaded state has sizes and indices that a step can work with.
bool cutting_fits(const Model& model, const Cutting& cutting);

// --- stages of a tick ----------------------------------------------------------------------------------------------------
// Once: switches pens, and removes their commands from the list. Events: pen_activated, pen_deactivated, wall_scored.
void switch_pens(const Model& model, State& state, TickInput& input);
// In every step of h seconds, before physical::step. Events: wall_cut_through, piece_freed, cut_off_line, cut_at_suture.
void use_pens(const Model& model, State& state, physical::Scratch& scratch, float h);
// Once, before the steps: scissors whose jaws have closed divide the wall between their blades. Events: tissue_snipped, and as
// for pens.
void use_scissors(const Model& model, State& state, physical::Scratch& scratch);
// Once, after the steps (sim/bleeding): blood flows, heat spreads. Events: bleeding_started, bleeding_stopped.
void bleed(const Model& model, State& state, CutScratch& scratch);
// Once, after the steps: the fault pulled_attached.
void watch_pulls(const Model& model, State& state);
// Whether a material point lies in charred tissue.
bool is_charred(const Model& model, const State& state, const wall::Point& point);

// The planned line: a circle on the first body, with the plan "excision" or "altemeier".
struct CutLine {
  Vec3 rim, axis;      // [m] middle of the rim at rest; unit, out of the opening
  float from_rim = 0;  // [m]
};
std::optional<CutLine> cut_line(const SceneSpec& scene);
constexpr float kOffLine = 2e-3f;       // [m] farther from the line is a fault (chosen)
constexpr float kBesideSuture = 1e-3f;  // [m] from a hole with thread, likewise
constexpr float kPulledForce = 1;       // [N] on the hand, likewise
constexpr float kCharred = 0.5f;        // of Excision::burnt, likewise
constexpr physical::ExciseModel kExciseLaw;

// --- sim/cut_picture -----------------------------------------------------------------------------------------------------
// Once per tick and after a load: notes what a new picture shows if the shape of the drawn wall has changed. The picture is
// made by the first who looks at it (exchange/divided_picture).
void renew_cut_picture(const Model& model, State& state, CutScratch& scratch);
void renew_cut_picture(const Model& model, State& state);
// Adds copies of columns, rotations, scars and the picture to a snapshot of the tissue as built.
void publish_cut(const Model& model, const State& state, Snapshot& snapshot);

}  // namespace catgut
