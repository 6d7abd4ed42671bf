// SPDX-License-Identifier: Apache-2.0
// app: `catgut bench`: time per stage; scaling with suture count (limits.cpp), the paper's tables
// (paper.cpp), scaling with particle count (scale.cpp), cost of a frame (frame.cpp), rate of pictures (pictures.cpp), force
// feedback (haptics.cpp).
#include <cstdio>
#include <memory>

#include "commands/commands.h"
#include "commands/pictures.h"
#include "core/check.h"
#include "core/file.h"
#include "procedure/scene_file.h"
#include "runtime/report.h"
#include "technique/technique.h"

namespace catgut {
namespace {

struct BenchOptions {
  std::string log;
  std::string what, json, out;
  std::vector<std::string> scene, set;
  int repeat = 1, threads = 1, sutures = 50, executions = 10;
  double seconds = 0;
};

int bench_stages(const BenchOptions& o) {
  const std::string name = o.scene.empty() ? "purse_string" : o.scene[0];
  SceneSpec scene = read_scene(name);
  for (const std::string& setting : o.set) set_value(scene, setting);
  check_suffix(o.json, ".json", "--json");
  prepare_output(o.json);
  SessionHooks hooks;
  hooks.stop = &stop_on_interrupt();
  hooks.on_progress = progress_line();
  SessionOptions session;
  session.threads = o.threads;
  session.seconds = o.seconds;
  session.surgeon = scene.technique.name == kNoTechnique ? "none" : "scripted";
  // Every repetition computes the same bits; the fastest is the least disturbed by other programs.
  RunResult best;
  for (int i = 0; i < o.repeat; ++i) {
    RunResult r = run_session(scene, session, hooks);
    if (i > 0 && r.state_hash != best.state_hash && !r.interrupted) {
      end_progress_line();
      std::fprintf(stderr,
                   "catgut: bench stages: two runs of %s gave different states; this is a defect in Catgut, please report it\n",
                   name.c_str());
      return 1;
    }
    if (i == 0 || (r.solver_ms.median < best.solver_ms.median && !r.interrupted)) best = std::move(r);
    if (hooks.stop->load()) break;
  }
  end_progress_line();
  if (!o.json.empty()) write_output(o.json, run_json(best));
  if (o.json != "-") {
    std::printf("%s, preset %s: %zu particles, %llu ticks, %d threads, best of %d\n", best.scene.c_str(), best.preset.c_str(),
                best.particles, static_cast<unsigned long long>(best.ticks), best.threads, o.repeat);
    std::fputs(stage_table(best).c_str(), stdout);
  }
  return best.interrupted ? 130 : 0;
}

int bench(const BenchOptions& o) {
  if (o.scene.size() > 1 && o.what != "paper" && o.what != "limits")
    throw InputError("bench " + o.what + " --scene", "one scene only", "name one");
  if (o.what == "haptics" && !o.log.empty()) return plot_haptics_log(o.log);
  if (o.what == "haptics") return bench_haptics(o.out, o.scene.empty() ? "purse_string" : o.scene[0]);
  if (o.what == "stages") return bench_stages(o);
  if (o.what == "frame")
    return bench_frame({o.scene.empty() ? "lembert" : o.scene[0], o.json, o.set, o.seconds > 0 ? o.seconds : 30});
  if (o.what == "pictures") return bench_pictures(o.scene.empty() ? "stay" : o.scene[0], o.set);
  if (o.what == "paper") {
    const std::vector<std::string> four{"purse_string", "connell", "stay", "lembert"};
    return bench_paper({o.scene.empty() ? four : o.scene, o.set, o.out, o.executions, o.threads});
  }
  if (o.what == "scale")
    return bench_scale(
        {o.scene.empty() ? "lembert" : o.scene[0], o.json, o.set, o.repeat, o.threads, o.seconds > 0 ? o.seconds : 4});
  const std::vector<std::string> both{"stress_one_body", "stress_two_bodies"};
  return bench_limits({o.scene.empty() ? both : o.scene, o.set, o.out.empty() ? "out/limits" : o.out, o.sutures, o.threads});
}

}  // namespace

void add_bench(CLI::App& app, int& exit_code) {
  auto o = std::make_shared<BenchOptions>();
  CLI::App* command = app.add_subcommand("bench", "benchmark and profile");
  command
      ->add_option(
          "what", o->what,
          "paper: tables 1 to 4 beside the paper's, and of a procedure by its stages; stages: time per stage; limits: marginal "
          "cost per suture; scale: 1, 4 "
          "and 16 times the particles, one thread and several; frame: CPU time of a stereo frame without rasterization; "
          "pictures: rate of pictures by size and quality; haptics: comparison of rendering methods")
      ->required()
      ->check(CLI::IsMember({"paper", "limits", "scale", "stages", "frame", "pictures", "haptics"}))
      ->type_name("paper|limits|scale|stages|frame|pictures|haptics");
  command->add_option("--json", o->json, "stages, scale, frame: results as JSON; -: standard output")->type_name("FILE|-");
  command->add_option("--repeat", o->repeat, "stages, scale: runs; reports the one with the lowest median")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  add_threads_option(*command, o->threads);
  command
      ->add_option("--scene", o->scene,
                   "scene to run (paper: all four techniques; stages: purse_string; frame, scale: lembert; limits: the two "
                   "stress scenes)")
      ->type_name("NAME");
  command->add_option("--seconds", o->seconds, "simulated time; default: whole procedure (stages), 4 s (scale), 30 s (frame)")
      ->check(within(0.001, 1e6));
  command->add_option("--sutures", o->sutures, "limits: bites per scene")->check(CLI::Range(1, 1000))->capture_default_str();
  command->add_option("--executions", o->executions, "paper: runs per technique, each with its own seed")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command
      ->add_option("--out", o->out,
                   "output folder. limits: CSV and PNG per scene (default out/limits); paper: tables.md, tables.csv; haptics: "
                   "force curves, Z-width and transparency (CSV, PNG)")
      ->type_name("DIR");
  command->add_option("--log", o->log, "haptics: plot a log of play --haptics-log to FILE.png instead")->type_name("FILE");
  command->add_option("--set", o->set, "override a scene key: key=value; repeatable")->take_all()->allow_extra_args(false);
  command->callback([o, &exit_code] { exit_code = bench(*o); });
}

}  // namespace catgut
