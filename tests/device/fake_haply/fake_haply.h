// SPDX-License-Identifier: Apache-2.0
// tests/device/fake_haply: a service like Haply's: a WebSocket on a port assigned by the system, one state per
// message, forces that last while messages arrive. Its own axes: x right, y forward, z up; meters and newtons.
#pragma once
#include <array>
#include <atomic>
#include <memory>
#include <string>

#include "../plain_hand.h"

namespace catgut {

enum class HaplyForm { v31, v35 };

struct FakeHaply {
  struct Arm {
    std::array<double, 3> position{0, -0.12, 0.15}, force{0, 0, 0};  // force as last commanded
    std::array<double, 3> motors{0, 0, 0};                           // [N] that acts
    double step_most = 0;                                            // [N] from one message to the next
    double to_hand_most = 0;                                         // [J] to the hand beyond what the arm's damping takes
    unsigned long messages = 0;
    bool there = true;
  };
  explicit FakeHaply(HaplyForm form = HaplyForm::v35, int arms = 2);
  ~FakeHaply();
  std::string where() const;  // "127.0.0.1:PORT"
  Arm at(size_t device) const;
  void zero(size_t device);
  void there(size_t device, bool is);       // false: it is removed from the service's messages
  void grip(size_t device, bool is);        // false: that device's grip is removed from the service's messages
  void hold(bool on);                       // true: messages are not answered until false, or step
  void say(const std::string& text);        // the answer to the next message; "": the normal one
  void inventory(const std::string& text);  // the first message to the next client
  void unkind(const UnkindDevice& how);     // storm: chance of a message that is none, or lacks a device or a grip
  void wish(size_t device, const std::array<double, 3>& position);               // where its hand means to be
  void hold_with(size_t device, double stiffness, double damping, double mass);  // [N/m], [N s/m], [kg]
  unsigned long now() const;       // [ns] on the service's clock: a message is a millisecond, or more on imperfect devices
  unsigned long nonsense() const;  // messages of the storm
  void hang_up();                  // cuts the connection; reconnecting works
  unsigned long answered() const;
  void step(unsigned long messages);  // answers this many messages while held; waits for them
  std::string last() const;           // message that came

  struct Work;
  std::unique_ptr<Work> work;
};

}  // namespace catgut
