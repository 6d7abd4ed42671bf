// SPDX-License-Identifier: Apache-2.0
// physical: a physical thread (src/thread) through a physical wall (src/wall). Reads Hands; writes State. It contains no
// technique: the thread's tension in holes of the wall closes wounds, and friction holds them. docs/physical.md.
//
// Units: SI, float32. Frame: the scene's. One step is the wall's step (1 ms), in which the thread does its substeps on the
// moving holes ("consistent multi-rate", wall/points.h). Several organs are pieces of one wall; several threads are strands of
// one thread::State, separated by broken segments. A step allocates nothing. Its bits do not depend on the number of workers.
#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "physical/body.h"
#include "physical/needle.h"
#include "physical/sleep.h"
#include "physical/surface.h"
#include "physical/tear.h"
#include "thread/thread.h"
#include "wall/contact.h"
#include "wall/cut.h"
#include "wall/points.h"

namespace catgut::physical {

// A hole in the wall. Its mouth stands off the surface by the thread's radius, so that the thread beside it can lie flat.
struct Hole {
  wall::Point place;    // zeta: -1 inner face .. 1 outer face
  bool within = false;  // from here to the next hole along the thread it runs within the wall
  float deepest = -2;   // zeta of the deepest point of a bite that begins here; -2: not known
  // Tearing (physical/tear). `place` moves with the tear; the slit leads from `made` to it.
  wall::Point made{};  // meaningful where torn > 0
  float torn = 0;      // [m]
  bool out = false;    // the bite has come out at the edge; the thread is no longer in it
  Vec3 load{};         // [N] on the bite that begins here, smoothed; once it tears, also at its other end
};

struct Model {
  wall::Model wall;
  thread::Settings thread;
  float surface_friction = 0.1f;  // thread on wall
  float lip_friction = 0.3f;      // wall on wall
  bool surface_contact = true;    // thread against the wall's surface
  bool lip_contact = true;        // wall against wall
  Surface surface;                // from make_surface
  BodiesModel bodies;             // rigid tools and needles
  NeedlesModel needles;
  TearModel tear;
  SleepModel sleep;
};

struct State {
  wall::State wall;
  thread::State thread;
  std::vector<Hole> hole;                    // Eyelet::point is an index of these
  std::vector<thread::SoftContact> contact;  // memory of thread on wall; `point` is meaningless between steps
  std::vector<wall::Contact> lip;            // memory of wall on wall
  Bodies bodies;
  std::vector<Needle> needle;
  Sleep sleep;                                 // of the thread's strands
  std::shared_ptr<const Surface> cut_surface;  // of a wall that was cut; follows from wall.topology.cut
};
inline const Surface& surface_of(const Model& m, const State& s) { return s.cut_surface ? *s.cut_surface : m.surface; }

// Loads and motions imposed in a step.
struct Hands {
  std::span<thread::Hold> holds;        // of thread nodes
  std::span<const thread::Pull> pulls;  // on thread nodes
  // A force on a point of the wall, such as forceps that hold an edge [N].
  struct WallPull {
    wall::Weights at;
    Vec3 force;
  };
  std::span<const WallPull> wall_pulls;
  std::span<const HandTarget> targets;  // of State::bodies, in their order
  thread::Plane* plane = nullptr;       // what the thread lies on
};

// Workspace: its contents never affect the result of a later step.
struct Scratch {
  wall::Scratch wall;
  thread::Stepper thread;
  wall::Coupling coupling;
  wall::ContactSolver lips;
  SurfaceSearch search;
  std::vector<wall::Point> point;
  std::vector<float> offset;
  std::vector<thread::SoftContact> contact;
  std::vector<Foot> foot;  // per contact
  std::vector<Vec3> moved;
  std::vector<Vec3> put;              // [m] per node: by landing
  std::vector<uint32_t> put_segment;  // segments whose nodes landing has put elsewhere
  float landing = 0;  // [m] largest distance, in the last step, from where the thread left a point to where the wall arrived
  std::vector<thread::SoftPoints::Tilt> tilt;
  BodiesScratch bodies;
  std::vector<thread::Hold> holds;  // those of the hands, then those of the bodies
  std::vector<wall::Mark> marks;    // of a pen (physical/excise)
  AwakeThread awake;
  explicit Scratch(const Model& model, const State& state);
};

// The model and state of a wall with a thread laid through its holes.
Model make_model(const wall::Wall& wall, const thread::Settings& settings);
// Position of a hole's mouth [m].
Vec3 mouth(const Model& model, const State& state, const Hole& hole);
float mouth_offset(const Model& model, const Hole& hole);  // [m] from the mid-surface along the director

// Removes links of the wall (wall/cut) between two steps. Bites, holes, grips and needles keep their material points.
wall::CutResult cut(const Model& model, State& state, Scratch& scratch, std::span<const wall::Mark> marks);
// After a load: everything that follows from the links. The scratch must be made after it.
void restore_cuts(const Model& model, State& state);

// Puts a body somewhere else, at rest: it forgets its contacts, and the thread forgets on which side of it it was.
void move_body(const Model& model, State& state, uint32_t body, const Pose& pose, float opening);

// Of all state.
uint64_t hash_state(const State& state);

void step(const Model& model, State& state, Scratch& scratch, const Hands& hands, Jobs& jobs);

}  // namespace catgut::physical
