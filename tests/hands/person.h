// SPDX-License-Identifier: Apache-2.0
// tests/hands: a simulated user with one device who sees the image, and the actions of a stitch. A workstation converts an
// intended action to the device's own events and returns the next frame. Actions are in the view frame: point there, click,
// drag; the user never states where a tool is in space.
#pragma once
#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "device/gamepad.h"
#include "device/mouse.h"
#include "exchange/strand.h"

namespace catgut {

struct Look {
  Snapshot seen;
  ViewFrame view;
  Steering steering;
  float dt = 1.0f / 60;  // [s] between two pictures
};

struct Act {
  size_t hand = 0;
  HandMotion motion;
  bool click = false;  // close the jaw, or open it
  bool cut = false;    // the thread, or the pen on or off
  bool coagulate = false;
  bool next = false;  // instrument from the tray
  bool park = false;  // or lay down, or take up
  float orbit = 0;    // [rad] of the camera round the field, to the right
};

class WorkQueue {
 public:
  virtual ~WorkQueue() = default;
  virtual const PictureModel& picture() const = 0;
  virtual const Look& look() const = 0;
  // Performs it, and waits for a frame that shows it. False: the simulation has ended.
  virtual bool act(const Act& act) = 0;
  virtual size_t count(EventKind kind) const = 0;  // so far
};

inline namespace hands {  // the store has a Person too
class Person {
 public:
  explicit Person(WorkQueue& desk) : desk_(desk) {}

  bool carry_out(const std::string& lesson);  // first_stitch or simple_suture, from beginning to end

  bool take_needle();
  bool bite();       // the needle holder holds the needle; afterwards the forceps has pulled it through
  bool hand_back();  // the needle holder takes it from the forceps
  bool pull_tail(float tail);
  bool draw_together();  // tail and needle end, until the edges are approximated
  bool tie(int way);     // one throw: the three actions below, repeated on failure, and the tail laid down
  bool wind(int way);
  bool take_tail();
  bool set_throw();
  bool cut_needle();  // off the thread, by the hand that holds it
  bool cut_tail();    // near the knot, by the empty needle holder

  // An operation: what the user sees is where rim and line are.
  bool take_instrument(size_t k, const std::string& kind);
  bool lay_down(size_t k);                       // what the hand has
  bool take_up(size_t k, size_t instrument);     // a parked one
  bool grasp_rim(size_t k, float angle);         // with the instrument in the hand, at this angle round the opening
  bool park(size_t k);                           // what the hand has closed on tissue
  bool snip(size_t k, float angle, float down);  // one cut from the rim, `down` [m] long
  // The pen goes round on the line, stroke by stroke, until the user sees that the rim is free.
  bool cut_round(size_t k, float edge);
  bool score(size_t k, float edge, float from, float to);  // one stroke
  bool carry(size_t k, Vec3 by);                           // what the hand holds
  size_t coagulate(size_t k);                              // every vessel that bleeds, once; the number that stopped
  std::string doing() const { return doing_; }
  const std::vector<std::string>& repeated() const { return repeated_; }  // actions that failed and were tried again

 private:
  const Snapshot& seen() const { return desk_.look().seen; }
  const SteeredHand& hand(size_t k) const { return desk_.look().steering.hand[k]; }
  bool wait(float seconds, const std::function<bool()>& done, Act act = {});
  bool point(size_t k, const std::function<Vec3()>& place, const std::function<bool()>& done, bool deep = false,
             float patience = 25);
  bool take(size_t k, Held what, HelpAt at, const std::function<Vec3()>& place);
  bool let_go(size_t k);
  void aside(size_t k);
  bool drive(size_t k, const std::function<bool()>& done);
  bool both(float amount, const std::function<bool()>& done, float patience = 25);
  bool lay_tail();
  bool face(float angle);  // the camera
  bool pen(size_t k, PenMode mode);
  Vec3 rim_at(float angle) const;
  std::optional<float> bridge(float edge) const;  // [rad]; none: the end is free
  Vec3 line_at(float angle, float edge) const;

  WorkQueue& desk_;
  std::string doing_;
  size_t locked_ = 0;  // throws, before the strand was wound
  std::vector<std::string> repeated_;
};
}  // namespace hands

// The events of the mouse for this motion, in whole pixels and notches.
MouseInput by_mouse(const Act& act, const Look& look, float speed);

// The sticks and buttons for it; `pad` holds what is pressed meanwhile (a closed jaw is a pressed trigger).
GamepadInput by_pad(const Act& act, const Look& look, GamepadInput& pad);

}  // namespace catgut
