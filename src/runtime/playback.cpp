// SPDX-License-Identifier: Apache-2.0
// runtime: see playback.h. Comments below state which of the two threads may use Work's members.
#include "runtime/playback.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <iterator>
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
constexpr double kKeepEvery = 1.0;  // [s] between keyframes; a step back simulates at most this time
constexpr size_t kMostKept = 600;   // about 200 kB each; with more, every other one is dropped
constexpr int kTogether = 8;        // ticks scanned between polls for requests
constexpr int kGatherEvery = 30;    // ticks between two updates of the gathered results
constexpr auto kNap = std::chrono::milliseconds(2);

double seconds_of(Clock::duration d) { return std::chrono::duration<double>(d).count(); }

struct Request {
  bool playing = false;
  float speed = 1;
  uint64_t go_to = 0;
  uint64_t times = 0;  // counts calls of go_to
};

struct PlayView {
  Snapshot before, now;
  Clock::time_point at;
  double tick_wall_s = 1;
  PlaybackStatus status;
  bool any = false;
};

struct Keyframe {
  uint64_t at = 0;
  std::vector<std::byte> state;
};

}  // namespace

struct Playback::Work {
  // --- set before the thread starts, constant after ----------------------------------------------------------------------
  Recording recording;
  std::string name;
  std::shared_ptr<const Model> model;
  PictureModel picture;
  double dt = 1.0 / 60;
  uint64_t settle = 0;  // ticks

  // --- shared by the threads ---------------------------------------------------------------------------------------------
  mutable std::mutex mutex;  // for the next two; held only while copying
  Request request;
  LiveResult gathered;
  Latest<PlayView> view_box;
  std::atomic<bool> quit{false};
  std::thread thread;

  // --- owned by the window -----------------------------------------------------------------------------------------------
  PlaybackStatus status;

  // --- owned by the playing thread ---------------------------------------------------------------------------------------
  Jobs jobs{1};
  StatePtr ahead, shown;  // scanned; shown
  uint64_t at = 0;        // ticks that `shown` has played
  LiveResult so_far;
  std::vector<Keyframe> keyframe;
  uint64_t keep_every = 60;
  Snapshot scan_snapshot, before, now;
  PlaybackStatus published;
  uint64_t heard = 0;

  void begin();
  void run();
  void look_ahead();
  void publish_result();
  void move_to(uint64_t to);
  void step_shown();
  void publish_view();
  bool poll_request(Request& out);
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
  keyframe.push_back({0, recording.start});
  so_far.map = start_map(picture, dt);
  so_far.recorded = {name};
  published.ticks = recording.tick.size();
  published.first = now.tick;
  published.tick_s = dt;
  gathered = so_far;
  thread = std::thread([this] { run(); });
}

// Scans the recording for several ticks and gathers all results.
void Playback::Work::look_ahead() {
  for (int i = 0; i < kTogether && published.known < published.ticks; ++i) {
    const RecordedTick& t = recording.tick[published.known];
    step(*model, *ahead, t.input, jobs);
    publish(*model, *ahead, scan_snapshot);
    ++published.known;
    ++so_far.ticks;
    so_far.state_hash = hash_state(*model, *ahead);
    if (!published.differs_at && so_far.state_hash != t.hash) published.differs_at = published.known;
    if (scan_snapshot.tick > settle) {
      update(so_far.metrics, scan_snapshot, static_cast<float>(dt));
      note(so_far.map, picture, scan_snapshot);
    }
    if (published.known % keep_every == 0) {
      keyframe.push_back({published.known, save_state(*model, *ahead)});
      if (keyframe.size() > kMostKept) {
        for (size_t k = 1; 2 * k < keyframe.size(); ++k) keyframe[k] = std::move(keyframe[2 * k]);
        keyframe.resize((keyframe.size() + 1) / 2);
        keep_every *= 2;
      }
    }
    if (published.known % kGatherEvery == 0 || published.known == published.ticks) publish_result();
    if (!state_is_valid(*model, *ahead))
      throw SimulationUnstable(name + ": the simulation became unstable here; earlier ticks can be viewed");
  }
}

void Playback::Work::publish_result() {
  const std::lock_guard lock(mutex);
  gathered = so_far;
  ++published.gathered;
}

void Playback::Work::step_shown() {
  const RecordedTick& t = recording.tick[at];
  step(*model, *shown, t.input, jobs);
  ++at;
  // Keyframes and their continuation are compared with the recording too, not only the pass that made them.
  if (hash_state(*model, *shown) != t.hash && (!published.differs_at || *published.differs_at > at)) published.differs_at = at;
}

void Playback::Work::move_to(uint64_t to) {
  const Keyframe* from = nullptr;
  for (const Keyframe& k : keyframe)
    if (k.at <= to) from = &k;
  if (at > to || from->at > at) {
    load_state(*model, *shown, from->state);
    at = from->at;
  }
  // The last tick is published with the previous one, so that a paused picture equals a playing one.
  while (at < to && !quit.load(std::memory_order_relaxed)) {
    if (at + 1 == to) publish(*model, *shown, before);
    step_shown();
  }
  publish(*model, *shown, now);
}

void Playback::Work::publish_view() {
  PlayView& view = view_box.draft();
  view.before = before;
  view.now = now;
  view.at = Clock::now();
  view.tick_wall_s = dt / std::max(static_cast<double>(published.speed), 0.01);
  published.at = at;
  view.status = published;
  view.any = true;
  view_box.publish();
}

// True: there is another request.
bool Playback::Work::poll_request(Request& out) {
  const std::lock_guard lock(mutex);
  out = request;
  return std::exchange(heard, request.times) != request.times;
}

void Playback::Work::run() {
  Clock::time_point due = Clock::now(), shown_at = due;
  publish_view();
  bool whole = true;  // scanning continues
  Request w;
  uint64_t to = 0;
  bool going = false;
  while (!quit.load(std::memory_order_relaxed)) {
    if (poll_request(w)) to = std::min(w.go_to, published.ticks), going = true;
    const bool starts = w.playing && !published.playing;
    if (starts || w.speed != published.speed) due = Clock::now();
    const bool changed = w.playing != published.playing || w.speed != published.speed;
    published.playing = w.playing;
    published.speed = w.speed;
    try {
      if (going && (to <= published.known || !whole)) {
        move_to(std::min(to, published.known));
        going = false;
        due = Clock::now();
        publish_view();
        continue;
      }
      const double period = dt / static_cast<double>(std::max(published.speed, 0.01f));
      if (published.playing && at < published.known && Clock::now() >= due) {
        std::swap(before, now);
        step_shown();
        publish(*model, *shown, now);
        due += std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(period));
        if (seconds_of(Clock::now() - due) > 4 * period) due = Clock::now();
        // At high speeds not every tick is copied: no display shows more.
        if (at == published.known || seconds_of(Clock::now() - shown_at) > 0.008) publish_view(), shown_at = Clock::now();
        continue;
      }
      if (whole && published.known < published.ticks) {
        look_ahead();
        if (seconds_of(Clock::now() - shown_at) > 0.05 || published.known == published.ticks) {
          if (!published.playing) before = now;
          publish_view(), shown_at = Clock::now();
        }
        continue;
      }
    } catch (const std::exception& error) {
      published.fault = error.what();
      whole = going = false;
      publish_result();
      publish_view();
      continue;
    }
    if (changed) publish_view();
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
  work_->request.playing = on;
}

void Playback::speed(float of_real_time) {
  const std::lock_guard lock(work_->mutex);
  work_->request.speed = std::clamp(of_real_time, 0.05f, 16.0f);
}

void Playback::go_to(uint64_t tick) {
  const std::lock_guard lock(work_->mutex);
  work_->request.go_to = tick;
  ++work_->request.times;
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

const Pose* Playback::head() const {
  const std::vector<RecordedHead>& all = work_->recording.head;
  const auto after = std::upper_bound(all.begin(), all.end(), work_->status.at,
                                      [](uint64_t at, const RecordedHead& h) { return at < h.tick; });
  return after == all.begin() ? nullptr : &std::prev(after)->pose;
}

LiveResult Playback::result() const {
  const std::lock_guard lock(work_->mutex);
  return work_->gathered;
}

}  // namespace catgut
