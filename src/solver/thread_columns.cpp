// SPDX-License-Identifier: Apache-2.0
// solver/thread_columns: see the header. Compiled once per instruction set (Highway); no fused multiply-add, as in shape_match.
#include "solver/thread_columns.h"

#include "solver/thread.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "solver/thread_columns.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace catgut {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = hn::CappedTag<float, 16>;
using V = hn::Vec<D>;
struct V3 {
  V x, y, z;
};
HWY_INLINE V3 operator+(V3 a, V3 b) { return {hn::Add(a.x, b.x), hn::Add(a.y, b.y), hn::Add(a.z, b.z)}; }
HWY_INLINE V3 operator-(V3 a, V3 b) { return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)}; }
HWY_INLINE V3 operator*(V3 a, V s) { return {hn::Mul(a.x, s), hn::Mul(a.y, s), hn::Mul(a.z, s)}; }
HWY_INLINE V Dot(V3 a, V3 b) { return hn::Add(hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y)), hn::Mul(a.z, b.z)); }

// Elements i .. i + lanes - 1; any i from -1 on.
HWY_INLINE V Get(const PaddedColumn<float>& c, ptrdiff_t i) { return hn::LoadU(D(), c.data() + i); }
HWY_INLINE V3 Get3(const PaddedColumn<float>& x, const PaddedColumn<float>& y, const PaddedColumn<float>& z, ptrdiff_t i) {
  return {Get(x, i), Get(y, i), Get(z, i)};
}
HWY_INLINE void Put(V v, PaddedColumn<float>& c, ptrdiff_t i) { hn::StoreU(v, D(), c.data() + i); }
HWY_INLINE void Put3(V3 v, PaddedColumn<float>& x, PaddedColumn<float>& y, PaddedColumn<float>& z, ptrdiff_t i) {
  Put(v.x, x, i), Put(v.y, y, i), Put(v.z, z, i);
}
constexpr ptrdiff_t kStep = HWY_MIN(16, HWY_MAX_BYTES / sizeof(float));
// Lanes of elements below `count`.
HWY_INLINE hn::Mask<D> In(ptrdiff_t i, size_t count) {
  const ptrdiff_t left = static_cast<ptrdiff_t>(count) - i;
  return hn::FirstN(D(), static_cast<size_t>(left < 0 ? 0 : left));
}

float FindDirections(ThreadScratch& s, size_t pairs, float alpha_per_meter) {
  const D d;
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0f), shortest = hn::Set(d, 1e-5f), apart = hn::Set(d, 1e-12f);
  V worst = zero;
  // One beyond the last: it has no pair, so its direction is zero, and the last node reads it.
  for (ptrdiff_t i = 0; i <= static_cast<ptrdiff_t>(pairs); i += kStep) {
    const auto in = In(i, pairs);
    const V3 way = Get3(s.x, s.y, s.z, i + 1) - Get3(s.x, s.y, s.z, i);
    const V length = hn::Sqrt(Dot(way, way)), rest = Get(s.rest, i), intact = Get(s.intact, i);
    const auto distinct = hn::Gt(length, apart);
    const V inverse = hn::Div(one, hn::IfThenElse(distinct, length, one));
    const V3 n{hn::IfThenElseZero(distinct, hn::Mul(way.x, inverse)),
               hn::IfThenElse(distinct, hn::Mul(way.y, inverse), one),  // without a direction, any is as good
               hn::IfThenElseZero(distinct, hn::Mul(way.z, inverse))};
    const V there = hn::IfThenElseZero(in, intact);
    Put3(n * there, s.nx, s.ny, s.nz, i);
    Put(hn::Mul(there, hn::Div(one, hn::Max(length, shortest))), s.inv_length, i);
    const V alpha = hn::IfThenElseZero(in, hn::Mul(hn::Set(d, alpha_per_meter), rest));
    const V residual = hn::Mul(there, hn::Sub(hn::Sub(rest, length), hn::Mul(alpha, Get(s.lambda, i))));
    Put(alpha, s.alpha, i);
    Put(residual, s.residual, i);
    worst = hn::Max(worst, hn::Abs(residual));
  }
  return hn::GetLane(hn::MaxOfLanes(d, worst));
}

void FindMasses(ThreadScratch& s, size_t nodes, float h) {
  const D d;
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0f), half = hn::Set(d, 0.5f);
  const V h2 = hn::Set(d, h * h), minus_inv_h2 = hn::Set(d, -1 / (h * h));
  for (ptrdiff_t i = 0; i < static_cast<ptrdiff_t>(nodes); i += kStep) {
    const V c = Dot(Get3(s.nx, s.ny, s.nz, i - 1), Get3(s.nx, s.ny, s.nz, i)), w = Get(s.w, i);
    const V before = hn::Max(Get(s.tension, i - 1), hn::Mul(Get(s.lambda, i - 1), minus_inv_h2));
    const V after = hn::Max(Get(s.tension, i), hn::Mul(Get(s.lambda, i), minus_inv_h2));
    const V pull = hn::Min(before, after);
    auto taut = hn::And(hn::Gt(pull, zero), hn::Gt(c, hn::Set(d, -0.999f)));
    taut = hn::And(taut, hn::Gt(Get(s.is_free, i), zero));
    const V curve = hn::Add(Get(s.inv_length, i - 1), Get(s.inv_length, i));
    const V ratio = hn::Div(one, hn::Add(one, hn::Mul(hn::Mul(hn::Mul(w, h2), pull), curve)));
    const V side = hn::IfThenElse(taut, ratio, one), give = hn::Sub(one, side), both = hn::Add(one, c);
    const V along = hn::Mul(hn::Mul(give, half), both);
    const V own = hn::Mul(w, hn::Add(side, along));
    Put(own, s.mass_before, i);
    Put(own, s.mass_after, i);
    Put(hn::Mul(w, hn::Add(hn::Mul(side, c), along)), s.across, i);
    Put(side, s.side, i);
    Put(hn::IfThenElseZero(taut, hn::Div(hn::Mul(give, half), hn::IfThenElse(taut, both, one))), s.tilt, i);
  }
}

void FindMatrix(ThreadScratch& s, size_t pairs, double regularization) {
  const hn::CappedTag<double, 8> dd;
  const hn::Rebind<float, decltype(dd)> df;
  using W = hn::Vec<decltype(dd)>;
  constexpr ptrdiff_t kLanes = HWY_MIN(8, HWY_MAX_BYTES / sizeof(double));
  const W whole = hn::Set(dd, 1 + regularization), one = hn::Set(dd, 1.0);
  auto get = [&](const PaddedColumn<float>& c, ptrdiff_t i) { return hn::PromoteTo(dd, hn::LoadU(df, c.data() + i)); };
  for (ptrdiff_t i = 0; i < static_cast<ptrdiff_t>(pairs); i += kLanes) {
    const W intact = get(s.intact, i), both = hn::Mul(intact, get(s.intact, i + 1));
    const W mass = hn::Mul(hn::Add(get(s.mass_after, i), get(s.mass_before, i + 1)), whole);
    const W diag = hn::Add(hn::Mul(intact, hn::Add(get(s.alpha, i), mass)), hn::Sub(one, intact));
    hn::StoreU(diag, dd, s.stretch.diag.data() + i);
    hn::StoreU(hn::Neg(hn::Mul(both, get(s.across, i + 1))), dd, s.stretch.off.data() + i);
    hn::StoreU(get(s.residual, i), dd, s.stretch.right[0].data() + i);  // 0 where cut
  }
}

void MoveLooseNodes(ThreadScratch& s, size_t nodes, float limit) {
  const D d;
  const V one = hn::Set(d, 1.0f), most = hn::Set(d, limit), most2 = hn::Set(d, limit * limit);
  for (ptrdiff_t i = 0; i < static_cast<ptrdiff_t>(nodes); i += kStep) {
    const V step = Get(s.step, i);
    const V3 n0 = Get3(s.nx, s.ny, s.nz, i - 1), n1 = Get3(s.nx, s.ny, s.nz, i), t = n0 + n1;
    V3 p = n0 * Get(s.step, i - 1) - n1 * step;
    p = p * Get(s.side, i) + t * hn::Mul(Get(s.tilt, i), Dot(p, t));
    p = p * hn::Mul(Get(s.w, i), Get(s.is_free, i));
    const V reach2 = Dot(p, p);
    const auto far = hn::Gt(reach2, most2);
    p = p * hn::IfThenElse(far, hn::Div(most, hn::Sqrt(hn::IfThenElse(far, reach2, one))), one);
    const auto in = In(i, nodes);
    const V3 at = Get3(s.x, s.y, s.z, i), moved = at + p;
    Put3({hn::IfThenElse(in, moved.x, at.x), hn::IfThenElse(in, moved.y, at.y), hn::IfThenElse(in, moved.z, at.z)}, s.x, s.y,
         s.z, i);
    Put(hn::Add(Get(s.lambda, i), step), s.lambda, i);
  }
}

void FindUnfitPairs(ThreadScratch& s, size_t pairs, float alpha_per_meter) {
  const D d;
  for (uint64_t& word : s.violated) word = 0;
  for (ptrdiff_t i = 0; i < static_cast<ptrdiff_t>(pairs); i += kStep) {
    const V3 way = Get3(s.x, s.y, s.z, i + 1) - Get3(s.x, s.y, s.z, i);
    const V rest = Get(s.rest, i), off = hn::Abs(hn::Sub(Dot(way, way), hn::Mul(rest, rest)));
    const V compliant = hn::Abs(hn::Mul(hn::Mul(hn::Set(d, alpha_per_meter), rest), Get(s.lambda, i)));
    auto violated = hn::Or(hn::Ge(off, hn::Mul(hn::Set(d, kFitLength), rest)), hn::Ge(compliant, hn::Set(d, kFitCompliant)));
    violated = hn::And(hn::And(violated, In(i, pairs)), hn::Gt(Get(s.intact, i), hn::Zero(d)));
    uint8_t bytes[8] = {};
    hn::StoreMaskBits(d, violated, bytes);
    const uint64_t bits = uint64_t{bytes[0]} | uint64_t{bytes[1]} << 8;
    s.violated[static_cast<size_t>(i) / 64] |= bits << (static_cast<size_t>(i) % 64);
  }
}

// The inertia and the weight in the prediction must see the same geometric stiffness as the constraints. Implicit Euler is
// (M + h^2 K) dx = h M v + h^2 f, with K the tension's Laplacian. Without it, a taut thread swings laterally as freely as
// a slack one, while its tension hardly restores it. It would gain energy, or settle
// stretched.
//   The velocity part, d = p - before - h^2 g, is smoothed by (1 + K) d' = d along the thread with locked nodes fixed. Rigid
//   motion of the thread is preserved, a taut thread loses its flutter, a slack one (no tension) is unchanged. The lateral part
//   of the weight is scaled by the node's own ratio, like its constraint impulses. At rest the two balance,
//   and the thread hangs as a catenary (catgut validate).
bool BeginSmoothing(ThreadScratch& s, size_t nodes, float inv_mass, float shortest, Vec3 fall, float h) {
  const D d;
  const V one = hn::Set(d, 1.0f), zero = hn::Zero(d), per_newton = hn::Set(d, h * h * inv_mass);
  V most = zero;
  for (ptrdiff_t i = 0; i < static_cast<ptrdiff_t>(nodes); i += kStep) {
    const V stiff = hn::IfThenElseZero(In(i, nodes), hn::Div(hn::Mul(hn::Max(zero, Get(s.tension, i)), per_newton),
                                                             hn::Max(Get(s.rest, i), hn::Set(d, shortest))));
    // Flush small values to zero (no denormal numbers). The last node has no pair: its tension is 0.
    Put(hn::IfThenElseZero(hn::Gt(stiff, hn::Set(d, 1e-9f)), stiff), s.stiff, i);
    most = hn::Max(most, stiff);
  }
  if (hn::GetLane(hn::MaxOfLanes(d, most)) <= 1e-3f) return false;
  const V3 weight{hn::Set(d, fall.x), hn::Set(d, fall.y), hn::Set(d, fall.z)};
  for (ptrdiff_t i = 0; i < static_cast<ptrdiff_t>(nodes); i += kStep) {
    const auto in = In(i, nodes);
    const V3 gone = Get3(s.x, s.y, s.z, i) - Get3(s.from_x, s.from_y, s.from_z, i) - weight * Get(s.is_free, i);
    Put3({hn::IfThenElseZero(in, gone.x), hn::IfThenElseZero(in, gone.y), hn::IfThenElseZero(in, gone.z)}, s.gone_x, s.gone_y,
         s.gone_z, i);
  }
  for (ptrdiff_t i = 0; i < static_cast<ptrdiff_t>(nodes); i += kStep) {
    const V is_free = Get(s.is_free, i), left = Get(s.stiff, i - 1), right = Get(s.stiff, i), after = Get(s.is_free, i + 1);
    const V held_left = hn::Mul(hn::Mul(left, is_free), hn::Sub(one, Get(s.is_free, i - 1)));
    const V held_right = hn::Mul(hn::Mul(right, is_free), hn::Sub(one, after));
    // The known motion of a held neighbor moves to the right-hand side; the matrix stays symmetric.
    const V3 rhs = Get3(s.gone_x, s.gone_y, s.gone_z, i) + Get3(s.gone_x, s.gone_y, s.gone_z, i - 1) * held_left +
                   Get3(s.gone_x, s.gone_y, s.gone_z, i + 1) * held_right;
    Put3(rhs, s.motion.right[0], s.motion.right[1], s.motion.right[2], i);
    Put(hn::Add(one, hn::Mul(is_free, hn::Add(left, right))), s.motion.diag, i);
    Put(hn::Neg(hn::Mul(right, hn::Mul(is_free, after))), s.motion.off, i);
  }
  return true;
}

void EndSmoothing(ThreadScratch& s, size_t nodes, Vec3 fall, float h) {
  const D d;
  const V one = hn::Set(d, 1.0f), zero = hn::Zero(d), apart = hn::Set(d, 1e-9f), shortest = hn::Set(d, 1e-5f);
  const V h2 = hn::Set(d, h * h), tiny = hn::Set(d, 1e-12f);
  const V3 weight{hn::Set(d, fall.x), hn::Set(d, fall.y), hn::Set(d, fall.z)};
  for (ptrdiff_t i = 0; i < static_cast<ptrdiff_t>(nodes); i += kStep) {
    const V pull = hn::Min(Get(s.tension, i - 1), Get(s.tension, i));
    const V3 at = Get3(s.x, s.y, s.z, i), d0 = at - Get3(s.x, s.y, s.z, i - 1), d1 = Get3(s.x, s.y, s.z, i + 1) - at;
    const V l0 = hn::Sqrt(Dot(d0, d0)), l1 = hn::Sqrt(Dot(d1, d1));
    const auto taut = hn::And(hn::Gt(pull, zero), hn::And(hn::Gt(l0, apart), hn::Gt(l1, apart)));
    const V i0 = hn::Div(one, hn::Max(l0, shortest)), i1 = hn::Div(one, hn::Max(l1, shortest));
    const V rho = hn::Div(one, hn::Add(one, hn::Mul(hn::Mul(hn::Mul(Get(s.w, i), h2), pull), hn::Add(i0, i1))));
    const V3 t = d0 * i0 + d1 * i1;
    const V3 along = t * hn::Div(Dot(weight, t), hn::Max(Dot(t, t), tiny));
    const V share = hn::IfThenElse(taut, rho, one);
    const V3 felt = along + (weight - along) * share;
    const V is_free = Get(s.is_free, i);
    Put3((Get3(s.motion.right[0], s.motion.right[1], s.motion.right[2], i) + V3{hn::IfThenElse(taut, felt.x, weight.x),
                                                                                hn::IfThenElse(taut, felt.y, weight.y),
                                                                                hn::IfThenElse(taut, felt.z, weight.z)}) *
             is_free,
         s.moved_x, s.moved_y, s.moved_z, i);
  }
  for (ptrdiff_t i = 0; i < static_cast<ptrdiff_t>(nodes); i += kStep) {
    const auto is_free = hn::And(In(i, nodes), hn::Gt(Get(s.is_free, i), zero));
    const V3 at = Get3(s.x, s.y, s.z, i);
    const V3 to = Get3(s.from_x, s.from_y, s.from_z, i) + Get3(s.moved_x, s.moved_y, s.moved_z, i);
    Put3({hn::IfThenElse(is_free, to.x, at.x), hn::IfThenElse(is_free, to.y, at.y), hn::IfThenElse(is_free, to.z, at.z)}, s.x,
         s.y, s.z, i);
  }
}

template <typename T, size_t kRight>
HWY_INLINE void Solve(PartitionedTridiagonal<T, kRight>& s, size_t count) {
  const hn::CappedTag<T, kPartitions> d;
  using W = hn::Vec<decltype(d)>;
  using Index = hn::Vec<hn::RebindToSigned<decltype(d)>>;
  constexpr size_t kLanes = HWY_MIN(kPartitions, HWY_MAX_BYTES / sizeof(T)), kParts = kPartitions / kLanes;
  const size_t rows = HWY_MAX(size_t{2}, (count + kPartitions - 1) / kPartitions);
  for (size_t i = count; i < rows * kPartitions; ++i) {
    s.diag[i] = 1, s.off[i] = 0;
    for (size_t j = 0; j < kRight; ++j) s.right[j][i] = 0;
  }
  if (count > 0) s.off[count - 1] = 0;
  // Lane c of row r is element c * rows + r.
  Index lane[kParts];
  const hn::RebindToSigned<decltype(d)> di;
  for (size_t p = 0; p < kParts; ++p) {
    using I = hn::TFromD<decltype(di)>;
    lane[p] = hn::Mul(hn::Iota(di, static_cast<I>(p * kLanes)), hn::Set(di, static_cast<I>(rows)));
  }
  const size_t last = rows - 1, separator = last * kPartitions,
               end = separator - kPartitions;  // first elements of the last two rows
  const W one = hn::Set(d, T{1});
  // Influences decay along a partition. Denormal numbers at their end would take a hundred cycles each.
  auto felt = [&](W v) HWY_ATTR { return hn::IfThenElseZero(hn::Gt(hn::Abs(v), hn::Set(d, T{1e-18f})), v); };
  // The float32 values are flushed too: 1e-18 m is negligible. Double precision has enough range.
  auto value_of = [&](W v) HWY_ATTR { return sizeof(T) == sizeof(float) ? felt(v) : v; };
  T *link = s.link.data(), *inv = s.inverse.data(), *before = s.before.data(), *after = s.after.data();

  // Forward: each row without the one before it. Inside a partition the separator before is carried as one more column.
  W inverse[kParts], carry[kParts], o[kParts], y[kRight][kParts];
  for (size_t p = 0; p < kParts; ++p) {
    const size_t k = p * kLanes;
    inverse[p] = hn::Div(one, hn::GatherIndex(d, s.diag.data(), lane[p]));
    o[p] = hn::GatherIndex(d, s.off.data(), lane[p]);
    // off[-1] is 0: there is no row before the first partition.
    carry[p] = hn::GatherIndex(d, s.off.data() - 1, lane[p]);
    hn::Store(o[p], d, link + k);
    hn::Store(inverse[p], d, inv + k);
    hn::Store(carry[p], d, before + k);
    for (size_t j = 0; j < kRight; ++j) {
      y[j][p] = hn::GatherIndex(d, s.right[j].data(), lane[p]);
      hn::Store(y[j][p], d, s.value[j].data() + k);
    }
  }
  for (size_t row = 1; row < last; ++row)
    for (size_t p = 0; p < kParts; ++p) {
      const size_t k = row * kPartitions + p * kLanes;
      const W f = hn::Mul(o[p], inverse[p]);
      inverse[p] = hn::Div(one, hn::Sub(hn::GatherIndex(d, s.diag.data() + row, lane[p]), hn::Mul(f, o[p])));
      o[p] = hn::GatherIndex(d, s.off.data() + row, lane[p]);
      carry[p] = felt(hn::Neg(hn::Mul(f, carry[p])));
      hn::Store(o[p], d, link + k);
      hn::Store(inverse[p], d, inv + k);
      hn::Store(carry[p], d, before + k);
      for (size_t j = 0; j < kRight; ++j) {
        y[j][p] = value_of(hn::Sub(hn::GatherIndex(d, s.right[j].data() + row, lane[p]), hn::Mul(f, y[j][p])));
        hn::Store(y[j][p], d, s.value[j].data() + k);
      }
    }
  // Backward: each row as its own value plus the influence of the two separators.
  W behind[kParts];
  for (size_t p = 0; p < kParts; ++p) {
    const size_t k = end + p * kLanes;
    carry[p] = hn::Mul(carry[p], inverse[p]);
    behind[p] = hn::Mul(o[p], inverse[p]);
    hn::Store(carry[p], d, before + k);
    hn::Store(behind[p], d, after + k);
    for (size_t j = 0; j < kRight; ++j) {
      y[j][p] = hn::Mul(y[j][p], inverse[p]);
      hn::Store(y[j][p], d, s.value[j].data() + k);
    }
  }
  for (size_t row = end; row > 0;) {
    row -= kPartitions;
    for (size_t p = 0; p < kParts; ++p) {
      const size_t k = row + p * kLanes;
      const W out = hn::Load(d, link + k), i = hn::Load(d, inv + k);
      carry[p] = felt(hn::Mul(hn::Sub(hn::Load(d, before + k), hn::Mul(out, carry[p])), i));
      behind[p] = felt(hn::Neg(hn::Mul(hn::Mul(out, behind[p]), i)));
      hn::Store(carry[p], d, before + k);
      hn::Store(behind[p], d, after + k);
      for (size_t j = 0; j < kRight; ++j) {
        y[j][p] = value_of(hn::Mul(hn::Sub(hn::Load(d, s.value[j].data() + k), hn::Mul(out, y[j][p])), i));
        hn::Store(y[j][p], d, s.value[j].data() + k);
      }
    }
  }
  // The reduced system of the separators.
  T pivot[kPartitions], upper[kPartitions];
  alignas(64) T value[kRight][kPartitions + 1] = {};  // value[j][c + 1] of separator c; 0 before the first
  for (size_t c = 0; c < kPartitions; ++c) {
    const size_t i = c * rows + last, next = c + 1 < kPartitions ? c + 1 : c;
    const T in = link[end + c], out = c + 1 < kPartitions ? s.off[i] : T{0};
    const T lower = -in * before[end + c];
    T diagonal = s.diag[i] - in * after[end + c] - out * before[next], f = 0;
    upper[c] = -out * after[next];
    if (c > 0) {
      f = lower * pivot[c - 1];
      diagonal -= f * upper[c - 1];
    }
    pivot[c] = T{1} / diagonal;
    for (size_t j = 0; j < kRight; ++j) {
      const T* r = s.value[j].data();
      value[j][c + 1] = s.right[j][i] - in * r[end + c] - out * r[next] - f * value[j][c];
    }
  }
  for (size_t j = 0; j < kRight; ++j) {
    T behind_it = 0;
    for (size_t c = kPartitions; c-- > 0;) {
      behind_it = value[j][c + 1] = (value[j][c + 1] - upper[c] * behind_it) * pivot[c];
      s.right[j][c * rows + last] = behind_it;
    }
  }
  // The interior rows.
  for (size_t j = 0; j < kRight; ++j)
    for (size_t p = 0; p < kParts; ++p) {
      const W left = hn::LoadU(d, value[j] + p * kLanes), right = hn::LoadU(d, value[j] + p * kLanes + 1);
      for (size_t row = 0; row < last; ++row) {
        const size_t k = row * kPartitions + p * kLanes;
        const W inside = hn::Add(hn::Mul(hn::Load(d, before + k), left), hn::Mul(hn::Load(d, after + k), right));
        hn::ScatterIndex(hn::Sub(hn::Load(d, s.value[j].data() + k), inside), d, s.right[j].data() + row, lane[p]);
      }
    }
}
void SolveStretch(PartitionedTridiagonal<double, 1>& s, size_t count) { Solve(s, count); }
void SolveMotion(PartitionedTridiagonal<float, 3>& s, size_t count) { Solve(s, count); }

bool SmoothMotion(ThreadScratch& s, size_t nodes, float inv_mass, float shortest, Vec3 fall, float h) {
  if (!BeginSmoothing(s, nodes, inv_mass, shortest, fall, h)) return false;
  Solve(s.motion, nodes);
  EndSmoothing(s, nodes, fall, h);
  return true;
}

}  // namespace HWY_NAMESPACE
}  // namespace catgut
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace catgut {

HWY_EXPORT(FindDirections);
HWY_EXPORT(FindMasses);
HWY_EXPORT(FindMatrix);
HWY_EXPORT(MoveLooseNodes);
HWY_EXPORT(FindUnfitPairs);
HWY_EXPORT(SmoothMotion);
HWY_EXPORT(SolveStretch);
HWY_EXPORT(SolveMotion);

float find_directions(ThreadScratch& s, size_t pairs, float alpha_per_meter) {
  return HWY_DYNAMIC_DISPATCH(FindDirections)(s, pairs, alpha_per_meter);
}
void find_masses(ThreadScratch& s, size_t nodes, float h) { HWY_DYNAMIC_DISPATCH(FindMasses)(s, nodes, h); }
void find_matrix(ThreadScratch& s, size_t pairs, double regularization) {
  HWY_DYNAMIC_DISPATCH(FindMatrix)(s, pairs, regularization);
}
void move_loose_nodes(ThreadScratch& s, size_t nodes, float limit) { HWY_DYNAMIC_DISPATCH(MoveLooseNodes)(s, nodes, limit); }
void mark_violated_segments(ThreadScratch& s, size_t pairs, float alpha_per_meter) {
  HWY_DYNAMIC_DISPATCH(FindUnfitPairs)(s, pairs, alpha_per_meter);
}
bool smooth_motion(ThreadScratch& s, size_t nodes, float inv_mass, float shortest, Vec3 fall, float h) {
  return HWY_DYNAMIC_DISPATCH(SmoothMotion)(s, nodes, inv_mass, shortest, fall, h);
}
void solve_partitions(PartitionedTridiagonal<double, 1>& system, size_t count) {
  HWY_DYNAMIC_DISPATCH(SolveStretch)(system, count);
}
void solve_partitions(PartitionedTridiagonal<float, 3>& system, size_t count) {
  HWY_DYNAMIC_DISPATCH(SolveMotion)(system, count);
}

}  // namespace catgut
#endif  // HWY_ONCE
