// SPDX-License-Identifier: Apache-2.0
// app: `catgut replay FILE`: plays a recording; with --check, compares its hash after every tick.
#include <cstdio>
#include <memory>

#include "commands/commands.h"
#include "core/check.h"
#include "core/file.h"
#include "procedure/scene_file.h"
#include "runtime/report.h"
#include "runtime/session_log.h"

namespace catgut {
namespace {

struct ReplayOptions {
  std::string file, json, csv, procedure;
  bool check = false, from_head = false;
  int threads = 1;
  PictureOptions pictures;
};

int replay(const ReplayOptions& o) {
  const Recording recording = read_recording(o.file);
  if (o.from_head && recording.head.empty())
    throw InputError(o.file, "the recording holds no head of a headset's wearer",
                     "leave out --from-head, or record with catgut play --headset");
  check_picture_files(o.pictures);
  check_suffix(o.json, ".json", "--json");
  check_suffix(o.csv, ".csv", "--csv");
  for (const std::string& path : {o.json, o.csv, o.pictures.video, o.pictures.contact_sheet}) prepare_output(path);
  std::unique_ptr<Pictures> pictures;
  std::optional<ProcedureWatch> procedure;
  if (!o.procedure.empty()) procedure.emplace(o.procedure);
  SceneSpec scene;
  SessionLog log;
  SessionHooks hooks;
  hooks.stop = &stop_on_interrupt();
  hooks.on_progress = progress_line();
  hooks.on_start = [&](const PictureModel& model) {
    scene = parse_scene(recording.header.scene, o.file);
    if (procedure) procedure->start(scene, model);
    log.start(scene, model);
    if (o.pictures.any()) pictures = std::make_unique<Pictures>(o.pictures, model);
  };
  hooks.on_tick = [&, ticks = uint64_t{0}, head = size_t{0}](const Snapshot& seen, const std::string&) mutable {
    if (procedure) procedure->tick(seen);
    log.tick(seen);
    for (; pictures && head < recording.head.size() && recording.head[head].tick <= ticks; ++head) {
      const Pose& at = recording.head[head].pose;
      if (o.from_head) pictures->look_from(at);
      else pictures->mark_gaze(at);
    }
    ++ticks;
    if (pictures) pictures->tick(seen, {});
  };
  const ReplayResult result = replay_session(recording, o.file, o.check, o.threads, hooks);
  end_progress_line();
  if (pictures) pictures->finish();
  const LiveResult session = log.result();
  if (!o.json.empty()) {
    const std::string json = with_session(replay_json(result, recording), scene, session);
    write_output(o.json, procedure ? with_procedure(json, procedure->procedure, procedure->run) : json);
  }
  if (!o.csv.empty()) write_output(o.csv, session_csv(session));
  const bool quiet = o.json == "-" || o.csv == "-";

  if (result.differs_at) {
    std::fprintf(stderr,
                 "catgut: %s: the state after tick %llu differs from the recorded one; recorded by version %s, this is %s\n",
                 o.file.c_str(), static_cast<unsigned long long>(*result.differs_at), recording.header.catgut_version.c_str(),
                 catgut_version());
    return 1;
  }
  if (!quiet)
    std::printf("%s: %llu ticks replayed%s, state %016llx\n", o.file.c_str(), static_cast<unsigned long long>(result.run.ticks),
                o.check ? ", all hashes verified" : "", static_cast<unsigned long long>(result.run.state_hash));
  if (procedure && !quiet) std::fputs(run_table(procedure->run, procedure->procedure).c_str(), stdout);
  if (result.run.interrupted) return 130;
  // The readable part was replayed; a truncated file is still an error of the file.
  if (recording.truncated)
    throw InputError(o.file, "truncated recording: " + recording.fault, "the ticks it holds were replayed");
  return 0;
}

}  // namespace

void add_replay(CLI::App& app, int& exit_code) {
  auto o = std::make_shared<ReplayOptions>();
  CLI::App* command = app.add_subcommand("replay", "replay a recording");
  command->add_option("file", o->file, "recording to replay")->required()->type_name("FILE.cgrec");
  command->add_flag("--check", o->check, "compare every state hash with the recorded one");
  add_threads_option(*command, o->threads);
  command->add_option("--json", o->json, "results as JSON; -: standard output")->type_name("FILE|-");
  command->add_option("--csv", o->csv, "stitches, forces, faults and tension over time as a table; -: standard output")
      ->type_name("FILE|-");
  command->add_option("--procedure", o->procedure, "report the stages and errors of a procedure")->type_name("NAME");
  add_picture_options(*command, o->pictures);
  command->add_flag("--from-head", o->from_head, "pictures from the eyes of the headset's wearer");
  command->callback([o, &exit_code] { exit_code = replay(*o); });
}

}  // namespace catgut
