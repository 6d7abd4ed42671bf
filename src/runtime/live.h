// SPDX-License-Identifier: Apache-2.0
// runtime: interactive run of a scene. Physics runs on its own thread at the scene's fixed tick; the window publishes hands and
// commands and reads pictures, and neither waits for the other. Overdue ticks are computed later, a few at a time; a machine
// that cannot keep up runs slower than real time, and the factor is reported. The simulation depends only on inputs and tick,
// as in runtime/session: with `record` every tick can be replayed bit for bit.
//
// Only one thread (the window's) may call a Live's functions; they never block, except finish() and the destructor.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "assess/feedback.h"
#include "assess/result.h"
#include "assess/rubric.h"
#include "assess/stitch_map.h"
#include "exchange/picture.h"
#include "exchange/snapshot.h"
#include "exchange/tool_input.h"
#include "procedure/manager.h"
#include "runtime/haptics.h"
#include "runtime/measures.h"
#include "runtime/session_metrics.h"
#include "sim/scene.h"

namespace catgut {

// [s] on a monotonic clock, for timing outside the physics: frames, key repeats, latencies.
double wall_seconds();
uint64_t wall_ns();

enum class LiveCommand : uint8_t {
  pause,
  resume,
  single_step,  // one tick, then pause
  restart,      // back to the settled scene
  take_back,    // back to a moment before the last bite started; no effect if there is none
  slower,       // the next of kLiveSpeeds
  faster,
  arms_off,           // switches device forces off, they still move the tools; again: on, through the ramp
  begin_stage,        // the user has read the new stage of a tutorial: time continues
  show_stage,         // demonstration of the procedure's active stage
  end_demonstration,  // back to the learner's state
  record,             // stops recording; again: the next file begins
};
constexpr std::array<float, 4> kLiveSpeeds{1.0f, 0.5f, 0.25f, 0.1f};  // of real time

// What steers the hands of the next tick.
struct HandsMoment {
  const PictureModel& picture;
  const Snapshot& seen;
  float dt;        // [s]
  uint32_t epoch;  // a new one: the tools have jumped
  bool at_start;   // to the settled scene
};

struct LiveOptions {
  int threads = 1;             // of the solver
  std::string record;          // recording to write; empty: none. See LiveResult::recorded
  bool record_at_once = true;  // false: with the first LiveCommand::record
  bool record_or_stop = true;  // false: a recording that cannot be written ends without stopping the session
  std::string surgeon;         // as `catgut run --surgeon`; empty: the hands of hand()
  float hand_speed = 0.6f;     // [m/s] and
  float hand_turn = 12.0f;     // [rad/s] maximum of a tool: a jumping input (a mouse at a low frame rate) then tears nothing
  float pace = 1;              // of real time at full speed; above 1 for tests that need not wait
  bool start_paused = false;
  std::shared_ptr<const Procedure> procedure;  // observed tick by tick; null: none
  size_t stage = 0;       // the first one: from its saved state, or after the surgeon has done those before
  bool tutorial = false;  // time stands still at a new stage until begin_stage
  // The session is measured tick by tick, and scored by these rubrics at its end. remarks: also after every stitch and throw,
  // by the first one, see remark().
  std::vector<assess::Rubric> rubric;
  bool remarks = false;
  // Haptic devices, as read_arm_choice (runtime/haptics) reads them; empty or "off": none. Problems are reported and the scene
  // opens without. The window controls hands without a device.
  std::string haptics;
  std::string haptics_log;                  // as HapticsOptions::log
  std::array<uint8_t, 2> arm_hand{0, 1};    // tool moved by the device in the right hand, in the left; {1, 0}: left-handed
  std::array<float, 2> arm_strength{1, 1};  // gain of the force in the right hand and in the left, as HapticsOptions::strength
  // Hands that are steered tick by tick (device/paced_hands). The physics thread calls it before every tick in which the user
  // has the tools. A hand that it returns not connected is the one of hand(). Empty: hand() alone.
  std::function<std::array<ToolInput, 2>(const HandsMoment&)> hands;
  std::function<void(const std::string&)> say;  // receives lines about the devices, from any thread; empty: lines are dropped
};

struct LiveStatus {
  uint64_t tick = 0;
  double time_s = 0;      // [s] simulated
  float speed = 1;        // requested fraction of real time
  float time_factor = 0;  // real-time factor, recent; below `speed`: this machine is too slow for the scene
  float tick_ms = 0;      // computation time of a tick, recent
  uint64_t late = 0;      // dropped ticks
  bool paused = false;
  bool settling = true;       // the scene settles; hands are not connected yet
  uint32_t epoch = 0;         // counts restarts and undone bites: hands then continue from the present tool poses
  uint32_t to_take_back = 0;  // bites that take_back can undo
  uint32_t events_lost = 0;   // not fetched in time
  bool recording = false;
  std::array<uint64_t, kMaxHands> input_time_ns{};  // ToolInput::time_ns of the hands in the newest tick, for latencies
  // Of the newest tick that first used a motion, on wall_ns(), for latencies: when the motion was read (if the device uses that
  // clock), when the tick started, and when its snapshot was available.
  uint64_t moved_ns = 0, began_ns = 0, ready_ns = 0;
  std::array<bool, kMaxHands> arm{};  // a haptic device moves that hand
  std::array<ArmView, 2> arm_view{};  // of each device
  bool arms_off = false;
  SessionMetrics metrics;
  Measures measures;           // filled while watched, see watch()
  std::string doing;           // of the surgeon, if active
  bool demonstrating = false;  // the surgeon demonstrates; the previous state is restored afterward
  bool shown = false;          // the demonstration has ended, or was abandoned
  bool not_shown = false;      // the last demonstration did not reach the stage's goal from here
  bool reading = false;        // a new stage of a tutorial: nothing moves until begin_stage
  bool preparing = false;      // the surgeon carries out the stages before the first one
  bool prepared = false;       // it did: hands start where it left the tools
  ProcedureRun procedure;      // not begun: none
  std::string refused;         // the last failed change(), and why
  std::string fault;           // not empty: the run has stopped, and why
};

struct LiveResult {
  SessionMetrics metrics;
  StitchMap map;
  ProcedureRun procedure;  // not begun: none
  uint64_t ticks = 0;      // all computed ticks, undone ones included
  uint64_t state_hash = 0;
  std::vector<std::string> recorded;    // files written: a restart or an undone bite starts the next one (NAME.2.cgrec ...)
  std::vector<uint64_t> recorded_from;  // tick of the start state of each
  assess::Result assessment;            // of what the hands did; undone bites are left out
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

  // The newest pose of hand `who`, below kMaxHands. A press is not lost when the button is released before the next
  // tick.
  void hand(size_t who, const ToolInput& input);
  // The head of a headset's wearer [m, world], for the recording: the physics does not read it.
  void head(const Pose& pose);
  // Take, swap, lay down, park or unpark an instrument in the next tick. False: as below.
  bool instrument(const Command& command);
  // False: the queue is full; try again.
  bool command(LiveCommand command);
  void arm_strength(size_t side, float gain);  // of the device in the right hand (0) or the left; it changes without a step

  // For developers: "solver.damping=6" from the next tick on, as in --set; sizes and counts cannot change. The model
  // is rebuilt, which may take several ticks' time. The recording continues in another file with the new scene. False: as
  // above.
  bool change(const std::string& key_equals_value);
  void watch(bool on);  // computes measures, some microseconds per tick
  // The scripted surgeon takes the tools and demonstrates tasks of its plan (make_demonstrator). Until end_demonstration, which
  // restores the present state. Its events are not reported. slowly: at half speed.
  bool demonstrate(const std::vector<size_t>& tasks, bool slowly);

  // The current picture: the last two ticks interpolated by the elapsed time, so that it is one tick late and moves evenly at
  // any frame rate. False before the first tick.
  bool look(Snapshot& out) { return look(out, wall_seconds()); }
  bool look(Snapshot& out, double at_s);  // as of the moment `at_s` on wall_seconds(): of a headset's display grid
  const LiveStatus& status() const;       // as of the last look()
  bool event(Event& out);                 // the next event; false: none for now
  bool remark(assess::Remark& out);       // the next remark on a stitch or throw; false: none for now

  LiveResult finish();  // stops and closes the recording

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

// Toward `to` as far as a hand moves in dt [s] at no more than `speed` [m/s] and `turn` [rad/s]; the jaw at ten strokes per
// second. share: fraction of the path per call: below 1 if hand messages arrive less often than calls, so that a tool moves
// evenly and does not stop between two frames (a needle that stops springs back out of the tissue).
ToolInput hand_toward(const ToolInput& from, const ToolInput& to, float speed, float turn, float dt, float share = 1);
float hand_share(float every);  // for hands with a message every so many calls

}  // namespace catgut
