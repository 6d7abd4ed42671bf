// SPDX-License-Identifier: Apache-2.0
// tests/hands: see x_events.h. XTest's library comes with xdotool; its headers do not, so it is loaded by name.
#ifdef CATGUT_TESTS_WINDOW
#include "x_events.h"

#include <X11/Xlib.h>
#include <dlfcn.h>

namespace catgut {

struct XEvents::Connection {
  Display* display = nullptr;
  int (*key)(Display*, unsigned, int, unsigned long) = nullptr;
  int (*button)(Display*, unsigned, int, unsigned long) = nullptr;
  int (*motion)(Display*, int, int, unsigned long) = nullptr;
};

XEvents::XEvents(const std::string& display) : to_(std::make_unique<Connection>()) {
  void* library = dlopen("libXtst.so.6", RTLD_NOW);
  if (!library) return;
  to_->key = reinterpret_cast<decltype(to_->key)>(dlsym(library, "XTestFakeKeyEvent"));
  to_->button = reinterpret_cast<decltype(to_->button)>(dlsym(library, "XTestFakeButtonEvent"));
  to_->motion = reinterpret_cast<decltype(to_->motion)>(dlsym(library, "XTestFakeRelativeMotionEvent"));
  if (to_->key && to_->button && to_->motion) to_->display = XOpenDisplay(display.c_str());
}
XEvents::~XEvents() {
  if (to_->display) XCloseDisplay(to_->display);
}
bool XEvents::ready() const { return to_->display != nullptr; }
void XEvents::key(const std::string& name, bool down) {
  to_->key(to_->display, XKeysymToKeycode(to_->display, XStringToKeysym(name.c_str())), down, 0);
  XSync(to_->display, False);
}
void XEvents::button(unsigned which, bool down) {
  to_->button(to_->display, which, down, 0);
  XSync(to_->display, False);
}
void XEvents::motion(int right, int down) {
  to_->motion(to_->display, right, down, 0);
  XSync(to_->display, False);
}

}  // namespace catgut
#endif
