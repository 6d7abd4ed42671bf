// SPDX-License-Identifier: Apache-2.0
// tests/hands: mouse and keyboard events made by the X server (XTest), on a separate connection: the program receives them
// like any external event.
#pragma once
#include <memory>
#include <string>

namespace catgut {

class XEvents {
 public:
  explicit XEvents(const std::string& display);
  ~XEvents();
  bool ready() const;
  void key(const std::string& name, bool down);  // X's key name: "Tab", "w"
  void button(unsigned which, bool down);        // 1 left, 3 right, 4 and 5 the wheel
  void motion(int right, int down);              // [pixels]

 private:
  struct Connection;
  std::unique_ptr<Connection> to_;
};

}  // namespace catgut
