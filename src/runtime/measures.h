// SPDX-License-Identifier: Apache-2.0
// runtime: what the inside of a tick looks like from outside, for developers' panels: where its time goes, how much there is of
// everything, and the largest force of every kind of constraint. Reads Model and State; changes nothing.
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
  attachment,  // tissue to the needle's tip, to a jaw, to where a closure draws it
  channel,     // the needle in its channel
  seam,        // tissue to tissue
  count_
};
const char* force_name(ForceKind kind);

struct Measures {
  std::array<float, static_cast<size_t>(Stage::count_)> stage_ms{};  // lately
  uint32_t particles = 0, thread_particles = 0, clusters = 0, contacts = 0;
  std::array<float, static_cast<size_t>(ForceKind::count_)> peak_n{};  // [N] in the last substep
  std::array<uint32_t, static_cast<size_t>(ForceKind::count_)> constraints{};
};
// All but the times.
void measure(const Model& model, const State& state, Measures& out);

// What can be changed between two ticks while a user works, with the range that a slider has.
struct LiveParameter {
  const char* key;  // of a scene file
  float low, high;
  float (*value)(const SceneSpec&);
};
constexpr size_t kLiveParameters = 9;
const std::array<LiveParameter, kLiveParameters>& live_parameters();

}  // namespace catgut
