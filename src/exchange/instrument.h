// SPDX-License-Identifier: Apache-2.0
// exchange/instrument: data of an instrument shared by rooms on both sides of the simulation: its capabilities, its location
// and its outline. The models themselves (mass, jaws, grip limits) are in src/instrument.
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
  kAbsorb = 1u << 8,  // takes up blood, and stops bleeding by pressure
};
// "hold_needle", ...; "" unless it is exactly one capability.
const char* capability_name(uint32_t capability);

enum class InstrumentPlace : uint32_t {
  tray,    // not in use: drawn on its tray, no contact
  hand,    // follows a hand
  parked,  // closed on tissue without a hand: loaded by its weight, or by the force given in the scene
};

// Of an electrosurgical pen.
enum class PenMode : uint8_t { off, cut, coagulate };

enum class Held : uint8_t { nothing, needle, thread, tissue };

constexpr uint8_t kNoHand = 0xff;

// Data to draw an instrument and to name it in a tray list. Constant during a run.
struct InstrumentPicture {
  struct Rod {
    Vec3 a, b;         // [m] ends of the axis, tool frame
    float radius = 0;  // [m]
  };
  std::string name;   // in this scene, unique: "left_clamp"
  std::string kind;   // the model's name: "allis"
  std::string title;  // for people: "Allis clamp"
  uint32_t capabilities = 0;
  std::vector<Rod> outline;  // collision capsules; drawn for a kind without a shape in the renderer
  bool can(uint32_t capability) const { return (capabilities & capability) == capability; }
};

}  // namespace catgut
