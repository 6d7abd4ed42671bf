// SPDX-License-Identifier: Apache-2.0
// app/xr: the wearer of a headset in the window's loop: place, hands, board, vibration, budget. The window asks it once per
// frame and passes the hands to the simulation as those of any device.
#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "runtime/live.h"
#include "xr/fade.h"
#include "xr/headset.h"
#include "xr/labels.h"
#include "xr/register.h"

namespace catgut::xr {

struct WearerOptions {
  SpaceHandOptions hands;
  std::string font;
  std::string room_file, room = "room";  // kept between sessions; empty: nothing is kept
  bool whole_resolution = false;         // as HeadsetOptions
  bool register_arms = false;            // the cut button notes a point where a controller touches an arm's stylus
  std::function<void(const std::string&)> report;
};

// What the wearer asked for by buttons since the last frame.
struct WearerWish {
  bool pause = false;          // pause, or resume
  std::array<bool, 2> swap{};  // per tool: the next instrument from the tray
};

// For an observer (a test): the frame that was submitted last.
struct WearerLook {
  HeadsetState state = HeadsetState::off;
  HeadsetFrame frame;
  Place place;
  Board board;
  std::optional<std::array<float, 2>> pointer;  // [pixels] of the board where a ray points
  float brightness = 0;                         // 0: black, 1: no fade
  HeadsetCounts counts;
  std::array<Vibration, 2> vibration;             // per tool, of this frame
  const std::array<Image, 2>* picture = nullptr;  // of both eyes, if it was requested
};

class Wearer {
 public:
  explicit Wearer(const WearerOptions& options);
  ~Wearer();  // keeps the room's settings
  Wearer(const Wearer&) = delete;
  Wearer& operator=(const Wearer&) = delete;

  // First in every frame of the window: handles the runtime's events and waits for its next frame. True: a frame is open and
  // draw() must follow.
  bool begin();
  bool in_use() const { return headset_.state() == HeadsetState::focused; }
  bool busy() const { return headset_.counts().work_ms > 0.6e-6f * static_cast<float>(frame_.period_ns); }
  bool failed() const { return headset_.failed(); }
  HeadsetState state() const { return headset_.state(); }

  // model: of the scene or recording that is shown; null: none. It must outlive the next call.
  void stage(const PictureModel* model, Quality quality);
  // [s] on wall_seconds(): the moment that the next picture should show, on the runtime's even grid of display times. The
  // interval to the display is constant, so that motion is even although frames start at uneven times.
  double moment() const { return moment_; }

  // Hands per tool while the wearer has the controls; none: the window's hands apply.
  // arm: hands that a haptic arm moves; the arms' registration then places the field.
  std::optional<std::array<ToolInput, 2>> hands(const Snapshot& seen, const SpaceHandOptions& options, std::array<bool, 2> arm);
  void jumped(const Snapshot& seen) { resume(hands_, seen); }
  void feel(const Event& event) { event_.push_back(event); }
  WearerWish wish() { return std::exchange(wish_, {}); }
  // Head pose in the world, and whether it is known: for the recording.
  bool head(Pose& out) const;
  // What the window's mirror shows: the left eye.
  std::optional<Camera> mirror() const;

  struct Picture {
    const Snapshot* snapshot = nullptr;
    bool working = false;  // the hands hold instruments: the board stands beside the field and cannot be pointed at
    bool walk = false;     // results or a replay: a hand with the clutch pressed takes hold of the field and carries it
    bool suture_points = false;
    std::span<const StitchMark> stitch;  // labels of results and replays
    std::function<void()> panels;
    std::array<float, 4> caption{};      // [pixels] part of the board that is shown near the work; empty: none
    const LiveStatus* status = nullptr;  // for the budget; null: none
    bool copy = false;
  };
  void draw(const Picture& picture);
  const WearerLook& look() const { return look_; }
  void leave() { headset_.leave(); }
  // One line for a panel: state, frames and late frames, resolution.
  std::string status_line() const;
  // Motion-to-photon budget and late pictures as a table on standard error.
  void report_budget() const;

 private:
  void buttons(float dt);
  void carry_field();
  void settle_place();
  void touch(const Snapshot& seen, std::array<bool, 2> arm);
  void report(const std::string& line) const {
    if (given_.report) given_.report(line);
  }
  void point(EyeRenderer::Frame& frame, const Board& board);

  WearerOptions given_;
  Headset headset_;
  HeadsetFrame frame_;
  Place place_, stand_;  // of the field; where the wearer was placed, for the boards
  bool placed_ = false, open_ = false, walk_ = false;
  std::optional<Pose> carried_;  // room: the hand that holds the field, in the last frame
  size_t carrier_ = 0;
  int board_turn_ = 0;  // [quarters] see walked_stand
  SpaceHands hands_;
  SpaceHandOptions options_;
  RoomSettings room_;
  std::vector<Vec3> touched_room_, touched_world_;  // [m] points of the registration
  bool touch_was_ = false, arms_ = false;
  VibrationState vibration_;
  std::vector<Event> event_;
  WearerWish wish_;
  WearerLook look_;
  std::array<Image, 2> picture_;
  const PictureModel* model_ = nullptr;
  double began_ = 0, before_ = 0, moment_ = 0;  // [s]
  float dt_ = 1.0f / 60, lead_ = 0, menu_held_ = 0;
  Fade fade_;
  bool recenter_wanted_ = false;
  int loupe_wanted_ = 0;  // steps; both are done in a black frame
  bool menu_used_ = false;
  std::array<bool, 2> swap_was_{};
  bool flick_was_ = false, panels_drawn_ = false;
  size_t pointer_ = 1;  // side of the hand that points
  uint64_t moved_ns_ = 0;
  std::vector<float> to_tick_, in_tick_, to_submit_, to_photon_, all_;  // [ms]
};

}  // namespace catgut::xr
