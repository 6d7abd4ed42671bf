// SPDX-License-Identifier: Apache-2.0
// tests/device: the backend of the Touch with a simulated libHD, through the same dlopen and symbols as the real
// one. Criteria H1, H7 and H9 of docs/rooms/haptic.md; the servo in between is the real one.
#include "device/touch.h"

#include <gtest/gtest.h>

#include <cstring>

#include "device/hd_api.h"
#include "device/profiles.h"
#include "fake_hd/load.h"
#include "haptic/servo.h"

namespace catgut {
namespace {

enum class Kind { ideal, unkind, swapped };
constexpr Kind kKinds[] = {Kind::ideal, Kind::unkind, Kind::swapped};
constexpr FakeHdUnkind kUnkind{0.055, 2, 0.05, 0.002, 0.002, 0, 3};  // a Touch on a busy computer

// Everything that a servo was given and gave back.
struct Recorded {
  ArmSample sample;
  bool fresh;
  ForcePatch patch;
  uint64_t now_ns;
  Vec3 force;
};

// Both arms on servos of their own, fed with a patch each.
struct Two {
  FakeHd fake{true};
  std::vector<std::string> messages;
  ArmPort port;
  std::array<ServoHand, 2> hand;
  std::array<ServoOptions, 2> options;
  std::array<ForcePatch, 2> patch;
  std::array<ToolInput, 2> input;
  std::array<ArmSample, 2> sample;
  std::array<bool, 2> feed{true, true};
  std::array<uint64_t, 2> calls{};
  int sent = 0;
  std::vector<Recorded>* record = nullptr;  // of the right arm

  explicit Two(Kind kind = Kind::ideal) {
    if (kind == Kind::swapped) setenv("FAKE_HD_SWAPPED", "1", 1), fake.reset(), unsetenv("FAKE_HD_SWAPPED");
    if (kind == Kind::unkind) fake.unkind(&kUnkind);
  }

  static ArmForce step(void* user, size_t arm, const ArmSample& s) {
    Two& t = *static_cast<Two*>(user);
    t.sample[arm] = s;
    ++t.calls[arm];
    const uint64_t now = t.fake.now();
    t.patch[arm].time_ns = now;
    if (t.patch[arm].stiffness.xx == 0) t.patch[arm].point = s.pose.p;  // a constant force goes with the hand
    const bool fresh = t.feed[arm] && t.sent % 16 == 0;
    const ServoOut out = servo_step(t.hand[arm], t.options[arm], s, fresh ? &t.patch[arm] : nullptr, now);
    t.input[arm] = out.hand;
    if (t.record && arm == 0) t.record->push_back({s, fresh, t.patch[arm], now, out.force});
    return out;
  }
  void open() {
    port = open_touch({}, messages);
    std::string why;
    if (port.any()) { ASSERT_TRUE(port.start(port.self, {step, this}, why)) << why; }
    for (size_t k = 0; k < 2; ++k) fit_to_arm(options[k], port.arm[k].limits);
  }
  // [ms]; `each` sees every one of them.
  template <typename F>
  void run(int ms, F&& each) {
    for (int k = 0; k < ms; ++k) {
      fake.step(1);
      ++sent;
      each(k);
    }
  }
  void run(int ms) {
    run(ms, [](int) {});
  }
  ~Two() { port.reset(); }
};

ForcePatch constant(Vec3 force) {
  ForcePatch p;
  p.period = 0.016f;
  p.force = force;
  return p;
}

// Devices that have engaged without force, then render a spring that holds them with `force` newtons.
void engage(Two& t, Vec3 right, Vec3 left) {
  t.patch = {constant({}), constant({})};
  t.run(2200);
  t.patch = {constant(right), constant(left)};
  t.run(1200);
}

// H1: every symbol is there, numbers keep their width, the error record comes back whole.
TEST(Haptics, H1_abi) {
  FakeHd fake(true);
  hd::Library hd;
  size_t found = 0;
#define CATGUT_FIND(name, result, arguments)                                 \
  hd.name = reinterpret_cast<decltype(hd.name)>(dlsym(fake.library, #name)); \
  found += hd.name != nullptr;
  CATGUT_HD_FUNCTIONS(CATGUT_FIND)
#undef CATGUT_FIND
  EXPECT_EQ(found, hd::kFunctions);
  EXPECT_GE(hd::kFunctions, 30u);

  const hd::Handle right = hd.hdInitDevice("Right Device");
  ASSERT_NE(right, hd::kNoDevice);
  hd.hdMakeCurrentDevice(77);  // no such handle
  const hd::ErrorInfo e = hd.hdGetError();
  EXPECT_EQ(e.code, 0x0104u);
  EXPECT_EQ(e.internal, 0x0104 + 1000);
  EXPECT_EQ(e.device, right);
  EXPECT_EQ(hd.hdGetError().code, hd::kSuccess);
  hd.hdMakeCurrentDevice(right);
  hd::Long encoder[6] = {};
  hd.hdGetLongv(0x2010, encoder);
  if (sizeof(hd::Long) == 8) { EXPECT_EQ(encoder[5], (1L << 40) + 5); }
  hd::Boolean inkwell[4] = {9, 9, 9, 9};
  hd.hdGetBooleanv(0x2002, inkwell);
  EXPECT_EQ(inkwell[0], 0);
  EXPECT_EQ(inkwell[1], 9) << "a boolean is one byte";
  hd::Int wrong = 0;
  hd.hdGetIntegerv(0x2002, &wrong);
  EXPECT_EQ(hd.hdGetError().code, 0x0103u) << "the inkwell is no integer";
}

TEST(Touch, tells_what_it_found) {
  Two t;
  t.open();
  ASSERT_TRUE(t.port.arm[0].present && t.port.arm[1].present);
  EXPECT_TRUE(t.messages.empty());
  EXPECT_EQ(t.port.arm[0].serial, "right-0001");
  EXPECT_EQ(t.port.arm[1].serial, "left-0002");
  EXPECT_FLOAT_EQ(t.port.arm[1].limits.force, 3.3f);
  EXPECT_FLOAT_EQ(t.port.arm[1].limits.continuous, 0.88f);
  EXPECT_FLOAT_EQ(t.port.arm[1].limits.stiffness, 400);
  EXPECT_FLOAT_EQ(t.port.arm[1].limits.damping, 4);
  EXPECT_FLOAT_EQ(t.port.arm[0].most.x, 0.08f);
}

// Positions in meters, the matrix by columns, buttons as bits.
TEST(Touch, poses_come_whole) {
  Two t;
  t.open();
  const Quat turn = axis_angle(normalized(Vec3{1, 2, -1}), 0.8f);
  t.fake.put(0, {0.01f, 0.02f, -0.03f});
  t.fake.wish(0, {0.01f, 0.02f, -0.03f}, turn, 3);
  t.run(5);
  EXPECT_LT(distance(t.sample[0].pose.p, {0.01f, 0.02f, -0.03f}), 1e-6f);
  EXPECT_LT(length(rotation_vector(t.sample[0].pose.q * conjugate(turn))), 1e-5f);
  EXPECT_EQ(t.sample[0].buttons, 3u);
  EXPECT_EQ(t.sample[1].buttons, 0u);
  EXPECT_EQ(t.input[0].jaw, 0.0f);
  EXPECT_EQ(t.input[0].buttons, 0u) << "one press of the other button cuts nothing";
}

// S8: every model has its own limits; values of the library may lower them, never raise them; an unknown one is a Touch.
TEST(Haptics, S8_limits_are_the_models) {
  const auto force = [](const char* model) { return limits_of(model, {0, 0, 0, 0}).force; };
  EXPECT_EQ(force("Touch"), 3.3f);
  EXPECT_EQ(force("Touch X"), 7.9f);
  EXPECT_EQ(force("PHANTOM Premium 1.5"), 8.5f);
  EXPECT_EQ(force("omega.7"), 12);
  EXPECT_EQ(force("sigma.7"), 12);
  EXPECT_EQ(force("lambda.7"), 12);
  EXPECT_EQ(force("Falcon"), 8);
  EXPECT_EQ(force("inverse3"), 2);
  EXPECT_EQ(force("minverse"), 2);
  EXPECT_EQ(force("something new"), 3.3f);
  EXPECT_EQ(limits_of("omega.3", {5, 0, 1e9f, std::nanf("")}).force, 5);
  EXPECT_EQ(limits_of("omega.3", {5, 0, 1e9f, std::nanf("")}).stiffness, 5000);
  EXPECT_EQ(limits_of("Touch", {40, 9, 9000, 90}).force, 3.3f);
  for (const ArmProfile& p : arm_profiles()) {
    ServoOptions o;
    fit_to_arm(o, p.limits);
    EXPECT_EQ(o.limiter.force, p.limits.force) << p.model;
    EXPECT_NEAR(o.limiter.knee / o.limiter.force, 1.5f / 3.3f, 1e-4f) << p.model;
    EXPECT_GT(std::string(p.source).size(), 5u);
  }
}

// H9: two arms, two forces, never the other's.
TEST(Haptics, H9_forces_are_never_swapped) {
  for (const Kind kind : kKinds) {
    SCOPED_TRACE(static_cast<int>(kind));
    Two t(kind);
    t.open();
    EXPECT_EQ(t.port.arm[0].serial, "right-0001") << "whatever the order of the library's list";
    const Vec3 right{0.3f, 0.1f, 0}, left{0, -0.2f, 0.6f};
    engage(t, right, left);
    int bad = 0;
    t.run(500, [&](int) { bad += distance(t.fake.force(0), right) > 1e-4f || distance(t.fake.force(1), left) > 1e-4f; });
    EXPECT_EQ(bad, 0);
    t.fake.wish(0, {0.02f, 0, 0}, {}, 1);
    t.run(400);
    EXPECT_GT(t.input[0].pose.p.x, 0.01f);
    EXPECT_TRUE(t.input[0].jaw == 0 && t.input[1].jaw == 1) << "the other hand's button";
  }
}

// H7: a device is lost at any moment and returns. Its force drops to zero and returns through the ramp; the other hand's is
// unchanged, to the bit.
TEST(Haptics, H7_an_arm_is_lost_and_comes_back) {
  for (const Kind kind : kKinds)
    for (const int lost : {0, 1}) {
      SCOPED_TRACE(testing::Message() << "kind " << static_cast<int>(kind) << ", arm " << lost);
      const int other = 1 - lost;
      const Vec3 right{0.9f, 0, 0}, left{0, 0.7f, 0};
      std::vector<Vec3> quiet;
      for (const bool faulty : {false, true}) {
        Two t(kind);
        t.open();
        engage(t, right, left);
        t.fake.zero(0), t.fake.zero(1);
        size_t n = 0;
        int bad = 0;
        const auto see = [&](int) {
          if (!faulty) quiet.push_back(t.fake.force(other));
          else bad += !(t.fake.force(other) == quiet[n]);
          ++n;
        };
        t.run(50, see);
        t.fake.fault(lost, kFakeCommError, faulty);
        t.run(30, see);
        if (faulty) {
          EXPECT_EQ(t.input[static_cast<size_t>(lost)].connected, 0u);
          EXPECT_EQ(length(t.fake.force(lost)), 0);
          EXPECT_FALSE(t.port.status(t.port.self, static_cast<size_t>(lost)).ready);
          EXPECT_EQ(t.port.status(t.port.self, static_cast<size_t>(lost)).error, 0x0302u);
        }
        t.run(1000, see);
        t.fake.fault(lost, kFakeCommError, 0);
        t.run(300, see);
        if (faulty) {
          EXPECT_EQ(t.input[static_cast<size_t>(lost)].connected, 1u);
          EXPECT_LT(length(t.fake.force(lost)), 1e-4f) << "what is wanted is not small: it must not engage";
          // The hand lets go for a moment; then force comes in over two seconds.
          t.patch[static_cast<size_t>(lost)] = constant({});
          t.run(100, see);
          t.patch[static_cast<size_t>(lost)] = constant(lost == 0 ? right : left);
          t.run(300, see);
          const float soon = length(t.fake.force(lost));
          EXPECT_LT(soon, 0.25f * length(lost == 0 ? right : left));
          t.run(2500, see);
          EXPECT_NEAR(length(t.fake.force(lost)), length(lost == 0 ? right : left), 0.08f);
          EXPECT_LE(t.fake.at(lost).step_most, 0.5 + 1e-4) << "the driver's own cut is no step either";
        } else {
          t.run(2900, see);
        }
        EXPECT_EQ(bad, 0) << "the other hand felt it";
        EXPECT_LE(t.fake.at(other).step_most, 0.5);
      }
    }
}

// H7: a call of the library blocks while it waits for one arm, and both stand still with it (one callback serves both). The gap
// is a fault: no step beyond a millisecond's, and force recovers.
TEST(Haptics, H7_a_call_that_blocks) {
  for (const int blocked : {0, 1})
    for (const unsigned ms : {4u, 12u, 40u, 300u}) {
      SCOPED_TRACE(testing::Message() << "arm " << blocked << " blocks for " << ms << " ms");
      Two t(Kind::unkind);
      t.open();
      engage(t, {0.9f, 0, 0}, {0, 0.7f, 0});
      t.fake.zero(0), t.fake.zero(1);
      for (int k = 0; k < 5; ++k) t.fake.block(blocked, ms), t.run(200);
      t.run(3000);
      for (int k = 0; k < 2; ++k) EXPECT_LE(t.fake.at(k).step_most, 0.5 + 1e-4);
      if (ms > 5) { EXPECT_TRUE(t.hand[0].limiter.faults & kLate); }
      // Beyond the expiry of what is felt it is off until the hand lets go.
      EXPECT_NEAR(length(t.fake.force(0)), ms < 100 ? 0.9f : 0.0f, 0.09f);
      EXPECT_NEAR(length(t.fake.force(1)), ms < 100 ? 0.7f : 0.0f, 0.07f);
    }
}

// Errors of any code at any call, about any arm or none: force stays within its limits, and when they end both hands are back.
TEST(Touch, errors_at_any_call_in_any_order) {
  for (const Kind kind : {Kind::unkind, Kind::swapped})
    for (const double chance : {0.0005, 0.01, 0.2}) {
      SCOPED_TRACE(chance);
      Two t(kind);
      t.open();
      engage(t, {0.9f, 0, 0}, {0, 0.7f, 0});
      t.fake.zero(0), t.fake.zero(1);
      t.fake.storm(chance);
      t.run(5000, [&](int) {
        for (int k = 0; k < 2; ++k) ASSERT_LE(length(t.fake.force(k)), 3.3f + 1e-4f);
      });
      t.fake.storm(0);
      EXPECT_GT(t.port.status(t.port.self, 0).errors, 10u);
      t.run(1000);
      for (size_t k = 0; k < 2; ++k) {
        EXPECT_EQ(t.input[k].connected, 1u);
        t.patch[k] = constant({});
      }
      t.run(2500);
      t.patch = {constant({0.9f, 0, 0}), constant({0, 0.7f, 0})};
      t.run(1500);
      EXPECT_NEAR(length(t.fake.force(0)), 0.9f, 0.05f);
      EXPECT_NEAR(length(t.fake.force(1)), 0.7f, 0.05f);
      for (int k = 0; k < 2; ++k) EXPECT_LE(t.fake.at(k).step_most, 0.5 + 1e-4);
    }
}

// H8: three newtons asked for during ten minutes along the axis whose motor bears half of what the others do. The driver reads
// each joint's temperature, and none becomes so warm that the library cuts the force.
TEST(Haptics, H8_no_joint_becomes_too_warm) {
  Two t;
  FakeHdUnkind weak = kUnkind;
  weak.weakest_joint = 0.5;
  t.fake.unkind(&weak);
  t.open();
  t.fake.grip(0, 0.8, 0.008, 0.12, 0.05);
  engage(t, {0, 3, 0}, {});
  double square = 0, hottest = 0;
  int n = 0;
  t.run(600000, [&](int k) {
    if (k % 10) return;
    const FakeHdArm a = t.fake.at(0);
    square += a.force[1] * a.force[1], ++n;
    hottest = std::max(hottest, a.hottest);
  });
  std::printf("H8: weakest joint: RMS over ten minutes %.3f N (0.44), hottest %.2f of its limit, cut off %u times\n",
              std::sqrt(square / n), hottest, t.fake.at(0).cuts);
  EXPECT_EQ(t.fake.at(0).cuts, 0u);
  EXPECT_LE(std::sqrt(square / n), 0.44);
  EXPECT_GT(std::sqrt(square / n), 0.3) << "it gave up more than the motor needs";
}

// H10: what a driver's callback received and wrote during some seconds on an unkind arm, with faults, gives the same forces
// again, bit for bit.
TEST(Haptics, H10_recorded_samples) {
  std::vector<Recorded> record;
  ServoOptions options;
  {
    Two t(Kind::unkind);
    t.open();
    options = t.options[0];
    t.record = &record;
    engage(t, {0.6f, 0, 0}, {});
    ForcePatch spring = constant({0, 0.4f, 0});
    spring.stiffness = identity(250), spring.point = t.sample[0].pose.p;
    spring.normal = {0, 1, 0}, spring.gap = 0.003f, spring.coefficient = 0.3f;
    t.patch[0] = spring;
    for (int k = 0; k < 40; ++k) {
      t.fake.wish(0,
                  {0.004f * std::sin(0.9f * static_cast<float>(k)), -0.006f * std::cos(1.3f * static_cast<float>(k)), 0.002f},
                  {}, k % 3);
      t.fake.fault(0, kFakeWarmMotors, k == 20), t.fake.fault(0, kFakeCommError, k == 30);
      t.run(100);
    }
  }
  ASSERT_GT(record.size(), 6000u);
  ServoHand hand;
  size_t different = 0, felt = 0;
  for (const Recorded& r : record) {
    const Vec3 f = servo_step(hand, options, r.sample, r.fresh ? &r.patch : nullptr, r.now_ns).force;
    different += !(f == r.force);
    felt += length(f) > 0.1f;
  }
  EXPECT_EQ(different, 0u);
  EXPECT_GT(felt, 1000u);
}

// Warm motors and a fast hand are not a disconnection: the tool still moves, force is off and returns.
TEST(Touch, warm_motors) {
  Two t;
  t.open();
  engage(t, {0.9f, 0, 0}, {});
  t.fake.fault(0, kFakeWarmMotors, 1);
  t.run(60);
  EXPECT_EQ(t.input[0].connected, 1u);
  EXPECT_LT(length(t.fake.force(0)), 1e-4f);
  EXPECT_EQ(t.port.status(t.port.self, 0).error, 0x0200u);
  EXPECT_TRUE(t.port.status(t.port.self, 0).ready);
}

// S2: an error that cuts the force is reported with the next sample wherever the library raises it: at a frame's begin, at its
// end (where it sends the force), or in between. Without that, the servo would write full force when the cut ends.
TEST(Touch, force_errors_are_reported_wherever_they_are_raised) {
  for (const int where : {0, 1, 2})
    for (const unsigned code : {0x0200u, 0x0201u, 0x0202u, 0x0203u, 0x0204u}) {
      SCOPED_TRACE(testing::Message() << "place " << where << " code " << code);
      Two t;
      t.open();
      engage(t, {0.9f, 0, 0}, {0, 0.5f, 0});
      ASSERT_NEAR(length(t.fake.force(0)), 0.9f, 0.01f);
      t.fake.raise(0, 0, code, where, 300);
      int messages = 0;
      t.run(300, [&](int) { messages += t.sample[0].forced_off; });
      EXPECT_GE(messages, 298);
      EXPECT_EQ(length(t.fake.force(0)), 0) << "nothing is left to come back at once";
      EXPECT_NEAR(length(t.fake.force(1)), 0.5f, 0.01f) << "the other hand's";
      EXPECT_EQ(t.port.status(t.port.self, 0).error, code);
      t.run(5);
      EXPECT_FALSE(t.sample[0].forced_off) << "and it ends";
      EXPECT_TRUE(t.port.status(t.port.self, 0).ready);
    }
}

// An error belongs to the device named in its record, in any device's frame; the most severe of several is
// shown.
TEST(Touch, errors_go_to_the_arm_they_name) {
  Two t;
  t.open();
  engage(t, {0.9f, 0, 0}, {0, 0.5f, 0});
  t.fake.raise(0, 1, 0x0200, 1, 50);  // raised in the right arm's frame, about the left
  t.run(50);
  EXPECT_NEAR(length(t.fake.force(0)), 0.9f, 0.01f);
  EXPECT_EQ(length(t.fake.force(1)), 0);
  EXPECT_EQ(t.port.status(t.port.self, 0).errors, 0u);
  EXPECT_EQ(t.port.status(t.port.self, 1).error, 0x0200u);
  t.run(5);
  // The left device's connection breaks, detected in the right one's frame; a harmless error follows.
  t.fake.raise(0, 1, 0x0302, 1, 1);
  t.fake.raise(0, 1, 0x0100, 1, 1);
  t.run(2);
  EXPECT_EQ(t.port.status(t.port.self, 1).error, 0x0302u);
  EXPECT_EQ(t.input[1].connected, 0u);
  EXPECT_EQ(t.input[0].connected, 1u);
  t.run(600);
  EXPECT_EQ(t.input[1].connected, 1u) << "asked again, and back";
}

TEST(Touch, positions_that_are_no_numbers) {
  Two t;
  t.open();
  engage(t, {0.9f, 0, 0}, {0, 0.5f, 0});
  t.fake.fault(0, kFakeNan, 1);
  t.run(200, [&](int) { ASSERT_TRUE(is_finite(t.fake.force(0))); });
  EXPECT_EQ(length(t.fake.force(0)), 0);
  EXPECT_TRUE(is_finite(t.input[0].pose.p));
  EXPECT_TRUE(t.hand[0].limiter.faults & kNotFinite);
  EXPECT_NEAR(length(t.fake.force(1)), 0.5f, 1e-3f);
}

// A motor with reversed sign makes a spring unstable: the passivity controller detects the energy and the force stays
// within its cap.
TEST(Touch, a_flipped_axis) {
  Two t;
  t.open();
  ForcePatch spring = constant({});
  spring.stiffness = identity(300);
  t.patch = {spring, constant({})};
  t.run(2500);
  t.fake.fault(0, kFakeFlipX, 1);
  t.fake.wish(0, {0.003f, 0, 0});
  t.run(2000, [&](int) { ASSERT_LE(length(t.fake.force(0)), 3.3f + 1e-4f); });
  EXPECT_LE(t.fake.at(0).step_most, 0.5 + 1e-4);
}

// The scheduler itself stops: no more force can be written. The maker's watchdog handles the device; the simulation detects
// that the steps stop.
TEST(Touch, the_scheduler_stalls) {
  Two t;
  t.open();
  t.run(100);
  const uint64_t before = t.port.status(t.port.self, 0).steps;
  t.fake.fault(0, kFakeStall, 1);
  t.run(50);
  EXPECT_EQ(t.port.status(t.port.self, 0).steps, before);
  t.fake.fault(0, kFakeStall, 0);
  t.run(50);
  EXPECT_EQ(t.port.status(t.port.self, 0).steps, before + 50);
}

// Faults by environment, as in a manual test.
TEST(Touch, faults_by_environment) {
  Two t;
  setenv("FAKE_HD_FAULT", "comm_error:left:100:200,warm_motors:right:300:400", 1);
  t.fake.reset();
  t.open();
  t.run(150);
  EXPECT_EQ(t.input[1].connected, 0u);
  EXPECT_EQ(t.input[0].connected, 1u);
  t.run(1000);
  EXPECT_EQ(t.input[1].connected, 1u);
  EXPECT_EQ(t.port.status(t.port.self, 0).error, 0x0200u);
  unsetenv("FAKE_HD_FAULT");
}

TEST(Touch, one_arm_is_missing) {
  Two t;
  setenv("FAKE_HD_MISSING", "left", 1);
  t.fake.reset();
  t.open();
  ASSERT_EQ(t.messages.size(), 1u);
  EXPECT_NE(t.messages[0].find("no left device"), std::string::npos) << t.messages[0];
  EXPECT_TRUE(t.port.arm[0].present);
  t.run(100);
  EXPECT_EQ(t.calls[0], 100u);
  EXPECT_EQ(t.calls[1], 0u);
}

TEST(Touch, nothing_to_work_with_is_one_line) {
  FakeHd fake(true);
  const auto line = [](const char* needle, const TouchOptions& options = {}) {
    std::vector<std::string> messages;
    const ArmPort port = open_touch(options, messages);
    EXPECT_FALSE(port.any());
    ASSERT_FALSE(messages.empty());
    EXPECT_NE(messages.back().find(needle), std::string::npos) << messages.back();
    EXPECT_EQ(messages.back().find('\n'), std::string::npos);
  };
  setenv("FAKE_HD_MISSING", "all", 1);
  fake.reset();
  line("device");
  unsetenv("FAKE_HD_MISSING");
  setenv("FAKE_HD_UNCALIBRATED", "1", 1);
  fake.reset();
  line("inkwell");
  unsetenv("FAKE_HD_UNCALIBRATED");
  TouchOptions o;
  o.library = "/nowhere/libHD.so";
  line("install OpenHaptics", o);
  o.library = "libc.so.6";
  line("lacks the function hdInitDevice", o);
}

TEST(Touch, an_arm_left_open_by_a_crash_is_taken_over) {
  Two t;
  setenv("FAKE_HD_BUSY", "3", 1);
  t.fake.reset();
  t.open();
  EXPECT_TRUE(t.port.arm[0].present && t.port.arm[1].present);
}

// Closing reduces the force at the slew rate, then switches the motors off.
TEST(Touch, leaving) {
  FakeHd fake(false);  // with its own thread, as stop() waits for it
  std::vector<std::string> messages;
  ArmPort port = open_touch({}, messages);
  ASSERT_TRUE(port.any());
  std::string why;
  struct Hold {
    static ArmForce step(void*, size_t, const ArmSample&) { return {{0, 2, 0}, {}, 0}; }
  };
  ASSERT_TRUE(port.start(port.self, {Hold::step, nullptr}, why)) << why;
  for (int k = 0; k < 2000 && length(fake.force(1)) < 1; ++k) {
    timespec nap{0, 1000000};
    nanosleep(&nap, nullptr);
  }
  ASSERT_GT(length(fake.force(0)), 1);
  fake.zero(0);
  port.stop(port.self);
  EXPECT_LE(fake.at(0).step_most, 0.5 + 1e-6);
  EXPECT_EQ(fake.at(0).force_output, 0);
  EXPECT_EQ(fake.at(1).force_output, 0);
}

}  // namespace
}  // namespace catgut
