// SPDX-License-Identifier: Apache-2.0
// solver/thread_columns: the uniform parts of a thread's solve, in SIMD. thread.cpp corrects the few nodes that are
// anchored, held or in contact. Reads and writes ThreadScratch only. The same bits for any SIMD width.
#pragma once
#include <algorithm>
#include <cstddef>

#include "core/math.h"
#include "solver/particles.h"

namespace catgut {

// A column with zeros before its first and behind its last element: kernels may read neighbors and work in whole vectors.
template <typename T>
class PaddedColumn {
 public:
  static constexpr size_t kPad = 32;
  void assign(size_t count, T value) {
    all_.assign(count + 2 * kPad, T{});
    std::fill(begin(), end(), value);
  }
  T* data() { return all_.data() + kPad; }
  const T* data() const { return all_.data() + kPad; }
  T& operator[](size_t i) { return data()[i]; }
  const T& operator[](size_t i) const { return data()[i]; }
  T* begin() { return data(); }
  T* end() { return data() + (all_.size() - 2 * kPad); }

 private:
  Column<T> all_ = Column<T>(2 * kPad);
};

// A symmetric positive definite tridiagonal system split into eight partitions of equal length, one per lane. Eliminating a row
// waits for the previous row (about 35 cycles, mostly the division). Eight short chains side by side are several times
// faster than one long one. The last row of every partition is a separator. The interior of a partition is eliminated with its
// two separators as unknowns. Then the eight separators are solved (their matrix, a Schur complement, is positive definite
// again). The interior follows in parallel (Wang 1981, A parallel method for tridiagonal equations).
// Row i of the system is row i % rows of partition i / rows. Rows behind the last are identity.
constexpr size_t kPartitions = 8;
template <typename T, size_t kRight>
struct PartitionedTridiagonal {
  // The system in its own order: off[i] between rows i and i + 1; right-hand sides, then solutions.
  PaddedColumn<T> diag, off, right[kRight];
  // Row by row of all partitions: off, inverse pivots, influence of the separator before and of the one behind, values.
  Column<T> link, inverse, before, after, value[kRight];
  void resize(size_t count) {
    for (PaddedColumn<T>* c : {&diag, &off}) c->assign(count, T{});
    for (PaddedColumn<T>& c : right) c.assign(count, T{});
    const size_t most = std::max<size_t>(2, count / kPartitions + 1) * kPartitions;
    for (Column<T>* c : {&link, &inverse, &before, &after}) c->assign(most, T{});
    for (Column<T>& c : value) c.assign(most, T{});
  }
};
// Solves the first `count` rows. Overwrites up to 15 rows behind them.
void solve_partitions(PartitionedTridiagonal<double, 1>& system, size_t count);
void solve_partitions(PartitionedTridiagonal<float, 3>& system, size_t count);

struct ThreadScratch;
// Directions, inverse lengths, compliances and residuals of all pairs. Returns the largest residual [m].
float find_directions(ThreadScratch& s, size_t pairs, float alpha_per_meter);
// Effective inverse masses of the pairs' nodes, as if no body held any.
void find_masses(ThreadScratch& s, size_t nodes, float h);
// The matrix and right-hand side of the stretch constraints in s.stretch. A pair that is cut has an identity row.
void find_matrix(ThreadScratch& s, size_t pairs, double regularization);
// Moves the free nodes by the impulses in s.step, each by at most `limit` [m], and adds them to the multipliers.
void move_loose_nodes(ThreadScratch& s, size_t nodes, float limit);
// Marks in s.violated the pairs that a distance sweep would change.
void mark_violated_segments(ThreadScratch& s, size_t pairs, float alpha_per_meter);
// Applies the thread's geometric stiffness to the predicted motion. `fall` [m]: displacement by weight in a substep. Returns
// false, without a change, where nothing is taut.
bool smooth_motion(ThreadScratch& s, size_t nodes, float inv_mass, float shortest, Vec3 fall, float h);

// A distance constraint within 0.1 um counts as satisfied, like most pairs after the direct solve: this saves its square root
// and division. `compliant`: compliance times multiplier [m].
constexpr float kFitLength = 2e-7f, kFitCompliant = 1e-7f;

}  // namespace catgut
