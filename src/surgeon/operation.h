// SPDX-License-Identifier: Apache-2.0
// surgeon/operation: the scripted surgeon carries out the scene "altemeier". He closes Allis clamps on the rim of the prolapse
// and parks them; an assistant takes one of them. Then he cuts the outer tube all round (surgeon/excision) and the assistant
// carries the specimen away. With SurgeonSkill::bites stitches, each of its own suture, he joins the cut edge to the inner tube
// (surgeon/scripted). A stitch that fails is taken out and made again, with another suture if its thread was cut. When
// all hands are away, the inner tube retracts by its clamp, as a colon does: only the stitches hold it. Reads Snapshots only.
#pragma once
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "surgeon/excision.h"
#include "surgeon/hands.h"
#include "surgeon/scripted.h"
#include "surgeon/sight.h"
#include "surgeon/surgeon.h"

namespace catgut {

class Operating final : public Surgeon {
 public:
  // The right hand is empty; forceps are in the left one.
  Operating(const PictureModel& picture, const SurgeonSkill& skill);
  TickInput operate(const Snapshot& seen, float dt) override;
  bool done() const override { return stage_ == finished || gave_up_; }
  bool gave_up() const override { return gave_up_; }
  int retries() const override;
  std::string doing() const override;

 private:
  enum Stage {
    take_clamp,
    over_rim,
    on_rim,
    close_clamp,
    park_clamp,
    off_rim,
    to_assistant,
    assistant_takes,
    take_pen,
    cut,
    carry,
    take_holder,
    sew,
    carry_needle,
    remove,
    pull,
    finished
  };
  void look(const Snapshot& seen);  // what is done already: a stage may be practiced alone, from a saved state
  void act(const Snapshot& seen);
  void go(Stage stage) { stage_ = stage, waited_ = 0; }
  float angle_of(size_t clamp) const;
  Vec3 radial(float angle) const { return u_ * portable::cos(angle) + v_ * portable::sin(angle); }
  Pose clamp_at(float angle, float raised) const;  // jaws about the rim
  void swap_for(const Snapshot& seen, uint32_t capability, Stage next);
  bool in_forceps(const Snapshot& seen) const;
  bool pulled_through(const Snapshot& seen) const;
  void choose_suture(const Snapshot& seen);  // suture_; the number of sutures if none is left
  void begin_stitch(const Snapshot& seen, TaskKind from);
  void next_stitch(const Snapshot& seen);
  bool sew_on(const Snapshot& seen);
  size_t place_of_stitch(size_t stitch) const;  // of as many places round the opening as there are stitches
  // The field as a surgeon sees it who stands where the next stitch is on his left; and his hands, back in the scene.
  Snapshot turned(const Snapshot& seen, float by) const;
  void turn_back(TickInput& input, float by) const;
  void join(const TickInput& part, std::initializer_list<size_t> hands);

  PictureModel picture_;
  SurgeonSkill skill_;
  OpeningShape opening_;
  Vec3 u_, v_;
  std::vector<uint16_t> clamp_;       // instruments
  std::array<ScriptedHand, 3> hand_;  // right, left, assistant
  CommandList commands_;
  Random random_;
  Stage stage_ = take_clamp;
  float waited_ = 0, dt_ = 1.0f / 60;
  float turn_ = 0;       // [rad] of the field, for this stitch
  size_t stitches_ = 0;  // that he makes
  size_t clamped_ = 0, stitched_ = 0;
  size_t suture_ = 0;  // of the stitch in hand
  size_t way_ = 0;
  bool carries_ = false;  // its needle lies on the left, and is carried to the right first
  int misses_ = 0, taken_out_ = 0, retries_ = 0, retries_of_parts_ = 0;
  bool gave_up_ = false;
  uint32_t sequence_ = 0;
  std::optional<Excising> excising_;
  std::optional<Scripted> sewing_;
  TickInput part_;  // of this tick, of the hands that another plan leads
  std::array<uint8_t, 3> led_{};
};

}  // namespace catgut
