// SPDX-License-Identifier: Apache-2.0
// solver/shape_match: shape matching over overlapping clusters (paper 2.1; Mueller et al. 2005), as an XPBD constraint
// C_k = x_k - g_k per particle, where g_k is the mean of the goals of all clusters that hold k.
// Both passes are sums of listed 64-byte rows in a fixed order: no gathers, no scatter, no atomics. The bits are the same for
// any number of workers and any SIMD width.
#pragma once
#include <array>
#include <cstdint>
#include <span>

#include "solver/particles.h"

namespace catgut {

struct alignas(64) Row {
  float f[16] = {};
};

// Consecutive particles that belong to the same clusters (like the two sides of a wall) form a group. They share one row, the
// sum of theirs, and one sum of transforms. Same arithmetic at half the loads.
//
// Constant part. Lists are padded to a fixed stride with the index of a zero row, so that the sums need no branches.
struct ShapeModel {
  uint32_t clusters = 0;  // distinct ones: particles on the two sides of a wall often share theirs
  uint32_t groups = 0;
  std::vector<uint32_t> group_first;         // groups + 1: particles group_first[g] .. group_first[g + 1] - 1
  uint32_t cluster_stride = 16;              // particles per cluster, padded; the pad is index `particles`
  uint32_t member_stride = 16;               // groups per cluster, padded; the pad is index `groups` (a zero row)
  uint32_t holder_stride = 16;               // clusters per group, padded with index `clusters` (a zero transform)
  Column<uint32_t> member;                   // clusters x cluster_stride: particles; not used by the kernels
  Column<uint32_t> group_member;             // clusters x member_stride: groups, as the offset of their row (16 floats each);
                                             // the last cluster's is repeated up to a multiple of 16
  Column<uint32_t> holder;                   // groups x holder_stride: clusters, likewise
  Column<float> inv_holders;                 // per group: 1 / number of clusters that hold it
  Column<Vec4> rest;                         // per particle, (x, y, z, 1)
  Column<float> relative_mass;               // per particle: m_k / mean m, the weights of the moments
  Column<Vec4> weighted_rest;                // per particle: relative mass times rest
  std::array<Column<float>, 3> rest_center;  // per cluster, by components: mass-weighted
  Column<float> inv_cluster_mass;            // per cluster: 1 / sum of relative masses; padded like the lists
  std::vector<uint32_t> cluster_of;          // per particle: the cluster centered on it
};
// cluster[i] is centered on particle i. Clusters with equal members are merged: solving both would be redundant.
ShapeModel make_shape_model(std::span<const Vec3> rest, std::span<const float> mass,
                            std::span<const std::vector<uint32_t>> cluster);

// Per-cluster rotation, structure of arrays, padded to a multiple of 16. Warm start of the next substep, hence state.
struct ClusterRotations {
  Column<float> x, y, z, w;
  void reset(uint32_t clusters);
};

// Working memory of one sweep. Row `groups` and transform `clusters` stay zero.
struct ShapeScratch {
  Column<Row> row;        // per group: sum of m_k (x,1)(q,1)^T
  Column<Row> transform;  // per cluster: columns of the 3x4 affine [R | t], 4 floats each
  Column<Vec4> moved;     // per particle: displacement by shape matching in this substep [m] (lambda = moved * mass)
  void resize(const ShapeModel& model);
};

// Sweep, pass 1 over clusters [first, last): moments from rows, rotation by one warm Newton step of the polar decomposition
// (error below 1e-5 rad. It falls back to the damped step of Mueller et al. 2016 where Newton's matrix is singular).
// first must be a multiple of 16.
void solve_shape_clusters(const ShapeModel& model, ClusterRotations& rotation, ShapeScratch& scratch, uint32_t first,
                          uint32_t last);
// Rows of groups [first, last) from the positions of their particles.
void make_shape_rows(const ShapeModel& model, const Vec4* x, ShapeScratch& scratch, uint32_t first, uint32_t last);
// Sweep, pass 2 over groups [first, last), for each particle: dx = relaxation * (s (g - x) - (1 - s) moved) with s = w /
// (w + alpha / h^2). This is the XPBD update of a constraint with compliance alpha and multiplier moved / w. Also makes
// the rows of the next sweep, if there is one. Particles with inv_mass 0 stay.
void solve_shape_particles(const ShapeModel& model, Vec4* x, const float* inv_mass, float stiffness, float relaxation,
                           ShapeScratch& scratch, uint32_t first, uint32_t last, bool more = true);

}  // namespace catgut
