// SPDX-License-Identifier: Apache-2.0
// validation: shared by the checks: where lines go, and small worlds to run the kernels in.
#pragma once
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "core/jobs.h"
#include "solver/substep.h"
#include "validation/validation.h"

namespace catgut::validation {

struct Lines {
  std::vector<ValidationLine> line;
  std::function<void(const ValidationLine&)> on_line;
  void add(const std::string& name, double expected, double got, double tolerance, const std::string& unit,
           const std::string& source);
};

// A thread whose first node, and optionally its last, is held by the world: only the thread's kernels and the time step.
// Without the substep's speed limit, so that published cases of meters and kilograms can run unchanged.
struct ThreadRig {
  StrandModel model;
  Strand thread;
  ThreadScratch scratch;
  Column<Vec4> x, v, prev;
  std::vector<float> inv_mass;
  std::vector<RigidModel> body_model;
  std::vector<RigidBody> body;
  float damping = 0;  // [1/s]

  ThreadRig(std::span<const Vec3> position, float spacing, float mass, bool hold_last);
  void step(float h);
};

// A whole solver world: tissue from `rest` in the given clusters, no thread, no gravity, no damping, no contact, no ground.
struct TissueWorld {
  SolverModel model;
  SolverState state;
  SolverScratch scratch;
  TissueWorld(std::span<const Vec3> rest, std::span<const float> mass, std::span<const std::vector<uint32_t>> cluster);
  void start(std::span<const Vec3> position);  // after the model is complete
  void run(double seconds, Jobs& jobs);
};

struct Block {
  std::vector<Vec3> position;
  std::vector<Tet> tet;
  std::vector<std::vector<uint32_t>> cluster;  // a single one with all particles
  int n = 0;
  uint32_t at(int i, int j, int k) const { return static_cast<uint32_t>((k * n + j) * n + i); }
};
// n x n x n particles, `spacing` apart, centered on the origin; five tetrahedra a cell, mirrored from cell to cell.
Block make_block(int n, float spacing);

void check_oscillator(Lines& out);
void check_hanging_chain(Lines& out);
void check_catenary(Lines& out);
void check_bending(Lines& out);
void check_stiffness(Lines& out);
void check_momentum(Lines& out);
void check_rotation(Lines& out);
void check_volume(Lines& out);
void check_wall(Lines& out);
void check_foundation(Lines& out);
// src/thread. nightly: the whole range of each; otherwise a range that takes a few seconds.
void check_capstan(Lines& out, bool nightly);
void check_overhand(Lines& out, bool nightly);
void check_holding(Lines& out, bool nightly);
void check_shaking(Lines& out, bool nightly);
void check_locking(Lines& out);
void check_names(Lines& out, bool nightly);
void check_ties(Lines& out, bool nightly);
// src/physical.
void check_contacts(Lines& out, bool nightly);
void check_puncture(Lines& out, bool nightly);
void check_eyelets(Lines& out, bool nightly);
void check_lying(Lines& out, bool nightly);
void check_interrupted(Lines& out, bool nightly);
void check_purse_string(Lines& out);
void check_tear(Lines& out, bool nightly);
// src/wall.
void check_cuts(Lines& out, bool nightly);
void check_pen(Lines& out);

}  // namespace catgut::validation
