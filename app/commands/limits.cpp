// SPDX-License-Identifier: Apache-2.0
// app: `catgut bench limits`: maximum number of sutures in one body and in two (paper 3.5).
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "commands/commands.h"
#include "core/check.h"
#include "procedure/scene_file.h"
#include "runtime/limits.h"

namespace catgut {

int bench_limits(const LimitsOptions& o) {
  std::vector<SceneSpec> scenes;
  for (const std::string& name : o.scene) {
    scenes.push_back(read_scene(name));
    for (const std::string& setting : o.set) set_value(scenes.back(), setting);
    prepare_output(o.out + "/" + scenes.back().name + ".csv");
    prepare_output(o.out + "/" + scenes.back().name + ".png");
  }
  SessionHooks hooks;
  hooks.stop = &stop_on_interrupt();
  bool all_reached = true;
  for (const SceneSpec& scene : scenes) {
    const std::string stem = o.out + "/" + scene.name;
    // Each row is written when it is complete: measurements survive an early end of the run.
    std::ofstream csv(stem + ".csv", std::ios::binary);
    csv << limits_csv_header();
    hooks.on_progress = progress_line();
    const LimitsResult result = measure_limits(
        scene, o.sutures, o.threads, [&](const SutureCost& row) { csv << limits_csv_row(row) << std::flush; }, hooks);
    end_progress_line();
    csv.close();
    if (!csv) throw InputError(stem + ".csv", "cannot be written", "is the disk full?");
    try {
      write_png(limits_plot(result, scene.body.size(), scene.solver.tick_rate), stem + ".png");
    } catch (const std::runtime_error& error) { throw InputError(stem + ".png", error.what(), "choose another place"); }
    std::fputs(limits_table(result, scene.body.size()).c_str(), stdout);
    std::printf("%s.csv  %s.png\n\n", stem.c_str(), stem.c_str());
    std::fflush(stdout);
    if (result.run.interrupted) return 130;
    all_reached = all_reached && result.reached();
  }
  return all_reached ? 0 : 1;
}

}  // namespace catgut
