// SPDX-License-Identifier: Apache-2.0
// physical/needle: a swaged curved needle through the wall. Its tip makes a hole where it presses on a face with the puncture
// force, cuts a channel within the wall, and leaves through the other face or the same one. In its channel the shaft is free
// along its curve, but for friction and the cutting force at the tip; across it carries load. The law is the same for a hand, a
// scripted surgeon and a falling needle. Reads the wall and the bodies' motion; writes channels, and rows for physical/body.
//
// Frame of the needle: origin at the center of mass of its arc, the circle in the xy plane; angle 0 at the swage, `arc` at the
// tip. The thread hangs on the swage by its last node: holes then follow the thread's order, entry before exit.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "physical/body.h"

namespace catgut::physical {

struct NeedleShape {
  float radius = 8.28e-3f;       // [m] of the circle
  float arc = kPi;               // [rad]
  float wire_radius = 0.33e-3f;  // [m]
  float taper = 2e-3f;           // [m] of the arc at the tip
  float mass = 2e-3f;            // [kg] simulated; a real one has about 0.1 g
};

// Forces between needle and tissue. The values for bowel are starting values; docs/references.md has the sources.
struct PunctureLaw {
  float puncture = 0.9f;         // [N] on the tip, for a wire of 0.66 mm; proportional to the diameter (Maloney et al.)
  float exit_share = 0.6f;       // of it, for a tip that leaves the tissue (Frick et al.: two peaks)
  float cutting = 0.2f;          // [N] at the tip within the tissue
  float friction = 45;           // [N/m] along the shaft in its channel
  float side_stiffness = 2000;   // [N/m] of a point of the channel against the tissue around it
  float most = 6;                // [N] load of such a point; beyond the strength of the channel it tears (physical/tear)
  float least_slope = 0.25f;     // cosine between needle and inward normal below which the tip slides off
  float tip_friction = 0.5f;     // of a tip that has not entered
  float swage_stiffness = 8000;  // [N/m] between swage and thread
  float swage_strength = 60;     // [N] no thread bears more
  float same_face = 1.5e-3f;     // [m] from the entry at which the tip can leave through the same face
};

struct NeedleModel {
  uint32_t body = 0;
  NeedleShape shape;
  Vec3 circle;  // [m] its center, needle frame
};
struct NeedlesModel {
  std::vector<NeedleModel> needle;
  PunctureLaw law;
  float thread_friction = 0.15f;  // of the thread in the holes
};

constexpr size_t kMaxPath = 24, kMaxChannels = 4;
constexpr float kPathStep = 0.8e-3f;  // [m] between points of a channel

// The path of the needle through tissue: material points from entry to exit, or to the tip.
struct Channel {
  std::array<wall::Point, kMaxPath> point;
  uint32_t count = 0;
  float entry_side = 1, exit_side = 0;                         // face: zeta +1 outer, -1 inner; exit 0: none yet
  uint32_t entry_hole = wall::kNone, exit_hole = wall::kNone;  // of State::hole, once thread runs through
  // Tearing (physical/tear): its points move across the needle. The slit of a mouth, entry or exit, leads from `made` to its
  // point.
  std::array<wall::Point, 2> made{};  // meaningful where torn > 0
  std::array<float, 2> torn{};        // [m]
  Vec3 load;                          // [N] of the needle on the tissue, across it, smoothed
};

// What happened in the last step, as bits.
enum NeedleEvent : uint32_t {
  kEntered = 1,     // the tip made a hole
  kLeft = 2,        // and another where it came out
  kWithdrawn = 4,   // the tip went back out: nothing remains
  kThreadIn = 8,    // the swage has passed the entry: an Eyelet
  kThreadOut = 16,  // and the exit: the bite is complete
  kTornOut = 32     // the shaft has left one of its channels sideways
};

struct Needle {
  uint32_t thread_node = wall::kNone;         // the last node of its strand; none: no thread
  std::array<Channel, kMaxChannels> channel;  // from the swage to the tip
  uint32_t channels = 0;
  bool inside = false;                  // the tip lies within tissue, at the end of the last channel
  wall::Point tip;                      // its material point while inside
  float entry_peak = 0, exit_peak = 0;  // [N] at the tip when it went in and out last
  uint32_t events = 0;
  // Of the step: the channel that the shaft has left, which is there no more, and its entry hole; rows at the tip.
  uint32_t torn = 0, torn_hole = wall::kNone;
  uint32_t tip_row = wall::kNone;
  uint32_t exit_row[2] = {wall::kNone, wall::kNone};
  wall::Point tip_on, exit_on[2];  // where they act
  Vec3 give;                       // [m] from the tip's material point to the tip, before it: by the tissue's elasticity
};

// A body and a needle of this shape. `body`: its index in BodiesModel.
BodyModel make_needle_body(const NeedleShape& shape);
NeedleModel make_needle(const NeedleShape& shape, uint32_t body);
Vec3 arc_point(const NeedleModel& needle, const Pose& pose, float angle);    // [m]
Vec3 arc_tangent(const NeedleModel& needle, const Pose& pose, float angle);  // toward the tip
inline Vec3 tip_of(const NeedleModel& n, const Pose& pose) { return arc_point(n, pose, n.shape.arc); }
inline Vec3 swage_of(const NeedleModel& n, const Pose& pose) { return arc_point(n, pose, 0); }
float puncture_force(const PunctureLaw& law, const NeedleShape& shape);  // [N]

// Stages of physical::step, in this order.
// Row::key of a point of a channel; 63: the tip.
inline uint64_t channel_key(uint32_t needle, uint32_t channel, uint32_t point) {
  return uint64_t{9} << 60 | uint64_t{needle} << 36 | (uint64_t{channel} * 64 + point);
}
// The material point at p, on the faces round that of `from` and of the same piece: another wall that touches it has none. off:
// [m] from p to it.
wall::Point locate(const wall::Model& wm, const wall::State& ws, const Surface& surface, BodiesScratch& k, Vec3 p,
                   const wall::Point& from, float& off);
// The shaft has left a channel sideways: kTornOut.
void leave_channel(Needle& needle, uint32_t channel);

void skip_channels(const NeedlesModel& model, const wall::Model& wm, const wall::State& ws, std::span<const Needle> needle,
                   Bodies& bodies);
void find_needle_rows(const NeedlesModel& model, const BodiesModel& bm, const wall::Model& wm, const wall::State& ws,
                      const Surface& surface, const thread::State& thread, const Bodies& bodies, std::span<Needle> needle,
                      float h, BodiesScratch& k);
// At the end of the step: punctures, and the channel follows the tip.
void advance_needles(const NeedlesModel& model, const wall::Model& wm, const wall::State& ws, const Surface& surface,
                     const Bodies& bodies, std::span<Needle> needle, float h, BodiesScratch& k);

}  // namespace catgut::physical
