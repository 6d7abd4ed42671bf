// SPDX-License-Identifier: Apache-2.0
// runtime: the interior of Live, for live.cpp (ticks and time) and live_procedure.cpp (stages and demonstrations). Comments
// state which of the two threads may use Work's members.
#pragma once
#include <atomic>
#include <chrono>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "assess/facts.h"
#include "exchange/latest.h"
#include "exchange/ring.h"
#include "runtime/force_curves.h"
#include "runtime/hands.h"
#include "runtime/haptics.h"
#include "runtime/live.h"
#include "runtime/session.h"
#include "sim/recording.h"
#include "sim/simulation.h"

namespace catgut {

using Clock = std::chrono::steady_clock;

// Everything needed to continue from a moment with identical results.
struct Moment {
  std::vector<std::byte> state;
  HandInputs hand;
  SessionMetrics metrics;
  ProcedureRun procedure;
  assess::Tally tally;
};

struct BiteMoment {
  uint32_t bite = 0;
  Moment before;
};

// Tasks of the surgeon's plan, in a fixed-size box for the command queue.
struct Demonstration {
  std::array<uint8_t, 6> task{};
  uint8_t tasks = 0;
  bool slowly = false;
};

struct Request {
  LiveCommand what{};
  bool demonstrate = false;
  Demonstration of;
};

struct HandMessage {
  ToolInput input = no_hand();
  uint32_t epoch = 0;  // epoch known to the sender
};

struct LiveView {
  Snapshot before, now;
  Clock::time_point at;    // when `now` was ready
  double tick_wall_s = 1;  // between two ticks, at this speed
  LiveStatus status;
  bool any = false;
};

struct Live::Work {
  // --- set before the thread starts, constant after ----------------------------------------------------------------------
  LiveOptions options;
  PictureModel picture;
  double dt = 0;

  // --- shared by the threads ---------------------------------------------------------------------------------------------
  std::array<Latest<HandMessage>, kMaxHands> hand_box;     // window -> physics
  std::array<std::atomic<uint32_t>, kMaxHands> pressed{};  // both: buttons pressed since the last tick
  Ring<Request, 64> requests;                              // window -> physics
  Ring<Command, 64> orders;                                // window -> physics: commands of the hands
  Ring<std::string, 16> changes;                           // window -> physics
  std::atomic<bool> quit{false};                           // window -> physics
  std::atomic<bool> watched{false};                        // window -> physics
  Latest<Pose> head_box;                                   // window -> physics
  Latest<LiveView> view_box;                               // physics -> window
  Ring<Event, 1024> events;                                // physics -> window
  Ring<assess::Remark, 64> remarks;                        // physics -> window
  std::thread thread;

  // --- owned by the window -----------------------------------------------------------------------------------------------
  LiveStatus status;
  std::array<uint32_t, kMaxHands> buttons{};

  // --- owned by the physics thread ---------------------------------------------------------------------------------------
  SceneSpec scene;
  std::shared_ptr<const Model> model;
  StatePtr state;
  std::unique_ptr<Jobs> jobs;
  Hands surgeon;
  std::unique_ptr<Recorder> recorder;
  std::unique_ptr<Haptics> haptics;  // null: no devices
  bool as_paper = false;             // devices use the paper's spring
  bool arms_drove = false;           // state in the last patch, and
  uint32_t handovers = 0;            // number of its changes
  PaperSpring paper;
  LiveResult result;
  TickInput input;
  std::array<uint32_t, kMaxHands> arm_buttons{};         // down in the last tick
  std::array<int, kMaxHands> unheard{};                  // [ticks] since the last message of a hand, and
  std::array<float, kMaxHands> heard_every{1, 1, 1, 1};  // [ticks] recent interval of its messages
  Snapshot before, now;
  LiveStatus published;
  StitchMap map, learner_map;
  assess::Facts facts;
  Moment settled, learner;
  uint64_t settled_tick = 0;
  std::vector<std::optional<Moment>> stage_begin;  // of the stages from which a later one is demonstrated
  Hands demonstrator;
  ProcedureRun demonstrated;  // of the demonstration
  uint32_t demo_stage = 0;    // that it shows
  size_t learner_speed = 0;   // of kLiveSpeeds
  double shown_for = 0;       // [s] wall time since it has ended
  std::deque<BiteMoment> bites;
  std::array<std::optional<Moment>, 2> checkpoint;                    // the newest and the previous one
  uint64_t checkpoint_every = 1;                                      // [ticks]
  size_t speed = 0;                                                   // of kLiveSpeeds
  int steps = 0;                                                      // requested single steps
  double wall_s = 0, simulated_s = 0, spent_s = 0, ticks_weight = 0;  // recent, with exponential weights

  void begin();
  void run();
  void main_loop();
  void process_commands();
  void tick(bool let_in);
  void feel();
  bool arms_drive() const;
  void rest_arms();
  void publish_view();
  void go_back(const Moment& to);
  void change_scene(const std::string& key_equals_value);
  void demonstrate(const Demonstration& what);
  void show_stage();
  void end_demonstration();
  void prepare();
  void observe();
  void begin_assessment();
  void assess_tick();
  void finish_assessment();
  void remember_stage();
  void record_from_here();
  double period() const { return dt / static_cast<double>(kLiveSpeeds[speed] * options.pace); }  // [s] wall time of a tick
  void forget_pace() { wall_s = simulated_s = 0; }
  size_t hand_of(size_t arm) const { return options.arm_hand[haptics->side(arm)]; }
  // The device that moves a hand, -1: none.
  int arm_of(size_t hand) const {
    for (size_t arm = 0; haptics && arm < 2; ++arm)
      if (haptics->present(arm) && hand_of(arm) == hand) return static_cast<int>(arm);
    return -1;
  }
  Moment moment() const { return {save_state(*model, *state), input.hand, published.metrics, published.procedure, facts}; }
};

}  // namespace catgut
