// SPDX-License-Identifier: Apache-2.0
// app/xr: see wearer.h.
#include "xr/wearer.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "core/check.h"
#include "runtime/metrics_collector.h"
#include "xr/boards.h"

namespace catgut::xr {
namespace {

constexpr float kHold = 0.8f;         // [s] of the menu button: recenters
constexpr float kTableSpeed = 0.08f;  // [m/s]
constexpr float kStick = 0.7f;        // of a stick's range
constexpr size_t kMostSamples = 100000;

}  // namespace

Wearer::Wearer(const WearerOptions& options)
    : given_(options), headset_({options.font, options.whole_resolution, options.report}), options_(options.hands) {
  try {
    room_ = load_room(given_.room_file, given_.room);
  } catch (const InputError& error) { report(error.what()); }
  place_.height = room_.height;
  place_.reach = room_.reach;
  place_.loupe = room_.loupe;
}

Wearer::~Wearer() {
  if (!placed_) return;
  room_.height = place_.height;
  room_.reach = place_.reach;
  if (!arms_) room_.loupe = place_.loupe;
  try {
    save_room(given_.room_file, given_.room, room_);
  } catch (const InputError& error) { report(error.what()); }
}

// The field ahead of the wearer, or where the arms are.
void Wearer::settle_place() {
  if (arms_ && room_.arms) {
    place_.at = room_.arms->at, place_.yaw = room_.arms->yaw, place_.loupe = room_.arms->loupe;
  } else {
    recenter(place_, frame_.head);
  }
  stand_ = place_;
  placed_ = true;
  fade_.cut();
}

// A controller's front at a stylus: one point in both frames.
void Wearer::touch(const Snapshot& seen, std::array<bool, 2> arm) {
  bool pressed = false;
  for (size_t side = 0; side < 2; ++side) {
    const HandState& h = frame_.hand[side];
    if (!h.tracked || h.articulated || !h.cut) continue;
    pressed = true;
    if (touch_was_ || (!arm[0] && !arm[1])) continue;
    touched_room_.push_back(tool_in_grip(h.grip, false, 1).p);
    touched_world_.push_back(seen.tool[arm[0] ? 0 : 1].hand.p);
    const ArmFit fit = fit_arms(touched_room_, touched_world_, place_);
    std::string line = "headset: point " + std::to_string(touched_room_.size());
    if (!fit.valid) {
      line += "; three points at least 6 cm apart are needed";
    } else {
      char text[80];
      std::snprintf(text, sizeof text, ": residual %.1f mm, worst %.1f mm", 1e3 * static_cast<double>(fit.rms),
                    1e3 * static_cast<double>(fit.worst));
      line += text;
      if (is_plausible(fit)) room_.arms = fit.place, room_.arms_rms = fit.rms, settle_place();
      else line += "; too large, not used: touch the stylus again, or start again";
    }
    report(line);
    headset_.vibrate(side, {0.8f, 0.05f, 0, "touch"});
  }
  touch_was_ = pressed;
}

bool Wearer::begin() {
  open_ = false;
  look_.state = headset_.state();
  if (!headset_.poll() || !headset_.wait(frame_)) {
    look_.state = headset_.state();
    return false;
  }
  open_ = true;
  began_ = wall_seconds();
  dt_ = static_cast<float>(std::clamp(before_ > 0 ? began_ - before_ : 0.0, 0.001, 0.25));
  before_ = began_;
  const double shown = static_cast<double>(frame_.shown_ns) * 1e-9;
  const auto lead = static_cast<float>(std::clamp(shown - began_, 0.0, 0.2));
  lead_ += (lead_ == 0 ? 1 : 0.02f) * (lead - lead_);
  moment_ = shown - static_cast<double>(lead_);
  if (fade_.step(dt_)) {
    if (std::exchange(recenter_wanted_, false) && frame_.posed) settle_place();
    if (const int step = std::exchange(loupe_wanted_, 0)) change_loupe(place_, step);
  }
  if (frame_.posed && (!placed_ || frame_.recentered)) settle_place();
  buttons(dt_);
  carry_field();
  return true;
}

void Wearer::stage(const PictureModel* model, Quality quality) {
  model_ = model;
  if (placed_)
    place_.at = stand_.at, place_.yaw = stand_.yaw;  // where results were carried to does not matter to the next scene
  if (model) place_.focus = model->focus;
  if (EyeRenderer* eyes = headset_.renderer()) eyes->stage(model, quality);
  hands_ = {};
  vibration_ = {};
  event_.clear();
}

void Wearer::buttons(float dt) {
  bool menu = false;
  float up = 0, ahead = 0, flick = 0;
  for (size_t side = 0; side < 2; ++side) {
    const HandState& h = frame_.hand[side];
    menu = menu || h.menu;
    if (std::abs(h.stick_y) > kStick) (side == 0 ? ahead : up) += h.stick_y;
    if (std::abs(h.stick_x) > kStick && std::abs(h.stick_y) < 0.5f) flick = h.stick_x;
    wish_.swap[tool_of(side, options_.left_handed)] |= h.swap && !swap_was_[side];
    swap_was_[side] = h.swap;
  }
  if (menu) {
    menu_held_ += dt;
    if (menu_held_ >= kHold && !menu_used_ && frame_.posed) {
      recenter_wanted_ = menu_used_ = true;
      fade_.out();
    }
  } else {
    if (menu_held_ > 0 && !menu_used_) wish_.pause = true;
    menu_held_ = 0;
    menu_used_ = false;
  }
  if (up != 0 && frame_.posed && move_table(place_, kTableSpeed * dt * up, frame_.head))
    stand_.at.y = place_.at.y, stand_.height = place_.height;
  if (ahead != 0 && placed_) {
    const float before = stand_.reach;
    if (move_reach(stand_, kTableSpeed * dt * ahead)) move_reach(place_, stand_.reach - before);
  }
  if (flick != 0 && !flick_was_) {
    Place next = place_;
    if (const int step = flick > 0 ? 1 : -1; change_loupe(next, step)) loupe_wanted_ = step, fade_.out();
  }
  flick_was_ = flick != 0;
}

std::optional<std::array<ToolInput, 2>> Wearer::hands(const Snapshot& seen, const SpaceHandOptions& options,
                                                      std::array<bool, 2> arm) {
  options_ = options;
  if (const bool arms = arm[0] || arm[1]; arms != arms_) {
    arms_ = arms;
    if (placed_ && room_.arms) settle_place();
  }
  if (given_.register_arms && open_ && in_use()) touch(seen, arm);
  const bool active = open_ && in_use() && placed_;
  const auto at = static_cast<uint64_t>(began_ * 1e9);
  look_.vibration = {};
  if (active && model_) {
    look_.vibration = vibration(vibration_, event_, seen, *model_, dt_);
    for (size_t side = 0; side < 2; ++side) headset_.vibrate(side, look_.vibration[tool_of(side, options.left_handed)]);
  }
  event_.clear();
  if (!active && hands_.sequence == 0) return {};
  const auto out = move(hands_, frame_.hand, place_, options, seen, active, dt_, at);
  if (!active || (!out[0].connected && !out[1].connected)) return {};
  return out;
}

bool Wearer::head(Pose& out) const {
  if (!open_ || !frame_.posed || !placed_) return false;
  out = place_.to_world(frame_.head);
  return true;
}

std::optional<Camera> Wearer::mirror() const {
  Pose at;
  if (!head(at)) return {};
  const Pose eye = place_.to_world(frame_.eye[0]);
  return eye_camera(eye, frame_.frustum[0], std::max(0.05f, distance(eye.p, place_.focus)));
}

// The field turns and moves with the hand, so that a wearer can look at a result from all sides.
void Wearer::carry_field() {
  const bool held = carried_ && walk_ && frame_.hand[carrier_].tracked && frame_.hand[carrier_].clutch;
  if (held) {
    carry(place_, *carried_, frame_.hand[carrier_].grip);
    carried_ = frame_.hand[carrier_].grip;
    return;
  }
  carried_.reset();
  for (size_t side = 0; side < 2 && walk_ && placed_; ++side)
    if (frame_.hand[side].tracked && frame_.hand[side].clutch) carried_ = frame_.hand[carrier_ = side].grip;
}

// The ray of the hand that pulled its trigger last, as a mouse on the board.
void Wearer::point(EyeRenderer::Frame& frame, const Board& b) {
  for (size_t side = 0; side < 2; ++side)
    if (frame_.hand[side].tracked && (frame_.hand[side].trigger > 0.5f || !frame_.hand[pointer_].tracked)) pointer_ = side;
  const HandState& h = frame_.hand[pointer_];
  if (!h.tracked) return;
  const Pose aim = place_.to_world(h.aim);
  const Vec3 from = to_local(b.pose, aim.p), along = rotate(conjugate(b.pose.q), rotate(aim.q, {0, 0, -1}));
  if (along.z >= -1e-3f || from.z <= 0) return;
  const Vec3 hit = from + along * (from.z / -along.z);
  const float x = hit.x / b.width + 0.5f, y = 0.5f - hit.y / height_of(b);
  if (x < 0 || x > 1 || y < 0 || y > 1) return;
  frame.pointer = {{x * EyeRenderer::kBoardWidth, y * EyeRenderer::kBoardHeight}};
  frame.pressed = h.trigger > 0.5f;
  frame.board->ray_from = aim.p;
  frame.board->ray_to = transform(b.pose, hit);
}

void Wearer::draw(const Picture& picture) {
  if (!open_) return;
  open_ = false;
  EyeRenderer::Frame frame;
  frame.snapshot = picture.snapshot;
  frame.suture_points = picture.suture_points;
  frame.brightness = fade_.brightness;
  frame.dt = dt_;
  if (!picture.walk) board_turn_ = 0;
  frame.board = board_at(picture.walk ? walked_stand(stand_, board_turn_, frame_.head.p) : stand_, place_, picture.working);
  if (picture.caption[2] > picture.caption[0]) frame.caption = caption_at(stand_, place_, picture.caption);
  walk_ = picture.walk;
  if (!picture.working) point(frame, *frame.board);
  frame.panels = picture.panels;
  if (picture.copy) frame.copy = &picture_;
  const Vec3 eye = place_.to_world(frame_.head.p);
  const std::vector<Label> label = place_labels(picture.stitch, place_, eye);
  frame.label = label;
  headset_.submit(frame_, frame, place_, std::max(0.05f, distance(eye, place_.focus)));

  look_.state = headset_.state();
  look_.frame = frame_;
  look_.place = place_;
  look_.board = *frame.board;
  look_.pointer = frame.pointer;
  look_.brightness = frame.brightness;
  look_.counts = headset_.counts();
  look_.picture = picture.copy && frame_.render && frame_.posed ? &picture_ : nullptr;
  if (!picture.status || picture.status->moved_ns == 0 || picture.status->moved_ns == moved_ns_ || all_.size() >= kMostSamples)
    return;
  const LiveStatus& s = *picture.status;
  moved_ns_ = s.moved_ns;
  const auto ms = [](uint64_t from, uint64_t to) { return to > from ? static_cast<float>(to - from) * 1e-6f : 0.0f; };
  const uint64_t now = wall_ns();
  to_tick_.push_back(ms(s.moved_ns, s.began_ns));
  in_tick_.push_back(ms(s.began_ns, s.ready_ns));
  to_submit_.push_back(ms(s.ready_ns, now));
  to_photon_.push_back(ms(now, frame_.shown_ns));
  all_.push_back(ms(s.moved_ns, frame_.shown_ns));
}

std::string Wearer::status_line() const {
  const HeadsetCounts& c = headset_.counts();
  char text[120];
  const double rate = frame_.period_ns > 0 ? 1e9 / static_cast<double>(frame_.period_ns) : 0;
  std::snprintf(text, sizeof text, "headset %s, %.0f Hz, %llu of %llu late, resolution %.0f %%", headset_state_name(state()),
                rate, static_cast<unsigned long long>(c.late), static_cast<unsigned long long>(c.frames),
                100.0 * static_cast<double>(c.resolution));
  return text;
}

void Wearer::report_budget() const {
  const HeadsetCounts& c = headset_.counts();
  if (c.frames == 0) return;
  std::fprintf(stderr, "catgut: headset: %llu frames, %llu late, resolution %.0f %%, work %.1f ms, lead %.1f ms\n",
               static_cast<unsigned long long>(c.frames), static_cast<unsigned long long>(c.late),
               100.0 * static_cast<double>(c.resolution), static_cast<double>(c.work_ms), static_cast<double>(c.lead_ms));
  if (all_.empty()) return;
  std::fprintf(stderr, "catgut: budget [ms] of %zu motions          median     99 %%    worst\n", all_.size());
  const auto row = [](const char* name, const std::vector<float>& v) {
    const Percentiles s = percentiles_of(v);
    std::fprintf(stderr, "catgut:   %-32s %8.1f %8.1f %8.1f\n", name, s.median, s.p99, s.max);
  };
  row("pose read -> tick", to_tick_);
  row("tick -> snapshot", in_tick_);
  row("snapshot -> frame submitted", to_submit_);
  row("submitted -> predicted display", to_photon_);
  row("pose read -> predicted display", all_);
}

}  // namespace catgut::xr
