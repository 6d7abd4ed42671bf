// SPDX-License-Identifier: Apache-2.0
// physical/body: rigid tools and needles against wall and thread. Reads targets of the hands; writes the bodies' motion, the
// impulses on the wall and the forces on each body. docs/physical.md.
//
// Units: SI. Frame of a tool as in ToolInput: origin at the grasp point between the jaw tips, -z the pointing direction, +z
// along the shaft toward the hand, x the direction in which the jaws open. Frame of a needle: physical/needle.h.
// All contacts of bodies with the wall, grips and needle channels of a step are solved together on the wall's full compliance
// and the bodies' inertia. The hand's spring is implicit: it adds h d + h^2 k to the inertia, so that no stiffness is too high.
// A step allocates nothing after Scratch was made; `overflow` counts contacts that found no room.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "physical/surface.h"

namespace catgut::physical {

constexpr size_t kMaxBodies = 24;
constexpr size_t kMaxRows = 192;            // contacts, grip points and channel points of one step
constexpr size_t kMaxThreadCapsules = 224;  // of all bodies together

// Geometry: spheres, and capsules between two of them.
struct BodySphere {
  Vec3 at;  // [m] body frame, jaws closed
  float radius = 0;
  int8_t jaw = 0;  // -1, +1: turns with the jaw on that side of x
};
struct BodyCapsule {
  uint32_t a = 0, b = 0;  // spheres
};

// Constants of a body.
struct BodyModel {
  std::vector<BodySphere> sphere;
  std::vector<BodyCapsule> capsule;         // against sharp edges of the wall; between neighboring spheres
  std::vector<BodyCapsule> thread_capsule;  // against the thread: as few as describe the outline
  Vec3 center;                              // [m] of mass; a tool: where the hand holds it
  float mass = 0.05f;                       // [kg]
  float inertia = 2e-5f;                    // [kg m2] about the center, the same about every axis
  bool falls = false;                       // gravity acts while no hand holds it
  float wall_friction = 0.1f, thread_friction = 0.15f;
  // Spring and damper between hand and tool.
  float stiffness = 3000, damping = 15;            // [N/m], [N s/m]
  float turn_stiffness = 6, turn_damping = 0.03f;  // [N m/rad], [N m s/rad]
  float max_force = 8, max_torque = 0.5f;          // [N], [N m] of the hand
  // Jaws. hinge_z 0: none.
  float hinge_z = 0;            // [m] the jaws turn about y through (0, 0, hinge_z)
  float jaw_length = 0.004f;    // [m] of the grasping part from the tips (z = 0 at its middle), half its width is jaw_width
  float jaw_width = 0.0015f;    // [m]
  float jaw_speed = 4;          // [rad/s]
  float grip_friction = 0.35f;  // jaw on what it holds, one side
};

// A straight tool with two jaws: needle holder, forceps. Closed jaws touch in the plane x = 0.
struct ToolShape {
  float jaw_reach = 0.012f;                            // [m] from the grasp point back to the hinge
  float tip_radius = 0.8e-3f, hinge_radius = 1.6e-3f;  // [m] of each jaw
  float shaft_radius = 3e-3f, length = 0.14f;          // [m]
  float mass = 0.05f;                                  // [kg]
};
BodyModel make_tool(const ToolShape& shape);
// Adds a capsule as spheres at most `spacing` apart.
void add_capsule(BodyModel& model, Vec3 a, Vec3 b, float radius_a, float radius_b, int8_t jaw, float spacing);

enum class Gripped : uint8_t { nothing, needle, thread, tissue };
// A point that jaws hold: fixed to the tool, and to what is held. A force beyond friction moves the second (slip).
struct GripPoint {
  Vec3 in_tool, in_needle;  // [m] body frames
  wall::Point tissue;
  Vec3 impulse;  // [N s] on the tool, of the last step
};
struct Grip {
  Gripped what = Gripped::nothing;
  uint32_t count = 0;              // of points; thread: of strands, 1 or 2
  uint32_t body = 0;               // needle: its body; thread: node of the second strand, which holds point[1]
  uint32_t node = 0;               // thread
  float force = 0;                 // [N] normal force of the jaws
  float size = 0;                  // [m] thickness between the jaws
  float slid = 0;                  // [m] by which the held thing has slipped since it was gripped
  std::array<GripPoint, 4> point;  // thread: in_tool of each strand
};

struct Body {
  Pose pose;
  Vec3 velocity, spin;  // [m/s] of the center, [rad/s]
  float opening = 0;    // [rad] of each jaw
  Pose shown;           // the thread has seen the body here; its capsules move on from there
  float shown_opening = 0;
  Vec3 target_place;  // [m] of the center, in the last step
  Quat target_turn;
  bool held = false;  // by a hand, in the last step
  // Bits: spheres of a needle's shaft in its channel, which have no contact with the wall; those of jaws that hold tissue, or
  // held it and have not left it.
  uint64_t skip = 0;
  Grip grip;
  Vec3 thread_force, thread_torque;  // [N], [N m] about the center, of the thread in the last step
  float drag = 0, turn_drag = 0;     // [N s/m], [N m s/rad] of thread that presses the body (feel_thread), in the last step
  // Results of the last step: of wall, thread and other bodies on this one, torque about the center; of the hand on it.
  Vec3 force, torque, hand_force, hand_torque;
};

// What a hand wants of a body in one step.
struct HandTarget {
  Pose pose;
  bool connected = false;  // no hand: the body falls, or stays in the wall it hangs in
  float opening = 0;       // [rad] of each jaw
  float grip = 0;          // [N] normal force of closing jaws; 0: they let go
  uint32_t may_hold = 7;   // bits: 1 needle, 2 thread, 4 tissue
  Vec3 load{};             // [N] on the center of a body that no hand holds, such as the weight of a parked clamp
};

// Impulse of a contact, grip point or channel point in the last step: start of the next solve.
struct RowMemory {
  uint64_t key = 0;
  Vec3 axis, impulse;
};

// One interaction of a body with the wall, another body or a point.
struct Row {
  enum class Kind : uint8_t { contact, channel, grip, spring };
  Kind kind = Kind::contact;
  uint64_t key = 0;
  uint32_t a = 0, b = wall::kNone;  // bodies
  bool on_wall = false;
  wall::Weights point;
  uint32_t place = 0;                       // among the rows on the wall
  Vec3 ra, rb;                              // [m] from the centers of the bodies
  Vec3 axis;                                // contact: out of the wall; channel: the needle's tangent; grip: across the jaws
  Vec3 speed;                               // [m/s] of a's point in addition to its rigid motion (jaws)
  Vec3 wanted;                              // [m/s] relative velocity of a that undoes an error; contact: along the axis only
  float gap = 0;                            // [m] contact
  float least = 0;                          // [m] contact: the gap at the end of the step, at least
  float soft = 0;                           // [1/kg] compliance over h^2, of bilateral directions and of a contact
  float soft_across = 0;                    // [1/kg] spring: across the axis
  float friction = 0;                       // contact
  float along_limit = 0, across_limit = 0;  // [N s]; contact: along 0 is unlimited
  Vec3 impulse;                             // [N s] on a
  float diagonal_along = 0, diagonal_across = 0;
  bool at_limit = false;
};

struct BodiesModel {
  std::vector<BodyModel> body;
  Vec3 gravity{0, -9.81f, 0};  // [m/s2] on bodies without a hand
  float reach = 0.3e-3f;       // [m] margin of candidates, in addition to two steps of relative motion
  bool pair_contact = true;    // bodies against each other
  float pair_friction = 0.2f;  // steel on steel, dry or wet: 0.1-0.3
  float push_out = 0.2f;       // [m/s] maximum speed at which overlap is resolved
  int sweeps = 80;             // maximum
  float accuracy = 1e-4f;      // relative change at which sweeps stop
};
struct Bodies {
  std::vector<Body> body;
  std::vector<RowMemory> memory;  // by key
  uint32_t overflow = 0;
};

constexpr uint32_t kRun = 8;  // spheres of a body that are searched together

struct BodiesScratch {
  std::vector<Row> row;
  wall::Inverse inverse{512};
  std::vector<wall::Weights> points;
  std::vector<uint32_t> wall_row;
  std::vector<float> w;
  std::vector<Vec3> speed, change, before, onward;
  // A ball round each element, of this step; made by ball_of at its first use.
  struct Ball {
    Vec3 center;       // [m]
    float radius = 0;  // [m]
    uint64_t step = 0;
  };
  std::vector<Ball> ball;
  uint64_t ball_step = 0;
  std::vector<uint32_t> near_run;  // elements near a run of spheres in this step
  // Elements within some millimeters of a body, and of each run of its spheres. The lists are kept until body and wall may have
  // come nearer by that much.
  struct Run {
    Vec3 center_here, center;           // [m] of a ball about the run and its capsules: in this step, in that of the list
    float radius_here = 0, radius = 0;  // [m]
    uint32_t face_first = 0, face_end = 0, rim_first = 0, rim_end = 0;  // its part of Around::run_face and run_rim
  };
  struct Around {
    Pose pose;  // of the body, with its box and its spheres
    float opening = 0;
    Vec3 low_here, high_here;            // [m]
    std::vector<Vec3> in_body, at_here;  // [m] centers of the spheres
    float farthest = 0, lever = 0;       // [m] from its center to its surface, and from the hinge to the jaws' spheres; at most
    float margin = 0;                    // [m]
    double moved = 0;                    // SurfaceSearch::moved
    uint32_t version = 0;
    bool made = false;
    std::vector<uint32_t> face;
    std::vector<Run> run;
    std::vector<uint32_t> run_face, run_rim;  // elements of each run in turn; those of them that have strips
    std::span<const uint32_t> faces(const Run& r) const {
      return std::span(run_face).subspan(r.face_first, r.face_end - r.face_first);
    }
    std::span<const uint32_t> rims(const Run& r) const {
      return std::span(run_rim).subspan(r.rim_first, r.rim_end - r.rim_first);
    }
  };
  std::vector<Around> around;
  struct Moving {
    Vec3 v, w, center;
    float inv_mass = 0, inv_inertia = 0;
    bool held = false;
    float opening = 0;
    float squeeze = 0;  // [N] at the tips, of jaws that close, on tissue between them
    // [N s/m], [N m s/rad] of thread that presses the body. A tool keeps to its hand's motion, a loose needle to the thread's.
    float drag = 0, turn_drag = 0;
    Vec3 drag_speed, drag_spin;      // [m/s] of the center, [rad/s]: that motion of the thread or of the needle's holder
    uint32_t holder = wall::kNone;   // of a needle in jaws
    bool loose = false;              // a needle that is in no jaws and in no tissue
    bool lies = false;               // such a needle on the drape
    bool fast = false;               // one that does not lie there: the thread moves it within the step
    Vec3 thread_push, thread_twist;  // [N s], [N m s] of the thread in this step, on a fast needle
  };
  std::vector<Moving> moving;
  std::vector<thread::ToolCapsule> tool;
  std::vector<uint32_t> tool_body;      // per capsule
  std::vector<thread::ToolBody> loose;  // needles that the thread moves
  std::vector<uint32_t> loose_body;
  std::vector<thread::Hold> hold;
  std::vector<uint32_t> hold_body;
  std::vector<Vec3> hold_at;  // [m] where its force acts on the body
  float step = 0;             // [s]
  int swept = 0;
  uint32_t overflow = 0;  // contacts of the step that found no room
  void reserve(const wall::Model& model, const wall::State& state);
};

// Where a load in `direction` (unit) acts on the wall at w. A load along the director moves the column as a whole: the
// thickness has a penalty in place of a law, and 4 N on one face of a column turned it inside out.
wall::Weights load_point(wall::Weights w, const wall::Motion& motion, Vec3 direction);
// Positions.
Vec3 local(const BodyModel& model, const BodySphere& sphere, float opening);  // [m] body frame
inline Vec3 center_of(const BodyModel& model, const Body& body) { return transform(body.pose, model.center); }
// The same force on a body with its torque about another point [N m].
inline Vec3 torque_about(const BodyModel& model, const Body& body, Vec3 point) {
  return body.torque + cross(center_of(model, body) - point, body.force);
}
// Puts a body at rest at a pose.
void place_body(const BodyModel& model, Body& body, const Pose& pose, float opening);

// Stages of physical::step.
// Before all others: the drag of bodies that bore on taut thread at the end of the last step.
void feel_thread(const BodiesModel& model, const Bodies& bodies, const thread::State& thread, const thread::Plane* drape,
                 float substep, float h, BodiesScratch& k);
// Before wall::begin_step: velocities of the bodies without contact.
void predict_bodies(const BodiesModel& model, const Bodies& bodies, std::span<const HandTarget> target, float h,
                    BodiesScratch& k);
// Before any contact: jaws with thread on their outer side open slowly.
void open_gently(const BodiesModel& model, const Bodies& bodies, const thread::State& thread, float thread_diameter, float h,
                 BodiesScratch& k);
// Contacts of bodies with each other. Jaws that hold a needle have none with it.
void find_pair_contacts(const BodiesModel& model, const Bodies& bodies, float h, BodiesScratch& k);
// Contacts of loose needles with the drape.
void find_drape_contacts(const BodiesModel& model, const Bodies& bodies, const thread::Plane& drape, float h, BodiesScratch& k);
// The ball round an element in this step.
const BodiesScratch::Ball& ball_of(const wall::Model& wm, const wall::State& ws, BodiesScratch& k, uint32_t face);
// Contacts with the wall.
void find_body_contacts(const BodiesModel& model, const wall::Model& wm, const wall::State& ws, const Surface& surface,
                        Bodies& bodies, float h, SurfaceSearch& search, BodiesScratch& k);
// Jaws close, grip and let go; rows of held needles and tissue, holds of held thread.
void find_grips(const BodiesModel& model, const wall::Model& wm, const wall::State& ws, const Surface& surface,
                const thread::State& thread, float thread_diameter, Bodies& bodies, std::span<const HandTarget> target, float h,
                BodiesScratch& k);
// Impulses of the last step, to the wall's external forces and to the bodies.
void warm_bodies(const BodiesModel& model, const Bodies& bodies, std::span<const HandTarget> target, wall::Scratch& ws, float h,
                 BodiesScratch& k);
// Capsules of the bodies for the thread's step, and the forces that the thread left on them. drape: may be null.
void show_bodies(const BodiesModel& model, Bodies& bodies, const thread::Plane* drape, float h, BodiesScratch& k);
void take_thread_forces(const BodiesModel& model, Bodies& bodies, BodiesScratch& k);
// After the thread: solves, applies impulses to the wall, moves the bodies.
void solve_bodies(const BodiesModel& model, const wall::Model& wm, wall::State& ws, wall::Scratch& wscratch, Bodies& bodies,
                  std::span<const HandTarget> target, BodiesScratch& k);
// At the end of the step: held things slide where friction was exceeded, and fall out of the jaws.
void settle_grips(const BodiesModel& model, const wall::Model& wm, const wall::State& ws, const thread::State& thread,
                  Bodies& bodies, BodiesScratch& k);

}  // namespace catgut::physical
