// SPDX-License-Identifier: Apache-2.0
// sim/scene: the complete content of a scene file as plain data. The table in procedure/scene_fields names each member once for
// the reader, the writer, `catgut describe` and the reference page; sim/build turns a SceneSpec into a Model.
// SI units throughout. A key left out of a scene file keeps the default given here.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "core/math.h"

namespace catgut {

// One soft body: made by the bowel generator (anatomy/bowel) or read from a mesh file (anatomy/organ).
struct BodySpec {
  std::string name = "bowel";
  std::string kind = "tube";     // or pad: one lip of a slit in flat skin, `length` wide and twice `radius` long
  std::string mesh;              // path[#node] of an organ surface; empty: generate what `kind` says
  int particles = 1228;          // exact
  float radius = 0.020f;         // [m] outer radius of the tube
  float length = 0.070f;         // [m]
  float wall = 0.0025f;          // [m] thickness
  bool closed_start = false;     // far end closed by a cap
  bool closed_end = false;       // near end (where the procedure works) closed by a cap
  float haustra = 0.0008f;       // [m] depth of the sacculations; they fade out toward an open rim
  int taeniae = 3;               // longitudinal bands
  Vec3 position;                 // [m] center of the near end
  Vec3 axis{0, 1, 0};            // direction in which the near end faces
  float density = 1050;          // [kg/m^3]
  float pinned_length = 0.035f;  // [m] length of the far end that is fixed
  float inner_radius = 0;        // [m] outer radius of a second tube inside the first (a bowel folded into itself); 0: none
  bool folded = false;           // the two tubes are one wall, folded at the near end: a prolapse before it is cut
  float modulus_along = 6e5f;    // [Pa] Young's modulus along the organ; this to poisson: physical mechanics only
  float modulus_around = 6e5f;   // [Pa] around it
  float stiff_along = 0;         // [Pa] the same beyond the strain `knee`, where fibers are straight; 0: none
  float stiff_around = 0;        // [Pa]
  float knee = 0.3f;             // engineering strain
  float poisson = 0.45f;         // contraction around when stretched along
  float foundation =
      0;  // [Pa/m] of an elastic bed that the wall lies on: its modulus over its thickness; physical mechanics only
};

// One instrument of the scene. A scene that names none has a needle holder in the right hand and forceps in the left.
struct InstrumentSpec {
  std::string name;              // unique in this scene; empty: that of its kind
  std::string kind = "forceps";  // of the table in src/instrument
  std::string where = "tray";    // right, left, assistant_right, assistant_left: in that hand; tray; parked: closed on tissue
  Vec3 at;                       // [m] parked: the jaws close on the tissue surface nearest to this point
  Vec3 pull;                     // [N] parked: this force replaces its weight; zero: its weight
  float stretch = 0;  // [m] of the elastic cord that pulls: gone so far along the pull, it is slack; 0: constant pull
};

struct ThreadSpec {
  int particles = 175;
  float spacing = 0.0016f;           // [m] rest distance of neighbors
  float radius = 0.00015f;           // [m]
  float mass = 2e-6f;                // [kg] per particle
  float stretch_compliance = 1e-6f;  // [m/N] per segment
  // Physical mechanics: diameter, stiffness, friction and strength are this material's, instead of radius, mass and compliance.
  std::string material = "silk 2-0";
};

struct NeedleSpec {
  float radius = 0.00828f;       // [m] of the circle: half circle of 26 mm arc
  float arc = 3.14159265f;       // [rad]
  float wire_radius = 0.00033f;  // [m]
  float mass = 0.005f;           // [kg] inertia; larger than the steel's 0.07 g, to match the scaled inertia of the tissue
};

// A suture: a needle and the thread swaged to it.
struct SutureSpec {
  ThreadSpec thread;
  NeedleSpec needle;
};

// Solver parameters. preset = "paper" sets all of them as in section 2.1 of the paper; "default" gives the best results.
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
  float mass_scale = 80;         // factor of tissue inertia at unchanged weight: sets the reaction force of tissue
  float friction_tissue = 0.3f;  // coefficients of Coulomb friction
  float friction_tool = 0.1f;
  float friction_thread = 0.15f;
  float hand_stiffness = 3000;  // [N/m] of the coupling between a hand and its tool
  float tool_force = 8;         // [N] maximum force between two tools; above what a haptic device renders
};

// Guided mechanics (paper 2.2, 2.3): of the other members, physical mechanics read grasp_reach alone.
struct MechanicsSpec {
  std::string kind = "guided";         // or physical: wall with a modulus, thread that ties its own knots (sim/physical)
  float attach_threshold = 0.006f;     // [m] X of figure 4: maximum distance from the tip to the nearest particle
  float release_distance = 0.0022f;    // [m] drag beyond which the attached particle is released (figure 5)
  float attach_compliance = 0.00091f;  // [m/N] of that attachment: 1 / 1100 N/m, the paper's spring
  float track_compliance = 0.002f;     // [m/N] lateral compliance of the needle track
  float pass_tension = 0.03f;          // [N] tension difference beyond which thread slides through a suture point
  float capstan_friction =
      0.08f;                   // additional threshold per newton of tension (friction coefficient times the angle of the bend)
  int collision_off = 3;       // thread particles on each side of a locked one that do not collide
  float grasp_reach = 0.003f;  // [m] within which a closing jaw grasps needle or thread
};

// The technique's plan.
struct TechniqueSpec {
  std::string name = "purse_string";   // or connell, stay, lembert, none
  Vec3 anvil;                          // [m] focal point of the closure, relative to the rim's center
  float anvil_radius = 0.004f;         // [m] the rim ends on a ring of this radius
  float closure_compliance = 0.0001f;  // [m/N] of the closure of edge particles toward the anvil
  int min_bites = 10;
  float closed_gap = 0.0005f;  // [m] gap that a seam or a knot leaves between two closed points
  float step = 0.003f;         // [m] between interpolated pairs of a seam (dist_threshold of 2.5.2)
  int throws = 2;              // a knot with fewer does not hold
};

// The scripted surgeon.
struct SurgeonSpec {
  std::string plan;  // which technique to perform; empty: that of the scene
  int bites = 12;
  float edge_distance = 0.004f;  // [m] of the bites from the rim
  float bite_length = 0.007f;    // [m] along the rim
  float tail = 0.045f;           // [m] of thread left at the free end
  float speed = 0.15f;           // [m/s] of free hand motion
  float drive_speed = 0.03f;     // [m/s] of the needle in tissue
  float tremor = 0.0001f;        // [m] standard deviation
  float aim_error = 0.0003f;     // [m] standard deviation
  // Abilities; 0: without that error (procedure/ability draws them for novices, intermediates and experts).
  float angle_error = 0;    // [rad] standard deviation of the needle's direction
  float pause = 0;          // [s] mean time of thought before a task
  float tension_error = 0;  // relative standard deviation of the force of a pull
  float grasp_error = 0;    // probability that a grasp misses
  float order_error = 0;    // probability of a throw in the wrong direction, or of two bites exchanged
};

// Expected results at the end: every scene is a test. min/max of a named result (see docs/scene_reference).
struct Expectation {
  std::string name;
  double min = -1e300, max = 1e300;
};

struct SceneSpec {
  std::string name;  // of the file, without .toml
  std::string title;
  uint64_t seed = 1;
  float duration = 240;                // [s] maximum simulated time; a run ends earlier when the surgeon has finished
  float settle = 0.5f;                 // [s] of settling before the hands connect
  std::string surroundings = "table";  // or perineum: the first body comes through the anal verge of a patient in lithotomy
  std::vector<BodySpec> body;
  std::vector<InstrumentSpec> instrument;
  ThreadSpec thread;
  NeedleSpec needle;
  std::vector<SutureSpec> suture;  // ready at the start; empty: one, of `thread` and `needle`
  SolverSpec solver;
  MechanicsSpec mechanics;
  TechniqueSpec technique;
  SurgeonSpec surgeon;
  std::vector<Expectation> expect;
};

// The needles and threads of a scene: at least one.
std::vector<SutureSpec> sutures_of(const SceneSpec& scene);
// Sets all solver parameters to the named preset ("paper" or "default"); false if there is no such preset.
bool apply_preset(SolverSpec& solver, const std::string& preset);

}  // namespace catgut
