// SPDX-License-Identifier: Apache-2.0
// surgeon/excision: the scripted surgeon cuts the end of a bowel off. The left hand grasps the rim; the right hand leads an
// electrosurgical pen once round the organ, `edge_distance` from the rim; the left hand lifts the specimen away. Then the pen
// coagulates what still bleeds. Reads Snapshots only. The line is carried by the tissue that stays: the specimen moves as soon
// as it is partly free. Near the end of the circle the pen steers to where it began. Where the wall still holds, it begins a
// further round at the first place that is not open to the eye, and follows its own line there.
#pragma once
#include <array>
#include <string>
#include <vector>

#include "core/random.h"
#include "surgeon/hands.h"
#include "surgeon/sight.h"
#include "surgeon/surgeon.h"

namespace catgut {

class Excising final : public Surgeon {
 public:
  Excising(const PictureModel& picture, const SurgeonSkill& skill);
  // Begins at the line: `hand` holds the specimen already, with an instrument that it commands as in `holder`.
  void take_over(const ScriptedHand& pen, const ScriptedHand& holder, size_t hand);
  TickInput operate(const Snapshot& seen, float dt) override;
  bool done() const override { return stage_ == finished || gave_up_; }
  bool gave_up() const override { return gave_up_; }
  int retries() const override { return retries_; }
  std::string doing() const override;

 private:
  static constexpr size_t kBearings = 96;    // 1 mm apart, on a bowel of 30 mm
  static constexpr float kSliver = 0.2e-3f;  // [kg] at most of a piece that is not the specimen; chosen
  enum Stage {
    over_rim,
    down,
    close,
    tighten,
    to_line,
    touch,
    round,
    off,
    lift,
    aside,
    to_vessel,
    coagulate,
    leave,
    hold,
    finished
  };
  void act(const Snapshot& seen);
  void go(Stage stage) { stage_ = stage, waited_ = 0; }
  // The line on the organ's outer side at an angle [rad], now: position, outward, toward the rim.
  struct OnLine {
    Vec3 at, out, up;
  };
  OnLine on_line(const Snapshot& seen, float angle) const;
  Vec3 radial(float angle) const { return u_ * portable::cos(angle) + v_ * portable::sin(angle); }
  Pose pen_at(const OnLine& line, float above) const;  // tip `above` the surface [m]
  Pose pen_on(const BleedingView& vessel, float above) const;
  bool choose_vessel(const Snapshot& seen);  // the next that bleeds; false: none
  Pose grasp_at(float raised) const;         // the hand that holds the specimen, raised along the axis [m]
  // [rad] the first angle at which the wall is still closed; 0, where the line began, if it is open all round.
  float closed_at(const Snapshot& seen) const;
  static bool freed(const Snapshot& seen) { return seen.wound.freed_mass > kSliver; }
  // [m] by which the pen leaves the planned line: it strays slowly in the first round, and follows its groove afterwards.
  float stray();
  void switch_pen() { commands_.push({CommandKind::cut, 0, 0}); }

  PictureModel picture_;
  SurgeonSkill skill_;
  OpeningShape opening_;
  Vec3 u_, v_;
  std::vector<uint32_t> below_;  // particles that carry the line
  Random random_;
  std::array<ScriptedHand, 2> hand_;
  size_t holder_ = 1;  // hand of the second one
  bool took_over_ = false;
  Pose held_at_;  // of that hand when it took over
  CommandList commands_;
  Stage stage_ = over_rim;
  float waited_ = 0, dt_ = 1.0f / 60, angle_ = 0, began_ = 0, aim_ = 0;
  std::array<float, kBearings> strayed_{};  // [m] of the first round, at each bearing
  int misses_ = 0, rounds_ = 0, retries_ = 0;
  int attempts_ = 0;  // to coagulate
  bool gave_up_ = false, pen_is_near_ = false;
  bool freed_ = false;
  uint32_t sequence_ = 0, vessel_ = 0;
};

}  // namespace catgut
