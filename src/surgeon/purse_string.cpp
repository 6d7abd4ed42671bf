// surgeon/purse_string: the script of paper 2.5.1 as a surgeon does it. Needle driver (right) drives a seromuscular bite along
// the rim by turning the needle about its own circle; the forceps (left) takes the tip, brings it through and pulls the thread;
// the driver takes the needle back for the next bite. At the end one hand holds the needle's end, the other the tail, and both
// pull. Reads Snapshots only; each step looks at what really happened before the next begins. What goes wrong is tried again: a
// bite whose tip did not come out is drawn back and driven a little shallower or deeper, a missed grasp is approached anew.
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "surgeon/hands.h"
#include "surgeon/surgeon.h"

namespace catgut {
namespace {

constexpr size_t kDriver = 0, kForceps = 1;
constexpr float kDriverAt = 0.35f, kForcepsAt = 0.93f;  // places on the needle's arc: two thirds from the tip, behind the tip
constexpr int kAttempts = 8;                            // at one bite, at one grasp

enum class Step {
  pick_over,
  pick_down,
  pick_close,
  hover,
  approach,
  drive,
  withdraw,
  take_over,
  take_down,
  take_close,
  release,
  retreat,
  drive_through,
  pull,
  present,
  back_over,
  back_down,
  back_close,
  give,
  tail_over,
  tail_down,
  tail_close,
  tighten,
  hold,
  done
};

// Where a bite is made, in the world as it is now: a place on the serosa, its outward normal, the way along the rim, the way to
// the rim.
struct BiteFrame {
  Vec3 at, out, along, up;
};

class PurseStringSurgeon final : public Surgeon {
 public:
  PurseStringSurgeon(const PictureModel& picture, const SurgeonSkill& skill)
      : picture_(picture), skill_(skill), random_(skill.seed) {
    if (picture.rim.empty() || picture.body.empty()) throw std::invalid_argument("the scene has no opening for a purse-string");
    find_places();
    hand_[kDriver].pose = {picture.focus + Vec3{0.06f, 0.08f, 0.05f}, {}};
    hand_[kForceps].pose = {picture.focus + Vec3{-0.08f, 0.08f, 0.06f}, {}};
  }

  bool done() const override { return step_ == Step::done; }

  std::string doing() const override {
    const std::string bite =
        "bite " + std::to_string(std::min(bite_ + 1, skill_.bites)) + " of " + std::to_string(skill_.bites) + ": ";
    switch (step_) {
      case Step::pick_over:
      case Step::pick_down:
      case Step::pick_close:
        return "pick up the needle";
      case Step::hover:
      case Step::approach:
        return bite + "approach";
      case Step::drive:
        return bite + "drive the needle";
      case Step::withdraw:
        return bite + "draw back and try again";
      case Step::take_over:
      case Step::take_down:
      case Step::take_close:
      case Step::release:
      case Step::retreat:
        return bite + "take the tip";
      case Step::drive_through:
        return bite + "bring the needle through";
      case Step::pull:
        return bite + "pull the thread";
      case Step::present:
      case Step::back_over:
      case Step::back_down:
      case Step::back_close:
      case Step::give:
        return bite + "take the needle back";
      case Step::tail_over:
      case Step::tail_down:
      case Step::tail_close:
        return "take the tail";
      case Step::tighten:
        return "draw the purse-string tight";
      case Step::hold:
        return "hold";
      case Step::done:
        return gave_up_ ? "gave up" : "done";
    }
    return "";
  }

  std::array<ToolInput, 2> operate(const Snapshot& seen, float dt) override {
    const std::array<Pose, 2> before{hand_[0].pose, hand_[1].pose};
    waited_ += dt;
    act(seen, dt);
    std::array<ToolInput, 2> out;
    for (size_t k = 0; k < 2; ++k) {
      tremble(hand_[k], skill_.tremor, random_, dt);
      out[k] = as_input(hand_[k], before[k], dt, sequence_);
    }
    ++sequence_;
    return out;
  }

 private:
  // --- seeing ---------------------------------------------------------------------------------------------------------
  // The rest-state place of each bite: the serosa vertex at its angle round the opening, edge_distance from the rim.
  void find_places() {
    const std::vector<uint32_t>& rim = picture_.rim[0];
    Vec3 centre{}, normal{};
    for (uint32_t i : rim) centre += picture_.particle_rest[i] / static_cast<float>(rim.size());
    for (size_t i = 0; i < rim.size(); ++i)
      normal += cross(picture_.particle_rest[rim[i]] - centre, picture_.particle_rest[rim[(i + 1) % rim.size()]] - centre);
    axis_ = normalized(normal);
    if (dot(axis_, centre - mean_rest()) < 0) axis_ = -axis_;  // out of the opening
    const Vec3 u = normalized(Vec3{1, 0, 0} - axis_ * axis_.x, any_perpendicular(axis_)), v = cross(axis_, u);
    float round = 0;
    for (size_t i = 0; i < rim.size(); ++i)
      round += distance(picture_.particle_rest[rim[i]], picture_.particle_rest[rim[(i + 1) % rim.size()]]);
    ring_radius_ = round / (2 * kPi);
    const VisibleMesh& mesh = picture_.body[0];
    // Bites are even in length round the rim, not in angle: an organ's rim is no circle.
    std::vector<float> run{0};
    std::vector<float> angle;
    const size_t n = rim.size();
    auto angle_of = [&](Vec3 p) { return std::atan2(dot(p - centre, v), dot(p - centre, u)); };
    size_t start = 0;
    for (size_t i = 0; i < n; ++i)
      if (std::abs(angle_of(picture_.particle_rest[rim[i]])) < std::abs(angle_of(picture_.particle_rest[rim[start]])))
        start = i;
    const bool counter = dot(normal, axis_) > 0;  // go clockwise seen from above: the way a right hand's needle turns
    auto rim_at = [&](size_t i) { return picture_.particle_rest[rim[(start + (counter ? n - i % n : i % n)) % n]]; };
    for (size_t i = 0; i < n; ++i) run.push_back(run.back() + distance(rim_at(i), rim_at(i + 1)));
    for (int b = 0; b < skill_.bites; ++b) {
      const float want = run.back() * static_cast<float>(b) / static_cast<float>(skill_.bites);
      size_t i = 0;
      while (i + 1 < n && run[i + 1] <= want) ++i;
      const Vec3 on_rim = lerp(rim_at(i), rim_at(i + 1), (want - run[i]) / std::max(run[i + 1] - run[i], 1e-6f));
      const Vec3 radial = normalized(on_rim - centre - axis_ * dot(on_rim - centre, axis_));
      const Vec3 sideways = cross(axis_, radial);
      float best = std::numeric_limits<float>::max();
      uint32_t found = 0;
      for (uint32_t k = 0; k < mesh.position.size(); ++k) {
        if (mesh.layer[k] != TissueLayer::serosa) continue;
        const Vec3 d = mesh.position[k] - on_rim;
        const float below = length(d - sideways * dot(d, sideways)) - skill_.edge_distance, side = dot(d, sideways);
        const float wrong_way = std::max(0.0f, dot(d, axis_)), score = below * below + side * side + 4 * wrong_way * wrong_way;
        if (length2(d) < 4 * skill_.edge_distance * skill_.edge_distance + 1e-5f && score < best) best = score, found = k;
      }
      place_.push_back(mesh.position[found]);
      place_normal_.push_back(mesh.normal[found]);
    }
  }
  Vec3 mean_rest() const {
    Vec3 c{};
    for (const Vec3& p : picture_.particle_rest) c += p / static_cast<float>(picture_.particle_rest.size());
    return c;
  }

  // Where a rest-state place is now, by the nearest particles; and how the tissue there has turned.
  Vec3 live(const Snapshot& seen, Vec3 rest, Quat* turned) const {
    std::array<uint32_t, 4> near{};
    std::array<float, 4> d;
    d.fill(std::numeric_limits<float>::max());
    for (uint32_t i = 0; i < picture_.particle_rest.size(); ++i) {
      const float d2 = length2(picture_.particle_rest[i] - rest);
      for (size_t k = 0; k < 4; ++k)
        if (d2 < d[k]) {
          for (size_t j = 3; j > k; --j) d[j] = d[j - 1], near[j] = near[j - 1];
          d[k] = d2, near[k] = i;
          break;
        }
    }
    Vec3 sum{};
    float weight = 0;
    for (size_t k = 0; k < 4; ++k) {
      const float w = 1 / (d[k] + 1e-7f);
      sum += w * (seen.particle[near[k]] + rotate(seen.rotation[near[k]], rest - picture_.particle_rest[near[k]]));
      weight += w;
    }
    if (turned) *turned = seen.rotation[near[0]];
    return sum / weight;
  }

  BiteFrame frame(const Snapshot& seen, int bite) const {
    const size_t b = static_cast<size_t>(std::min(bite, skill_.bites - 1));
    Quat turned;
    BiteFrame f;
    f.at = live(seen, place_[b], &turned);
    f.out = rotate(turned, place_normal_[b]);
    f.out = normalized(f.out - axis_ * (0.5f * dot(f.out, axis_)));  // hands keep the needle's circle near level
    f.up = normalized(axis_ - f.out * dot(axis_, f.out));
    f.along = cross(f.out, f.up);
    return f;
  }

  float bite_depth() const {
    return skill_.bite_length * skill_.bite_length / 8 * (1 / picture_.needle_radius + 1 / ring_radius_);
  }
  float half_bite_angle() const { return std::asin(std::min(0.9f, 0.5f * skill_.bite_length / picture_.needle_radius)); }

  // The needle with its tip `psi` past the deepest place of a bite at frame f: its circle cuts the wall over bite_length.
  Pose needle_at(const BiteFrame& f, float psi) const {
    const Vec3 centre = f.at + f.out * (picture_.needle_radius - bite_depth() + depth_error_ + depth_fix_);
    const Vec3 x = f.out * std::cos(psi) - f.along * std::sin(psi);
    // The tip is at the end of the arc: for other arcs than a half circle turn back by what is missing.
    const Pose half{centre, from_axes(x, cross(f.up, x), f.up)};
    return half * Pose{{}, axis_angle({0, 0, 1}, kPi - picture_.needle_arc)};
  }

  // A tool frame that grips the needle (at `needle`) at place s of its arc: shaft out of the needle's plane on its upper side,
  // leaning over the circle's centre by `lean`.
  Pose grip_at(const Pose& needle, float s, float lean) const {
    const float phi = s * picture_.needle_arc;
    const Vec3 radial = rotate(needle.q, {std::cos(phi), std::sin(phi), 0});
    Vec3 up = rotate(needle.q, {0, 0, 1});
    if (dot(up, axis_) < 0) up = -up;
    const Vec3 z = normalized(up - radial * lean), y = normalized(cross(z, radial)), x = cross(y, z);
    return {needle.p + radial * picture_.needle_radius, from_axes(x, y, z)};
  }
  static Pose raised(const Pose& tool, float by) { return {tool.p + rotate(tool.q, {0, 0, by}), tool.q}; }

  // Tool pose that puts the held needle at `needle`.
  Pose holding(size_t hand, const Pose& needle) const { return needle * hand_[hand].grip; }

  bool holds_needle(const Snapshot& seen, size_t hand) const { return seen.tool[hand].held == Held::needle; }

  // Lengths along the thread, from the order and the spacing that the eye can measure: distances between neighbours.
  float length_from(const Snapshot& seen, size_t from, size_t to) const {
    float sum = 0;
    for (size_t i = from; i < to && i + 1 < seen.thread_order.size(); ++i)
      sum += distance(seen.particle[seen.thread_order[i]], seen.particle[seen.thread_order[i + 1]]);
    return sum;
  }
  size_t node_of(const Snapshot& seen, uint32_t slot) const {
    for (size_t i = 0; i < seen.thread_order.size(); ++i)
      if (seen.thread_order[i] == slot) return i;
    return 0;
  }

  // --- acting ---------------------------------------------------------------------------------------------------------
  void go(Step step) {
    step_ = step;
    waited_ = 0;
  }
  void give_up() {
    gave_up_ = true;
    go(Step::done);
  }
  bool patience(float seconds) const { return waited_ < seconds; }

  void act(const Snapshot& seen, float dt) {
    ScriptedHand& driver = hand_[kDriver];
    ScriptedHand& forceps = hand_[kForceps];
    const float speed = skill_.speed, careful = 0.35f * skill_.speed;
    const Pose& needle = seen.needle.pose;
    const float psi_bite = half_bite_angle();
    const Pose aside = Pose{picture_.focus + rotate(axis_angle(axis_, 0), Vec3{0, 0.09f, 0.09f}), {}};

    // The hand that is not needed waits out of the way, on its own side of the field.
    auto rest_aside = [&](size_t hand) {
      Pose p = aside;
      const BiteFrame f = frame(seen, bite_);
      p.p = picture_.focus + f.out * 0.07f + axis_ * 0.09f + f.along * (hand == kDriver ? -0.05f : 0.05f);
      move_toward(hand_[hand], p, speed, dt);
      move_jaw(hand_[hand], 1, dt);
    };

    switch (step_) {
      case Step::pick_over:
        rest_aside(kForceps);
        move_jaw(driver, 1, dt);
        if (move_toward(driver, raised(grip_at(needle, kDriverAt, 0), 0.03f), speed, dt)) go(Step::pick_down);
        return;
      case Step::pick_down:
        if (move_toward(driver, grip_at(needle, kDriverAt, 0), careful, dt)) go(Step::pick_close);
        return;
      case Step::pick_close:
        if (!move_jaw(driver, 0, dt) || waited_ < 0.35f) return;
        if (!holds_needle(seen, kDriver)) {
          if (++misses_ > kAttempts) return give_up();
          return go(Step::pick_over);
        }
        driver.grip = inverse(needle) * seen.tool[kDriver].pose;
        misses_ = 0;
        aim();
        return go(Step::hover);

      case Step::hover: {  // to a place beside the bite, clear of the organ
        rest_aside(kForceps);
        BiteFrame f = frame(seen, bite_);
        f.at += f.out * 0.022f + f.up * 0.012f;
        if (move_toward(driver, holding(kDriver, needle_at(f, -psi_bite - 0.7f)), speed, dt)) go(Step::approach);
        else if (!patience(6)) give_up();
        return;
      }
      case Step::approach: {
        rest_aside(kForceps);
        frame_ = frame(seen, bite_);
        frame_.at += frame_.along * aim_along_ + frame_.up * aim_up_;
        psi_ = -psi_bite - 0.45f;
        if (move_toward(driver, holding(kDriver, needle_at(frame_, psi_)), careful, dt)) {
          first_bite_seen_ = seen.bite.size();
          go(Step::drive);
        } else if (!patience(5)) {
          give_up();
        }
        return;
      }
      case Step::drive: {
        rest_aside(kForceps);
        psi_ += skill_.drive_speed / picture_.needle_radius * dt;
        move_toward(driver, holding(kDriver, needle_at(frame_, psi_)), 2 * speed, dt);
        const bool out = seen.bite.size() > first_bite_seen_ && seen.bite.back().has_exit;
        if (out && psi_ > psi_bite + 0.72f) return go(Step::take_over);
        if (psi_ > psi_bite + 1.1f) {
          // The tip is not where it should be: it never went in, or it went too deep to come out.
          depth_fix_ += seen.needle.in_tissue ? 0.0003f : -0.0003f;
          return go(Step::withdraw);
        }
        return;
      }
      case Step::withdraw: {  // back the way it came, then the same bite again
        rest_aside(kForceps);
        psi_ = std::max(psi_ - 2 * skill_.drive_speed / picture_.needle_radius * dt, -psi_bite - 0.7f);
        BiteFrame f = frame_;
        if (!patience(1.5f)) f.at += f.out * std::min(0.01f, 0.01f * (waited_ - 1.5f));  // it sticks: away from the wall
        move_toward(driver, holding(kDriver, needle_at(f, psi_)), 2 * speed, dt);
        if (psi_ <= -psi_bite - 0.7f && !seen.needle.in_tissue) {
          if (++attempts_ > kAttempts) return give_up();
          aim();
          return go(Step::hover);
        }
        if (!patience(8)) give_up();
        return;
      }
      case Step::take_over:
        move_jaw(forceps, 1, dt);
        if (move_toward(forceps, raised(grip_at(needle, kForcepsAt, 0.5f), 0.025f), speed, dt)) go(Step::take_down);
        return;
      case Step::take_down:
        if (move_toward(forceps, grip_at(needle, kForcepsAt, 0.5f), careful, dt)) go(Step::take_close);
        return;
      case Step::take_close:
        if (!move_jaw(forceps, 0, dt) || waited_ < 0.3f) return;
        if (!holds_needle(seen, kForceps)) {
          if (++misses_ > kAttempts) return give_up();
          return go(Step::take_over);
        }
        misses_ = 0;
        forceps.grip = inverse(needle) * seen.tool[kForceps].pose;
        return go(Step::release);
      case Step::release:
        if (move_jaw(driver, 1, dt)) go(Step::retreat);
        return;
      case Step::retreat:
        if (move_toward(driver, raised(driver.pose, 0.01f), speed, dt) || waited_ > 0.25f) go(Step::drive_through);
        return;
      case Step::drive_through: {
        rest_aside(kDriver);
        psi_ += 2 * skill_.drive_speed / picture_.needle_radius * dt;
        psi_ = std::min(psi_, psi_bite + kPi + 0.5f);
        BiteFrame f = frame_;
        if (!patience(3))
          f.at +=
              (f.out + 0.4f * f.up) * std::min(0.02f, 0.01f * (waited_ - 3));  // it sticks: a pull outward frees the back end
        move_toward(forceps, holding(kForceps, needle_at(f, psi_)), 2 * speed, dt);
        if (seen.bite.size() > first_bite_seen_ && seen.bite.back().complete) {
          pull_from_ = forceps.pose;
          go(Step::pull);
        } else if (!patience(8)) {
          give_up();
        }
        return;
      }
      case Step::pull: {
        rest_aside(kDriver);
        const Vec3 way = normalized(frame_.out * 0.85f + axis_ * 0.4f);
        const size_t n = seen.suture_point.size();
        const float span = static_cast<float>(seen.thread_order.size() - 1);
        const float spacing = length_from(seen, 0, seen.thread_order.size() - 1) / span;
        const float tail = spacing * static_cast<float>(node_of(seen, seen.suture_point.front().anchored));
        float slack = tail - skill_.tail;
        if (n > 2) {
          // Slack between the bite before and this one: thread there against the straight way.
          const SuturePointView &a = seen.suture_point[n - 3], &b = seen.suture_point[n - 2];
          const float there = length_from(seen, node_of(seen, a.anchored), node_of(seen, b.anchored));
          slack = there - 1.1f * distance(a.position, b.position) - 0.001f;
        }
        // Thread that cannot be drawn further is left: the last pull takes up the slack.
        if (slack <= 0 || distance(forceps.pose.p, pull_from_.p) > 0.29f || !patience(12)) {
          ++bite_;
          attempts_ = 0;
          depth_fix_ = 0;
          aim();
          return go(bite_ < skill_.bites ? Step::present : Step::tail_over);
        }
        const Pose goal{pull_from_.p + way * 0.3f, forceps.pose.q};
        // Slow down before the thread runs tight: a jerk would tear.
        move_toward(forceps, goal, std::min(speed, 0.015f + 5 * slack), dt);
        return;
      }
      case Step::present: {  // bring the needle beside the next bite, where the driver can take it
        rest_aside(kDriver);
        BiteFrame f = frame(seen, bite_);
        f.at += f.out * 0.03f + f.up * 0.02f;
        if (move_toward(forceps, holding(kForceps, needle_at(f, -psi_bite - 0.7f)), speed, dt)) go(Step::back_over);
        else if (!patience(6)) give_up();
        return;
      }
      case Step::back_over:
        move_jaw(driver, 1, dt);
        if (move_toward(driver, raised(grip_at(needle, kDriverAt, 0.5f), 0.025f), speed, dt)) go(Step::back_down);
        return;
      case Step::back_down:
        if (move_toward(driver, grip_at(needle, kDriverAt, 0.5f), careful, dt)) go(Step::back_close);
        return;
      case Step::back_close:
        if (!move_jaw(driver, 0, dt) || waited_ < 0.3f) return;
        if (!holds_needle(seen, kDriver)) {
          if (++misses_ > kAttempts) return give_up();
          return go(Step::back_over);
        }
        misses_ = 0;
        driver.grip = inverse(needle) * seen.tool[kDriver].pose;
        return go(Step::give);
      case Step::give:
        if (move_jaw(forceps, 1, dt)) go(Step::hover);
        return;

      // --- closing: the driver takes the tail, both hands pull ---
      case Step::tail_over:
      case Step::tail_down:
      case Step::tail_close: {
        // A place on the tail a little way from the first bite, seen from outside.
        const size_t first = node_of(seen, seen.suture_point.front().anchored);
        // After a miss another place: that one may lie against the tissue.
        const size_t away = 12 + 3 * static_cast<size_t>(misses_ % 4);
        const size_t at = first > away + 2 ? first - away : first / 2;
        const Vec3 thread = seen.particle[seen.thread_order[at]];
        const BiteFrame f = frame(seen, 0);
        const Vec3 z = normalized(f.out * 0.6f + axis_), x = normalized(f.along - z * dot(f.along, z));
        const Pose goal{thread, from_axes(x, cross(z, x), z)};
        if (step_ == Step::tail_over) {
          move_jaw(driver, 1, dt);
          if (move_toward(driver, raised(goal, 0.03f), speed, dt)) go(Step::tail_down);
          else if (!patience(8)) give_up();
        } else if (step_ == Step::tail_down) {
          if (move_toward(driver, goal, careful, dt)) go(Step::tail_close);
          else if (!patience(4)) give_up();
        } else if (move_jaw(driver, 0, dt) && waited_ > 0.3f) {
          if (seen.tool[kDriver].held != Held::thread) {
            if (++misses_ > kAttempts) return give_up();
            return go(Step::tail_over);
          }
          go(Step::tighten);
        }
        return;
      }
      case Step::tighten: {
        const BiteFrame f = frame(seen, 0);
        const Vec3 left = normalized(f.out * 0.5f - f.along * 0.8f + axis_ * 0.35f),
                   right = normalized(f.out * 0.5f + f.along * 0.8f + axis_ * 0.35f);
        // The needle's end leaves the last bite, which lies before the first one along the rim; the tail leaves the first.
        const float reach = 0.35f;
        // A surgeon feels the thread: the harder it pulls back, the slower the hand.
        auto gently = [&](size_t hand) {
          return 0.25f * speed * std::clamp(1.5f - length(seen.tool[hand].force), 0.02f, 1.0f);
        };
        if (seen.closure < 0.985f) {
          move_toward(forceps, {picture_.focus + left * reach, forceps.pose.q}, gently(kForceps), dt);
          // The tail hand gives a counter-hold: it moves out only as far as keeps its own side tight.
          move_toward(driver, {picture_.focus + right * 0.11f, driver.pose.q}, gently(kDriver), dt);
        } else {
          go(Step::hold);
        }
        if (!patience(20)) give_up();
        return;
      }
      case Step::hold:
        if (waited_ > 1.5f) go(Step::done);
        return;
      case Step::done:
        return;
    }
  }

  // Draws the errors of the next bite.
  void aim() {
    aim_along_ = skill_.aim_error * random_.normal();
    aim_up_ = skill_.aim_error * random_.normal();
    depth_error_ = 0.4f * skill_.aim_error * random_.normal();
  }

  PictureModel picture_;
  SurgeonSkill skill_;
  Random random_;
  std::array<ScriptedHand, 2> hand_;
  std::vector<Vec3> place_, place_normal_;
  Vec3 axis_{0, 1, 0};
  float ring_radius_ = 0.02f;
  Step step_ = Step::pick_over;
  float waited_ = 0;
  int bite_ = 0, misses_ = 0, attempts_ = 0;
  bool gave_up_ = false;
  BiteFrame frame_;
  float psi_ = 0, aim_along_ = 0, aim_up_ = 0, depth_error_ = 0;
  float depth_fix_ = 0;  // [m] what the failed attempts at this bite taught; positive: shallower
  size_t first_bite_seen_ = 0;
  Pose pull_from_;
  uint32_t sequence_ = 0;
};

}  // namespace

std::unique_ptr<Surgeon> make_surgeon(const std::string& technique, const PictureModel& picture, const SurgeonSkill& skill) {
  if (technique == "purse_string") return std::make_unique<PurseStringSurgeon>(picture, skill);
  throw std::invalid_argument("there is no scripted surgeon for technique \"" + technique + "\"");
}

}  // namespace catgut
