// SPDX-License-Identifier: Apache-2.0
// sim: the engine's API. `Model` is constant, `State` is everything that changes, `step` computes one tick. Equal inputs give
// equal bits for any number of workers. Everything above (command line, window, recording, embedding) is built on these few
// functions.
#pragma once
#include <cstddef>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/jobs.h"
#include "core/profile.h"
#include "exchange/picture.h"
#include "exchange/snapshot.h"
#include "exchange/tool_input.h"
#include "instrument/instrument.h"
#include "sim/scene.h"

namespace catgut {

struct Model;  // sim/model.h
struct State;  // sim/state.h

// Builds the scene. Throws InputError for errors in the scene (mesh missing, too few particles, ...).
// own: instrument models in addition to the built-in table (instrument/table); scene instruments may be of these kinds.
std::shared_ptr<const Model> build_model(const SceneSpec& scene, std::span<const InstrumentModel> own = {});
const SceneSpec& scene_of(const Model& model);
size_t particle_count(const Model& model);  // tissue + thread

struct StateDeleter {
  void operator()(State*) const;
};
using StatePtr = std::unique_ptr<State, StateDeleter>;
StatePtr initial_state(const Model& model);

// One tick of 1 / tick_rate seconds. times may be null.
void step(const Model& model, State& state, const TickInput& input, Jobs& jobs, StageTimes* times = nullptr);

// Copies the state after the last tick into the snapshot (reusing its memory). Equal states give equal snapshots, whether
// reached by ticks or loaded.
void publish(const Model& model, const State& state, Snapshot& snapshot);
PictureModel picture_model(const Model& model);

// Saves the whole state as bytes (versioned by kStateVersion) and restores it. load_state throws InputError if the bytes do not
// fit the model.
constexpr uint32_t kStateVersion = 19;
std::vector<std::byte> save_state(const Model& model, const State& state);
void load_state(const Model& model, State& state, const std::vector<std::byte>& bytes);
uint64_t hash_state(const Model& model, const State& state);

// Numerical instability: values left the solver's range. Not an input error. A caller that runs ticks checks for it with
// state_is_valid.
struct SimulationUnstable : std::runtime_error {
  explicit SimulationUnstable(const std::string& what) : std::runtime_error(what) {}
};

// True when nothing in the state is NaN or infinite and no particle is further than `limit` meters from the origin.
bool state_is_valid(const Model& model, const State& state, float limit = 1.0f);
double kinetic_energy(const Model& model, const State& state);  // [J]
// Contacts of thread and instruments that found no room in a list, over the whole run: what touched there could pass through.
// Physical mechanics; 0 with guided ones.
uint32_t dropped_contacts(const State& state);

}  // namespace catgut
