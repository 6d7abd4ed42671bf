// exchange: the state of the operating field after a tick, for the picture, the surgeon, the host and (later) assessment.
// Self-contained: plain values, no pointers into the simulation.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "core/math.h"
#include "exchange/event.h"

namespace catgut {

enum class Held : uint8_t { nothing, needle, thread };

struct ToolView {
  Pose pose;      // where the simulated tool is (tissue and thread may hold it back from the hand)
  Pose hand;      // where the hand is
  float jaw = 1;  // 0 closed .. 1 open
  Held held = Held::nothing;
  float held_at = 0;       // needle: place on the arc, 0 swage .. 1 tip
  uint32_t held_slot = 0;  // thread: particle slot
  Vec3 force;              // [N] on the hand
  Vec3 torque;             // [N m] on the hand, about the tool's origin
};

struct NeedleView {
  Pose pose;  // frame at the circle's centre: point(phi) = radius (cos phi, sin phi, 0), phi from 0 (swage) to arc (tip)
  bool in_tissue = false;
  uint32_t bite = 0;  // the bite being made, valid while in_tissue
};

struct SuturePointView {
  Vec3 position;  // [m]
  uint32_t bite = 0;
  bool exit = false;                           // the exit end of its bite, else the entry
  uint32_t anchored = 0;                       // slot of the thread particle locked to it
  float tension_needle = 0, tension_free = 0;  // [N] on its two sides
};

struct BiteView {
  Vec3 entry, exit;  // [m] where they are now, carried by the tissue
  float depth = 0;   // [m] deepest the tip went below the surface
  bool has_exit = false, complete = false;
};

struct Snapshot {
  uint64_t tick = 0;
  double time_s = 0;
  std::vector<Vec3> particle;          // [m] tissue particles of every body, then thread slots
  std::vector<Quat> rotation;          // per tissue particle: rotation of the cluster centred on it
  std::vector<uint32_t> thread_order;  // particle indices from the free end to the needle
  std::vector<float> thread_tension;   // [N] per pair of thread_order, size thread_order.size() - 1
  std::array<ToolView, 2> tool;
  NeedleView needle;
  std::vector<SuturePointView> suture_point;
  std::vector<BiteView> bite;
  float opening_area = 0;    // [m^2] of the rim that is being closed
  float closure = 0;         // 0 open .. 1 at the anvil
  std::vector<Event> event;  // of this tick
};

}  // namespace catgut
