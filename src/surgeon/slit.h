// SPDX-License-Identifier: Apache-2.0
// surgeon/slit: the scripted surgeon lengthens the opening of a bowel with two cuts of scissors, opposite each other. He
// presses a swab on what bleeds, then coagulates it. All with the right hand, which takes swab and pen from the tray. Reads
// Snapshots only.
#pragma once
#include <string>

#include "core/random.h"
#include "surgeon/hands.h"
#include "surgeon/sight.h"
#include "surgeon/surgeon.h"

namespace catgut {

class Slitting final : public Surgeon {
 public:
  // The first instrument is in the right hand: scissors.
  Slitting(const PictureModel& picture, const SurgeonSkill& skill);
  TickInput operate(const Snapshot& seen, float dt) override;
  bool done() const override { return stage_ == finished || gave_up_; }
  bool gave_up() const override { return gave_up_; }
  int retries() const override { return retries_; }
  std::string doing() const override;

 private:
  enum Stage {
    over_rim,
    enter,
    close,
    withdraw,
    take_swab,
    to_stain,
    press,
    leave_stain,
    take_pen,
    to_vessel,
    touch,
    coagulate,
    leave,
    finished
  };
  void act(const Snapshot& seen);
  void go(Stage stage) { stage_ = stage, waited_ = 0; }
  Pose blades_at(float above) const;                           // tips about the rim [m]
  Pose beside(const BleedingView& vessel, float above) const;  // from the side, on the outer face
  bool choose_vessel(const Snapshot& seen);                    // the next that bleeds; false: none
  void take(const Snapshot& seen, uint32_t capability, Stage next);

  PictureModel picture_;
  SurgeonSkill skill_;
  OpeningShape opening_;
  Vec3 u_;
  Random random_;
  ScriptedHand hand_;
  CommandList commands_;
  Stage stage_ = over_rim;
  float waited_ = 0, dt_ = 1.0f / 60;
  int cuts_ = 0, retries_ = 0;
  uint32_t sequence_ = 0, vessel_ = 0;
  bool gave_up_ = false;
};

}  // namespace catgut
