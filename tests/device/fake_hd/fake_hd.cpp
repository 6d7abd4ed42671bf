// SPDX-License-Identifier: Apache-2.0
// tests/device/fake_hd: a libHD.so that simulates two arms, each with mass, friction and a human hand, behind the very
// functions, types and error codes of the real one. Written only from the published description of that library and
// deliberately without our own declarations of it, so that the two can disagree.
#include "fake_hd.h"

#include <pthread.h>
#include <time.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <limits>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

typedef unsigned int HDuint, HDerror, HDenum, HHD, HDCallbackCode, HDWaitCode;
typedef unsigned char HDboolean;
typedef unsigned short HDushort;
typedef int HDint;
typedef long HDlong;
typedef unsigned long HDulong, HDSchedulerHandle;
typedef float HDfloat;
typedef double HDdouble;
typedef const char* HDstring;
typedef HDCallbackCode (*HDSchedulerCallback)(void*);
struct HDErrorInfo {
  HDerror errorCode;
  int internalErrorCode;
  HHD hHD;
};

namespace {

struct Raised {
  HDErrorInfo error;
  int frame_of, where;
  unsigned long times;
};

struct Planned {
  int arm, fault;
  unsigned long from, to;
};

struct Arm {
  bool open = false, in_frame = false;
  double x[3] = {0, 0, 0}, v[3] = {0, 0, 0};  // [mm], [mm/s]
  double wish[3] = {0, 0, 0}, wish_now[3] = {0, 0, 0}, q[4] = {0, 0, 0, 1};
  int buttons = 0;
  double grip = 0.15, grip_damping = 0.002, mass = 0.12, coulomb = 0.05, viscous = 0.0005;
  double force[3] = {0, 0, 0};
  bool output = false, clamping = false;
  bool fault[8] = {};
  double energy = 0, energy_most = 0, step_most = 0, force_most = 0;
};

struct Fake {
  std::recursive_mutex lock;
  std::array<Arm, 2> arm;
  HHD current = 0xFFFFFFFF;
  std::deque<HDErrorInfo> error;
  HDSchedulerCallback callback = nullptr;
  void* user = nullptr;
  bool running = false;
  bool manual = false, uncalibrated = false;
  int busy = 0;
  std::string missing;
  std::vector<Planned> plan;
  std::vector<Raised> raised;
  unsigned long ticks = 0;
  std::thread thread;
  std::atomic<bool> quit{false};
  Fake();
  ~Fake() {
    quit = true;
    if (thread.joinable()) thread.join();
  }
};

constexpr double kMaxForce = 3.3, kHandSpeed = 400;  // [N], [mm/s]

Fake& fake() {
  static Fake f;
  return f;
}

int arm_named(const std::string& name) { return name == "left" ? 1 : 0; }

void read_environment(Fake& f) {
  const auto get = [](const char* name) {
    const char* s = std::getenv(name);
    return std::string(s ? s : "");
  };
  f.manual = get("FAKE_HD_MANUAL") == "1";
  f.uncalibrated = get("FAKE_HD_UNCALIBRATED") == "1";
  f.busy = std::atoi(get("FAKE_HD_BUSY").c_str());
  f.missing = get("FAKE_HD_MISSING");
  f.plan.clear();
  std::string rest = get("FAKE_HD_FAULT");
  while (!rest.empty()) {
    const size_t comma = rest.find(',');
    std::string one = rest.substr(0, comma);
    rest = comma == std::string::npos ? "" : rest.substr(comma + 1);
    std::vector<std::string> part(1);
    for (const char c : one) {
      if (c == ':') part.emplace_back();
      else part.back() += c;
    }
    if (part.size() < 3) continue;
    const char* kinds[] = {"", "comm_error", "warm_motors", "stall", "nan", "flip_x", "too_fast"};
    for (int k = 1; k < 7; ++k)
      if (part[0] == kinds[k])
        f.plan.push_back({arm_named(part[1]), k, std::strtoul(part[2].c_str(), nullptr, 10),
                          part.size() > 3 ? std::strtoul(part[3].c_str(), nullptr, 10) : ~0ul});
  }
}
Fake::Fake() { read_environment(*this); }

// Errors requested by a test for this point (0 begin, 1 end of a frame, 2 any read) of the current device.
void raise_planned(Fake& f, int where) {
  for (Raised& r : f.raised)
    if (r.times > 0 && r.where == where && static_cast<HHD>(r.frame_of) == f.current) --r.times, f.error.push_back(r.error);
}
void raise(Fake& f, HDerror code) { f.error.push_back({code, static_cast<int>(code) + 1000, f.current}); }

Arm* now(Fake& f) {
  if (f.current < 2 && f.arm[f.current].open) return &f.arm[f.current];
  raise(f, 0x0104);  // HD_BAD_HANDLE
  return nullptr;
}

bool has(const Fake& f, int arm, int fault) {
  if (f.arm[static_cast<size_t>(arm)].fault[fault]) return true;
  for (const Planned& p : f.plan)
    if (p.arm == arm && p.fault == fault && f.ticks >= p.from && f.ticks < p.to) return true;
  return false;
}

void move(Fake& f, Arm& a, int which) {
  double force[3] = {a.force[0], a.force[1], a.force[2]};
  if (has(f, which, kFakeWarmMotors) || has(f, which, kFakeTooFast) || has(f, which, kFakeCommError) || !a.output)
    force[0] = force[1] = force[2] = 0;
  if (has(f, which, kFakeFlipX)) force[0] = -force[0];
  constexpr int kParts = 10;
  const double h = 1e-3 / kParts;
  double from[3] = {a.x[0], a.x[1], a.x[2]};
  for (int part = 0; part < kParts; ++part) {
    // The hand is limited to the speed of human hands.
    double way[3], far = 0;
    for (int k = 0; k < 3; ++k) way[k] = a.wish[k] - a.wish_now[k], far += way[k] * way[k];
    far = std::sqrt(far);
    const double go = far > kHandSpeed * h ? kHandSpeed * h / far : 1;
    double speed[3];
    for (int k = 0; k < 3; ++k) a.wish_now[k] += way[k] * go, speed[k] = far > 1e-9 ? way[k] * go / h : 0;
    double fast = 0;
    for (int k = 0; k < 3; ++k) {
      const double total =
          force[k] + a.grip * (a.wish_now[k] - a.x[k]) + a.grip_damping * (speed[k] - a.v[k]) - a.viscous * a.v[k];
      a.v[k] += total / a.mass * 1e3 * h;  // N / kg = m/s^2
      fast += a.v[k] * a.v[k];
    }
    fast = std::sqrt(fast);
    const double slow = a.coulomb / a.mass * 1e3 * h;
    for (int k = 0; k < 3; ++k) {
      a.v[k] = fast > slow ? a.v[k] * (1 - slow / fast) : 0;
      a.x[k] += a.v[k] * h;
    }
  }
  for (int k = 0; k < 3; ++k) a.energy += force[k] * (a.x[k] - from[k]) * 1e-3;
  a.energy_most = std::max(a.energy_most, a.energy);
}

void tick(Fake& f) {
  for (int k = 0; k < 2; ++k) move(f, f.arm[static_cast<size_t>(k)], k);
  const bool stalled = has(f, 0, kFakeStall) || has(f, 1, kFakeStall);
  if (f.running && f.callback && !stalled) {
    const HDSchedulerCallback callback = f.callback;
    if (callback(f.user) == 0) f.callback = nullptr;
  }
  ++f.ticks;
}

void scheduler() {
  Fake& f = fake();
  // Like the real one's: real-time priority, if permitted.
  sched_param first{};
  first.sched_priority = 50;
  pthread_setschedparam(pthread_self(), SCHED_FIFO, &first);
  timespec next;
  clock_gettime(CLOCK_MONOTONIC, &next);
  while (!f.quit) {
    {
      const std::lock_guard<std::recursive_mutex> hold(f.lock);
      if (f.running) tick(f);
    }
    next.tv_nsec += 1000000;
    if (next.tv_nsec >= 1000000000) next.tv_nsec -= 1000000000, ++next.tv_sec;
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &next, nullptr);
  }
}

#define HOLD        \
  Fake& f = fake(); \
  const std::lock_guard<std::recursive_mutex> hold(f.lock)

}  // namespace

extern "C" {

HHD hdInitDevice(HDstring name) {
  HOLD;
  const std::string n = name ? name : "";
  const int which = n == "Left Device" ? 1 : n == "Right Device" || n.empty() ? 0 : -1;
  const bool gone = f.missing == "all" || (which == 0 && f.missing == "right") || (which == 1 && f.missing == "left");
  if (which < 0 || gone) {
    raise(f, 0x0302);
    return 0xFFFFFFFF;
  }
  if (f.busy > 0) {
    --f.busy;
    raise(f, 0x0301);
    return 0xFFFFFFFF;
  }
  f.arm[static_cast<size_t>(which)].open = true;
  f.current = static_cast<HHD>(which);
  return f.current;
}
void hdMakeCurrentDevice(HHD h) {
  HOLD;
  if (h < 2 && f.arm[h].open) f.current = h;
  else raise(f, 0x0104);
}
void hdDisableDevice(HHD h) {
  HOLD;
  if (h < 2) f.arm[h].open = false, f.arm[h].output = false;
}
HHD hdGetCurrentDevice() {
  HOLD;
  return f.current;
}
void hdBeginFrame(HHD h) {
  HOLD;
  if (h >= 2 || f.current != h) return raise(f, 0x0400);
  f.arm[h].in_frame = true;
  if (has(f, static_cast<int>(h), kFakeCommError)) raise(f, 0x0302);
  raise_planned(f, 0);
}
void hdEndFrame(HHD h) {
  HOLD;
  if (h >= 2 || !f.arm[h].in_frame) return raise(f, 0x0401);
  f.arm[h].in_frame = false;
  if (has(f, static_cast<int>(h), kFakeCommError)) raise(f, 0x0302);
  // The end of a frame sends the force, and there the library may detect that it is not allowed.
  if (has(f, static_cast<int>(h), kFakeWarmMotors)) raise(f, 0x0200);
  if (has(f, static_cast<int>(h), kFakeTooFast)) raise(f, 0x0203);
  raise_planned(f, 1);
}
HDErrorInfo hdGetError() {
  HOLD;
  if (f.error.empty()) return {0, 0, f.current};
  const HDErrorInfo e = f.error.back();  // the newest first
  f.error.pop_back();
  return e;
}
HDstring hdGetErrorString(HDerror code) {
  switch (code) {
    case 0x0000:
      return "no error";
    case 0x0104:
      return "bad handle";
    case 0x0200:
      return "warm motors";
    case 0x0203:
      return "exceeded the maximum velocity";
    case 0x0301:
      return "the device is already initiated";
    case 0x0302:
      return "communication error";
    case 0x0103:
      return "invalid input type";
    default:
      return "another error";
  }
}
void hdEnable(HDenum what) {
  HOLD;
  if (Arm* a = now(f)) {
    if (what == 0x4000) a->output = true;
    else if (what == 0x4001) a->clamping = true;
    else if (what != 0x4002 && what != 0x4003 && what != 0x4004) raise(f, 0x0100);
  }
}
void hdDisable(HDenum what) {
  HOLD;
  if (Arm* a = now(f)) {
    if (what == 0x4000) a->output = false;
    else if (what == 0x4001) a->clamping = false;
  }
}
HDboolean hdIsEnabled(HDenum what) {
  HOLD;
  Arm* a = now(f);
  return a && ((what == 0x4000 && a->output) || (what == 0x4001 && a->clamping));
}
void hdGetBooleanv(HDenum what, HDboolean* out) {
  HOLD;
  if (what == 0x2002 || what == 0x2001) *out = 0;
  else raise(f, 0x0103);
}
void hdGetIntegerv(HDenum what, HDint* out) {
  HOLD;
  Arm* a = now(f);
  if (!a) return;
  if (what == 0x2000) *out = a->buttons;
  else raise(f, 0x0103);  // the inkwell, too: it is a boolean
}
void hdGetFloatv(HDenum what, HDfloat* out) {
  HOLD;
  if (what == 0x2552) *out = 0;
  else raise(f, 0x0103);
}
void hdGetDoublev(HDenum what, HDdouble* out) {
  HOLD;
  Arm* a = now(f);
  if (!a) return;
  const bool nan = has(f, static_cast<int>(f.current), kFakeNan);
  if (what == 0x2052) raise_planned(f, 2);
  switch (what) {
    case 0x2050:
      for (int k = 0; k < 3; ++k) out[k] = nan ? std::numeric_limits<double>::quiet_NaN() : a->x[k];
      return;
    case 0x2051:
      for (int k = 0; k < 3; ++k) out[k] = a->v[k];
      return;
    case 0x2052: {
      const double x = a->q[0], y = a->q[1], z = a->q[2], w = a->q[3];
      const double m[16] = {1 - 2 * (y * y + z * z),
                            2 * (x * y + z * w),
                            2 * (x * z - y * w),
                            0,
                            2 * (x * y - z * w),
                            1 - 2 * (x * x + z * z),
                            2 * (y * z + x * w),
                            0,
                            2 * (x * z + y * w),
                            2 * (y * z - x * w),
                            1 - 2 * (x * x + y * y),
                            0,
                            a->x[0],
                            a->x[1],
                            a->x[2],
                            1};
      std::memcpy(out, m, sizeof m);
      if (nan) out[12] = std::numeric_limits<double>::quiet_NaN();
      return;
    }
    case 0x2551: {
      const double box[6] = {-80, -60, -35, 80, 60, 35};
      std::memcpy(out, box, sizeof box);
      return;
    }
    case 0x2602:
      *out = 0.4;
      return;
    case 0x2603:
      *out = kMaxForce;
      return;
    case 0x2604:
      *out = 0.88;
      return;
    case 0x2605:
      for (int k = 0; k < 3; ++k) out[k] = has(f, static_cast<int>(f.current), kFakeWarmMotors) ? 1.0 : 0.1;
      return;
    case 0x2609:
      *out = 0.004;
      return;
    case 0x2700:
    case 0x2800:
      for (int k = 0; k < 3; ++k) out[k] = a->force[k];
      return;
    default:
      raise(f, 0x0100);
  }
}
void hdGetLongv(HDenum what, HDlong* out) {
  HOLD;
  if (what != 0x2010) return raise(f, 0x0103);
  for (int k = 0; k < 6; ++k) out[k] = (1L << 40) + k;  // wider than 32 bits: detects a binding that uses int
}
HDstring hdGetString(HDenum what) {
  switch (what) {
    case 0x2501:
      return "Simulated Touch";
    case 0x2502:
      return "fake 1.0";
    case 0x2503:
      return "Catgut tests";
    case 0x2504:
      return fake().current == 1 ? "left-0002" : "right-0001";
    default:
      return "";
  }
}
void hdSetBooleanv(HDenum, const HDboolean*) {}
void hdSetIntegerv(HDenum, const HDint*) {}
void hdSetFloatv(HDenum, const HDfloat*) {}
void hdSetDoublev(HDenum what, const HDdouble* in) {
  HOLD;
  Arm* a = now(f);
  if (!a) return;
  if (what != 0x2700) return raise(f, 0x0100);
  if (!a->in_frame) return raise(f, 0x0402);
  double l = std::sqrt(in[0] * in[0] + in[1] * in[1] + in[2] * in[2]), part = 1;
  if (!(l <= 1e9)) return raise(f, 0x0204);
  if (l > kMaxForce * 1.001) {
    raise(f, 0x0201);
    if (a->clamping) part = kMaxForce / l;
    else part = 0;
  }
  double step = 0;
  for (int k = 0; k < 3; ++k) step += (in[k] * part - a->force[k]) * (in[k] * part - a->force[k]);
  a->step_most = std::max(a->step_most, std::sqrt(step));
  a->force_most = std::max(a->force_most, l * part);
  for (int k = 0; k < 3; ++k) a->force[k] = in[k] * part;
}
void hdSetLongv(HDenum, const HDlong*) {}
HDenum hdCheckCalibration() { return fake().uncalibrated ? 0x5002 : 0x5000; }
HDenum hdCheckCalibrationStyle() { return 4; }
void hdUpdateCalibration(HDenum) {}
HDboolean hdDeploymentLicense(HDstring, HDstring, HDstring) { return 1; }
void hdStartScheduler() {
  HOLD;
  f.running = true;
  if (!f.manual && !f.thread.joinable()) f.thread = std::thread(scheduler);
}
void hdStopScheduler() {
  HOLD;
  f.running = false;
}
void hdSetSchedulerRate(HDulong rate) {
  HOLD;
  if (rate != 500 && rate != 1000) raise(f, 0x0101);
}
void hdScheduleSynchronous(HDSchedulerCallback callback, void* user, HDushort) {
  HOLD;
  callback(user);
}
HDSchedulerHandle hdScheduleAsynchronous(HDSchedulerCallback callback, void* user, HDushort) {
  HOLD;
  if (f.callback) raise(f, 0x0501);  // one for both arms
  f.callback = callback, f.user = user;
  return 0x1234567800000001ul;  // wider than 32 bits, as above
}
void hdUnschedule(HDSchedulerHandle handle) {
  HOLD;
  if (handle == 0x1234567800000001ul) f.callback = nullptr;
  else raise(f, 0x0101);
}
HDboolean hdWaitForCompletion(HDSchedulerHandle, HDWaitCode) { return 0; }
HDdouble hdGetSchedulerTimeStamp() { return static_cast<double>(fake().ticks) * 1e-3; }

// --- what tests ask ---

void fakeHdReset() {
  HOLD;
  for (Arm& a : f.arm) a = {};
  f.error.clear();
  f.raised.clear();
  f.callback = nullptr;
  f.running = false;
  f.current = 0xFFFFFFFF;
  f.ticks = 0;
  read_environment(f);
}
void fakeHdStep(unsigned milliseconds) {
  HOLD;
  for (unsigned k = 0; k < milliseconds; ++k) tick(f);
}
void fakeHdFault(int arm, int fault, int on) {
  HOLD;
  f.arm[static_cast<size_t>(arm)].fault[fault] = on != 0;
}
void fakeHdRaise(int frame_of, int blamed, unsigned code, int where, unsigned long times) {
  HOLD;
  f.raised.push_back({{code, static_cast<int>(code) + 1000, static_cast<HHD>(blamed)}, frame_of, where, times});
}
void fakeHdHand(int arm, const double* position, const double* quaternion, int buttons) {
  HOLD;
  Arm& a = f.arm[static_cast<size_t>(arm)];
  std::copy(position, position + 3, a.wish);
  if (quaternion) std::copy(quaternion, quaternion + 4, a.q);
  a.buttons = buttons;
}
void fakeHdGrip(int arm, double stiffness, double damping, double mass, double coulomb) {
  HOLD;
  Arm& a = f.arm[static_cast<size_t>(arm)];
  a.grip = stiffness, a.grip_damping = damping, a.mass = mass, a.coulomb = coulomb;
}
void fakeHdPlace(int arm, const double* position) {
  HOLD;
  Arm& a = f.arm[static_cast<size_t>(arm)];
  for (int k = 0; k < 3; ++k) a.x[k] = a.wish[k] = a.wish_now[k] = position[k], a.v[k] = 0;
}
void fakeHdRead(int arm, FakeHdArm* out) {
  HOLD;
  const Arm& a = f.arm[static_cast<size_t>(arm)];
  for (int k = 0; k < 3; ++k) out->position[k] = a.x[k], out->velocity[k] = a.v[k], out->force[k] = a.output ? a.force[k] : 0;
  out->energy = a.energy, out->energy_most = a.energy_most, out->step_most = a.step_most, out->force_most = a.force_most;
  out->ticks = f.ticks;
  out->force_output = a.output;
}
void fakeHdZero(int arm) {
  HOLD;
  Arm& a = f.arm[static_cast<size_t>(arm)];
  a.energy = a.energy_most = a.step_most = a.force_most = 0;
}
}
