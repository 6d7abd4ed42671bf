// SPDX-License-Identifier: Apache-2.0
// runtime: two haptic arms in a run. Ties the driver (device/arm), the servo (haptic/servo) and the physics together: the
// servo's millisecond runs in the driver's thread, the physics publishes a patch a tick and takes the newest poses, and they
// meet at exchange/latest alone: no lock, no allocation and no logging on the servo's side. What went wrong there is a bit or a
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

// Physics under arms: more ticks with fewer substeps each (of the same length), and the coupling that an arm can render.
constexpr int kHapticParts = 16;  // ticks in the time of one of the scene's, where its substeps can be shared out: 960 Hz
constexpr float kHapticStiffness =
    300;  // [N/m] between hand and tool (our choice; CHAI3D allows at most 400 on a Touch, docs/references.md)
void prepare_for_arms(SceneSpec& scene);

struct HapticsOptions {
  uint64_t (*clock)() = nullptr;  // null: wall_ns(); tests hand in their own
  bool ratchet = true;            // the stylus' first button closes the jaw and, pressed again, opens it; else it is held
  bool force = true;              // false: arms move tools and feel nothing
  std::string log;                // file to which every millisecond is written (CSV, see kHapticsLogHead); empty: none
  std::map<std::string, ArmPlace> place;  // by serial number; an arm that is not in it: the middle of its workspace, 1:1
};
// Where the workspace of arm k lies in a scene whose field has its middle at `focus` [m].
Workspace workspace_of(const ArmInfo& arm, size_t k, Vec3 focus, const std::map<std::string, ArmPlace>& places);

// How regularly the servo of one arm ran, in [us]: counts per 10 us, the last one for all that is longer.
struct ServoTimes {
  std::array<uint64_t, 512> period{}, work{};
  uint64_t steps = 0;
};
// [us] below which `part` (0..1) of the counts lie.
double quantile_us(const std::array<uint64_t, 512>& counts, double part);

// Columns of the log: seconds on the servo's clock, arm (0 right, 1 left), position [m] and rotation (xyzw) of the stylus in
// the arm's frame, tick and age [s] of the patch, its force [N] and the trace of its stiffness [N/m] (world), then three forces
// in the arm's frame [N]: wanted by the patch, allowed by the limits, written to the motors; faults (haptic/limiter, as a
// number) and the state of engagement (0 off, 1 waiting, 2 rising, 3 on).
constexpr const char* kHapticsLogHead =
    "t_s,arm,x,y,z,qx,qy,qz,qw,patch_tick,patch_age_s,patch_fx,patch_fy,patch_fz,stiffness_trace,wanted_x,wanted_y,wanted_z,"
    "allowed_x,allowed_y,allowed_z,written_x,written_y,written_z,faults,engaged";

// What a user who holds an arm may want to see of it.
struct ArmView {
  bool here = false;          // samples come
  bool felt = false;          // force is let in
  float force = 0, most = 0;  // [N] written now; what the arm may give
  const char* off = "";       // why no force is felt; empty: it is
};

class Haptics {
 public:
  // Takes the port over and starts its servo. `focus` [m] is where the workspaces' middle goes.
  Haptics(ArmPort port, const PictureModel& picture, const HapticsOptions& options);
  ~Haptics();
  Haptics(const Haptics&) = delete;
  Haptics& operator=(const Haptics&) = delete;

  bool present(size_t k) const;
  const ServoOptions& servo(size_t k) const;

  // Of the thread that runs the physics.
  void publish(size_t k, const ForcePatch& patch, uint32_t epoch, float speed);  // speed: of real time
  // Nothing is to be felt, and that is meant: someone else moves the tool, or time does not run as fast as the hand's.
  void rest(size_t k, uint32_t epoch);
  ToolInput hand(size_t k);  // the newest; not connected when no sample came for 20 ms
  // What happened to arms and servo since the last call, a line each.
  std::vector<std::string> news();

  ArmView view(size_t k, const char* off) const;  // off: why the run itself gives no force, or ""; any thread
  ServoTimes times(size_t k) const;               // valid after stop()
  void stop();                                    // force off, no more callbacks

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

// What the LimiterFault bits in `faults` that are not in `reported` mean, a line each; they are in `reported` afterwards.
std::vector<std::string> new_faults(uint32_t faults, uint32_t& messages);

// Which arms, as people write it: DRIVER[:WHERE] of device/drivers ("touch", "bridge:10.0.0.2"); "paper" or
// "paper:DRIVER[:WHERE]": the same arms with the paper's spring, the Touch's when none is named; "off" or nothing: none.
struct ArmChoice {
  std::string driver, where;
  bool as_paper = false;
};
ArmChoice read_arm_choice(const std::string& text);  // throws InputError for a word that is no driver
// `reported` gets a line for what is missing. No driver: no arms.
ArmPort open_arms(const ArmChoice& choice, std::vector<std::string>& messages);

}  // namespace catgut
