// SPDX-License-Identifier: Apache-2.0
// wall/points: all interaction with the wall through material points and impulses. A point moves as J x; an impulse p on it
// changes all velocities by A^-1 J^T p. A is a scalar matrix times the unit matrix, so the compliance W = J A^-1 J^T of two
// points is one number, independent of direction. A does not rotate with the tissue: columns of A^-1 stay valid until the
// topology changes.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "wall/wall.h"

namespace catgut::wall {

// A material point; a cut does not move it. Quad: xi, eta in -1..1 (corner 0 at -1, -1). Triangle: corner 0 at (0, 0),
// 1 at (2, 0), 2 at (0, 2). zeta: -1 inner face, 0 mid-surface, 1 outer face.
struct Point {
  uint32_t face = 0;
  float xi = 0, eta = 0, zeta = 0;
};

// The same for the present topology: sum over columns of weight * (mid + zeta * director). Weights of 0 are allowed.
struct Weights {
  std::array<uint32_t, 4> column{};
  std::array<float, 4> weight{};
  float zeta = 0;
};

Weights weights(const Model& model, const Topology& topology, const Point& point);
Weights at_column(uint32_t column, float zeta);
Vec3 place(const Weights& w, const Motion& motion);     // [m]
Vec3 velocity(const Weights& w, const Motion& motion);  // [m/s]
// The nearest material point of one side (zeta) of the wall to p.
Point nearest_point(const Model& model, const State& state, Vec3 p, float zeta);

// Adds an impulse or force on a point to lists of 2 per column.
void add_to(Column<Float4>& list, const Weights& w, Vec3 amount);

// What a compliance needs of a point: weights of 0 and held columns are left out.
struct Terms {
  uint32_t count = 0;
  std::array<uint32_t, 4> column{}, slot{};
  std::array<float, 4> weight{};
  std::array<const float*, 4> row{};  // of A^-1
  float zeta = 0;
};

// Columns of A^-1 for mid-surface points, computed on first use and cached. The cache never changes a result.
class Inverse {
 public:
  // capacity: cached columns; at least the number requested by one call of `need`. A small wall caches all of them.
  explicit Inverse(uint32_t capacity = 512) : asked_(capacity) {}
  // Computes missing columns of these points; clears the cache when the topology has changed.
  void need(const Topology& topology, std::span<const Weights> points);
  // [1/kg] between two points whose columns have been requested.
  float compliance(const Topology& topology, const Weights& a, const Weights& b) const {
    return compliance(topology, terms(topology, a), terms(topology, b));
  }
  // The same in two steps, for points that take part in many pairs. Valid until the next call of `need`.
  Terms terms(const Topology& topology, const Weights& point) const;
  float compliance(const Topology& topology, const Terms& a, const Terms& b) const;
  // Its two parts: what goes through the factor, for a unit on one point, in every slot (added, times `sign`); and what
  // points on copies of the same column share in addition.
  void add_answer(const Terms& a, float sign, std::span<float> slots) const;
  static float shared(const Topology& topology, const Terms& a, const Terms& b);
  // The column of a slot of the factor, which has been requested.
  const float* column(uint32_t slot) const { return value_.data() + size_t{entry_[slot]} * rows_; }
  uint32_t rows() const { return rows_; }
  uint32_t kept() const { return static_cast<uint32_t>(slot_.size()); }

 private:
  uint32_t asked_, capacity_ = 0, version_ = 0, rows_ = 0, next_ = 0, round_ = 0;
  std::vector<uint32_t> entry_;        // per slot; kNone: not cached
  std::vector<uint32_t> slot_, used_;  // per entry: its slot, and the last call that requested it
  Column<float> value_;
  Column<Float4> solve_;
};

// Points of contact with something at smaller steps, such as a thread stepped at 50 us on a wall stepped at 1 ms ("consistent
// multi-rate"). The wall's step ends at x + h (v + A^-1 J^T sum p): a point therefore moves through the step at its velocity,
// and every impulse displaces it as if it acted for the whole step. At the end, a point is at the wall's final position.
//
//   begin_step(...)                      velocities without the impulses
//   coupling.begin(...)
//   for each small step dt:
//     coupling.advance(dt)               at[i] moves with the wall
//     ... coupling.push(i, impulse)      at[all] answer; compliance of a force held over dt: (h / dt) W
//   coupling.end(...)                    impulses become velocities
//   finish_step(...)
//
// A point may stand off the mid-surface by `offset` along the unit director. An impulse on it then moves and tilts the column,
// but never squeezes its thickness: a thread round both faces of a thin wall would draw them together, by an amount that
// depends on the mesh.
struct Coupling {
  // What an impulse on a point does through the tilt of columns that both share: tilt Q_j Q_i p, Q = 1 - axis axis'.
  struct Tilt {
    uint32_t other = 0;
    float value = 0;  // [1/kg]
  };
  std::vector<Weights> point;   // on the mid-surface where there is an offset
  std::vector<float> offset;    // [m]
  std::vector<Vec3> axis;       // unit director, of this step
  std::vector<Vec3> at, speed;  // [m], [m/s]
  std::vector<Vec3> impulse;    // [N s] in this step so far
  std::vector<float> w;         // [1/kg] n x n
  std::vector<uint32_t> tilt_first;
  std::vector<Tilt> tilt;
  Inverse inverse{512};
  float step = 0;        // [s]
  uint32_t version = 0;  // of the topology that w belongs to

  // offsets: none, or one for each point. Allocates nothing once it has had as many points.
  void set_points(const Model& model, const Topology& topology, std::span<const Point> points,
                  std::span<const float> offsets = {});
  void reserve(size_t points);
  // After the wall's begin_step. The points given to set_points are looked up again when the topology has changed.
  void begin(const Model& model, const State& state);
  void advance(float dt) {
    for (size_t i = 0; i < at.size(); ++i) at[i] += speed[i] * dt;
  }
  void push(size_t i, Vec3 p) {
    impulse[i] += p;
    const float* row = w.data() + i * at.size();
    for (size_t j = 0; j < at.size(); ++j) at[j] += p * (step * row[j]);
    const Vec3 q = p - axis[i] * dot(p, axis[i]);
    for (uint32_t t = tilt_first[i]; t < tilt_first[i + 1]; ++t) {
      const Vec3 n = axis[tilt[t].other];
      at[tilt[t].other] += (q - n * dot(q, n)) * (step * tilt[t].value);
    }
  }
  void end(State& state, Scratch& scratch);
  // The impulses on the points as impulses on columns, 2 per column: what `end` applies.
  void spread(Column<Float4>& to) const;
  Vec3 now(size_t i, const State& state) const;  // where point i is [m]

 private:
  std::vector<Point> material_;
  std::vector<float> lever_;  // offset over the length of the director, of this step
  std::vector<Terms> terms_;
};

// Points with prescribed positions within the step, such as a grip. softness [m/N]: 0 is rigid. Returns forces [N] on the
// wall in `force`. After begin_step (and Coupling::end), before finish_step.
struct Hold {
  std::vector<Weights> point;
  std::vector<Vec3> target;  // [m] at the end of the step
  float softness = 0;
  std::vector<Vec3> force;  // [N] result
  Inverse inverse{512};
  std::vector<double> matrix;
};
void apply_hold(const Model& model, State& state, Scratch& scratch, Hold& hold);

}  // namespace catgut::wall
