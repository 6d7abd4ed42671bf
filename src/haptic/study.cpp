// SPDX-License-Identifier: Apache-2.0
// haptic/study: see the header.
#include "haptic/study.h"

#include <array>
#include <cmath>

namespace catgut {
namespace {

constexpr float kStep = 0.001f, kClamp = 3.3f;

// The hand's path: 5 mm above the wall, 8 mm behind it, back. Smooth (minimum jerk), like hands.
float hand_path(float t) {
  const auto rise = [](float s) {
    s = std::clamp(s, 0.0f, 1.0f);
    return s * s * s * (10 + s * (6 * s - 15));
  };
  return 0.005f - 0.013f * (rise((t - 0.1f) / 0.4f) - rise((t - 1.6f) / 0.4f));
}
constexpr float kHoldFrom = 0.8f, kHoldTo = 1.6f, kEnd = 2.2f;

// Tissue behind a coupling, in equilibrium: device at x, the wall at 0, tissue below. Returns force on device and slope.
struct Wall {
  float force = 0, slope = 0, tool = 0;
};
Wall press(const StudyCase& c, float x) {
  if (x >= 0) return {0, 0, x};
  // coupling (tool - x) = a1 z + a2 z^2 with z = -tool; solved for z.
  const float a = c.hardening, b = c.tissue + c.coupling, d = c.coupling * x;
  const float z = a > 0 ? (-b + std::sqrt(b * b - 4 * a * d)) / (2 * a) : -d / b;
  const float tangent = c.tissue + 2 * a * z;
  return {c.tissue * z + a * z * z, c.coupling * tangent / (c.coupling + tangent), -z};
}

}  // namespace

const char* rendering_name(Rendering r) {
  switch (r) {
    case Rendering::reference:
      return "full rate";
    case Rendering::held_force:
      return "held force";
    case Rendering::held_and_net:
      return "held force + energy net";
    case Rendering::coupling:
      return "virtual coupling";
    case Rendering::coupling_blend:
      return "virtual coupling, blended";
    case Rendering::local_model:
      return "local model";
  }
  return "";
}

StudyRow run_study(const StudyCase& c) {
  StudyRow row;
  float x = 0.005f, v = 0;
  const float period = 1 / c.rate;
  // The physics samples the device at the start of a frame; its result arrives one frame later.
  Wall heard, thinking = press(c, x), before = heard;
  float heard_at = x, thinking_at = x, next = 0, heard_since = 0;
  ForceModel model;
  Passivity net;
  double energy = 0, square = 0;
  int n = 0;
  float last = 0, low = 1e9f, high = -1e9f;
  const int steps = static_cast<int>(kEnd / kStep);
  for (int i = 0; i < steps; ++i) {
    const float t = static_cast<float>(i) * kStep;
    if (t >= next - 1e-6f) {
      before = heard, heard = thinking, heard_at = thinking_at, heard_since = t;
      thinking = press(c, x), thinking_at = x;
      next += period;
      ForcePatch p;
      p.period = period;
      p.normal = {1, 0, 0};
      if (heard_at < 0) {
        p.point = {heard_at, 0, 0};
        p.force = {heard.force, 0, 0};
        p.stiffness = outer({1, 0, 0}, heard.slope);
        p.gap = heard.force / heard.slope;
      } else {  // no contact yet: the wall ahead and its stiffness
        p.stiffness = outer({1, 0, 0}, press(c, -1e-6f).slope);
      }
      make_safe(p, {kClamp, kClamp, c.coupling, 4});
      receive(model, p);
    }
    float f = 0;
    switch (c.rendering) {
      case Rendering::reference:
        f = press(c, x).force;
        break;
      case Rendering::held_force:
      case Rendering::held_and_net:
        f = heard.force;
        break;
      case Rendering::coupling:
      case Rendering::coupling_blend: {
        const float part = c.rendering == Rendering::coupling ? 1 : std::min(1.0f, (t - heard_since) / period);
        const float tool = before.tool + (heard.tool - before.tool) * part;
        f = heard.force > 0 ? std::max(0.0f, c.coupling * (tool - x) - 1.0f * v) : 0;
        break;
      }
      case Rendering::local_model:
        f = evaluate(model, {x, 0, 0}, {}, kStep).x;
        break;
    }
    f = std::min(f, kClamp);
    if (c.rendering == Rendering::held_and_net) {
      PassivityOptions o;
      o.slew = 1e9f;
      PassivityInput in;
      in.x = {x, 0, 0}, in.v = {v, 0, 0}, in.force = {f, 0, 0};
      in.most = kClamp, in.dt = kStep;
      f = keep_passive(net, in, o).force.x;
    }
    const double error = double{f} - double{std::min(kClamp, press(c, x).force)};
    square += error * error;
    ++n;
    row.largest_step = std::max(row.largest_step, std::abs(f - last));
    // Device, finger and hand, in twenty parts of the millisecond for which the motors hold their force.
    const float from = x;
    constexpr int kParts = 20;
    for (int k = 0; k < kParts; ++k) {
      const float at = t + kStep * static_cast<float>(k) / kParts;
      const float h = kStep / kParts;
      const float wish = hand_path(at), speed = (hand_path(at + h) - wish) / h;
      v += h / c.mass * (f + c.grip * (wish - x) + c.grip_damping * (speed - v) - c.viscous * v);
      x += h * v;
    }
    energy += double{f} * (double{x} - double{from});
    row.energy = std::max(row.energy, static_cast<float>(energy));
    if (t >= kHoldFrom && t < kHoldTo) low = std::min(low, x), high = std::max(high, x);
    last = f;
  }
  row.force_error = static_cast<float>(std::sqrt(square / n));
  row.hold_swing = high - low;
  return row;
}

std::vector<StudyPublished> published_study() {
  const auto row = [](Rendering r, float tissue, float coupling, float rate, float error, float swing_mm, float step,
                      float mj) {
    StudyPublished p;
    p.c.rendering = r, p.c.tissue = tissue, p.c.coupling = coupling, p.c.rate = rate;
    p.prototype = {error, swing_mm * 1e-3f, step, mj * 1e-3f};
    return p;
  };
  using R = Rendering;
  return {row(R::reference, 1100, 400, 1000, 0, 0.10f, 0.035f, 0.14f),
          row(R::held_force, 1100, 400, 60, 1.30f, 32, 3.1f, 1014),
          row(R::held_and_net, 1100, 400, 60, 0.37f, 1.3f, 2.7f, 4.1f),
          row(R::coupling, 1100, 400, 60, 0.10f, 0.001f, 1.3f, 1.0f),
          row(R::coupling_blend, 1100, 400, 60, 0.12f, 0.01f, 1.5f, 1.3f),
          row(R::local_model, 1100, 400, 60, 0, 0.10f, 0.035f, 0.14f),
          row(R::held_force, 1100, 400, 120, 1.08f, 16, 1.3f, 390),
          row(R::coupling, 1100, 400, 120, 0.05f, 0.004f, 0.75f, 0),
          row(R::local_model, 1100, 400, 120, -1, -1, -1, -1),
          row(R::held_force, 1100, 400, 250, 0.07f, 1.0f, 0.14f, 3.1f),
          row(R::coupling, 1100, 400, 250, -1, -1, -1, -1),
          row(R::local_model, 1100, 400, 250, -1, -1, -1, -1),
          row(R::held_force, 300, 400, 60, 0.99f, 16, 2.0f, 631),
          row(R::coupling, 300, 400, 60, 0.11f, 0.001f, 1.1f, 0.17f),
          row(R::local_model, 300, 400, 60, 0, 0.12f, 0.02f, 0.12f),
          row(R::held_force, 1100, 800, 60, 1.41f, 32, 3.3f, 1083),
          row(R::coupling, 1100, 800, 60, 0.20f, 0.01f, 2.3f, 2.1f),
          row(R::coupling_blend, 1100, 800, 60, 0.29f, 0.28f, 3.0f, 3.1f),
          row(R::local_model, 1100, 800, 60, 0, 0.06f, 0.06f, 0.16f)};
}

}  // namespace catgut
