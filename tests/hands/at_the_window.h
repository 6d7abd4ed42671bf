// SPDX-License-Identifier: Apache-2.0
// tests/hands: a workstation in the window itself. The program's own loop, physics on its thread, rendering; a private X
// server, and its mouse and keyboard events (XTest), or a virtual gamepad of SDL. All waits are for observed states, so a slow
// machine only takes longer.
#pragma once
#include <SDL.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <mutex>
#include <thread>

#include "person.h"
#include "procedure/scene_file.h"
#include "render/renderer.h"
#include "sim/simulation.h"
#include "window/window.h"
#include "x_events.h"
#include "x_server.h"

namespace catgut {

using Clock = std::chrono::steady_clock;

// The image as seen by a user and, in derived classes, the device. The window runs on the thread that called sit(); the
// simulated user on another.
class AtTheWindow : public WorkQueue {
 public:
  // pace: simulated seconds per second; the user is as fast as the scene.
  explicit AtTheWindow(int seconds, const char* scene = "stay", float pace = 1)
      : scene_(scene), pace_(pace), until_(Clock::now() + std::chrono::seconds(seconds)) {
    picture_ = picture_model(*build_model(read_scene(scene)));
  }
  const PictureModel& picture() const override { return picture_; }
  const Look& look() const override { return look_; }
  size_t count(EventKind kind) const override { return happened_[static_cast<size_t>(kind)]; }
  bool act(const Act& act) override {
    do_it(act);
    return see(2);
  }
  size_t lesson_step() const { return lesson_step_; }
  const std::vector<size_t>& lesson_went() const { return lesson_went_; }  // its steps as displayed; after sit()
  // Until the lesson waits for the user.
  bool until_reading() {
    for (int i = 0; i < 30000 && !reading_; ++i)
      if (!see(1)) return false;
    return reading_;
  }
  // Until the surgeon's demonstration has started, or ended.
  bool until_showing(bool wanted) {
    for (int i = 0; i < 30000 && showing_ != wanted; ++i)  // frames that are not drawn count too
      if (!see(1)) return false;
    return showing_ == wanted && see(3);
  }
  // A user who has failed restarts.
  virtual void begin_again() = 0;
  bool restarted() {
    for (int i = 0; i < 200 && (epoch_ == begun_ || !see(1)); ++i)
      if (!see(1)) return false;
    begun_ = epoch_;
    for (auto& n : happened_) n = 0;
    return see(3);
  }

  int width = 320, height = 200;                                  // [pixels]
  std::string lesson = "first_stitch";                            // of sit(..., true); its scene is the constructor's
  const ProcedureRun& lesson_run() const { return lesson_run_; }  // after sit()
  std::function<void(PlayOptions&)> prepare;                      // changes the options of sit()
  std::function<bool()> arrive;  // what the user does before there is a field; false: the user leaves

  // Until so many more frames were drawn, on any screen. False: the window was closed.
  bool frames(size_t n) {
    std::unique_lock lock(mutex_);
    const size_t from = drawn_;
    changed_.wait(lock, [&] { return closed_ || drawn_ >= from + n; });
    return !closed_;
  }
  // The button of the costliest lost point; empty: none is in sight.
  PanelRect moment() {
    const std::lock_guard lock(mutex_);
    return moment_;
  }
  // Until a frame of this screen was drawn.
  bool shows(const std::string& screen, double seconds = 90) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::duration<double>(seconds), [&] { return closed_ || screen_ == screen; }) &&
           !closed_;
  }

  // Opens the window and performs `work`; true when it was completed within the time limit.
  bool sit(const std::function<void()>& work, bool teach = false) {
    std::thread person([&] {
      if ((!arrive || arrive()) && see(3)) work();
      gone_ = true;
    });
    PlayOptions options;
    if (teach) options.procedure = lesson, options.tutorial = true;
    else options.scene = scene_;
    options.live.pace = pace_;
    options.width = width, options.height = height;
    options.seconds = std::max(1.0, std::chrono::duration<double>(until_ - Clock::now()).count());
    options.watch = [&](const WindowLook& now) {
      const std::lock_guard lock(mutex_);
      newest_.seen = now.seen;
      newest_.view = now.view;
      newest_.steering = now.steering;
      active_ = now.mouse.active;
      epoch_ = now.status.epoch;
      lesson_step_ = now.status.procedure.stage;
      lesson_run_ = now.status.procedure;
      if (now.status.procedure.begun && (lesson_went_.empty() || lesson_went_.back() != lesson_step_))
        lesson_went_.push_back(lesson_step_);
      showing_ = now.status.demonstrating;
      reading_ = now.status.reading && !now.status.demonstrating;
      bites_ = now.status.metrics.bites;
      tick_ = now.status.tick;
      standing_ = now.status.paused || now.status.reading;
      ++pictures_;
      changed_.notify_all();
      return !gone_ && Clock::now() < until_;
    };
    options.on_frame = [&](const char* screen) {
      const std::lock_guard lock(mutex_);
      ++drawn_;
      screen_ = screen;
      moment_ = screen_ == "results" && !drawn_moments().empty() ? drawn_moments()[0] : PanelRect{};
      changed_.notify_all();
      return !gone_ && Clock::now() < until_;
    };
    options.on_event = [&](const Event& e) { ++happened_[static_cast<size_t>(e.kind)]; };
    if (prepare) prepare(options);
    const int code = play(options);
    {
      const std::lock_guard lock(mutex_);
      closed_ = true;
      changed_.notify_all();
    }
    person.join();
    return code == 0;
  }

 protected:
  virtual void do_it(const Act& act) = 0;
  // Until so many frames have passed since, and the hands have moved: the last frame includes everything before the call. While
  // time stands still, only frames count.
  bool see(size_t pictures) {
    std::unique_lock lock(mutex_);
    const size_t from = pictures_;
    const uint64_t tick = tick_;
    changed_.wait(lock, [&] {
      return closed_ || (pictures_ >= from + pictures && (tick_ >= tick + kTicksToSee || tick_ < tick || standing_)) ||
             pictures_ >= from + kFramesToSee;
    });
    const double before = look_.seen.time_s;
    look_ = newest_;
    // A stick moves on until the next picture, which may come later than this one did: the user expects it as late as the last.
    const float passed = static_cast<float>(newest_.seen.time_s - before);
    look_.dt = dt_ = std::clamp(std::max(passed, 0.5f * dt_), 0.02f, 0.25f);
    return !closed_;
  }

  // The field is hidden: the window shows another screen.
  bool stands_still() {
    std::unique_lock lock(mutex_);
    for (int i = 0; i < 20 && !closed_; ++i) {
      const size_t from = pictures_;
      if (!changed_.wait_for(lock, std::chrono::seconds(3), [&] { return closed_ || pictures_ > from; })) return true;
    }
    return false;
  }

  PictureModel picture_;
  Look look_;
  std::atomic<size_t> active_{0};
  std::atomic<uint32_t> epoch_{0};
  uint32_t begun_ = 0;
  std::atomic<size_t> lesson_step_{0};
  std::vector<size_t> lesson_went_;
  ProcedureRun lesson_run_;
  std::atomic<bool> showing_{false}, reading_{false};
  std::atomic<uint32_t> bites_{0};

 private:
  static constexpr uint64_t kTicksToSee = 3;  // a motion is read, carried out and displayed; faster than a user reacts
  static constexpr size_t kFramesToSee = 400;
  const char* scene_;
  float pace_;
  Clock::time_point until_;
  float dt_ = 0.02f;  // [s] simulated, between two pictures
  std::mutex mutex_;
  std::condition_variable changed_;
  Look newest_;
  size_t pictures_ = 0;  // of the field
  size_t drawn_ = 0;     // on all screens
  std::string screen_;
  PanelRect moment_;
  uint64_t tick_ = 0;
  bool closed_ = false, standing_ = false;
  std::atomic<bool> gone_{false};
  std::array<std::atomic<size_t>, static_cast<size_t>(EventKind::count_)> happened_{};
};

class XMouse : public AtTheWindow {
 public:
  XMouse(const std::string& display, int seconds, float pace = 1, const char* scene = "stay")
      : AtTheWindow(seconds, scene, pace), x_(display) {}
  // The server keeps what is pressed: the next window would start with a gesture under way.
  ~XMouse() override { let_go(); }
  bool ready() const { return x_.ready(); }
  void press(const std::string& key) { x_.key(key, true), x_.key(key, false); }
  // A pedal is a key: pressed until the pen has this mode, then released until it is off.
  bool pedal(const std::string& key, PenMode mode) {
    const auto until = [&](PenMode wanted) {
      for (int i = 0; i < 300; ++i) {
        PenMode now = PenMode::off;
        for (const InstrumentView& v : look_.seen.instrument) now = std::max(now, v.pen);
        if (now == wanted) return true;
        if (!see(1)) return false;
      }
      return false;
    };
    x_.key(key, true);
    const bool on = until(mode);
    x_.key(key, false);
    return until(PenMode::off) && on;
  }
  bool press_for(const std::string& key, double seconds) {
    x_.key(key, true);
    const double until = look_.seen.time_s + seconds;
    bool open = true;
    while (open && look_.seen.time_s < until) open = see(1);
    x_.key(key, false);
    return open;
  }
  // [m] between the middles of two walls.
  float walls_apart() {
    see(1);
    std::array<Vec3, 2> middle{};
    std::array<float, 2> count{};
    for (size_t i = 0; i < picture_.wall.size(); ++i) {
      const size_t wall = picture_.wall[i];
      if (wall < 2) middle[wall] += look_.seen.particle[i], ++count[wall];
    }
    return distance(middle[0] / count[0], middle[1] / count[1]);
  }
  // A click on a panel. [pixels] of the X server's screen, from its corner. The pointer rests until each of its states was
  // drawn.
  bool click_at(int x, int y) {
    x_.motion(-5000, -5000), x_.motion(x, y);
    if (!frames(2)) return false;
    x_.button(1, true);
    const bool held = frames(2);
    x_.button(1, false);
    return held && frames(2);
  }
  void begin_again() override {
    let_go();
    press("F5");
  }

 private:
  void let_go() {
    if (turn_) x_.button(3, turn_ = false);
    if (both_) x_.key("w", both_ = false);
  }
  void do_it(const Act& act) override {
    for (int i = 0; reading_ && i < 40; ++i) {  // a new stage
      if (i % 8 == 0) press("Return");
      if (!see(1)) return;
    }
    for (int i = 0; act.hand != active_ && i < 40; ++i) {
      if (i % 8 == 0) x_.key("Tab", true), x_.key("Tab", false);
      if (!see(1)) return;
    }
    const MouseInput in = by_mouse(act, look_, 1);
    if (turn_ != in.turn) x_.button(3, turn_ = in.turn), see(2);  // before the mouse moves: its meaning changes
    if (both_ != in.both) x_.key("w", both_ = in.both), see(2);
    for (float right = in.right, down = in.down; right != 0 || down != 0;) {
      // The pointer is recentered: no step may be so long that it reaches the edge of the screen.
      const float x = std::clamp(right, -50.0f, 50.0f), y = std::clamp(down, -50.0f, 50.0f);
      x_.motion(static_cast<int>(x), static_cast<int>(y));
      right -= x, down -= y;
    }
    const int notches = std::clamp(static_cast<int>(in.wheel), -12, 12);
    for (int i = 0; i < std::abs(notches); ++i) click(notches > 0 ? 4 : 5);
    if (in.jaw_presses) click(1);
    if (in.cut) press("c");
    if (in.fresh) press("n");
    if (act.next) press("i");
    if (act.park) press("k");
    if (act.orbit != 0) {
      const std::string arrow = act.orbit > 0 ? "Right" : "Left";
      x_.key(arrow, true);
      see(1);
      x_.key(arrow, false);
    }
  }
  void click(unsigned which) { x_.button(which, true), x_.button(which, false); }

  XEvents x_;
  bool turn_ = false, both_ = false;
};

// A virtual gamepad of SDL: it connects, is opened and read like a real one.
class SdlPad : public AtTheWindow {
 public:
  using AtTheWindow::AtTheWindow;
  bool plug_in() {
    SDL_LockJoysticks();
    index_ = SDL_JoystickAttachVirtual(SDL_JOYSTICK_TYPE_GAMECONTROLLER, SDL_CONTROLLER_AXIS_MAX, SDL_CONTROLLER_BUTTON_MAX, 1);
    stick_ = index_ < 0 ? nullptr : SDL_JoystickOpen(index_);
    pad_ = {};
    if (stick_) send(pad_);
    SDL_UnlockJoysticks();
    return stick_ && see(3);
  }
  void tap(SDL_GameControllerButton which) {
    for (const bool down : {true, false}) {
      SDL_LockJoysticks();
      SDL_JoystickSetVirtualButton(stick_, which, down);
      SDL_UnlockJoysticks();
      see(3);
    }
  }
  // The window pauses; true when it did.
  bool pull_out() {
    SDL_LockJoysticks();
    SDL_JoystickClose(stick_);
    SDL_JoystickDetachVirtual(index_);
    SDL_UnlockJoysticks();
    stick_ = nullptr;
    const bool paused = stands_still();
    press(SDLK_ESCAPE);
    return see(3) && paused;
  }
  void begin_again() override {
    pad_ = {};
    send(pad_);
    see(3);
    press(SDLK_F5);  // there is no button for it
  }

  static void press(SDL_Keycode key) {  // of the keyboard
    SDL_Event e{};
    e.type = SDL_KEYDOWN;
    e.key.keysym.sym = key;
    SDL_PushEvent(&e);
  }

 private:
  void do_it(const Act& act) override {
    if (!stick_) return;
    send(by_pad(act, look_, pad_));
    if (act.next) tap(SDL_CONTROLLER_BUTTON_DPAD_UP);
    if (act.park) tap(SDL_CONTROLLER_BUTTON_DPAD_DOWN);
    if (act.orbit != 0) hold(act.orbit > 0 ? SDL_CONTROLLER_BUTTON_DPAD_RIGHT : SDL_CONTROLLER_BUTTON_DPAD_LEFT);
  }
  void hold(SDL_GameControllerButton which) {  // for a picture
    for (const bool down : {true, false}) {
      SDL_LockJoysticks();
      SDL_JoystickSetVirtualButton(stick_, which, down);
      SDL_UnlockJoysticks();
      if (down) see(1);
    }
  }
  void send(const GamepadInput& pad) {
    const auto axis = [&](int which, float value) {
      SDL_JoystickSetVirtualAxis(stick_, which, static_cast<Sint16>(std::clamp(value, -1.0f, 1.0f) * 32767));
    };
    const auto button = [&](int which, bool down) { SDL_JoystickSetVirtualButton(stick_, which, down); };
    axis(SDL_CONTROLLER_AXIS_LEFTX, pad.left.x), axis(SDL_CONTROLLER_AXIS_LEFTY, pad.left.y);
    axis(SDL_CONTROLLER_AXIS_RIGHTX, pad.right.x), axis(SDL_CONTROLLER_AXIS_RIGHTY, pad.right.y);
    // A trigger rests at the low end of its axis.
    axis(SDL_CONTROLLER_AXIS_TRIGGERLEFT, 2 * pad.left.trigger - 1);
    axis(SDL_CONTROLLER_AXIS_TRIGGERRIGHT, 2 * pad.right.trigger - 1);
    button(SDL_CONTROLLER_BUTTON_LEFTSHOULDER, pad.left.shoulder);
    button(SDL_CONTROLLER_BUTTON_RIGHTSHOULDER, pad.right.shoulder);
    button(SDL_CONTROLLER_BUTTON_B, pad.both);
    button(SDL_CONTROLLER_BUTTON_A, pad.cut), button(SDL_CONTROLLER_BUTTON_Y, pad.fresh);
  }
  GamepadInput pad_;
  int index_ = -1;
  SDL_Joystick* stick_ = nullptr;
};

// Grasps the needle, sutures both bowel ends, pulls the thread through, approximates, ties. False: it stopped at me.doing().
inline bool sew_and_tie_once(AtTheWindow& desk, Person& me, int throws, bool cut) {
  const auto sewn = [&] { return desk.count(EventKind::bite_completed) >= 2; };
  return me.take_needle() && me.bite() && (sewn() || (me.hand_back() && me.bite())) && me.pull_tail(0.08f) &&
         me.draw_together() && me.tie(1) && (throws < 2 || me.tie(-1)) && (!cut || me.cut_needle());
}

class StitchAtTheWindow : public testing::Test {
 protected:
  void SetUp() override {
    if (!renderer_available()) GTEST_SKIP() << "no EGL driver here";
    for (const char* program : {"Xvfb", "xdotool"})
      if (!on_path(program)) GTEST_SKIP() << program << " is missing (Debian: apt install xvfb xdotool)";
    x_ = std::make_unique<XServer>();
    if (x_->display.empty()) GTEST_SKIP() << "Xvfb does not start here";
    setenv("DISPLAY", x_->display.c_str(), 1);
    setenv("SDL_VIDEODRIVER", "x11", 1);
    signal(SIGPIPE, SIG_IGN);
  }
  std::unique_ptr<XServer> x_;
};

}  // namespace catgut
