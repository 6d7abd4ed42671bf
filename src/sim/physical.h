// SPDX-License-Identifier: Apache-2.0
// sim/physical: physical mechanics of a scene ([mechanics] kind = "physical"): the tissue is a wall with a modulus, the thread
// ties its own knots, instruments push both by impulses (docs/physical.md). Reads SceneSpec and TickInput; writes
// State::physical, and shows positions, tensions, holes and grips in State::solver and State::suture, where publish and
// measures read them.
//
// A tick is a whole number of steps of at most 1 ms. Tissue particle 2 c is the outer node of column c, 2 c + 1 its inner node;
// a thread particle is a node. Instruments and needles are rigid bodies of src/physical on the springs of their hands: contact,
// grips by pinch, puncture and the needle's channel are solved together with the wall.
#pragma once
#include <memory>
#include <span>
#include <vector>

#include "core/jobs.h"
#include "core/profile.h"
#include "exchange/tool_input.h"
#include "physical/physical.h"
#include "physical/reflect.h"
#include "sim/cutting.h"
#include "solver/reflect.h"

namespace catgut {

struct BodyRest;
struct BodySpec;
struct Model;
struct SceneSpec;
struct SolverState;
struct State;

constexpr float kWideOpen = 0.19f;  // [rad] of each jaw at ToolInput::jaw 1: 6 mm between the tips

// Constant during a run.
struct PhysicalModel {
  physical::Model world;
  physical::State start;
  thread::Plane drape;
};

// What the physical state of a needle and its suture adds to the published one.
struct PhysicalSuture {
  std::vector<uint32_t> hole;  // per suture point: of physical::State::hole
  bool lies = true;            // on the drape: its friction holds the needle there
  Pose bed;                    // where
};
constexpr void reflect(auto& a, Like<PhysicalSuture> auto& s) { a(s.hole), a(s.lies), a(s.bed); }

struct PhysicalScratch;
struct PhysicalState {
  physical::State world;  // bodies: instruments, then the needle of every suture
  std::vector<PhysicalSuture> suture;
  Cutting cutting;
  std::shared_ptr<PhysicalScratch> scratch;  // working memory; null: made by the next tick
};
// A guided scene has none of it: nothing is written, read or hashed.
constexpr void reflect(auto& a, Like<PhysicalState> auto& p) {
  if (p.world.thread.x.x.empty()) a.cache(p.world), a.cache(p.suture), a.cache(p.cutting);
  else a(p.world), a.column(p.suture, IndexOf::strand), a(p.cutting);
  a.cache(p.scratch);
}

// --- building: sim/build calls these -----------------------------------------------------------------------------------
// Steps of a tick of `dt` seconds.
int physical_steps(float dt);
// [m] radius of the thread that a scene names. Throws InputError for a name that is not in the table.
float thread_radius(const SceneSpec& scene, const std::string& material);
// Adds a body to the wall. Throws InputError for a body that cannot be a wall.
void add_wall(const SceneSpec& scene, const BodySpec& spec, const BodyRest& body, wall::Mesh& mesh);
// After everything else of the model.
std::shared_ptr<const PhysicalModel> make_physical(const Model& model, const wall::Mesh& mesh);
PhysicalState start_physical(const Model& model, const SolverState& solver);

// --- running -----------------------------------------------------------------------------------------------------------
// wall_pulls: forces that no hand exerts, for measurements.
void step_physical(const Model& model, State& state, const TickInput& input, Jobs& jobs, StageTimes* times,
                   std::span<const physical::Hands::WallPull> wall_pulls = {});
// Places the bites and suture points of suture `which` on the wall as it is cut now.
void publish_holes(const Model& model, const State& state, size_t which, SutureView& out);
// After a load: what follows from the cuts of the wall.
void restore_physical(const Model& model, PhysicalState& state);
// Whether a loaded state has sizes and indices that a step can work with.
bool physical_fits(const Model& model, const PhysicalState& state);

}  // namespace catgut
