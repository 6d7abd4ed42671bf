// SPDX-License-Identifier: Apache-2.0
// render/camera: see camera.h.
#include "render/camera.h"

#include <iterator>

namespace catgut {
namespace {

// Limits: distance of a hand from the field that still counts, and the largest half height of the image.
constexpr float kFarthest = 1.8f, kWidest = 1.0f;

Camera look_at_from(Vec3 target, float azimuth, float elevation, float half_height, float fov_deg) {
  const float d = half_height / std::tan(0.5f * fov_deg * kPi / 180);
  const Vec3 away{std::cos(elevation) * std::sin(azimuth), std::sin(elevation), std::cos(elevation) * std::cos(azimuth)};
  return {target + d * away, target, {0, 1, 0}, fov_deg};
}

float wrap_angle(float a) { return a - 2 * kPi * std::round(a / (2 * kPi)); }

// Viewpoints: round from the needle's side, in units of `beside`, and up from `elevation` [rad].
constexpr float kRound[] = {0.4f, -0.4f, 1, -1, 1.7f, -1.7f, 0}, kUp[] = {0, 0.22f, -0.16f};
constexpr size_t kRounds = std::size(kRound), kUps = std::size(kUp);

// How much the tools' shafts occlude the needle and the center of the image, seen from the unit direction `away`.
float hidden(const Snapshot& snapshot, Vec3 away, Vec3 target, float half) {
  constexpr int points = 10;
  float sum = 0;
  for (const ToolView& tool : snapshot.tool) {
    const Vec3 along = rotate(tool.pose.q, {0, 0, 1});
    for (int i = 1; i <= points; ++i) {
      const Vec3 p = tool.pose.p + along * (0.012f * static_cast<float>(i));
      const auto before = [&](Vec3 key, float size) {
        const Vec3 d = p - key;
        const float toward = dot(d, away), off2 = length2(d - away * toward);
        return toward > 0 && std::isfinite(off2) ? std::exp(-off2 / (size * size)) : 0.0f;
      };
      sum += 0.5f * before(snapshot.active().needle.pose.p, 0.010f) + 0.35f * before(target, 0.6f * half);
    }
  }
  return sum;
}

}  // namespace

Camera eye_camera(const Pose& eye, const Frustum& frustum, float work) {
  const float vertical = std::atan(frustum.up) - std::atan(frustum.down);
  return {eye.p, eye.p + rotate(eye.q, {0, 0, -work}), rotate(eye.q, {0, 1, 0}), vertical * 180 / kPi, frustum};
}

Camera overview(const PictureModel& model) {
  return look_at_from(model.focus - Vec3{0, 0.1f * model.field, 0}, 0.5f, 0.75f, 0.42f * model.field, 30);
}

FollowCamera::FollowCamera(const PictureModel& model)
    : half_height(0.3f * model.field),
      focus_(model.focus),
      field_(model.field),
      target_(model.focus),
      front_(model.body.size() > 1) {}

Camera FollowCamera::update(const Snapshot& snapshot, float dt) {
  // Between the organ's center and the needle: both stay in view.
  Vec3 offset = snapshot.active().needle.pose.p - focus_;
  if (!is_finite(offset)) offset = {};
  // For hands that tie or pull thread the view widens, to include tissue, needle and the tools'
  // tips.
  const float away = length(offset), reach = 0.35f * field_;
  float half_wanted = std::clamp(0.55f * away, half_height, 0.62f * field_);
  Vec3 wanted = focus_ + 0.45f * offset;
  if (away > reach) {
    offset *= std::min(away, kFarthest * field_) / away;
    Vec3 low = focus_, high = focus_;
    const auto show = [&](Vec3 p) {
      low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    };
    show(focus_ + offset);
    for (const ToolView& tool : snapshot.tool)
      if (distance(tool.pose.p, focus_) < kFarthest * field_) show(tool.pose.p);
    wanted = 0.5f * (low + high);
    half_wanted = std::clamp(0.55f * length(high - low), half_height, kWidest * field_);
  }

  // Round from the needle's side of the organ, and up: to where the tools' shafts occlude least.
  const float from_axis = std::hypot(offset.x, offset.z);
  float side = azimuth_;
  // Near the axis the needle's direction is undefined; the camera keeps its position.
  if (from_axis > 0.06f * field_) {
    const float middle = std::atan2(offset.x, offset.z);
    const auto azimuth_of = [&](size_t i) {
      const float a = wrap_angle(middle + kRound[i % kRounds] * beside);
      return front_ ? std::clamp(a, -0.75f, 0.75f) : a;
    };
    const auto cost = [&](size_t i) {
      const float raised = kUp[i / kRounds], a = azimuth_of(i), e = elevation + raised;
      const Vec3 seen_from{std::cos(e) * std::sin(a), std::sin(e), std::cos(e) * std::cos(a)};
      return hidden(snapshot, seen_from, wanted, half_wanted) + 0.35f * kRound[i % kRounds] * kRound[i % kRounds] +
             3 * raised * raised;
    };
    size_t best = choice_;
    float least = cost(choice_) - (started_ ? 0.5f : 0);  // hysteresis, or it would oscillate
    for (size_t i = 0; i < kRounds * kUps; ++i)
      if (const float c = cost(i); c < least) least = c, best = i;
    choice_ = best;
    side = azimuth_of(choice_);
  }
  const float lift_wanted = kUp[choice_ / kRounds];

  if (!started_) {
    started_ = true;
    target_ = wanted;
    azimuth_ = side;
    half_ = half_wanted;
    lift_ = lift_wanted;
  } else if (dt > 0) {
    const float part = 1 - std::exp(-3 * dt / settle_time);
    target_ = lerp(target_, wanted, part);
    half_ += (half_wanted - half_) * part;
    const float want_speed = std::clamp(wrap_angle(side - azimuth_) / settle_time, -turn_speed, turn_speed);
    // The angular velocity is smoothed too, or the camera would start and stop with a jerk.
    speed_ += (want_speed - speed_) * (1 - std::exp(-4 * dt / settle_time));
    azimuth_ = wrap_angle(azimuth_ + std::clamp(speed_ * dt, -0.5f, 0.5f));
    lift_ += (lift_wanted - lift_) * (1 - std::exp(-1.5f * dt / settle_time));
  }
  return look_at_from(target_, azimuth_, elevation + lift_, half_, fov_deg);
}

}  // namespace catgut
