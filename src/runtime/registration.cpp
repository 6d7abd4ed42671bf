// SPDX-License-Identifier: Apache-2.0
// runtime/registration: see the header. Source: B. K. P. Horn, Closed-form solution of absolute orientation using unit
// quaternions, J. Opt. Soc. Am. A 4(4), 1987, doi 10.1364/JOSAA.4.000629.
#include "runtime/registration.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>
#include <vector>

#include "core/check.h"
#include "exchange/latest.h"
#include "runtime/live.h"

namespace catgut {
namespace {

constexpr std::array<RegistrationMark, 5> kMarks{{{"the center", {0, 0, 0}},
                                                  {"the right mark", {0.05f, 0, 0}},
                                                  {"the left mark", {-0.05f, 0, 0}},
                                                  {"the far mark", {0, 0, -0.05f}},
                                                  {"the near mark", {0, 0, 0.05f}}}};
constexpr float kPlausible = 0.003f, kScale = 0.05f;  // [m], part
constexpr float kLeastSpread = 0.005f;                // [m] of points that determine a rotation

using Matrix4 = std::array<std::array<double, 4>, 4>;

// Eigenvector of the largest eigenvalue: the matrix, made positive, is squared until that one alone is left.
std::array<double, 4> dominant(Matrix4 m) {
  double shift = 0;
  for (const auto& row : m)
    for (const double x : row) shift += std::abs(x);
  for (size_t i = 0; i < 4; ++i) m[i][i] += shift;
  for (int n = 0; n < 40; ++n) {
    Matrix4 square{};
    double most = 0;
    for (size_t i = 0; i < 4; ++i)
      for (size_t j = 0; j < 4; ++j) {
        for (size_t k = 0; k < 4; ++k) square[i][j] += m[i][k] * m[k][j];
        most = std::max(most, std::abs(square[i][j]));
      }
    if (most <= 0) break;
    for (auto& row : square)
      for (double& x : row) x /= most;
    m = square;
  }
  size_t column = 0;
  for (size_t k = 1; k < 4; ++k)
    if (m[k][k] > m[column][column]) column = k;
  return {m[0][column], m[1][column], m[2][column], m[3][column]};
}

}  // namespace

std::span<const RegistrationMark> registration_marks() { return kMarks; }

Registration fit_registration(std::span<const Vec3> device, std::span<const Vec3> card) {
  Registration r;
  const size_t n = device.size();
  if (n < 3 || card.size() != n) return r;
  Vec3 from, to;
  for (size_t i = 0; i < n; ++i) from += device[i] / static_cast<float>(n), to += card[i] / static_cast<float>(n);
  double s[3][3] = {}, spread_from = 0, spread_to = 0;
  for (size_t i = 0; i < n; ++i) {
    const Vec3 a = device[i] - from, b = card[i] - to;
    const double x[3] = {double{a.x}, double{a.y}, double{a.z}}, y[3] = {double{b.x}, double{b.y}, double{b.z}};
    for (int p = 0; p < 3; ++p)
      for (int q = 0; q < 3; ++q) s[p][q] += x[p] * y[q];
    spread_from += double{length2(a)}, spread_to += double{length2(b)};
  }
  if (!(std::sqrt(spread_from / static_cast<double>(n)) > double{kLeastSpread})) return r;
  const Matrix4 horn{{{s[0][0] + s[1][1] + s[2][2], s[1][2] - s[2][1], s[2][0] - s[0][2], s[0][1] - s[1][0]},
                      {s[1][2] - s[2][1], s[0][0] - s[1][1] - s[2][2], s[0][1] + s[1][0], s[2][0] + s[0][2]},
                      {s[2][0] - s[0][2], s[0][1] + s[1][0], s[1][1] - s[0][0] - s[2][2], s[1][2] + s[2][1]},
                      {s[0][1] - s[1][0], s[2][0] + s[0][2], s[1][2] + s[2][1], s[2][2] - s[0][0] - s[1][1]}}};
  const std::array<double, 4> q = dominant(horn);
  r.turn =
      normalized(Quat{static_cast<float>(q[1]), static_cast<float>(q[2]), static_cast<float>(q[3]), static_cast<float>(q[0])});
  r.scale = static_cast<float>(std::sqrt(spread_to / spread_from));
  r.center = from - rotate(conjugate(r.turn), to);
  for (size_t i = 0; i < n; ++i) {
    const float off = distance(rotate(r.turn, device[i] - r.center), card[i]);
    r.rms += off * off / static_cast<float>(n);
    r.worst = std::max(r.worst, off);
  }
  r.rms = std::sqrt(r.rms);
  r.valid = std::isfinite(r.rms) && std::isfinite(r.turn.w);
  return r;
}

bool is_plausible(const Registration& r) { return r.valid && r.worst <= kPlausible && std::abs(r.scale - 1) <= kScale; }

namespace {

struct Watch {
  std::array<Latest<ArmSample>, 2> box;
  std::array<bool, 2> present{};
  static ArmForce step(void* user, size_t arm, const ArmSample& s) {
    Latest<ArmSample>& box = static_cast<Watch*>(user)->box[arm];
    box.draft() = s;
    box.publish();
    return {};
  }
  ArmSample look(size_t k) {
    box[k].update();
    return box[k].seen();
  }
};

// Waits for the first button of one of the devices in `of` (bits) to be let go, then pressed. Which; 2: none.
size_t pressed(Watch& watch, unsigned of, float patience, const std::atomic<bool>& stop) {
  std::array<bool, 2> ready{};
  for (const double until = wall_seconds() + double{patience}; wall_seconds() < until && !stop;) {
    for (size_t k = 0; k < 2; ++k) {
      const ArmSample s = watch.look(k);
      if (!watch.present[k] || !(of & (1u << k)) || s.state != ArmState::ready) continue;
      if (!(s.buttons & 1)) ready[k] = true;
      else if (ready[k]) return k;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return 2;
}

// Mean position of device k while it holds still; false: it did not.
bool held_at(Watch& watch, size_t k, const RegistrationOptions& o, const std::atomic<bool>& stop, Vec3& at) {
  for (const double give_up = wall_seconds() + double{o.patience}; wall_seconds() < give_up && !stop;) {
    const Vec3 first = watch.look(k).pose.p;
    Vec3 sum;
    float far = 0;
    int n = 0;
    for (const double until = wall_seconds() + double{o.steady}; wall_seconds() < until;) {
      const ArmSample s = watch.look(k);
      if (s.state != ArmState::ready || !is_finite(s.pose.p)) far = 1e9f;
      sum += s.pose.p, ++n;
      far = std::max(far, distance(s.pose.p, first));
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    if (far > o.still) continue;
    at = sum / static_cast<float>(n);
    return true;
  }
  return false;
}

}  // namespace

RegistrationResult register_arms(ArmPort port, const RegistrationOptions& options,
                                 const std::function<void(const std::string&)>& say, const std::atomic<bool>& stop) {
  RegistrationResult result;
  Watch watch;
  unsigned all = 0;
  for (size_t k = 0; k < 2; ++k)
    if (port.arm[k].present) watch.present[k] = true, all |= 1u << k;
  std::string why;
  if (!port.start(port.self, {Watch::step, &watch}, why))
    throw InputError(port.kind, why, "close other programs that use the devices");
  const auto ended = [&] {
    port.stop(port.self);
    return result;
  };
  if (all == 3) {
    say("press the first button of the device in your RIGHT hand");
    const size_t right = pressed(watch, all, options.patience, stop);
    if (right > 1) return ended();
    result.hand = {right == 0 ? size_t{0} : size_t{1}, right == 0 ? size_t{1} : size_t{0}};
    if (right == 1) say("the devices are listed the other way round; this is saved");
  }
  std::array<Vec3, kMarks.size()> card;
  for (size_t i = 0; i < kMarks.size(); ++i) card[i] = kMarks[i].at;
  for (size_t hand = 0; hand < 2; ++hand)
    for (size_t k = 0; k < 2; ++k) {
      if (!watch.present[k] || result.hand[k] != hand) continue;
      std::array<Vec3, kMarks.size()> device;
      for (size_t i = 0; i < kMarks.size(); ++i) {
        say(std::string(hand == 0 ? "right" : "left") + " device: touch " + kMarks[i].name +
            " of the card with the tip, press the first button and hold still");
        if (pressed(watch, 1u << k, options.patience, stop) > 1 || !held_at(watch, k, options, stop, device[i])) return ended();
      }
      result.fit[k] = fit_registration(device, card);
      result.done[k] = true;
    }
  return ended();
}

}  // namespace catgut
