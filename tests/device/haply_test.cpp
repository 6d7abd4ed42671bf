// SPDX-License-Identifier: Apache-2.0
// tests/device: the backend of Haply's devices with a service of the same protocol, over a WebSocket like the real one. The
// servo in between is the real one. One message is one millisecond of the devices. The first device is the left
// hand's.
#include "device/haply.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdio>
#include <functional>
#include <thread>

#include "fake_haply/fake_haply.h"
#include "haptic/servo.h"

namespace catgut {
namespace {

bool wait_for(const std::function<bool()>& done) {
  for (int k = 0; k < 20000; ++k) {
    if (done()) return true;
    std::this_thread::sleep_for(std::chrono::microseconds(500));
  }
  return false;
}

// In our axes.
Vec3 ours(const std::array<double, 3>& v) {
  return {static_cast<float>(v[0]), static_cast<float>(v[2]), static_cast<float>(-v[1])};
}
Vec3 force_of(const FakeHaply::Arm& a) { return ours(a.force); }

// An encoder of 0.05 mm, 2 ms to the motors, periods that vary, messages that are late or lost.
constexpr UnkindDevice kUnkind{5e-5, 2, 0.2, 0.002, 0.002, 0};

struct Two {
  FakeHaply fake;
  std::vector<std::string> messages;
  ArmPort port;
  std::array<ServoHand, 2> hand;
  std::array<ServoOptions, 2> options;
  std::array<std::atomic<float>, 2> pull{};  // [N] along x right, y up
  std::array<std::atomic<uint64_t>, 2> physics_ns{};
  std::array<ArmSample, 2> sample;  // of a backend that is stopped
  std::array<std::atomic<bool>, 2> there{};
  std::array<std::atomic<float>, 2> turned{};      // [rad] of the grip
  std::array<std::atomic<uint32_t>, 2> buttons{};  // of the grip
  std::array<std::atomic<uint64_t>, 2> now_ns{};
  std::atomic<float> wall{0};  // [N/m] of a wall at the height 0.15 m, for the right hand

  static ArmForce step(void* user, size_t k, const ArmSample& s) {
    Two& t = *static_cast<Two*>(user);
    const uint64_t now = t.now_ns[k] = t.fake.now();
    t.sample[k] = s;
    ForcePatch p;
    p.point = s.pose.p;
    p.period = 0.016f, p.time_ns = t.physics_ns[k] ? t.physics_ns[k].load() : now;
    (k == 0 ? p.force.x : p.force.y) = t.pull[k];
    if (const float stiff = t.wall; stiff > 0 && k == 0) {
      const float depth = 0.15f - s.pose.p.y;
      p.normal = {0, 1, 0}, p.stiffness = outer({0, 1, 0}, stiff);
      p.gap = std::max(0.0f, depth), p.force = {0, stiff * p.gap, 0};
      if (depth < 0) p.point.y = 0.15f;
    }
    const ServoOut out = servo_step(t.hand[k], t.options[k], s, &p, now);
    t.there[k] = out.hand.connected;
    if (s.state == ArmState::ready) t.turned[k] = length(rotation_vector(s.pose.q)), t.buttons[k] = s.buttons;
    return out;
  }
  explicit Two(HaplyForm form = HaplyForm::v35, int arms = 2, bool unkind = false) : fake(form, arms) {
    if (unkind) fake.unkind(kUnkind);
    for (size_t k = 0; k < 2; ++k) fake.hold_with(k, 1e4, 60, 0.1);  // firmly: a constant pull moves nothing
    fake.hold(true);
    HaplyOptions o;
    o.where = fake.where();
    o.patience = 5, o.forget = 5, o.paced = false;  // this machine may be busy
    port = open_haply(o, messages);
    for (const std::string& line : messages) ADD_FAILURE() << line;
    for (size_t k = 0; k < 2; ++k) fit_to_arm(options[k], port.arm[k].limits), options[k].limiter.ramp = 0.2f;
    std::string why;
    if (port.any()) { EXPECT_TRUE(port.start(port.self, {step, this}, why)) << why; }
  }
  ~Two() {
    fake.hold(false);
    port.reset();
  }
  Vec3 force(size_t h) const { return force_of(fake.at(h == 0 ? 1 : 0)); }
  template <typename F>
  void run(int packets, const F& each) {
    for (int k = 0; k < packets; ++k) fake.step(1), each(k);
  }
  void engage(float right, float left) {
    fake.step(300);
    pull[0] = right, pull[1] = left;
    fake.step(300);
    fake.zero(0), fake.zero(1);
  }
};

TEST(Haply, both_forms_of_the_service) {
  for (const HaplyForm form : {HaplyForm::v31, HaplyForm::v35}) {
    Two t(form);
    ASSERT_TRUE(t.port.arm[0].present && t.port.arm[1].present);
    EXPECT_EQ(t.port.arm[0].serial, "haply-049D");
    EXPECT_EQ(t.port.arm[1].serial, "haply-04BA") << "as the service says which hand's it is";
    EXPECT_EQ(t.options[0].limiter.force, 2) << "S8: an Inverse3's";
    t.engage(0.5f, 0.4f);
    // H9: two devices, two forces, both in the form that the service reads.
    EXPECT_LT(distance(t.force(0), {0.5f, 0, 0}), 1e-3f);
    EXPECT_LT(distance(t.force(1), {0, 0.4f, 0}), 1e-3f);
    EXPECT_EQ(t.fake.last().find("session") != std::string::npos, false) << "said once";
    EXPECT_EQ(t.fake.last().find("vector") != std::string::npos, form == HaplyForm::v35);
  }
}

TEST(Haply, poses_come_whole) {
  Two t;
  t.fake.step(10);
  t.fake.hold(false);
  t.port.stop(t.port.self);  // from here on the samples stand still
  EXPECT_LT(distance(t.sample[1].pose.p, {0, 0.15f, 0.12f}), 1e-6f);
  // Their z is our y. A grip without rotation points along their y: our -z, like an unrotated tool.
  EXPECT_LT(length(rotation_vector(t.sample[1].pose.q * conjugate(axis_angle({0, 1, 0}, 0.5f * kPi)))), 1e-5f);
  EXPECT_LT(length(rotation_vector(t.sample[0].pose.q)), 1e-5f);
  EXPECT_EQ(t.sample[1].buttons, 1u);
  EXPECT_EQ(t.sample[0].buttons, 0u);
}

TEST(Haply, the_physics_dies) {
  for (const bool unkind : {false, true}) {
    SCOPED_TRACE(unkind ? "unkind" : "ideal");
    Two t(HaplyForm::v35, 2, unkind);
    t.engage(0.9f, 0.6f);
    const Vec3 left = t.force(1);
    // To the bit; with encoder steps the account damps a pull that no contact explains.
    const auto unmoved = [&] { return distance(t.force(1), left) <= (unkind ? 0.02f : 0); };
    t.physics_ns[0] = t.now_ns[0].load();
    const uint64_t from = t.fake.now();
    uint64_t zero = 0;  // [ms]
    t.run(150, [&](int) {
      if (length(t.force(0)) == 0 && zero == 0) zero = (t.fake.now() - from) / 1000000;
      ASSERT_TRUE(unmoved());
    });
    EXPECT_GT(zero, 30u);
    EXPECT_LE(zero, 100u);
    EXPECT_LE(t.fake.at(1).step_most, 0.5 + 1e-4);
  }
}

// One device is lost and returns; the other's force is unchanged to the bit.
TEST(Haply, H7_an_arm_is_lost) {
  for (const bool unkind : {false, true}) {
    SCOPED_TRACE(unkind ? "unkind" : "ideal");
    Two t(HaplyForm::v35, 2, unkind);
    t.engage(0.9f, 0.6f);
    const Vec3 left = t.force(1);
    // To the bit; with encoder steps the account damps a pull that no contact explains.
    const auto unmoved = [&] { return distance(t.force(1), left) <= (unkind ? 0.02f : 0); };
    t.fake.there(1, false);
    t.run(100, [&](int k) {
      ASSERT_TRUE(unmoved());
      if (k > 1) { ASSERT_EQ(length(t.force(0)), 0); }
    });
    EXPECT_FALSE(t.there[0]);
    EXPECT_TRUE(t.there[1]);
    EXPECT_NE(t.port.error_text(t.port.self, t.port.status(t.port.self, 0).error).find("lost the device"), std::string::npos);
    t.fake.there(1, true);
    t.run(200, [&](int) { ASSERT_EQ(length(t.force(0)), 0) << "what is wanted is not small: it must not engage"; });
    EXPECT_TRUE(t.there[0]);
    EXPECT_TRUE(unmoved());
  }
}

// H3: hands of every grip press a wall of 300 N/m and hold still, on ideal and on imperfect devices.
TEST(Haply, H3_a_wall_is_passive) {
  for (const bool unkind : {false, true})
    for (const double grip : {50.0, 150.0, 800.0}) {
      Two t(HaplyForm::v35, 2, unkind);
      t.wall = 300;
      t.fake.hold_with(1, grip, 4, 0.1);
      const auto wish = [&t](double y) { t.fake.wish(1, {0, -0.12, 0.15 + y}); };
      wish(0.004);
      t.fake.step(500);
      t.fake.zero(1);
      const double deep = 0.004 + 1 / grip;
      for (int i = 0; i <= 40; ++i) wish(0.004 - deep * i / 40), t.fake.step(10);
      t.fake.step(600);
      double low = 1e9, high = -1e9;
      t.run(300, [&](int) {
        const double y = t.fake.at(1).position[2];
        low = std::min(low, y), high = std::max(high, y);
      });
      const float felt = length(t.force(0));
      for (int i = 40; i >= 0; --i) wish(0.004 - deep * i / 40), t.fake.step(10);
      t.fake.step(200);
      const FakeHaply::Arm a = t.fake.at(1);
      std::printf("H3: Haply, %s, grip %.0f N/m: %.2f N, %.3f mJ to the hand, swing %.3f mm, step %.3f N\n",
                  unkind ? "unkind" : "ideal", grip, double{felt}, 1e3 * a.to_hand_most, 1e3 * (high - low), a.step_most);
      EXPECT_GT(felt, 0.2f);
      EXPECT_LE(a.to_hand_most, 0.5e-3);
      EXPECT_LE(high - low, 0.2e-3);
      EXPECT_LE(a.step_most, 0.5 + 1e-4);
    }
}

// Messages that are none, or lack a device or a grip, in any order, with imperfect timing: no step, nothing over what is
// wanted, the right hand's grip stays the right hand's, and both devices are there again at the end.
TEST(Haply, errors_at_any_message_in_any_order) {
  Two t(HaplyForm::v35, 2, true);
  t.engage(0, 0);
  UnkindDevice storm = kUnkind;
  storm.storm = 0.01;
  t.fake.unkind(storm);
  float most = 0;
  int turned = 0;
  t.run(3000, [&](int k) {
    // What is wanted comes and goes, so that the force can engage again.
    t.pull[0] = 0.5f * std::max(0.0f, std::sin(2 * kPi * 0.003f * static_cast<float>(k)));
    most = std::max(most, length(t.force(0)));
    turned += t.turned[0] > 1e-3f || t.buttons[0] != 0;
  });
  const unsigned long nonsense = t.fake.nonsense();
  t.fake.unkind(kUnkind);
  t.pull[0] = 0;
  t.fake.step(100);
  std::printf("storm: %lu messages of nonsense, step %.3f N, at most %.2f N\n", nonsense, t.fake.at(1).step_most, double{most});
  EXPECT_GT(nonsense, 10u);
  EXPECT_EQ(turned, 0);
  EXPECT_TRUE(t.there[0] && t.there[1]);
  EXPECT_LE(t.fake.at(1).step_most, 0.5 + 1e-4);
  EXPECT_GT(most, 0.1f);
  EXPECT_LE(most, 0.51f);
}

// S7: the right hand's grip stays the right hand's when the left arm, the left grip, or both leave and come back.
TEST(Haply, grips_belong_to_their_arms) {
  Two t;
  t.fake.step(5);
  const auto right_is_right = [&](const char* when) {
    EXPECT_LT(t.turned[0], 1e-3f) << when;
    EXPECT_EQ(t.buttons[0], 0u) << when;
  };
  right_is_right("at first");
  EXPECT_NEAR(t.turned[1], 0.5f * kPi, 1e-3f);
  EXPECT_EQ(t.buttons[1], 1u);
  for (const int gone : {1, 2, 3}) {  // arm, grip, both
    if (gone & 1) t.fake.there(0, false);
    if (gone & 2) t.fake.grip(0, false);
    t.fake.step(20);
    right_is_right("while the left one is gone");
    EXPECT_EQ(t.there[1], (gone & 1) == 0);
    if (gone == 2) {
      EXPECT_NEAR(t.turned[1], 0.5f * kPi, 1e-3f) << "a grip out of range has not turned";
      EXPECT_EQ(t.buttons[1], 1u) << "nor let go";
    }
    t.fake.there(0, true), t.fake.grip(0, true);
    t.fake.step(20);
    right_is_right("when it is back");
    EXPECT_NEAR(t.turned[1], 0.5f * kPi, 1e-3f);
  }
}

// For any message of the service: no crash, and no step in the force.
TEST(Haply, answers_that_are_none) {
  Two t;
  t.engage(0.9f, 0.6f);
  for (const char* text :
       {"{", "[]", "null", "7", "\"x\"", "{\"inverse3\":7}", "{\"inverse3\":[7,null,[]]}", "{\"inverse3\":[{\"device_id\":4}]}",
        "{\"inverse3\":[{\"device_id\":\"049D\",\"state\":{\"cursor_position\":{\"x\":1e99,\"y\":0,\"z\":0}}}]}",
        "{\"inverse3\":[{\"device_id\":\"049D\",\"state\":{\"cursor_position\":{\"x\":\"a\"}}}]}",
        "{\"inverse3\":[{\"device_id\":\"049D\",\"state\":null}],\"wireless_verse_grip\":[[]]}"}) {
    SCOPED_TRACE(text);
    t.fake.say(text);
    t.run(3, [&](int) { ASSERT_LE(length(t.force(0)), 0.91f); });
  }
  t.pull[0] = t.pull[1] = 0;
  t.fake.step(300);
  EXPECT_TRUE(t.there[0] && t.there[1]);
}

// In real time: the service stops answering, its connection is cut, then it returns. Both devices are lost, and return.
TEST(Haply, the_service_stands_still) {
  FakeHaply fake;
  HaplyOptions o;
  o.where = fake.where();
  o.patience = 5;
  std::vector<std::string> messages;
  ArmPort port = open_haply(o, messages);
  ASSERT_TRUE(port.any());
  static std::atomic<uint64_t> lost{0};
  lost = 0;
  const auto step = [](void*, size_t, const ArmSample& s) {
    lost += s.state == ArmState::absent;
    return ArmForce{{0, 0.3f, 0}, {}, 0};
  };
  std::string why;
  ASSERT_TRUE(port.start(port.self, {step, nullptr}, why));
  const auto ready = [&](bool is) {
    return wait_for([&] { return port.status(port.self, 0).ready == is && port.status(port.self, 1).ready == is; });
  };
  ASSERT_TRUE(ready(true));
  fake.hold(true);
  EXPECT_TRUE(ready(false));
  EXPECT_TRUE(wait_for([] { return lost > 10; })) << "the servo still has its millisecond";
  EXPECT_TRUE(wait_for([&] { return length(force_of(fake.at(0))) == 0; }));
  fake.hold(false);
  EXPECT_TRUE(ready(true));
  fake.say("\xff\xfe");  // not text: the connection is closed
  EXPECT_TRUE(ready(false));
  EXPECT_TRUE(ready(true)) << "a new line";
  fake.hang_up();
  EXPECT_TRUE(ready(false));
  EXPECT_TRUE(ready(true)) << "a new line";
  EXPECT_TRUE(wait_for([&] { return length(force_of(fake.at(0))) > 0.2f; }));
  fake.zero(0);
  port.stop(port.self);
  EXPECT_TRUE(wait_for([&] { return length(force_of(fake.at(0))) == 0; }));
  EXPECT_LE(fake.at(0).step_most, 0.5 + 1e-4);
}

TEST(Haply, nothing_to_work_with_is_one_line) {
  const auto line = [](const std::string& where, const char* needle) {
    std::vector<std::string> messages;
    HaplyOptions o;
    o.where = where;
    o.patience = 0.2f;
    EXPECT_FALSE(open_haply(o, messages).any()) << needle;
    ASSERT_EQ(messages.size(), 1u);
    EXPECT_NE(messages[0].find(needle), std::string::npos) << messages[0];
    EXPECT_EQ(messages[0].find('\n'), std::string::npos);
  };
  std::string gone;
  {
    FakeHaply fake;
    gone = fake.where();
  }
  line(gone, "no Inverse service answers");
  line("127.0.0.1:nothing", "no Inverse service at");
  FakeHaply none(HaplyForm::v35, 0);
  line(none.where(), "has no device");
  FakeHaply other;
  other.inventory("{\"device\":[]}");
  line(other.where(), "has an unknown version");
  FakeHaply raw;
  raw.inventory(R"({"inverse3":[{"device_id":"04BA","status":{"calibrated":false}}]})");
  line(raw.where(), "not calibrated");
  FakeHaply quotes;
  quotes.inventory(R"({"inverse3":[{"device_id":"04\"BA"}]})");
  line(quotes.where(), "has no device");
}

}  // namespace
}  // namespace catgut
