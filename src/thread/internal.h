// SPDX-License-Identifier: Apache-2.0
// thread/internal: the work space of a step and its parts, in the order in which a substep calls them. Not for other rooms.
#pragma once
#include <vector>

#include "thread/thread.h"

// Plain loops over columns, compiled for several instruction sets. Without fused multiply-add (see CMakeLists.txt) every one of
// them gives the same bits.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define CATGUT_CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define CATGUT_CLONES
#endif

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

// A contact solved in this substep, with all inputs of a sweep.
struct Active {
  Four normal{}, lt{};
  Four partner{};    // [m] motion of the tool's contact point in this substep
  Four pull_back{};  // fraction of the drift that is undone
  // Barycentric weights, negative for the second segment; the same times the inverse masses.
  float wi0 = 0, wi1 = 0, wj0 = 0, wj1 = 0, mi0 = 0, mi1 = 0, mj0 = 0, mj1 = 0;
  uint32_t i = 0, j = 0;  // first nodes of both segments; j = i for a tool or the plane (its weights are 0)
  float inverse = 0;      // 1 / effective inverse mass
  float mu = 0;
  float level = 0;  // gap - normal . motion, at the moment of the geometry
  float ln = 0;
  uint32_t crossing = 0;  // index in State
  bool slipped = false;
};

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
  Padded rest, inverse_rest, keep, alpha, lambda, step, residual, diag, off, down, up, inverse_diag, tension_sum, segment_move;
  std::vector<Active> active;
  std::vector<Four> contact_u;         // u of the nodes below, node by node
  std::vector<uint32_t> contact_node;  // nodes of active contacts, each once
  std::vector<uint32_t> plane_node;
  std::vector<uint8_t> touched;  // per node, in this substep
  // Pair list under construction, and what finds it.
  std::vector<uint32_t> new_key;
  Column new_budget;
  std::vector<Crossing> new_crossing;
  Padded3 middle;  // per segment
  Padded half;
  std::vector<Vec3> block_middle;
  Column block_radius;
  std::vector<Vec3> tool_move;  // per substep, of both ends of every tool
};

inline Vec3 between(const State& s, size_t i, size_t j) {  // node i - node j, to full resolution
  return (s.x.at(i) - s.x.at(j)) + (s.fine.at(i) - s.fine.at(j));
}

// pairs.cpp
constexpr float kReady = 0.15f;  // of the diameter: pairs with a smaller gap are solved
uint32_t skipped_neighbors(const Settings& settings, const State& state);
void refresh_pairs(const Settings& settings, State& state, Scratch& s, std::span<const ToolCapsule> tools, float time);
// Closest points of segments p + s a and q + t b, with r = p - q.
void closest_points(Vec3 r, Vec3 a, Vec3 b, float& s, float& t);

// stretch.cpp
void find_edges(const State& state, Scratch& s);
void prepare_stretch(const Settings& settings, const State& state,
                     Scratch& s);  // directions and factor at the predicted positions
void solve_stretch(Scratch& s, size_t segments);

// bending.cpp
void add_bending(const Settings& settings, Scratch& s, size_t nodes);

// contact.cpp
// Finds contacts at the predicted positions and applies their impulses of the last substep.
void begin_contacts(const Settings& settings, State& state, Scratch& s, Surroundings& around, float time);
void sweep_contacts(Scratch& s, bool backward);
void end_contacts(const Settings& settings, State& state, Scratch& s, Surroundings& around);

}  // namespace catgut::thread
