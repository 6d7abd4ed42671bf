// SPDX-License-Identifier: Apache-2.0
// tests/device: the backend of Force Dimension's devices with a simulated libdhd, through the same dlopen and symbols
// as the real one. The servo in between is the real one. In the double the first device is the left hand's.
#include "device/force_dimension.h"

#include <dlfcn.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <mutex>
#include <thread>

#include "device/dhd_api.h"
#include "fake_dhd/fake_dhd.h"
#include "haptic/servo.h"
#include "plain_hand.h"

namespace catgut {
namespace {

enum class Kind { ideal, unkind, swapped };
constexpr Kind kKinds[] = {Kind::ideal, Kind::unkind, Kind::swapped};
// An encoder of 0.02 mm, 2 ms to the motors, periods that vary, calls that are late or lost.
constexpr UnkindDevice kUnkind{2e-5, 2, 0.2, 0.002, 0.002, 0};

struct FakeDhd {
  void* library = nullptr;
  bool swapped = false;
  decltype(&fakeDhdReset) reset = nullptr;
  decltype(&fakeDhdStep) step = nullptr;
  decltype(&fakeDhdRun) run = nullptr;
  decltype(&fakeDhdFault) fault = nullptr;
  decltype(&fakeDhdHand) hand = nullptr;
  decltype(&fakeDhdFast) fast = nullptr;
  decltype(&fakeDhdRead) read = nullptr;
  decltype(&fakeDhdZero) zero = nullptr;
  decltype(&fakeDhdUnkind) unkind = nullptr;
  decltype(&fakeDhdGrip) grip = nullptr;
  decltype(&fakeDhdErrors) errors = nullptr;
  decltype(&fakeDhdNow) now = nullptr;
  explicit FakeDhd(bool manual, Kind kind = Kind::ideal, const char* model = "") {
    for (const char* name : {"FAKE_DHD_COUNT", "FAKE_DHD_UNCALIBRATED", "FAKE_DHD_LOCKED"}) unsetenv(name);
    swapped = kind == Kind::swapped;
    setenv("FAKE_DHD_SWAPPED", swapped ? "1" : "0", 1);
    setenv("FAKE_DHD_NAME", model, 1);
    setenv("FAKE_DHD_MANUAL", manual ? "1" : "0", 1);
    setenv("CATGUT_LIBDHD", CATGUT_FAKE_LIBDHD, 1);
    library = dlopen(CATGUT_FAKE_LIBDHD, RTLD_NOW | RTLD_LOCAL);
    if (!library) ADD_FAILURE() << dlerror();
    find(reset, "fakeDhdReset"), find(step, "fakeDhdStep"), find(fault, "fakeDhdFault"), find(hand, "fakeDhdHand");
    find(fast, "fakeDhdFast"), find(read, "fakeDhdRead"), find(zero, "fakeDhdZero");
    find(run, "fakeDhdRun"), find(unkind, "fakeDhdUnkind"), find(grip, "fakeDhdGrip"), find(errors, "fakeDhdErrors");
    find(now, "fakeDhdNow");
    reset();
    if (kind == Kind::unkind) unkind(&kUnkind);
  }
  template <typename F>
  void find(F& f, const char* name) {
    f = reinterpret_cast<F>(dlsym(library, name));
    if (!f) ADD_FAILURE() << name;
  }
  // hand: 0 right, 1 left.
  int device(size_t h) const { return (h == 0) != swapped ? 1 : 0; }
  FakeDhdArm at(size_t h) const {
    FakeDhdArm a{};
    read(device(h), &a);
    return a;
  }
  static Vec3 ours(const double (&v)[3]) {
    return {static_cast<float>(v[1]), static_cast<float>(v[2]), static_cast<float>(v[0])};
  }
  Vec3 force(size_t h) const { return ours(at(h).force); }  // in our axes
  Vec3 torque(size_t h) const { return ours(at(h).torque); }
};

// Both arms on servos, a millisecond at a time.
struct Two {
  FakeDhd fake;
  std::mutex guard;                // of what the servo threads and the test share, below
  float wall = 0;                  // [N/m] of a wall at the height 0, for the right hand
  std::array<ArmForce, 2> more{};  // torque and grip at jaw 0.1, besides
  std::vector<std::string> messages;
  ArmPort port;
  std::array<ServoHand, 2> hand;
  std::array<ServoOptions, 2> options;
  std::array<Vec3, 2> pull{};
  std::array<ToolInput, 2> input;
  std::array<ArmSample, 2> sample;
  std::array<uint64_t, 2> now_ns{};      // each thread its own
  std::array<uint64_t, 2> physics_ns{};  // 0: the physics runs

  explicit Two(Kind kind = Kind::ideal, const char* model = "") : fake(true, kind, model) {}

  static ArmForce step(void* user, size_t k, const ArmSample& s) {
    Two& t = *static_cast<Two*>(user);
    const std::scoped_lock lock(t.guard);
    t.now_ns[k] = t.fake.now(t.fake.device(k));
    t.sample[k] = s;
    ForcePatch p;
    p.point = s.pose.p;
    p.period = 0.016f, p.force = t.pull[k], p.time_ns = t.physics_ns[k] ? t.physics_ns[k] : t.now_ns[k];
    p.turn = s.pose.q, p.couple = t.more[k].torque, p.couple_stiffness = 0.1f;
    if (t.more[k].grip > 0) p.grip_from = 0.35f, p.grip_stiffness = t.more[k].grip / 0.25f;
    if (t.wall > 0 && k == 0) {
      p.normal = {0, 1, 0}, p.stiffness = outer({0, 1, 0}, t.wall);
      p.gap = std::max(0.0f, -s.pose.p.y), p.force = {0, t.wall * p.gap, 0};
      if (s.pose.p.y > 0) p.point.y = 0;
    }
    const ServoOut out = servo_step(t.hand[k], t.options[k], s, &p, t.now_ns[k]);
    t.input[k] = out.hand;
    return out;
  }
  void open() {
    ForceDimensionOptions o;
    o.paced = false;
    port = open_force_dimension(o, messages);
    for (size_t k = 0; k < 2; ++k) fit_to_arm(options[k], port.arm[k].limits);
    std::string why;
    if (port.any()) { ASSERT_TRUE(port.start(port.self, {step, this}, why)) << why; }
  }
  template <typename F>
  void run(int ms, const F& each) {
    for (int k = 0; k < ms; ++k) {
      ASSERT_TRUE(fake.step(1));
      const std::scoped_lock lock(guard);
      each(k);
    }
  }
  void run(int ms) {
    run(ms, [](int) {});
  }
  void engage(Vec3 right, Vec3 left) {
    run(2100);
    pull = {right, left};
    run(800);
    fake.zero(0), fake.zero(1);
  }
  void put(size_t h, Vec3 p, const double* rows, int button = 0, double gap = 0.02) {
    const double at[3] = {double{p.z}, double{p.x}, double{p.y}};
    fake.hand(fake.device(h), at, rows, button, gap);
  }
  ~Two() {
    fake.run();  // the backend gets the milliseconds that it needs to reduce its force
    port.reset();
  }
};

constexpr double kStraight[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};

TEST(ForceDimension, tells_what_it_found) {
  Two t;
  t.open();
  EXPECT_TRUE(t.messages.empty());
  ASSERT_TRUE(t.port.arm[0].present && t.port.arm[1].present);
  EXPECT_EQ(t.port.arm[0].serial, "fd-1001");
  EXPECT_EQ(t.port.arm[1].serial, "fd-1000") << "the left-handed one is the left hand's";
  EXPECT_EQ(t.port.arm[0].driver, "3.17.5");
  EXPECT_EQ(t.port.arm[0].limits.force, 12);
  EXPECT_EQ(t.options[0].limiter.force, 12) << "S8: its own, not a Touch's";
  EXPECT_EQ(t.fake.at(0).watchdog, 255);
}

// S8: a gripper is a continuous jaw, not a switch: it follows the fingers, and a pinch toggles nothing.
TEST(ForceDimension, S8_the_jaw_follows_the_fingers) {
  Two t;
  t.open();
  const double straight[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  float last = 2;
  for (const double gap : {0.020, 0.014, 0.010, 0.006, 0.003}) {
    t.put(0, {}, straight, 0, gap);
    t.run(20);
    EXPECT_LT(t.input[0].jaw, last) << gap;
    last = t.input[0].jaw;
  }
  EXPECT_EQ(last, 0);
  t.put(0, {}, straight, 0, 0.020);
  t.run(20);
  EXPECT_EQ(t.input[0].jaw, 1);
}

TEST(ForceDimension, poses_come_whole) {
  Two t;
  t.open();
  // Turned by 90 degrees about the vertical, their z: their x axis points where their y was.
  const double turned[9] = {0, -1, 0, 1, 0, 0, 0, 0, 1};
  t.put(0, {0.01f, 0.02f, 0.03f}, turned, 0, 0.003);
  t.put(1, {-0.01f, 0, 0}, kStraight, 1);
  t.run(300);
  EXPECT_LT(distance(t.sample[0].pose.p, {0.01f, 0.02f, 0.03f}), 1e-5f);
  EXPECT_LT(length(rotation_vector(t.sample[0].pose.q * conjugate(axis_angle({0, 1, 0}, 0.5f * kPi)))), 1e-5f);
  EXPECT_LT(length(rotation_vector(t.sample[1].pose.q)), 1e-5f);
  EXPECT_EQ(t.sample[0].buttons, 1u) << "the gripper is pressed";
  EXPECT_EQ(t.sample[1].buttons, 1u);
  t.put(0, {}, turned, 0, 0.009);
  t.run(5);
  EXPECT_EQ(t.sample[0].buttons, 1u) << "not quite let go";
  t.put(0, {}, turned, 0, 0.02);
  t.run(5);
  EXPECT_EQ(t.sample[0].buttons, 0u);
}

TEST(ForceDimension, H9_forces_are_never_swapped) {
  for (const Kind kind : kKinds) {
    SCOPED_TRACE(static_cast<int>(kind));
    Two t(kind);
    t.open();
    const Vec3 right{0.3f, 0.1f, 0}, left{0, -0.2f, 0.6f};
    t.engage(right, left);
    EXPECT_LT(distance(t.fake.force(0), right), 1e-3f);
    EXPECT_LT(distance(t.fake.force(1), left), 1e-3f);
    EXPECT_GT(t.fake.at(0).position[1], 0.001) << "pushed to the right, it went to the right";
  }
}

// The physics stops: force is zero within 100 ms, without a step.
TEST(ForceDimension, the_physics_dies) {
  for (const Kind kind : kKinds) {
    SCOPED_TRACE(static_cast<int>(kind));
    Two t(kind);
    t.open();
    t.engage({0.9f, 0, 0}, {0, 0.6f, 0});
    const Vec3 left = t.fake.force(1);
    t.physics_ns[0] = t.now_ns[0];
    int zero = 0;
    t.run(150, [&](int k) {
      if (length(t.fake.force(0)) == 0 && zero == 0) zero = k + 1;
      ASSERT_TRUE(t.fake.force(1) == left);
    });
    EXPECT_GT(zero, 30);
    EXPECT_LE(zero, 100);
    EXPECT_LE(t.fake.at(0).step_most, 0.5 + 1e-4);
  }
}

// A device is unplugged and plugged in again: its force drops to zero, the other hand's is unchanged to the bit, and it
// returns through the ramp.
TEST(ForceDimension, H7_an_arm_is_unplugged) {
  for (const Kind kind : kKinds) {
    SCOPED_TRACE(static_cast<int>(kind));
    Two t(kind);
    t.open();
    t.engage({0.9f, 0, 0}, {0, 0.6f, 0});
    const Vec3 left = t.fake.force(1);
    // To the bit; with encoder steps the account damps a pull that no contact explains.
    const auto unmoved = [&] { return distance(t.fake.force(1), left) <= (kind == Kind::unkind ? 0.02f : 0); };
    t.fake.fault(t.fake.device(0), kDhdUnplugged, 1);
    t.run(200, [&](int) {
      ASSERT_TRUE(unmoved());
      ASSERT_EQ(length(t.fake.force(0)), 0);
    });
    for (int k = 0; k < 2000 && t.port.status(t.port.self, 0).ready; ++k)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    EXPECT_FALSE(t.port.status(t.port.self, 0).ready);
    EXPECT_TRUE(t.port.status(t.port.self, 1).ready);
    EXPECT_EQ(t.port.error_text(t.port.self, t.port.status(t.port.self, 0).error), "communication error");
    t.fake.fault(t.fake.device(0), kDhdUnplugged, 0);
    for (int k = 0; k < 5000 && !t.port.status(t.port.self, 0).ready; ++k) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      ASSERT_TRUE(t.fake.step(1));
    }
    EXPECT_TRUE(t.port.status(t.port.self, 0).ready);
    EXPECT_EQ(t.fake.at(0).watchdog, 255);
    t.run(100);
    EXPECT_EQ(length(t.fake.force(0)), 0) << "what is wanted is not small: it must not engage";
    EXPECT_TRUE(unmoved());
  }
}

// A call that never returns: the device's own watchdog switches the force off, the other hand is unaffected, and closing does
// not wait for it.
TEST(ForceDimension, an_arm_hangs) {
  Two t;
  t.open();
  t.engage({0.9f, 0, 0}, {0, 0.6f, 0});
  const Vec3 left = t.fake.force(1);
  t.fake.fault(t.fake.device(0), kDhdHang, 1);
  int zero = 0;
  t.run(100, [&](int k) {
    if (length(t.fake.force(0)) == 0 && zero == 0) zero = k + 1;
    ASSERT_TRUE(t.fake.force(1) == left);
  });
  EXPECT_GT(zero, 0);
  EXPECT_LE(zero, 33);
  EXPECT_EQ(t.fake.at(0).cause, 3);
  t.fake.run();
  const auto before = std::chrono::steady_clock::now();
  t.port.reset();
  EXPECT_LT(std::chrono::steady_clock::now() - before, std::chrono::seconds(5));
  EXPECT_EQ(t.fake.at(1).output, 0) << "the other one was left as it should be";
  t.fake.fault(t.fake.device(0), kDhdHang, 0);  // the abandoned thread finds no callback, and ends
  t.fake.fault(t.fake.device(0), kDhdUnplugged, 1);
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
}

// S8: torque and grip of a device that has motors for them arrive there, in its axes, behind clamps of the library that are the
// model's; leaving takes them away without a step. Other devices get none.
TEST(ForceDimension, S8_torque_and_grip_reach_the_motors) {
  for (const char* model : {"simulated sigma.7", "simulated omega.7", "simulated omega.3"})
    for (const Kind kind : kKinds) {
      SCOPED_TRACE(testing::Message() << model << " " << static_cast<int>(kind));
      const bool turns = std::string(model).find("sigma") != std::string::npos,
                 grips = model[std::string(model).size() - 1] == '7';
      Two t(kind, model);
      t.open();
      EXPECT_EQ(t.port.arm[0].limits.torque, turns ? 0.2f : 0);
      EXPECT_EQ(t.port.arm[0].limits.grip, grips ? 8 : 0);
      EXPECT_EQ(t.fake.at(0).max_force, 12);
      if (turns) { EXPECT_NEAR(t.fake.at(0).max_torque, 0.2, 1e-6); }
      if (grips) { EXPECT_EQ(t.fake.at(0).max_gripper, 8) << "not the library's 1 N"; }
      t.put(0, {}, kStraight, 0, 0.004 + 0.1 * double{kGripTravel});
      t.engage({0.4f, 0, 0}, {});
      t.more[0] = {{}, {0.01f, -0.02f, 0.03f}, 3}, t.more[1] = {{}, {0, 0.005f, 0}, 0};
      t.run(600);
      EXPECT_LT(distance(t.fake.torque(0), turns ? t.more[0].torque : Vec3{}), 1e-4f);
      EXPECT_LT(distance(t.fake.torque(1), turns ? t.more[1].torque : Vec3{}), 1e-4f);
      EXPECT_NEAR(t.fake.at(0).grip, grips ? 3 : 0, 0.01);
      EXPECT_EQ(t.fake.at(1).grip, 0) << "its jaws are empty";
      EXPECT_LE(t.fake.at(0).torque_step, 0.5 * 0.2 / 12 + 1e-6);
      EXPECT_LE(t.fake.at(0).grip_step, 0.5 * 8 / 12 + 1e-6);
      t.fake.zero(0), t.fake.zero(1);
      t.fake.run();
      t.port.stop(t.port.self);
      for (const size_t k : {size_t{0}, size_t{1}}) {
        EXPECT_LE(t.fake.at(k).step_most, 0.5 + 1e-6);
        EXPECT_LE(t.fake.at(k).torque_step, 0.5 * 0.2 / 12 + 1e-6);
        EXPECT_LE(t.fake.at(k).grip_step, 0.5 * 8 / 12 + 1e-6);
        EXPECT_EQ(length(t.fake.torque(k)), 0);
        EXPECT_EQ(t.fake.at(k).grip, 0);
      }
    }
}

// H3: hands of every grip press a wall of 300 N/m and hold still, on ideal and on imperfect devices.
TEST(ForceDimension, H3_a_wall_is_passive) {
  for (const Kind kind : {Kind::ideal, Kind::unkind})
    for (const double grip : {50.0, 150.0, 800.0}) {
      Two t(kind);
      t.open();
      t.wall = 300;
      t.fake.grip(t.fake.device(0), grip, 4, 0.1);
      t.put(0, {0, 0.004f, 0}, kStraight);
      t.run(2400);
      t.fake.zero(0);
      const float deep = 0.004f + 1.0f / static_cast<float>(grip);
      for (int i = 0; i <= 40; ++i) t.put(0, {0, 0.004f - deep * static_cast<float>(i) / 40, 0}, kStraight), t.run(10);
      t.run(600);
      double low = 1e9, high = -1e9;
      t.run(600, [&](int) {
        const double y = t.fake.at(0).position[2];
        low = std::min(low, y), high = std::max(high, y);
      });
      const float felt = length(t.fake.force(0));
      for (int i = 40; i >= 0; --i) t.put(0, {0, 0.004f - deep * static_cast<float>(i) / 40, 0}, kStraight), t.run(10);
      t.run(300);
      const FakeDhdArm a = t.fake.at(0);
      std::printf("H3: Force Dimension, %s, grip %.0f N/m: %.2f N, %.3f mJ to the hand, swing %.3f mm, step %.3f N\n",
                  kind == Kind::ideal ? "ideal" : "unkind", grip, double{felt}, 1e3 * a.to_hand_most, 1e3 * (high - low),
                  a.step_most);
      EXPECT_GT(felt, 0.2f);
      EXPECT_LE(a.to_hand_most, 0.5e-3);
      EXPECT_LE(high - low, 0.2e-3);
      EXPECT_LE(a.step_most, 0.5 + 1e-4);
    }
}

// Errors at any call in any order, on both devices, with imperfect timing: no step at the motors beyond the slew, nothing over
// what is wanted, the jaw that holds a needle never opens unasked, and both devices are there again at the end.
TEST(ForceDimension, errors_at_any_call_in_any_order) {
  Two t(Kind::unkind, "simulated sigma.7");
  t.open();
  t.put(0, {}, kStraight, 0, 0.004);
  for (ServoOptions& o : t.options) o.limiter.ramp = 0.05f;
  t.engage({}, {});
  UnkindDevice storm = kUnkind;
  storm.storm = 0.002;
  t.fake.unkind(&storm);
  t.fake.zero(0), t.fake.zero(1);
  uint64_t opened = 0, absent = 0;
  t.run(3000, [&](int k) {
    // What is wanted comes and goes, so that the force can engage again.
    const float now = std::max(0.0f, std::sin(2 * kPi * 0.005f * static_cast<float>(k)));
    t.pull = {Vec3{0.5f * now, 0, 0}, Vec3{0, 0.4f * now, 0}};
    t.more[0] = {{}, {0, 0.01f * now, 0}, 2};
    absent += !t.input[0].connected;
    opened += t.input[0].connected && t.input[0].jaw > 0.05f;
  });
  const unsigned long errors = t.fake.errors();
  t.fake.unkind(&kUnkind);
  for (int k = 0; k < 3000 && !(t.port.status(t.port.self, 0).ready && t.port.status(t.port.self, 1).ready); ++k) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    t.run(1);
  }
  std::printf("storm: %lu errors, right device absent in %llu of 3000 ms, step %.3f N and %.2f mN m, at most %.2f N\n", errors,
              static_cast<unsigned long long>(absent), t.fake.at(0).step_most, 1e3 * t.fake.at(0).torque_step,
              t.fake.at(0).force_most);
  EXPECT_GT(errors, 20u);
  EXPECT_GT(absent, 5u);
  EXPECT_EQ(opened, 0u);
  for (const size_t k : {size_t{0}, size_t{1}}) {
    EXPECT_TRUE(t.port.status(t.port.self, k).ready);
    EXPECT_LE(t.fake.at(k).step_most, 0.5 + 1e-4);
    EXPECT_LE(t.fake.at(k).torque_step, 0.5 * 0.2 / 12 + 1e-6);
    EXPECT_GT(t.fake.at(k).force_most, 0.2);
    EXPECT_LE(t.fake.at(k).force_most, 0.51);
  }
}

// The firmware cuts the force because the hand was fast: the tool still moves, force returns through the ramp.
TEST(ForceDimension, the_firmware_cuts_the_force) {
  Two t;
  t.open();
  t.engage({0.9f, 0, 0}, {});
  t.fake.fast(t.fake.device(0));
  t.run(60);
  EXPECT_EQ(t.input[0].connected, 1u);
  EXPECT_TRUE(t.sample[0].forced_off);
  EXPECT_EQ(length(t.fake.force(0)), 0);
  t.run(400);
  EXPECT_FALSE(t.sample[0].forced_off) << "switched on again";
  EXPECT_EQ(length(t.fake.force(0)), 0) << "but what is wanted is not small";
}

TEST(ForceDimension, positions_that_are_no_numbers) {
  Two t;
  t.open();
  t.engage({0.9f, 0, 0}, {0, 0.6f, 0});
  t.fake.fault(t.fake.device(0), kDhdNan, 1);
  t.run(100, [&](int) { ASSERT_TRUE(is_finite(t.fake.force(0))); });
  EXPECT_EQ(length(t.fake.force(0)), 0);
  EXPECT_NEAR(length(t.fake.force(1)), 0.6f, 0.01f);
}

TEST(ForceDimension, nothing_to_work_with_is_one_line) {
  FakeDhd fake(true);
  const auto line = [&fake](const char* name, const char* value, const char* needle, const std::string& library = "") {
    if (*name) setenv(name, value, 1);
    fake.reset();
    std::vector<std::string> messages;
    ForceDimensionOptions o;
    o.library = library;
    EXPECT_FALSE(open_force_dimension(o, messages).any()) << needle;
    ASSERT_FALSE(messages.empty());
    EXPECT_NE(messages.back().find(needle), std::string::npos) << messages.back();
    EXPECT_EQ(messages.back().find('\n'), std::string::npos);
    if (*name) unsetenv(name);
  };
  line("FAKE_DHD_COUNT", "0", "no device");
  line("FAKE_DHD_UNCALIBRATED", "1", "HapticInit");
  line("FAKE_DHD_LOCKED", "1", "udev rules");
  line("", "", "install the SDK", "/nowhere/libdhd.so");
  line("", "", "lacks the function dhdGetDeviceCount", "libc.so.6");
}

TEST(ForceDimension, one_arm_is_enough) {
  Two t;
  setenv("FAKE_DHD_COUNT", "1", 1);
  t.fake.reset();
  t.open();
  EXPECT_TRUE(t.messages.empty());
  EXPECT_TRUE(!t.port.arm[0].present && t.port.arm[1].present);
  t.run(20);
  EXPECT_EQ(t.port.status(t.port.self, 0).steps, 0u);
  EXPECT_GE(t.port.status(t.port.self, 1).steps, 19u);
  unsetenv("FAKE_DHD_COUNT");
}

// Leaving takes the force off by the slew, then switches the motors off. In real time, as the arm keeps it.
TEST(ForceDimension, leaving) {
  FakeDhd fake(false);
  std::vector<std::string> messages;
  ArmPort port = open_force_dimension({}, messages);
  ASSERT_TRUE(port.any());
  const auto hold = [](void*, size_t, const ArmSample&) { return ArmForce{{0, 2, 0}, {}, 0}; };
  std::string why;
  ASSERT_TRUE(port.start(port.self, {hold, nullptr}, why)) << why;
  for (int k = 0; k < 5000 && (length(fake.force(0)) < 1 || length(fake.force(1)) < 1); ++k)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  ASSERT_GT(length(fake.force(0)), 1);
  fake.zero(0), fake.zero(1);
  port.stop(port.self);
  for (const size_t k : {size_t{0}, size_t{1}}) {
    EXPECT_LE(fake.at(k).step_most, 0.5 + 1e-6);
    EXPECT_EQ(fake.at(k).output, 0);
  }
}

}  // namespace
}  // namespace catgut
