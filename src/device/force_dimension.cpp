// SPDX-License-Identifier: Apache-2.0
// device/force_dimension: see the header. Comments below state which thread may use Arm's members.
#include "device/force_dimension.h"

#include <dlfcn.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <thread>

#include "device/dhd_api.h"
#include "device/periodic_timer.h"
#include "device/profiles.h"

namespace catgut {
namespace {

using namespace std::chrono_literals;

constexpr float kStopStep = 0.5f;                   // [N] per millisecond while stopping (the limiter's slew rate)
constexpr uint32_t kStatusEvery = 20;               // [ms] between checks whether the firmware has cut the force
constexpr uint32_t kEnableEvery = 250;              // [ms] between attempts to switch it on again
constexpr uint32_t kMostFailures = 20;              // milliseconds in a row with a failed call, after which a device is lost
constexpr auto kReopenEvery = 500ms;                // of a lost device
constexpr auto kHangsAfter = 300ms;                 // a thread that does not end by then is abandoned
constexpr double kShut = 0.004;                     // [m] gap from which on the jaw follows the fingers, over kGripTravel
constexpr double kClosed = 0.007, kOpened = 0.011;  // [m] gap of a gripper that counts as pressed, and as released

// Their axes (x toward the user, y right, z up) to ours (x right, y up, z toward the user), and back.
Vec3 ours(double x, double y, double z) { return {static_cast<float>(y), static_cast<float>(z), static_cast<float>(x)}; }
std::array<double, 3> theirs(Vec3 v) { return {double{v.z}, double{v.x}, double{v.y}}; }

struct Arm {
  dhd::Library dhd;  // constant
  int index = 0;     // among the library's devices; constant
  size_t hand = 0;
  bool paced = true, gripper = false;
  ArmLimits limits;  // constant
  // Owned by the thread; before it runs, by the opener.
  dhd::Id id = -1;
  ArmCallback callback;
  uint32_t sequence = 0, cut_for = 0, failures = 0;
  float jaw = -1;
  bool forced_off = false, closed = false;
  ArmForce force;  // last written, our frame
  std::chrono::steady_clock::time_point reopen_at;
  // Readable from any thread.
  std::atomic<bool> ready{false}, stopping{false}, stopped{true};
  std::atomic<bool> calling{false}, left{false};  // left: the port was destroyed, and its callback
  std::atomic<uint32_t> error{0}, errors{0};
  std::atomic<uint64_t> steps{0};
};

// The thread shares ownership of its Arm: one that hangs in the library outlives the port.
struct ForceDimension {
  dhd::Library dhd;
  std::array<std::shared_ptr<Arm>, 2> arm;
  std::array<std::thread, 2> thread;
};

std::string text(const char* s) { return s ? s : ""; }

// Checks that the device is ready, or reports why not. Called again when a device returns.
bool prepare(Arm& a, std::string& why) {
  int status[dhd::kStatusRoom] = {};
  if (a.dhd.dhdGetStatus(status, a.id) == dhd::kError) {
    why = text(a.dhd.dhdErrorGetStr(a.dhd.dhdErrorGetLast()));
    return false;
  }
  if (!status[dhd::kStatusReset]) {
    why = "not calibrated: run HapticInit of the SDK, or calibrate as in its manual, and try again";
    return false;
  }
  // Expert mode is needed only for the watchdog and is left at once: it would also allow invalid calls.
  const bool watched =
      a.dhd.dhdEnableExpertMode() != dhd::kError && a.dhd.dhdSetWatchdog(dhd::kWatchdogMost, a.id) != dhd::kError;
  a.dhd.dhdDisableExpertMode();
  if (!watched) {
    why = "its watchdog cannot be set; without it, a crash would leave a force on";
    return false;
  }
  a.dhd.dhdSetGravityCompensation(dhd::kOn, a.id);
  if (a.dhd.dhdEnableForce(dhd::kOn, a.id) == dhd::kError) {
    why = "force output cannot be enabled";
    return false;
  }
  a.gripper = a.dhd.dhdHasGripper(a.id);
  // A second clamp, in the library: behind all of ours.
  a.dhd.dhdSetMaxForce(double{a.limits.force}, a.id);
  if (a.limits.torque > 0) a.dhd.dhdSetMaxTorque(double{a.limits.torque}, a.id);
  if (a.limits.grip > 0) a.dhd.dhdSetMaxGripperForce(double{a.limits.grip}, a.id);
  return true;
}

bool read(Arm& a, ArmSample& s) {
  double p[3] = {}, v[3] = {}, m[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  if (a.dhd.dhdGetPosition(&p[0], &p[1], &p[2], a.id) == dhd::kError) return false;
  if (a.dhd.dhdGetOrientationFrame(m, a.id) == dhd::kError) return false;
  // Directly after opening the velocity has no history and returns an error: use zero.
  if (a.dhd.dhdGetLinearVelocity(&v[0], &v[1], &v[2], a.id) == dhd::kError) v[0] = v[1] = v[2] = 0;
  s.pose.p = ours(p[0], p[1], p[2]);
  s.velocity = ours(v[0], v[1], v[2]);
  // The columns are the tool's axes in the base frame. The tool's own axes are named like the base's: its y is our tool's x.
  const auto column = [&m](int k) { return ours(m[0][k], m[1][k], m[2][k]); };
  s.pose.q = from_axes(normalized(column(1), {1, 0, 0}), normalized(column(2), {0, 1, 0}), normalized(column(0), {0, 0, 1}));
  for (int k = 0; k < 2; ++k)
    if (a.dhd.dhdGetButton(k, a.id) == dhd::kOn) s.buttons |= 1u << k;
  double gap = 0;
  if (a.gripper && a.dhd.dhdGetGripperGap(&gap, a.id) != dhd::kError) {
    a.closed = gap < (a.closed ? kOpened : kClosed);
    a.jaw = static_cast<float>(std::clamp((gap - kShut) / double{kGripTravel}, 0.0, 1.0));
  }
  if (a.closed) s.buttons |= 1;
  s.jaw = a.jaw;  // a gap that could not be read must not open the jaws
  if (a.sequence % kStatusEvery == 1) {
    int status[dhd::kStatusRoom] = {};
    if (a.dhd.dhdGetStatus(status, a.id) == dhd::kError) return false;
    const int cause = status[dhd::kStatusForceOffCause];
    a.forced_off = !status[dhd::kStatusForce];
    a.cut_for = a.forced_off ? a.cut_for + kStatusEvery : 0;
    // A force cut by the firmware (late calls, a fast hand) is switched on again, through the servo's ramp. A force that the
    // user switched off at the device stays off until it is switched on there.
    if (a.cut_for >= kEnableEvery && (cause == dhd::kCauseWatchdog || cause == dhd::kCauseVelocity))
      a.dhd.dhdEnableForce(dhd::kOn, a.id), a.cut_for = 0;
  }
  s.forced_off = a.forced_off;
  s.state = ArmState::ready;
  return true;
}

bool write(Arm& a, const ArmForce& f) {
  const auto force = theirs(f.force), torque = theirs(a.limits.torque > 0 ? f.torque : Vec3{});
  const double grip = a.limits.grip > 0 ? double{f.grip} : 0;
  return a.dhd.dhdSetForceAndTorqueAndGripperForce(force[0], force[1], force[2], torque[0], torque[1], torque[2], grip, a.id) !=
         dhd::kError;
}

void note_error(Arm& a) {
  a.error.store(static_cast<uint32_t>(a.dhd.dhdErrorGetLast()), std::memory_order_relaxed);
  a.errors.fetch_add(1, std::memory_order_relaxed);
}

void lose(Arm& a) {
  a.ready.store(false, std::memory_order_relaxed);
  a.force = {}, a.failures = 0;
  a.dhd.dhdClose(a.id);
  a.id = -1;
  a.reopen_at = std::chrono::steady_clock::now() + kReopenEvery;
}

// A lost device may have been unplugged: its id is invalid, and it has to be opened again.
void find_again(Arm& a) {
  if (std::chrono::steady_clock::now() < a.reopen_at) return;
  a.reopen_at = std::chrono::steady_clock::now() + kReopenEvery;
  const int id = a.dhd.dhdOpenID(static_cast<dhd::Id>(a.index));
  if (id < 0) return;
  a.id = static_cast<dhd::Id>(id);
  std::string why;
  if (prepare(a, why)) return;
  a.dhd.dhdClose(a.id);
  a.id = -1;
}

// One millisecond of one device.
void serve(Arm& a) {
  ArmSample s;
  s.sequence = ++a.sequence;
  if (a.id < 0 && !a.stopping) find_again(a);
  const bool here = a.id >= 0;
  bool fine = here && read(a, s);
  if (!fine) s = {}, s.sequence = a.sequence;
  // The callback's owner is not destroyed between these two marks (see stop).
  a.calling = true;
  ArmForce force;
  if (!a.left) force = a.callback.step(a.callback.user, a.hand, s);
  a.calling = false;
  if (a.stopping || !fine) force = fade(a.force, a.limits, kStopStep);
  if (!is_finite(force)) force = {};
  const bool written = here && write(a, force);
  if (written) a.force = force;
  if (fine && written) {
    a.failures = 0;
    a.ready.store(true, std::memory_order_relaxed);
  } else if (here) {
    // A single failed call loses no device. While it cannot be read but still takes commands, its force goes down without a
    // step; meanwhile its own watchdog is as strict.
    a.ready.store(false, std::memory_order_relaxed);
    note_error(a);
    if (++a.failures > kMostFailures) lose(a);
  }
  a.steps.fetch_add(1, std::memory_order_relaxed);
}

void run(const std::shared_ptr<Arm>& arm) {
  Arm& a = *arm;
  go_first();
  Beat beat;
  while (!a.left && (!a.stopping || !is_zero(a.force))) {
    serve(a);
    if (a.paced || a.id < 0) beat.wait();
  }
  if (a.id >= 0 && !a.left) a.dhd.dhdEnableForce(dhd::kOff, a.id);
  a.stopped = true;
}

bool start(void* self, const ArmCallback& callback, std::string&) {
  ForceDimension& f = *static_cast<ForceDimension*>(self);
  for (size_t k = 0; k < 2; ++k) {
    if (!f.arm[k]) continue;
    f.arm[k]->callback = callback;
    f.arm[k]->stopping = false, f.arm[k]->stopped = false;
    f.thread[k] = std::thread(run, f.arm[k]);
  }
  return true;
}

void stop(void* self) {
  ForceDimension& f = *static_cast<ForceDimension*>(self);
  for (const auto& a : f.arm)
    if (a) a->stopping = true;
  const auto until = std::chrono::steady_clock::now() + kHangsAfter;
  for (size_t k = 0; k < 2; ++k) {
    if (!f.thread[k].joinable()) continue;
    Arm& a = *f.arm[k];
    while (!a.stopped && std::chrono::steady_clock::now() < until) std::this_thread::sleep_for(1ms);
    if (a.stopped) {
      f.thread[k].join();
      continue;
    }
    // It hangs in the library; the device's watchdog has switched the force off. Its callback is disabled.
    a.left = true;
    while (a.calling) std::this_thread::yield();
    f.thread[k].detach();
  }
}

ArmStatus status(void* self, size_t k) {
  const auto& a = static_cast<ForceDimension*>(self)->arm[k];
  if (!a) return {};
  return {a->ready, a->error, a->errors, a->steps};
}

std::string error_text(void* self, uint32_t error) {
  return text(static_cast<ForceDimension*>(self)->dhd.dhdErrorGetStr(static_cast<int>(error)));
}

void close(void* self) {
  ForceDimension* f = static_cast<ForceDimension*>(self);
  stop(self);
  for (const auto& a : f->arm)
    if (a && !a->left && a->id >= 0) f->dhd.dhdClose(a->id);
  delete f;
}

bool load(const ForceDimensionOptions& options, dhd::Library& dhd, std::vector<std::string>& messages) {
  std::vector<std::string> names{"libdhd.so", "libdhd.so.3", "libdrd.so", "libdrd.so.3"};  // the latter contains the former
  const char* set = std::getenv("CATGUT_LIBDHD");
  if (set && *set) names = {set};
  if (!options.library.empty()) names = {options.library};
  void* library = nullptr;
  std::string why;
  for (const std::string& name : names) {
    library = dlopen(name.c_str(), RTLD_NOW | RTLD_LOCAL);  // never closed: a thread may still be in it
    if (library) break;
    if (why.empty()) why = dlerror();
  }
  if (!library) {
    messages.push_back("force-dimension: SDK library not found (" + why +
                       "); install the SDK, or set CATGUT_LIBDHD to the path of libdhd.so");
    return false;
  }
  std::string missing;
#define CATGUT_DHD_LOAD(name, result, arguments)                          \
  dhd.name = reinterpret_cast<decltype(dhd.name)>(dlsym(library, #name)); \
  if (!dhd.name && missing.empty()) missing = #name;
  CATGUT_DHD_FUNCTIONS(CATGUT_DHD_LOAD)
#undef CATGUT_DHD_LOAD
  if (missing.empty()) return true;
  messages.push_back("force-dimension: the library lacks the function " + missing + "; supported versions are 3.14 to 3.17");
  return false;
}

}  // namespace

ArmPort open_force_dimension(const ForceDimensionOptions& options, std::vector<std::string>& messages) {
  ArmPort port;
  port.kind = "force-dimension";
  dhd::Library dhd;
  if (!load(options, dhd, messages)) return port;
  const int count = dhd.dhdGetDeviceCount();
  if (count <= 0) {
    messages.push_back("force-dimension: no device, or no permission to open its USB device (udev rules)");
    return port;
  }
  int version[4] = {};
  dhd.dhdGetSDKVersion(&version[0], &version[1], &version[2], &version[3]);
  auto f = std::make_unique<ForceDimension>();
  f->dhd = dhd;
  for (int index = 0; index < count && !(f->arm[0] && f->arm[1]); ++index) {
    const std::string who = "force-dimension: device " + std::to_string(index + 1) + " of " + std::to_string(count);
    const int id = dhd.dhdOpenID(static_cast<dhd::Id>(index));
    if (id < 0) {
      messages.push_back(who + " cannot be opened: " + text(dhd.dhdErrorGetStr(dhd.dhdErrorGetLast())) +
                         "; close other programs that use it, and check USB permissions (udev rules)");
      continue;
    }
    auto a = std::make_shared<Arm>();
    a->dhd = dhd, a->index = index, a->id = static_cast<dhd::Id>(id), a->paced = options.paced;
    // The library does not report its devices' limits; these are from CHAI3D's CDeltaDevices.cpp (docs/references.md).
    const int type = dhd.dhdGetSystemType(a->id);
    const bool falcon = type == dhd::kTypeFalcon, delta = type == dhd::kTypeDelta3 || type == dhd::kTypeOldDelta3;
    a->limits = limits_of(falcon  ? "falcon"
                          : delta ? "delta"
                                  : text(dhd.dhdGetSystemName(a->id)),
                          {falcon  ? 8.0f
                           : delta ? 20.0f
                                   : 12.0f,
                           0, 0, 0});
    if (!dhd.dhdHasActiveWrist(a->id)) a->limits.torque = 0;
    if (!dhd.dhdHasActiveGripper(a->id)) a->limits.grip = 0;
    std::string why;
    if (!prepare(*a, why)) {
      messages.push_back(who + " cannot be used: " + why);
      dhd.dhdClose(a->id);
      continue;
    }
    a->hand = dhd.dhdIsLeftHanded(a->id) ? 1 : 0;
    if (f->arm[a->hand]) a->hand = 1 - a->hand;
    ArmInfo& info = port.arm[a->hand];
    info.present = true;
    info.model = text(dhd.dhdGetSystemName(a->id));
    info.name = info.model;
    unsigned short serial = 0;
    if (dhd.dhdGetSerialNumber(&serial, a->id) != dhd::kError) info.serial = "fd-" + std::to_string(serial);
    info.driver = std::to_string(version[0]) + "." + std::to_string(version[1]) + "." + std::to_string(version[2]);
    info.limits = a->limits;
    const float reach = falcon ? 0.04f : delta ? 0.15f : 0.075f;
    info.least = Vec3{-reach, -reach, -reach}, info.most = Vec3{reach, reach, reach};
    f->arm[a->hand] = std::move(a);
  }
  if (!f->arm[0] && !f->arm[1]) return port;
  port.self = f.release();
  port.start = start, port.stop = stop, port.status = status, port.error_text = error_text, port.close = close;
  return port;
}

}  // namespace catgut
