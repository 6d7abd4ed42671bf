// SPDX-License-Identifier: Apache-2.0
// tests/runtime: registration of the devices on the table: the fit against rotations it does not know, its residual against
// noise of known size, and the whole dialog with simulated devices in either order.
#include "runtime/registration.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <thread>
#include <vector>

#include "../device/fake_hd/load.h"
#include "core/random.h"
#include "device/touch.h"
#include "procedure/arm_places.h"
#include "runtime/haptics.h"

namespace catgut {
namespace {

std::vector<Vec3> marks() {
  std::vector<Vec3> at;
  for (const RegistrationMark& m : registration_marks()) at.push_back(m.at);
  return at;
}

// Any rotation and place, half turns included: found to 1e-5. A residual of 0.5 mm per axis is reported as such.
TEST(Registration, finds_any_rotation_and_reports_its_residual) {
  Random random(3);
  const std::vector<Vec3> card = marks();
  double worst = 0, square = 0;
  constexpr int kTries = 300;
  for (int n = 0; n < kTries; ++n) {
    const Vec3 axis = normalized(Vec3{random.uniform() - 0.5f, random.uniform() - 0.5f, random.uniform() - 0.5f}, {0, 1, 0});
    const Quat turn = axis_angle(axis, n % 10 == 0 ? kPi : 2 * kPi * random.uniform());
    const Vec3 center{0.1f * random.uniform(), -0.05f, 0.2f * random.uniform()};
    std::vector<Vec3> device, rough;
    const auto noise = [&random] {  // 0.5 mm standard deviation
      return 0.0005f * (random.uniform() + random.uniform() + random.uniform() - 1.5f) * 2;
    };
    for (const Vec3 m : card) {
      device.push_back(center + rotate(conjugate(turn), m));
      rough.push_back(device.back() + Vec3{noise(), noise(), noise()});
    }
    const Registration exact = fit_registration(device, card);
    ASSERT_TRUE(exact.valid);
    EXPECT_LT(length(rotation_vector(exact.turn * conjugate(turn))), 1e-4f);
    EXPECT_LT(distance(exact.center, center), 1e-6f);
    EXPECT_LT(exact.worst, 1e-6f);
    EXPECT_NEAR(exact.scale, 1, 1e-4f);
    EXPECT_TRUE(is_plausible(exact));
    const Registration r = fit_registration(rough, card);
    worst = std::max(worst, double{length(rotation_vector(r.turn * conjugate(turn)))});
    square += double{r.rms} * double{r.rms} / kTries;
  }
  // 15 coordinates less 6 of the fit: 0.5 mm * sqrt(9 / 5) per point.
  const double expected = 0.5e-3 * std::sqrt(9.0 / 5);
  std::printf("registration: 0.5 mm per axis: residual %.3f mm RMS (expected %.3f), rotation off by %.2f degrees at most\n",
              1e3 * std::sqrt(square), 1e3 * expected, worst * 180 / 3.14159265);
  EXPECT_NEAR(std::sqrt(square), expected, 0.1 * expected);
  EXPECT_LT(worst, 0.05);
}

TEST(Registration, refuses_what_determines_nothing) {
  std::vector<Vec3> card = marks(), device = card;
  EXPECT_TRUE(is_plausible(fit_registration(device, card)));
  std::swap(device[1], device[3]);
  EXPECT_FALSE(is_plausible(fit_registration(device, card))) << "touched in another order";
  for (Vec3& p : device) p = {0.01f, 0, 0};
  EXPECT_FALSE(fit_registration(device, card).valid) << "always at the same point";
  device = card;
  for (Vec3& p : device) p *= 1.2f;
  EXPECT_FALSE(is_plausible(fit_registration(device, card))) << "a device that measures 20 % too much";
  device[2].x = std::nanf("");
  EXPECT_FALSE(is_plausible(fit_registration(device, card)));
  device.resize(2), card.resize(2);
  EXPECT_FALSE(fit_registration(device, card).valid);
}

// A user touches the marks with each stylus; the devices stand turned on the table, and in one run each is in the other hand.
TEST(Registration, the_dialog_with_two_devices) {
  for (const bool exchanged : {false, true}) {
    SCOPED_TRACE(exchanged);
    FakeHd fake(false);
    std::vector<std::string> messages, said;
    const std::array<Quat, 2> turn{axis_angle({0, 1, 0}, 0.35f), axis_angle(normalized(Vec3{0.1f, 1, 0}), -0.6f)};
    const Vec3 center{0.01f, -0.02f, 0.005f};
    RegistrationOptions o;
    o.patience = 10, o.steady = 0.03f;
    std::atomic<bool> stop{false};
    const auto say = [&](const std::string& line) {
      said.push_back(line);
      size_t mark = 0;
      const size_t hand = line.rfind("left", 0) == 0 ? 1 : 0, device = exchanged ? 1 - hand : hand;
      if (line.find("listed the other way") != std::string::npos) return;
      for (size_t i = 0; i < registration_marks().size(); ++i)
        if (line.find(registration_marks()[i].name) != std::string::npos) mark = i;
      const Vec3 at = center + rotate(conjugate(turn[device]), registration_marks()[mark].at);
      fake.put(static_cast<int>(device), at);
      fake.wish(static_cast<int>(device), at, {}, 0);
      std::thread([&fake, device, at] {
        std::this_thread::sleep_for(std::chrono::milliseconds(60));
        fake.wish(static_cast<int>(device), at, {}, 1);
      }).detach();
    };
    ArmPort port = open_touch({}, messages);
    const std::array<ArmInfo, 2> arm = port.arm;
    const RegistrationResult r = register_arms(std::move(port), o, say, stop);
    EXPECT_EQ(r.hand[0], exchanged ? 1u : 0u);
    std::map<std::string, ArmPlace> places;
    for (size_t k = 0; k < 2; ++k) {
      ASSERT_TRUE(r.done[k]);
      EXPECT_TRUE(is_plausible(r.fit[k]));
      EXPECT_LT(r.fit[k].worst, 2e-4f);
      EXPECT_LT(length(rotation_vector(r.fit[k].turn * conjugate(turn[k]))), 0.01f);
      EXPECT_LT(distance(r.fit[k].center, center), 2e-4f);
      ArmPlace& p = places[arm[k].serial];
      p.middle = r.fit[k].center, p.rotation = r.fit[k].turn, p.residual = r.fit[k].rms, p.hand = static_cast<int>(r.hand[k]);
    }
    EXPECT_EQ(said.size(), exchanged ? 12u : 11u);
    // Saved, read, used: the card's axes are the field's, and each device moves on its hand's side.
    const std::string file = testing::TempDir() + "registered.toml";
    write_arm_places(file, places);
    const auto kept = read_arm_places(file);
    const std::array<size_t, 2> side = sides_of(arm, kept);
    EXPECT_EQ(side, r.hand);
    for (size_t k = 0; k < 2; ++k) {
      const Workspace w = workspace_of(arm[k], k, side[k], {}, kept);
      const Vec3 from = to_world(w, {center, {}}).p,
                 to = to_world(w, {center + rotate(conjugate(turn[k]), {0.05f, 0, 0}), {}}).p;
      EXPECT_LT(distance(to - from, {0.05f, 0, 0}), 6e-4f);
      EXPECT_EQ(from.x > 0, side[k] == 0);
    }
  }
}

// No mark is touched, or the user interrupts: it ends without a result.
TEST(Registration, ends_without_a_user) {
  FakeHd fake(false);
  std::vector<std::string> messages;
  RegistrationOptions o;
  o.patience = 0.2f;
  std::atomic<bool> stop{false};
  RegistrationResult r = register_arms(
      open_touch({}, messages), o, [](const std::string&) {}, stop);
  EXPECT_FALSE(r.done[0] || r.done[1]);
  stop = true;
  o.patience = 100;
  r = register_arms(
      open_touch({}, messages), o, [](const std::string&) {}, stop);
  EXPECT_FALSE(r.done[0] || r.done[1]);
}

}  // namespace
}  // namespace catgut
