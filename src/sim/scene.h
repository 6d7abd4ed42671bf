// SPDX-License-Identifier: Apache-2.0
// sim/scene: everything a scene file can say, as plain data. The table in procedure/scene_fields names each member once for
// the reader, the writer, `catgut describe` and the reference page; sim/build turns a SceneSpec into a Model.
// SI units throughout. A value left out of a scene file keeps the default given here.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "core/math.h"

namespace catgut {

// One soft body: made by the bowel generator (anatomy/bowel) or read from a mesh file (anatomy/organ).
struct BodySpec {
  std::string name = "bowel";
  std::string mesh;              // path[#node] of an organ surface; empty: generate a tube
  int particles = 1228;          // exact
  float radius = 0.020f;         // [m] outer radius of the tube
  float length = 0.070f;         // [m]
  float wall = 0.0025f;          // [m] thickness
  bool closed_start = false;     // far end closed by a cap
  bool closed_end = false;       // near end (where the procedure works) closed by a cap
  float haustra = 0.0008f;       // [m] depth of the sacculations; they fade out toward an open rim
  int taeniae = 3;               // longitudinal bands
  Vec3 position;                 // [m] center of the near end
  Vec3 axis{0, 1, 0};            // the way the near end faces
  float density = 1050;          // [kg/m^3]
  float pinned_length = 0.035f;  // [m] of the far end that the surroundings hold
  float inner_radius = 0;        // [m] outer radius of a second tube inside the first (a bowel folded into itself); 0: none
};

// One instrument of the scene. A scene that names none has a needle holder in the right hand and forceps in the left.
struct InstrumentSpec {
  std::string name;              // in this scene; empty: that of its kind
  std::string kind = "forceps";  // of the table in src/instrument
  std::string where = "tray";    // right, left, assistant_right, assistant_left: in that hand; tray; parked: closed on tissue
  Vec3 at;                       // [m] parked: the jaws close on the tissue's surface nearest to here
  Vec3 pull;                     // [N] parked: pulls with this force instead of its weight; zero: its weight
};

struct ThreadSpec {
  int particles = 175;
  float spacing = 0.0016f;           // [m] rest distance of neighbors
  float radius = 0.00015f;           // [m]
  float mass = 2e-6f;                // [kg] per particle
  float stretch_compliance = 1e-6f;  // [m/N] per segment
};

struct NeedleSpec {
  float radius = 0.00828f;       // [m] of the circle: half circle of 26 mm arc
  float arc = 3.14159265f;       // [rad]
  float wire_radius = 0.00033f;  // [m]
  float mass = 0.005f;  // [kg] inertia; more than the steel's 0.07 g, to match the scaled inertia of the tissue it moves
};

// One of several sutures: a needle and the thread swaged to it.
struct NeedleAndThread {
  ThreadSpec thread;
  NeedleSpec needle;
};

// The solver's knobs. preset = "paper" sets all of them as in section 2.1 of the paper; "default" is what works best.
struct SolverSpec {
  std::string preset = "default";
  float tick_rate = 60;  // [1/s] ticks
  int substeps = 16;     // per tick
  int shape_sweeps = 1;
  float shape_stiffness = 0.9f;   // 0..1, the paper's deformation resistance, per sweep of a substep of 1/480 s
  float shape_relaxation = 1.3f;  // over-relaxation of the averaged goals; stiffness * relaxation < 2
  int distance_sweeps = 1;
  int bend_sweeps = 1;
  float bend_compliance = 2e4f;  // [1/J] of the cosine form
  int self_contact_sweeps = 1;   // tissue against tissue
  int contact_sweeps = 1;        // tools, thread and needle
  bool thread_direct = true;     // direct solve along the thread before the distance sweeps
  bool volume = false;           // tetrahedral volume constraints
  float volume_compliance = 0;   // [m^6/J] energy = (V - V0)^2 / (2 compliance); 0: incompressible
  float damping = 4;             // [1/s] of tissue velocities
  float thread_damping = 12;     // [1/s] of thread velocities
  Vec3 gravity{0, -9.81f, 0};    // [m/s^2]
  float mass_scale = 80;         // tissue inertia times this at unchanged weight: sets the force with which tissue answers
  float friction_tissue = 0.3f;  // coefficients of Coulomb friction
  float friction_tool = 0.1f;
  float friction_thread = 0.15f;
  float hand_stiffness = 3000;  // [N/m] of the coupling between a hand and its tool
  float tool_force = 8;         // [N] with which two tools press each other at most; more than an arm renders
};

// Guided mechanics (paper 2.2, 2.3).
struct SutureSpec {
  float attach_threshold = 0.006f;     // [m] X of figure 4: the nearest particle must be this near to the tip
  float release_distance = 0.0022f;    // [m] drag beyond which the attached particle is let go (figure 5)
  float attach_compliance = 0.00091f;  // [m/N] of that attachment: 1 / 1100 N/m, the paper's spring
  float track_compliance = 0.002f;     // [m/N] the bitten tissue holds the needle's shaft sideways
  float pass_tension = 0.03f;          // [N] tension difference beyond which thread slides through a suture point
  float capstan_friction =
      0.08f;                   // and that much more per newton of tension (friction coefficient times the angle of the bend)
  int collision_off = 3;       // thread particles on each side of a locked one that do not collide
  float grasp_reach = 0.003f;  // [m] how near a closing jaw must be to hold needle or thread
};

// The technique's plan.
struct TechniqueSpec {
  std::string name = "purse_string";   // or connell, stay, lembert, none
  Vec3 anvil;                          // [m] focal point of the closure, relative to the rim's center
  float anvil_radius = 0.004f;         // [m] the rim ends on a ring of this radius
  float closure_compliance = 0.0001f;  // [m/N] of the pull of the edge particles toward it
  int min_bites = 10;
  float closed_gap = 0.0005f;  // [m] left between two points that a seam or a knot draws together
  float step = 0.003f;         // [m] between the pairs that a seam draws together in between (dist_threshold of 2.5.2)
  int throws = 2;              // with fewer a knot does not hold
};

// The scripted surgeon.
struct SurgeonSpec {
  std::string plan;  // what he does; empty: the technique
  int bites = 12;
  float edge_distance = 0.004f;  // [m] of the bites from the rim
  float bite_length = 0.007f;    // [m] along the rim
  float tail = 0.045f;           // [m] of thread left at the free end
  float speed = 0.15f;           // [m/s] of free hand motion
  float drive_speed = 0.03f;     // [m/s] of the needle in tissue
  float tremor = 0.0001f;        // [m] standard deviation
  float aim_error = 0.0003f;     // [m] standard deviation
};

// What must hold at the end: every scene is a test. min/max of a named result (see docs/scene_reference).
struct Expectation {
  std::string name;
  double min = -1e300, max = 1e300;
};

struct SceneSpec {
  std::string name;  // of the file, without .toml
  std::string title;
  uint64_t seed = 1;
  float duration = 240;  // [s] simulated, at most; a run ends earlier when the surgeon is done
  float settle = 0.5f;   // [s] simulated before the hands are let in
  std::vector<BodySpec> body;
  std::vector<InstrumentSpec> instrument;
  ThreadSpec thread;
  NeedleSpec needle;
  std::vector<NeedleAndThread> sutures;  // that lie ready at the start; empty: one, of `thread` and `needle`
  SolverSpec solver;
  SutureSpec suture;
  TechniqueSpec technique;
  SurgeonSpec surgeon;
  std::vector<Expectation> expect;
};

// The needles and threads of a scene: at least one.
std::vector<NeedleAndThread> sutures_of(const SceneSpec& scene);
// Sets every solver knob to the named preset ("paper" or "default"); false if there is no such preset.
bool apply_preset(SolverSpec& solver, const std::string& preset);

}  // namespace catgut
