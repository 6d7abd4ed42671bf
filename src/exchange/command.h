// SPDX-License-Identifier: Apache-2.0
// exchange/command: commands of a hand, or of an assistant, in a tick. Commands travel in TickInput and are recorded with
// it, so that a replay repeats them. A command that cannot be carried out changes nothing and is reported (instrument_refused).
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

namespace catgut {

enum class CommandKind : uint8_t {
  none,
  take,        // the empty hand takes instrument `argument` from the tray, or takes up a parked one
  swap,        // lays down the instrument in the hand and takes instrument `argument` from the tray
  lay_down,    // releases what is held and puts the instrument in its place on the tray
  park,        // leaves the clamp closed on what it holds; the hand is empty then
  unpark,      // the empty hand takes instrument `argument`, parked or held on tissue by an assistant, in its present pose
  new_suture,  // replaces suture `argument` by a new needle and thread
  cut,         // cuts the thread of suture `argument` at the jaws
  // Physical mechanics: the clamp on the fixed end of bowel `argument` moves during this tick, toward its opening and back to
  // where the scene has it.
  advance_clamp,
  retract_clamp,
  set_pen,  // switches the electrosurgical pen in the hand: argument is its PenMode. Pedals, which are pressed and released
  // Draws the clamp of bowel `argument` away from its opening, as retract_clamp and on by kClampRange, with at most kClampPull.
  pull_clamp,
  count_
};
constexpr float kClampSpeed = 0.004f, kClampRange = 0.005f, kClampPull = 2;  // [m/s], [m], [N]
constexpr bool moves_clamp(CommandKind k) {
  return k == CommandKind::advance_clamp || k == CommandKind::retract_clamp || k == CommandKind::pull_clamp;
}

struct Command {
  CommandKind kind = CommandKind::none;
  uint8_t hand = 0;       // the hand that carries it out
  uint16_t argument = 0;  // see CommandKind
};

// Commands of one tick, in the order of execution.
struct CommandList {
  static constexpr size_t kCapacity = 16;
  uint32_t count = 0;
  std::array<Command, kCapacity> row{};

  // False: full, the command is dropped.
  bool push(Command c) {
    if (count == kCapacity) return false;
    row[count++] = c;
    return true;
  }
  void clear() { count = 0; }
  const Command* begin() const { return row.data(); }
  const Command* end() const { return row.data() + count; }
};

}  // namespace catgut
