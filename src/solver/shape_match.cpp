// SPDX-License-Identifier: Apache-2.0
// solver/shape_match: see the header. Compiled once per instruction set (Highway) and chosen at run time. Multiplications and
// additions are separate (no fused multiply-add) so that every instruction set gives the same bits.
#include "solver/shape_match.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "solver/shape_match.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace catgut {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = hn::CappedTag<float, 16>;
using D4 = hn::FixedTag<float, 4>;
constexpr size_t kLanes = HWY_MIN(16, HWY_MAX_BYTES / sizeof(float));
constexpr size_t kParts = 16 / kLanes;

// Rows (or transforms) as registers.
struct Parts {
  hn::Vec<D> part[kParts];
};

// Sum of the `n` rows named by `index`, a multiple of 4; kRows: n if known at compile time, else 0. Four independent partial
// sums hide the latency of the additions.
template <uint32_t kRows>
HWY_INLINE Parts SumRows(const float* HWY_RESTRICT row, const uint32_t* HWY_RESTRICT index, uint32_t n) {
  const D d;
  Parts acc[4];
  for (size_t k = 0; k < 4; ++k)
    for (size_t p = 0; p < kParts; ++p) acc[k].part[p] = hn::Load(d, row + index[k] + p * kLanes);
  for (uint32_t i = 4; i < (kRows > 0 ? kRows : n); i += 4)
    for (size_t k = 0; k < 4; ++k)
      for (size_t p = 0; p < kParts; ++p)
        acc[k].part[p] = hn::Add(acc[k].part[p], hn::Load(d, row + index[i + k] + p * kLanes));
  Parts sum;
  for (size_t p = 0; p < kParts; ++p)
    sum.part[p] = hn::Add(hn::Add(acc[0].part[p], acc[1].part[p]), hn::Add(acc[2].part[p], acc[3].part[p]));
  return sum;
}
constexpr uint32_t kShell = 8;  // rows in a sum for a two-layer wall: seven neighbors, padded

// Component of (q, 1) by which each lane of a row is multiplied: column j of the moments is m x q_j.
alignas(64) constexpr int32_t kColumn[16] = {0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3};

// Whether each of these groups has two particles, as in most of a two-layer wall.
HWY_INLINE bool AllPairs(const uint32_t* HWY_RESTRICT group, uint32_t first, uint32_t last) {
  uint32_t other = 0;
  for (uint32_t g = first; g < last; ++g) other |= (group[g + 1] - group[g]) ^ 2u;
  return other == 0;
}

void MakeRows(const ShapeModel& model, const Vec4* x, ShapeScratch& scratch, uint32_t first, uint32_t last) {
  const D d;
  Row* row = scratch.row.data();
  const Vec4* rest = model.weighted_rest.data();
  const uint32_t* group = model.group_first.data();
  // Each part extracts its own columns of a (q, 1) that is repeated in every block of four lanes.
  hn::Vec<hn::RebindToSigned<D>> lanes[kParts];
  for (size_t p = 0; p < kParts; ++p) lanes[p] = hn::Load(hn::RebindToSigned<D>(), kColumn + p * kLanes);
  auto add = [&](Parts& sum, uint32_t i) HWY_ATTR {
    const auto at = hn::LoadDup128(d, &x[i].x), q = hn::LoadDup128(d, &rest[i].x);
    for (size_t p = 0; p < kParts; ++p)
      sum.part[p] = hn::Add(sum.part[p], hn::Mul(at, hn::TableLookupLanes(q, hn::IndicesFromVec(d, lanes[p]))));
  };
  auto of_group = [&](uint32_t g, uint32_t i, uint32_t end) HWY_ATTR {
    Parts sum;
    for (size_t p = 0; p < kParts; ++p) sum.part[p] = hn::Zero(d);
    for (; i < end; ++i) add(sum, i);
    for (size_t p = 0; p < kParts; ++p) hn::Store(sum.part[p], d, row[g].f + p * kLanes);
  };
  if (AllPairs(group, first, last))
    for (uint32_t g = first, i = group[first]; g < last; ++g, i += 2) of_group(g, i, i + 2);
  else
    for (uint32_t g = first; g < last; ++g) of_group(g, group[g], group[g + 1]);
}

// Registers of four-lane blocks: swaps blocks with registers, like rows and columns of a matrix.
template <class Dx, class V = hn::Vec<Dx>>
HWY_INLINE void TransposeBlocks(Dx d, V* HWY_RESTRICT v) {
  if constexpr (kLanes == 16) {
    const V low02 = hn::ConcatLowerLower(d, v[2], v[0]), high02 = hn::ConcatUpperUpper(d, v[2], v[0]);
    const V low13 = hn::ConcatLowerLower(d, v[3], v[1]), high13 = hn::ConcatUpperUpper(d, v[3], v[1]);
    v[0] = hn::OddEvenBlocks(hn::SwapAdjacentBlocks(low13), low02);
    v[1] = hn::OddEvenBlocks(low13, hn::SwapAdjacentBlocks(low02));
    v[2] = hn::OddEvenBlocks(hn::SwapAdjacentBlocks(high13), high02);
    v[3] = hn::OddEvenBlocks(high13, hn::SwapAdjacentBlocks(high02));
  } else if constexpr (kLanes == 8) {
    const V low = hn::ConcatLowerLower(d, v[1], v[0]), high = hn::ConcatUpperUpper(d, v[1], v[0]);
    v[0] = low, v[1] = high;
  }
}

// The same within each block: swaps lanes with the four registers.
template <class Dx, class V = hn::Vec<Dx>>
HWY_INLINE void TransposeLanes(Dx d, V* HWY_RESTRICT v) {
  const hn::Repartition<double, Dx> pairs;
  const auto low01 = hn::BitCast(pairs, hn::InterleaveLower(d, v[0], v[1]));
  const auto low23 = hn::BitCast(pairs, hn::InterleaveLower(d, v[2], v[3]));
  const auto high01 = hn::BitCast(pairs, hn::InterleaveUpper(d, v[0], v[1]));
  const auto high23 = hn::BitCast(pairs, hn::InterleaveUpper(d, v[2], v[3]));
  v[0] = hn::BitCast(d, hn::InterleaveLower(pairs, low01, low23));
  v[1] = hn::BitCast(d, hn::InterleaveUpper(pairs, low01, low23));
  v[2] = hn::BitCast(d, hn::InterleaveLower(pairs, high01, high23));
  v[3] = hn::BitCast(d, hn::InterleaveUpper(pairs, high01, high23));
}

// Rows of kLanes clusters <-> registers with one component of each: column[j][k] is component k of column j. Clusters k, 4 + k,
// 8 + k ... pass through TransposeBlocks together, so that TransposeLanes leaves each in the lane of its own number.
template <class Dx, class V = hn::Vec<Dx>>
HWY_INLINE void ColumnsOfRows(Dx d, const float (*HWY_RESTRICT row)[16], V (*HWY_RESTRICT column)[4]) {
  constexpr size_t kBlocks = kLanes / 4;
  for (size_t k = 0; k < 4; ++k)
    for (size_t p = 0; p < kParts; ++p) {
      V v[kBlocks];
      for (size_t b = 0; b < kBlocks; ++b) v[b] = hn::Load(d, row[4 * b + k] + p * kLanes);
      TransposeBlocks(d, v);
      for (size_t b = 0; b < kBlocks; ++b) column[p * kBlocks + b][k] = v[b];
    }
  for (size_t j = 0; j < 4; ++j) TransposeLanes(d, column[j]);
}
template <class Dx, class V = hn::Vec<Dx>>
HWY_INLINE void RowsOfColumns(Dx d, V (*HWY_RESTRICT column)[4], float (*HWY_RESTRICT row)[16]) {
  constexpr size_t kBlocks = kLanes / 4;
  for (size_t j = 0; j < 4; ++j) TransposeLanes(d, column[j]);
  for (size_t k = 0; k < 4; ++k)
    for (size_t p = 0; p < kParts; ++p) {
      V v[kBlocks];
      for (size_t b = 0; b < kBlocks; ++b) v[b] = column[p * kBlocks + b][k];
      TransposeBlocks(d, v);
      for (size_t b = 0; b < kBlocks; ++b) hn::Store(v[b], d, row[4 * b + k] + p * kLanes);
    }
}

// N registers in lockstep. A polar decomposition is a long dependency chain with divisions and a square root; two interleaved
// ones take hardly longer than one.
template <size_t N>
struct Wide {
  hn::Vec<D> part[N];
};
template <size_t N, class Op>
HWY_INLINE Wide<N> Each(const Op& op) {
  Wide<N> w;
  for (size_t k = 0; k < N; ++k) w.part[k] = op(k);
  return w;
}
template <size_t N>
HWY_INLINE Wide<N> operator+(Wide<N> a, Wide<N> b) {
  return Each<N>([&](size_t k) HWY_ATTR { return hn::Add(a.part[k], b.part[k]); });
}
template <size_t N>
HWY_INLINE Wide<N> operator-(Wide<N> a, Wide<N> b) {
  return Each<N>([&](size_t k) HWY_ATTR { return hn::Sub(a.part[k], b.part[k]); });
}
template <size_t N>
HWY_INLINE Wide<N> operator*(Wide<N> a, Wide<N> b) {
  return Each<N>([&](size_t k) HWY_ATTR { return hn::Mul(a.part[k], b.part[k]); });
}
template <size_t N>
HWY_INLINE Wide<N> operator/(Wide<N> a, Wide<N> b) {
  return Each<N>([&](size_t k) HWY_ATTR { return hn::Div(a.part[k], b.part[k]); });
}
template <size_t N>
HWY_INLINE Wide<N> operator-(Wide<N> a) {
  return Each<N>([&](size_t k) HWY_ATTR { return hn::Neg(a.part[k]); });
}
template <size_t N>
HWY_INLINE Wide<N> Abs(Wide<N> a) {
  return Each<N>([&](size_t k) HWY_ATTR { return hn::Abs(a.part[k]); });
}
template <size_t N>
HWY_INLINE Wide<N> Max(Wide<N> a, Wide<N> b) {
  return Each<N>([&](size_t k) HWY_ATTR { return hn::Max(a.part[k], b.part[k]); });
}
template <size_t N>
HWY_INLINE Wide<N> Sqrt(Wide<N> a) {
  return Each<N>([&](size_t k) HWY_ATTR { return hn::Sqrt(a.part[k]); });
}
template <size_t N>
HWY_INLINE Wide<N> Number(float value) {
  return Each<N>([&](size_t) HWY_ATTR { return hn::Set(D(), value); });
}
template <size_t N>
HWY_INLINE Wide<N> LoadWide(const float* from) {
  return Each<N>([&](size_t k) HWY_ATTR { return hn::Load(D(), from + k * kLanes); });
}
template <size_t N>
HWY_INLINE void StoreWide(Wide<N> a, float* to) {
  for (size_t k = 0; k < N; ++k) hn::Store(a.part[k], D(), to + k * kLanes);
}

template <size_t N>
struct Wide3 {
  Wide<N> x, y, z;
};
template <size_t N>
HWY_INLINE Wide<N> Dot(const Wide3<N>& a, const Wide3<N>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

// Columns of the rotation of a unit quaternion.
template <size_t N>
HWY_INLINE void Columns(const Wide3<N>& q, Wide<N> w, Wide3<N>* HWY_RESTRICT r) {
  const Wide<N> one = Number<N>(1.0f), two = Number<N>(2.0f);
  const Wide<N> xx = q.x * q.x, yy = q.y * q.y, zz = q.z * q.z;
  const Wide<N> xy = q.x * q.y, xz = q.x * q.z, yz = q.y * q.z;
  const Wide<N> wx = w * q.x, wy = w * q.y, wz = w * q.z;
  r[0] = {one - two * (yy + zz), two * (xy + wz), two * (xz - wy)};
  r[1] = {two * (xy - wz), one - two * (xx + zz), two * (yz + wx)};
  r[2] = {two * (xz + wy), two * (yz - wx), one - two * (xx + yy)};
}

// Rows of moments in, rows of transforms out, in place, for N * kLanes clusters from `at` on.
template <size_t N>
HWY_INLINE void MatchClusters(const ShapeModel& model, ClusterRotations& rotation, size_t at, float (*HWY_RESTRICT row)[16]) {
  const D d;
  Wide<N> m[4][4];  // component k of column j: x, y, z, count
  for (size_t part = 0; part < N; ++part) {
    hn::Vec<D> column[4][4];
    ColumnsOfRows(d, row + part * kLanes, column);
    for (size_t j = 0; j < 4; ++j)
      for (size_t k = 0; k < 4; ++k) m[j][k].part[part] = column[j][k];
  }
  const Wide<N> one = Number<N>(1.0f), half = Number<N>(0.5f), tiny = Number<N>(1e-30f);
  const Wide<N> inv = LoadWide<N>(model.inv_cluster_mass.data() + at);
  const Wide3<N> c{m[3][0] * inv, m[3][1] * inv, m[3][2] * inv};
  // A = sum m (x - c) q^T: centered after summing.
  Wide3<N> a[3], r[3];
  for (size_t j = 0; j < 3; ++j) a[j] = {m[j][0] - c.x * m[j][3], m[j][1] - c.y * m[j][3], m[j][2] - c.z * m[j][3]};

  Wide3<N> q{LoadWide<N>(rotation.x.data() + at), LoadWide<N>(rotation.y.data() + at), LoadWide<N>(rotation.z.data() + at)};
  Wide<N> w = LoadWide<N>(rotation.w.data() + at);
  Columns(q, w, r);
  // B = R^T A in the cluster's own frame. At the optimum B is symmetric. The axial vector g of its antisymmetric part is
  // the gradient and H = tr(B) 1 - sym(B) the Hessian of the rotation (Kugelstadt et al. 2018, analytic polar).
  const Wide<N> b00 = Dot(r[0], a[0]), b01 = Dot(r[0], a[1]), b02 = Dot(r[0], a[2]);
  const Wide<N> b10 = Dot(r[1], a[0]), b11 = Dot(r[1], a[1]), b12 = Dot(r[1], a[2]);
  const Wide<N> b20 = Dot(r[2], a[0]), b21 = Dot(r[2], a[1]), b22 = Dot(r[2], a[2]);
  const Wide3<N> g{b21 - b12, b02 - b20, b10 - b01};
  const Wide<N> trace = b00 + b11 + b22;
  const Wide<N> h00 = trace - b00, h11 = trace - b11, h22 = trace - b22;
  const Wide<N> h01 = -(half * (b01 + b10)), h02 = -(half * (b02 + b20)), h12 = -(half * (b12 + b21));
  const Wide<N> k00 = h11 * h22 - h12 * h12, k01 = h02 * h12 - h01 * h22, k02 = h01 * h12 - h02 * h11;
  const Wide<N> k11 = h00 * h22 - h02 * h02, k12 = h01 * h02 - h00 * h12, k22 = h00 * h11 - h01 * h01;
  const Wide<N> det = h00 * k00 + h01 * k01 + h02 * k02;
  const Wide<N> size = Max(Abs(trace), tiny);
  const Wide<N> inv_det = one / Max(det, tiny);
  Wide3<N> turn{inv_det * (k00 * g.x + k01 * g.y + k02 * g.z), inv_det * (k01 * g.x + k11 * g.y + k12 * g.z),
                inv_det * (k02 * g.x + k12 * g.y + k22 * g.z)};
  // Positive definite with a margin and a step below half a radian; otherwise the unconditionally stable damped step g / tr.
  const Wide<N> step2 = Dot(turn, turn), least = Number<N>(1e-3f) * (size * (size * size));
  for (size_t k = 0; k < N; ++k) {
    const auto safe = hn::And(hn::And(hn::Gt(trace.part[k], tiny.part[k]), hn::Gt(det.part[k], least.part[k])),
                              hn::Lt(step2.part[k], hn::Set(d, 0.25f)));
    if (HWY_LIKELY(hn::AllTrue(d, safe))) continue;
    // Bounded by one even without a defined rotation (the moments of a cluster shrunk to a point are rounding errors).
    const auto sum = hn::Add(hn::Add(hn::Abs(g.x.part[k]), hn::Abs(g.y.part[k])), hn::Abs(g.z.part[k]));
    const auto damp = hn::Div(one.part[k], hn::Add(size.part[k], sum));
    turn.x.part[k] = hn::IfThenElse(safe, turn.x.part[k], hn::Mul(damp, g.x.part[k]));
    turn.y.part[k] = hn::IfThenElse(safe, turn.y.part[k], hn::Mul(damp, g.y.part[k]));
    turn.z.part[k] = hn::IfThenElse(safe, turn.z.part[k], hn::Mul(damp, g.z.part[k]));
  }
  // q <- q (1, turn/2), renormalized: the rotation is in the cluster's own frame, hence on the right.
  const Wide3<N> t{half * turn.x, half * turn.y, half * turn.z};
  const Wide<N> nx = q.x + (w * t.x + (q.y * t.z - q.z * t.y)), ny = q.y + (w * t.y + (q.z * t.x - q.x * t.z));
  const Wide<N> nz = q.z + (w * t.z + (q.x * t.y - q.y * t.x)), nw = w - Dot(q, t);
  const Wide<N> norm = one / Sqrt((nx * nx + ny * ny) + (nz * nz + nw * nw));
  q = {nx * norm, ny * norm, nz * norm}, w = nw * norm;
  StoreWide(q.x, rotation.x.data() + at), StoreWide(q.y, rotation.y.data() + at);
  StoreWide(q.z, rotation.z.data() + at), StoreWide(w, rotation.w.data() + at);
  Columns(q, w, r);
  // Translation: c - R c0.
  const Wide<N> c0x = LoadWide<N>(model.rest_center[0].data() + at), c0y = LoadWide<N>(model.rest_center[1].data() + at);
  const Wide<N> c0z = LoadWide<N>(model.rest_center[2].data() + at);
  const Wide3<N> to{c.x - (r[0].x * c0x + r[1].x * c0y + r[2].x * c0z), c.y - (r[0].y * c0x + r[1].y * c0y + r[2].y * c0z),
                    c.z - (r[0].z * c0x + r[1].z * c0y + r[2].z * c0z)};
  const Wide3<N>* affine[4] = {&r[0], &r[1], &r[2], &to};
  for (size_t part = 0; part < N; ++part) {
    hn::Vec<D> column[4][4];
    for (size_t j = 0; j < 4; ++j) {
      column[j][0] = affine[j]->x.part[part], column[j][1] = affine[j]->y.part[part];
      column[j][2] = affine[j]->z.part[part], column[j][3] = hn::Zero(d);
    }
    RowsOfColumns(d, column, row + part * kLanes);
  }
}

template <uint32_t kStride>
HWY_INLINE void ClustersOf(const ShapeModel& model, ClusterRotations& rotation, ShapeScratch& scratch, uint32_t first,
                           uint32_t last) {
  const D d;
  const float* row = scratch.row.data()->f;
  const uint32_t stride = kStride > 0 ? kStride : model.member_stride;
  const uint32_t* member = model.group_member.data() + size_t{first} * stride;
  constexpr uint32_t kMost = HWY_MAX(16, 2 * kLanes);
  alignas(64) float moment[kMost][16];
  for (uint32_t base = first; base < last; base += kMost) {
    const uint32_t n = HWY_MIN(kMost, last - base), padded = (n + 15) / 16 * 16;
    for (uint32_t c = 0; c < padded; ++c, member += stride) {
      const Parts sum = SumRows<kStride>(row, member, stride);
      for (size_t p = 0; p < kParts; ++p) hn::Store(sum.part[p], d, moment[c] + p * kLanes);
    }
    uint32_t c = 0;
    for (; c + 2 * kLanes <= padded; c += 2 * kLanes) MatchClusters<2>(model, rotation, base + c, moment + c);
    if (c < padded) MatchClusters<1>(model, rotation, base + c, moment + c);
    // Not beyond the last cluster: the transform after it stays zero.
    for (c = 0; c < n; ++c)
      for (size_t p = 0; p < kParts; ++p)
        hn::Store(hn::Load(d, moment[c] + p * kLanes), d, scratch.transform[base + c].f + p * kLanes);
  }
}
void Clusters(const ShapeModel& model, ClusterRotations& rotation, ShapeScratch& scratch, uint32_t first, uint32_t last) {
  if (model.member_stride == kShell) ClustersOf<kShell>(model, rotation, scratch, first, last);
  else ClustersOf<0>(model, rotation, scratch, first, last);
}

// Column j of the mean transforms of groups g, g + 1, ... in the order of their particles: one block each, two per group.
struct PairColumns {
  hn::Vec<D> column[4];
};
constexpr uint32_t kPairs = HWY_MAX(1, kLanes / 8);  // groups of two that fill a register of eight lanes or more
template <class Dx>
HWY_INLINE PairColumns SpreadColumns(Dx d, const Parts* HWY_RESTRICT mean) {
  PairColumns of;
  if constexpr (kLanes == 16) {
    alignas(64) constexpr int32_t kEven[16] = {0, 1, 2, 3, 0, 1, 2, 3, 8, 9, 10, 11, 8, 9, 10, 11};
    alignas(64) constexpr int32_t kOdd[16] = {4, 5, 6, 7, 4, 5, 6, 7, 12, 13, 14, 15, 12, 13, 14, 15};
    const auto even = hn::SetTableIndices(d, kEven), odd = hn::SetTableIndices(d, kOdd);
    const auto low = hn::ConcatLowerLower(d, mean[1].part[0], mean[0].part[0]);
    const auto high = hn::ConcatUpperUpper(d, mean[1].part[0], mean[0].part[0]);
    of.column[0] = hn::TableLookupLanes(low, even), of.column[1] = hn::TableLookupLanes(low, odd);
    of.column[2] = hn::TableLookupLanes(high, even), of.column[3] = hn::TableLookupLanes(high, odd);
  } else if constexpr (kLanes == 8) {
    for (size_t p = 0; p < 2; ++p) {
      of.column[2 * p] = hn::ConcatLowerLower(d, mean[0].part[p], mean[0].part[p]);
      of.column[2 * p + 1] = hn::ConcatUpperUpper(d, mean[0].part[p], mean[0].part[p]);
    }
  }
  return of;
}

template <uint32_t kStride>
HWY_INLINE void ParticlesOf(const ShapeModel& model, Vec4* HWY_RESTRICT x, const float* HWY_RESTRICT inv_mass, float stiffness,
                            float relaxation, ShapeScratch& scratch, uint32_t first, uint32_t last) {
  const D d;
  const D4 d4;
  const float* transform = scratch.transform.data()->f;
  Vec4* HWY_RESTRICT move = scratch.moved.data();
  const Vec4* rest = model.rest.data();
  const uint32_t *holder = model.holder.data(), *group = model.group_first.data();
  const float* inv_holders = model.inv_holders.data();
  const uint32_t stride = kStride > 0 ? kStride : model.holder_stride;
  // Lane 3 (the constant 1 of a position) must not move.
  alignas(16) const float relax[4] = {relaxation, relaxation, relaxation, 0};
  auto mean_of = [&](uint32_t g) HWY_ATTR {  // of the transforms of a group's clusters
    Parts mean = SumRows<kStride>(transform, holder + size_t{g} * stride, stride);
    for (size_t p = 0; p < kParts; ++p) mean.part[p] = hn::Mul(mean.part[p], hn::Set(d, inv_holders[g]));
    return mean;
  };
  // As many particles from i on as dp has blocks of four lanes.
  auto move_at = [&](auto dp, const auto* column, uint32_t i) HWY_ATTR {
    const auto q = hn::LoadU(dp, &rest[i].x), at = hn::LoadU(dp, &x[i].x), moved = hn::LoadU(dp, &move[i].x);
    const auto goal = hn::Add(hn::Add(hn::Mul(column[0], hn::Broadcast<0>(q)), hn::Mul(column[1], hn::Broadcast<1>(q))),
                              hn::Add(hn::Mul(column[2], hn::Broadcast<2>(q)), column[3]));
    const auto dx = hn::Mul(hn::LoadDup128(dp, relax), hn::Sub(hn::Mul(hn::Set(dp, stiffness), hn::Sub(goal, at)),
                                                               hn::Mul(hn::Set(dp, 1.0f - stiffness), moved)));
    hn::StoreU(hn::Add(at, dx), dp, &x[i].x);
    hn::StoreU(hn::Add(moved, dx), dp, &move[i].x);
  };
  auto move_group = [&](const Parts& mean, uint32_t g) HWY_ATTR {
    alignas(64) float f[16];
    for (size_t p = 0; p < kParts; ++p) hn::Store(mean.part[p], d, f + p * kLanes);
    const hn::Vec<D4> column[4] = {hn::Load(d4, f), hn::Load(d4, f + 4), hn::Load(d4, f + 8), hn::Load(d4, f + 12)};
    for (uint32_t i = group[g]; i < group[g + 1]; ++i)
      if (inv_mass[i] != 0) move_at(d4, column, i);
  };
  uint32_t g = first;
  if constexpr (kLanes >= 8) {
    if (AllPairs(group, first, last))
      for (; g + kPairs <= last; g += kPairs) {
        Parts mean[kPairs];
        float all = 1;  // nonzero unless one of them is pinned
        for (uint32_t k = 0; k < kPairs; ++k) {
          mean[k] = mean_of(g + k);
          all *= inv_mass[group[g] + 2 * k] * inv_mass[group[g] + 2 * k + 1];
        }
        if (HWY_LIKELY(all != 0)) move_at(d, SpreadColumns(d, mean).column, group[g]);
        else
          for (uint32_t k = 0; k < kPairs; ++k) move_group(mean[k], g + k);
      }
  }
  for (; g < last; ++g) move_group(mean_of(g), g);
}
void ShapeParticles(const ShapeModel& model, Vec4* x, const float* inv_mass, float stiffness, float relaxation,
                    ShapeScratch& scratch, uint32_t first, uint32_t last, bool more) {
  if (model.holder_stride == kShell) ParticlesOf<kShell>(model, x, inv_mass, stiffness, relaxation, scratch, first, last);
  else ParticlesOf<0>(model, x, inv_mass, stiffness, relaxation, scratch, first, last);
  if (more) MakeRows(model, x, scratch, first, last);
}

}  // namespace HWY_NAMESPACE
}  // namespace catgut
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <algorithm>
#include <map>

#include "core/check.h"

namespace catgut {

HWY_EXPORT(MakeRows);
HWY_EXPORT(Clusters);
HWY_EXPORT(ShapeParticles);

void make_shape_rows(const ShapeModel& model, const Vec4* x, ShapeScratch& scratch, uint32_t first, uint32_t last) {
  HWY_DYNAMIC_DISPATCH(MakeRows)(model, x, scratch, first, last);
}
void solve_shape_clusters(const ShapeModel& model, ClusterRotations& rotation, ShapeScratch& scratch, uint32_t first,
                          uint32_t last) {
  HWY_DYNAMIC_DISPATCH(Clusters)(model, rotation, scratch, first, last);
}
void solve_shape_particles(const ShapeModel& model, Vec4* x, const float* inv_mass, float stiffness, float relaxation,
                           ShapeScratch& scratch, uint32_t first, uint32_t last, bool more) {
  HWY_DYNAMIC_DISPATCH(ShapeParticles)(model, x, inv_mass, stiffness, relaxation, scratch, first, last, more);
}

void ClusterRotations::reset(uint32_t clusters) {
  const size_t padded = (clusters + 15) / 16 * 16;
  x.assign(padded, 0), y.assign(padded, 0), z.assign(padded, 0), w.assign(padded, 1);
}

void ShapeScratch::resize(const ShapeModel& model) {
  row.assign(model.groups + 1, Row{});
  transform.assign(model.clusters + 1, Row{});
  moved.assign(model.rest.size(), Vec4{});
}

ShapeModel make_shape_model(std::span<const Vec3> rest, std::span<const float> mass,
                            std::span<const std::vector<uint32_t>> cluster) {
  constexpr uint32_t kRow = sizeof(Row) / sizeof(float);
  ShapeModel m;
  const uint32_t particles = static_cast<uint32_t>(rest.size());
  // The sorted members are the key: partners across the wall list the same neighborhood.
  std::map<std::vector<uint32_t>, uint32_t> known;
  std::vector<const std::vector<uint32_t>*> unique;
  for (const std::vector<uint32_t>& c : cluster) {
    std::vector<uint32_t> key = c;
    std::sort(key.begin(), key.end());
    const auto [at, fresh] = known.try_emplace(std::move(key), static_cast<uint32_t>(unique.size()));
    if (fresh) unique.push_back(&c);
    m.cluster_of.push_back(at->second);
  }
  m.clusters = static_cast<uint32_t>(unique.size());
  double total = 0;
  for (float k : mass) total += k;
  for (uint32_t i = 0; i < particles; ++i) {
    m.rest.push_back(point(rest[i]));
    m.relative_mass.push_back(static_cast<float>(mass[i] * particles / total));
    const Vec3 weighted = rest[i] * m.relative_mass[i];
    m.weighted_rest.push_back({weighted.x, weighted.y, weighted.z, m.relative_mass[i]});
  }
  std::vector<std::vector<uint32_t>> holders(particles);
  size_t widest = 4;
  for (uint32_t c = 0; c < m.clusters; ++c) {
    widest = std::max(widest, unique[c]->size());
    for (uint32_t k : *unique[c]) holders[k].push_back(c);
  }
  m.cluster_stride = static_cast<uint32_t>((widest + 3) / 4 * 4);
  m.member.assign(size_t{m.clusters} * m.cluster_stride, particles);
  for (Column<float>& axis : m.rest_center) axis.assign((m.clusters + 15) / 16 * 16, 0.0f);
  for (uint32_t c = 0; c < m.clusters; ++c) {
    double sum = 0, sx = 0, sy = 0, sz = 0;
    for (size_t k = 0; k < unique[c]->size(); ++k) {
      const uint32_t id = (*unique[c])[k];
      m.member[size_t{c} * m.cluster_stride + k] = id;
      const double w = m.relative_mass[id];
      sum += w, sx += w * rest[id].x, sy += w * rest[id].y, sz += w * rest[id].z;
    }
    m.rest_center[0][c] = static_cast<float>(sx / sum), m.rest_center[1][c] = static_cast<float>(sy / sum);
    m.rest_center[2][c] = static_cast<float>(sz / sum);
  }
  // Groups: runs of particles with the same list of clusters.
  for (uint32_t i = 0; i < particles; ++i) {
    CATGUT_CHECK(!holders[i].empty());
    if (i == 0 || holders[i] != holders[i - 1]) m.group_first.push_back(i);
  }
  m.groups = static_cast<uint32_t>(m.group_first.size());
  m.group_first.push_back(particles);
  const auto padded = [](size_t n) { return static_cast<uint32_t>((std::max<size_t>(n, 4) + 3) / 4 * 4); };
  widest = 0;
  for (uint32_t g = 0; g < m.groups; ++g) widest = std::max(widest, holders[m.group_first[g]].size());
  m.holder_stride = padded(widest);
  m.holder.assign(size_t{m.groups} * m.holder_stride, kRow * m.clusters);
  std::vector<std::vector<uint32_t>> held(m.clusters);
  for (uint32_t g = 0; g < m.groups; ++g) {
    const std::vector<uint32_t>& h = holders[m.group_first[g]];
    for (size_t k = 0; k < h.size(); ++k) {
      m.holder[size_t{g} * m.holder_stride + k] = kRow * h[k];
      held[h[k]].push_back(g);
    }
    m.inv_holders.push_back(1.0f / static_cast<float>(h.size()));
  }
  widest = 0;
  for (const auto& g : held) widest = std::max(widest, g.size());
  m.member_stride = padded(widest);
  const size_t batched = m.rest_center[0].size();
  m.group_member.assign(batched * m.member_stride, kRow * m.groups);
  for (size_t at = 0; at < batched; ++at) {
    const size_t c = std::min<size_t>(at, m.clusters - 1);  // padding repeats the last cluster
    for (size_t k = 0; k < held[c].size(); ++k) m.group_member[at * m.member_stride + k] = kRow * held[c][k];
    // In the order in which the kernels add rows, so that it equals the mass in the moments.
    float part[4] = {};
    for (size_t k = 0; k < held[c].size(); ++k) {
      float row = 0;
      for (uint32_t i = m.group_first[held[c][k]]; i < m.group_first[held[c][k] + 1]; ++i) row += m.relative_mass[i];
      part[k % 4] += row;
    }
    m.inv_cluster_mass.push_back(1.0f / ((part[0] + part[1]) + (part[2] + part[3])));
  }
  return m;
}

}  // namespace catgut
#endif  // HWY_ONCE
