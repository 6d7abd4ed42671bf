// SPDX-License-Identifier: Apache-2.0
// app: `catgut run SCENE`: simulates a scene and checks its expected results.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "commands/commands.h"
#include "core/check.h"
#include "core/file.h"
#include "procedure/ability.h"
#include "procedure/procedure_file.h"
#include "procedure/scene_file.h"
#include "runtime/report.h"
#include "runtime/session_log.h"
#include "sim/simulation.h"

namespace catgut {
namespace {

struct RunOptions {
  std::string scene, procedure, states, preset, mesh, json, csv;
  std::vector<std::string> set;
  uint64_t seed = 0;
  bool seed_given = false, headless = false, no_expect = false;
  SessionOptions session;
  PictureOptions pictures;
};

SceneSpec scene_for(RunOptions& o, const Procedure* procedure) {
  SceneSpec scene = procedure ? scene_of(*procedure) : read_scene(o.scene);
  if (!o.preset.empty()) use_preset(scene, o.preset);
  if (o.seed_given) set_value(scene, "seed=" + std::to_string(o.seed), "--seed");
  o.session.surgeon = apply_ability(scene, o.session.surgeon);
  if (!o.mesh.empty()) {
    if (scene.body.empty()) throw InputError("--mesh", "the scene has no body to replace", "add a [[body]]");
    scene.body[0].mesh = o.mesh;
  }
  // The scene's exact particle count belongs to its own bodies and thread.
  const bool other_size = !o.mesh.empty() || std::any_of(o.set.begin(), o.set.end(), [](const std::string& setting) {
    const std::string key = setting.substr(0, setting.find('='));
    return key == "thread.particles" || (key.rfind("body", 0) == 0 && key.ends_with(".particles"));
  });
  if (other_size) std::erase_if(scene.expect, [](const Expectation& e) { return e.name == "particles"; });
  for (const std::string& setting : o.set) set_value(scene, setting);
  return scene;
}

int run(RunOptions& o) {
  std::optional<ProcedureWatch> procedure;
  if (!o.procedure.empty()) procedure.emplace(o.procedure);
  if (o.scene.empty() == !procedure)
    throw InputError("run", "it needs either a scene or --procedure", "write catgut run SCENE, or catgut run --procedure NAME");
  if (!procedure && !o.states.empty()) throw InputError("--states", "it needs a procedure", "add --procedure NAME");
  const SceneSpec scene = scene_for(o, procedure ? &procedure->procedure : nullptr);
  check_picture_files(o.pictures);
  check_suffix(o.session.record, ".cgrec", "--record");
  if (procedure && !o.states.empty() && !o.session.record.empty() &&
      std::filesystem::weakly_canonical(o.session.record) ==
          std::filesystem::weakly_canonical(procedure->last_state_file(o.states)))
    throw InputError("--record", "--states writes the last state to the same file", "choose another name");
  check_suffix(o.json, ".json", "--json");
  check_suffix(o.csv, ".csv", "--csv");
  for (const std::string& path : {o.json, o.csv, o.session.record, o.pictures.video, o.pictures.contact_sheet})
    prepare_output(path);
  const double until_s = o.session.seconds > 0 ? o.session.seconds : static_cast<double>(scene.duration);
  for (const auto& [at_s, path] : o.pictures.still) {
    if (at_s > until_s)
      throw InputError("--still", fmt::format("the run ends after {} s at the latest, before {} s", until_s, at_s),
                       "choose an earlier time, or a larger --seconds");
    prepare_output(path);
  }

  std::unique_ptr<Pictures> pictures;
  SessionLog log;
  SessionHooks hooks;
  hooks.stop = &stop_on_interrupt();
  hooks.on_progress = progress_line();
  hooks.on_start = [&](const PictureModel& model) {
    if (procedure) procedure->start(scene, model);
    log.start(scene, model);
    if (o.pictures.any()) pictures = std::make_unique<Pictures>(o.pictures, model);
  };
  hooks.on_tick = [&](const Snapshot& seen, const std::string& doing) {
    if (procedure) procedure->tick(seen);
    log.tick(seen);
    if (pictures) pictures->tick(seen, doing);
  };
  std::vector<std::byte> last_state;
  if (procedure && !o.states.empty()) {
    hooks.on_step = [&](const Model& model, const State& state, const TickInput&) {
      procedure->save_stage(o.states, scene, model, state);
    };
    hooks.on_end = [&](const Model& model, const State& state) { last_state = save_state(model, state); };
  }
  const RunResult result = run_session(scene, o.session, hooks);
  end_progress_line();
  const LiveResult session = log.result();
  if (!o.json.empty()) {
    const std::string json = with_session(run_json(result), scene, session);
    write_output(o.json, procedure ? with_procedure(json, procedure->procedure, procedure->run) : json);
  }
  if (!o.csv.empty()) write_output(o.csv, session_csv(session));
  const bool quiet = o.json == "-" || o.csv == "-";
  if (!quiet) std::fputs(run_summary(result, !o.no_expect).c_str(), stdout);
  if (procedure && !quiet) std::fputs(run_table(procedure->run, procedure->procedure).c_str(), stdout);
  // Last: an error in a state or in a picture does not lose results.
  if (!last_state.empty()) procedure->save_state_as(procedure->last_state_file(o.states), scene, last_state);
  if (pictures) pictures->finish();
  if (result.interrupted) return 130;
  if (o.no_expect) return 0;
  return result.expectations_hold() && (!procedure || faultless(procedure->run, procedure->procedure)) ? 0 : 1;
}

}  // namespace

void add_run(CLI::App& app, int& exit_code) {
  auto o = std::make_shared<RunOptions>();
  CLI::App* command = app.add_subcommand("run", "simulate a scene");
  command->add_option("scene", o->scene, "name from scenes/ or path of a .toml file")->type_name("SCENE");
  command
      ->add_option("--procedure", o->procedure,
                   "in place of a scene: report its stages and errors; code 1 unless all are done without")
      ->type_name("NAME");
  command
      ->add_option("--surgeon", o->session.surgeon,
                   "scripted (scripted:novice, intermediate or expert), none, or a recording whose hands are replayed")
      ->type_name("scripted[:LEVEL]|none|FILE")
      ->capture_default_str();
  command->add_flag("--headless", o->headless, "no window (always so; catgut play opens one)");
  command->add_option("--seconds", o->session.seconds, "simulated time including settling; default: the scene's duration")
      ->check(within(0.001, 1e6))
      ->type_name("S");
  CLI::Option* seed =
      command->add_option("--seed", o->seed, "random seed of tremor and aim; default: the scene's")->type_name("N");
  add_threads_option(*command, o->session.threads);
  command->add_option("--preset", o->preset, "solver preset")->type_name("paper|default");
  command->add_option("--set", o->set, "override a scene key; repeatable")
      ->type_name("key=value")
      ->take_all()
      ->allow_extra_args(false);
  command->add_option("--record", o->session.record, "write a recording")->type_name("FILE.cgrec");
  command->add_option("--json", o->json, "results as JSON; -: standard output")->type_name("FILE|-");
  command->add_option("--states", o->states, "with --procedure: saves the state in which each stage begins, and the last one")
      ->type_name("DIR");
  command->add_option("--csv", o->csv, "stitches, forces, faults and tension over time as a table; -: standard output")
      ->type_name("FILE|-");
  command->add_option("--mesh", o->mesh, "organ surface of the first body, file or file#node")->type_name("FILE");
  command->add_flag("--no-expect", o->no_expect, "report expected results without checking them");
  add_picture_options(*command, o->pictures);
  command->callback([o, seed, &exit_code] {
    o->seed_given = seed->count() > 0;
    exit_code = run(*o);
  });
}

}  // namespace catgut
