// SPDX-License-Identifier: Apache-2.0
// surgeon/thread_tie: an instrument tie with physical mechanics. The forceps holds the needle near its swage and winds the
// strand round the needle holder, which takes the tail, draws it through the turns and pulls against the forceps. The turns are
// thread on a shaft. The surgeon looks whether they are still there when the tail is taken, and counts the throws that strand
// and tail show before he pulls and after. If one is missing, he lays the tail again and winds again, up to kAgain times. Reads
// Snapshots; moves two scripted hands.
//
// Throws of one turn open while the next one is wound: where nothing else holds the edges together, the first has two turns.
//
// x along the stitch, y up, z toward the viewer. `side` +1: the long strand is on the right, and the needle holder comes from
// there. The sides alternate from throw to throw; winding in the same sense then makes a square knot.
#pragma once
#include <array>
#include <string>

#include "exchange/picture.h"
#include "exchange/snapshot.h"
#include "surgeon/hands.h"
#include "surgeon/throws.h"

namespace catgut {

struct ThreadTieSettings {
  float speed = 0.15f;  // [m/s] maximum of the hands
  float pull = 2.5f;    // [N] with which both strands are pulled tight
  bool flat = false;    // the tissue round the stitch is flat: the tail lies on it and hangs down nowhere
  bool lumen = false;   // beside the stitch is an open lumen: the jaws go down into it upright and press with 2.4 N at most
  float aside = 0;      // [rad] of the line on which tail and strand are drawn and laid, from the x axis toward z
};

class ThreadTie {
 public:
  // hands: the needle holder, which is empty, and the forceps, which holds the needle.
  ThreadTie(const PictureModel& picture, std::array<ScriptedHand, 2>& hands, const ThreadTieSettings& settings);

  // A throw of `wraps` turns; sense +1: over the top. The first one also lays the tail. keep: both strands stay taut, once the
  // throw is seated, until let_go().
  void begin(const Snapshot& seen, int wraps, int sense, bool first, bool keep = false);
  // Every tick, until it returns true.
  bool operate(const Snapshot& seen, float dt);
  bool failed() const { return failed_; }
  bool keeping() const { return stage_ == hold; }
  void let_go() { keep_ = false; }
  int retries() const { return retries_; }  // throws wound again so far
  std::string doing() const;
  float pulled() const { return pulled_; }  // [N] the smaller tension of both strands when the throw was pulled tight

 private:
  enum Stage {
    to_tail,
    take_tail,
    lift_tail,
    lay_tail,
    drop_tail,
    off_tail,
    to_work,
    into_work,
    wind,
    open,
    fetch,
    close,
    draw,
    cross_up,
    cross_down,
    pull,
    hold,
    lay,
    release,
    away,
    done
  };
  void go(const Snapshot& seen, Stage stage);
  void glide_to(Vec3 tip, Vec3 hand, float speed, float angle);
  bool glide(float dt);
  void lead_by(float most, Vec3 jaws);
  void feel(const Snapshot& seen);
  Vec3 give(Vec3 at, float felt, float& given, float dt) const;
  void place();
  float tail_side() const { return snugs_ ? -side_ : side_; }  // on which it is pulled; the hands have crossed for a new throw
  float slack_of(const Snapshot& seen, bool tail) const;
  Vec3 tail_node(const Snapshot& seen, float from_end) const;
  float tail_place(const Snapshot& seen, float wanted) const;
  float grasp_place(const Snapshot& seen) const;
  float held_tail() const;  // [m] of it from the jaws to the knot
  // Winds again, after the stage that lets everything go; or fails.
  void again(const Snapshot& seen, Stage after);
  void measure(const Snapshot& seen);
  void wind_next(const SeenThrows& knot);
  void seated(const Snapshot& seen);
  bool is_enough(const SeenThrows& knot) const;
  float wound(const Snapshot& seen) const;
  bool pinches_strand(const Snapshot& seen) const;

  const PictureModel& picture_;
  std::array<ScriptedHand, 2>& hands_;
  ThreadTieSettings how_;
  Vec3 line_;  // unit: from the strand's hand to the tail's, where side_ is +1
  Stage stage_ = done;
  float taken_ = 0;  // [m] from the tail's end, where the needle holder takes it
  int wraps_ = 1, misses_ = 0, retries_ = 0, tries_ = 0, throws_ = 0;
  float side_ = 1, sense_ = 1, waited_ = 0;
  int wanted_ = 0;  // throws that the knot shall have
  bool first_ = false, failed_ = false, keep_ = false;
  bool lost_ = false;                // the tail: it is taken and laid again first
  bool snugs_ = false;               // the first throw, once more, before the second is wound again
  bool ends_ = false;                // no more throws: everything is let go
  float laid_ = 1, first_laid_ = 1;  // hand of this throw, of the first: +1 right
  Vec3 origin_;                      // the middle of the stitch
  Vec3 tip_, hand_;                  // where the needle holder's jaws and the needle's swage shall be
  Quat holder_turn_;                 // of the needle holder
  Quat forceps_rest_;                // forceps at angle 0, as it held the needle
  Vec3 swage_in_forceps_;
  float forceps_angle_ = 0;
  Vec3 shaft_;     // of the needle holder, from its tip
  Vec3 approach_;  // the same at the tail
  // A movement of both hands.
  Vec3 tip_from_, tip_to_, hand_from_, hand_to_;
  Quat holder_from_, holder_to_;
  float angle_from_ = 0, angle_to_ = 0, done_ = 0, seconds_ = 0;
  // Winding.
  float strand_ = 0, tail_ = 0, height_ = 0, angle_ = 0, turned_ = 0, radius_ = 0, slack_ = 0;
  float felt_ = 0, tail_felt_ = 0, pulled_ = 0, steady_ = 0, drawn_ = 0, slid_ = 0, caught_ = 0, risen_ = 0;
  float foreign_ = 0;                        // [N] largest tension of the other sutures, smoothed
  float tail_given_ = 0, strand_given_ = 0;  // [m] by which the hands have given way
};

}  // namespace catgut
