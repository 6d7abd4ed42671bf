// SPDX-License-Identifier: Apache-2.0
// solver/substep: THE loop. One call advances everything soft, rigid and thin by one substep of XPBD (Macklin et al. 2016;
// small steps: Macklin et al. 2019). Multipliers are cleared here and nowhere else, at the start of a substep, and
// accumulate over its sweeps: lambda / h^2 at its end is the force in newtons.
#pragma once
#include <vector>

#include "core/jobs.h"
#include "core/profile.h"
#include "solver/attach.h"
#include "solver/collide.h"
#include "solver/contact.h"
#include "solver/shape_match.h"
#include "solver/tethers.h"
#include "solver/thread.h"
#include "solver/volume.h"

namespace catgut {

// Constant during a run.
struct SolverModel {
  uint32_t tissue = 0;     // particles of soft bodies; thread particles follow
  uint32_t count = 0;      // all particles
  Column<float> inv_mass;  // [1/kg] per particle, 0: pinned
  ShapeModel shape;
  VolumeModel volume;
  TissueCollision collision;
  std::vector<StrandModel> strand;    // one per suture; their slots follow those of the tissue, strand after strand
  std::vector<NeedleArc> needle_arc;  // one per suture
  std::vector<RigidModel> body;       // instruments, then the needle of every suture
  float h = 1.0f / 480;               // [s] substep
  Vec3 gravity{0, -9.81f, 0};         // [m/s^2] on thread and needle
  Vec3 tissue_gravity{0, -9.81f, 0};  // [m/s^2] on tissue: divided by the mass scaling, so that its weight is correct
  int shape_sweeps = 1, self_sweeps = 1, contact_sweeps = 1, volume_sweeps = 1, rigid_sweeps = 4;
  float pin_tolerance = 3e-5f;    // [m] a tenth of the thread's diameter
  int pin_sweeps = 4;             // tethers of a seam share tissue with their neighbors: one sweep would leave 1 mm of error
  float shape_stiffness = 0.65f;  // s of solve_shape_particles at this h
  float shape_relaxation = 1;
  bool use_volume = false;
  float volume_compliance = 0;
  float damping = 0, thread_damping = 0, body_damping = 20;  // [1/s]
  Friction friction;
  float tool_force = 8;  // [N] maximum force between two tools
  float ground = -1e9f;  // [m] height of the drape
  // Instruments are the first bodies; the needle of every suture follows.
  uint32_t instruments() const { return static_cast<uint32_t>(body.size() - strand.size()); }
  uint32_t needle_body(size_t suture) const { return instruments() + static_cast<uint32_t>(suture); }
  // The suture of a thread slot.
  uint32_t strand_of(uint32_t slot) const {
    uint32_t k = 0;
    while (!strand[k].has(slot)) ++k;
    return k;
  }
};

struct SolverState {
  Column<Vec4> x, v;          // position [m], velocity [m/s]
  ClusterRotations rotation;  // warm start of the polar decompositions
  std::vector<RigidBody> body;
  std::vector<Strand> strand;                  // one per suture
  std::vector<Weld> weld;                      // row i: instrument i to its hand; after them needle to instrument
  std::vector<Attachment> attach;              // tissue to needle tip, to a jaw, to its closing target
  std::vector<Tether> pin;                     // tissue to tissue: seams, baked sutures
  std::vector<NeedleTrackConstraint> channel;  // needles in their tracks
  std::vector<uint8_t> body_collides;          // per body
  std::vector<Vec3> body_force;                // [N] external force per body: the weight of a parked instrument
  Column<Vec4> pair_origin;                    // [m] per tissue particle: where its contact pairs were last searched
};

// Working memory and caches: never saved, never hashed. All of it is written in the same tick before it is read, or
// rebuilt from the state after a load.
struct SolverScratch {
  Column<Vec4> prev;
  ShapeScratch shape;
  std::vector<float> volume_lambda;
  std::vector<ThreadScratch> thread;  // one per strand
  TetherGraph web;
  std::vector<TetherSpan> pin_span;
  Candidates candidates;
  std::vector<BodyContact> on_body;   // contact impulses on bodies in the last substep
  std::vector<int32_t> node_of_slot;  // per thread slot (relative to the first strand's first)
  std::vector<uint8_t> locked;        // likewise
  uint32_t contacts = 0;              // in contact in the last substep
};

SolverState make_solver_state(const SolverModel& model, std::span<const Vec3> position);
void prepare_scratch(const SolverModel& model, SolverScratch& scratch);
// Once per tick, before anything else: bounding boxes of the tissue, for all searches.
void find_boxes(const SolverModel& model, const SolverState& state, SolverScratch& scratch, Jobs& jobs, StageTimes* times);
// Once per tick, before its substeps, in which no tether is added or removed: contact candidates, and tethers that share
// tissue. Reads the boxes. margin [m]: maximum relative motion in a tick.
void find_candidates(const SolverModel& model, const SolverState& state, SolverScratch& scratch, float margin,
                     StageTimes* times);
// The same of tools with tissue and with each other alone.
void find_tool_candidates(const SolverModel& model, const SolverState& state, SolverScratch& scratch, float margin,
                          StageTimes* times);
void substep(const SolverModel& model, SolverState& state, SolverScratch& scratch, Jobs& jobs, StageTimes* times);

// [m/N] compliance per particle equivalent to a stiffness s in (0, 1] at substep h, and back (XPBD: s = w / (w + alpha/h^2)).
float stiffness_at(float stiffness, float h_reference, float h);

}  // namespace catgut
