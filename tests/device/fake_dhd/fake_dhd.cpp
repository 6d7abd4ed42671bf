// SPDX-License-Identifier: Apache-2.0
// tests/device/fake_dhd: a libdhd.so with two devices and the functions and types of the real one. Positions that follow a
// hand, calls that wait for the device, a firmware watchdog. Written only from the published description of that library and
// deliberately without our own declarations of it, so that the two can disagree.
#include "fake_dhd.h"

#include "../plain_hand.h"

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
  bool open = false, output = false;
  int cause = 0, watchdog = 0, button = 0;
  double gap = 0.02;
  PlainHand hand;
  double rows[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  double asked[3] = {0, 0, 0};                                // [N] last written
  double torque[3] = {0, 0, 0}, grip = 0;                     // [N m], [N] at the motors
  double max_force = 100, max_torque = 100, max_gripper = 1;  // the library's clamps; 1 N is its default for grippers
  double step_most = 0, torque_step = 0, grip_step = 0;
  unsigned long writes = 0, granted = 0, done = 0;
  int silent = 0, waiting = 0, next_call = 1;
  long now_ns = 1000000000, part_ns = 0;
  bool owes = false;  // a millisecond was begun by a read, and is finished by a write
  bool fault[4] = {};

  bool at_rest() const { return asked[0] == 0 && asked[1] == 0 && asked[2] == 0; }
  void cut() {
    hand.cut();
    for (int k = 0; k < 3; ++k) asked[k] = torque[k] = 0;
    grip = 0;
  }
};

struct Fake {
  std::mutex lock;
  std::condition_variable change;
  std::array<Arm, 2> arm;
  int count = 2;
  bool manual = false, expert = false, uncalibrated = false, locked = false, swapped = false;
  std::string name = "simulated omega.3";
  UnkindDevice unkind;
  UnkindPeriods periods;
  unsigned long errors = 0;  // of the storm
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
  if (f.unkind.storm > 0 && f.periods.uniform() < f.unkind.storm) {
    ++f.errors;
    last_error = static_cast<int>(1 + 20 * f.periods.uniform());
    return nullptr;
  }
  return &a;
}

// The device's own millisecond, independent of the backend.
void pass(Arm& a) {
  ++a.silent;
  if (a.watchdog > 0 && a.output && a.silent * 8 > a.watchdog && !a.at_rest()) a.output = false, a.cause = 3;
  if (!a.output || a.fault[kDhdUnplugged]) a.cut();
  a.hand.pass(a.output);
  a.now_ns += 1000000;
}

#define HOLD        \
  Fake& f = fake(); \
  std::unique_lock<std::mutex> hold(f.lock)

}  // namespace

extern "C" {

bool dhdHasActiveGripper(char id);

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
  a.cut();
  f.change.notify_all();
  return 0;
}
int dhdGetSystemType(char) { return 33; }
const char* dhdGetSystemName(char) { return fake().name.c_str(); }
int dhdGetSerialNumber(ushort* sn, char id) { return *sn = static_cast<ushort>(1000 + id), 0; }
void dhdGetSDKVersion(int* a, int* b, int* c, int* d) { *a = 3, *b = 17, *c = 5, *d = 0; }
// The first one is the left hand's, unless swapped: the order does not matter.
bool dhdIsLeftHanded(char id) { return id == (fake().swapped ? 1 : 0); }
bool dhdHasGripper(char id) { return !dhdIsLeftHanded(id) || dhdHasActiveGripper(id); }
bool dhdHasActiveGripper(char) { return fake().name.find(".7") != std::string::npos; }
bool dhdHasActiveWrist(char) { return fake().name.find("sigma") != std::string::npos; }
int dhdSetMaxForce(double limit, char id) {
  HOLD;
  Arm* a = find(f, id);
  return a ? (a->max_force = limit, 0) : -1;
}
int dhdSetMaxTorque(double limit, char id) {
  HOLD;
  Arm* a = find(f, id);
  return a ? (a->max_torque = limit, 0) : -1;
}
int dhdSetMaxGripperForce(double limit, char id) {
  HOLD;
  Arm* a = find(f, id);
  return a ? (a->max_gripper = limit, 0) : -1;
}
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
  if (!a->output) a->cut();
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
  a->part_ns = f.periods.deviation_ns(f.unkind);
  const bool nan = a->fault[kDhdNan];
  const PlainHand::V seen = a->hand.seen(f.unkind.encoder);
  *x = nan ? std::numeric_limits<double>::quiet_NaN() : seen[0];
  *y = seen[1], *z = seen[2];
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
  *x = a->hand.v[0], *y = a->hand.v[1], *z = a->hand.v[2];
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
int dhdSetForceAndTorqueAndGripperForce(double x, double y, double z, double tx, double ty, double tz, double fg, char id) {
  HOLD;
  Arm* a = find(f, id);
  if (!a) return -1;
  const auto length = [](double p, double q, double r) { return std::sqrt(p * p + q * q + r * r); };
  const double to[3] = {x, y, z}, turn[3] = {tx, ty, tz};
  if (a->output) {
    a->step_most = std::fmax(a->step_most, length(x - a->asked[0], y - a->asked[1], z - a->asked[2]));
    a->torque_step = std::fmax(a->torque_step, length(tx - a->torque[0], ty - a->torque[1], tz - a->torque[2]));
    a->grip_step = std::fmax(a->grip_step, std::fabs(fg - a->grip));
    std::memcpy(a->asked, to, sizeof to);
    const double part = std::fmin(1, a->max_force / std::fmax(1e-9, length(x, y, z))),
                 turned = std::fmin(1, a->max_torque / std::fmax(1e-9, length(tx, ty, tz)));
    a->hand.command({part * x, part * y, part * z}, f.unkind.transport);
    for (int k = 0; k < 3; ++k) a->torque[k] = dhdHasActiveWrist(id) ? turned * turn[k] : 0;
    a->grip = dhdHasActiveGripper(id) ? std::fmax(-a->max_gripper, std::fmin(a->max_gripper, fg)) : 0;
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
  f.swapped = number("FAKE_DHD_SWAPPED", 0) == 1;
  const char* name = std::getenv("FAKE_DHD_NAME");
  f.name = name && *name ? name : "simulated omega.3";
  f.unkind = {};
  f.errors = 0;
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
      if (--a.next_call > 0) continue;
      a.next_call = f.periods.next(f.unkind);
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
  for (size_t k = 0; k < 3; ++k) a.hand.wish[k] = position[k];
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
  for (size_t k = 0; k < 3; ++k) {
    out->position[k] = a.hand.x[k], out->force[k] = a.hand.acting[k], out->asked[k] = a.asked[k], out->torque[k] = a.torque[k];
  }
  out->grip = a.grip, out->torque_step = a.torque_step, out->grip_step = a.grip_step;
  out->to_hand_most = a.hand.to_hand_most, out->force_most = a.hand.force_most;
  out->max_force = a.max_force, out->max_torque = a.max_torque, out->max_gripper = a.max_gripper;
  out->step_most = a.step_most;
  out->open = a.open, out->output = a.output, out->cause = a.cause, out->watchdog = a.watchdog, out->writes = a.writes;
}
void fakeDhdZero(int arm) {
  HOLD;
  Arm& a = f.arm[static_cast<size_t>(arm)];
  a.step_most = a.torque_step = a.grip_step = 0;
  a.hand.zero();
}
void fakeDhdUnkind(const UnkindDevice* unkind) {
  HOLD;
  f.unkind = *unkind;
}
void fakeDhdGrip(int arm, double stiffness, double damping, double mass) {
  HOLD;
  PlainHand& h = f.arm[static_cast<size_t>(arm)].hand;
  h.grip = stiffness, h.damping = damping, h.mass = mass;
}
unsigned long fakeDhdErrors(void) {
  HOLD;
  return f.errors;
}
unsigned long fakeDhdNow(int arm) {
  HOLD;
  const Arm& a = f.arm[static_cast<size_t>(arm)];
  return static_cast<unsigned long>(a.now_ns + a.part_ns);
}
}
