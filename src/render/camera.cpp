// render/camera: see camera.h.
#include "render/camera.h"

namespace catgut {
namespace {

// Of the field: how far off a hand still counts, and the largest half height of the picture.
constexpr float kFarthest = 1.8f, kWidest = 1.0f;

Camera look_at_from(Vec3 target, float azimuth, float elevation, float half_height, float fov_deg) {
  const float d = half_height / std::tan(0.5f * fov_deg * kPi / 180);
  const Vec3 away{std::cos(elevation) * std::sin(azimuth), std::sin(elevation), std::cos(elevation) * std::cos(azimuth)};
  return {target + d * away, target, {0, 1, 0}, fov_deg};
}

float wrap_angle(float a) { return a - 2 * kPi * std::round(a / (2 * kPi)); }

}  // namespace

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
  // Part of the way from the organ's middle to the needle: the work stays in view together with what it is done to.
  Vec3 offset = snapshot.needle.pose.p - focus_;
  if (!is_finite(offset)) offset = {};
  // Hands that tie or draw thread are farther away: the picture opens up for them, from the tissue to the needle and the tools'
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

  // Near the axis the needle's direction means nothing; the camera keeps to where it is.
  const float from_axis = std::hypot(offset.x, offset.z);
  float side = azimuth_;
  if (from_axis > 0.06f * field_) {
    const float middle = std::atan2(offset.x, offset.z);
    // How far the nearest tool's shaft stands from a camera on that side, seen from above.
    const auto clear = [&](float hand) {
      float least = kPi;
      for (const ToolView& tool : snapshot.tool) {
        const Vec3 shaft = rotate(tool.pose.q, {0, 0, 1});
        if (distance(tool.pose.p, focus_) < 2 * field_ && std::hypot(shaft.x, shaft.z) > 0.2f)
          least = std::min(least, std::abs(wrap_angle(middle + hand * beside - std::atan2(shaft.x, shaft.z))));
      }
      return least;
    };
    // It changes sides only for a good reason, or it would sway between two equal ones.
    if (clear(-hand_) > clear(hand_) + (started_ ? 0.35f : 0)) hand_ = -hand_;
    side = middle + hand_ * beside;
  }
  if (front_) side = std::clamp(wrap_angle(side), -0.75f, 0.75f);

  if (!started_) {
    started_ = true;
    target_ = wanted;
    azimuth_ = side;
    half_ = half_wanted;
  } else if (dt > 0) {
    const float part = 1 - std::exp(-3 * dt / settle_time);
    target_ = lerp(target_, wanted, part);
    half_ += (half_wanted - half_) * part;
    const float want_speed = std::clamp(wrap_angle(side - azimuth_) / settle_time, -turn_speed, turn_speed);
    // The speed itself eases, or the camera would start and stop with a jerk.
    speed_ += (want_speed - speed_) * (1 - std::exp(-4 * dt / settle_time));
    azimuth_ = wrap_angle(azimuth_ + std::clamp(speed_ * dt, -0.5f, 0.5f));
  }
  return look_at_from(target_, azimuth_, elevation, half_, fov_deg);
}

}  // namespace catgut
