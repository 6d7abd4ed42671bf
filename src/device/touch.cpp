// SPDX-License-Identifier: Apache-2.0
// device/touch: see the header. Comments below state which thread may use Touch's members.
#include "device/touch.h"

#include <dlfcn.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <thread>
#include <utility>

#include "device/hd_api.h"
#include "device/profiles.h"

namespace catgut {

ArmPort& ArmPort::operator=(ArmPort&& other) noexcept {
  if (this == &other) return *this;
  reset();
  kind = other.kind;
  arm = std::move(other.arm);
  self = std::exchange(other.self, nullptr);
  start = other.start, stop = other.stop, status = other.status, error_text = other.error_text, close = other.close;
  send_patch = other.send_patch;
  return *this;
}

namespace {

using namespace std::chrono_literals;

constexpr float kStopStep = 0.5f;      // [N] per millisecond while stopping (the limiter's slew rate)
constexpr uint32_t kProbeEvery = 250;  // [ms] between checks whether a lost device has returned
constexpr uint32_t kWarmthEvery = 50;  // [ms] motors warm slowly
constexpr int kMostErrors = 8;         // per device and millisecond: the error stack may be deep, the callback must be short

bool is_lost(hd::Enum error) { return error >= hd::kDeviceFault && error <= hd::kTimerError && error != hd::kAlreadyOpen; }
bool cuts_force(hd::Enum error) { return error >= hd::kWarmMotors && error <= hd::kForceError; }

// Rotation of a column-major 4x4 matrix.
Quat rotation_of(const double* m) {
  const auto column = [m](int k) {
    return Vec3{static_cast<float>(m[4 * k]), static_cast<float>(m[4 * k + 1]), static_cast<float>(m[4 * k + 2])};
  };
  return from_axes(normalized(column(0), {1, 0, 0}), normalized(column(1), {0, 1, 0}), normalized(column(2), {0, 0, 1}));
}

struct Arm {
  hd::Handle handle = hd::kNoDevice;  // set before the scheduler starts, constant after
  // Owned by the callback.
  uint32_t sequence = 0, lost_for = 0;
  bool lost = false;
  // Latched until a sample has reported them. The library also raises errors at the end of a frame, after the sample was used,
  // and errors of one device may appear in the other's frame.
  bool cut = false, broken = false;
  float warmth = 0;
  ArmForce force;    // last written
  ArmLimits limits;  // constant
  // Readable from any thread.
  std::atomic<bool> ready{false}, at_rest{true};
  std::atomic<uint32_t> error{0}, errors{0};
  std::atomic<uint64_t> steps{0};
};

struct Touch {
  hd::Library hd;
  std::array<Arm, 2> arm;
  ArmCallback callback;  // set before the scheduler starts
  hd::SchedulerHandle scheduled = 0;
  bool running = false;
  std::atomic<bool> stopping{false}, stopped{false};
};

// Fetches the errors since the last call and latches them at the device that each names; unnamed ones belong to the current
// device. The library returns the newest first; the most severe one becomes the device's error, of equals the newest.
void note_errors(Touch& t, size_t current) {
  std::array<int, 2> worst{-1, -1};
  for (int k = 0; k < kMostErrors; ++k) {
    const hd::ErrorInfo e = t.hd.hdGetError();
    if (e.code == hd::kSuccess) break;
    size_t which = current;
    for (size_t arm = 0; arm < 2; ++arm)
      if (e.device != hd::kNoDevice && t.arm[arm].handle == e.device) which = arm;
    Arm& a = t.arm[which];
    a.errors.fetch_add(1, std::memory_order_relaxed);
    const int rank = is_lost(e.code) ? 2 : cuts_force(e.code) ? 1 : 0;
    if (rank > worst[which]) worst[which] = rank, a.error.store(e.code, std::memory_order_relaxed);
    if (is_lost(e.code)) a.broken = true;
    if (cuts_force(e.code)) a.cut = true;
  }
}

// One device, one millisecond, in order: make current, begin, read, compute, write, end.
void serve(Touch& t, size_t which) {
  Arm& a = t.arm[which];
  if (a.handle == hd::kNoDevice) return;
  ArmSample s;
  s.sequence = ++a.sequence;
  if (std::exchange(a.broken, false)) a.lost = true, a.lost_for = 0;  // found in the other device's frame
  // A lost device is asked now and then; before that its force goes down without a step, in case it still hears the driver.
  if (a.lost && is_zero(a.force) && ++a.lost_for % kProbeEvery != 0) {
    t.callback.step(t.callback.user, which, s);
    a.steps.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  t.hd.hdMakeCurrentDevice(a.handle);
  t.hd.hdBeginFrame(a.handle);
  double matrix[16] = {}, velocity[3] = {};
  hd::Int buttons = 0;
  t.hd.hdGetDoublev(hd::kTransform, matrix);
  t.hd.hdGetDoublev(hd::kVelocity, velocity);
  t.hd.hdGetIntegerv(hd::kButtons, &buttons);
  if (a.sequence % kWarmthEvery == 1) {
    double motor[6] = {};
    t.hd.hdGetDoublev(hd::kMotorTemperature, motor);
    double most = 0;
    for (const double m : motor)
      if (m > most) most = m;
    a.warmth = static_cast<float>(most);
  }
  note_errors(t, which);
  const bool lost = std::exchange(a.broken, false);
  if (!lost) {
    s.state = ArmState::ready;
    s.pose.p = Vec3{static_cast<float>(matrix[12]), static_cast<float>(matrix[13]), static_cast<float>(matrix[14])} * 1e-3f;
    s.pose.q = rotation_of(matrix);
    s.velocity =
        Vec3{static_cast<float>(velocity[0]), static_cast<float>(velocity[1]), static_cast<float>(velocity[2])} * 1e-3f;
    s.buttons = static_cast<uint32_t>(buttons);
    s.warmth = a.warmth;
    s.forced_off = std::exchange(a.cut, false);
  }
  ArmForce force = t.callback.step(t.callback.user, which, s);
  if (t.stopping.load(std::memory_order_relaxed) || lost) force = fade(a.force, a.limits, kStopStep);
  if (!is_finite(force)) force = {};
  const double newton[3] = {double{force.force.x}, double{force.force.y}, double{force.force.z}};
  t.hd.hdSetDoublev(hd::kCurrentForce, newton);
  if (a.limits.torque > 0) {
    const double milli[3] = {1e3 * double{force.torque.x}, 1e3 * double{force.torque.y}, 1e3 * double{force.torque.z}};
    t.hd.hdSetDoublev(hd::kCurrentTorque, milli);  // [N mm]
  }
  t.hd.hdEndFrame(a.handle);
  note_errors(t, which);
  a.lost = std::exchange(a.broken, false) || lost;
  if (!a.lost) a.lost_for = 0;
  a.force = force;
  a.at_rest.store(is_zero(force), std::memory_order_relaxed);
  a.ready.store(!a.lost, std::memory_order_relaxed);
  a.steps.fetch_add(1, std::memory_order_relaxed);
}

void switch_off(Touch& t) {
  for (Arm& a : t.arm)
    if (a.handle != hd::kNoDevice) t.hd.hdMakeCurrentDevice(a.handle), t.hd.hdDisable(hd::kForceOutput);
}

hd::Code CATGUT_HD_CALL serve_both(void* self) {
  Touch& t = *static_cast<Touch*>(self);
  for (size_t k = 0; k < t.arm.size(); ++k) serve(t, k);
  if (!t.stopping.load(std::memory_order_relaxed) || !t.arm[0].at_rest || !t.arm[1].at_rest) return hd::kCallbackContinue;
  switch_off(t);  // here, where no other code makes another device current
  t.stopped.store(true, std::memory_order_release);
  return hd::kCallbackDone;
}

void drain(const hd::Library& hd) {
  for (int k = 0; k < 100 && hd.hdGetError().code != hd::kSuccess; ++k) {}
}

bool load(const TouchOptions& options, hd::Library& hd, std::vector<std::string>& messages) {
  std::vector<std::string> names;
  if (const char* set = std::getenv("CATGUT_LIBHD"); !options.library.empty() || (set && *set))
    names.push_back(options.library.empty() ? set : options.library);
  else names = {"libHD.so", "libHD.so.3.4", "libHD.so.3.0"};
  void* library = nullptr;
  std::string why;
  for (const std::string& name : names) {
    // Never closed: the library fails when loaded a second time.
    library = dlopen(name.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (library) break;
    if (why.empty()) why = dlerror();
  }
  if (!library) {
    messages.push_back("touch: OpenHaptics device library not found (" + why +
                       "); install OpenHaptics and the device driver, or set CATGUT_LIBHD to the path of libHD.so");
    return false;
  }
  std::string missing;
#define CATGUT_HD_LOAD(name, result, arguments)                         \
  hd.name = reinterpret_cast<decltype(hd.name)>(dlsym(library, #name)); \
  if (!hd.name && missing.empty()) missing = #name;
  CATGUT_HD_FUNCTIONS(CATGUT_HD_LOAD)
#undef CATGUT_HD_LOAD
  if (missing.empty()) return true;
  messages.push_back("touch: the device library lacks the function " + missing + "; supported versions are 3.0 to 3.5");
  return false;
}

std::string text(const char* s) { return s ? s : ""; }

// Opens the device `name` (null: the default one); `ours`: the device that is open already. Returns kNoDevice, with the reason
// in `why`.
hd::Handle open_arm(const hd::Library& hd, const char* name, hd::Handle ours, int retries, std::string& why) {
  for (int attempt = 0;; ++attempt) {
    drain(hd);
    const hd::Handle handle = hd.hdInitDevice(name);
    const hd::ErrorInfo e = hd.hdGetError();
    if (handle != hd::kNoDevice && e.code == hd::kSuccess) return handle;
    if (e.code == hd::kAlreadyOpen && attempt < retries) {
      // A device left open by a crashed program is closed first (as in SOFA's plugin), unless it is one of ours.
      if (handle != hd::kNoDevice && handle != ours) hd.hdDisableDevice(handle);
      std::this_thread::sleep_for(20ms);
      continue;
    }
    why = e.code == hd::kInvalidLicense ? "the driver has no license"
          : e.code != hd::kSuccess      ? text(hd.hdGetErrorString(e.code))
                                        : "unknown to the driver";
    if (!std::getenv("GTDD_HOME")) why += "; GTDD_HOME is not set, which newer drivers need to find their devices";
    return hd::kNoDevice;
  }
}

double number(const hd::Library& hd, hd::Enum what) {
  double value = 0;
  hd.hdGetDoublev(what, &value);
  return hd.hdGetError().code == hd::kSuccess && std::isfinite(value) && value > 0 ? value : 0;
}

// Reads the device's properties and switches its force on; false, with the reason, if it is unusable.
bool prepare(const hd::Library& hd, hd::Handle handle, ArmInfo& info, std::string& why) {
  hd.hdMakeCurrentDevice(handle);
  info.model = text(hd.hdGetString(hd::kModel));
  info.serial = text(hd.hdGetString(hd::kSerial));
  info.driver = text(hd.hdGetString(hd::kDriverVersion));
  drain(hd);
  hd::Enum calibration = hd.hdCheckCalibration();
  if (calibration == hd::kCalibrationNeedsUpdate) {
    hd.hdUpdateCalibration(hd.hdCheckCalibrationStyle());
    calibration = hd.hdCheckCalibration();
  }
  if (calibration != hd::kCalibrationOk) {
    why = "not calibrated: put the stylus into its inkwell and try again";
    return false;
  }
  drain(hd);
  info.limits.force = static_cast<float>(number(hd, hd::kMaxForce));
  info.limits.continuous = static_cast<float>(number(hd, hd::kMaxContinuousForce));
  info.limits.stiffness = 1e3f * static_cast<float>(number(hd, hd::kMaxStiffness));  // N/mm
  info.limits.damping = 1e3f * static_cast<float>(number(hd, hd::kMaxDamping));
  // Phantom Premium 6DOF. The library's Cartesian torque is deprecated there, in favor of torques of its joints.
  hd::Int motors = 0;
  hd.hdGetIntegerv(hd::kOutputDof, &motors);
  info.limits = limits_of(info.model, info.limits);
  if (motors != 6) info.limits.torque = 0;
  double box[6] = {};
  hd.hdGetDoublev(hd::kUsableWorkspace, box);
  info.least = Vec3{static_cast<float>(box[0]), static_cast<float>(box[1]), static_cast<float>(box[2])} * 1e-3f;
  info.most = Vec3{static_cast<float>(box[3]), static_cast<float>(box[4]), static_cast<float>(box[5])} * 1e-3f;
  drain(hd);
  for (const hd::Enum what : {hd::kForceOutput, hd::kForceClamping, hd::kForceLimit, hd::kForceRamping}) hd.hdEnable(what);
  if (!hd.hdIsEnabled(hd::kForceOutput)) {
    why = "force output cannot be enabled";
    return false;
  }
  drain(hd);
  return true;
}

bool start(void* self, const ArmCallback& callback, std::string& why) {
  Touch& t = *static_cast<Touch*>(self);
  t.callback = callback;
  t.stopping = false, t.stopped = false;
  drain(t.hd);
  t.hd.hdSetSchedulerRate(1000);
  drain(t.hd);  // a refused rate is not an error: the servo measures its own periods
  t.scheduled = t.hd.hdScheduleAsynchronous(serve_both, self, hd::kPriority);
  t.hd.hdStartScheduler();
  const hd::ErrorInfo e = t.hd.hdGetError();
  if (e.code != hd::kSuccess) {
    why = "the driver's 1 kHz timer did not start: " + text(t.hd.hdGetErrorString(e.code));
    t.hd.hdStopScheduler();
    t.hd.hdUnschedule(t.scheduled);
    return false;
  }
  t.running = true;
  return true;
}

void stop(void* self) {
  Touch& t = *static_cast<Touch*>(self);
  if (!t.running) return;
  t.stopping = true;
  // Ten milliseconds reduce 3.3 N to zero; do not wait for a library that no longer calls back.
  for (int k = 0; k < 50 && !t.stopped.load(std::memory_order_acquire); ++k) std::this_thread::sleep_for(1ms);
  if (!t.stopped) switch_off(t);
  t.hd.hdStopScheduler();
  t.hd.hdUnschedule(t.scheduled);
  t.running = false;
}

ArmStatus status(void* self, size_t which) {
  const Arm& a = static_cast<Touch*>(self)->arm[which];
  return {a.ready.load(std::memory_order_relaxed), a.error.load(std::memory_order_relaxed),
          a.errors.load(std::memory_order_relaxed), a.steps.load(std::memory_order_relaxed)};
}

std::string error_text(void* self, uint32_t error) { return text(static_cast<Touch*>(self)->hd.hdGetErrorString(error)); }

void close(void* self) {
  Touch* t = static_cast<Touch*>(self);
  stop(self);
  for (Arm& a : t->arm)
    if (a.handle != hd::kNoDevice) t->hd.hdDisableDevice(a.handle);
  delete t;
}

}  // namespace

ArmPort open_touch(const TouchOptions& options, std::vector<std::string>& messages) {
  ArmPort port;
  port.kind = "touch";
  hd::Library hd;
  if (!load(options, hd, messages)) return port;
  auto touch = std::make_unique<Touch>();
  touch->hd = hd;
  std::array<std::string, 2> why;
  for (size_t k = 0; k < 2; ++k) {  // all of them before the scheduler starts
    touch->arm[k].handle = open_arm(hd, options.name[k].c_str(), touch->arm[0].handle, options.retries, why[k]);
    port.arm[k].name = options.name[k];
  }
  if (touch->arm[0].handle == hd::kNoDevice && touch->arm[1].handle == hd::kNoDevice) {
    std::string none;
    touch->arm[0].handle = open_arm(hd, nullptr, hd::kNoDevice, options.retries, none);
    port.arm[0].name = "default device";
  }
  for (size_t k = 0; k < 2; ++k) {
    ArmInfo& info = port.arm[k];
    if (touch->arm[k].handle == hd::kNoDevice) {
      messages.push_back("touch: no " + std::string(k == 0 ? "right" : "left") + " device (\"" + options.name[k] +
                         "\"): " + why[k]);
      continue;
    }
    if (!prepare(hd, touch->arm[k].handle, info, why[k])) {
      messages.push_back("touch: \"" + info.name + "\" cannot be used: " + why[k]);
      hd.hdDisableDevice(touch->arm[k].handle);
      touch->arm[k].handle = hd::kNoDevice;
      continue;
    }
    info.present = true;
    touch->arm[k].limits = info.limits;
  }
  if (!port.arm[0].present && !port.arm[1].present) return port;
  port.self = touch.release();
  port.start = start, port.stop = stop, port.status = status, port.error_text = error_text, port.close = close;
  return port;
}

}  // namespace catgut
