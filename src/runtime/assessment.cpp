// SPDX-License-Identifier: Apache-2.0
// runtime: see assessment.h.
#include "runtime/assessment.h"

#include "procedure/scene_file.h"
#include "sim/recording.h"

namespace catgut {

assess::Setup assess_setup(const SceneSpec& scene) {
  assess::Setup setup;
  setup.tick_s = 1 / static_cast<double>(scene.solver.tick_rate);
  setup.wall = scene.body.empty() ? 0 : static_cast<double>(scene.body[0].wall) * 1000;
  setup.technique = scene.technique.name;
  setup.physical = scene.mechanics.kind == "physical";
  return setup;
}

Assessor::Assessor(const SceneSpec& scene) : scene_(scene) {}

void Assessor::attach(SessionHooks& hooks) {
  const auto start = hooks.on_start;
  hooks.on_start = [this, start](const PictureModel& picture) {
    if (start) start(picture);
    picture_ = picture;
    facts_ = assess::begin_facts(picture_, assess_setup(scene_));
  };
  const auto tick = hooks.on_tick;
  hooks.on_tick = [this, tick](const Snapshot& seen, const std::string& doing) {
    if (tick) tick(seen, doing);
    seen_ = &seen;  // valid until on_step, in the same tick
  };
  const auto step = hooks.on_step;
  hooks.on_step = [this, step](const Model& model, const State& state, const TickInput& input) {
    if (step) step(model, state, input);
    assess::note(facts_, picture_, *seen_, input);
    last_ = *seen_;
  };
}

assess::Result Assessor::finish(const RunResult& run, const std::vector<assess::Rubric>& rubrics) const {
  assess::Result r = assess::measure(facts_, picture_, last_);
  r.catgut_version = catgut_version();
  r.scene = run.scene, r.title = run.title, r.surgeon = run.surgeon;
  r.seed = scene_.seed;
  r.ticks = run.ticks;
  r.state_hash = run.state_hash;
  for (const assess::Rubric& rubric : rubrics) r.score.push_back(assess::mark(rubric, r));
  return r;
}

std::vector<assess::Rubric> rubrics_for(const std::string& name, const SceneSpec& scene) {
  const std::string which = name.empty() ? assess::rubric_for(scene.technique.name) : name;
  if (which.empty()) return {};
  return {assess::read_rubric(which)};
}

assess::Result assess_recording(const Recording& recording, const std::string& name, int threads,
                                const std::vector<assess::Rubric>& rubrics, SessionHooks hooks) {
  check_replayable(recording, name);
  Assessor assessor(parse_scene(recording.header.scene, name));
  assessor.attach(hooks);
  const ReplayResult replay = replay_session(recording, name, false, threads, hooks);
  assess::Result r = assessor.finish(replay.run, rubrics);
  r.surgeon = "recording";
  r.truncated = recording.truncated;
  return r;
}

}  // namespace catgut
