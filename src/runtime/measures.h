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

// Multipliers by kind; lambda / h^2 is a force.
enum class ForceKind : uint8_t {
  thread,      // between two particles of the thread
  tool,        // a tool on its hand, the needle in a jaw
  attachment,  // tissue to the needle's tip, to a jaw, to the target of a closure
  channel,     // the needle in its track
  seam,        // tissue to tissue
  count_
};
const char* force_name(ForceKind kind);

struct Measures {
  std::array<float, static_cast<size_t>(Stage::count_)> stage_ms{};  // recent
  uint32_t particles = 0, thread_particles = 0, clusters = 0, contacts = 0;
  std::array<float, static_cast<size_t>(ForceKind::count_)> peak_n{};  // [N] in the last substep
  std::array<uint32_t, static_cast<size_t>(ForceKind::count_)> constraints{};
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
