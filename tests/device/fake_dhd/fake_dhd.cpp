// SPDX-License-Identifier: Apache-2.0
// tests/device/fake_dhd: a libdhd.so with two devices and the functions and types of the real one. Positions that follow a
// hand, calls that wait for the device, a firmware watchdog. Written only from the published description of that library and
// deliberately without our own declarations of it, so that the two can disagree.
#include "fake_dhd.h"

#include <array>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <mutex>
#include <string>

typedef unsigned char uchar;
typedef unsigned short ushort;

namespace {

struct Arm {
  bool open = false, output = false, reset_done = true;
  int cause = 0, watchdog = 0, button = 0;
  double gap = 0.02;
  double x[3] = {0, 0, 0}, v[3] = {0, 0, 0}, wish[3] = {0, 0, 0};
  double rows[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  double force[3] = {0, 0, 0};
  double step_most = 0;
  unsigned long writes = 0, granted = 0, done = 0;
  int silent = 0, waiting = 0;
  bool owes = false;  // a millisecond was begun by a read, and is finished by a write
  bool fault[4] = {};
};

struct Fake {
  std::mutex lock;
  std::condition_variable change;
  std::array<Arm, 2> arm;
  int count = 2;
  bool manual = false, expert = false, uncalibrated = false, locked = false;
};
Fake& fake() {
  static Fake f;
  return f;
}
thread_local int last_error = 0;

int number(const char* name, int otherwise) {
  const char* s = std::getenv(name);
  return s && *s ? std::atoi(s) : otherwise;
}

Arm* find(Fake& f, char id) {
  const int k = id < 0 ? 0 : id;
  if (k >= f.count || k > 1 || !f.arm[static_cast<size_t>(k)].open) return last_error = 5, nullptr;
  Arm& a = f.arm[static_cast<size_t>(k)];
  if (a.fault[kDhdUnplugged]) return last_error = 2, nullptr;
  return &a;
}

// The device's own millisecond, independent of the backend.
void pass(Arm& a) {
  ++a.silent;
  if (a.watchdog > 0 && a.output && a.silent * 8 > a.watchdog && (a.force[0] != 0 || a.force[1] != 0 || a.force[2] != 0))
    a.output = false, a.cause = 3;
  if (!a.output || a.fault[kDhdUnplugged]) a.force[0] = a.force[1] = a.force[2] = 0;
  for (int k = 0; k < 3; ++k) {  // a hand of 150 N/m, well damped
    const double to = a.wish[k] + a.force[k] / 150, before = a.x[k];
    a.x[k] += 0.05 * (to - a.x[k]);
    a.v[k] = (a.x[k] - before) * 1e3;
  }
}

#define HOLD        \
  Fake& f = fake(); \
  std::unique_lock<std::mutex> hold(f.lock)

}  // namespace

extern "C" {

int dhdGetDeviceCount() {
  HOLD;
  return f.count;
}
int dhdOpenID(char id) {
  HOLD;
  if (id < 0 || id >= f.count || f.locked || f.arm[static_cast<size_t>(id)].fault[kDhdUnplugged]) return last_error = 6, -1;
  Arm& a = f.arm[static_cast<size_t>(id)];
  a.open = true, a.output = false, a.cause = 4, a.watchdog = 0, a.silent = 0, a.owes = false, a.done = a.granted;
  return id;
}
int dhdClose(char id) {
  HOLD;
  if (id < 0 || id > 1) return -1;
  Arm& a = f.arm[static_cast<size_t>(id)];
  a.open = a.output = false;
  a.force[0] = a.force[1] = a.force[2] = 0;
  return 0;
}
int dhdGetSystemType(char) { return 33; }
const char* dhdGetSystemName(char) { return "simulated omega.3"; }
int dhdGetSerialNumber(ushort* sn, char id) { return *sn = static_cast<ushort>(1000 + id), 0; }
void dhdGetSDKVersion(int* a, int* b, int* c, int* d) { *a = 3, *b = 17, *c = 5, *d = 0; }
bool dhdIsLeftHanded(char id) { return id == 0; }  // the first one is the left hand's: the order does not matter
bool dhdHasGripper(char id) { return id == 1; }
int dhdGetStatus(int* status, char id) {
  HOLD;
  Arm* a = find(f, id);
  if (!a) return -1;
  for (int k = 0; k < 17; ++k) status[k] = 0;
  status[0] = status[1] = status[2] = 1;
  status[3] = !f.uncalibrated;
  status[5] = a->output;
  status[14] = a->cause;
  return 0;
}
int dhdEnableForce(uchar on, char id) {
  HOLD;
  Arm* a = find(f, id);
  if (!a) return -1;
  a->output = on == 1, a->cause = on == 1 ? 0 : 4, a->silent = 0;
  if (!a->output) a->force[0] = a->force[1] = a->force[2] = 0;
  return 0;
}
int dhdSetGravityCompensation(int, char) { return 0; }
int dhdEnableExpertMode() {
  HOLD;
  return f.expert = true, 0;
}
int dhdDisableExpertMode() {
  HOLD;
  return f.expert = false, 0;
}
int dhdSetWatchdog(uchar val, char id) {
  HOLD;
  Arm* a = find(f, id);
  if (!a || !f.expert) return last_error = 9, -1;
  return a->watchdog = val, 0;
}
int dhdGetPosition(double* x, double* y, double* z, char id) {
  HOLD;
  Arm* a = find(f, id);
  if (!a) return -1;
  if (f.manual || a->fault[kDhdHang]) {
    if (a->owes) ++a->done, a->owes = false;
    ++a->waiting;
    f.change.notify_all();
    f.change.wait(hold, [&] {
      return a->fault[kDhdUnplugged] || !a->open || (!a->fault[kDhdHang] && (!f.manual || a->granted > a->done));
    });
    --a->waiting;
    f.change.notify_all();
    if (a->fault[kDhdUnplugged] || !a->open) return last_error = 2, -1;
    a->owes = f.manual;
  }
  if (!f.manual) pass(*a);
  const bool nan = a->fault[kDhdNan];
  *x = nan ? std::numeric_limits<double>::quiet_NaN() : a->x[0];
  *y = a->x[1], *z = a->x[2];
  return 0;
}
int dhdGetOrientationFrame(double m[3][3], char id) {
  HOLD;
  Arm* a = find(f, id);
  if (!a) return -1;
  std::memcpy(m, a->rows, sizeof a->rows);
  return 0;
}
int dhdGetLinearVelocity(double* x, double* y, double* z, char id) {
  HOLD;
  Arm* a = find(f, id);
  if (!a) return -1;
  *x = a->v[0], *y = a->v[1], *z = a->v[2];
  return 1;  // the result of the time guard, which is not an error
}
int dhdGetButton(int index, char id) {
  HOLD;
  Arm* a = find(f, id);
  return a && index == 0 ? a->button : 0;
}
int dhdGetGripperGap(double* gap, char id) {
  HOLD;
  Arm* a = find(f, id);
  if (!a) return -1;
  return *gap = a->gap, 0;
}
int dhdSetForceAndTorqueAndGripperForce(double x, double y, double z, double, double, double, double, char id) {
  HOLD;
  Arm* a = find(f, id);
  if (!a) return -1;
  const double to[3] = {x, y, z};
  double step = 0;
  for (int k = 0; k < 3; ++k) step += (to[k] - a->force[k]) * (to[k] - a->force[k]);
  if (a->output) {
    a->step_most = std::fmax(a->step_most, std::sqrt(step));
    std::memcpy(a->force, to, sizeof to);
  }
  a->silent = 0;
  ++a->writes;
  if (a->owes) ++a->done, a->owes = false;
  f.change.notify_all();
  return 0;
}
int dhdErrorGetLast() { return last_error; }
const char* dhdErrorGetStr(int error) {
  return error == 2 ? "communication error" : error == 5 ? "no device found" : error == 6 ? "device not available" : "an error";
}

void fakeDhdReset(void) {
  HOLD;
  f.count = number("FAKE_DHD_COUNT", 2);
  f.manual = number("FAKE_DHD_MANUAL", 0) == 1;
  f.uncalibrated = number("FAKE_DHD_UNCALIBRATED", 0) == 1;
  f.locked = number("FAKE_DHD_LOCKED", 0) == 1;
  for (Arm& a : f.arm) {
    const int waiting = a.waiting;
    a = Arm{};
    a.waiting = waiting;
  }
  f.change.notify_all();
}
bool fakeDhdStep(int milliseconds) {
  HOLD;
  for (int ms = 0; ms < milliseconds; ++ms) {
    for (Arm& a : f.arm) {
      pass(a);
      if (a.open && !a.fault[kDhdHang] && !a.fault[kDhdUnplugged]) ++a.granted;
    }
    f.change.notify_all();
    const bool served = f.change.wait_for(hold, std::chrono::seconds(5), [&] {
      for (const Arm& a : f.arm)
        if (a.open && !a.fault[kDhdHang] && !a.fault[kDhdUnplugged] && a.done < a.granted) return false;
      return true;
    });
    if (!served) return false;
  }
  return true;
}
void fakeDhdRun(void) {
  HOLD;
  f.manual = false;
  f.change.notify_all();
}
void fakeDhdFault(int arm, int fault, int on) {
  HOLD;
  f.arm[static_cast<size_t>(arm)].fault[fault] = on != 0;
  f.change.notify_all();
}
void fakeDhdHand(int arm, const double* position, const double* rows, int button, double gap) {
  HOLD;
  Arm& a = f.arm[static_cast<size_t>(arm)];
  std::memcpy(a.wish, position, sizeof a.wish);
  std::memcpy(a.rows, rows, sizeof a.rows);
  a.button = button, a.gap = gap;
}
void fakeDhdFast(int arm) {
  HOLD;
  Arm& a = f.arm[static_cast<size_t>(arm)];
  a.output = false, a.cause = 2;
}
void fakeDhdRead(int arm, FakeDhdArm* out) {
  HOLD;
  const Arm& a = f.arm[static_cast<size_t>(arm)];
  std::memcpy(out->position, a.x, sizeof a.x);
  std::memcpy(out->force, a.force, sizeof a.force);
  out->step_most = a.step_most;
  out->open = a.open, out->output = a.output, out->cause = a.cause, out->watchdog = a.watchdog, out->writes = a.writes;
}
void fakeDhdZero(int arm) {
  HOLD;
  f.arm[static_cast<size_t>(arm)].step_most = 0;
}
}
