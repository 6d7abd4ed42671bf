// SPDX-License-Identifier: Apache-2.0
// wall/contact: contact with friction by impulses. All contacts of a step are solved together on the full compliance W = J A^-1
// J^T (projected Gauss-Seidel, Moreau's time stepping; Jourdan, Alart, Jean 1998, Comput. Methods Appl.
// Mech. Eng. 155, 31-47): a W cut
// to neighbors or to its diagonal gave forces that flickered or were eight times too large. The last step's impulses enter
// the wall's main solve, so that a resting contact is exact and only changes are iterated.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "wall/points.h"

namespace catgut::wall {

// A plane, or a capsule from a to b. Points of the capsule move at the velocities of its ends.
struct Obstacle {
  enum class Kind : uint8_t { plane, capsule } kind = Kind::capsule;
  Vec3 a, b;              // [m] capsule: ends of its axis; plane: a point of it, and its unit normal
  float radius = 0;       // [m]
  Vec3 speed_a, speed_b;  // [m/s] of the ends; plane: of all of it
  float friction = 0.3f;
};

struct Contact {
  uint64_t key = 0;  // obstacle, face or column, side: key of the impulses of the last step
  Weights point;     // of the wall
  Weights other;     // of the wall too, where `self`; it takes the opposite impulse
  bool self = false;
  uint32_t obstacle = 0;
  float along = 0;  // capsule: position on its axis, 0 at a
  Vec3 normal;      // out of the obstacle (self: out of the other side), unit
  float gap = 0;    // [m] at the start of the step
  Vec3 speed;       // [m/s] of the obstacle there
  float friction = 0;
  Vec3 impulse;  // [N s] on `point`
};

// [N/m] of a contact, by which the wall gives in its thickness: estimated. The solve knows columns as stiff in it.
constexpr float kThicknessStiffness = 60e3f;

struct ContactSolver {
  float reach = 0.0003f;  // [m] margin: gaps up to this plus two steps of relative motion are candidates
  // [m/N] of a contact. Without it, a point and a face that share columns, as in a crease, press each other with 1000 N: the
  // wall between them cannot yield in its thickness.
  float softness = 1 / kThicknessStiffness;
  float push_out = 0.2f;  // [m/s] maximum speed at which overlap is resolved
  // Sweeps come first: at rest, with the warm start, one suffices. Adjacent contacts are strongly coupled, and sweeps alone
  // converge slowly. Then all contacts that touch are solved together (ADMM for Coulomb friction: Tasora, Mangoni,
  // Benatti, Garziera 2021, doi 10.1002/nme.6693), and sweeps follow, which find what touches in addition.
  int sweeps = 3;          // at a time, maximum
  int rounds = 4;          // maximum
  int iterations = 40;     // of the joint solve, per round, maximum
  float accuracy = 1e-4f;  // relative to the largest impulse: sweeps stop when one changes less
  float joint_accuracy = 1e-3f;
  int swept = 0, iterated = 0;         // sweeps and iterations of the last step
  std::vector<Contact> contact, last;  // of this step and of the last one, in the order of their keys
  std::vector<Vec3> force, torque;     // per obstacle: [N] and [N m] about the scene's origin, of the wall on it
  Inverse inverse{512};
  // Workspace.
  struct Trial {  // a contact during the iteration
    Vec3 normal;
    float wanted = 0;  // [m/s] speed along the normal at which it would just touch at the end of the step
    float self = 0;    // [1/kg] its own compliance
    float friction = 0;
    Vec3 impulse, before;  // [N s] now, and before this sweep
  };
  std::vector<Trial> trial;
  std::vector<float> w;           // [1/kg] n x n; a row is made when its contact's impulse first changes
  std::vector<uint8_t> known;     // per row of w
  std::vector<float> slots;       // per slot of the factor: what an impulse on one contact does
  std::vector<uint32_t> mark;     // per slot: 1 + the contact that acts there
  std::vector<float> ux, uy, uz;  // [m/s] per contact, of the wall relative to what it touches
  std::vector<Vec3> change;       // [N s] since the last step
  std::vector<Weights> points;
  std::vector<Terms> terms;  // two per contact: point and other
  // The joint solve, per contact that takes part: columns of one number each.
  struct Joint {
    std::vector<uint32_t> contact;
    std::vector<uint8_t> has;    // per contact of the solver
    std::vector<float> inverse;  // [kg] n x n
    std::vector<float> friction, wanted, change;
    std::vector<float> n[3];                 // normal
    std::vector<float> start[3], free[3];    // [N s], [m/s] before the solve
    std::vector<float> impulse[3], slip[3];  // [N s] within the cone; [m/s] estimate of the velocity beyond the wanted one
    std::vector<float> right[3], answer[3];  // of an iteration
    void resize(size_t size);
  } joint;
  void reserve(size_t contacts);
};

// Before begin_step: finds candidates and applies last step's impulses to the wall (scratch.external). The caller may then add
// self contacts to `contact`, with keys above all others.
void find_contacts(const Model& model, const State& state, std::span<const Obstacle> obstacle, ContactSolver& solver);
void warm_start(const Model& model, Scratch& scratch, ContactSolver& solver);
// After begin_step: solves the corrections and applies them to the velocities.
void solve_contacts(const Model& model, State& state, Scratch& scratch, std::span<const Obstacle> obstacle,
                    ContactSolver& solver);

}  // namespace catgut::wall
