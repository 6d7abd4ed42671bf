// SPDX-License-Identifier: Apache-2.0
// validation: a body of tissue with a tool in a hand, a free needle and a thread across it, and random events. What happens is
// judged from outside: from positions, the drawn outline of the bodies and the wall's faces.
#pragma once
#include <functional>
#include <memory>
#include <vector>

#include "core/random.h"
#include "physical/physical.h"
#include "validation/knot_scenes.h"
#include "validation/skin.h"

namespace catgut::validation {

// tube: one open bowel end. ends: two of them face to face. pads: two lips of skin. tubes: one tube within the other, as after
// a prolapse was cut. bowel: with haustra, from the generator. organ: a bent pouch, imported from a mesh file.
enum class ContactBody : uint8_t { tube, ends, pads, tubes, bowel, organ };
constexpr int kContactBodies = 6;
const char* name_of(ContactBody body);

// Pairs that may overlap.
enum ContactPair : uint8_t { tool_wall, needle_wall, thread_wall, tool_needle, tool_thread, needle_thread, kContactPairs };
const char* name_of(ContactPair pair);

constexpr float kMostOverlap = 0.3e-3f;  // [m]

struct ContactBench {
  physical::Model model;
  physical::State state, rest;
  std::unique_ptr<physical::Scratch> scratch;
  std::unique_ptr<Skin> skin;  // of the wall when it was looked at
  Jobs jobs{1};
  std::vector<physical::HandTarget> target;  // tool, needle
  std::vector<thread::Pull> pull;
  std::vector<thread::Hold> hold;
  std::function<void()> watch;  // called after each step
  Random random;
  uint64_t seed = 0;
  int events = 0;
  // Of the last event: overlap [m]; how often one was seen through the other.
  float deepest[kContactPairs] = {};
  int passed[kContactPairs] = {};
  float fastest = 0, strongest = 0;  // [m/s] of a body, [N] on a body, over all events
  float tightest = 0;                // [N] of the thread
  explicit ContactBench(uint64_t s, ContactBody body = ContactBody::tube);
  // 80 ms: the tool pushes and perhaps drags, the needle falls or is thrown, the thread's ends are pulled.
  void event(float max_force, float max_speed);

 private:
  struct Bounds {              // of the faces
    std::vector<Vec3> center;  // [m]
    std::vector<float> radius;
  };
  Vec3 direction();
  void bound(const wall::State& ws, Bounds& bounds) const;
  bool passes_wall(const wall::State& ws, const Bounds& bounds, Vec3 p, Vec3 q) const;
  // [m] by which a ball lies in the wall, whose skin follows it; more than its radius where the center is inside.
  float wall_overlap(const wall::State& ws, const Bounds& bounds, Vec3 p, float r) const;
  float skin_distance(const wall::State& ws, const Bounds& bounds, Vec3 p) const;  // [m] 4 mm at most
  void see_wall();
  // The tool at this pose touches neither wall, needle nor thread.
  bool clear(const Pose& tool, float opening);
  void forget();
  void step();
  void look();
  Bounds now;
  Vec3 low, high, middle;      // [m] of the wall at rest, of its free part
  std::vector<uint32_t> free;  // faces that nothing holds
};

// Two strands hooked into each other, each a bight of 15 mm, pulled apart at random: with up to `max_force` [N] or at up to
// `max_speed` [m/s]. Returns how often a segment passed through another; nearest: of both strands' centerlines, in diameters.
int pull_hooked_bights(uint64_t seed, float max_force, float max_speed, float& nearest);

}  // namespace catgut::validation
