// SPDX-License-Identifier: Apache-2.0
// runtime: two haptic devices in a run. Connects the backend (device/arm), the servo (haptic/servo) and the physics. The
// servo's millisecond runs in the backend's thread; the physics publishes a patch per tick and takes the newest poses. They
// share only exchange/latest: no lock, no allocation and no logging on the servo's side. A fault there is a bit or a
// number, and becomes a line here, reported once.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "device/arm.h"
#include "exchange/force_patch.h"
#include "exchange/picture.h"
#include "exchange/tool_input.h"
#include "haptic/servo.h"
#include "procedure/arm_places.h"
#include "sim/scene.h"

namespace catgut {

// Physics with devices: more ticks with fewer substeps each (of the same length), and a coupling that a device can render.
constexpr int kHapticParts = 16;  // ticks per tick of the scene, if its substeps are divisible: 960 Hz
constexpr float kHapticStiffness =
    300;  // [N/m] between hand and tool (chosen; CHAI3D allows at most 400 on a Touch, docs/references.md)
void prepare_for_arms(SceneSpec& scene);

struct HapticsOptions {
  uint64_t (*clock)() = nullptr;  // null: wall_ns(); tests pass their own
  bool ratchet = true;            // the stylus' first button toggles the jaw; false: the jaw is closed while it is pressed
  bool force = true;              // false: devices move tools without force
  std::array<float, 2> strength{1, 1};  // gain of the force in the right hand and in the left (kLeastStrength .. kMostStrength)
  std::string log;                      // file to which every millisecond is written (CSV, see kHapticsLogHead); empty: none
  std::map<std::string, ArmPlace> place;  // by arm_key; a device that is not in it: the center of its workspace, 1:1
};
// Serial number of device k; of one that reports none, its place in the driver's list.
std::string arm_key(const ArmInfo& arm, size_t k);
// In which hand each device is, 0 right, 1 left: as saved by `catgut devices --register`, else as the driver lists them.
std::array<size_t, 2> sides_of(const std::array<ArmInfo, 2>& arm, const std::map<std::string, ArmPlace>& places);
// The workspace of device k, which is in the right hand or in the left (side 1), in a scene whose field has its center at
// `focus` [m].
Workspace workspace_of(const ArmInfo& arm, size_t k, size_t side, Vec3 focus, const std::map<std::string, ArmPlace>& places);

// Timing of one device's servo, in [us]: counts per 10 us, the last one for all longer periods.
struct ServoTimes {
  std::array<uint64_t, 512> period{}, work{};
  uint64_t steps = 0;
};
// [us] percentile: `part` (0..1) of the counts lie below.
double quantile_us(const std::array<uint64_t, 512>& counts, double part);

// Columns of the log: seconds on the servo's clock, arm (0 right, 1 left), position [m] and rotation (xyzw) of the stylus in
// the device's frame, tick and age [s] of the patch, its force [N] and the trace of its stiffness [N/m] (world), then three
// forces in the device's frame [N]: wanted by the patch, allowed by the limits, written to the motors; faults (haptic/limiter,
// as a number) and the state of engagement (0 off, 1 waiting, 2 rising, 3 on). Then torque [N m] and grip [N], wanted and
// written, the jaw (0 closed to 1 open, -1 none) and the user's gain.
constexpr const char* kHapticsLogHead =
    "t_s,arm,x,y,z,qx,qy,qz,qw,patch_tick,patch_age_s,patch_fx,patch_fy,patch_fz,stiffness_trace,wanted_x,wanted_y,wanted_z,"
    "allowed_x,allowed_y,allowed_z,written_x,written_y,written_z,faults,engaged,wanted_tx,wanted_ty,wanted_tz,written_tx,"
    "written_ty,written_tz,wanted_grip,written_grip,jaw,gain";

// Status of a device for display.
struct ArmView {
  size_t side = 0;            // 0 right, 1 left
  bool here = false;          // samples arrive
  bool felt = false;          // force is enabled
  float force = 0, most = 0;  // [N] written now; limit of the device
  float peak = -1;            // [N] largest written since the start; negative: there is no such device
  float strength = 1;         // the user's gain
  const char* off = "";       // why the force is off; empty: it is on
};

class Haptics {
 public:
  // Takes ownership of the port and starts its servo. `focus` [m]: target of the workspaces' center.
  Haptics(ArmPort port, const PictureModel& picture, const HapticsOptions& options);
  ~Haptics();
  Haptics(const Haptics&) = delete;
  Haptics& operator=(const Haptics&) = delete;

  bool present(size_t k) const;
  size_t side(size_t k) const;  // in which hand the device is: 0 right, 1 left
  const ServoOptions& servo(size_t k) const;

  void set_strength(size_t side, float strength);  // of the device in that hand; clamped; callable from any thread

  // Owned by the physics thread.
  void publish(size_t k, const ForcePatch& patch, uint32_t epoch, float speed);  // speed: of real time
  // Deliberately without force: something else moves the tool, or time runs slower than the hand.
  void rest(size_t k, uint32_t epoch);
  ToolInput hand(size_t k);  // the newest; not connected after 20 ms without a sample
  // Events of devices and servo since the last call, a line each.
  std::vector<std::string> news();

  ArmView view(size_t k, const char* off) const;  // off: why the run itself gives no force, or ""; callable from any thread
  ServoTimes times(size_t k) const;               // valid after stop()
  void stop();                                    // force off, no more callbacks

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

// Lines for the LimiterFault bits in `faults` that are not yet in `reported`; adds them to `reported`.
std::vector<std::string> new_faults(uint32_t faults, uint32_t& messages);

// Device selection on the command line: BACKEND[:WHERE] of device/drivers ("touch", "bridge:10.0.0.2"); "paper" or
// "paper:BACKEND[:WHERE]": the same devices with the paper's spring, default Touch; "off" or empty: none.
struct ArmChoice {
  std::string driver, where;
  bool as_paper = false;
};
ArmChoice read_arm_choice(const std::string& text);  // throws InputError for an unknown backend
// `reported` receives a line per problem. No backend: no devices.
ArmPort open_arms(const ArmChoice& choice, std::vector<std::string>& messages);

}  // namespace catgut
