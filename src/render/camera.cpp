// SPDX-License-Identifier: Apache-2.0
// render/camera: see camera.h.
#include "render/camera.h"

#include <algorithm>
#include <array>
#include <cstdio>
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

// Weighted points of the scene that a picture must show.
struct Interest {
  std::array<Vec3, 12> point;
  std::array<float, 12> weight{};
  size_t count = 0;
  void add(Vec3 p, float w) {
    if (count < point.size() && is_finite(p)) point[count] = p, weight[count] = w, ++count;
  }
};

// Share of the points that the tools hide from `eye`, 0..1, in perspective: a shaft that points at the camera hides much. Each
// tool is a cone that widens from its jaws to its rings.
float hidden(const Snapshot& snapshot, Vec3 eye, const Interest& interest) {
  constexpr int samples = 24;
  constexpr float step = 0.007f, slender = 0.003f, widening = 0.05f;  // [m], [m], radius per length
  float sum = 0, whole = 1e-6f;
  for (size_t k = 0; k < interest.count; ++k) {
    const Vec3 p = interest.point[k], ray = normalized(eye - p, {0, 1, 0});
    float most = 0;
    for (const ToolView& tool : snapshot.tool) {
      if (tool.instrument < 0 || !is_finite(tool.pose.p)) continue;
      const Vec3 along = rotate(tool.pose.q, {0, 0, 1});
      for (int i = 0; i < samples; ++i) {
        const float z = step * static_cast<float>(i), radius = slender + widening * z;
        const Vec3 d = tool.pose.p + along * z - p;
        const float toward = dot(d, ray), off = std::sqrt(std::max(0.0f, length2(d - ray * toward))) / radius;
        if (toward > 0) most = std::max(most, std::clamp(1.6f - 0.7f * off, 0.0f, 1.0f));
      }
    }
    sum += interest.weight[k] * most, whole += interest.weight[k];
  }
  return sum / whole;
}

// The same for the tissue: particles between a point and the eye, those next to the point itself apart.
float behind_tissue(const PictureModel& model, const Snapshot& snapshot, Vec3 eye, const Interest& interest) {
  constexpr float radius = 0.0022f, apart = 0.004f;  // [m]
  const size_t tissue = std::min<size_t>(model.particle_rest.size(), snapshot.particle.size());
  float sum = 0, whole = 1e-6f;
  for (size_t k = 0; k < interest.count; ++k) {
    const Vec3 p = interest.point[k], ray = normalized(eye - p, {0, 1, 0});
    bool covered = false;
    for (size_t i = 0; i < tissue && !covered; ++i) {
      const Vec3 d = snapshot.particle[i] - p;
      const float toward = dot(d, ray);
      covered = toward > apart && length2(d - ray * toward) < radius * radius;
    }
    sum += covered ? interest.weight[k] : 0, whole += interest.weight[k];
  }
  return sum / whole;
}

void add_needle(Interest& interest, const PictureModel& model, const Snapshot& snapshot) {
  const SuturePicture& suture = model.suture[std::min<size_t>(snapshot.active_suture, model.suture.size() - 1)];
  for (const float part : {0.0f, 0.35f, 0.7f, 1.0f}) {
    const float a = part * suture.needle_arc;
    interest.add(
        transform(snapshot.active().needle.pose, {suture.needle_radius * std::cos(a), suture.needle_radius * std::sin(a), 0}),
        1);
  }
}

// The decisive thing of this moment: the needle in the wall, else the turns of thread round an instrument, else the newest knot
// that is being tightened, else the finished repair, else the field.
Interest decisive(const PictureModel& model, const Snapshot& snapshot) {
  Interest interest;
  const SutureView& active = snapshot.active();
  if (active.needle.in_tissue) {
    add_needle(interest, model, snapshot);
    if (active.needle.bite < active.bite.size()) interest.add(active.bite[active.needle.bite].entry, 2);
    return interest;
  }
  for (const ToolView& tool : snapshot.tool) {
    if (tool.loop_wraps == 0) continue;
    for (const float z : {-0.002f, 0.008f}) interest.add(transform(tool.pose, {0, 0, z}), 1);
    // The turns themselves: from a good side more of them lie before the tool than behind it.
    if (tool.loop_suture < snapshot.suture.size()) {
      const std::vector<uint32_t>& order = snapshot.suture[tool.loop_suture].thread_order;
      auto a = std::find(order.begin(), order.end(), tool.loop_first),
           b = std::find(order.begin(), order.end(), tool.loop_last);
      if (b < a) std::swap(a, b);
      if (b != order.end())
        for (int i = 0; i <= 6; ++i) {
          const uint32_t slot = a[(b - a) * i / 6];
          if (slot < snapshot.particle.size()) interest.add(snapshot.particle[slot], 1);
        }
    }
    if (!active.suture_point.empty()) interest.add(active.suture_point.back().position, 0.5f);
    return interest;
  }
  if (!active.knot.empty() && active.knot.back().phase == KnotPhase::tightening) {
    interest.add(active.knot.back().position, 1);
    for (const SuturePointView& point : active.suture_point)
      if (distance(point.position, active.knot.back().position) < 0.02f) interest.add(point.position, 0.5f);
    return interest;
  }
  // Of several separate stitches the newest: all of them together are too small.
  const auto tied =
      std::count_if(snapshot.suture.begin(), snapshot.suture.end(), [](const SutureView& s) { return !s.knot.empty(); });
  if ((tied > 1 || !snapshot.settled.empty()) && !active.knot.empty()) {
    interest.add(active.knot.back().position, 1);
    for (const SuturePointView& point : active.suture_point)
      if (distance(point.position, active.knot.back().position) < 0.02f) interest.add(point.position, 0.5f);
    return interest;
  }
  for (const SutureView& suture : snapshot.suture) {
    for (const KnotView& knot : suture.knot) interest.add(knot.position, 1);
    const size_t every = std::max<size_t>(1, suture.suture_point.size() / 8);
    for (size_t i = 0; i < suture.suture_point.size(); i += every) interest.add(suture.suture_point[i].position, 0.5f);
  }
  if (interest.count == 0)
    for (const SettledView& stitch : snapshot.settled)
      for (const Vec3& knot : stitch.knot) interest.add(knot, 1);
  if (interest.count == 0) interest.add(model.focus, 1);
  return interest;
}

}  // namespace

Camera eye_camera(const Pose& eye, const Frustum& frustum, float work) {
  const float vertical = std::atan(frustum.up) - std::atan(frustum.down);
  return {eye.p, eye.p + rotate(eye.q, {0, 0, -work}), rotate(eye.q, {0, 1, 0}), vertical * 180 / kPi, frustum};
}

bool project(const Camera& camera, Vec3 point, float width, float height, float& x, float& y) {
  const Vec3 ahead = normalized(camera.target - camera.eye), right = normalized(cross(ahead, camera.up));
  const Vec3 up = cross(right, ahead), d = point - camera.eye;
  const float deep = dot(d, ahead), half = std::tan(0.5f * camera.fov_deg * kPi / 180);
  if (deep <= 0) return false;
  x = 0.5f * width + 0.5f * height * dot(d, right) / (deep * half);
  y = 0.5f * height - 0.5f * height * dot(d, up) / (deep * half);
  return true;
}

Vec3 gaze_point(const Pose& head, const PictureModel& picture, const Snapshot& seen) {
  constexpr float kNear = 0.052f;  // tangent of three degrees
  const Vec3 ahead = rotate(head.q, {0, 0, -1});
  float least = 0;
  const size_t count = std::min(picture.particle_rest.size(), seen.particle.size());
  for (size_t i = 0; i < count; ++i) {
    const Vec3 d = seen.particle[i] - head.p;
    const float deep = dot(d, ahead);
    if (deep > 0 && (least == 0 || deep < least) && length(d - ahead * deep) < kNear * deep) least = deep;
  }
  return head.p + ahead * (least > 0 ? least : distance(head.p, picture.focus));
}

Camera magnified(const Camera& camera, Vec3 point, float half_height) {
  const float away = std::max(0.01f, distance(camera.eye, point));
  return {camera.eye, point, camera.up, 2 * std::atan(half_height / away) * 180 / kPi, {}};
}

Camera overview(const PictureModel& model) {
  return look_at_from(model.focus - Vec3{0, 0.1f * model.field, 0}, 0.5f, 0.75f, 0.42f * model.field, 30);
}

Camera close_up(const PictureModel& model, const Snapshot& snapshot) {
  const Interest interest = decisive(model, snapshot);
  Vec3 low = interest.point[0], high = low;
  for (size_t i = 1; i < interest.count; ++i) {
    const Vec3 p = interest.point[i];
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  constexpr float fov_deg = 30, nearest = 0.013f, margin = 0.006f;  // [m] half heights
  const Vec3 target = 0.5f * (low + high);
  const float half = std::clamp(0.5f * length(high - low) + margin, nearest, kWidest * model.field);
  Camera best = look_at_from(target, 0.4f, 0.8f, half, fov_deg);
  float least = 1e9f;
  // From all sides of the table; without a reason, from the surgeon's.
  constexpr int round = 16;
  for (const float elevation : {0.5f, 0.75f, 1.0f, 1.25f})
    for (int i = 0; i < round; ++i) {
      const float azimuth = wrap_angle(2 * kPi * static_cast<float>(i) / round + 0.2f);
      const Camera camera = look_at_from(target, azimuth, elevation, half, fov_deg);
      const float cost = hidden(snapshot, camera.eye, interest) + 0.8f * behind_tissue(model, snapshot, camera.eye, interest) +
                         0.02f * azimuth * azimuth + 0.5f * (elevation - 0.8f) * (elevation - 0.8f);
      if (cost < least) least = cost, best = camera;
    }
  return best;
}

std::optional<Camera> fixed_camera(const std::string& name, const PictureModel& model) {
  constexpr float half = 0.5f;  // of the field's radius
  if (name == "overview") return overview(model);
  if (name == "front") return look_at_from(model.focus, 0, 0.6f, half * model.field, 30);
  if (name == "left") return look_at_from(model.focus, -0.5f * kPi, 0.6f, half * model.field, 30);
  if (name == "right") return look_at_from(model.focus, 0.5f * kPi, 0.6f, half * model.field, 30);
  if (name == "top") return look_at_from(model.focus, 0, 1.45f, half * model.field, 30);
  Camera camera;
  float v[6];
  int used = 0;
  if (std::sscanf(name.c_str(), "%f,%f,%f,%f,%f,%f%n", &v[0], &v[1], &v[2], &v[3], &v[4], &v[5], &used) != 6 ||
      static_cast<size_t>(used) != name.size())
    return std::nullopt;
  camera.eye = {v[0], v[1], v[2]}, camera.target = {v[3], v[4], v[5]};
  const Vec3 ahead = camera.target - camera.eye;
  if (!is_finite(ahead) || length(ahead) < 0.001f || length(ahead) > 10) return std::nullopt;
  if (std::abs(normalized(ahead).y) > 0.999f) camera.up = {0, 0, -1};
  return camera;
}

FollowCamera::FollowCamera(const PictureModel& model)
    : half_height(0.3f * model.field),
      focus_(model.focus),
      field_(model.field),
      target_(model.focus),
      front_(model.body.size() > 1),
      needle_radius_(model.suture.front().needle_radius),
      needle_arc_(model.suture.front().needle_arc) {}

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
    Interest interest;
    for (const float part : {0.15f, 0.5f, 0.85f}) {
      const float a = part * needle_arc_;
      interest.add(transform(snapshot.active().needle.pose, {needle_radius_ * std::cos(a), needle_radius_ * std::sin(a), 0}),
                   1);
    }
    interest.add(wanted, 0.7f);
    const auto cost = [&](size_t i) {
      const float raised = kUp[i / kRounds], a = azimuth_of(i), e = elevation + raised;
      return 1.5f * hidden(snapshot, look_at_from(wanted, a, e, half_wanted, fov_deg).eye, interest) +
             0.35f * kRound[i % kRounds] * kRound[i % kRounds] + 3 * raised * raised;
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
