// SPDX-License-Identifier: Apache-2.0
// thread/thread: a suture thread whose knots emerge from contact, friction, stretch and bending. Reads Settings, Surroundings
// (holds, tools, a plane); writes State. Future work of the paper (section 4); docs/thread.md explains the method.
//
// Units: SI, float32. Frame: any inertial frame; positions have 48 bits (a float and the remainder below its resolution), so
// that a thread may lie a meter from the origin. One thread, one worker: the bits never depend on the number of workers. A step
// does not allocate: every list has the capacity given by `make_state`. When a list is full, `overflow` counts.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/math.h"
#include "thread/material.h"

namespace catgut::thread {

using Column = std::vector<float>;
struct Columns3 {
  Column x, y, z;
  void assign(size_t n, float v) { x.assign(n, v), y.assign(n, v), z.assign(n, v); }
  void reserve(size_t n) { x.reserve(n), y.reserve(n), z.reserve(n); }
  Vec3 at(size_t i) const { return {x[i], y[i], z[i]}; }
  void set(size_t i, Vec3 v) { x[i] = v.x, y[i] = v.y, z[i] = v.z; }
  void add(size_t i, Vec3 v) { x[i] += v.x, y[i] += v.y, z[i] += v.z; }
};

// Constants of one thread.
struct Settings {
  Properties material;
  float substep = 50e-6f;  // h [s]
  int substeps = 20;       // per step(): 1 ms
  int iterations = 4;      // stretch solve and contact sweep, per substep
  // Simulated line mass [kg/m]. The real one (1e-4 kg/m) would need shorter substeps: h^2 T / (l^2 rho) must stay below
  // `load_limit`, and elsewhere the mass follows the tension. A part in contact with something loaded is heavier, and becomes
  // light again within `mass_decay` [s].
  float free_density = 0.05f, touch_density = 0.4f, mass_decay = 0.02f, load_limit = 0.2f;
  float damping = 5;            // drag [1/s]
  float inner_damping = 0.02f;  // of velocity differences between neighbors, per substep; conserves momentum
  float anchor = 0.2f;          // fraction of the stored tangential drift that a sticking contact undoes per substep
  float list_margin = 0.6e-3f;  // pairs nearer than d + margin are listed [m]
  float max_move = 0.125f;      // of the diameter, per substep
  float hole_grip = 0;          // [N] with which a hole holds thread that is slack, too; in addition to its Coulomb friction
  Vec3 gravity{};               // [m/s2]
  bool breaks = true;
};

// The second partner of a crossing: a segment, or kTool + index of a capsule.
constexpr uint32_t kTool = 0x8000;
constexpr uint32_t segment_of(uint32_t key) { return key >> 16; }
constexpr uint32_t partner_of(uint32_t key) { return key & 0xffff; }

enum class Touch : uint8_t { unknown, apart, stick, slip };

// A candidate pair of segments, or a segment and a tool's capsule. Its memory is the thread's topology: it persists as long
// as the two are near each other, independently of the list.
struct Crossing {
  float s = 0, t = 0;  // closest points, 0..1 along the first and along the second
  Vec3 normal;         // unit, from the second to the first. Continuous: its side is never recomputed from positions
  float gap = 0;       // [m] along the normal, surface to surface; below -d the pair is on its wrong side and is pushed back
  float normal_impulse = 0;  // force times h^2 [N.s2], carried over to the next substep
  Vec3 friction_impulse;     // on the first, likewise
  Vec3 drift;                // [m] tangential motion that sticking has not undone; 0 after slip; at most 0.2 d
  Touch touch = Touch::unknown;
  std::array<uint8_t, 3> pad{};
};

// A hole in something soft through which the thread slides: it turns a corner there. The corner lies within one segment, whose
// length is measured round it. When a node has come to the hole, the corner is handed to the neighboring segment.
struct Eyelet {
  uint32_t point = 0;    // in SoftPoints
  uint32_t segment = 0;  // in which the corner lies
  float friction = 0;    // Coulomb; the tensions on both sides differ by at most a factor exp(friction * turning angle)
  float slip = 0;        // [m] of thread that passed from the first side to the second since it stuck; at most kBristle
  float before = 0;      // [m] of thread between the segment's first node and the hole, at the end of the last substep
  float angle = 0;       // [rad] by which the thread turns there, likewise
};
constexpr size_t kMaxEyelets = 128, kMaxSoftPoints = 1024;  // of one step
constexpr float kBristle = 50e-6f;                          // [m] of slip within which friction builds up

struct State {
  // Per node.
  Columns3 x, fine;  // position [m] = x + fine; written by the substep
  Columns3 v;        // [m/s]
  Column warm;       // 0 free .. 1 in contact with something loaded
  Column kept;       // bend that stays without load, as the difference of the unit directions before and behind the node
  // Per segment: segment i joins nodes i and i + 1.
  Column rest;                  // [m]
  Column tension;               // [N] mean over the last step; negative: pushed
  std::vector<uint8_t> broken;  // 1: no longer a segment
  // Crossings, sorted by key. Separate columns, because most pairs only use up their budget.
  std::vector<uint32_t> key;  // first segment << 16 | partner
  Column budget;              // [m] of motion before the pair must be evaluated again
  std::vector<Crossing> crossing;
  // Contact with the plane, per node.
  Column plane_normal;  // [N.s2]
  Columns3 plane_friction, plane_drift;
  std::vector<Eyelet> eyelet;  // by segment; at most one in a segment
  Columns3 listed;             // [m] positions of the nodes when the pairs were listed
  float travel = 0;            // [m] motion of the tools since then; huge: the list is outdated
  uint32_t overflow = 0;       // pairs, or contacts with something soft, dropped because a list was full
  uint32_t refreshes = 0;

  size_t nodes() const { return x.x.size(); }
  size_t segments() const { return rest.size(); }
  Vec3 position(size_t i) const { return x.at(i) + fine.at(i); }
};

// Every field that is state, in order: for a caller that saves, loads, hashes or compares.
template <typename Archive, typename AnyState>
void reflect(Archive& archive, AnyState& s) {
  for (auto* c : {&s.x, &s.fine, &s.v, &s.plane_friction, &s.plane_drift, &s.listed}) {
    archive("x", c->x), archive("y", c->y), archive("z", c->z);
  }
  archive("warm", s.warm), archive("kept", s.kept), archive("rest", s.rest), archive("tension", s.tension),
      archive("broken", s.broken);
  archive("key", s.key), archive("budget", s.budget), archive("crossing", s.crossing);
  archive("plane_normal", s.plane_normal);
  archive("eyelet", s.eyelet);
  archive("travel", s.travel), archive("overflow", s.overflow);
  archive("refreshes", s.refreshes);
}
uint64_t hash_state(const State& state);

// A node that is moved or pulled from outside. The target moves linearly from `from` to `to` during a step.
struct Hold {
  uint32_t node = 0;
  Vec3 from, to;        // [m]
  float stiffness = 0;  // [N/m]; 0: rigid
  float limit = 0;      // [N] maximum force of the spring; 0: no limit
  Vec3 force;           // [N] of the hold on the thread, mean over the last step; written by step
};
// A constant force on a node.
struct Pull {
  uint32_t node = 0;
  Vec3 force;  // [N]
};
// A rigid body that tools are parts of and that the thread moves within the step. As with SoftPoints, an impulse displaces it
// as if it acted for the whole step; its own motion is that of its capsules.
struct ToolBody {
  Vec3 center, to_center;               // [m] of mass, at the beginning and at the end of the step
  float inv_mass = 0, inv_inertia = 0;  // [1/kg], [1/(kg m2)] the same about every axis
  Vec3 impulse, twist;                  // [N s], [N m s] about the center, of the thread; written by step
  Vec3 moved, turned;                   // [m], [rad] by the thread, at the end of the step; written by step
};
// Part of a tool: capsule about the segment a b. The points move linearly during a step.
struct ToolCapsule {
  static constexpr uint32_t kNoBody = 0xffffffff;
  Vec3 a, b;         // [m] at the beginning of the step; step adds to all four what the thread does to its body
  Vec3 to_a, to_b;   // at its end
  float radius = 0;  // [m] at a
  float friction = 0.15f;
  Vec3 force_a, force_b;    // [N] of the thread on the tool, split over its ends; mean over the last step; written by step
  float press = 20;         // [N] maximum on a segment: thread wedged between two rigid tools yields
  float widens = 0;         // [m] by which the radius at b is larger
  uint32_t body = kNoBody;  // in Surroundings::bodies; none: nothing that the thread does moves it
  uint32_t own_first = 1, own_last = 0;  // segments that begin in this part and have no contact with it
};
struct Plane {
  Vec3 normal{0, 1, 0};
  float offset = 0;  // [m] dot(normal, x) of its points
  float friction = 0.2f;
  Vec3 force;  // [N] of the thread on the plane, mean over the last step; written by step
};
// Points of something soft that is stepped once while the thread does all its substeps, such as a wall. They travel at `speed`,
// and an impulse p on point i displaces every point j as if it acted for the whole step: by step * (w_ij p + tilt_ij Q_j Q_i p)
// with Q = 1 - axis axis'. wall::Coupling fills it; "consistent multi-rate" in docs/physical.md.
struct SoftPoints {
  // What an impulse on a point does through the tilt of an axis that both points share.
  struct Tilt {
    uint32_t other = 0;
    float value = 0;  // [1/kg]
  };
  float step = 1e-3f;                    // [s] of one Stepper::step
  std::span<const Vec3> at, speed;       // [m] at the beginning of the step, [m/s] without what the thread does
  std::span<const Vec3> axis;            // unit
  std::span<const float> w;              // [1/kg] n x n
  std::span<const uint32_t> tilt_first;  // n + 1, into tilt
  std::span<const Tilt> tilt;
  std::span<Vec3> impulse;  // [N s] of the thread on each point; written by step
  std::span<Vec3> moved;    // [m] where the thread left each point, from `at`; written by step
};
// A node near the surface of something soft, for one step: it stays on its side of the plane that moves with the point.
struct SoftContact {
  uint32_t node = 0, point = 0;
  Vec3 offset;         // [m] from the point to the foot on the surface; neighbors may share a point
  uint32_t patch = 0;  // of the caller, to find what it remembers from the last step
  Vec3 normal;         // unit, out of the surface
  float friction = 0.1f;
  float normal_impulse = 0;  // memory, as in Crossing; written by step
  Vec3 friction_impulse, drift;
  float gap = 0;  // [m] at the end of the step; written by step
};
// Finds the plane of a contact again for a node that has slid far within the step. `node`: where it is [m], in the soft thing
// as it was at the beginning of the step. Writes the contact's normal, offset and patch, or leaves them.
struct SoftSurface {
  void* context = nullptr;
  void (*find)(void* context, std::span<SoftContact> contacts, size_t contact, Vec3 node) = nullptr;
};
struct Surroundings {
  std::span<Hold> holds;
  std::span<const Pull> pulls;
  std::span<ToolCapsule> tools;  // the same ones in the same order at every step: contacts remember the index
  std::span<ToolBody> bodies;    // of the tools
  Plane* plane = nullptr;
  SoftPoints* soft = nullptr;  // of State::eyelet and of the contacts
  std::span<SoftContact> soft_contacts;
  SoftSurface soft_surface;  // none: planes stay for the whole step
};

struct Scratch;  // work space of a step; nothing in it outlives the step

constexpr size_t kLeastNodes = 4;  // of a thread
// Pairs near each other that a thread of so many nodes has room for. Measured with twelve threads of 200 nodes, eleven of them
// knotted: 1.8 for each node.
constexpr size_t pair_capacity(size_t nodes) { return std::max<size_t>(4096, 8 * nodes); }
// Straight segments through `path`, with its segment lengths as rest lengths.
State make_state(std::span<const Vec3> path);

// Lays a thread through points: `path` are nodes and holes in order; hole[k] >= 0 makes path[k] a corner at that soft point
// instead of a node. Lengths at rest are those of the path. Two holes need a node between them.
State make_laced_state(std::span<const Vec3> path, std::span<const int32_t> hole, float hole_friction);

class Stepper {
 public:
  explicit Stepper(size_t max_nodes);
  ~Stepper();
  Stepper(Stepper&&) noexcept;
  // settings.substeps substeps: one millisecond by default. Allocates nothing, unless `state` was copied or loaded since its
  // last step (its lists get their capacity back).
  void step(const Settings& settings, State& state, Surroundings& around);

 private:
  std::unique_ptr<Scratch> scratch_;
};

// Minimum line mass [kg/m] for stable explicit bending with segments of this length [m]; the step uses no less.
float bending_density(const Settings& settings, float segment_length);

}  // namespace catgut::thread
