// SPDX-License-Identifier: Apache-2.0
// app: `catgut bench paper`: tables 1 to 4 of the paper, Catgut's figures beside its own.
#include <fmt/format.h>

#include <cstdio>
#include <optional>
#include <stdexcept>

#include "commands/commands.h"
#include "core/check.h"
#include "procedure/procedure_file.h"
#include "procedure/scene_file.h"
#include "runtime/paper_tables.h"
#include "technique/technique.h"

namespace catgut {
namespace {

// Empty in a build without rendering.
std::function<PictureCost(const PictureModel&)> picture_cost() {
  try {
    stereo_pictures({}, 0.1f);
  } catch (const std::runtime_error&) { return {}; }
  return [](const PictureModel& model) -> PictureCost {
    return [picture = stereo_pictures(model, 1.0f / 15)](const Snapshot& seen) { return picture(seen).caller_ms; };
  };
}

}  // namespace

int bench_paper(const PaperOptions& o) {
  std::vector<SceneSpec> scenes;
  std::vector<std::optional<Procedure>> procedure;  // of a scene without a technique
  for (const std::string& name : o.scene) {
    scenes.push_back(read_scene(name));
    procedure.emplace_back();
    for (const std::string& setting : o.set) set_value(scenes.back(), setting);
    if (scenes.back().technique.name != kNoTechnique) continue;
    if (scenes.back().surgeon.plan.empty())
      throw InputError(name, "it has no technique for the scripted surgeon",
                       "name purse_string, connell, stay, lembert or altemeier");
    procedure.back() = read_procedure(name);
  }
  if (!o.out.empty())
    for (const char* name : {"/tables.md", "/tables.csv"}) prepare_output(o.out + name);
  const auto picture = picture_cost();
  SessionHooks hooks;
  hooks.stop = &stop_on_interrupt();
  const std::string about = fmt::format(
      "On {}. Mean ± standard deviation of the median ticks of {} executions. The paper's figures are from an i7-13700KF with "
      "an "
      "RTX 4070 Ti, rendered in a headset. A frame is the surgeon's plan, the tick{} in sequence.\n\n",
      this_machine(), o.executions,
      picture ? " and a stereo frame submitted to a backend that does not rasterize," : " (no pictures in this build)");
  std::fputs(about.c_str(), stdout);
  std::string markdown = about, csv = paper_csv_header();
  bool all_sewn = true, interrupted = false;
  for (size_t i = 0; i < scenes.size(); ++i) {
    hooks.on_progress = progress_line();
    const PaperTable table =
        measure_paper(scenes[i], o.executions, o.threads, picture, hooks, procedure[i] ? &*procedure[i] : nullptr);
    end_progress_line();
    const std::string text = paper_markdown(table);
    std::fputs(text.c_str(), stdout);
    std::fflush(stdout);
    markdown += text, csv += paper_csv(table);
    all_sewn = all_sewn && table.sewn == o.executions;
    interrupted = table.interrupted;
    if (interrupted) break;
  }
  if (!o.out.empty()) {
    write_output(o.out + "/tables.md", markdown);
    write_output(o.out + "/tables.csv", csv);
    std::printf("%s/tables.md  %s/tables.csv\n", o.out.c_str(), o.out.c_str());
  }
  return interrupted ? 130 : all_sewn ? 0 : 1;
}

}  // namespace catgut
