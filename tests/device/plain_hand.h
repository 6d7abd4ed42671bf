// SPDX-License-Identifier: Apache-2.0
// tests/device: a hand on a simulated device: a mass on a spring to where the hand means to be, in any axes. SI units. Shared
// by the doubles; it knows nothing of the programs under test.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <random>
#include <utility>

// What a real device does and an ideal one does not; all zero: ideal.
struct UnkindDevice {
  double encoder = 0;         // [m] step of the position
  int transport = 0;          // [ms] from a command to the motors
  double jitter = 0;          // [ms] largest deviation of a period
  double late = 0, lost = 0;  // chance of a call that comes 2 to 8 ms late; of one that never comes
  double storm = 0;           // chance of an error at any call
};

struct PlainHand {
  using V = std::array<double, 3>;
  V x{}, v{}, wish{};
  double grip = 150, damping = 7.5, mass = 0.1, viscous = 0.25;  // of the hand; `viscous` of that is the device's own
  double to_hand = 0, to_hand_most = 0;                          // [J] out of the motors, less what the device's damping takes
  double force_most = 0, step_most = 0;                          // [N] at the motors
  V acting{};
  std::deque<std::pair<long, V>> on_the_way;
  long ms = 0;

  // A command that arrives `transport` milliseconds from now.
  void command(const V& force, int transport) {
    if (transport <= 0) act(force);
    else on_the_way.emplace_back(ms + transport, force);
  }
  void cut() {
    on_the_way.clear();
    acting = {};
  }
  void pass(bool output) {
    ++ms;
    for (; !on_the_way.empty() && on_the_way.front().first <= ms; on_the_way.pop_front()) act(on_the_way.front().second);
    if (!output) cut();
    constexpr double h = 1e-4;
    for (int part = 0; part < 10; ++part)
      for (size_t k = 0; k < 3; ++k) {
        v[k] += (acting[k] + grip * (wish[k] - x[k]) - (damping + viscous) * v[k]) * (h / mass);
        x[k] += v[k] * h;
        to_hand += (acting[k] - viscous * v[k]) * v[k] * h;
      }
    to_hand_most = std::max(to_hand_most, to_hand);
  }
  V seen(double encoder) const {
    if (encoder <= 0) return x;
    V s;
    for (size_t k = 0; k < 3; ++k) s[k] = std::round(x[k] / encoder) * encoder;
    return s;
  }
  void zero() { to_hand = to_hand_most = force_most = step_most = 0; }

 private:
  void act(const V& force) {
    double step = 0, size = 0;
    for (size_t k = 0; k < 3; ++k) step += (force[k] - acting[k]) * (force[k] - acting[k]), size += force[k] * force[k];
    step_most = std::max(step_most, std::sqrt(step)), force_most = std::max(force_most, std::sqrt(size));
    acting = force;
  }
};

// When the next call comes, in milliseconds, and by how much it deviates.
struct UnkindPeriods {
  std::mt19937 chance{3};
  double uniform() { return std::uniform_real_distribution<double>(0, 1)(chance); }
  int next(const UnkindDevice& u) {
    int period = 1;
    if (u.lost > 0 && uniform() < u.lost) period += 1;
    if (u.late > 0 && uniform() < u.late) period += static_cast<int>(2 + 7 * uniform());
    return period;
  }
  long deviation_ns(const UnkindDevice& u) {
    return u.jitter > 0 ? static_cast<long>(1e6 * u.jitter * (2 * uniform() - 1)) : 0;
  }
};
