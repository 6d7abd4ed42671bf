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
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <limits>
#include <memory>
#include <mutex>
#include <random>
#include <string>
#include <thread>
#include <utility>
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
  HDerror code;
  int blamed;  // arm
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
  double force[3] = {0, 0, 0};                                             // [N] last written
  double acting[3] = {0, 0, 0};                                            // [N] at the motors
  std::deque<std::pair<unsigned long, std::array<double, 3>>> on_the_way;  // written forces, with the time they act from
  double heat[3] = {0, 0, 0};                                              // of each joint's motor, 1: too hot
  bool hot = false;
  unsigned long block_ms = 0;
  bool output = false, clamping = false;
  bool fault[8] = {};
  double energy = 0, energy_most = 0, to_hand = 0, to_hand_most = 0, step_most = 0, force_most = 0;
  unsigned cuts = 0;
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
  unsigned long part = 0, next_call = 10;  // [0.1 ms] since fakeHdReset; when the scheduler calls next
  unsigned long ticks() const { return part / 10; }
  FakeHdUnkind unkind{};
  bool swapped = false;
  double storm = 0;  // chance of an error at any call
  std::mt19937 chance{1};
  double uniform() { return std::uniform_real_distribution<double>(0, 1)(chance); }
  std::thread thread;
  std::atomic<bool> quit{false};
  Fake();
  ~Fake() {
    quit = true;
    if (thread.joinable()) thread.join();
  }
};

constexpr double kMaxForce = 3.3, kHandSpeed = 400;   // [N], [mm/s]
constexpr double kContinuous = 0.88, kHeatTime = 10;  // [N] that a joint's motor bears for ever; [s]

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
  f.swapped = get("FAKE_HD_SWAPPED") == "1";
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

// Which arm a handle stands for, and back; 2: none.
size_t arm_of(const Fake& f, HHD h) { return h < 2 ? (f.swapped ? 1 - h : h) : 2; }
HHD handle_of(const Fake& f, size_t arm) { return static_cast<HHD>(f.swapped ? 1 - arm : arm); }

// What a test has asked to be raised at this place (0 begin, 1 end of a frame, 2 any read) of the current arm.
void raise_planned(Fake& f, int where) {
  for (Raised& r : f.raised)
    if (r.times > 0 && r.where == where && static_cast<size_t>(r.frame_of) == arm_of(f, f.current))
      --r.times, f.error.push_back({r.code, static_cast<int>(r.code) + 1000, handle_of(f, static_cast<size_t>(r.blamed))});
}
void raise(Fake& f, HDerror code) { f.error.push_back({code, static_cast<int>(code) + 1000, f.current}); }
// Any error of the library, with any arm in its record or none.
void storm(Fake& f) {
  if (f.storm <= 0 || f.uniform() >= f.storm) return;
  constexpr HDerror kCodes[] = {0x0100, 0x0101, 0x0102, 0x0103, 0x0104, 0x0200, 0x0201, 0x0202, 0x0203, 0x0204, 0x0300,
                                0x0301, 0x0302, 0x0303, 0x0304, 0x0400, 0x0401, 0x0402, 0x0500, 0x0501, 0x0600, 0x7777};
  constexpr HHD kBlamed[] = {0, 1, 0xFFFFFFFF, 77};
  f.error.push_back({kCodes[f.chance() % std::size(kCodes)], -1, kBlamed[f.chance() % 4]});
}

Arm* now(Fake& f) {
  storm(f);
  if (const size_t k = arm_of(f, f.current); k < 2 && f.arm[k].open) return &f.arm[k];
  raise(f, 0x0104);  // HD_BAD_HANDLE
  return nullptr;
}

bool has(const Fake& f, size_t arm, int fault) {
  if (f.arm[arm].fault[fault]) return true;
  for (const Planned& p : f.plan)
    if (p.arm == static_cast<int>(arm) && p.fault == fault && f.ticks() >= p.from && f.ticks() < p.to) return true;
  return false;
}

// A tenth of a millisecond of one arm.
void move(Fake& f, Arm& a, size_t which) {
  for (; !a.on_the_way.empty() && a.on_the_way.front().first <= f.part; a.on_the_way.pop_front())
    std::copy_n(a.on_the_way.front().second.begin(), 3, a.acting);
  double force[3] = {a.acting[0], a.acting[1], a.acting[2]};
  if (has(f, which, kFakeWarmMotors) || has(f, which, kFakeTooFast) || has(f, which, kFakeCommError) || a.hot || !a.output)
    force[0] = force[1] = force[2] = 0;
  if (has(f, which, kFakeFlipX)) force[0] = -force[0];
  constexpr double h = 1e-4;
  const double from[3] = {a.x[0], a.x[1], a.x[2]};
  // The speed of the hand is limited, as for people.
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
  double work = 0;
  for (int k = 0; k < 3; ++k) {
    a.v[k] = fast > slow ? a.v[k] * (1 - slow / fast) : 0;
    a.x[k] += a.v[k] * h;
    work += force[k] * (a.x[k] - from[k]) * 1e-3;
    // The arm's own damping takes of it what it is there for.
    a.to_hand -= a.viscous * a.v[k] * (a.x[k] - from[k]) * 1e-3;
  }
  a.energy += work, a.to_hand += work;
  a.energy_most = std::max(a.energy_most, a.energy), a.to_hand_most = std::max(a.to_hand_most, a.to_hand);
  if (f.unkind.weakest_joint <= 0) return;
  for (int k = 0; k < 3; ++k) {  // the second joint's motor is the weakest
    const double bears = kContinuous * (k == 1 ? f.unkind.weakest_joint : 1);
    a.heat[k] += (force[k] * force[k] / (bears * bears) - a.heat[k]) * h / kHeatTime;
  }
  const double hottest = std::max({a.heat[0], a.heat[1], a.heat[2]});
  if (!a.hot && hottest > 1) ++a.cuts;
  a.hot = hottest > (a.hot ? 0.9 : 1);
}

void pass(Fake& f, unsigned long parts) {
  for (unsigned long n = 0; n < parts; ++n, ++f.part)
    for (size_t k = 0; k < 2; ++k) move(f, f.arm[k], k);
}

void tick(Fake& f) {
  for (int n = 0; n < 10; ++n) {
    pass(f, 1);
    if (f.part < f.next_call) continue;
    unsigned long period = 10;
    if (f.unkind.jitter_ms > 0)
      period = static_cast<unsigned long>(
          std::clamp(std::lround(10 + 20 * f.unkind.jitter_ms * (f.uniform() + f.uniform() + f.uniform() - 1.5)), 3l, 30l));
    if (f.unkind.lost > 0 && f.uniform() < f.unkind.lost) period += 10;
    if (f.unkind.late > 0 && f.uniform() < f.unkind.late) period += static_cast<unsigned long>(20 + 60 * f.uniform());
    f.next_call = f.part + period;
    const bool stalled = has(f, 0, kFakeStall) || has(f, 1, kFakeStall);
    if (!f.running || !f.callback || stalled) continue;
    const HDSchedulerCallback callback = f.callback;
    if (callback(f.user) == 0) f.callback = nullptr;
  }
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
  f.current = handle_of(f, static_cast<size_t>(which));
  return f.current;
}
void hdMakeCurrentDevice(HHD h) {
  HOLD;
  storm(f);
  if (const size_t k = arm_of(f, h); k < 2 && f.arm[k].open) f.current = h;
  else raise(f, 0x0104);
}
void hdDisableDevice(HHD h) {
  HOLD;
  if (const size_t k = arm_of(f, h); k < 2) f.arm[k].open = false, f.arm[k].output = false;
}
HHD hdGetCurrentDevice() {
  HOLD;
  return f.current;
}
void hdBeginFrame(HHD h) {
  HOLD;
  storm(f);
  const size_t k = arm_of(f, h);
  if (k >= 2 || f.current != h) return raise(f, 0x0400);
  f.arm[k].in_frame = true;
  if (const unsigned long ms = std::exchange(f.arm[k].block_ms, 0); ms > 0) {  // it waits for the arm: time passes
    if (!f.manual) std::this_thread::sleep_for(std::chrono::milliseconds(ms));
    pass(f, 10 * ms);
    f.next_call = f.part + 10;
  }
  if (has(f, k, kFakeCommError)) raise(f, 0x0302);
  raise_planned(f, 0);
}
void hdEndFrame(HHD h) {
  HOLD;
  storm(f);
  const size_t k = arm_of(f, h);
  if (k >= 2 || !f.arm[k].in_frame) return raise(f, 0x0401);
  f.arm[k].in_frame = false;
  if (has(f, k, kFakeCommError)) raise(f, 0x0302);
  // The end of a frame sends the force, and there the library finds that it may not.
  if (has(f, k, kFakeWarmMotors) || f.arm[k].hot) raise(f, 0x0200);
  if (has(f, k, kFakeTooFast)) raise(f, 0x0203);
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
  const size_t which = arm_of(f, f.current);
  const bool nan = has(f, which, kFakeNan);
  double seen[3];  // the encoders step
  for (int k = 0; k < 3; ++k) {
    const double step = f.unkind.encoder_mm;
    seen[k] = step > 0 ? std::round(a->x[k] / step) * step : a->x[k];
  }
  if (what == 0x2052) raise_planned(f, 2);
  switch (what) {
    case 0x2050:
      for (int k = 0; k < 3; ++k) out[k] = nan ? std::numeric_limits<double>::quiet_NaN() : seen[k];
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
                            seen[0],
                            seen[1],
                            seen[2],
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
      for (int k = 0; k < 3; ++k)
        out[k] = has(f, which, kFakeWarmMotors) ? 1.0 : f.unkind.weakest_joint > 0 ? std::min(1.0, a->heat[k]) : 0.1;
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
      return arm_of(fake(), fake().current) == 1 ? "left-0002" : "right-0001";
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
  std::array<double, 3> to{};
  for (size_t k = 0; k < 3; ++k) a->force[k] = to[k] = in[k] * part;
  a->on_the_way.emplace_back(f.part + static_cast<unsigned long>(10 * f.unkind.transport_ms + 0.5), to);
  if (f.unkind.transport_ms <= 0) a->on_the_way.clear(), std::copy_n(to.begin(), 3, a->acting);
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
HDdouble hdGetSchedulerTimeStamp() { return static_cast<double>(fake().part) * 1e-4; }

// --- what tests ask ---

void fakeHdReset() {
  HOLD;
  for (Arm& a : f.arm) a = {};
  f.error.clear();
  f.raised.clear();
  f.callback = nullptr;
  f.running = false;
  f.current = 0xFFFFFFFF;
  f.part = 0, f.next_call = 10;
  f.unkind = {};
  f.storm = 0;
  f.chance.seed(1);
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
  f.raised.push_back({code, blamed, frame_of, where, times});
}
void fakeHdUnkind(const FakeHdUnkind* unkind) {
  HOLD;
  f.unkind = *unkind;
  f.chance.seed(unkind->seed);
}
void fakeHdBlock(int arm, unsigned milliseconds) {
  HOLD;
  f.arm[static_cast<size_t>(arm)].block_ms = milliseconds;
}
void fakeHdStorm(double chance) {
  HOLD;
  f.storm = chance;
}
unsigned long fakeHdNow(void) { return 1000000000ul + 100000ul * fake().part; }
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
  for (int k = 0; k < 3; ++k)
    out->position[k] = a.x[k], out->velocity[k] = a.v[k], out->force[k] = a.output && !a.hot ? a.acting[k] : 0,
    out->asked[k] = a.force[k];
  out->energy = a.energy, out->energy_most = a.energy_most, out->step_most = a.step_most, out->force_most = a.force_most;
  out->to_hand_most = a.to_hand_most;
  out->hottest = std::max({a.heat[0], a.heat[1], a.heat[2]}), out->cuts = a.cuts;
  out->ticks = f.ticks();
  out->force_output = a.output;
}
void fakeHdZero(int arm) {
  HOLD;
  Arm& a = f.arm[static_cast<size_t>(arm)];
  a.energy = a.energy_most = a.to_hand = a.to_hand_most = a.step_most = a.force_most = 0;
}
}
