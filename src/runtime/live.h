// SPDX-License-Identifier: Apache-2.0
// runtime: a scene that people work in. Physics runs on a thread of its own at the scene's fixed tick; a caller that holds the
// window publishes hands and commands and looks at pictures, and neither waits for the other. Ticks that come late are caught
// up, a few at a time; a machine that cannot keep up makes time itself go slower, and says by how much. What is simulated
// depends on the hands and the tick alone, as in runtime/session: with `record` every tick can be replayed bit for bit.
//
// One thread at a time calls a Live's functions (the window's); they never block, except finish() and the destructor.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "exchange/picture.h"
#include "exchange/snapshot.h"
#include "exchange/tool_input.h"
#include "runtime/haptics.h"
#include "runtime/measures.h"
#include "runtime/session_metrics.h"
#include "runtime/stitch_map.h"
#include "sim/scene.h"

namespace catgut {

enum class LiveCommand : uint8_t {
  pause,
  resume,
  single_step,  // one tick, then pause
  restart,      // back to the settled scene
  take_back,    // back to a moment before the last bite began; nothing when there is none
  slower,       // the next of kLiveSpeeds
  faster,
  arms_off,           // no force to the arms, they still move the tools; again: back, through its ramp
  mark,               // this moment is where a demonstration may begin: Live::demonstrate(..., true)
  end_demonstration,  // back to where the learner was
};
constexpr std::array<float, 4> kLiveSpeeds{1.0f, 0.5f, 0.25f, 0.1f};  // of real time

struct LiveOptions {
  int threads = 1;          // of the solver
  std::string record;       // recording to write; empty: none. See LiveStatus::recorded
  std::string surgeon;      // as `catgut run --surgeon`; empty: the hands of hand()
  float hand_speed = 0.6f;  // [m/s] and
  float hand_turn = 12.0f;  // [rad/s] at most for a tool: a device that jumps (a mouse under a slow picture) tears nothing
  bool start_paused = false;
  // Haptic arms, as read_arm_choice (runtime/haptics) reads them; empty or "off": none. What is missing is reported and the
  // scene opens without. A hand without an arm stays the window's.
  std::string haptics;
  std::string haptics_log;                      // as HapticsOptions::log
  std::array<uint8_t, 2> arm_hand{0, 1};        // the hand that each of the two arms moves
  std::function<void(const std::string&)> say;  // a line about the arms, from any thread; empty: lines are dropped
};

struct LiveStatus {
  uint64_t tick = 0;
  double time_s = 0;      // [s] simulated
  float speed = 1;        // of real time, as asked for
  float time_factor = 0;  // simulated over wall time, lately; less than `speed`: this machine is too slow for the scene
  float tick_ms = 0;      // that a tick takes to compute, lately
  uint64_t late = 0;      // ticks' worth of time that was given up because it could not be caught up
  bool paused = false;
  bool settling = true;       // the scene settles; hands are not let in yet
  uint32_t epoch = 0;         // counts restarts and bites undone: hands continue from where the tools are then
  uint32_t to_take_back = 0;  // bites that take_back can undo
  uint32_t events_lost = 0;   // no one fetched them in time
  std::array<uint64_t, kMaxHands> input_time_ns{};  // ToolInput::time_ns of the hands in the newest tick, for latencies
  // Of the newest tick that was the first to have a motion, on wall_ns(), for latencies: when the motion was read (where the
  // device uses that clock), when the tick began, and when its snapshot was ready to be looked at.
  uint64_t moved_ns = 0, began_ns = 0, ready_ns = 0;
  std::array<bool, kMaxHands> arm{};  // a haptic arm moves that hand
  std::array<ArmView, 2> arm_view{};  // of each arm
  bool arms_off = false;
  SessionMetrics metrics;
  Measures measures;           // filled while watched, see watch()
  std::string doing;           // of the surgeon, when one works
  bool demonstrating = false;  // the surgeon shows something; what was before comes back
  bool shown = false;          // and is through with it, or gave up
  std::string refused;         // the last change() that could not be made, and why
  std::string fault;           // not empty: the run has stopped, and why
};

struct LiveResult {
  SessionMetrics metrics;
  StitchMap map;
  uint64_t ticks = 0;  // all that were computed, those undone included
  uint64_t state_hash = 0;
  std::vector<std::string> recorded;  // files written: a restart or a bite undone begins the next one (NAME.2.cgrec ...)
  std::string fault;
};

class Live {
 public:
  // Builds the scene and starts. Throws InputError (scene, recording, surgeon).
  Live(const SceneSpec& scene, const LiveOptions& options);
  ~Live();  // stops; the recording is kept
  Live(const Live&) = delete;
  Live& operator=(const Live&) = delete;

  const PictureModel& picture() const;

  // The newest pose of hand `who`, below kMaxHands. A button that goes down is not lost when it comes up again before the next
  // tick.
  void hand(size_t who, const ToolInput& input);
  // Take, swap, lay down, park or take up an instrument in the next tick. False: as below.
  bool instrument(const Command& command);
  // False: too many are waiting; try again.
  bool command(LiveCommand command);

  // For developers: "solver.damping=6" from the next tick on, as in --set; sizes and numbers of things cannot change. The model
  // is built again, which may cost some ticks' time. The recording continues in another file, whose scene says so. False: as
  // above.
  bool change(const std::string& key_equals_value);
  void watch(bool on);  // measures are wanted; they cost some microseconds a tick
  // The scripted surgeon takes the tools and shows tasks of its plan (make_demonstrator): from here, or from the moment that
  // was last marked. Until end_demonstration, which brings everything back as it is now.
  bool demonstrate(const std::vector<size_t>& tasks, bool from_mark);

  // The field as it is now: the last two ticks blended by the time that has passed, so that it shows one tick late and moves
  // evenly whatever the rate of pictures. False before there is any.
  bool look(Snapshot& out);
  const LiveStatus& status() const;  // as of the last look()
  bool event(Event& out);            // the next thing that happened; false: none for now

  LiveResult finish();  // stops and closes the recording

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

// Toward `to` as far as a hand gets in dt [s] at no more than `speed` [m/s] and `turn` [rad/s]; the jaw at ten strokes a
// second. share: of the way, per call: below 1 where hands are heard of less often than this is called, so that a tool moves
// evenly and does not stop between two pictures (a needle that stops springs back out of the tissue).
ToolInput hand_toward(const ToolInput& from, const ToolInput& to, float speed, float turn, float dt, float share = 1);
float hand_share(float every);  // for hands that are heard of every so many calls

// [s] on a clock that never goes back, for whatever is paced outside the physics: pictures, key repeats, latencies.
double wall_seconds();
uint64_t wall_ns();

}  // namespace catgut
