// SPDX-License-Identifier: Apache-2.0
// thread/internal: the work space of a step and its parts, in the order in which a substep calls them. Not for other rooms.
#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "core/clones.h"
#include "thread/thread.h"

namespace catgut::thread {

// A column with room before element 0 and behind the last: neighbors of the ends can be read, and are 0.
struct Padded {
  static constexpr size_t kPad = 16;
  std::vector<float> memory;
  void resize(size_t n) { memory.assign(n + 2 * kPad, 0.0f); }
  float* data() { return memory.data() + kPad; }
  const float* data() const { return memory.data() + kPad; }
  float& operator[](size_t i) { return memory[i + kPad]; }
  float operator[](size_t i) const { return memory[i + kPad]; }
};
struct Padded3 {
  Padded x, y, z;
  void resize(size_t n) { x.resize(n), y.resize(n), z.resize(n); }
  Vec3 at(size_t i) const { return {x[i], y[i], z[i]}; }
  void set(size_t i, Vec3 v) { x[i] = v.x, y[i] = v.y, z[i] = v.z; }
  void add(size_t i, Vec3 v) { x[i] += v.x, y[i] += v.y, z[i] += v.z; }
};

// Three numbers in one register; the fourth stays 0.
using Four = float __attribute__((vector_size(16)));
inline Four four(Vec3 v) { return Four{v.x, v.y, v.z, 0}; }
inline Vec3 three(Four v) { return {v[0], v[1], v[2]}; }
inline float dot(Four a, Four b) {
  const Four p = a * b;
  return (p[0] + p[1]) + p[2];
}

// The factored tridiagonal system of the stretch solve; see stretch.cpp. Element a of lane c is at a * kLanes + c.
struct LaneSystem {
  static constexpr size_t kLanes = 8;
  // Multiplier of the row before, inverse pivot; a unit of the row before the lane: eliminated, and solved.
  std::vector<float> down, inverse, first, left;
  std::vector<float> swept;  // right-hand side under way
  float off_end[kLanes]{}, between_down[kLanes]{}, between_inverse[kLanes]{};
  void resize(size_t n) {
    for (std::vector<float>* c : {&down, &inverse, &first, &left, &swept}) c->assign(n + 2 * kLanes, 0.0f);
  }
};

// A contact solved in this substep, with all inputs of a sweep.
struct Active {
  Four normal{}, lt{};
  Four partner{};    // [m] motion of the tool's contact point in this substep
  Four pull_back{};  // fraction of the drift that is undone
  // Barycentric weights, negative for the second segment; the same times the inverse masses.
  float wi0 = 0, wi1 = 0, wj0 = 0, wj1 = 0, mi0 = 0, mi1 = 0, mj0 = 0, mj1 = 0;
  uint32_t i = 0, j = 0;  // first nodes of both segments; j = i for a tool (its weights are 0)
  float inverse = 0;      // 1 / effective inverse mass
  float mu = 0;
  float level = 0;            // gap - normal . motion, at the moment of the geometry
  float ln = 0, most = 1e9f;  // [N.s2] normal impulse, and its maximum
  uint32_t crossing = 0;      // index in State
  uint32_t body = ToolCapsule::kNoBody;
  Vec3 arm;  // [m] from the body's center
  bool slipped = false;
};

// What a sweep does with any contact, of the thread or of something soft: Coulomb's law for its motion in this substep. Returns
// the change of its impulse.
template <typename AnyActive>
inline Four correct(AnyActive& c, Four moved) {
  const float along = dot(c.normal, moved);
  const float ln = std::min(std::max(0.0f, c.ln - (c.level + along) * c.inverse), c.most);
  Four lt = c.lt - (moved - c.normal * along + c.pull_back) * c.inverse;
  const float limit = c.mu * ln, size2 = dot(lt, lt);
  c.slipped = size2 > limit * limit;
  if (c.slipped) lt = lt * (limit / std::sqrt(size2));
  const Four change = c.normal * (ln - c.ln) + (lt - c.lt);
  c.ln = ln, c.lt = lt;
  return change;
}
// Without load, and with none after `correct`: most of the contacts near a knot.
template <typename AnyActive>
inline bool stays_apart(const AnyActive& c, Four moved) {
  return c.ln == 0 && (c.level + dot(c.normal, moved)) * c.inverse >= 0;
}
inline Vec3 tangential(Vec3 v, Vec3 n) { return v - n * dot(v, n); }
// Friction memory after a substep: the drift while sticking.
template <typename AnyActive>
inline Vec3 new_drift(const Settings& settings, const AnyActive& c, Vec3 drift, Vec3 moved) {
  if (c.slipped || c.ln <= 0) return {};
  const Vec3 d = tangential(drift + moved, three(c.normal));
  const float size = length(d), limit = 0.2f * settings.material.diameter;
  return size > limit ? d * (limit / size) : d;
}

constexpr uint8_t kOnOther = 1, kOnThread = 2;  // bits of Scratch::touched: with load on a tool, plane, wall; on thread

constexpr size_t kMaxTools = 256;  // of one step

struct Scratch {
  size_t max_nodes = 0, max_crossings = 0;
  // Per node.
  Padded3 u;                   // [m] motion since the substep began
  Padded3 force;               // [N] bending, pulls
  Padded mass, w;              // [kg], [1/kg]; w = 0: held
  Padded move;                 // [m] displacement in the last substep
  Padded least_density, span;  // [kg/m], [m] of thread per node; of the step
  // Per segment.
  Padded3 e;       // [m] edge vectors at the beginning of the substep
  Padded3 n;       // unit directions, of the stretch solve
  Padded3 moment;  // per node: B times curvature over length [N]
  Padded rest, inverse_rest, keep, alpha, lambda, step, residual, diag, off, tension_sum;
  Padded hinge;         // per node: bending stiffness over length [N]; of the step
  Padded yields;        // per node: bend beyond which more of it stays, as State::kept; of the step
  Padded segment_move;  // [m] in the last substep; behind the segments, from max_nodes on, those of the tools
  LaneSystem lanes;
  // Contacts of the thread with itself and tools. Pairs under examination lie side by side; see contact.cpp.
  struct Pairs {
    static constexpr size_t kMost = 64;
    std::array<uint32_t, kMost> index, first, second;  // in State; first nodes of both segments
    Padded3 p, a, b, n;  // first node of the first segment from that of the second, both segments; direction between
    Padded s, t, far;    // closest points, [m] between them
  };
  Pairs pairs;
  Padded3 edge;              // per segment, at the predicted positions
  Padded half_turn;          // per segment: half of the change of direction between its neighbors
  bool knows_turns = false;  // of this substep
  std::vector<Active> active_memory;
  size_t actives = 0;
  std::span<Active> active() { return {active_memory.data(), actives}; }
  std::span<const Active> active() const { return {active_memory.data(), actives}; }
  std::vector<Four> contact_u;         // u of the nodes below, node by node
  std::vector<uint32_t> contact_node;  // nodes of active contacts, each once
  // Contact with the plane: nodes that may touch it, and columns over all nodes.
  size_t plane_first = 0, plane_end = 0;
  Padded plane_level, plane_inverse, plane_slipped;  // [m], [kg] 0: does not touch, 0 or 1
  std::vector<uint8_t> touched;                      // per node, in this substep: kOnThread, kOnOther, or both
  // Pair list under construction, and what finds it.
  std::vector<uint32_t> new_key;
  Column new_budget;
  std::vector<Crossing> new_crossing;
  Padded3 middle;  // per segment
  Padded half;
  std::vector<Vec3> block_middle;
  Column block_radius;
  std::vector<std::array<uint64_t, kMaxTools / 64>> block_tools;
  std::vector<uint32_t> near_block;
  std::vector<uint8_t> holed;   // 1: a hole is in this segment and in the next one
  std::vector<Vec3> tool_move;  // per substep, of both ends of every tool
  // Soft points: motion since the step began, now and at the beginning of the substep.
  Padded3 soft_moved, soft_before;
  size_t soft_points = 0;
  float soft_answer = 0;  // [s/s] step / substep: displacement per multiplier and compliance
  // Corners in holes, one per State::eyelet: directions of the thread before and behind the corner (toward it, away from it).
  struct Corner {
    Vec3 in, out;
    float length_in = 0, length_out = 0;                               // [m]
    float pass = 1;                                                    // tension behind over tension before
    float sub = 0, sup = 0, sub_before = 0, sup_before = 0, diag = 0;  // of its row in the stretch system
    bool near_in = false, near_out = false;  // the node on that side is too near to the hole to give a direction
  };
  std::vector<Corner> corner;
  Padded spike_right, spike_left;     // answers of the spans between corners to the corner behind and before them
  std::vector<float> reduced, right;  // the system of the corners alone, factored
  struct SoftActive {
    Four normal{}, lt{}, pull_back{};
    uint32_t node = 0, point = 0;
    float inverse = 0, mu = 0, level = 0, before = 0, ln = 0, most = 1e9f;
    bool slipped = false;
    uint32_t contact = 0;
  };
  std::vector<SoftActive> soft_active;
  // Bodies of tools: where the thread has moved them, and had at the beginning of the substep; the same per impulse.
  struct MovedBody {
    Vec3 moved, turned, moved_before, turned_before;
    Vec3 center;                           // [m] at the end of the substep
    float per_impulse = 0, per_twist = 0;  // [1/kg] and [1/(kg m2)], times step / substep
    Vec3 impulse, twist;                   // sums of multipliers
  };
  std::vector<MovedBody> body;
  std::vector<float> pushed;    // [m] per tool: by the thread in the last substep
  std::vector<Vec3> soft_seen;  // [m] per contact: from its point to its node when the plane was found
  struct Carried {
    uint32_t node = 0;
    Vec3 by;  // [m]
  };
  std::vector<Carried> carried;
};

inline float clamp01(float v) { return v < 0 ? 0 : v > 1 ? 1 : v; }
// Closest points of segments p + s a and q + t b, with r = p - q.
template <typename Vector>
inline void closest_points(Vector r, Vector a, Vector b, float& s, float& t) {
  const float aa = dot(a, a), bb = dot(b, b), ab = dot(a, b), ar = dot(a, r), br = dot(b, r);
  const float det = aa * bb - ab * ab;
  s = det > 1e-7f * aa * bb ? clamp01((ab * br - bb * ar) / det) : 0.5f;
  t = (ab * s + br) / bb;
  if (t < 0) t = 0, s = clamp01(-ar / aa);
  else if (t > 1) t = 1, s = clamp01((ab - ar) / aa);
}

inline Vec3 between(const State& s, size_t i, size_t j) {  // node i - node j, to full resolution
  return (s.x.at(i) - s.x.at(j)) + (s.fine.at(i) - s.fine.at(j));
}

// pairs.cpp
constexpr float kReady = 0.15f;  // of the diameter: pairs with a smaller gap are solved
uint32_t skipped_neighbors(const Settings& settings, const State& state);
void refresh_pairs(const Settings& settings, State& state, Scratch& s, std::span<const ToolCapsule> tools, float time);

// stretch.cpp
void find_edges(const State& state, Scratch& s);
// Directions and factor at the predicted positions.
void prepare_stretch(const Settings& settings, const State& state, Scratch& s, const SoftPoints* soft);
void solve_stretch(const Settings& settings, const State& state, Scratch& s, SoftPoints* soft);

// The tridiagonal system that prepare_stretch factored, for the given right-hand side, which may be x.
void factor_tridiagonal(Scratch& s, size_t segments);
void solve_tridiagonal(Scratch& s, size_t segments, float* right_hand_side, float* x);

// eyelet.cpp
void begin_eyelets(const Settings& settings, State& state, Scratch& s, Surroundings& around);  // of a step
void advance_soft(const Settings& settings, Scratch& s, const SoftPoints& soft);               // of a substep
// Hands corners on that a node has come to; finds slip and friction.
void turn_corners(const Settings& settings, State& state, Scratch& s, Surroundings& around);
void grip_corners(const Settings& settings, const State& state, Scratch& s, SoftPoints& soft);  // Settings::hole_grip
void find_corners(const State& state, Scratch& s, const SoftPoints& soft);
void prepare_corners(const State& state, Scratch& s, const SoftPoints& soft);
void take_corner_residuals(const State& state, Scratch& s, const SoftPoints& soft);
void solve_corners(const Settings& settings, const State& state, Scratch& s);
// [N s2] of a segment, either way. No segment bears more than twice its straight strength, beyond which it breaks within a
// step: what moves a node faster than the limit of motion lets its neighbors follow would else load hands and tissue with
// kilonewtons.
inline float most_multiplier(const Settings& settings) {
  const float strength = settings.material.straight_strength;
  return strength > 0 ? 2 * strength * settings.substep * settings.substep : 1e9f;
}
void apply_corners(const State& state, Scratch& s, SoftPoints& soft, float substep);
void push_soft(Scratch& s, SoftPoints& soft, uint32_t point, Vec3 multiplier, float substep);

// soft_contact.cpp
void see_soft_contacts(const State& state, Scratch& s, const Surroundings& around);  // of a step
void begin_soft_contacts(const Settings& settings, State& state, Scratch& s, Surroundings& around);
// Round the limit of motion: fast nodes that bear on a tool or on something soft move with it, and the limit is for the rest.
void begin_carrying(const Settings& settings, Scratch& s, const Surroundings& around, float limit);
void end_carrying(Scratch& s);
void sweep_soft_contacts(Scratch& s, SoftPoints& soft, float substep, bool backward);
void end_soft_contacts(const Settings& settings, State& state, Scratch& s, Surroundings& around);

// bending.cpp
void begin_bending(const Settings& settings, const State& state, Scratch& s);  // of a step
void add_bending(State& state, Scratch& s);

// contact.cpp
// Finds contacts at the predicted positions and applies their impulses of the last substep.
void begin_bodies(const Settings& settings, Scratch& s, const Surroundings& around);        // of a step
void end_bodies(const Settings& settings, State& state, Scratch& s, Surroundings& around);  // of a step
void begin_contacts(const Settings& settings, State& state, Scratch& s, Surroundings& around, float time);
void sweep_contacts(const Settings& settings, State& state, Scratch& s, const Surroundings& around, bool backward);
void end_contacts(const Settings& settings, State& state, Scratch& s, Surroundings& around);

// plane.cpp: the same stages for the contacts with the plane, called by contact.cpp.
void begin_plane(const Settings& settings, State& state, Scratch& s, const Plane& plane);
void warm_plane(State& state, Scratch& s, const Plane& plane);
void sweep_plane(const Settings& settings, State& state, Scratch& s, const Plane& plane);
void end_plane(const Settings& settings, State& state, Scratch& s, Plane& plane);

}  // namespace catgut::thread
