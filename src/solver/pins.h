// solver/pins: ropes between two points of tissue. A settled stitch leaves some, and a long procedure has hundreds of them that
// pull at the same tissue, so they are solved among themselves, without the particles that they hang on.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "solver/attach.h"
#include "solver/particles.h"

namespace catgut {

// Who made it: a technique's closure plan, a settled stitch, or one for its passage through a wall, which draws the wall in.
enum class PinOwner : uint32_t { plan, stitch, passage };

// Two points of tissue that thread holds together: never further apart than `length`. A rope: it does not push.
struct TissuePin {
  TissuePoint a, b;
  float length = 0;      // [m]
  float compliance = 0;  // [m/N]
  float lambda = 0;      // [N s^2] of the last substep; negative: it pulls
  PinOwner owner = PinOwner::plan;
};

// One XPBD step of a pin (Macklin et al. 2016) on top of what its lambda says that it pulls already.
void solve_pin(TissuePin& pin, Vec4* x, const float* w, float h);

// What weave finds out about the pins of a tick. The span of a pin is the vector from its b to its a.
struct PinWeb {
  struct Strand {
    uint32_t pin = 0;
    float coupling = 0;  // [1/kg] so much does the span of that pin move along each unit of this one's pull
  };
  std::vector<uint32_t> first;  // pin i moves the spans of strand[first[i]] .. strand[first[i + 1]], its own the first of them
  std::vector<Strand> strand;
  // Pin i as one sum over the particles of both its points, row[i] .. row[i + 1]: see PinRow in pins.cpp.
  std::vector<uint32_t> row, particle;
  std::vector<float> share, move;
  std::vector<float> length, compliance;  // [m], [m/N], by pin
  std::vector<TissuePoint> point;         // of all pins, as they were when the strands were found
  // Working memory of weave: pins by particle and their shares there, couplings by pin and whether they are listed.
  std::vector<uint32_t> start, pin;
  std::vector<float> weight, by_pin;
  std::vector<uint8_t> listed;
};
// Brings the web up to date: to be called whenever pins may have changed. w: inverse mass [1/kg] of the particles, which never
// changes.
void weave(std::span<const TissuePin> pin, const float* w, uint32_t particles, PinWeb& web);

// Working memory of solve_pins: all that it reads and writes of a pin while it solves.
struct PinSpan {
  Vec4 span;                    // [m] as it is with all pulls so far
  Vec4 pull;                    // [N s^2] all that it pulls, still to be given to the particles
  float length = 0, alpha = 0;  // [m], [1/kg]
  float give = 0;               // [kg] lambda of a pull that makes it shorter by a metre
  float lambda = 0;             // [N s^2]
};
// Solves all pins from no pull at all: `sweeps` times solve_pin of each in turn. From the second sweep on, pins that are as
// they should be to within `tolerance` [m] are left alone; in the first, ropes would twitch. Pins see each other through the
// web and give all that they pull to their particles at the end, so a sweep costs what pins that pull have neighbours, however
// many particles they hang on. (Gauss-Seidel on the multipliers, as Catto, "Iterative Dynamics with Temporal Coherence", 2005,
// has it for contacts.) web: as weave left it for these pins.
void solve_pins(std::span<TissuePin> pin, const PinWeb& web, Vec4* x, float h, int sweeps, float tolerance,
                std::vector<PinSpan>& work);

}  // namespace catgut
