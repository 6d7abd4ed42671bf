// SPDX-License-Identifier: Apache-2.0
// haptic: two measurements of a rendering method, on a one-dimensional arm that reads its position in steps and moves late.
// Z-width (Colgate and Brown 1994): the walls, by stiffness and damping, that stay passive under every hand. Transparency
// (Lawrence 1993): how much of the impedance of a wall, a needle or a thread reaches the hand, by frequency. `catgut bench
// haptics` prints and plots both; tests/haptic checks them. Both call the code that drives the arms.
#pragma once
#include <cstdint>
#include <vector>

#include "haptic/servo.h"

namespace catgut {

enum class WallMethod : uint8_t {
  coupling,  // virtual coupling: a spring and a damper at 1 kHz to the tool's position in the last frame
  patch,     // ForcePatch evaluated at 1 kHz, without any limit
  chain,     // the same through servo_step: minimum damping, limits, energy account
};
const char* wall_method_name(WallMethod m);

// A wall of tissue behind the coupling, of which the hand feels `stiffness` and `damping` in all.
struct WallCase {
  WallMethod method{};
  float stiffness = 300, damping = 0;  // [N/m], [N s/m]
  float rate = 960;                    // [1/s] of the physics, which is heard one period later
  float delay = 0.002f;                // [s] from a call of the servo to the motors
  float encoder = 5.5e-5f;             // [m] step of the position (Touch)
};
struct WallResult {
  float energy = 0;  // [J] to the hand: of the motors, less what the arm's own damping takes; the worst of all hands
  float swing = 0;   // [m] peak to peak while the hand holds still
};
// Hands of 0.05 to 0.3 kg and 50 to 800 N/m press the wall, hold and let go.
WallResult press_wall(const WallCase& c);
// Criterion H3: at most 0.5 mJ and 0.2 mm.
bool is_passive(const WallResult& r);
// [N/m] the largest stiffness on a grid of `step` up to `most` below which every wall is passive; 0: none.
float z_width(WallCase c, float step, float most);

enum class Environment : uint8_t { wall, needle, thread };
const char* environment_name(Environment e);

struct SweepCase {
  Environment environment{};
  float rate = 960, delay = 0.002f, encoder = 5.5e-5f;
  float amplitude = 0.001f;  // [m] of the hand about its working point
};
struct SweepPoint {
  float hz = 0;
  float gain = 0;       // rendered impedance over the environment's, amplitude at hz
  float phase = 0;      // [rad] of the same; negative: the force comes late
  float rms_error = 0;  // [N] between the forces, at the same instant
  float rms = 0;        // [N] of the environment's, about its mean
};
// The hand moves as a sine of each frequency; its force is compared with the environment's at the same position.
std::vector<SweepPoint> sweep(const SweepCase& c, const std::vector<float>& hz);

}  // namespace catgut
