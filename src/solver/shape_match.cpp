// solver/shape_match: see the header. Compiled once per instruction set (Highway) and chosen at run time. Multiplications and
// additions are kept apart (no fused multiply-add) so that every instruction set gives the same bits.
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

// Sum of `n` rows named by `index`. n is a multiple of 4. Four independent partial sums hide the latency of the additions.
HWY_INLINE Parts SumRows(const float* HWY_RESTRICT row, const uint32_t* HWY_RESTRICT index, uint32_t n) {
  const D d;
  Parts acc[4];
  for (size_t k = 0; k < 4; ++k)
    for (size_t p = 0; p < kParts; ++p) acc[k].part[p] = hn::Load(d, row + index[k] + p * kLanes);
  auto more = [&](uint32_t i) HWY_ATTR {
    for (size_t k = 0; k < 4; ++k)
      for (size_t p = 0; p < kParts; ++p)
        acc[k].part[p] = hn::Add(acc[k].part[p], hn::Load(d, row + index[i + k] + p * kLanes));
  };
  if (n == 8) more(4);  // a shell of two layers: straight-line code
  else
    for (uint32_t i = 4; i < n; i += 4) more(i);
  Parts sum;
  for (size_t p = 0; p < kParts; ++p)
    sum.part[p] = hn::Add(hn::Add(acc[0].part[p], acc[1].part[p]), hn::Add(acc[2].part[p], acc[3].part[p]));
  return sum;
}

// Which component of (q, 1) each lane of a row is multiplied by: column j of the moments is m x q_j.
alignas(64) constexpr int32_t kColumn[16] = {0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3};

void MakeRows(const ShapeModel& model, const Vec4* x, ShapeScratch& scratch, uint32_t first, uint32_t last) {
  const D d;
  Row* row = scratch.row.data();
  const Vec4* rest = model.weighted_rest.data();
  const uint32_t* group = model.group_first.data();
  // Each part takes its own columns out of a (q, 1) that is repeated in every block of four lanes.
  hn::Vec<hn::RebindToSigned<D>> lanes[kParts];
  for (size_t p = 0; p < kParts; ++p) lanes[p] = hn::Load(hn::RebindToSigned<D>(), kColumn + p * kLanes);
  for (uint32_t g = first; g < last; ++g) {
    Parts sum;
    for (size_t p = 0; p < kParts; ++p) sum.part[p] = hn::Zero(d);
    for (uint32_t i = group[g]; i < group[g + 1]; ++i) {
      const auto at = hn::LoadDup128(d, &x[i].x), q = hn::LoadDup128(d, &rest[i].x);
      for (size_t p = 0; p < kParts; ++p) {
        const auto column = hn::TableLookupLanes(q, hn::IndicesFromVec(d, lanes[p]));
        sum.part[p] = hn::Add(sum.part[p], hn::Mul(at, column));
      }
    }
    for (size_t p = 0; p < kParts; ++p) hn::Store(sum.part[p], d, row[g].f + p * kLanes);
  }
}

// Polar decomposition in lanes: rotates the frame q so that it is the rotation nearest to A (columns a0, a1, a2).
template <class V>
struct Lanes3 {
  V x, y, z;
};

template <class Dx, class V = hn::Vec<Dx>>
HWY_INLINE Lanes3<V> LCross(Lanes3<V> a, Lanes3<V> b) {
  return {hn::Sub(hn::Mul(a.y, b.z), hn::Mul(a.z, b.y)), hn::Sub(hn::Mul(a.z, b.x), hn::Mul(a.x, b.z)),
          hn::Sub(hn::Mul(a.x, b.y), hn::Mul(a.y, b.x))};
}
template <class Dx, class V = hn::Vec<Dx>>
HWY_INLINE V LDot(Lanes3<V> a, Lanes3<V> b) {
  return hn::Add(hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y)), hn::Mul(a.z, b.z));
}

// Columns of the rotation of a unit quaternion.
template <class Dx, class V = hn::Vec<Dx>>
HWY_INLINE void Columns(Dx d, V qx, V qy, V qz, V qw, Lanes3<V>& r0, Lanes3<V>& r1, Lanes3<V>& r2) {
  const V one = hn::Set(d, 1.0f), two = hn::Set(d, 2.0f);
  const V xx = hn::Mul(qx, qx), yy = hn::Mul(qy, qy), zz = hn::Mul(qz, qz);
  const V xy = hn::Mul(qx, qy), xz = hn::Mul(qx, qz), yz = hn::Mul(qy, qz);
  const V wx = hn::Mul(qw, qx), wy = hn::Mul(qw, qy), wz = hn::Mul(qw, qz);
  r0 = {hn::Sub(one, hn::Mul(two, hn::Add(yy, zz))), hn::Mul(two, hn::Add(xy, wz)), hn::Mul(two, hn::Sub(xz, wy))};
  r1 = {hn::Mul(two, hn::Sub(xy, wz)), hn::Sub(one, hn::Mul(two, hn::Add(xx, zz))), hn::Mul(two, hn::Add(yz, wx))};
  r2 = {hn::Mul(two, hn::Add(xz, wy)), hn::Mul(two, hn::Sub(yz, wx)), hn::Sub(one, hn::Mul(two, hn::Add(xx, yy)))};
}

void Clusters(const ShapeModel& model, ClusterRotations& rotation, ShapeScratch& scratch, uint32_t first, uint32_t last) {
  const D d;
  const D4 d4;
  using V = hn::Vec<D>;
  const float* row = scratch.row.data()->f;
  float* transform = scratch.transform.data()->f;
  const uint32_t* member = model.group_member.data();
  const uint32_t stride = model.member_stride;
  alignas(64) float moment[16];
  alignas(64) float column[4][16 * 4];  // column j of the moments of 16 clusters, four floats each
  for (uint32_t base = first; base < last; base += 16) {
    for (uint32_t c = 0; c < 16; ++c) {
      // The last group may reach past the clusters: it repeats the last one and its results are dropped below.
      const uint32_t id = HWY_MIN(base + c, model.clusters - 1);
      const Parts sum = SumRows(row, member + size_t{id} * stride, stride);
      for (size_t p = 0; p < kParts; ++p) hn::Store(sum.part[p], d, moment + p * kLanes);
      for (size_t j = 0; j < 4; ++j) hn::Store(hn::Load(d4, moment + 4 * j), d4, column[j] + 4 * c);
    }
    for (uint32_t c = 0; c < 16; c += kLanes) {
      V mx[4], my[4], mz[4], mw[4];  // column j of the moments: (x, y, z, count)
      for (size_t j = 0; j < 4; ++j) hn::LoadInterleaved4(d, column[j] + 4 * c, mx[j], my[j], mz[j], mw[j]);
      const V one = hn::Set(d, 1.0f), half = hn::Set(d, 0.5f), tiny = hn::Set(d, 1e-30f);
      const V inv = hn::Div(one, mw[3]);
      const V cx = hn::Mul(mx[3], inv), cy = hn::Mul(my[3], inv), cz = hn::Mul(mz[3], inv);
      // A = sum m (x - c) q^T: centred after summing.
      Lanes3<V> a[3];
      for (size_t j = 0; j < 3; ++j)
        a[j] = {hn::Sub(mx[j], hn::Mul(cx, mw[j])), hn::Sub(my[j], hn::Mul(cy, mw[j])), hn::Sub(mz[j], hn::Mul(cz, mw[j]))};

      const size_t at = base + c;
      V qx = hn::Load(d, rotation.x.data() + at), qy = hn::Load(d, rotation.y.data() + at);
      V qz = hn::Load(d, rotation.z.data() + at), qw = hn::Load(d, rotation.w.data() + at);
      Lanes3<V> r0, r1, r2;
      Columns(d, qx, qy, qz, qw, r0, r1, r2);
      // B = R^T A in the cluster's own frame. At the optimum B is symmetric; the axial vector b of its antisymmetric part is
      // the gradient and H = tr(B) 1 - sym(B) the Hessian of the rotation (Kugelstadt et al. 2018, analytic polar).
      const V b00 = LDot<D>(r0, a[0]), b01 = LDot<D>(r0, a[1]), b02 = LDot<D>(r0, a[2]);
      const V b10 = LDot<D>(r1, a[0]), b11 = LDot<D>(r1, a[1]), b12 = LDot<D>(r1, a[2]);
      const V b20 = LDot<D>(r2, a[0]), b21 = LDot<D>(r2, a[1]), b22 = LDot<D>(r2, a[2]);
      const Lanes3<V> g{hn::Sub(b21, b12), hn::Sub(b02, b20), hn::Sub(b10, b01)};
      const V trace = hn::Add(hn::Add(b00, b11), b22);
      const V h00 = hn::Sub(trace, b00), h11 = hn::Sub(trace, b11), h22 = hn::Sub(trace, b22);
      const V h01 = hn::Neg(hn::Mul(half, hn::Add(b01, b10))), h02 = hn::Neg(hn::Mul(half, hn::Add(b02, b20)));
      const V h12 = hn::Neg(hn::Mul(half, hn::Add(b12, b21)));
      const V k00 = hn::Sub(hn::Mul(h11, h22), hn::Mul(h12, h12)), k01 = hn::Sub(hn::Mul(h02, h12), hn::Mul(h01, h22));
      const V k02 = hn::Sub(hn::Mul(h01, h12), hn::Mul(h02, h11)), k11 = hn::Sub(hn::Mul(h00, h22), hn::Mul(h02, h02));
      const V k12 = hn::Sub(hn::Mul(h01, h02), hn::Mul(h00, h12)), k22 = hn::Sub(hn::Mul(h00, h11), hn::Mul(h01, h01));
      const V det = hn::Add(hn::Add(hn::Mul(h00, k00), hn::Mul(h01, k01)), hn::Mul(h02, k02));
      const V size = hn::Max(hn::Abs(trace), tiny);
      const V inv_det = hn::Div(one, hn::Max(det, tiny));
      Lanes3<V> newton{hn::Mul(inv_det, hn::Add(hn::Add(hn::Mul(k00, g.x), hn::Mul(k01, g.y)), hn::Mul(k02, g.z))),
                       hn::Mul(inv_det, hn::Add(hn::Add(hn::Mul(k01, g.x), hn::Mul(k11, g.y)), hn::Mul(k12, g.z))),
                       hn::Mul(inv_det, hn::Add(hn::Add(hn::Mul(k02, g.x), hn::Mul(k12, g.y)), hn::Mul(k22, g.z)))};
      // Positive definite with some reserve and a step below half a radian, else the always-safe damped step g / tr.
      const V relative = hn::Div(det, hn::Mul(size, hn::Mul(size, size)));
      const auto safe = hn::And(hn::And(hn::Gt(trace, tiny), hn::Gt(relative, hn::Set(d, 1e-3f))),
                                hn::Lt(LDot<D>(newton, newton), hn::Set(d, 0.25f)));
      // Bounded by one even where there is nothing to turn by (a cluster shrunk to a point has only rounding for moments).
      const V damp = hn::Div(one, hn::Add(size, hn::Add(hn::Add(hn::Abs(g.x), hn::Abs(g.y)), hn::Abs(g.z))));
      const V wx = hn::Mul(half, hn::IfThenElse(safe, newton.x, hn::Mul(damp, g.x)));
      const V wy = hn::Mul(half, hn::IfThenElse(safe, newton.y, hn::Mul(damp, g.y)));
      const V wz = hn::Mul(half, hn::IfThenElse(safe, newton.z, hn::Mul(damp, g.z)));
      // q <- q (1, w/2), renormalised: the rotation is in the cluster's own frame, hence on the right.
      const V nx = hn::Add(qx, hn::Add(hn::Mul(qw, wx), hn::Sub(hn::Mul(qy, wz), hn::Mul(qz, wy))));
      const V ny = hn::Add(qy, hn::Add(hn::Mul(qw, wy), hn::Sub(hn::Mul(qz, wx), hn::Mul(qx, wz))));
      const V nz = hn::Add(qz, hn::Add(hn::Mul(qw, wz), hn::Sub(hn::Mul(qx, wy), hn::Mul(qy, wx))));
      const V nw = hn::Sub(qw, hn::Add(hn::Add(hn::Mul(qx, wx), hn::Mul(qy, wy)), hn::Mul(qz, wz)));
      const V norm =
          hn::Div(one, hn::Sqrt(hn::Add(hn::Add(hn::Mul(nx, nx), hn::Mul(ny, ny)), hn::Add(hn::Mul(nz, nz), hn::Mul(nw, nw)))));
      qx = hn::Mul(nx, norm), qy = hn::Mul(ny, norm), qz = hn::Mul(nz, norm), qw = hn::Mul(nw, norm);
      hn::Store(qx, d, rotation.x.data() + at);
      hn::Store(qy, d, rotation.y.data() + at);
      hn::Store(qz, d, rotation.z.data() + at);
      hn::Store(qw, d, rotation.w.data() + at);
      Columns(d, qx, qy, qz, qw, r0, r1, r2);
      // t = c - R c0
      V c0x, c0y, c0z, unused;
      hn::LoadInterleaved4(d, &model.rest_centre[at].x, c0x, c0y, c0z, unused);
      const V tx = hn::Sub(cx, hn::Add(hn::Add(hn::Mul(r0.x, c0x), hn::Mul(r1.x, c0y)), hn::Mul(r2.x, c0z)));
      const V ty = hn::Sub(cy, hn::Add(hn::Add(hn::Mul(r0.y, c0x), hn::Mul(r1.y, c0y)), hn::Mul(r2.y, c0z)));
      const V tz = hn::Sub(cz, hn::Add(hn::Add(hn::Mul(r0.z, c0x), hn::Mul(r1.z, c0y)), hn::Mul(r2.z, c0z)));
      const V zero = hn::Zero(d);
      hn::StoreInterleaved4(r0.x, r0.y, r0.z, zero, d, column[0] + 4 * c);
      hn::StoreInterleaved4(r1.x, r1.y, r1.z, zero, d, column[1] + 4 * c);
      hn::StoreInterleaved4(r2.x, r2.y, r2.z, zero, d, column[2] + 4 * c);
      hn::StoreInterleaved4(tx, ty, tz, zero, d, column[3] + 4 * c);
    }
    const uint32_t n = HWY_MIN(16u, last - base);
    for (uint32_t c = 0; c < n; ++c)
      for (size_t j = 0; j < 4; ++j) hn::Store(hn::Load(d4, column[j] + 4 * c), d4, transform + 16 * size_t{base + c} + 4 * j);
  }
}

void ShapeParticles(const ShapeModel& model, Vec4* x, const float* inv_mass, float stiffness, float relaxation,
                    ShapeScratch& scratch, uint32_t first, uint32_t last, bool more) {
  const D d;
  const D4 d4;
  const float* transform = scratch.transform.data()->f;
  Vec4* move = scratch.moved.data();
  const Vec4* rest = model.rest.data();
  const uint32_t *holder = model.holder.data(), *group = model.group_first.data();
  const uint32_t stride = model.holder_stride;
  const hn::CappedTag<float, 8> dw;
  constexpr uint32_t kPer = HWY_MIN(8, kLanes) / 4;
  // Lane 3 (the constant 1 of a position) must not move.
  alignas(16) const float relax[4] = {relaxation, relaxation, relaxation, 0};
  alignas(64) float sum[16];
  for (uint32_t g = first; g < last; ++g) {
    const Parts total = SumRows(transform, holder + size_t{g} * stride, stride);
    const auto share = hn::Set(d, model.inv_holders[g]);
    for (size_t p = 0; p < kParts; ++p) hn::Store(hn::Mul(total.part[p], share), d, sum + p * kLanes);
    // Two particles at a time where registers are wide enough, and the few left over, or beside a pinned one, singly.
    auto move_at = [&](auto dp, uint32_t i) HWY_ATTR {
      const auto q = hn::LoadU(dp, &rest[i].x), at = hn::LoadU(dp, &x[i].x), moved = hn::LoadU(dp, &move[i].x);
      const auto goal =
          hn::Add(hn::Add(hn::Mul(hn::LoadDup128(dp, sum), hn::Broadcast<0>(q)),
                          hn::Mul(hn::LoadDup128(dp, sum + 4), hn::Broadcast<1>(q))),
                  hn::Add(hn::Mul(hn::LoadDup128(dp, sum + 8), hn::Broadcast<2>(q)), hn::LoadDup128(dp, sum + 12)));
      const auto dx = hn::Mul(hn::LoadDup128(dp, relax), hn::Sub(hn::Mul(hn::Set(dp, stiffness), hn::Sub(goal, at)),
                                                                 hn::Mul(hn::Set(dp, 1.0f - stiffness), moved)));
      hn::StoreU(hn::Add(at, dx), dp, &x[i].x);
      hn::StoreU(hn::Add(moved, dx), dp, &move[i].x);
    };
    uint32_t i = group[g];
    const uint32_t end = group[g + 1];
    while (i < end) {
      if (i + kPer <= end && inv_mass[i] != 0 && inv_mass[i + kPer - 1] != 0) {
        move_at(dw, i);
        i += kPer;
      } else {
        if (inv_mass[i] != 0) move_at(d4, i);
        ++i;
      }
    }
  }
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
  // The members as a set, in ascending order, are the key: partners across the wall list the same neighbourhood.
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
  m.rest_centre.assign((m.clusters + 15) / 16 * 16, Vec4{});
  for (uint32_t c = 0; c < m.clusters; ++c) {
    double sum = 0, sx = 0, sy = 0, sz = 0;
    for (size_t k = 0; k < unique[c]->size(); ++k) {
      const uint32_t id = (*unique[c])[k];
      m.member[size_t{c} * m.cluster_stride + k] = id;
      const double w = m.relative_mass[id];
      sum += w, sx += w * rest[id].x, sy += w * rest[id].y, sz += w * rest[id].z;
    }
    m.rest_centre[c] = {static_cast<float>(sx / sum), static_cast<float>(sy / sum), static_cast<float>(sz / sum), 0};
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
  m.group_member.assign(size_t{m.clusters} * m.member_stride, kRow * m.groups);
  for (uint32_t c = 0; c < m.clusters; ++c)
    for (size_t k = 0; k < held[c].size(); ++k) m.group_member[size_t{c} * m.member_stride + k] = kRow * held[c][k];
  return m;
}

}  // namespace catgut
#endif  // HWY_ONCE
