// SPDX-License-Identifier: Apache-2.0
// app/xr: see boards.h.
#include "xr/boards.h"

#include <algorithm>
#include <cmath>

namespace catgut::xr {
namespace {

// [m] room, from the field's center.
constexpr Vec3 kBeside{0.42f, 0.14f, -0.16f}, kAbove{0, 0.30f, -0.22f}, kCaption{0, 0.07f, -0.15f};
constexpr float kBesideWidth = 0.56f, kAboveWidth = 0.62f;  // [m] room
constexpr float kCaptionPixel = 0.00042f;                   // [m] room, of a pixel of the caption

Quat turn_of(const Place& stand) { return axis_angle({0, 1, 0}, -stand.yaw); }

// Faces the eyes, with a level upper edge.
Pose facing(const Place& stand, const Place& place, Vec3 at) {
  const Vec3 z = normalized(eyes_at(stand) - at, {0, 0, 1}), x = normalized(cross({0, 1, 0}, z), {1, 0, 0});
  return place.to_world(Pose{at, from_axes(x, cross(z, x), z)});
}

float degrees(float radians) { return radians * 180 / kPi; }

// [pixels] width of the part that a board shows.
float pixels_across(const Board& b) { return (b.part[2] - b.part[0]) * EyeRenderer::kBoardWidth; }

}  // namespace

Vec3 eyes_at(const Place& stand) { return stand.at + rotate(turn_of(stand), {0, -stand.height, stand.reach}); }

Board board_at(const Place& stand, const Place& place, bool working) {
  Board b;
  b.pose = facing(stand, place, stand.at + rotate(turn_of(stand), working ? kBeside : kAbove));
  b.width = (working ? kBesideWidth : kAboveWidth) / place.loupe;
  return b;
}

Place walked_stand(const Place& stand, int& turn, Vec3 head) {
  constexpr float kQuarter = kPi / 2, kChange = 1.1f;  // [rad] beyond which it follows: later than half a quarter
  const Vec3 d = head - stand.at;
  if (std::hypot(d.x, d.z) > 0.1f) {
    const float walked = std::atan2(-d.x, d.z) - stand.yaw;
    if (std::cos(walked - kQuarter * static_cast<float>(turn)) < std::cos(kChange))
      turn = static_cast<int>(std::lround(walked / kQuarter));
  }
  Place out = stand;
  out.yaw += kQuarter * static_cast<float>(turn);
  return out;
}

Board caption_at(const Place& stand, const Place& place, const std::array<float, 4>& part) {
  Board b;
  b.part = {part[0] / EyeRenderer::kBoardWidth, part[1] / EyeRenderer::kBoardHeight, part[2] / EyeRenderer::kBoardWidth,
            part[3] / EyeRenderer::kBoardHeight};
  const float tall = kCaptionPixel * (part[3] - part[1]);
  b.pose = facing(stand, place, stand.at + rotate(turn_of(stand), kCaption + Vec3{0, 0.5f * tall, 0}));
  b.width = kCaptionPixel * (part[2] - part[0]) / place.loupe;
  return b;
}

float text_degrees(const Board& b, const Place& stand, const Place& place) {
  const float line = b.width / pixels_across(b) * EyeRenderer::kBoardText;
  return degrees(std::atan2(line, distance(b.pose.p, place.to_world(eyes_at(stand)))));
}

float degrees_from_field(const Board& b, const Place& stand, const Place& place) {
  const Vec3 eye = place.to_world(eyes_at(stand)), field = normalized(place.focus - eye);
  float least = kPi;
  constexpr int kGrid = 20;
  for (int i = 0; i <= kGrid; ++i)
    for (int j = 0; j <= kGrid; ++j) {
      const Vec3 on{b.width * (static_cast<float>(i) / kGrid - 0.5f), height_of(b) * (static_cast<float>(j) / kGrid - 0.5f), 0};
      const Vec3 to = normalized(transform(b.pose, on) - eye);
      least = std::min(least, std::acos(std::clamp(dot(to, field), -1.0f, 1.0f)));
    }
  return degrees(least);
}

}  // namespace catgut::xr
