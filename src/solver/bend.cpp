// SPDX-License-Identifier: Apache-2.0
// solver/bend: see the header. Compiled once per instruction set (Highway); no fused multiply-add, as in shape_match.
#include "solver/bend.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "solver/bend.cpp"
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
HWY_INLINE V3 Sub3(V3 a, V3 b) { return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)}; }
HWY_INLINE V3 Mul3(V3 a, V s) { return {hn::Mul(a.x, s), hn::Mul(a.y, s), hn::Mul(a.z, s)}; }
HWY_INLINE V Dot3(V3 a, V3 b) { return hn::Add(hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y)), hn::Mul(a.z, b.z)); }

// Triplets of one color: end columns a and c, middle column b, each starting at its own offset; `count` of them.
struct Color {
  float *ax, *ay, *az, *aw, *bx, *by, *bz, *bw, *cx, *cy, *cz, *cw, *lambda, *whole;
  size_t count;
};

void Sweep(const Color& t, float alpha) {
  const D d;
  const size_t lanes = hn::Lanes(d);
  const V one = hn::Set(d, 1.0f), tiny = hn::Set(d, 1e-18f), va = hn::Set(d, alpha), zero = hn::Zero(d);
  for (size_t k = 0; k < t.count; k += lanes) {
    const V3 a{hn::LoadU(d, t.ax + k), hn::LoadU(d, t.ay + k), hn::LoadU(d, t.az + k)};
    const V3 b{hn::LoadU(d, t.bx + k), hn::LoadU(d, t.by + k), hn::LoadU(d, t.bz + k)};
    const V3 c{hn::LoadU(d, t.cx + k), hn::LoadU(d, t.cy + k), hn::LoadU(d, t.cz + k)};
    // Lanes past the last triplet belong to padding or to an incomplete triplet: they get no mass.
    const auto in = hn::FirstN(d, HWY_MIN(lanes, t.count - k));
    const V wa = hn::IfThenElseZero(in, hn::LoadU(d, t.aw + k)), wb = hn::IfThenElseZero(in, hn::LoadU(d, t.bw + k));
    const V wc = hn::IfThenElseZero(in, hn::LoadU(d, t.cw + k)), lambda = hn::LoadU(d, t.lambda + k);
    const V3 da = Sub3(a, b), dc = Sub3(c, b);
    const V la2 = Dot3(da, da), lc2 = Dot3(dc, dc);
    const V ia = hn::Div(one, hn::Sqrt(hn::Max(la2, tiny))), ic = hn::Div(one, hn::Sqrt(hn::Max(lc2, tiny)));
    const V3 u = Mul3(da, ia), v = Mul3(dc, ic);
    const V cosine = hn::Max(hn::Neg(one), hn::Min(one, Dot3(u, v))), violation = hn::Add(cosine, one);
    const V3 ga = Mul3(Sub3(v, Mul3(u, cosine)), ia), gc = Mul3(Sub3(u, Mul3(v, cosine)), ic);
    const V3 gb{hn::Neg(hn::Add(ga.x, gc.x)), hn::Neg(hn::Add(ga.y, gc.y)), hn::Neg(hn::Add(ga.z, gc.z))};
    const V ga2 = Dot3(ga, ga), gb2 = Dot3(gb, gb), gc2 = Dot3(gc, gc);
    const V w = hn::Add(hn::Add(hn::Mul(wa, ga2), hn::Mul(wb, gb2)), hn::Mul(wc, gc2));
    const V floor = hn::Mul(hn::Mul(hn::Set(d, 1e-12f), hn::Add(hn::Add(wa, wb), wc)), hn::Mul(ia, ic));
    auto live = hn::And(hn::And(hn::Ge(la2, tiny), hn::Ge(lc2, tiny)), hn::And(hn::Ge(w, floor), hn::Gt(w, zero)));
    live = hn::And(live, hn::Gt(hn::LoadU(d, t.whole + k), zero));
    live = hn::And(live, hn::Or(hn::Ge(violation, hn::Set(d, 1e-6f)), hn::Ne(lambda, zero)));
    V step = hn::Neg(hn::Div(hn::Add(violation, hn::Mul(va, lambda)), hn::IfThenElse(live, hn::Add(w, va), one)));
    const V most = hn::Mul(hn::Mul(step, step), hn::Max(hn::Max(hn::Mul(hn::Mul(wa, wa), ga2), hn::Mul(hn::Mul(wb, wb), gb2)),
                                                        hn::Mul(hn::Mul(wc, wc), gc2)));
    const V limit = hn::Mul(hn::Set(d, 0.01f), hn::Min(la2, lc2));
    const auto over = hn::Gt(most, limit);
    if (!hn::AllFalse(d, over))  // rare, and the root and the division are expensive
      step = hn::IfThenElse(over, hn::Mul(step, hn::Sqrt(hn::Div(limit, hn::IfThenElse(over, most, one)))), step);
    step = hn::IfThenElseZero(live, step);
    hn::StoreU(hn::Add(lambda, step), d, t.lambda + k);
    const V sa = hn::Mul(wa, step), sb = hn::Mul(wb, step), sc = hn::Mul(wc, step);
    // Whole vectors are stored; lanes without mass write back what they read. Each color touches a node once.
    hn::StoreU(hn::Add(a.x, hn::Mul(ga.x, sa)), d, t.ax + k);
    hn::StoreU(hn::Add(a.y, hn::Mul(ga.y, sa)), d, t.ay + k);
    hn::StoreU(hn::Add(a.z, hn::Mul(ga.z, sa)), d, t.az + k);
    hn::StoreU(hn::Add(b.x, hn::Mul(gb.x, sb)), d, t.bx + k);
    hn::StoreU(hn::Add(b.y, hn::Mul(gb.y, sb)), d, t.by + k);
    hn::StoreU(hn::Add(b.z, hn::Mul(gb.z, sb)), d, t.bz + k);
    hn::StoreU(hn::Add(c.x, hn::Mul(gc.x, sc)), d, t.cx + k);
    hn::StoreU(hn::Add(c.y, hn::Mul(gc.y, sc)), d, t.cy + k);
    hn::StoreU(hn::Add(c.z, hn::Mul(gc.z, sc)), d, t.cz + k);
  }
}

void AllBends(BendScratch& s, size_t nodes, float alpha, int sweeps) {
  for (int sweep = 0; sweep < sweeps; ++sweep)
    for (size_t middle = 1; middle <= 3; ++middle) {
      if (middle + 1 >= nodes) continue;
      const size_t a = (middle - 1) % 3, b = middle % 3, c = (middle + 1) % 3;
      // Offsets of the first triplet of the color within each column.
      const size_t oa = (middle - 1) / 3, ob = middle / 3, oc = (middle + 1) / 3;
      const size_t count = (nodes - 2 - middle) / 3 + 1;
      Sweep({s.x[a].data() + oa, s.y[a].data() + oa, s.z[a].data() + oa, s.w[a].data() + oa, s.x[b].data() + ob,
             s.y[b].data() + ob, s.z[b].data() + ob, s.w[b].data() + ob, s.x[c].data() + oc, s.y[c].data() + oc,
             s.z[c].data() + oc, s.w[c].data() + oc, s.lambda[b].data() + ob, s.whole[b].data() + ob, count},
            alpha);
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace catgut
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <algorithm>

namespace catgut {

HWY_EXPORT(AllBends);

void BendScratch::resize(size_t nodes) {
  const size_t padded = nodes / 3 + 1 + 16;
  for (int k = 0; k < 3; ++k) {
    x[k].assign(padded, 0), y[k].assign(padded, 0), z[k].assign(padded, 0);
    w[k].assign(padded, 0), lambda[k].assign(padded, 0), whole[k].assign(padded, 1);
  }
}

void solve_bends(BendScratch& s, size_t nodes, float compliance, float h, int sweeps) {
  if (nodes < 3 || sweeps < 1) return;
  for (int k = 0; k < 3; ++k) std::fill(s.lambda[k].begin(), s.lambda[k].end(), 0.0f);
  HWY_DYNAMIC_DISPATCH(AllBends)(s, nodes, compliance / (h * h), sweeps);
}

void solve_bends(std::span<Vec3> p, std::span<const float> w, float compliance, float h, int sweeps, BendScratch& s) {
  for (size_t i = 0; i < p.size(); ++i) s.set(i % 3, i / 3, p[i], w[i]);
  solve_bends(s, p.size(), compliance, h, sweeps);
  for (size_t i = 0; i < p.size(); ++i) p[i] = s.at(i % 3, i / 3);
}

}  // namespace catgut
#endif  // HWY_ONCE
