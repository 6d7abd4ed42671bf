// SPDX-License-Identifier: Apache-2.0
// runtime: the procedure of an interactive session: its stage and errors after every tick, the state in which a stage begins,
// and demonstrations by the scripted surgeon. All functions belong to the physics thread; see live_work.h.
#include <algorithm>
#include <stdexcept>

#include "procedure/procedure_file.h"
#include "procedure/scripted_surgeon.h"
#include "runtime/live_work.h"

namespace catgut {
namespace {

constexpr double kHandsConnect = 0.5;  // [s]
constexpr uint64_t kViewTicks = 64;    // interval of pictures while the surgeon prepares

}  // namespace

void Live::Work::demonstrate(const Demonstration& what) {
  if (surgeon.surgeon || published.demonstrating || published.settling || !published.fault.empty()) return;
  try {
    demonstrator.surgeon =
        make_demonstrator(plan_of(scene), picture, skill_of(scene), {what.task.begin(), what.task.begin() + what.tasks});
  } catch (const std::invalid_argument&) { return; }  // a scene without a demonstrator
  learner = moment();
  learner_map = map;
  learner_speed = speed;
  if (what.slowly) speed = std::max<size_t>(speed, 1);
  demo_stage = static_cast<uint32_t>(stage_begin.size());  // none
  published.demonstrating = true;
  published.shown = published.not_shown = false;
  shown_for = 0;
}

// The procedure's active stage: from here, or from the begin of the stage at which its demonstration starts.
void Live::Work::show_stage() {
  if (!options.procedure || finished(published.procedure, *options.procedure)) return;
  if (now.tick - settled_tick < static_cast<uint64_t>(kHandsConnect / dt)) return;
  const uint32_t stage = published.procedure.stage;
  Demonstration what;
  what.slowly = true;
  for (const size_t task : demo_tasks(*options.procedure, stage, scene, picture))
    if (what.tasks < what.task.size()) what.task[what.tasks++] = static_cast<uint8_t>(task);
  if (what.tasks == 0) return;
  demonstrate(what);
  if (!published.demonstrating) return;
  learner.procedure.record[stage].assisted = true;
  demo_stage = stage;
  const size_t from = options.procedure->stage[stage].demo_from;
  const bool reading = published.reading;
  if (from != stage && stage_begin[from]) go_back(*stage_begin[from]);
  published.reading = reading;
  demonstrated = published.procedure;
}

void Live::Work::end_demonstration() {
  if (!published.demonstrating) return;
  published.not_shown = published.shown && demo_stage < stage_begin.size() && demonstrated.stage <= demo_stage;
  published.demonstrating = published.shown = false;
  published.doing.clear();
  const bool reading = published.reading;
  go_back(learner);
  published.reading = reading;
  map = learner_map;
  speed = learner_speed;
}

// After every tick with connected hands: the procedure's stage and errors, of the user or of the demonstration.
void Live::Work::observe() {
  if (!options.procedure) return;
  const Procedure& procedure = *options.procedure;
  if (published.demonstrating) {
    update_run(demonstrated, procedure, now);
    published.shown = published.shown || demonstrated.stage > demo_stage;
    return;
  }
  const bool changed = update_run(published.procedure, procedure, now);
  // The first stage is read when the hands are there.
  const uint64_t since = now.tick - settled_tick;
  if (options.tutorial && since == static_cast<uint64_t>(kHandsConnect / dt)) published.reading = true;
  if (!changed) return;
  published.not_shown = false;
  published.reading = options.tutorial && !finished(published.procedure, procedure);
  remember_stage();
}

void Live::Work::remember_stage() {
  const std::vector<ProcedureStage>& all = options.procedure->stage;
  const uint32_t stage = published.procedure.stage;
  for (size_t later = stage + 1; later < all.size(); ++later)
    if (all[later].demo_from == stage) {
      stage_begin[stage] = moment();
      return;
    }
}

// The state in which the procedure's first stage begins: a saved one, or the work of the scripted surgeon.
void Live::Work::prepare() {
  if (!options.procedure) return;
  const Procedure& procedure = *options.procedure;
  const size_t first = std::min(options.stage, procedure.stage.size() - 1);
  stage_begin.resize(procedure.stage.size());
  if (const std::string& file = procedure.stage[first].start; !file.empty()) {
    const Recording saved = read_recording(file);
    check_replayable(saved, file);
    load_state(*model, *state, saved.start);
    publish(*model, *state, now);
    before = now;
    published.prepared = true;
    record_from_here();
  } else if (first > 0) {
    ProcedureRun run;
    begin_run(run, procedure, now, dt);
    demonstrator.surgeon = scripted_surgeon(scene, picture);
    published.preparing = published.prepared = true;
    const auto burns = [](const InstrumentView& i) { return i.pen != PenMode::off; };
    const auto pen_is_on = [&] { return std::any_of(now.instrument.begin(), now.instrument.end(), burns); };
    while ((run.stage < first || pen_is_on()) && !demonstrator.surgeon->done() && !quit.load(std::memory_order_relaxed)) {
      tick(false);
      update_run(run, procedure, now);
      if (result.ticks % kViewTicks == 0) publish_view();
    }
    published.preparing = false;
    published.doing.clear();
    published.epoch += 1;
    if (run.stage < first && !quit.load(std::memory_order_relaxed))
      throw std::runtime_error("the scripted surgeon did not reach stage \"" + procedure.stage[first].name +
                               "\"; give it a saved state with the key start");
  }
  begin_run(published.procedure, procedure, now, dt, first);
  remember_stage();
}

}  // namespace catgut
