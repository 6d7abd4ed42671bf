// surgeon/scripted: carries out a plan's tasks with two hands. The needle driver (right) drives a bite by turning the needle
// about its own circle; the forceps (left) takes the tip, brings it through and pulls the thread; knots are tied with the
// instrument. Reads Snapshots only; each step looks at what really happened before the next begins. What goes wrong is tried
// again: a bite whose tip did not come out is drawn back and driven a little shallower or deeper, a missed grasp is approached
// anew, a throw whose loop did not hold is wound again.
#include <array>
#include <cmath>
#include <stdexcept>

#include "surgeon/hands.h"
#include "surgeon/plan.h"
#include "surgeon/sight.h"
#include "surgeon/surgeon.h"

namespace catgut {
namespace {

constexpr size_t kDriver = 0, kForceps = 1;
// Places on the needle's arc: two thirds from the tip, behind the tip, behind the swage.
constexpr float kDriverAt = 0.35f, kForcepsAt = 0.93f, kTyingAt = 0.12f;
constexpr int kAttempts = 8;            // at one bite, at one grasp, at one throw
constexpr float kHalfOpen = 0.7f;       // a jaw that lets go without shaking off a loop
constexpr float kStump = 0.007f;        // [m] of thread left on a knot
constexpr float kWindAt = 0.009f;       // [m] behind the driver's tip, where thread is wound round it
constexpr float kWindRadius = 0.0019f;  // [m] of a wrap's middle line
constexpr float kWound = 0.0026f;       // [m] of thread that a radian takes, coarse as its segments are
constexpr float kSecure = 0.985f;       // of a closure that counts as closed

// Where a bite is made, in the world as it is now: a place, outward, the way of the needle, the axis about which it turns.
struct BiteFrame {
  Vec3 at, out, along, up;
};

class Scripted final : public Surgeon {
 public:
  Scripted(const std::string& technique, const PictureModel& picture, const SurgeonSkill& skill)
      : picture_(picture), skill_(skill), plan_(make_plan(technique, picture, skill)), random_(skill.seed) {
    hand_[kDriver].pose = {picture.focus + Vec3{0.06f, 0.08f, 0.05f}, {}};
    hand_[kForceps].pose = {picture.focus + Vec3{-0.08f, 0.08f, 0.06f}, {}};
  }

  bool done() const override { return gave_up_ || task_ >= plan_.task.size(); }
  bool gave_up() const override { return gave_up_; }

  std::string doing() const override {
    if (gave_up_) return "gave up: " + doing_;
    return task_ >= plan_.task.size() ? "done" : doing_;
  }

  std::array<ToolInput, 2> operate(const Snapshot& seen, float dt) override {
    const std::array<Pose, 2> before{hand_[0].pose, hand_[1].pose};
    buttons_ = {};
    if (!done()) {
      waited_ += dt;
      dt_ = dt;
      if (act(plan_.task[task_], seen)) {
        ++task_;
        begin();
      }
    }
    std::array<ToolInput, 2> out;
    for (size_t k = 0; k < 2; ++k) {
      tremble(hand_[k], skill_.tremor, random_, dt);
      out[k] = as_input(hand_[k], before[k], dt, sequence_);
      out[k].buttons = buttons_[k];
    }
    ++sequence_;
    return out;
  }

 private:
  // --- the state of a task ----------------------------------------------------------------------------------------------
  void begin() {
    stage_ = 0;
    waited_ = 0;
    misses_ = 0;
    attempts_ = 0;
    depth_fix_ = 0;
  }
  void go(int stage) {
    stage_ = stage;
    waited_ = 0;
  }
  bool patience(float seconds) const { return waited_ < seconds; }
  // Counts a miss; gives up after too many.
  void miss(int back_to) {
    if (++misses_ > kAttempts) gave_up_ = true;
    go(back_to);
  }

  // --- hands ------------------------------------------------------------------------------------------------------------
  bool move(size_t hand, const Pose& goal, float speed) { return move_toward(hand_[hand], goal, speed, dt_); }
  bool jaw(size_t hand, float goal) { return move_jaw(hand_[hand], goal, dt_); }
  float careful() const { return 0.35f * skill_.speed; }
  bool holds_needle(const Snapshot& seen, size_t hand) const { return seen.tool[hand].held == Held::needle; }
  // Tool pose that puts the held needle at `needle`.
  Pose holding(size_t hand, const Pose& needle) const { return needle * hand_[hand].grip; }
  void remember_grip(const Snapshot& seen, size_t hand) { hand_[hand].grip = inverse(seen.needle.pose) * seen.tool[hand].pose; }
  static Pose raised(const Pose& tool, float by) { return {tool.p + rotate(tool.q, {0, 0, by}), tool.q}; }

  // The hand that is not needed waits out of the way, on its own side of the field.
  void rest_aside(const Snapshot& seen, size_t hand) {
    const BiteFrame f = frame(seen, place_);
    const float side = hand == kDriver ? plan_.driver_side : plan_.forceps_side;
    const Vec3 lateral = plan_.forceps_side == plan_.driver_side ? f.along * (hand == kDriver ? -0.05f : 0.05f) : Vec3{};
    const Vec3 p = picture_.focus + f.out * 0.07f + f.up * (0.09f * side) + lateral;
    move(hand, {p, hand_[hand].pose.q}, skill_.speed);
    jaw(hand, 1);
  }

  // --- bites ------------------------------------------------------------------------------------------------------------
  BiteFrame frame(const Snapshot& seen, size_t place) const {
    const BitePlace& b = plan_.place[std::min(place, plan_.place.size() - 1)];
    BiteFrame f;
    Quat turned;
    f.at = live_place(picture_, seen, b.at, b.wall, &turned);
    if (b.walls > 1 && picture_.rim.size() > 1 && picture_.body.size() == 1) {
      // Between two layers: the middle of where the place would be on either.
      f.at = 0.5f * (f.at + live_place(picture_, seen, b.at, 1, nullptr));
      f.out = b.out;
    } else {
      f.out = rotate(turned, b.out);
    }
    if (b.level) f.out = normalized(f.out - b.up * (0.5f * dot(f.out, b.up)));
    f.up = normalized(b.up - f.out * dot(b.up, f.out));
    f.along = cross(f.out, f.up);
    return f;
  }
  const BitePlace& bite() const { return plan_.place[place_]; }
  float half_bite_angle() const { return std::asin(std::min(0.9f, 0.5f * bite().length / picture_.needle_radius)); }

  // The needle with its tip `psi` past the deepest place of a bite at frame f.
  Pose needle_at(const BiteFrame& f, float psi) const {
    const Vec3 centre = f.at + f.out * (picture_.needle_radius - bite().depth + depth_error_ + depth_fix_);
    const Vec3 x = f.out * std::cos(psi) - f.along * std::sin(psi);
    // The tip is at the end of the arc: for other arcs than a half circle turn back by what is missing.
    const Pose half{centre, from_axes(x, cross(f.up, x), f.up)};
    return half * Pose{{}, axis_angle({0, 0, 1}, kPi - picture_.needle_arc)};
  }

  // A tool frame that grips the needle (at `needle`) at place s of its arc: the shaft leaves the needle's plane on `side` and
  // leans by `lean` toward what is outward of the tissue when the tip is `psi` past the deepest place.
  Pose grip_at(const Pose& needle, float s, float side, float lean, float psi) const {
    const float phi = s * picture_.needle_arc;
    const Vec3 radial = rotate(needle.q, {std::cos(phi), std::sin(phi), 0});
    const Vec3 outward = rotate(needle.q, {std::cos(psi), -std::sin(psi), 0});
    const Vec3 z = normalized(rotate(needle.q, {0, 0, side}) + outward * lean);
    const Vec3 y = normalized(cross(z, radial), any_perpendicular(z)), x = cross(y, z);
    return {needle.p + radial * picture_.needle_radius, from_axes(x, y, z)};
  }
  Pose driver_grip(const Pose& needle) const {
    return grip_at(needle, kDriverAt, plan_.driver_side, plan_.lift > 0 ? 0.0f : 0.7f, 0.2f);
  }
  Pose forceps_grip(const Pose& needle) const {
    return grip_at(needle, kForcepsAt, plan_.forceps_side, plan_.lift > 0 ? 0.3f : 0.8f, 2.6f);
  }

  // Draws the errors of the next bite.
  void aim() {
    aim_along_ = skill_.aim_error * random_.normal();
    aim_up_ = skill_.aim_error * random_.normal();
    depth_error_ = 0.4f * skill_.aim_error * random_.normal();
  }

  // --- tasks ------------------------------------------------------------------------------------------------------------
  // Each returns true when it is finished.
  bool act(const Task& task, const Snapshot& seen) {
    switch (task.kind) {
      case TaskKind::pick_up:
        doing_ = "pick up the needle";
        return pick_up(seen);
      case TaskKind::bite:
        place_ = static_cast<size_t>(task.which);
        return make_bite(seen);
      case TaskKind::pull_tail:
      case TaskKind::pull_slack:
      case TaskKind::pull_together:
        doing_ = name_of_bite() + "pull the thread";
        return pull(task.kind, seen);
      case TaskKind::hand_back:
        doing_ = name_of_bite() + "take the needle back";
        return take_back(seen, true);
      case TaskKind::regrip:
        doing_ = "take the needle near its end, to tie";
        return regrip(seen);
      case TaskKind::draw:
        doing_ = "draw the suture tight";
        return draw(seen);
      case TaskKind::throw_:
      case TaskKind::lock_strand:
        return tie(task, seen);
      case TaskKind::cut_long:
      case TaskKind::cut_tail:
      case TaskKind::cut_needle:
        doing_ = "cut the thread";
        return cut(task.kind, seen);
      case TaskKind::take_both:
        doing_ = "take both ends";
        return take_both(seen);
      case TaskKind::fresh:
        doing_ = "take a fresh needle";
        return fresh(seen);
      case TaskKind::rest:
        doing_ = "hold";
        return waited_ > 1.5f;
    }
    return true;
  }

  std::string name_of_bite() const {
    return "bite " + std::to_string(place_ + 1) + " of " + std::to_string(plan_.place.size()) + ": ";
  }

  bool pick_up(const Snapshot& seen) {
    enum { over, down, close };
    const Pose grip = driver_grip(seen.needle.pose);
    if (stage_ != over || seen.tick > 0) rest_aside(seen, kForceps);
    switch (stage_) {
      case over:
        jaw(kDriver, 1);
        if (move(kDriver, raised(grip, 0.03f), skill_.speed)) go(down);
        return false;
      case down:
        if (move(kDriver, grip, careful())) go(close);
        return false;
      default:
        if (!jaw(kDriver, 0) || waited_ < 0.35f) return false;
        if (!holds_needle(seen, kDriver)) return miss(over), false;
        remember_grip(seen, kDriver);
        return true;
    }
  }

  bool make_bite(const Snapshot& seen) {
    enum { hover, approach, drive, withdraw, over, down, close, release, retreat, bring };
    const float speed = skill_.speed, psi_bite = half_bite_angle();
    const Pose& needle = seen.needle.pose;
    if (stage_ == hover && waited_ <= dt_) aim();
    switch (stage_) {
      case hover: {  // to a place beside the bite, clear of the organ
        doing_ = name_of_bite() + "approach";
        rest_aside(seen, kForceps);
        BiteFrame f = frame(seen, place_);
        f.at += f.out * 0.022f + f.up * plan_.lift;
        if (move(kDriver, holding(kDriver, needle_at(f, -psi_bite - 0.7f)), speed)) go(approach);
        else if (!patience(6)) gave_up_ = true;
        return false;
      }
      case approach: {
        rest_aside(seen, kForceps);
        frame_ = frame(seen, place_);
        frame_.at += frame_.along * aim_along_ + frame_.up * aim_up_;
        psi_ = -psi_bite - 0.45f;
        if (move(kDriver, holding(kDriver, needle_at(frame_, psi_)), careful())) {
          bites_before_ = seen.bite.size();
          go(drive);
        } else if (!patience(5)) {
          gave_up_ = true;
        }
        return false;
      }
      case drive: {
        doing_ = name_of_bite() + "drive the needle";
        rest_aside(seen, kForceps);
        psi_ += skill_.drive_speed / picture_.needle_radius * dt_;
        move(kDriver, holding(kDriver, needle_at(frame_, psi_)), 2 * speed);
        const bool out = seen.bite.size() >= bites_before_ + static_cast<size_t>(bite().walls) && seen.bite.back().has_exit;
        if (out && psi_ > psi_bite + 0.72f) {
          go(over);
        } else if (psi_ > psi_bite + 1.1f) {
          // The tip is not where it should be: it never went in or not deep enough, or it went too deep to come out.
          const bool shallow = !seen.needle.in_tissue || (seen.bite.size() > bites_before_ && seen.bite.back().has_exit);
          depth_fix_ += shallow ? -0.0003f : 0.0003f;
          go(withdraw);
        }
        return false;
      }
      case withdraw: {  // back the way it came, then the same bite again
        doing_ = name_of_bite() + "draw back and try again";
        rest_aside(seen, kForceps);
        psi_ = std::max(psi_ - 2 * skill_.drive_speed / picture_.needle_radius * dt_, -psi_bite - 0.7f);
        BiteFrame f = frame_;
        if (!patience(1.5f)) f.at += f.out * std::min(0.01f, 0.01f * (waited_ - 1.5f));  // it sticks: away from the wall
        move(kDriver, holding(kDriver, needle_at(f, psi_)), 2 * speed);
        if (psi_ <= -psi_bite - 0.7f && !seen.needle.in_tissue) {
          if (++attempts_ > kAttempts) gave_up_ = true;
          go(hover);
        } else if (!patience(8)) {
          gave_up_ = true;
        }
        return false;
      }
      case over:
        doing_ = name_of_bite() + "take the tip";
        jaw(kForceps, 1);
        if (move(kForceps, raised(forceps_grip(needle), 0.025f), speed)) go(down);
        return false;
      case down:
        if (move(kForceps, forceps_grip(needle), careful())) go(close);
        return false;
      case close:
        if (!jaw(kForceps, 0) || waited_ < 0.3f) return false;
        if (!holds_needle(seen, kForceps)) return miss(over), false;
        misses_ = 0;
        remember_grip(seen, kForceps);
        go(release);
        return false;
      case release:
        if (jaw(kDriver, 1)) go(retreat);
        return false;
      case retreat:
        if (move(kDriver, raised(hand_[kDriver].pose, 0.01f), speed) || waited_ > 0.25f) go(bring);
        return false;
      default: {
        doing_ = name_of_bite() + "bring the needle through";
        rest_aside(seen, kDriver);
        psi_ = std::min(psi_ + 2 * skill_.drive_speed / picture_.needle_radius * dt_, psi_bite + kPi + 0.5f);
        BiteFrame f = frame_;
        if (!patience(3))  // it sticks: a pull outward frees the back end
          f.at += (f.out + (plan_.lift > 0 ? 0.4f : 0.0f) * f.up) * std::min(0.02f, 0.01f * (waited_ - 3));
        move(kForceps, holding(kForceps, needle_at(f, psi_)), 2 * speed);
        if (seen.bite.size() > bites_before_ && !seen.needle.in_tissue && seen.bite.back().complete) {
          pull_from_ = hand_[kForceps].pose;
          return true;
        }
        if (!patience(8)) gave_up_ = true;
        return false;
      }
    }
  }

  bool pull(TaskKind kind, const Snapshot& seen) {
    rest_aside(seen, kDriver);
    if (seen.suture_point.empty()) return true;
    const Vec3 way = plan_.lift > 0 ? normalized(frame_.out * 0.85f + frame_.up * 0.4f)
                                    : normalized(frame_.out + frame_.up * (0.35f * plan_.forceps_side));
    const size_t n = seen.suture_point.size();
    float slack = 0;
    if (kind == TaskKind::pull_tail) {
      slack = length_between(seen, 0, first_point_node(seen)) - skill_.tail;
    } else if (kind == TaskKind::pull_slack && n > 2) {
      // Between the bite before and this one: thread there against the straight way.
      const SuturePointView &a = seen.suture_point[n - 3], &b = seen.suture_point[n - 2];
      slack = length_between(seen, node_of(seen, a.anchored), node_of(seen, b.anchored)) -
              1.1f * distance(a.position, b.position) - 0.001f;
    } else if (kind == TaskKind::pull_together) {
      slack = open_seam(seen);
    }
    // Thread that cannot be drawn further is left: the last pull takes up the slack.
    if (slack <= 0 || distance(hand_[kForceps].pose.p, pull_from_.p) > 0.29f || !patience(12)) return true;
    // Slow down before the thread runs tight, and when it pulls back: a jerk would tear.
    const float gently = std::clamp(2.0f - length(seen.tool[kForceps].force), 0.02f, 1.0f);
    move(kForceps, {pull_from_.p + way * 0.3f, hand_[kForceps].pose.q}, gently * std::min(skill_.speed, 0.015f + 5 * slack));
    return false;
  }

  // [m] by which the midpoints are still apart, the slowest of them; 0 once all count as closed.
  static float open_seam(const Snapshot& seen) {
    float open = 0;
    for (const SeamView& s : seen.seam)
      if (s.midpoint && s.progress < kSecure) open = std::max(open, (1 - s.progress) * s.start);
    return open;
  }

  // The driver takes the needle from the forceps; with `present` the forceps first brings it beside the next bite.
  bool take_back(const Snapshot& seen, bool present) {
    enum { bring, over, down, close, give };
    switch (stage_) {
      case bring: {
        rest_aside(seen, kDriver);
        const size_t next = std::min(place_ + 1, plan_.place.size() - 1);
        BiteFrame f = frame(seen, present ? next : place_);
        f.at += f.out * (present ? 0.03f : 0.045f) + f.up * (1.7f * plan_.lift);
        if (move(kForceps, holding(kForceps, needle_at(f, -half_bite_angle() - 0.7f)), skill_.speed)) go(over);
        else if (!patience(6)) gave_up_ = true;
        return false;
      }
      case over:
        jaw(kDriver, 1);
        if (move(kDriver, raised(driver_grip(seen.needle.pose), 0.025f), skill_.speed)) go(down);
        return false;
      case down:
        if (move(kDriver, driver_grip(seen.needle.pose), careful())) go(close);
        return false;
      case close:
        if (!jaw(kDriver, 0) || waited_ < 0.3f) return false;
        if (!holds_needle(seen, kDriver)) return miss(over), false;
        remember_grip(seen, kDriver);
        go(give);
        return false;
      default:
        return jaw(kForceps, 1);
    }
  }

  // --- tying ------------------------------------------------------------------------------------------------------------
  // How the hands stand to tie: the driver lies across the wound from the right, the forceps comes from the left.
  static Pose tying_pose(size_t hand, Vec3 at) {
    const Vec3 z = normalized(Vec3{hand == kDriver ? 1.0f : -1.0f, 0.3f, 0.15f}), x = normalized(Vec3{0, 1, 0} - z * z.y);
    return {at, from_axes(x, cross(z, x), z)};
  }

  bool regrip(const Snapshot& seen) {
    enum { first = 0, over = 10, down, close, give };
    if (stage_ < over) {
      if (!holds_needle(seen, kDriver) || stage_ > first) {
        if (!take_back(seen, false)) return false;
      }
      go(over);
      return false;
    }
    const float phi = kTyingAt * picture_.needle_arc;
    const Vec3 place = transform(seen.needle.pose, picture_.needle_radius * Vec3{std::cos(phi), std::sin(phi), 0});
    const Pose grip = tying_pose(kForceps, place);
    switch (stage_) {
      case over:
        jaw(kForceps, 1);
        if (move(kForceps, raised(grip, 0.025f), skill_.speed)) go(down);
        else if (!patience(6)) gave_up_ = true;
        return false;
      case down:
        if (move(kForceps, grip, careful())) go(close);
        else if (!patience(4)) gave_up_ = true;
        return false;
      case close:
        if (!jaw(kForceps, 0) || waited_ < 0.3f) return false;
        if (!holds_needle(seen, kForceps)) return miss(over), false;
        remember_grip(seen, kForceps);
        go(give);
        return false;
      default:
        jaw(kDriver, 1);
        return move(kDriver, raised(hand_[kDriver].pose, 0.02f), skill_.speed) || waited_ > 0.6f;
    }
  }

  // Where the stitch is tied: at its knot, else in the middle between the ends of its thread in the tissue.
  Vec3 stitch(const Snapshot& seen) const {
    if (!seen.knot.empty()) return seen.knot.back().position;
    if (seen.suture_point.empty()) return picture_.focus;
    return 0.5f * (seen.suture_point.front().position + seen.suture_point.back().position);
  }
  Vec3 swage(const Snapshot& seen) const { return transform(seen.needle.pose, Vec3{picture_.needle_radius, 0, 0}); }
  // Moves the forceps so that the needle's swage, which it holds, comes to `goal`.
  bool carry_swage(const Snapshot& seen, Vec3 goal, float speed) {
    return move(kForceps, {goal + (seen.tool[kForceps].pose.p - swage(seen)), tying_pose(kForceps, {}).q}, speed);
  }

  // An instrument tie. The needle's strand is held up, the driver is laid beside it, the forceps carries the strand round the
  // driver; then the driver, the loop on it, takes the tail and the hands pull apart.
  bool tie(const Task& task, const Snapshot& seen) {
    enum { lift, lay, beside, wind, over, down, close, tighten, open, unwind };
    const bool own_strand = task.kind == TaskKind::lock_strand;
    doing_ = std::string(own_strand ? "lock the thread: " : "throw: ") + std::to_string(task.which) + " wrap" +
             (task.which > 1 ? "s" : "");
    const ToolView& driver = seen.tool[kDriver];
    const float side = static_cast<float>(task.way);
    const size_t last = seen.thread_order.size() - 1;
    if (stage_ == lift && waited_ <= dt_) {
      // The strand rises from the last suture point, or from the knot that is already there.
      start_ = seen.knot.empty() && !seen.suture_point.empty() ? seen.suture_point.back().position : stitch(seen);
      reach_ = std::max(0.03f, length_between(seen, last_point_node(seen), last));
      taut_ = 0.97f;
      frozen_at_ = 0;
      wraps_seen_ = 0;
      // So high that the hand, going round below, keeps clear of the tissue.
      height_ = std::clamp(0.5f * reach_ + 0.004f, 0.025f, 0.09f);
      throws_before_ = seen.knot.empty() ? 0 : seen.knot.back().throws;
      knots_before_ = seen.knot.size();
    }
    // Across the driver: e1 away from the tissue, e2 to its side.
    const Vec3 z = rotate(tying_pose(kDriver, {}).q, {0, 0, 1}), e1 = normalized(Vec3{0, 1, 0} - z * z.y), e2 = cross(z, e1);
    const Vec3 axis_at = start_ + e1 * height_ - e2 * (side * kWindRadius);
    const Pose lying = tying_pose(kDriver, axis_at - z * kWindAt);
    // The strand, just not taut, leaving the driver after turning by w about it.
    auto swage_at = [&](float w) {
      const float way = side * w;
      const Vec3 leave = axis_at + kWindRadius * (e2 * (side * std::cos(w)) + e1 * std::sin(w)) + z * (0.00012f * std::abs(w));
      const Vec3 to = e1 * std::cos(way) - e2 * std::sin(way);
      // What lies frozen round the driver is spent; what was wound since takes its part.
      const float left = driver.loop_wraps > 0 ? length_between(seen, node_of(seen, driver.loop_last), last) -
                                                     kWound * std::max(0.0f, w - frozen_at_)
                                               : reach_ - height_ - kWound * std::max(0.0f, w);
      const float free = std::max(0.008f, taut_ * left);
      // It leaves slanting toward the hand, so that it crosses above the strand that comes up and not against it.
      return leave + to * free + z * std::min(0.35f * free, 0.007f);
    };
    // The strand is kept just taut by feel: four per cent of slack would let it sag by a seventh of its length.
    const float tension = seen.thread_tension.empty() ? 0 : seen.thread_tension.back();
    if (stage_ <= wind)
      taut_ = std::clamp(taut_ + dt_ * (tension < 0.02f ? 0.12f : tension > 0.15f ? -2.0f : tension > 0.06f ? -0.4f : 0.0f), 0.85f, 1.02f);
    switch (stage_) {
      case lift:
        jaw(kDriver, kHalfOpen);
        move(kDriver, {lying.p - e2 * (side * 0.03f) + Vec3{0, 0.01f, 0}, lying.q}, skill_.speed);
        if (carry_swage(seen, swage_at(-0.25f), skill_.speed)) go(lay);
        else if (!patience(8)) go(lay);
        return false;
      case lay:
        carry_swage(seen, swage_at(-0.25f), skill_.speed);
        if (move(kDriver, {lying.p - e2 * (side * 0.012f), lying.q}, skill_.speed)) go(beside);
        else if (!patience(6)) gave_up_ = true;
        return false;
      case beside:
        carry_swage(seen, swage_at(-0.25f), careful());
        if (move(kDriver, lying, careful()) || !patience(4)) {
          wound_ = -0.25f;
          go(wind);
        }
        return false;
      case wind: {
        const float want = static_cast<float>(task.which) * 2 * kPi + 0.6f;
        if (driver.loop_wraps != wraps_seen_) wraps_seen_ = driver.loop_wraps, frozen_at_ = wound_;
        wound_ = std::min(wound_ + 2.2f * dt_, want + 0.9f);
        carry_swage(seen, swage_at(wound_), 1.2f * skill_.speed);
        move(kDriver, lying, careful());
        if (driver.loop_wraps >= static_cast<uint32_t>(task.which)) go(over);
        else if (wound_ >= want + 0.9f && waited_ > 7) go(unwind);
        return false;
      }
      case over:
      case down:
      case close: {
        if (driver.loop_wraps == 0 && stage_ != close) return miss(lift), false;
        if (own_strand) return take_strand(seen, lying, close, tighten, lift);
        // A place on the tail a little way from the stitch; after a miss another, since that one may lie against the tissue.
        const size_t first = first_point_node(seen);
        const float away = 0.012f + 0.004f * static_cast<float>(misses_ % 4);
        const Vec3 thread = node_at(seen, node_along(seen, first, away, -1));
        const Pose goal{thread, lying.q};
        carry_swage(seen, hand_[kDriver].pose.p + z * kWindAt + (swage_at(wound_) - axis_at), 2 * skill_.speed);
        if (stage_ == over) {
          jaw(kDriver, kHalfOpen);
          if (move(kDriver, raised(goal, 0.012f), 0.6f * skill_.speed)) go(down);
          else if (!patience(6)) miss(unwind);
        } else if (stage_ == down) {
          if (move(kDriver, goal, careful())) go(close);
          else if (!patience(4)) miss(over);
        } else if (jaw(kDriver, 0) && waited_ > 0.35f) {
          if (driver.held == Held::thread && node_of(seen, driver.held_slot) < first) {
            pull_from_ = hand_[kDriver].pose;
            go(tighten);
          } else {
            miss(over);
          }
        }
        return false;
      }
      case tighten: {
        const bool locked = seen.knot.size() > 0 && seen.knot.back().phase == KnotPhase::locked &&
                            (seen.knot.size() > knots_before_ || seen.knot.back().throws > throws_before_);
        // The strands are drawn apart, low and even.
        auto gently = [&](size_t hand) {
          return 0.6f * skill_.speed * std::clamp(1.5f - length(seen.tool[hand].force), 0.03f, 1.0f);
        };
        const Vec3 right = normalized(Vec3{side, 0.35f, 0.1f}), left = normalized(Vec3{-side, 0.35f, 0.1f});
        move(kDriver, {pull_from_.p + right * 0.08f, hand_[kDriver].pose.q}, gently(kDriver));
        carry_swage(seen, start_ + (own_strand ? Vec3{0, 1, 0} : left) * (0.9f * reach_), gently(kForceps));
        if (locked && waited_ > 0.5f) go(open);
        else if (driver.held != Held::thread) miss(lift);
        else if (!patience(8)) miss(unwind);
        return false;
      }
      case open:
        jaw(kDriver, kHalfOpen);
        return move(kDriver, raised(hand_[kDriver].pose, 0.02f), skill_.speed) || waited_ > 0.8f;
      default:  // unwind: shake the loop off and begin again
        jaw(kDriver, 1);
        wound_ = std::max(-0.25f, wound_ - 4 * dt_);
        carry_swage(seen, swage_at(wound_), skill_.speed);
        if (move(kDriver, raised(lying, 0.03f), skill_.speed) && waited_ > 1) miss(lift);
        else if (!patience(5)) miss(lift);
        return false;
    }
  }

  // The needle's own strand is laid between the driver's jaws, past the loop.
  bool take_strand(const Snapshot& seen, const Pose& lying, int close, int tighten, int again) {
    const Vec3 z = rotate(lying.q, {0, 0, 1});
    const ToolView& driver = seen.tool[kDriver];
    const Vec3 ahead = driver.pose.p - z * 0.02f;
    if (stage_ != close) {
      jaw(kDriver, kHalfOpen);
      move(kDriver, lying, careful());
      if (carry_swage(seen, ahead, skill_.speed) && waited_ > 0.5f) go(close);
      else if (!patience(5)) go(close);
      return false;
    }
    if (jaw(kDriver, 0) && waited_ > 0.35f) {
      if (driver.held == Held::thread && node_of(seen, driver.held_slot) > last_point_node(seen)) {
        pull_from_ = hand_[kDriver].pose;
        go(tighten);
      } else {
        miss(again);
      }
    }
    return false;
  }

  // --- both hands on the thread -----------------------------------------------------------------------------------------
  // The driver takes the tail, then both pull until everything is closed.
  bool draw(const Snapshot& seen) {
    enum { over, down, close, pull, open };
    const size_t first = first_point_node(seen);
    const BiteFrame f = frame(seen, 0);
    switch (stage_) {
      case over:
      case down:
      case close: {
        // A place on the tail a little way from the first bite, seen from outside; after a miss another.
        const float away = 0.019f + 0.005f * static_cast<float>(misses_ % 4);
        const Vec3 thread = node_at(seen, node_along(seen, first, std::min(away, 0.6f * length_between(seen, 0, first)), -1));
        const Vec3 z = plan_.lift > 0 ? normalized(f.out * 0.6f + f.up) : normalized(f.out + Vec3{0.6f, 0, 0.2f});
        const Vec3 x = normalized(f.along - z * dot(f.along, z), any_perpendicular(z));
        const Pose goal{thread, from_axes(x, cross(z, x), z)};
        if (stage_ == over) {
          jaw(kDriver, 1);
          if (move(kDriver, raised(goal, 0.03f), skill_.speed)) go(down);
          else if (!patience(8)) gave_up_ = true;
        } else if (stage_ == down) {
          if (move(kDriver, goal, careful())) go(close);
          else if (!patience(4)) gave_up_ = true;
        } else if (jaw(kDriver, 0) && waited_ > 0.3f) {
          if (seen.tool[kDriver].held != Held::thread) return miss(over), false;
          go(pull);
        }
        return false;
      }
      case pull: {
        // A surgeon feels the thread: the harder it pulls back, the slower the hand.
        auto gently = [&](size_t hand) {
          return 0.25f * skill_.speed * std::clamp(1.5f - length(seen.tool[hand].force), 0.02f, 1.0f);
        };
        const bool closed = plan_.lift > 0 ? seen.closure >= kSecure : open_seam(seen) <= 0;
        if (closed) return go(open), false;
        Vec3 left, right;
        if (plan_.lift > 0) {
          // The needle's end leaves the last bite, which lies before the first one along the rim; the tail leaves the first.
          left = normalized(f.out * 0.5f - f.along * 0.8f + f.up * 0.35f);
          right = normalized(f.out * 0.5f + f.along * 0.8f + f.up * 0.35f);
        } else {
          const Vec3 across = normalized(seen.suture_point.back().position - seen.suture_point.front().position, {1, 0, 0});
          left = normalized(across * 0.8f + f.out * 0.6f);
          right = normalized(across * -0.8f + f.out * 0.6f);
        }
        move(kForceps, {picture_.focus + left * 0.35f, hand_[kForceps].pose.q}, gently(kForceps));
        // The tail hand gives a counter-hold: it moves out only as far as keeps its own side tight.
        move(kDriver, {picture_.focus + right * 0.11f, hand_[kDriver].pose.q}, gently(kDriver));
        if (!patience(20)) gave_up_ = true;
        return false;
      }
      default:
        if (plan_.lift > 0) return true;  // a purse-string stays in the hands
        jaw(kDriver, 1);
        return move(kDriver, raised(hand_[kDriver].pose, 0.02f), skill_.speed) || waited_ > 0.8f;
    }
  }

  // --- scissors ---------------------------------------------------------------------------------------------------------
  bool cut(TaskKind kind, const Snapshot& seen) {
    enum { over, down, snip, away };
    const size_t last = seen.thread_order.size() - 1;
    if (kind == TaskKind::cut_needle) {  // the forceps holds the needle by its end: cut right there
      if (stage_ == over) {
        buttons_[kForceps] = kButtonCut;
        go(away);
      } else if (!seen.needle_on_thread || !patience(0.5f)) {
        if (seen.needle_on_thread) return miss(over), false;
        return move(kForceps, {hand_[kForceps].pose.p + Vec3{-0.03f, 0.02f, 0}, hand_[kForceps].pose.q}, skill_.speed) ||
               waited_ > 1.5f;
      }
      return false;
    }
    const bool tail = kind == TaskKind::cut_tail;
    const size_t at = node_along(seen, tail ? first_point_node(seen) : last_point_node(seen), kStump, tail ? -1 : 1);
    const Pose goal = tying_pose(kDriver, node_at(seen, std::clamp<size_t>(at, 1, last - 1)));
    switch (stage_) {
      case over:
        cuts_before_ = count_cuts(seen);
        jaw(kDriver, kHalfOpen);
        if (move(kDriver, raised(goal, 0.015f), skill_.speed) || !patience(5)) go(down);
        return false;
      case down:
        if (move(kDriver, goal, careful()) || !patience(3)) go(snip);
        return false;
      case snip:
        buttons_[kDriver] = kButtonCut;
        go(away);
        return false;
      default:
        move(kDriver, raised(hand_[kDriver].pose, 0.015f), skill_.speed);
        if (waited_ < 0.3f) return false;
        if (count_cuts(seen) == cuts_before_) return miss(over), false;
        return true;
    }
  }
  static size_t count_cuts(const Snapshot& seen) {
    size_t n = 0;
    for (const uint8_t c : seen.thread_cut) n += c;
    return n;
  }

  bool fresh(const Snapshot& seen) {
    enum { let_go, ask, wait };
    rest_aside(seen, kDriver);
    rest_aside(seen, kForceps);
    switch (stage_) {
      case let_go:
        if (waited_ > 0.6f) go(ask);
        return false;
      case ask:
        buttons_[kDriver] = kButtonNewSuture;
        settled_before_ = seen.settled.size();
        go(wait);
        return false;
      default:
        if (waited_ < 0.3f) return false;
        if (seen.settled.size() == settled_before_) return miss(let_go), false;
        return true;
    }
  }

  // The needle's strand is laid along the tail; the driver closes on both.
  bool take_both(const Snapshot& seen) {
    enum { lay, over, down, close };
    const size_t first = first_point_node(seen);
    const size_t at = node_along(seen, first, 0.014f + 0.003f * static_cast<float>(misses_ % 3), -1);
    const Vec3 thread = node_at(seen, at), knot = stitch(seen);
    const Vec3 way = normalized(thread - knot, {1, 0, 0});
    const float free = length_between(seen, last_point_node(seen), seen.thread_order.size() - 1);
    const Pose goal = tying_pose(kDriver, thread);
    carry_swage(seen, knot + normalized(way + Vec3{0, 0.12f, 0}) * (0.97f * free), skill_.speed);
    switch (stage_) {
      case lay:
        jaw(kDriver, kHalfOpen);
        move(kDriver, raised(goal, 0.03f), skill_.speed);
        if (waited_ > 2.0f) go(over);
        return false;
      case over:
        jaw(kDriver, kHalfOpen);
        if (move(kDriver, raised(goal, 0.02f), skill_.speed) || !patience(4)) go(down);
        return false;
      case down:
        if (move(kDriver, goal, careful()) || !patience(4)) go(close);
        return false;
      default:
        if (!jaw(kDriver, 0) || waited_ < 0.35f) return false;
        if (seen.tool[kDriver].held != Held::thread || seen.tool[kDriver].held_strands < 2) return miss(over), false;
        return true;
    }
  }

  PictureModel picture_;
  SurgeonSkill skill_;
  Plan plan_;
  Random random_;
  std::array<ScriptedHand, 2> hand_;
  std::array<uint32_t, 2> buttons_{};
  size_t task_ = 0;
  int stage_ = 0;     // within the task
  float waited_ = 0;  // [s] in this stage
  float dt_ = 1.0f / 60;
  int misses_ = 0, attempts_ = 0;
  bool gave_up_ = false;
  std::string doing_ = "pick up the needle";
  // A bite.
  size_t place_ = 0, bites_before_ = 0;
  BiteFrame frame_;
  float psi_ = 0, aim_along_ = 0, aim_up_ = 0, depth_error_ = 0;
  float depth_fix_ = 0;  // [m] what the failed attempts at this bite taught; positive: shallower
  Pose pull_from_;
  // A throw.
  Vec3 start_;
  float reach_ = 0, height_ = 0, wound_ = 0;
  float taut_ = 1;  // the strand's straight length over what it was reckoned to be
  size_t knots_before_ = 0, cuts_before_ = 0, settled_before_ = 0;
  float frozen_at_ = 0;  // [rad] wound when the loop was last seen to grow
  uint32_t throws_before_ = 0, wraps_seen_ = 0;
  uint32_t sequence_ = 0;
};

}  // namespace

std::unique_ptr<Surgeon> make_surgeon(const std::string& technique, const PictureModel& picture, const SurgeonSkill& skill) {
  return std::make_unique<Scripted>(technique, picture, skill);
}

}  // namespace catgut
