// SPDX-License-Identifier: Apache-2.0
// runtime: creates the hands of a run; see hands.h.
#include "runtime/hands.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "core/check.h"
#include "procedure/scene_file.h"
#include "procedure/scripted_surgeon.h"
#include "sim/recording.h"

namespace catgut {
namespace {

// Plays recorded hands by time, so that a recording can also drive a scene with another tick rate. It does not react: in a
// different scene the recorded motion will miss its targets.
class RecordedHands : public Surgeon {
 public:
  RecordedHands(Recording recording, float tick_rate) : recording_(std::move(recording)), tick_rate_(tick_rate) {}

  TickInput operate(const Snapshot& seen, float dt) override {
    const size_t before = next_;
    next_ = static_cast<size_t>(std::llround(static_cast<double>(seen.tick) * dt * tick_rate_));
    TickInput out;
    out.hand = no_hands();
    if (recording_.tick.empty()) return out;
    const size_t last = recording_.tick.size() - 1;
    out.hand = recording_.tick[std::min(next_, last)].input.hand;
    // Each command once, at any tick rate.
    for (size_t t = begun_ ? before + 1 : 0; t <= std::min(next_, last); ++t)
      for (const Command& c : recording_.tick[t].input.commands) out.commands.push(c);
    begun_ = true;
    return out;
  }
  bool done() const override { return next_ + 1 >= recording_.tick.size(); }
  std::string doing() const override {
    return "recorded hands, tick " + std::to_string(next_) + " of " + std::to_string(recording_.tick.size());
  }

 private:
  Recording recording_;
  double tick_rate_;
  size_t next_ = 0;
  bool begun_ = false;
};

}  // namespace

void prepare_for_mouse(SceneSpec& scene) { scene.solver.tool_force = std::min(scene.solver.tool_force, kUnfeltToolForce); }

Hands make_hands(const std::string& who, const SceneSpec& scene, const PictureModel& picture) {
  if (who == "none") return {};
  if (who == "scripted") return {scripted_surgeon(scene, picture), true};
  if (who.rfind("scripted:", 0) == 0)
    throw InputError("--surgeon " + who, "levels are for `catgut run` and `catgut study`", "use scripted");
  if (!std::filesystem::exists(who))
    throw InputError("--surgeon " + who, "unknown surgeon, and no such file",
                     "use scripted, none or the path of a .cgrec recording");
  Recording recording = read_recording(who);
  const float tick_rate = parse_scene(recording.header.scene, who).solver.tick_rate;
  return {std::make_unique<RecordedHands>(std::move(recording), tick_rate), false};
}

}  // namespace catgut
