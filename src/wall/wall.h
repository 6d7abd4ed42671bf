// SPDX-License-Identifier: Apache-2.0
// wall: a soft organ wall whose stiffness is the material's. Solid-shell elements (wall/element) on columns of an outer and an
// inner node. The mass matrix of the symplectic step is enlarged for relative motion only ("selective mass scaling",
// Olovsson, Simonsson, Unosson 2005, doi 10.1002/nme.1293; inertia as a factored stiffness bound):
//
//   f = forces at x + tau v                      tau = h / 4: damping that vanishes at rest
//   v = exp(-drag h) v + h A^-1 f                A = M + h^2 c L on mid-surface points, a diagonal on directors
//   impulses of everything else: v += A^-1 J^T p
//   x = x + h v
//
// A mesh may lie on an elastic bed (Winkler). It draws each column back to its place at rest, with k per area and distance
// along the normal, and k / 3 across it. In A it has h^2 k area: it is implicit, and a stiff bed does not limit the step.
//
// A resting state has zero force for any A, so neither step nor mesh changes the stiffness. L does not act on rigid
// translation: mass and linear momentum are exact. c is chosen at build time so that the largest eigenvalue of h^2 A^-1 K is at
// most 1.05. It stays below about 1.2 when the wall is cut (the step is stable below 2.67). Frames: positions in the scene's
// frame, meters, seconds, newtons.
#pragma once
#include <string>

#include "core/jobs.h"
#include "wall/factor.h"
#include "wall/force.h"
#include "wall/laminate.h"
#include "wall/mesh.h"
#include "wall/raster.h"

namespace catgut::wall {

struct Spec {
  Mesh mesh;
  std::vector<Layer> layer{Layer{}};
  float density = 1050;   // [kg/m^3]
  float step = 0.001f;    // [s]
  float drag = 5;         // [1/s] of all motion, in addition to the damping of strain
  Vec3 gravity{0, 0, 0};  // [m/s^2]
};

// Parameters chosen by the solver, for reports.
struct InertiaReport {
  float scale = 0;          // c
  float largest = 0;        // eigenvalue of h^2 A^-1 K
  float apparent_mass = 0;  // median over the columns: mass felt by a short push on one, relative to its own
  uint32_t entries = 0;     // of the factor
  float rest_mass = 0;      // [kg] of the wall
};

// Constant after build_wall.
struct Model {
  Mesh mesh;  // at rest
  std::vector<Layer> layer;
  Laminate laminate;
  float step = 0, drag = 0, tau = 0;  // [s], [1/s], [s]
  float max_speed = 3;                // [m/s]
  Vec3 gravity;
  std::vector<ElementBlock> block;
  std::vector<uint32_t> lane_of_face;  // block * 16 + lane
  std::vector<uint32_t> face_of_lane;  // kNone: an empty lane
  // Per lane, shared evenly by the corners where they are one number.
  struct LaneInertia {
    float mass;     // [kg] per corner
    float edge[6];  // [N/m] between corners 01 12 23 30 02 13: the stiffness bound
    float dir;      // [N/m] per corner, of directors
  };
  std::vector<LaneInertia> inertia;
  // Of a column that lies on a bed, by `source`; an empty list: no bed.
  struct Bed {
    Float4 at, normal;    // [m], unit: of the mid-surface at rest
    float stiffness = 0;  // [1/s^2] k per mass of wall above it
  };
  std::vector<Bed> bed;
  std::vector<std::array<uint32_t, 4>> neighbor;  // per face, over each edge: 4 * face + edge on the other side; kNone: a rim
  InertiaReport report;
};

// Changes in every step.
struct Motion {
  Column<Float4> x, v;  // [m], [m/s]: mid-surface point and director of each column in turn
  std::vector<BlockTurn> turn;
  uint64_t clamped = 0;  // columns at the speed limit, over all steps
};

// Changes when the wall is cut or factored again. A column that was cut is a group of copies that share a row of the factor.
// All of it follows from the model, `cut` and `factored` (wall/cut: restore).
struct Topology {
  uint32_t version = 0;               // counts changes
  std::vector<BlockCorners> corners;  // columns
  std::vector<uint32_t> source;       // per column: the column at rest it is a copy of
  std::vector<float> mass;            // [kg] per column
  std::vector<float> inv_dir;         // [1/kg] per column; 0: held
  std::vector<uint32_t> slot;         // per column: place in the factor's order; kNone: held
  // Per column: its share of its group's mass; [1/kg] of motion against the group; the group's sum of share^2 * relative.
  std::vector<float> share, relative, spread;
  std::vector<uint32_t> group_first, group_member;  // groups of two columns and more
  std::vector<uint32_t> gather_first, gather_from;  // per column: (block * 4 + corner) * 16 + lane
  Factor factor;
  // Cuts; the lists are empty while nothing was cut. Fragments are sorted by face and lowest cell. Their lanes follow those of
  // the model, in blocks of their own; the lane of a divided face is idle, on the columns that the face has at rest.
  std::vector<FaceCut> cut, factored;    // per face: links cut so far, and when the factor was made
  std::vector<uint32_t> first_fragment;  // per face; kNone: whole
  std::vector<Fragment> fragment;
  std::vector<ElementBlock> extra;  // constants of the fragments
};

struct State {
  Topology topology;
  Motion motion;
};

// Corner of an element that may lose its volume in this step.
struct FlatCorner {
  uint32_t at = 0, next = 0, last = 0;  // columns
  float least = 0;                      // [m^3]
};

// Workspace: nothing in it persists between steps.
struct Scratch {
  Column<Float4> y, force, external, answer;
  Column<Float4> rhs;
  std::vector<BlockForce> block_force;
  std::vector<FlatCorner> flat_corner;
};

struct Wall {
  Model model;
  State state;
  Scratch scratch;
};

// Throws InputError for a mesh, material or step that cannot be simulated.
Wall build_wall(const Spec& spec);
Scratch make_scratch(const Model& model, const State& state);

inline uint32_t columns(const State& s) { return static_cast<uint32_t>(s.topology.source.size()); }
inline Vec3 outer(const State& s, uint32_t c) { return vec3(s.motion.x[2 * c]) + vec3(s.motion.x[2 * c + 1]); }
inline Vec3 inner(const State& s, uint32_t c) { return vec3(s.motion.x[2 * c]) - vec3(s.motion.x[2 * c + 1]); }

// The first half of a step: forces, and velocities before impulses. scratch.external (2 per column: on
// mid-surface point and director, newtons) is added and then cleared.
void begin_step(const Model& model, State& state, Scratch& scratch, Jobs& jobs);
// The second half: the speed limit, and positions.
void finish_step(const Model& model, State& state, Jobs& jobs);
// Impulses that keep a tenth of each corner's volume (wall/volume): the last ones before finish_step, with the scratch of
// begin_step. Forces alone do not bound what a thread can flatten.
void keep_volumes(const Model& model, State& state, Scratch& scratch);

// v += A^-1 p for impulses p (2 per column, [N s]), which may be the scratch's `external`.
void apply_impulses(State& state, Scratch& scratch, const Column<Float4>& impulse);

// Elastic forces at the present positions, 2 per column, into scratch.force. Frames are turned `turns` steps first.
void elastic_forces(const Model& model, State& state, Scratch& scratch, int turns = 1);

// Largest eigenvalue of h^2 A^-1 K about the present positions. stiff: as if every fiber were beyond its knee.
float largest_eigenvalue(const Model& model, const State& state, Scratch& scratch, bool stiff, int iterations = 60);

// The lane of a place on a face.
uint32_t lane_at(const Model& model, const Topology& topology, uint32_t face, uint32_t cell);
inline uint32_t lane_at(const Model& m, const Topology& t, uint32_t face, float xi, float eta) {
  if (t.first_fragment.empty() || t.first_fragment[face] == kNone) return m.lane_of_face[face];
  return lane_at(m, t, face, cell_at(m.mesh.face[face][3] != kNone, xi, eta));
}
// Fragments of a face: how many, 0 for a whole one.
inline uint32_t fragments(const Topology& t, uint32_t face) {
  if (t.first_fragment.empty() || t.first_fragment[face] == kNone) return 0;
  uint32_t n = 1;
  while (t.first_fragment[face] + n < t.fragment.size() && t.fragment[t.first_fragment[face] + n].face == face) ++n;
  return n;
}

// Elements: the whole faces by their number, then the fragments. A divided face has no element of its own.
inline uint32_t elements(const Model& m, const Topology& t) {
  return static_cast<uint32_t>(m.lane_of_face.size() + t.fragment.size());
}
inline uint32_t lane_of_element(const Model& m, const Topology& t, uint32_t element) {
  const size_t faces = m.lane_of_face.size();
  return element < faces ? m.lane_of_face[element] : t.fragment[element - faces].lane;
}
inline uint32_t face_of_element(const Model& m, const Topology& t, uint32_t element) {
  const size_t faces = m.lane_of_face.size();
  return element < faces ? element : t.fragment[element - faces].face;
}

// Masses, director inertia and gather lists from the corners; then, with `again`, a new factor in which every column has a row
// of its own. The motion is continuous.
void renew_topology(const Model& model, Topology& topology, bool again);

}  // namespace catgut::wall
