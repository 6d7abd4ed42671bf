// SPDX-License-Identifier: Apache-2.0
// exchange/instrument: what rooms on both sides of the simulation know of an instrument: what it can do, where it is, what it
// looks like in outline. The models themselves (mass, jaws, grip limits) are in src/instrument.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "core/math.h"

namespace catgut {

// What an instrument can do, as bits.
enum Capability : uint32_t {
  kHoldNeedle = 1u << 0,
  kHoldThread = 1u << 1,
  kHoldTissue = 1u << 2,
  kClamp = 1u << 3,  // a ratchet keeps the jaws closed: the instrument may be parked on what it holds
  kCutThread = 1u << 4,
  kCutTissue = 1u << 5,
  kCauterize = 1u << 6,
  kRetract = 1u << 7,
};
// "hold_needle", ...; "" for anything that is not exactly one capability.
const char* capability_name(uint32_t capability);

enum class InstrumentPlace : uint32_t {
  tray,    // not in use: drawn on its tray, touches nothing
  hand,    // follows a hand
  parked,  // closed on what it holds, no hand on it: hangs there by its weight, or pulls with the force the scene gives
};

enum class Held : uint8_t { nothing, needle, thread, tissue };

constexpr uint8_t kNoHand = 0xff;

// What a picture needs to draw an instrument and a tray list needs to name it. Constant during a run.
struct InstrumentPicture {
  struct Rod {
    Vec3 a, b;         // [m] ends of the axis, tool frame
    float radius = 0;  // [m]
  };
  std::string name;   // in this scene, unique: "left_clamp"
  std::string kind;   // the model's name: "allis"
  std::string title;  // for people: "Allis clamp"
  uint32_t capabilities = 0;
  std::vector<Rod> outline;  // what it collides with; drawn for a kind that the renderer has no shape for
  bool can(uint32_t capability) const { return (capabilities & capability) == capability; }
};

}  // namespace catgut
