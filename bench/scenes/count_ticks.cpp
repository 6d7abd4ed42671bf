// SPDX-License-Identifier: Apache-2.0
// bench/scenes: ticks whose instructions are counted. On a shared machine times vary by tens of percent; instructions do not.
//   count_ticks write DIR   runs every scene as far as needed, at full speed, and stores some ticks of each moment below as a
//                           small recording: the state before them and the inputs
//   count_ticks run DIR     runs those ticks again; under callgrind the ticks of each moment, and nothing else, become one dump
// tools/count_instructions.sh runs both and compares with bench/instructions.txt.
#include <valgrind/callgrind.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/check.h"
#include "exchange/event.h"
#include "procedure/scene_file.h"
#include "runtime/session.h"
#include "sim/recording.h"
#include "sim/simulation.h"
#include "wall/wall.h"

namespace {
using namespace catgut;

constexpr uint64_t kTicks = 12;  // of each moment: a fifth of a second, including some searches for pairs

// Moments are identified by events, not by times: a faster surgeon is not slower code.
struct Moment {
  const char* name;
  EventKind begins;  // with the tick after the nth of these ...
  int nth;           // 0: from the start of the run
  uint64_t ticks;    // ... and this many ticks
};
struct Scene {
  const char* name;
  std::vector<Moment> moment;
};
const std::vector<Scene> kScenes{
    {"purse_string", {{"rest", {}, 0, 12}, {"bite", EventKind::tip_entered, 3, 6}, {"draw", EventKind::bite_completed, 3, 60}}},
    {"connell", {{"rest", {}, 0, 12}, {"bite", EventKind::tip_entered, 3, 6}, {"draw", EventKind::bite_completed, 3, 60}}},
    {"stay", {{"rest", {}, 0, 12}, {"bite", EventKind::tip_entered, 1, 6}, {"knot", EventKind::throw_started, 1, 6}}},
    {"lembert", {{"rest", {}, 0, 12}, {"bite", EventKind::tip_entered, 1, 6}, {"knot", EventKind::throw_started, 1, 6}}},
};

std::string file_of(const std::string& folder, const Scene& scene, const Moment& moment) {
  return folder + "/" + scene.name + "." + moment.name + ".cgrec";
}

// Follows a run and stores the ticks of one moment.
class Keeper {
 public:
  Keeper(const Moment& moment, std::string path, std::string scene)
      : moment_(moment), path_(std::move(path)), scene_(std::move(scene)) {}

  // After every tick of the run.
  void look(const Model& model, const State& state, const Snapshot& seen, const TickInput& input) {
    if (recorder_) {
      recorder_->tick(input, hash_state(model, state));
      if (++kept_ == kTicks) {
        recorder_->finish(false);
        recorder_.reset();
      }
      return;
    }
    if (kept_ > 0) return;
    for (const Event& e : seen.event) seen_ += e.kind == moment_.begins;
    const bool begun = moment_.nth == 0 || seen_ >= moment_.nth;
    if (begun && since_++ == moment_.ticks)
      recorder_ =
          std::make_unique<Recorder>(path_, RecordingHeader{catgut_version(), kStateVersion, scene_}, save_state(model, state));
  }
  bool done() const { return kept_ == kTicks; }
  const Moment& moment() const { return moment_; }

 private:
  Moment moment_;
  std::string path_, scene_;
  std::unique_ptr<Recorder> recorder_;
  int seen_ = 0;
  uint64_t since_ = 0, kept_ = 0;
};

int write(const std::string& folder) {
  std::filesystem::create_directories(folder);
  for (const Scene& s : kScenes) {
    const SceneSpec scene = read_scene(s.name);
    std::vector<Keeper> keeper;
    for (const Moment& m : s.moment) keeper.emplace_back(m, file_of(folder, s, m), write_scene(scene));
    Snapshot seen;
    SessionHooks hooks;
    hooks.on_tick = [&](const Snapshot& now, const std::string&) { seen.event = now.event; };
    hooks.on_step = [&](const Model& model, const State& state, const TickInput& input) {
      for (Keeper& k : keeper) k.look(model, state, seen, input);
    };
    hooks.on_cost = [&](const Snapshot&, const StageTimes&, double) {
      for (const Keeper& k : keeper)
        if (!k.done()) return true;
      return false;
    };
    run_session(scene, {}, hooks);
    for (const Keeper& k : keeper)
      if (!k.done()) {
        std::fprintf(stderr, "count_ticks: %s never came to its moment \"%s\"\n", s.name, k.moment().name);
        return 1;
      }
  }
  return 0;
}

// Steps of the wall alone, pulled at one column: 1216 and 4864 nodes.
void run_walls() {
  for (const int fine : {1, 2}) {
    wall::Spec spec;
    wall::TubeShape shape;
    shape.around = 32 * fine, shape.rings = 19 * fine;
    spec.mesh = wall::tube(shape);
    wall::Wall w = wall::build_wall(spec);
    Jobs jobs(1);
    CALLGRIND_START_INSTRUMENTATION;
    CALLGRIND_ZERO_STATS;
    CALLGRIND_TOGGLE_COLLECT;
    for (uint64_t i = 0; i < kTicks; ++i) {
      w.scratch.external[0].x = 0.1f;
      wall::begin_step(w.model, w.state, w.scratch, jobs);
      wall::finish_step(w.model, w.state, jobs);
    }
    CALLGRIND_TOGGLE_COLLECT;
    CALLGRIND_DUMP_STATS;
    CALLGRIND_STOP_INSTRUMENTATION;
    std::printf("wall x%d %llu\n", fine * fine, static_cast<unsigned long long>(kTicks));
    std::fflush(stdout);
  }
}

int run(const std::string& folder) {
  run_walls();
  for (const Scene& s : kScenes) {
    std::shared_ptr<const Model> model;
    for (const Moment& m : s.moment) {
      const std::string path = file_of(folder, s, m);
      const Recording recording = read_recording(path);
      if (!model) model = build_model(parse_scene(recording.header.scene, path));
      const StatePtr state = initial_state(*model);
      load_state(*model, *state, recording.start);
      Jobs jobs(1);
      CALLGRIND_START_INSTRUMENTATION;
      CALLGRIND_ZERO_STATS;
      CALLGRIND_TOGGLE_COLLECT;
      for (const RecordedTick& t : recording.tick) step(*model, *state, t.input, jobs);
      CALLGRIND_TOGGLE_COLLECT;
      CALLGRIND_DUMP_STATS;  // dumps are numbered like the lines that are printed below
      CALLGRIND_STOP_INSTRUMENTATION;
      // The same ticks as stored, to the last bit, for any instruction set: otherwise something else was counted.
      if (recording.tick.size() != kTicks || hash_state(*model, *state) != recording.tick.back().hash) {
        std::fprintf(stderr, "count_ticks: %s: these are not the ticks that were kept\n", path.c_str());
        return 1;
      }
      std::printf("%s %s %llu\n", s.name, m.name, static_cast<unsigned long long>(kTicks));
      std::fflush(stdout);
    }
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string what = argc == 3 ? argv[1] : "";
  try {
    if (what == "write") return write(argv[2]);
    if (what == "run") return run(argv[2]);
  } catch (const catgut::InputError& error) {
    std::fprintf(stderr, "count_ticks: %s\n", error.what());
    return 2;
  }
  std::fprintf(stderr, "usage: count_ticks write DIR | run DIR\n");
  return 2;
}
