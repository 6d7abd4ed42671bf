// SPDX-License-Identifier: Apache-2.0
// app/xr: see vibration.h.
#include "xr/vibration.h"

#include <algorithm>

#include "instrument/instrument.h"

namespace catgut::xr {
namespace {

constexpr Vibration kPuncture{0.7f, 0.03f, 180, "puncture"}, kExit{0.4f, 0.02f, 180, "puncture"};
constexpr Vibration kContact{0.25f, 0.012f, 0, "contact"}, kThrow{1.0f, 0.06f, 120, "throw"};
constexpr float kTouch = 0.08f, kFree = 0.03f;  // [N] on the hand
constexpr float kNear = 0.7f;                   // of the pull at which the jaws slip
constexpr float kEvery = 0.12f;                 // [s] between pulses for a tight thread

void stronger(Vibration& v, const Vibration& other) {
  if (other.amplitude > v.amplitude) v = other;
}

// [N] in the strand at the jaws.
float pull_on(const ToolView& tool, const Snapshot& seen) {
  if (tool.held_suture >= seen.suture.size()) return 0;
  const SutureView& suture = seen.suture[tool.held_suture];
  if (suture.thread_tension.empty()) return 0;
  if (tool.held == Held::needle) return suture.needle_on_thread ? suture.thread_tension.back() : 0;
  if (tool.held != Held::thread) return 0;
  float most = 0;
  for (size_t i = 0; i < suture.thread_order.size(); ++i) {
    if (suture.thread_order[i] != tool.held_slot) continue;
    if (i > 0) most = suture.thread_tension[i - 1];
    if (i < suture.thread_tension.size()) most = std::max(most, suture.thread_tension[i]);
  }
  return most;
}

float grip_limit(const ToolView& tool, const PictureModel& picture) {
  if (tool.instrument < 0) return 0;
  const InstrumentModel* model = find_instrument(picture.instrument[static_cast<size_t>(tool.instrument)].kind);
  return !model ? 0 : tool.held == Held::needle ? model->needle_grip : model->thread_grip;
}

}  // namespace

std::array<Vibration, 2> vibration(VibrationState& state, std::span<const Event> events, const Snapshot& seen,
                                   const PictureModel& picture, float dt) {
  std::array<Vibration, 2> out;
  for (const Event& e : events) {
    for (size_t k = 0; k < 2; ++k) {
      const ToolView& tool = seen.tool[k];
      const bool drives = tool.held == Held::needle && tool.held_suture == e.suture;
      if (drives && e.kind == EventKind::tip_entered) stronger(out[k], kPuncture);
      if (drives && e.kind == EventKind::tip_exited) stronger(out[k], kExit);
      const bool pulls = tool.held == Held::needle || tool.held == Held::thread;
      if (pulls && e.kind == EventKind::throw_locked) stronger(out[k], kThrow);
    }
  }
  for (size_t k = 0; k < 2; ++k) {
    const ToolView& tool = seen.tool[k];
    const float force = length(tool.force);
    if (!state.touching[k] && force > kTouch) {
      state.touching[k] = true;
      stronger(out[k], kContact);
    } else if (force < kFree) {
      state.touching[k] = false;
    }
    state.since_thread[k] = std::min(state.since_thread[k] + dt, 1.0f);
    const float limit = grip_limit(tool, picture);
    const float part = limit > 0 ? pull_on(tool, seen) / limit : 0;
    if (part > kNear && state.since_thread[k] >= kEvery) {
      state.since_thread[k] = 0;
      stronger(out[k], {std::min(1.0f, 0.4f + 2 * (part - kNear)), 0.04f, 90, "thread"});
    }
  }
  return out;
}

}  // namespace catgut::xr
