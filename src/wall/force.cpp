// SPDX-License-Identifier: Apache-2.0
// wall/force: see the header. Compiled once per instruction set (Highway) and chosen at run time.
#include "wall/force.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "wall/force.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace catgut::wall {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = hn::CappedTag<float, kLanesOfBlock>;
constexpr size_t kWidth = HWY_MIN(kLanesOfBlock, HWY_MAX_BYTES / sizeof(float));

struct Wide {
  hn::Vec<D> v;
  Wide() = default;
  HWY_INLINE Wide(hn::Vec<D> a) : v(a) {}
  HWY_INLINE Wide(float a) : v(hn::Set(D(), a)) {}
};
HWY_INLINE Wide operator+(Wide a, Wide b) { return hn::Add(a.v, b.v); }
HWY_INLINE Wide operator-(Wide a, Wide b) { return hn::Sub(a.v, b.v); }
HWY_INLINE Wide operator*(Wide a, Wide b) { return hn::Mul(a.v, b.v); }
HWY_INLINE Wide operator/(Wide a, Wide b) { return hn::Div(a.v, b.v); }
HWY_INLINE Wide above(Wide a, Wide b) { return hn::IfThenElseZero(hn::Gt(a.v, b.v), hn::Set(D(), 1.0f)); }
HWY_INLINE Wide absolute(Wide a) { return hn::Abs(a.v); }
HWY_INLINE Wide larger(Wide a, Wide b) { return hn::Max(a.v, b.v); }
HWY_INLINE Wide square_root(Wide a) { return hn::Sqrt(a.v); }
HWY_INLINE bool any(Wide a) { return !hn::AllFalse(D(), hn::Gt(a.v, hn::Zero(D()))); }

#include "wall/element_formula.h"

using Vec3W = Vec3Of<Wide>;

struct ConstantsOf {
  const float* at;
  HWY_INLINE Wide operator()(uint32_t k) const { return hn::Load(D(), at + k * kLanesOfBlock); }
};

HWY_INLINE void LoadCorner(const float* y, const uint32_t* column, Vec3W& mid, Vec3W& dir) {
  const hn::RebindToSigned<D> di;
  const auto at = hn::ShiftLeft<3>(hn::Load(di, reinterpret_cast<const int32_t*>(column)));
  const D d;
  mid = {hn::GatherIndex(d, y, at), hn::GatherIndex(d, y + 1, at), hn::GatherIndex(d, y + 2, at)};
  dir = {hn::GatherIndex(d, y + 4, at), hn::GatherIndex(d, y + 5, at), hn::GatherIndex(d, y + 6, at)};
}

void BlockForces(const ElementBlock* block, const BlockCorners* corners, const Float4* y, BlockTurn* turn, BlockForce* force,
                 uint32_t first, uint32_t last) {
  const D d;
  const float* at = &y[0].x;
  for (uint32_t b = first; b < last; ++b)
    for (size_t part = 0; part < kLanesOfBlock; part += kWidth) {
      Vec3W mid[4], dir[4];
      for (size_t k = 0; k < 4; ++k) LoadCorner(at, corners[b].column[k].data() + part, mid[k], dir[k]);
      BlockTurn& frame = turn[b];
      Turn<Wide> q{hn::Load(d, frame.x.data() + part), hn::Load(d, frame.y.data() + part), hn::Load(d, frame.z.data() + part),
                   hn::Load(d, frame.w.data() + part)};
      const ConstantsOf constants{block[b].constant[0].data() + part};
      const Wide quarter(0.25f), half(0.5f), third(1.0f / 3);
      const bool quads = corners[b].quads != 0;
      const Modes<Wide> f =
          element_force(constants, quads ? quad_modes(mid, dir, quarter) : triangle_modes(mid, dir, half, third), q, 1);
      hn::Store(q.x.v, d, frame.x.data() + part), hn::Store(q.y.v, d, frame.y.data() + part);
      hn::Store(q.z.v, d, frame.z.data() + part), hn::Store(q.w.v, d, frame.w.data() + part);
      Vec3W fm[4], fd[4];
      bool flat = false;
      if (quads) {
        quad_corners(f, quarter, fm, fd);
        flat = guard_corners<4>(constants, mid, dir, fm, fd);
      } else {
        triangle_corners(f, half, third, fm, fd);
        flat = guard_corners<3>(constants, mid, dir, fm, fd);
      }
      force[b].flat = (part > 0 && force[b].flat) || flat;
      const auto zero = hn::Zero(d);
      for (size_t k = 0; k < 4; ++k) {
        hn::StoreInterleaved4(fm[k].x.v, fm[k].y.v, fm[k].z.v, zero, d, &force[b].mid[k][part].x);
        hn::StoreInterleaved4(fd[k].x.v, fd[k].y.v, fd[k].z.v, zero, d, &force[b].dir[k][part].x);
      }
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace catgut::wall
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace catgut::wall {
HWY_EXPORT(BlockForces);
void block_forces(const ElementBlock* block, const BlockCorners* corners, const Float4* y, BlockTurn* turn, BlockForce* force,
                  uint32_t first, uint32_t last) {
  HWY_DYNAMIC_DISPATCH(BlockForces)(block, corners, y, turn, force, first, last);
}
}  // namespace catgut::wall
#endif
