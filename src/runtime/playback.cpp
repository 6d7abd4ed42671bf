// runtime: see playback.h. Below, Work's members say which of the two threads may touch them.
#include "runtime/playback.h"

#include <atomic>
#include <chrono>
#include <cmath>
#include <mutex>
#include <thread>
#include <utility>

#include "core/check.h"
#include "exchange/latest.h"
#include "procedure/scene_file.h"
#include "runtime/blend.h"
#include "runtime/session.h"
#include "sim/simulation.h"

namespace catgut {
namespace {

using Clock = std::chrono::steady_clock;
constexpr double kKeepEvery = 1.0;  // [s] between kept states; a step back costs at most so much simulation
constexpr size_t kMostKept = 600;   // some 200 kB each; with more every other one is dropped
constexpr int kTogether = 8;        // ticks looked through before wishes are heard again
constexpr int kGatherEvery = 30;    // ticks between two tellings of what was gathered
constexpr auto kNap = std::chrono::milliseconds(2);

double seconds_of(Clock::duration d) { return std::chrono::duration<double>(d).count(); }

struct Wish {
  bool playing = false;
  float speed = 1;
  uint64_t go_to = 0;
  uint64_t times = 0;  // counts every go_to
};

struct PlayView {
  Snapshot before, now;
  Clock::time_point at;
  double tick_wall_s = 1;
  PlaybackStatus status;
  bool any = false;
};

struct Kept {
  uint64_t at = 0;
  std::vector<std::byte> state;
};

}  // namespace

struct Playback::Work {
  // --- set up before the thread starts, constant after -------------------------------------------------------------------
  Recording recording;
  std::string name;
  std::shared_ptr<const Model> model;
  PictureModel picture;
  double dt = 1.0 / 60;
  uint64_t settle = 0;  // ticks

  // --- between the threads -----------------------------------------------------------------------------------------------
  mutable std::mutex mutex;  // of the next two; held for copies only
  Wish wish;
  LiveResult gathered;
  Latest<PlayView> view_box;
  std::atomic<bool> quit{false};
  std::thread thread;

  // --- the window's ------------------------------------------------------------------------------------------------------
  PlaybackStatus status;

  // --- the playing thread's ----------------------------------------------------------------------------------------------
  Jobs jobs{1};
  StatePtr ahead, shown;  // looked through; in the picture
  uint64_t at = 0;        // ticks that `shown` has played
  LiveResult so_far;
  std::vector<Kept> kept;
  uint64_t keep_every = 60;
  Snapshot scout, before, now;
  PlaybackStatus told;
  uint64_t heard = 0;

  void begin();
  void run();
  void look_ahead();
  void tell();
  void move_to(uint64_t to);
  void step_shown();
  void show();
  bool hear(Wish& out);
};

void Playback::Work::begin() {
  check_replayable(recording, name);
  const SceneSpec scene = parse_scene(recording.header.scene, name);
  model = build_model(scene);
  picture = picture_model(*model);
  dt = 1.0 / static_cast<double>(scene.solver.tick_rate);
  settle = static_cast<uint64_t>(std::llround(static_cast<double>(scene.settle) / dt));
  keep_every = std::max<uint64_t>(1, static_cast<uint64_t>(std::llround(kKeepEvery / dt)));
  ahead = initial_state(*model);
  shown = initial_state(*model);
  load_state(*model, *ahead, recording.start);
  load_state(*model, *shown, recording.start);
  publish(*model, *shown, now);
  before = now;
  kept.push_back({0, recording.start});
  so_far.map = start_map(picture, dt);
  so_far.recorded = {name};
  told.ticks = recording.tick.size();
  told.first = now.tick;
  told.tick_s = dt;
  gathered = so_far;
  thread = std::thread([this] { run(); });
}

// Some ticks further into the recording, with all that is to be known about them.
void Playback::Work::look_ahead() {
  for (int i = 0; i < kTogether && told.known < told.ticks; ++i) {
    const RecordedTick& t = recording.tick[told.known];
    step(*model, *ahead, t.input, jobs);
    publish(*model, *ahead, scout);
    ++told.known;
    ++so_far.ticks;
    so_far.state_hash = hash_state(*model, *ahead);
    if (!told.differs_at && so_far.state_hash != t.hash) told.differs_at = told.known;
    if (scout.tick > settle) {
      note(so_far.practice, scout, static_cast<float>(dt));
      note(so_far.map, picture, scout);
    }
    if (told.known % keep_every == 0) {
      kept.push_back({told.known, save_state(*model, *ahead)});
      if (kept.size() > kMostKept) {
        for (size_t k = 1; 2 * k < kept.size(); ++k) kept[k] = std::move(kept[2 * k]);
        kept.resize((kept.size() + 1) / 2);
        keep_every *= 2;
      }
    }
    if (told.known % kGatherEvery == 0 || told.known == told.ticks) tell();
    if (!state_is_sane(*model, *ahead))
      throw SimulationUnstable(name + ": the simulation became unstable here; earlier ticks can be viewed");
  }
}

void Playback::Work::tell() {
  const std::lock_guard lock(mutex);
  gathered = so_far;
  ++told.gathered;
}

void Playback::Work::step_shown() {
  const RecordedTick& t = recording.tick[at];
  step(*model, *shown, t.input, jobs);
  ++at;
  // Kept states and what follows them must be the recorded ones too, not only the pass that made them.
  if (hash_state(*model, *shown) != t.hash && (!told.differs_at || *told.differs_at > at)) told.differs_at = at;
}

void Playback::Work::move_to(uint64_t to) {
  const Kept* from = nullptr;
  for (const Kept& k : kept)
    if (k.at <= to) from = &k;
  if (at > to || from->at > at) {
    load_state(*model, *shown, from->state);
    at = from->at;
  }
  // The last tick is published with the one before it, so that what is held looks as it does while playing.
  while (at < to && !quit.load(std::memory_order_relaxed)) {
    if (at + 1 == to) publish(*model, *shown, before);
    step_shown();
  }
  publish(*model, *shown, now);
}

void Playback::Work::show() {
  PlayView& view = view_box.draft();
  view.before = before;
  view.now = now;
  view.at = Clock::now();
  view.tick_wall_s = dt / std::max(static_cast<double>(told.speed), 0.01);
  told.at = at;
  view.status = told;
  view.any = true;
  view_box.publish();
}

// True: there is somewhere else to go.
bool Playback::Work::hear(Wish& out) {
  const std::lock_guard lock(mutex);
  out = wish;
  return std::exchange(heard, wish.times) != wish.times;
}

void Playback::Work::run() {
  Clock::time_point due = Clock::now(), shown_at = due;
  show();
  bool whole = true;  // looking ahead goes on
  Wish w;
  uint64_t to = 0;
  bool going = false;
  while (!quit.load(std::memory_order_relaxed)) {
    if (hear(w)) to = std::min(w.go_to, told.ticks), going = true;
    const bool starts = w.playing && !told.playing;
    if (starts || w.speed != told.speed) due = Clock::now();
    const bool changed = w.playing != told.playing || w.speed != told.speed;
    told.playing = w.playing;
    told.speed = w.speed;
    try {
      if (going && (to <= told.known || !whole)) {
        move_to(std::min(to, told.known));
        going = false;
        due = Clock::now();
        show();
        continue;
      }
      const double period = dt / static_cast<double>(std::max(told.speed, 0.01f));
      if (told.playing && at < told.known && Clock::now() >= due) {
        std::swap(before, now);
        step_shown();
        publish(*model, *shown, now);
        due += std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(period));
        if (seconds_of(Clock::now() - due) > 4 * period) due = Clock::now();
        // At high speeds not every tick is worth a copy: no display shows more.
        if (at == told.known || seconds_of(Clock::now() - shown_at) > 0.008) show(), shown_at = Clock::now();
        continue;
      }
      if (whole && told.known < told.ticks) {
        look_ahead();
        if (seconds_of(Clock::now() - shown_at) > 0.05 || told.known == told.ticks) {
          if (!told.playing) before = now;
          show(), shown_at = Clock::now();
        }
        continue;
      }
    } catch (const std::exception& error) {
      told.fault = error.what();
      whole = going = false;
      tell();
      show();
      continue;
    }
    if (changed) show();
    std::this_thread::sleep_for(kNap);
  }
}

Playback::Playback(const Recording& recording, const std::string& name) : work_(std::make_unique<Work>()) {
  work_->recording = recording;
  work_->name = name;
  work_->begin();
}

Playback::~Playback() {
  work_->quit = true;
  if (work_->thread.joinable()) work_->thread.join();
}

const SceneSpec& Playback::scene() const { return scene_of(*work_->model); }
const PictureModel& Playback::picture() const { return work_->picture; }

void Playback::play(bool on) {
  const std::lock_guard lock(work_->mutex);
  work_->wish.playing = on;
}

void Playback::speed(float of_real_time) {
  const std::lock_guard lock(work_->mutex);
  work_->wish.speed = std::clamp(of_real_time, 0.05f, 16.0f);
}

void Playback::go_to(uint64_t tick) {
  const std::lock_guard lock(work_->mutex);
  work_->wish.go_to = tick;
  ++work_->wish.times;
}

bool Playback::look(Snapshot& out) {
  work_->view_box.update();
  const PlayView& view = work_->view_box.seen();
  if (!view.any) return false;
  work_->status = view.status;
  const double passed = seconds_of(Clock::now() - view.at);
  blend(view.before, view.now, view.status.playing ? static_cast<float>(passed / view.tick_wall_s) : 1.0f, out);
  return true;
}

const PlaybackStatus& Playback::status() const { return work_->status; }

LiveResult Playback::result() const {
  const std::lock_guard lock(work_->mutex);
  return work_->gathered;
}

}  // namespace catgut
