// SPDX-License-Identifier: Apache-2.0
// runtime: measures of a tick for developers' panels: time per stage, counts, and the largest force of every kind of
// constraint. Reads Model and State; changes nothing.
#pragma once
#include <array>
#include <cstdint>

#include "core/profile.h"

namespace catgut {

struct Model;
struct State;
struct SceneSpec;

// The largest force of one kind of interaction, and how many of them there are.
struct ForceMeasure {
  const char* name = "";
  float peak_n = 0;  // [N] in the last step of the physics
  uint32_t count = 0;
};
constexpr size_t kMostForces = 5;

struct Measures {
  std::array<float, static_cast<size_t>(Stage::count_)> stage_ms{};  // recent
  bool physical = false;                                             // mechanics of the scene
  uint32_t particles = 0, thread_particles = 0, contacts = 0;
  uint32_t clusters = 0;      // guided mechanics
  uint32_t columns = 0;       // physical mechanics: of the wall
  uint32_t awake = 0;         // physical mechanics: thread particles that are stepped
  uint32_t without_room = 0;  // contacts since the start that found no room: what touched there could pass through
  std::array<ForceMeasure, kMostForces> force{};
};
// All but the times.
void measure(const Model& model, const State& state, Measures& out);

// Settings that may change between two ticks of an interactive run, with the range of their sliders.
struct LiveParameter {
  const char* key;  // of a scene file
  float low, high;
  float (*value)(const SceneSpec&);
};
constexpr size_t kLiveParameters = 9;
const std::array<LiveParameter, kLiveParameters>& live_parameters();

}  // namespace catgut
