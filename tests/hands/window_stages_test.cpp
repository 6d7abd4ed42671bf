// SPDX-License-Identifier: Apache-2.0
// tests/hands: the stages of an operation in the window itself: by events of the X server, by a virtual gamepad, by simulated
// haptic devices. All waits are for observed states. stages_test has the same in lock step, to the end of each stage.
#ifdef CATGUT_TESTS_WINDOW
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "../device/fake_hd/load.h"
#include "at_the_window.h"
#include "device/wall_spot.h"
#include "render/smoke.h"
#include "runtime/session.h"
#include "sim/recording.h"
#include "window/sound.h"

namespace catgut {
namespace {
namespace fs = std::filesystem;

constexpr float kLine = 0.025f;                            // [m] from the rim, in scene altemeier
constexpr float kFrom = -0.5f * kPi, kTo = kFrom + 0.35f;  // [rad] of a stroke toward the user: 5 mm

// Cutting and coagulation are distinct by ear; neither begins nor ends with a click.
TEST(PenTone, has_the_pitch_of_its_mode_and_fades) {
  PenTone tone;
  std::vector<float> s(kSoundRate / 10);
  for (const PenMode mode : {PenMode::cut, PenMode::coagulate}) {
    tone.fill(s, mode);
    float step = std::abs(s[0]);
    for (size_t i = 1; i < s.size(); ++i) step = std::max(step, std::abs(s[i] - s[i - 1]));
    tone.fill(s, mode);
    size_t rising = 0;
    for (size_t i = 1; i < s.size(); ++i) rising += s[i - 1] < 0 && s[i] >= 0;
    EXPECT_NEAR(static_cast<float>(rising) * 10, tone_of(mode), 10);
    EXPECT_LT(step, 0.03f) << "a click";
    tone.fill(s, PenMode::off);
    EXPECT_EQ(s.back(), 0);
  }
}

// Only while the tip burns tissue; the same from the same Snapshot.
TEST(Smoke, rises_from_a_tip_that_burns) {
  Snapshot seen;
  seen.time_s = 10, seen.instrument.resize(1);
  InstrumentView& pen = seen.instrument[0];
  pen.pose.p = {0.01f, 0.02f, 0.03f};
  std::vector<Puff> puff, again;
  smoke_of(seen, puff);
  EXPECT_TRUE(puff.empty());
  pen.pen = PenMode::cut;
  smoke_of(seen, puff);
  EXPECT_TRUE(puff.empty()) << "in the air";
  pen.burning = 5;
  smoke_of(seen, puff);
  smoke_of(seen, again);
  ASSERT_GT(puff.size(), 10u);
  ASSERT_EQ(puff.size(), again.size());
  for (size_t i = 0; i < puff.size(); ++i) {
    EXPECT_EQ(puff[i].at.y, again[i].at.y);
    EXPECT_GE(puff[i].at.y, pen.pose.p.y);
    EXPECT_LT(distance(puff[i].at, pen.pose.p), 0.06f);
  }
}

// A clamp from the tray, closed on the rim and parked; then the pen, one stroke, and it is laid down.
bool clamp_and_score(Person& me) {
  return me.take_instrument(0, "allis") && me.grasp_rim(0, 0) && me.park(0) && me.carry(0, {0.02f, 0.05f, 0}) &&
         me.take_instrument(0, "cautery") && me.score(0, kLine, kFrom, kTo) && me.lay_down(0);
}

void expect_clamp_and_score(const AtTheWindow& desk) {
  EXPECT_EQ(desk.count(EventKind::instrument_parked), 1u);
  EXPECT_GE(desk.count(EventKind::pen_activated), 1u);
  EXPECT_EQ(desk.count(EventKind::pen_activated), desk.count(EventKind::pen_deactivated));
  EXPECT_GE(desk.count(EventKind::wall_scored) + desk.count(EventKind::wall_cut_through), 1u);
  EXPECT_GE(desk.count(EventKind::instrument_laid_down), 1u);
}

TEST_F(StitchAtTheWindow, a_clamp_and_the_pen_by_mouse_and_keyboard) {
  XMouse desk(x_->display, 400, 1, "altemeier");
  if (!desk.ready()) GTEST_SKIP() << "no XTest here";
  Person me(desk);
  bool done = false, by_pedal = false;
  desk.sit([&] {
    done = clamp_and_score(me) && me.take_instrument(0, "cautery");
    if (done) by_pedal = desk.pedal("F8", PenMode::coagulate) && desk.pedal("F7", PenMode::cut);
  });
  EXPECT_TRUE(done) << me.doing();
  EXPECT_TRUE(by_pedal) << "on while it is pressed, off when it is released";
  expect_clamp_and_score(desk);
}

// The clamps move by 4 mm/s. Both ends are free, and so go where their clamps go.
TEST_F(StitchAtTheWindow, an_assistant_brings_clamped_ends_together_and_draws_them_apart) {
  XMouse desk(x_->display, 200, 1, "interrupted_tied");
  if (!desk.ready()) GTEST_SKIP() << "no XTest here";
  float before = 0, together = 0, apart = 0;
  bool pressed = false;
  desk.sit([&] {
    before = desk.walls_apart();
    pressed = desk.press_for("F4", 0.5);
    together = desk.walls_apart();
    pressed = pressed && desk.press_for("F6", 1);
    apart = desk.walls_apart();
  });
  EXPECT_TRUE(pressed);
  EXPECT_LT(together, before - 1e-3f);
  EXPECT_GT(apart, together + 2e-3f);
}

TEST_F(StitchAtTheWindow, a_clamp_and_the_pen_by_gamepad) {
  SdlPad desk(400, "altemeier");
  Person me(desk);
  bool done = false;
  desk.sit([&] { done = desk.plug_in() && clamp_and_score(me); });
  EXPECT_TRUE(done) << me.doing();
  expect_clamp_and_score(desk);
}

// The end of a bowel is cut off, held by the forceps in the other hand. Minutes, so for the nightly tests.
TEST_F(StitchAtTheWindow, an_end_is_cut_off_and_carried_away_by_mouse) {
  if (!std::getenv("CATGUT_LONG")) GTEST_SKIP() << "set CATGUT_LONG=1";
  XMouse desk(x_->display, 900, 1, "excision");
  if (!desk.ready()) GTEST_SKIP() << "no XTest here";
  Person me(desk);
  bool done = false;
  desk.sit([&] { done = me.grasp_rim(1, kPi) && me.cut_round(0, 0.006f) && me.carry(1, {-0.10f, 0.06f, 0}); });
  EXPECT_TRUE(done) << me.doing();
  EXPECT_GE(desk.count(EventKind::piece_freed), 1u);
  EXPECT_EQ(desk.count(EventKind::technique_fault), 0u);
}

TEST_F(StitchAtTheWindow, an_end_is_cut_off_and_carried_away_by_gamepad) {
  if (!std::getenv("CATGUT_LONG")) GTEST_SKIP() << "set CATGUT_LONG=1";
  SdlPad desk(900, "excision", 0.25f);  // slow: the stick moves on between two pictures
  Person me(desk);
  bool done = false;
  desk.sit([&] {
    done = desk.plug_in() && me.grasp_rim(1, kPi) && me.cut_round(0, 0.006f) && me.carry(1, {-0.10f, 0.06f, 0});
  });
  EXPECT_TRUE(done) << me.doing();
  EXPECT_GE(desk.count(EventKind::piece_freed), 1u);
  EXPECT_EQ(desk.count(EventKind::technique_fault), 0u);
}

TEST_F(StitchAtTheWindow, scissors_cut_by_mouse) {
  XMouse desk(x_->display, 300, 1, "slit");
  if (!desk.ready()) GTEST_SKIP() << "no XTest here";
  Person me(desk);
  bool done = false;
  desk.sit([&] { done = me.snip(0, kFrom, 0.008f); });
  EXPECT_TRUE(done) << me.doing();
  EXPECT_GE(desk.count(EventKind::tissue_snipped), 1u);
}

// Report and recording of an operation that is left in its first stage.
class AbortedFiles {
 public:
  AbortedFiles() { fs::create_directories(folder_); }
  ~AbortedFiles() { fs::remove_all(folder_); }
  void write(PlayOptions& options) const {
    options.tutorial = false;
    options.json = json_, options.live.record = recording_, options.live.record_at_once = true;
  }
  // The report says how far it came; the recording has all of it, and its replay comes to the same state.
  void expect_first_stage_and_the_same_replay(size_t clamps) const {
    const nlohmann::json report = nlohmann::json::parse(std::ifstream(json_));
    EXPECT_EQ(report["procedure"]["finished"], false);
    EXPECT_EQ(report["procedure"]["stages"][0]["name"], "clamp");
    EXPECT_EQ(report["procedure"]["stages"][0]["state"], "active");
    EXPECT_EQ(report["procedure"]["stages"][1]["state"], "waiting");
    const Recording recording = read_recording(recording_);
    EXPECT_FALSE(recording.truncated) << recording.fault;
    size_t held = 0;
    SessionHooks hooks;
    hooks.on_tick = [&](const Snapshot& seen, const std::string&) {
      held = 0;
      for (const InstrumentView& i : seen.instrument) held += i.held == Held::tissue;
    };
    const ReplayResult again = replay_session(recording, recording_, true, 1, hooks);
    EXPECT_FALSE(again.differs_at) << "tick " << again.differs_at.value_or(0);
    EXPECT_EQ(held, clamps);
  }

 private:
  fs::path folder_ = fs::path(testing::TempDir()) / ("catgut_aborted_" + std::to_string(getpid()));
  std::string json_ = (folder_ / "report.json").string(), recording_ = (folder_ / "session.cgrec").string();
};

// F10 in the middle of the first stage, a clamp in the hand and one parked.
TEST_F(StitchAtTheWindow, an_aborted_operation_is_reported_and_recorded) {
  XMouse desk(x_->display, 400, 1, "altemeier");
  if (!desk.ready()) GTEST_SKIP() << "no XTest here";
  const AbortedFiles files;
  desk.lesson = "altemeier";
  desk.prepare = [&](PlayOptions& options) { files.write(options); };
  Person me(desk);
  bool done = false, left = false;
  size_t parked = 0;
  desk.sit(
      [&] {
        done = me.take_instrument(0, "allis") && me.grasp_rim(0, 0) && me.park(0) && me.carry(0, {0.02f, 0.05f, 0}) &&
               me.take_instrument(0, "allis") && me.grasp_rim(0, 0.5f * kPi);
        parked = desk.count(EventKind::instrument_parked);
        desk.press("F10");
        left = desk.shows("results");
      },
      true);
  ASSERT_TRUE(done) << me.doing();
  EXPECT_TRUE(left);
  EXPECT_EQ(parked, 1u);
  files.expect_first_stage_and_the_same_replay(2);  // the parked clamp, and the one in the hand
}

TEST_F(StitchAtTheWindow, an_operation_by_gamepad_is_aborted_reported_and_recorded) {
  SdlPad desk(400, "altemeier");
  const AbortedFiles files;
  desk.lesson = "altemeier";
  desk.prepare = [&](PlayOptions& options) { files.write(options); };
  Person me(desk);
  bool done = false, left = false;
  desk.sit(
      [&] {
        done = desk.plug_in() && me.take_instrument(0, "allis") && me.grasp_rim(0, 0) && me.park(0);
        SdlPad::press(SDLK_F10);
        left = desk.shows("results");
      },
      true);
  ASSERT_TRUE(done) << me.doing();
  EXPECT_TRUE(left);
  files.expect_first_stage_and_the_same_replay(1);
}

constexpr float kBeside = -0.25f * kPi;  // [rad] between the clamps at 6 and 3 o'clock
// The surgeon has secured the prolapse before the user sits down: the second stage begins with its four clamps.
void begin_at_the_cut(PlayOptions& options) { options.tutorial = false, options.stage = "cut"; }
size_t clamps_on_the_rim(const Snapshot& seen) {
  size_t n = 0;
  for (const InstrumentView& i : seen.instrument) n += i.place == InstrumentPlace::parked && i.held == Held::tissue;
  return n;
}
bool score_between_clamps(Person& me) {
  constexpr float kBesideClamp = 0.5f;  // [rad]
  return me.carry(0, {0.02f, 0.05f, 0}) && me.take_instrument(0, "cautery") &&
         me.score(0, kLine, kFrom + kBesideClamp, kTo + kBesideClamp);
}
void expect_a_cut(const AtTheWindow& desk, size_t clamps) {
  EXPECT_EQ(clamps, 4u);
  EXPECT_EQ(desk.lesson_run().stage, 1u) << "clamp, cut";
  EXPECT_GE(desk.count(EventKind::wall_scored) + desk.count(EventKind::wall_cut_through), 1u);
}

// A user with a stylus in the right hand sees how far the tool is from where it should be, and moves on.
class Stylus {
 public:
  Stylus(AtTheWindow& desk, const FakeHd& arm) : desk_(desk), arm_(arm), wish_(arm.position(0)) {}
  const Snapshot& seen() const { return desk_.look().seen; }
  bool until(const std::function<bool()>& done, double patience = 10) {  // [s] simulated
    const double from = seen().time_s;
    while (!done())
      if (seen().time_s > from + patience || !desk_.act({})) return done();
    return true;
  }
  bool go(const std::function<Pose()>& to, float near) {
    double moved = -1;
    return until([&] {
      const Pose goal = to();
      const Vec3 off = goal.p - seen().tool[0].hand.p;
      if (length(off) < near && distance(seen().tool[0].pose.p, goal.p) < near) return true;
      // The arm needs its time to follow: who corrects sooner swings.
      if (seen().time_s < moved + kReaction) return false;
      moved = seen().time_s;
      wish_ += off * (0.6f * std::min(1.0f, 0.02f / std::max(length(off), 1e-6f)));
      turn_ = goal.q;
      arm_.wish(0, wish_, turn_, 0);
      return false;
    });
  }
  // As go(), of the hand alone: what it holds is held back by the tissue.
  bool hand_to(const std::function<Pose()>& to, float near) {
    double moved = -1;
    return until([&] {
      const Vec3 off = to().p - seen().tool[0].hand.p;
      if (length(off) < near) return true;
      if (seen().time_s < moved + kReaction) return false;
      moved = seen().time_s;
      wish_ += off * (0.6f * std::min(1.0f, 0.02f / length(off)));
      arm_.wish(0, wish_, turn_, 0);
      return false;
    });
  }
  // Until `done`: buttons as the devices have them, 1 the jaw's, 2 beside it; pressed so many times in half a second.
  bool press(int button, int times, const std::function<bool()>& done) {
    for (int attempt = 0; attempt < 5; ++attempt) {  // a double press may come late where the machine is late
      for (int i = 0; i < times; ++i) press_once(button);
      if (until(done, 2)) return true;
    }
    return false;
  }
  // Who closes the jaws on nothing opens them again and goes one millimeter deeper: a late machine leaves them short.
  bool grasp(const std::function<Pose()>& to) {
    const auto held = [&] { return seen().tool[0].held == Held::tissue; };
    for (int deeper = 0; deeper < 4; ++deeper) {
      const auto goal = [&] {
        Pose p = to();
        p.p += rotate(p.q, {0, 0, -0.001f * static_cast<float>(deeper)});
        return p;
      };
      if (!go(goal, 0.0025f)) return false;
      press_once(1);
      if (until(held, 2)) return true;
      press_once(1);
      if (!until([&] { return seen().tool[0].jaw > 0.95f; }, 2)) return false;
    }
    return false;
  }

 private:
  static constexpr double kReaction = 0.05;  // [s] simulated
  void press_once(int button) {
    for (const int down : {button, 0}) {
      arm_.wish(0, wish_, turn_, down);
      std::this_thread::sleep_for(std::chrono::milliseconds(60));
    }
  }
  AtTheWindow& desk_;
  const FakeHd& arm_;
  Vec3 wish_;
  Quat turn_;
};

// Two simulated arms at a window; the right one has the stylus. The first action that does not succeed is remembered.
class AtTheArms {
 public:
  AtTheArms(const std::string& display, const char* scene) : desk(display, 500, 1, scene) {
    desk.prepare = [](PlayOptions& options) { connect(options); };
  }
  static void connect(PlayOptions& options) {
    options.live.haptics = "touch";
    options.live.say = [](const std::string&) {};
  }
  void sit(const std::function<void(Stylus&)>& work, bool teach = false) {
    desk.sit(
        [&] {
          Stylus me(desk, fake_);
          work(me);
        },
        teach);
  }
  bool step(const char* what, bool done) {
    if (!done && stopped_at.empty()) stopped_at = what;
    return done;
  }
  // A place of the rim, in this direction from its middle, and `down` [m] below it.
  Vec3 on_rim(const Stylus& me, Vec3 direction, float down) const {
    const std::vector<uint32_t>& rim = desk.picture().rim[0];
    const uint32_t found = *std::max_element(rim.begin(), rim.end(), [&](uint32_t a, uint32_t b) {
      return dot(desk.picture().particle_rest[a], direction) < dot(desk.picture().particle_rest[b], direction);
    });
    return me.seen().particle[found] - Vec3{0, down, 0};
  }
  Vec3 at_front(const Stylus& me, float down) const { return on_rim(me, {0, 0, 1}, down); }
  Pose jaws(const Stylus& me, float above) const {
    Pose p = jaws_at(*rim_beside(desk.look().view, at_front(me, 0), 0.01f, desk.picture(), me.seen()));
    p.p += rotate(p.q, {0, 0, above});
    return p;
  }
  bool take(Stylus& me, const char* kind) {
    const auto instrument = [&] { return me.seen().tool[0].instrument; };
    for (int i = 0; i < 8; ++i) {
      if (instrument() >= 0 && desk.picture().instrument[static_cast<size_t>(instrument())].kind == kind) return true;
      const int before = instrument();
      desk.press("i");
      if (!me.until([&] { return instrument() != before; })) return false;
    }
    return false;
  }
  bool clamp_the_rim(Stylus& me) {
    return step("take a clamp", take(me, "allis")) && step("over the rim", me.go([&] { return jaws(me, 0.03f); }, 0.004f)) &&
           step("close on the rim", me.grasp([&] { return jaws(me, 0); }));
  }
  bool park(Stylus& me) {
    desk.press("k");
    return step("park it", me.until([&] { return me.seen().tool[0].instrument < 0; }));
  }

  // The pen, 4 mm along the line, on and off.
  bool score(Stylus& me, Vec3 direction = {0, 0, 1}) {
    float along = 0, above = 0.02f;
    const auto tip = [&] {
      const Vec3 place = on_rim(me, direction, kLine) + Vec3{direction.z, 0, -direction.x} * along;
      const auto spot = wall_under(desk.look().view, place, desk.picture(), me.seen());
      return spot ? tip_on(*spot, above) : Pose{place, {}};
    };
    const auto pen = [&] { return me.seen().instrument[static_cast<size_t>(me.seen().tool[0].instrument)].pen; };
    if (!step("take the pen", take(me, "cautery")) || !step("to the line", me.go(tip, 0.004f))) return false;
    above = 0;
    if (!step("touch the line", me.go(tip, 0.0025f)) ||
        !step("switch it on", me.press(2, 2, [&] { return pen() == PenMode::cut; })))
      return false;
    for (; along < 0.004f; along += 0.0005f) me.go(tip, 0.0025f);
    return step("switch it off", me.press(2, 2, [&] { return pen() == PenMode::off; }));
  }

  // Each vessel that bleeds, with the pen and its pedal.
  bool coagulate(Stylus& me) {
    if (!step("take the pen", take(me, "cautery"))) return false;
    for (size_t i = 0; i < me.seen().wound.bleeding.size(); ++i) {
      const auto bleeds = [&] { return me.seen().wound.bleeding[i].flow > 0; };
      if (!bleeds()) continue;
      float above = 0.02f;
      const auto tip = [&] {
        const Vec3 place = me.seen().wound.bleeding[i].at, from = place - desk.picture().focus;
        return tip_on({place, normalized(Vec3{from.x, 0, from.z}), {0, 1, 0}, 0}, above);
      };
      if (!step("over the vessel", me.go(tip, 0.004f))) return false;
      above = 0;
      me.go(tip, 0.001f);
      for (int attempt = 0; attempt < 4 && bleeds(); ++attempt) desk.press_for("F8", 1);
      if (!step("stop the bleeding", !bleeds())) return false;
      above = 0.02f;
      if (!step("off the vessel", me.go(tip, 0.004f))) return false;
    }
    return true;
  }

  XMouse desk;
  std::string stopped_at;

 private:
  FakeHd fake_{false};
};

TEST_F(StitchAtTheWindow, a_clamp_and_the_pen_by_simulated_arms) {
  AtTheArms at(x_->display, "altemeier");
  if (!at.desk.ready()) GTEST_SKIP() << "no XTest here";
  at.sit([&](Stylus& me) {
    if (!at.clamp_the_rim(me) || !at.park(me) || !at.step("away", me.go([&] { return at.jaws(me, 0.05f); }, 0.02f)) ||
        !at.score(me))
      return;
    at.desk.press("k");
    at.step("lay it down", me.until([&] { return me.seen().tool[0].instrument < 0; }));
  });
  EXPECT_EQ(at.stopped_at, "");
  expect_clamp_and_score(at.desk);
}

// The second stage begins with what the scripted surgeon has done in the first one. By gamepad: stages_test, in lock step.
TEST_F(StitchAtTheWindow, an_operation_is_resumed_at_its_cut_by_mouse) {
  if (!std::getenv("CATGUT_LONG")) GTEST_SKIP() << "set CATGUT_LONG=1";
  XMouse desk(x_->display, 400, 1, "altemeier");
  if (!desk.ready()) GTEST_SKIP() << "no XTest here";
  desk.lesson = "altemeier", desk.prepare = begin_at_the_cut;
  Person me(desk);
  size_t clamps = 0;
  bool done = false;
  desk.sit([&] { clamps = clamps_on_the_rim(desk.look().seen), done = score_between_clamps(me); }, true);
  EXPECT_TRUE(done) << me.doing();
  expect_a_cut(desk, clamps);
}

TEST_F(StitchAtTheWindow, an_operation_is_resumed_at_its_cut_by_simulated_arms) {
  if (!std::getenv("CATGUT_LONG")) GTEST_SKIP() << "set CATGUT_LONG=1";
  AtTheArms at(x_->display, "altemeier");
  if (!at.desk.ready()) GTEST_SKIP() << "no XTest here";
  at.desk.lesson = "altemeier";
  at.desk.prepare = [](PlayOptions& options) { AtTheArms::connect(options), begin_at_the_cut(options); };
  size_t clamps = 0;
  at.sit(
      [&](Stylus& me) {
        clamps = clamps_on_the_rim(me.seen());
        if (at.step("away", me.go([&] { return at.jaws(me, 0.05f); }, 0.02f)))
          at.score(me, {std::cos(kBeside), 0, -std::sin(kBeside)});
      },
      true);
  EXPECT_EQ(at.stopped_at, "");
  expect_a_cut(at.desk, clamps);
}

// The third stage: the surgeon has clamped and cut. The user stops the bleeding, takes the assistant's clamp over and carries
// the specimen away.
TEST_F(StitchAtTheWindow, the_specimen_is_removed_by_simulated_arms) {
  if (!std::getenv("CATGUT_LONG")) GTEST_SKIP() << "set CATGUT_LONG=1";
  AtTheArms at(x_->display, "altemeier");
  if (!at.desk.ready()) GTEST_SKIP() << "no XTest here";
  at.desk.lesson = "altemeier";
  at.desk.prepare = [](PlayOptions& options) {
    AtTheArms::connect(options);
    options.tutorial = false, options.stage = "remove";
  };
  at.sit(
      [&](Stylus& me) {
        if (!at.coagulate(me)) return;
        at.desk.press("k");
        if (!at.step("lay the pen down", me.until([&] { return me.seen().tool[0].instrument < 0; }))) return;
        const auto beside = [&] {
          Pose p = me.seen().tool[0].hand;
          p.p = me.seen().tool[2].pose.p + Vec3{-0.03f, 0.03f, 0};
          return p;
        };
        if (!at.step("to the assistant's clamp", me.hand_to(beside, 0.01f))) return;
        at.desk.press("k");
        if (!at.step("take it over", me.until([&] { return me.seen().tool[0].held == Held::tissue; }))) return;
        Pose aside = me.seen().tool[0].hand;
        aside.p += Vec3{-0.15f, 0.1f, 0};
        at.step("carry it away", me.hand_to([&] { return aside; }, 0.01f));
        at.step("the stage is done", me.until([&] { return at.desk.lesson_step() == 3; }));
      },
      true);
  EXPECT_EQ(at.stopped_at, "");
  EXPECT_EQ(at.desk.lesson_run().stage, 3u) << "clamp, cut, remove, bite";
  EXPECT_EQ(at.desk.lesson_run().error.size(), 0u);
}

TEST_F(StitchAtTheWindow, scissors_cut_by_simulated_arms) {
  AtTheArms at(x_->display, "slit");
  if (!at.desk.ready()) GTEST_SKIP() << "no XTest here";
  at.sit([&](Stylus& me) {
    float above = 0.03f;
    const auto blades = [&] {
      const auto rim = rim_beside(at.desk.look().view, at.at_front(me, 0), 0.01f, at.desk.picture(), me.seen());
      Pose p = rim ? jaws_at(*rim) : me.seen().tool[0].hand;
      p.p += rotate(p.q, {0, 0, above});
      return p;
    };
    if (!at.step("over the rim", me.go(blades, 0.004f))) return;
    above = -0.006f;
    at.step("blades on both sides", me.go(blades, 0.0025f));
    at.step("close them", me.press(1, 1, [&] { return at.desk.count(EventKind::tissue_snipped) > 0; }));
  });
  EXPECT_EQ(at.stopped_at, "");
  EXPECT_GE(at.desk.count(EventKind::tissue_snipped), 1u);
}

// As by mouse, above.
TEST_F(StitchAtTheWindow, an_operation_by_simulated_arms_is_aborted_reported_and_recorded) {
  AtTheArms at(x_->display, "altemeier");
  if (!at.desk.ready()) GTEST_SKIP() << "no XTest here";
  const AbortedFiles files;
  at.desk.lesson = "altemeier";
  at.desk.prepare = [&](PlayOptions& options) { AtTheArms::connect(options), files.write(options); };
  bool left = false;
  at.sit(
      [&](Stylus& me) {
        if (!at.clamp_the_rim(me) || !at.park(me)) return;
        at.step("away", me.go([&] { return at.jaws(me, 0.05f); }, 0.02f));
        at.desk.press("F10");
        left = at.desk.shows("results");
      },
      true);
  EXPECT_EQ(at.stopped_at, "");
  EXPECT_TRUE(left);
  files.expect_first_stage_and_the_same_replay(1);
}

}  // namespace
}  // namespace catgut
#endif
