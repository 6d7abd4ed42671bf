// SPDX-License-Identifier: Apache-2.0
// runtime: physics on its own thread; see live.h and live_work.h.
#include "runtime/live.h"

#include <atomic>
#include <chrono>
#include <cmath>
#include <deque>
#include <optional>
#include <thread>
#include <utility>

#include "core/check.h"
#include "exchange/buttons.h"
#include "exchange/latest.h"
#include "exchange/ring.h"
#include "procedure/scene_file.h"
#include "runtime/blend.h"
#include "runtime/force_curves.h"
#include "runtime/hands.h"
#include "runtime/haptics.h"
#include "runtime/live_work.h"
#include "runtime/session.h"
#include "sim/recording.h"
#include "sim/simulation.h"

namespace catgut {
namespace {

constexpr int kCatchUp = 4;              // overdue ticks computed at once; further ones are dropped
constexpr size_t kMostTakenBack = 32;    // bites kept, some 200 kB each
constexpr double kBeforeBite = 0.25;     // [s] minimum between the restored moment and the entry of the tip
constexpr uint64_t kValidityTicks = 16;  // as in runtime/session
constexpr uint64_t kNewsTicks = 64;      // interval of polling the devices for faults
constexpr double kFactorTime = 0.5;      // [s] window of `lately`
constexpr float kArmSpeed = 1.0f;        // [m/s] at which a tool moves to a device that reconnects at another position
constexpr double kLinger = 1.2;          // [s] that the result of a demonstration stays visible
constexpr auto kNap = std::chrono::milliseconds(2);  // maximum delay of a command while no tick is due

double seconds_of(Clock::duration d) { return std::chrono::duration<double>(d).count(); }

// NAME.cgrec, NAME.2.cgrec, ...
std::string part_name(const std::string& path, size_t part) {
  if (part == 1) return path;
  const size_t dot = path.rfind('.'), slash = path.rfind('/');
  const bool has = dot != std::string::npos && (slash == std::string::npos || dot > slash + 1);
  return path.substr(0, has ? dot : path.size()) + "." + std::to_string(part) + (has ? path.substr(dot) : "");
}

}  // namespace

void Live::Work::begin() {
  const ArmChoice choice = read_arm_choice(options.haptics);
  as_paper = choice.as_paper;
  std::vector<std::string> lines;
  ArmPort arms = open_arms(choice, lines);
  for (size_t k = 0; options.say && k < lines.size(); ++k) options.say(lines[k]);
  if (arms.any()) prepare_for_arms(scene);
  else if (options.surgeon.empty()) prepare_for_mouse(scene);
  model = build_model(scene);
  picture = picture_model(*model);
  if (arms.any()) {
    HapticsOptions how;
    how.place = read_arm_places(arm_places_file());
    how.log = options.haptics_log, how.strength = options.arm_strength;
    haptics = std::make_unique<Haptics>(std::move(arms), picture, how);
    for (size_t arm = 0; arm < 2; ++arm) published.arm[hand_of(arm)] |= haptics->present(arm);
  }
  dt = 1.0 / static_cast<double>(scene.solver.tick_rate);
  checkpoint_every = std::max<uint64_t>(1, static_cast<uint64_t>(std::llround(kBeforeBite / dt)));
  state = initial_state(*model);
  jobs = std::make_unique<Jobs>(options.threads);
  if (!options.surgeon.empty()) surgeon = make_hands(options.surgeon, scene, picture);
  for (ToolInput& hand : input.hand) hand.connected = 0;
  published.recording = options.record_at_once && !options.record.empty();
  record_from_here();
  map = start_map(picture, dt);
  begin_assessment();
  publish(*model, *state, now);
  before = now;
  published.paused = options.start_paused;
  thread = std::thread([this] { run(); });
}

void Live::Work::record_from_here() {
  if (!published.recording) return;
  if (recorder) recorder->finish(true);
  recorder.reset();
  const std::string path = part_name(options.record, result.recorded.size() + 1);
  recorder = std::make_unique<Recorder>(path, RecordingHeader{catgut_version(), kStateVersion, write_scene(scene)},
                                        save_state(*model, *state));
  result.recorded.push_back(path);
  result.recorded_from.push_back(now.tick);
}

void Live::Work::tick(bool let_in) {
  const Clock::time_point start = Clock::now();
  const uint64_t began_ns = wall_ns();
  uint64_t fresh = 0;  // time_ns of the newest motion first used in this tick
  if (let_in && published.tick % checkpoint_every == 0) {
    std::swap(checkpoint[0], checkpoint[1]);
    checkpoint[0] = moment();
  }
  input.tick = result.ticks;
  input.commands.clear();
  if (published.preparing || (let_in && (surgeon.surgeon || published.demonstrating))) {
    Surgeon& hands = surgeon.surgeon && !published.preparing ? *surgeon.surgeon : *demonstrator.surgeon;
    const TickInput wanted = hands.operate(now, static_cast<float>(dt));
    input.hand = wanted.hand;
    input.commands = wanted.commands;
    published.doing = hands.doing();
    published.shown = published.shown || (published.demonstrating && hands.done());
  } else if (let_in) {
    for (Command c; input.commands.count < CommandList::kCapacity && orders.pop(c);) input.commands.push(c);
    std::array<ToolInput, 2> steered{no_hand(), no_hand()};
    if (options.hands)
      steered = options.hands(
          {picture, now, static_cast<float>(dt), published.epoch, published.metrics.time_s == 0 && !published.prepared});
    for (size_t k = 0; k < kMaxHands; ++k) {
      ++unheard[k];
      if (hand_box[k].update()) {
        heard_every[k] += 0.2f * (static_cast<float>(unheard[k]) - heard_every[k]);
        unheard[k] = 0;
      }
      const HandMessage& mail = hand_box[k].seen();
      const uint32_t down = pressed[k].exchange(0, std::memory_order_relaxed);
      ToolInput& hand = input.hand[k];
      if (const int arm = arm_of(k); arm >= 0) {
        const ToolInput wanted = haptics->hand(static_cast<size_t>(arm));
        add_commands(input.commands, k, down | (wanted.buttons & ~std::exchange(arm_buttons[k], wanted.buttons)), now);
        hand = hand_toward(hand, wanted, kArmSpeed, 10 * options.hand_turn, static_cast<float>(dt));
        continue;
      }
      if (k < 2 && steered[k].connected) {
        add_commands(input.commands, k, steered[k].buttons & ~std::exchange(arm_buttons[k], steered[k].buttons), now);
        hand = hand_toward(hand, steered[k], options.hand_speed, options.hand_turn, static_cast<float>(dt));
        fresh = std::max(fresh, steered[k].time_ns > published.input_time_ns[k] ? steered[k].time_ns : 0);
        published.input_time_ns[k] = steered[k].time_ns;
        continue;
      }
      // A message from before a jump in time refers to other tool poses: the hand stays until a newer one arrives.
      if (mail.epoch != published.epoch) continue;
      add_commands(input.commands, k, down, now);
      hand = hand_toward(hand, mail.input, options.hand_speed, options.hand_turn, static_cast<float>(dt),
                         hand_share(heard_every[k]));
      fresh = std::max(fresh, mail.input.time_ns > published.input_time_ns[k] ? mail.input.time_ns : 0);
      published.input_time_ns[k] = mail.input.time_ns;
    }
  }
  const bool watch = watched.load(std::memory_order_relaxed);
  StageTimes times;
  step(*model, *state, input, *jobs, watch ? &times : nullptr);
  std::swap(before, now);
  {
    StageTimer timer(watch ? &times : nullptr, Stage::publish);
    publish(*model, *state, now);
  }
  if (haptics && let_in) feel();
  ++result.ticks;
  if (recorder) try {
      recorder->tick(input, hash_state(*model, *state));
      if (head_box.update()) recorder->head(head_box.seen());
    } catch (const InputError& error) {
      if (options.record_or_stop) throw;
      recorder.reset();
      published.recording = false;
      published.refused = error.what();
    }
  if (let_in) {
    update(published.metrics, now, static_cast<float>(dt));
    note(map, picture, now);
    assess_tick();
    observe();
  }
  for (const Event& e : now.event) {
    if (published.demonstrating || published.preparing) continue;  // not the user's, and they cannot be undone
    published.events_lost += !events.push(e);
    if (e.kind == EventKind::tip_entered && checkpoint[0]) {
      bites.push_back({e.which, checkpoint[1] ? *checkpoint[1] : *checkpoint[0]});
      if (bites.size() > kMostTakenBack) bites.pop_front();
    } else if (e.kind == EventKind::bite_withdrawn) {
      if (!bites.empty() && bites.back().bite == e.which) bites.pop_back();
    }
  }
  published.tick = now.tick;
  published.time_s = now.time_s;
  published.to_take_back = static_cast<uint32_t>(bites.size());
  if (now.tick % kValidityTicks == 0 && !state_is_valid(*model, *state))
    throw SimulationUnstable(scene.name + ": the simulation became unstable; undo the last bite, or restart; keep the " +
                             "recording to find the cause");
  if (fresh > 0) published.moved_ns = fresh, published.began_ns = began_ns, published.ready_ns = 0;
  if (watch) {
    measure(*model, *state, published.measures);
    if (!published.measures.physical) published.measures.contacts = times.contacts;
    for (size_t k = 0; k < times.ms.size(); ++k) {  // smoothed for display
      float& ms = published.measures.stage_ms[k];
      ms += 0.05f * (static_cast<float>(times.ms[k]) - ms);
    }
  }
  const double spent = seconds_of(Clock::now() - start), keep = std::exp(-dt / kFactorTime);
  spent_s = spent_s * keep + spent;
  ticks_weight = ticks_weight * keep + 1;
  published.tick_ms = static_cast<float>(1000 * spent_s / ticks_weight);
}

// Whether the devices move the tools at real-time speed. Otherwise their forces are not rendered.
bool Live::Work::arms_drive() const {
  return !published.demonstrating && !surgeon.surgeon && !published.paused && speed == 0 && !published.arms_off;
}

void Live::Work::rest_arms() {
  handovers += std::exchange(arms_drove, false);
  for (size_t k = 0; k < 2; ++k) haptics->rest(k, published.epoch + handovers);
}

void Live::Work::feel() {
  const bool drive = arms_drive();
  if (drive) handovers += !std::exchange(arms_drove, true);
  else rest_arms();
  if (as_paper) follow(paper, now, picture);
  for (size_t arm = 0; arm < 2 && drive; ++arm) {
    const size_t k = hand_of(arm);
    haptics->publish(arm, as_paper ? paper_patch(paper, now, picture, k) : now.patch[k], published.epoch + handovers,
                     kLiveSpeeds[speed]);
  }
  if (now.tick % kNewsTicks != 0 || !options.say) return;
  for (const std::string& line : haptics->news()) options.say(line);
}

void Live::Work::publish_view() {
  LiveView& view = view_box.draft();
  view.before = before, view.now = now;
  view.at = Clock::now();
  view.tick_wall_s = period();
  published.speed = kLiveSpeeds[speed];
  const char* off = published.arms_off ? "switched off (F9)" : arms_drive() ? "" : "off while it does not move the instrument";
  for (size_t k = 0; haptics && k < 2; ++k)
    published.metrics.peak_rendered[hand_of(k)] = (published.arm_view[k] = haptics->view(k, off)).peak;
  if (published.ready_ns == 0 && published.moved_ns > 0) published.ready_ns = wall_ns();
  view.status = published;
  view.any = true;
  view_box.publish();
}

void Live::Work::go_back(const Moment& to) {
  load_state(*model, *state, to.state);
  publish(*model, *state, now);
  before = now;
  rewind(map, now.tick);
  assess::rewind(facts, to.tally);
  input.hand = to.hand;
  const uint32_t undos = published.metrics.undos;
  published.reading = published.reading || (options.tutorial && to.procedure.stage != published.procedure.stage);
  published.procedure = to.procedure;
  published.metrics = to.metrics;
  published.metrics.undos = undos;
  published.fault.clear();
  ++published.epoch;
  published.tick = now.tick;
  published.time_s = now.time_s;
  checkpoint = {};
  checkpoint[0] = to;
  published.to_take_back = static_cast<uint32_t>(bites.size());
  record_from_here();
  forget_pace();
}

// Simulated time so far is kept. The recording's next file has the scene, the state and the inputs, which determine all later
void Live::Work::change_scene(const std::string& key_equals_value) {
  try {
    SceneSpec changed = scene;
    set_value(changed, key_equals_value, "change");
    const auto next = build_model(changed);
    StatePtr same = initial_state(*next);
    load_state(*next, *same, save_state(*model, *state));
    scene = changed;
    model = next;
    state = std::move(same);
    published.refused.clear();
    record_from_here();
  } catch (const InputError& error) { published.refused = error.what(); }
  forget_pace();
}

void Live::Work::process_commands() {
  bool any = false;
  for (std::string c; changes.pop(c); any = true) change_scene(c);
  for (Request c; requests.pop(c); any = true) {
    if (c.demonstrate) {
      demonstrate(c.of);
      continue;
    }
    switch (c.what) {
      case LiveCommand::pause:
        published.paused = true;
        break;
      case LiveCommand::resume:
        published.paused = !published.fault.empty();
        break;
      case LiveCommand::single_step:
        published.paused = true;
        steps += published.fault.empty();
        break;
      case LiveCommand::record:
        if (options.record.empty()) break;
        published.recording = !published.recording;
        if (!published.recording && recorder) recorder->finish(true), recorder.reset();
        record_from_here();
        break;
      case LiveCommand::arms_off:
        published.arms_off = !published.arms_off;
        break;
      case LiveCommand::begin_stage:
        published.reading = false;
        break;
      case LiveCommand::show_stage:
        show_stage();
        break;
      case LiveCommand::end_demonstration:
        end_demonstration();
        break;
      case LiveCommand::restart:
        end_demonstration();
        bites.clear();
        published.metrics.undos = 0;
        go_back(settled);
        published.reading = false;
        if (!options.surgeon.empty()) surgeon = make_hands(options.surgeon, scene, picture);
        break;
      case LiveCommand::take_back: {
        end_demonstration();
        if (bites.empty() || surgeon.surgeon) break;
        const Moment to = std::move(bites.back().before);
        bites.pop_back();
        ++published.metrics.undos;
        go_back(to);
        break;
      }
      case LiveCommand::slower:
        speed = std::min(speed + 1, kLiveSpeeds.size() - 1);
        forget_pace();
        break;
      case LiveCommand::faster:
        speed -= speed > 0;
        forget_pace();
        break;
    }
  }
  if (any) publish_view();
}

void Live::Work::main_loop() {
  Clock::time_point due = Clock::now(), last = due;
  while (!quit.load(std::memory_order_relaxed)) {
    process_commands();
    const Clock::time_point at = Clock::now();
    const bool stepping = steps > 0;
    if ((published.paused || (published.reading && !published.demonstrating)) && !stepping) {
      if (haptics) rest_arms();
      std::this_thread::sleep_for(kNap);
      due = last = Clock::now();
      continue;
    }
    if (!stepping && at < due) {
      std::this_thread::sleep_until(std::min(due, at + kNap));
      continue;
    }
    steps -= stepping;
    tick(true);
    if (published.demonstrating && published.shown) {  // its result stays visible for a moment
      shown_for += dt / static_cast<double>(kLiveSpeeds[speed]);
      if (shown_for > kLinger) end_demonstration();
    }
    const Clock::time_point done = Clock::now();
    const double passed = seconds_of(done - last), keep = std::exp(-passed / kFactorTime);
    last = done;
    wall_s = wall_s * keep + passed;
    simulated_s = simulated_s * keep + dt;
    published.time_factor = static_cast<float>(simulated_s / std::max(wall_s, 1e-6));
    due += std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(period()));
    const double behind = seconds_of(done - due);
    if (stepping) {
      due = done;
    } else if (behind > kCatchUp * period()) {
      published.late += static_cast<uint64_t>(behind / period());
      due = done;
    }
    publish_view();
  }
}

void Live::Work::run() {
  bool was_settled = false;
  while (!quit.load(std::memory_order_relaxed)) try {
      if (!was_settled) {  // settling: as fast as possible, hands not connected
        publish_view();
        const auto ticks = static_cast<uint64_t>(std::llround(static_cast<double>(scene.settle) / dt));
        while (result.ticks < ticks && !quit.load(std::memory_order_relaxed)) tick(false);
        prepare();
        settled = moment();
        settled_tick = now.tick;
        published.settling = false;
        was_settled = true;
        publish_view();
      }
      main_loop();
    } catch (const std::exception& error) {  // shown in the window; the user restarts, undoes, or leaves
      published.fault = error.what();
      published.paused = true;
      steps = 0;
      if (!was_settled) settled = moment(), was_settled = true, published.settling = false;
      if (recorder) recorder.reset();
      published.recording = false;
      publish_view();
    }
  if (haptics) haptics->stop();
  published.fault.swap(result.fault);
  result.metrics = published.metrics;
  result.procedure = published.procedure;
  finish_assessment();
  result.map = std::move(map);
  result.state_hash = hash_state(*model, *state);
  try {
    if (recorder) recorder->finish(true);
  } catch (const std::exception& error) { result.fault = error.what(); }
  recorder.reset();
}

Live::Live(const SceneSpec& scene, const LiveOptions& options) : work_(std::make_unique<Work>()) {
  work_->scene = scene;
  work_->options = options;
  work_->begin();
}

Live::~Live() { finish(); }

const PictureModel& Live::picture() const { return work_->picture; }

void Live::hand(size_t who, const ToolInput& input) {
  HandMessage& mail = work_->hand_box[who].draft();
  mail.input = input;
  mail.epoch = work_->status.epoch;
  work_->pressed[who].fetch_or(input.buttons & ~work_->buttons[who], std::memory_order_relaxed);
  work_->buttons[who] = input.buttons;
  work_->hand_box[who].publish();
}

void Live::head(const Pose& pose) {
  work_->head_box.draft() = pose;
  work_->head_box.publish();
}

bool Live::change(const std::string& key_equals_value) { return work_->changes.push(key_equals_value); }
void Live::watch(bool on) { work_->watched = on; }

void Live::arm_strength(size_t side, float gain) {
  if (work_->haptics) work_->haptics->set_strength(side, gain);
}
bool Live::command(LiveCommand command) { return work_->requests.push({command, false, {}}); }
bool Live::instrument(const Command& command) { return work_->orders.push(command); }

bool Live::demonstrate(const std::vector<size_t>& tasks, bool slowly) {
  Request c;
  c.demonstrate = true;
  c.of.slowly = slowly;
  for (const size_t t : tasks)
    if (c.of.tasks < c.of.task.size()) c.of.task[c.of.tasks++] = static_cast<uint8_t>(t);
  return work_->requests.push(c);
}

bool Live::look(Snapshot& out, double at_s) {
  work_->view_box.update();
  const LiveView& view = work_->view_box.seen();
  if (!view.any) return false;
  work_->status = view.status;
  const double passed = at_s - seconds_of(view.at.time_since_epoch());
  blend(view.before, view.now, view.status.paused || view.status.reading ? 1.0f : static_cast<float>(passed / view.tick_wall_s),
        out);
  return true;
}

const LiveStatus& Live::status() const { return work_->status; }
bool Live::event(Event& out) { return work_->events.pop(out); }
bool Live::remark(assess::Remark& out) { return work_->remarks.pop(out); }

LiveResult Live::finish() {
  work_->quit = true;
  if (work_->thread.joinable()) work_->thread.join();
  return work_->result;
}

}  // namespace catgut
