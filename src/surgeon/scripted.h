// SPDX-License-Identifier: Apache-2.0
// surgeon/scripted: carries out a plan's tasks with two hands. The needle holder (right) drives a bite by turning the needle
// about its own circle. The forceps (left) grasps the tip, brings it through and pulls the thread; knots are instrument ties.
// Reads Snapshots only; each step checks the actual state before the next begins. Failed steps are repeated. A bite whose tip
// did not exit is withdrawn and driven slightly shallower or deeper, a missed grasp is approached again, a throw whose loop
// did not hold is wound again. Bites are in biting.cpp, knots in tying.cpp, scissors in finishing.cpp, stitches that are taken
// out in removal.cpp.
#pragma once
#include <algorithm>
#include <array>
#include <optional>
#include <string>

#include "exchange/tying.h"
#include "surgeon/hands.h"
#include "surgeon/plan.h"
#include "surgeon/sight.h"
#include "surgeon/surgeon.h"
#include "surgeon/thread_tie.h"

namespace catgut {

constexpr size_t kNeedleHolder = 0, kForceps = 1;
constexpr int kAttempts = 8;  // per bite, per grasp, per throw
constexpr float kJustOpen =
    0.6f;  // of jaws beside the other instrument: they release at half, and wide open they would meet it
constexpr float kHalfOpen = 0.7f;       // of jaws that release without shaking off a loop
constexpr int kPiece = 10;              // first stage of carrying a cut-off tail away
constexpr float kStrandsTouch = 1e-3f;  // [m] between the nodes of two strands in contact

class Scripted final : public Surgeon {
 public:
  Scripted(const std::string& plan, const PictureModel& picture, const SurgeonSkill& skill);

  // Only these tasks of the plan, with the tools in their present state.
  void take_over_for(const std::vector<size_t>& tasks);
  // Takes the stitch in hand out of the tissue instead, also when he has given up; retries() counts from 0 again.
  void take_over_to_remove();

  bool done() const override { return gave_up_ || task_ >= plan_.task.size(); }
  bool gave_up() const override { return gave_up_; }
  int retries() const override { return retries_ + (thread_tie_ ? thread_tie_->retries() : 0); }

  std::string doing() const override;

  TickInput operate(const Snapshot& seen, float dt) override;

 private:
  // --- the state of a task ----------------------------------------------------------------------------------------------
  void begin();
  void go(int stage);
  bool patience(float seconds) const { return waited_ < seconds; }
  // Counts a miss; gives up after too many.
  void miss(int back_to);

  // --- hands ------------------------------------------------------------------------------------------------------------
  bool move(size_t hand, const Pose& goal, float speed) { return move_toward(hand_[hand], goal, speed, dt_); }
  bool jaw(size_t hand, float goal) { return move_jaw(hand_[hand], goal, dt_); }
  float careful() const { return 0.35f * skill_.speed; }
  bool holds_needle(const Snapshot& seen, size_t hand) const { return seen.tool[hand].held == Held::needle; }
  // Tool pose that puts the held needle at `needle`.
  Pose holding(size_t hand, const Pose& needle) const { return needle * hand_[hand].grip; }
  void remember_grip(const Snapshot& seen, size_t hand) {
    hand_[hand].grip = inverse(seen.active().needle.pose) * seen.tool[hand].pose;
  }
  static Pose raised(const Pose& tool, float by) { return {tool.p + rotate(tool.q, {0, 0, by}), tool.q}; }

  void take_over(const Snapshot& seen);
  // About the suture in hand.
  void order(CommandKind kind, size_t hand) {
    commands_.push({kind, static_cast<uint8_t>(hand), static_cast<uint16_t>(suture_)});
  }

  // An idle hand waits clear of the work, on its own side of the field.
  void rest_aside(const Snapshot& seen, size_t hand);

  // --- bites ------------------------------------------------------------------------------------------------------------
  BiteFrame frame(const Snapshot& seen, size_t place) const;
  const BitePlace& bite() const { return plan_.place[place_]; }
  size_t first_place() const;  // of the suture in hand
  // The side of the needle's plane from which a hand comes, +1: its `up`.
  float side_of(size_t hand, size_t place) const {
    const BitePlace& bite = plan_.place[std::min(place, plan_.place.size() - 1)];
    return (hand == kNeedleHolder ? plan_.driver_side : plan_.forceps_side) * (bite.backhand ? -1.0f : 1.0f);
  }
  const SuturePicture& shape() const { return picture_.suture[suture_]; }
  float half_bite_angle() const { return portable::asin(std::min(0.9f, 0.5f * bite().length / shape().needle_radius)); }

  // The needle with its tip `psi` past the deepest point of a bite at frame f.
  Pose needle_at(const BiteFrame& f, float psi) const;

  // A tool frame that grips the needle (at `needle`) at fraction s of its arc: the shaft leaves the needle's plane on `side`,
  // leans by `lean` toward the outside of the tissue when the tip is `psi` past the deepest point.
  Pose grip_at(const Pose& needle, float s, float side, float lean, float psi) const;
  // least: of the arc; place: whose bite it is taken for.
  Pose driver_grip(const Pose& needle, size_t place, float least = 0) const;
  Pose forceps_grip(const Pose& needle) const;
  Pose tip_grip(const Pose& needle, size_t way) const;
  void choose_tip_way(const Snapshot& seen);

  // Samples the errors of the next bite.
  void aim();
  // Exchanges tasks and reverses throws of the plan: errors of order.
  void misorder();
  // To the stage in which a tool approaches its target; samples whether it misses.
  void go_down(int stage);
  // The goal of that approach: short of the target where the grasp misses.
  Pose short_of(const Pose& goal) const { return miss_by_ > 0 ? raised(goal, miss_by_) : goal; }

  // --- tasks ------------------------------------------------------------------------------------------------------------
  // Each returns true when it is finished.
  bool act(const Task& task, const Snapshot& seen);

  std::string name_of_bite() const;

  bool pick_up(const Snapshot& seen);

  bool hold_edge(const Snapshot& seen);
  // The forceps keeps an edge that it holds, else it waits clear of the work.
  void hold_or_rest(const Snapshot& seen);
  bool make_bite(const Snapshot& seen);
  // The needle is out, and a wall has no thread in it or is not held any more. Inserts the tasks that make the bite again, up
  // to twice; false: it cannot be done.
  bool bite_again(const Snapshot& seen);
  bool is_caught(const Snapshot& seen) const;  // what was pulled through is too short for a throw
  bool is_sound(const Snapshot& seen) const {  // thread runs through every wall of the bite
    return seen.active().suture_point.size() >= points_before_ + 2 * static_cast<size_t>(bite().walls);
  }
  bool draw_out(const Snapshot& seen);
  // Walls that the needle has passed since this bite began; complete: with its back end too. A withdrawn bite stays listed
  // and counts for nothing.
  int passages(const Snapshot& seen, bool complete) const;
  // Of the bite in hand, where the plan asks for a part of the wall.
  bool too_deep(const Snapshot& seen) const;
  // The needle in its bite, with its tip where it is: `by` [rad] nearer to the direction along the wall.
  void turn_about_tip(float by);
  void correct_depth(float shallower);  // [m] for the next attempt
  // Jaws that hold the needle, and no thread beside it.
  bool holds_well(const Snapshot& seen, size_t hand) const;
  // The needle slits a wall of the bite in hand.
  bool tears(const Snapshot& seen) const;
  // The forceps holds the edge for this bite.
  bool holds_edge(size_t place) const;

  bool pull(TaskKind kind, const Snapshot& seen);

  // [m] maximum remaining distance of the midpoints; 0 once all count as closed.
  static float open_seam(const Snapshot& seen);

  // Raises the place where a needle is presented until its strand is nearly taut: slack thread drifts into the jaws.
  // psi: of the needle there.
  void hold_strand_straight(const Snapshot& seen, BiteFrame& f, float psi) const;
  // The needle holder takes the needle from the forceps; with `present` the forceps first moves it beside the next bite.
  bool take_back(const Snapshot& seen, bool present);

  // --- tying ------------------------------------------------------------------------------------------------------------
  // Orientation of the hands to tie: the needle holder lies across the wound from the right, the forceps comes from the left.
  static Pose tying_pose(size_t hand, Vec3 at);

  bool regrip(const Snapshot& seen);

  // Where the stitch is tied: at its knot, else midway between the ends of its thread in the tissue.
  Vec3 stitch(const Snapshot& seen) const { return stitch_place(picture_, seen); }
  Vec3 swage(const Snapshot& seen) const { return needle_swage(picture_, seen); }
  // Moves the forceps so that the needle's swage, which it holds, reaches `goal`.
  bool carry_swage(const Snapshot& seen, Vec3 goal, float speed);

  // The needle holder moves the tail where the next throw finds it: in front, clear of the needle's strand. Between two bowel
  // ends on the tail's own side, because over the gap it would fall inside.
  bool lay_tail(const Snapshot& seen);

  // Best position and side for the needle holder to grasp the tail; not those of the last miss.
  void choose_grasp(const Snapshot& seen);

  // An instrument tie. The needle's strand is held up, the needle holder is laid beside it, the forceps winds the strand round
  // it. The needle holder, with the loop on it, then grasps the tail, and the hands pull apart.
  bool tie(const Task& task, const Snapshot& seen);
  // The same with physical mechanics.
  bool tie_thread(const Task& task, const Snapshot& seen);
  // The assistant's forceps closes on the crossing of the throw that both hands hold taut, or leaves it. True when it has.
  bool take_crossing(const Snapshot& seen);
  bool leave_crossing(const Snapshot& seen);

  // The needle's own strand is laid between the needle holder's jaws, past the loop.
  bool take_strand(const Snapshot& seen, const Pose& lying, int close, int tighten, int again);

  // --- the end of a stitch with physical mechanics ----------------------------------------------------------------------
  void order_clamps(bool advance);
  // The needle is laid beside the bowel as far as its strand reaches; then both hands are away for the time of a measurement.
  bool leave(const Snapshot& seen);

  // --- both hands on the thread -----------------------------------------------------------------------------------------
  // The needle holder grasps the tail, then both pull until everything is closed.
  bool grasp_tail(const Snapshot& seen);
  bool draw(const Snapshot& seen);
  // The same with physical mechanics, until both ends are taut with Plan::pull.
  bool gather(const Snapshot& seen);

  // --- scissors ---------------------------------------------------------------------------------------------------------
  // Clear of the stitch, beyond the last throw of its knot: he looks at that when he begins.
  size_t node_to_cut(const Snapshot& seen, bool tail, bool begins) const;
  bool cut(TaskKind kind, const Snapshot& seen);
  // The needle holder carries the tail's piece away: left in the field it would lie between jaws and tissue at the next stitch.
  size_t piece_grip(const Snapshot& seen, size_t end) const;
  // Blades that come from above, the strand at a node between them.
  Pose blades_at(const Snapshot& seen, size_t node) const;
  // [m] of a node from any other thread, its own suture's too.
  float room_to_cut(const Snapshot& seen, size_t node, float most) const;
  bool take_piece(const Snapshot& seen);
  static size_t count_cuts(const Snapshot& seen);

  // --- a stitch that failed is taken out --------------------------------------------------------------------------------
  bool remove(const Snapshot& seen);
  size_t node_to_remove(const Snapshot& seen) const;
  Vec3 place_for_needle(const Snapshot& seen) const;

  bool discard(const Snapshot& seen);
  bool fresh(const Snapshot& seen);

  // The needle's strand is laid along the tail; the needle holder closes on both.
  bool take_both(const Snapshot& seen);

  PictureModel picture_;
  SurgeonSkill skill_;
  Plan plan_;
  Random random_, ability_;  // ability_: of the errors that are 0 by default, so that a run without them keeps its bits
  std::array<ScriptedHand, 2> hand_;
  std::array<ScriptedHand, kMaxHands - 2> assistant_;
  CommandList commands_;  // of this tick
  size_t task_ = 0;
  size_t suture_ = 0;  // in hand
  int stage_ = 0;      // within the task
  float waited_ = 0;   // [s] in this stage
  float dt_ = 1.0f / 60;
  int misses_ = 0, attempts_ = 0, retries_ = 0;
  bool gave_up_ = false, takes_over_ = false;
  std::string doing_ = "pick up the needle";
  // A bite.
  size_t place_ = 0, bites_before_ = 0;
  BiteFrame frame_;
  float psi_ = 0, aim_along_ = 0, aim_up_ = 0, depth_error_ = 0, aim_turn_ = 0;
  float pause_left_ = 0;      // [s] of thought before this task
  float strength_ = 1;        // of the pulls of this task, relative
  float miss_by_ = 0;         // [m] distance by which this grasp misses
  float depth_fix_ = 0;       // [m] correction from failed attempts at this bite; positive: shallower
  float next_fix_ = 0;        // [m] of the attempt that is withdrawn, in addition
  float turn_fix_ = 0;        // [rad] added to Plan::flatten
  int again_ = 0;             // times that this bite is made again from the start
  size_t points_before_ = 0;  // suture points of the suture, when the sweep began
  Pose pull_from_;
  float scooped_ = 0;            // [m] by which this bite was lifted
  float flattened_ = 0;          // [rad] by which it was turned
  float hard_ = 0;               // [s] that the needle has needed too much force
  float steady_ = 0;             // [s] of full tension
  std::array<float, 2> felt_{};  // [N] in the strands of a hand, smoothed
  float overloaded_ = 0;         // [s] that a pull has had more than the maximum load
  float stitch_load_ = 0;        // [N] largest tension beside a cut-off tail when the jaws took it
  // A throw.
  Winding winding_;                                           // computed by exchange/tying, as for assisted hands
  size_t tip_way_ = 0;                                        // of kTipWay
  int tip_misses_ = 0;                                        // of this bite
  size_t cuts_before_ = 0, cut_at_ = 0, settled_before_ = 0;  // cut_at_: node for the scissors, or for the jaws on a piece
  uint32_t throws_before_ = 0, take_slot_ = 0;
  Quat take_turn_;
  Vec3 tried_, piece_from_;              // piece_from_: unit, from a piece of thread along the shaft of the jaws that take it
  Vec3 laid_at_;                         // of a stitch that is taken out: where its needle is laid down
  std::optional<ThreadTie> thread_tie_;  // with physical mechanics, from the first throw on
  float clamped_ = 0;                    // [s] that both strands are still held taut, within a throw: the clamps move back
  int assisting_ = 0;  // stage of the assistant's hand at the crossing of a throw; 0: it waits beyond the field
  uint32_t sequence_ = 0;
};

}  // namespace catgut
