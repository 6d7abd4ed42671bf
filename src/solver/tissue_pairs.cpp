// solver/tissue_pairs: reads positions, writes boxes and pairs. Compiled once per instruction set (Highway) and chosen at run
// time. Comparisons only decide what is worth a closer look, so every instruction set finds every pair that touches.
#include "solver/tissue_pairs.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "solver/tissue_pairs.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace catgut {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = hn::CappedTag<float, 16>;
using V = hn::Vec<D>;
constexpr size_t kLanes = HWY_MIN(16, HWY_MAX_BYTES / sizeof(float));

// Bit k of the result: test(k) of lanes k. Sixteen at a time, whatever the registers hold.
template <class Test>
HWY_INLINE uint32_t Sixteen(const Test& test) {
  const D d;
  uint32_t bits = 0;
  for (size_t k = 0; k < 16; k += kLanes) {
    uint8_t byte[8] = {};
    hn::StoreMaskBits(d, test(k), byte);
    bits |= (uint32_t{byte[0]} | uint32_t{byte[1]} << 8) << k;
  }
  return bits;
}

HWY_INLINE uint32_t BoxesThatMeet(const Boxes& box, size_t first, const float* HWY_RESTRICT from,
                                  const float* HWY_RESTRICT to) {
  const D d;
  return Sixteen([&](size_t k) HWY_ATTR {
    auto along = [&](size_t axis) HWY_ATTR {
      return hn::And(hn::Le(hn::Load(d, box.lower[axis].data() + first + k), hn::Set(d, to[axis])),
                     hn::Ge(hn::Load(d, box.upper[axis].data() + first + k), hn::Set(d, from[axis])));
    };
    return hn::And(along(0), hn::And(along(1), along(2)));
  });
}

// Boxes of the blocks of a group, and its own.
void MakeBoxes(const TissueCollision& tissue, const Vec4* x, BlockBoxes& boxes, uint32_t g) {
  const hn::FixedTag<float, 4> d4;
  alignas(16) float low[4], high[4];
  auto group_lower = hn::Set(d4, 1e30f), group_upper = hn::Set(d4, -1e30f);
  const uint32_t end = HWY_MIN(boxes.blocks, (g + 1) * kBlock);
  for (uint32_t b = g * kBlock; b < end; ++b) {
    const uint32_t last = HWY_MIN(tissue.particles, (b + 1) * kBlock);
    auto lower = hn::Load(d4, &x[b * kBlock].x), upper = lower;
    for (uint32_t i = b * kBlock + 1; i < last; ++i) {
      const auto at = hn::Load(d4, &x[i].x);
      lower = hn::Min(lower, at), upper = hn::Max(upper, at);
    }
    hn::Store(lower, d4, low), hn::Store(upper, d4, high);
    for (size_t axis = 0; axis < 3; ++axis) boxes.block.lower[axis][b] = low[axis], boxes.block.upper[axis][b] = high[axis];
    group_lower = hn::Min(group_lower, lower), group_upper = hn::Max(group_upper, upper);
  }
  hn::Store(group_lower, d4, low), hn::Store(group_upper, d4, high);
  for (size_t axis = 0; axis < 3; ++axis) boxes.group.lower[axis][g] = low[axis], boxes.group.upper[axis][g] = high[axis];
}

float FurthestMove(const Vec4* x, const Vec4* from, size_t n) {
  const D d;
  const float *at = &x->x, *was = &from->x;
  const size_t count = 4 * n;
  V most[2] = {hn::Zero(d), hn::Zero(d)};  // two, so that neither waits for the other
  size_t i = 0;
  for (; i + 2 * kLanes <= count; i += 2 * kLanes)
    for (size_t k = 0; k < 2; ++k)
      most[k] = hn::Max(most[k], hn::Abs(hn::Sub(hn::LoadU(d, at + i + k * kLanes), hn::LoadU(d, was + i + k * kLanes))));
  float furthest = hn::GetLane(hn::MaxOfLanes(d, hn::Max(most[0], most[1])));
  for (; i < count; ++i) {
    const float move = at[i] > was[i] ? at[i] - was[i] : was[i] - at[i];
    furthest = move > furthest ? move : furthest;
  }
  return furthest;
}

// Positions by components, for the particles of a group of blocks; the places after the last particle are no numbers, which are
// near nothing, however far away a damaged state may have put its particles.
void SpreadPositions(const TissueCollision& tissue, const Vec4* x, PairSearch& search, uint32_t g) {
  const uint32_t first = g * kBlock * kBlock, last = HWY_MIN(search.boxes.blocks * kBlock, first + kBlock * kBlock);
  for (uint32_t i = first; i < last; ++i) {
    const bool is = i < tissue.particles;
    search.at[0][i] = is ? x[i].x : kNowhere;
    search.at[1][i] = is ? x[i].y : kNowhere;
    search.at[2][i] = is ? x[i].z : kNowhere;
  }
}

// Pairs whose first particle is in group g.
void PairsOfGroup(const TissueCollision& tissue, PairSearch& search, uint32_t g) {
  const D d;
  PairSearch::Part& part = search.part[g];
  part.pair.clear();
  const BlockBoxes& boxes = search.boxes;
  const float reach = 2 * tissue.largest_radius + tissue.pair_margin;
  const uint32_t end = HWY_MIN(boxes.blocks, (g + 1) * kBlock);
  for (uint32_t ba = g * kBlock; ba < end; ++ba) {
    float from[3], to[3];
    for (size_t axis = 0; axis < 3; ++axis)
      from[axis] = boxes.block.lower[axis][ba] - reach, to[axis] = boxes.block.upper[axis][ba] + reach;
    part.near.clear();
    const TissueCollision::Kin* kin = tissue.kin.data() + tissue.kin_first[ba];
    const TissueCollision::Kin* const last_kin = tissue.kin.data() + tissue.kin_first[ba + 1];
    for (uint32_t base = g / 16 * 16; base < boxes.groups; base += 16) {
      uint32_t groups = BoxesThatMeet(boxes.group, base, from, to);
      for (; groups != 0; groups &= groups - 1) {
        const uint32_t other = base + static_cast<uint32_t>(__builtin_ctz(groups));
        if (other < g) continue;
        uint32_t blocks = BoxesThatMeet(boxes.block, size_t{other} * kBlock, from, to);
        if (other == g) blocks &= ~0u << (ba - g * kBlock);
        for (; blocks != 0; blocks &= blocks - 1) {
          const uint32_t bb = other * kBlock + static_cast<uint32_t>(__builtin_ctz(blocks));
          while (kin != last_kin && kin->block < bb) ++kin;
          part.near.push_back({bb, kin != last_kin && kin->block == bb ? kin->may.data() : nullptr});
        }
      }
    }
    // Their boxes side by side: most of a near block's particles are out of a particle's reach, and one test tells for sixteen.
    Boxes& near_box = part.near_box;
    if (near_box.lower[0].size() < part.near.size()) near_box.resize(part.near.size());
    const size_t padded = (part.near.size() + 15) / 16 * 16;
    for (size_t axis = 0; axis < 3; ++axis)
      for (size_t k = 0; k < padded; ++k) {
        const bool is = k < part.near.size();
        near_box.lower[axis][k] = is ? boxes.block.lower[axis][part.near[k].block] : 0.0f;
        near_box.upper[axis][k] = is ? boxes.block.upper[axis][part.near[k].block] : 0.0f;
      }
    const uint32_t last = HWY_MIN(tissue.particles, (ba + 1) * kBlock);
    for (uint32_t i = ba * kBlock; i < last; ++i) {
      const V px = hn::Set(d, search.at[0][i]), py = hn::Set(d, search.at[1][i]), pz = hn::Set(d, search.at[2][i]);
      const V own = hn::Set(d, tissue.radius[i] + tissue.pair_margin);
      for (size_t first = 0; first < padded; first += 16) {
        uint32_t blocks = Sixteen([&](size_t k) HWY_ATTR {
          auto outside = [&](size_t axis, V p) HWY_ATTR {
            const V below = hn::Sub(hn::Load(d, near_box.lower[axis].data() + first + k), p);
            const V above = hn::Sub(p, hn::Load(d, near_box.upper[axis].data() + first + k));
            return hn::Max(hn::Max(below, above), hn::Zero(d));
          };
          const V dx = outside(0, px), dy = outside(1, py), dz = outside(2, pz);
          return hn::Le(hn::Add(hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy)), hn::Mul(dz, dz)), hn::Set(d, reach * reach));
        });
        if (part.near.size() - first < 16) blocks &= (1u << (part.near.size() - first)) - 1;
        for (; blocks != 0; blocks &= blocks - 1) {
          const PairSearch::Near& near = part.near[first + static_cast<size_t>(__builtin_ctz(blocks))];
          const uint32_t may = near.may ? near.may[i - ba * kBlock] : 0xffffu;
          if (may == 0) continue;  // neighbours in the wall
          uint32_t close =
              may & Sixteen([&](size_t k) HWY_ATTR {
                const size_t at = size_t{near.block} * kBlock + k;
                const V dx = hn::Sub(hn::Load(d, search.at[0].data() + at), px);
                const V dy = hn::Sub(hn::Load(d, search.at[1].data() + at), py);
                const V dz = hn::Sub(hn::Load(d, search.at[2].data() + at), pz);
                const V touch = hn::Add(own, hn::Load(d, search.radius.data() + at));
                return hn::Le(hn::Add(hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy)), hn::Mul(dz, dz)), hn::Mul(touch, touch));
              });
          for (; close != 0; close &= close - 1)
            part.pair.push_back({i, near.block * kBlock + static_cast<uint32_t>(__builtin_ctz(close))});
        }
      }
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace catgut
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <algorithm>
#include <cmath>

namespace catgut {

HWY_EXPORT(MakeBoxes);
HWY_EXPORT(FurthestMove);
HWY_EXPORT(SpreadPositions);
HWY_EXPORT(PairsOfGroup);

namespace {

// Which particles of neighbouring blocks are too near each other at rest ever to collide.
void find_kin(TissueCollision& t, std::span<const Vec4> rest) {
  BlockBoxes boxes;
  Jobs alone;
  make_boxes(t, rest.data(), boxes, alone);
  float furthest = 0;
  for (const float reach : t.rest_reach) furthest = std::max(furthest, reach);
  for (uint32_t ba = 0; ba < boxes.blocks; ++ba) {
    t.kin_first.push_back(static_cast<uint32_t>(t.kin.size()));
    auto corner = [&](const std::array<Column<float>, 3>& of) { return Vec3{of[0][ba], of[1][ba], of[2][ba]}; };
    const Vec3 grow{furthest, furthest, furthest};
    for_blocks_near(boxes, corner(boxes.block.lower) - grow, corner(boxes.block.upper) + grow, [&](uint32_t bb) {
      if (bb < ba) return;
      TissueCollision::Kin kin{bb, {}};
      bool all = bb != ba;
      for (uint32_t i = ba * kBlock; i < std::min(t.particles, (ba + 1) * kBlock); ++i)
        for (uint32_t j = bb * kBlock; j < std::min(t.particles, (bb + 1) * kBlock); ++j) {
          const float apart = std::max(t.rest_reach[i], t.rest_reach[j]);
          const bool may = i < j && (t.body[i] != t.body[j] || length2(xyz(rest[j]) - xyz(rest[i])) >= apart * apart);
          all = all && may;
          if (may) kin.may[i % kBlock] = static_cast<uint16_t>(kin.may[i % kBlock] | 1u << (j % kBlock));
        }
      if (!all) t.kin.push_back(kin);
    });
  }
  t.kin_first.push_back(static_cast<uint32_t>(t.kin.size()));
}

}  // namespace

TissueCollision make_tissue_collision(std::span<const Vec4> rest, std::span<const float> radius, std::span<const uint32_t> body,
                                      std::span<const float> rest_reach, std::vector<Triangle> surface) {
  TissueCollision t;
  t.particles = static_cast<uint32_t>(rest.size());
  t.radius.assign(radius.begin(), radius.end());
  t.body.assign(body.begin(), body.end());
  t.rest_reach.assign(rest_reach.begin(), rest_reach.end());
  t.surface = std::move(surface);
  for (float r : radius) t.largest_radius = std::max(t.largest_radius, r);
  // Wide enough to be kept for long, but not so wide that the wall's own particles, a little pressed together, fill the list.
  const float nearest = rest_reach.empty() ? 1.0f : *std::min_element(rest_reach.begin(), rest_reach.end());
  t.pair_margin = std::clamp(0.5f * (nearest - 2 * t.largest_radius), 0.0002f, 0.001f);
  std::vector<uint32_t> count(t.particles + 1, 0);
  for (const Triangle& k : t.surface)
    for (uint32_t i : k) ++count[i + 1];
  for (size_t i = 1; i < count.size(); ++i) count[i] += count[i - 1];
  t.ring_first = count;
  t.ring.resize(t.surface.size() * 3);
  for (uint32_t f = 0; f < t.surface.size(); ++f)
    for (uint32_t i : t.surface[f]) t.ring[count[i]++] = f;
  find_kin(t, rest);
  return t;
}

void Boxes::resize(size_t count) {
  const size_t padded = (count + kBlock - 1) / kBlock * kBlock;
  if (!lower[0].empty() && lower[0].size() == padded) return;
  for (size_t axis = 0; axis < 3; ++axis) lower[axis].assign(padded, kNowhere), upper[axis].assign(padded, kNowhere);
}

void make_boxes(const TissueCollision& tissue, const Vec4* x, BlockBoxes& boxes, Jobs& jobs) {
  boxes.blocks = (tissue.particles + kBlock - 1) / kBlock;
  boxes.groups = (boxes.blocks + kBlock - 1) / kBlock;
  boxes.block.resize(boxes.blocks);
  boxes.group.resize(boxes.groups);
  jobs.each(boxes.groups, 1, [&](size_t g, size_t) {
    HWY_DYNAMIC_DISPATCH(MakeBoxes)(tissue, x, boxes, static_cast<uint32_t>(g));
  });
}

float furthest_move(const Vec4* x, const Vec4* from, size_t n) { return HWY_DYNAMIC_DISPATCH(FurthestMove)(x, from, n); }

bool pairs_are_stale(const TissueCollision& tissue, const PairSearch& search) {
  if (search.built_at.size() != tissue.particles) return true;
  float furthest = 0;
  for (const float move : search.moved) furthest = std::max(furthest, move);
  // Two particles, each half the margin, along all three axes.
  return furthest > tissue.pair_margin / (2 * std::sqrt(3.0f));
}

void find_tissue_pairs(const TissueCollision& tissue, const Vec4* x, PairSearch& search, Jobs& jobs) {
  search.built_at.assign(x, x + tissue.particles);
  make_boxes(tissue, x, search.boxes, jobs);
  const size_t padded = size_t{search.boxes.blocks} * kBlock;
  if (search.radius.size() != padded) {
    for (Column<float>& column : search.at) column.resize(padded);
    search.radius.assign(tissue.radius.begin(), tissue.radius.end());
    search.radius.resize(padded);
    search.part.resize(search.boxes.groups);
  }
  jobs.each(search.boxes.groups, 1, [&](size_t g, size_t) {
    HWY_DYNAMIC_DISPATCH(SpreadPositions)(tissue, x, search, static_cast<uint32_t>(g));
  });
  jobs.each(search.boxes.groups, 1, [&](size_t g, size_t) {
    HWY_DYNAMIC_DISPATCH(PairsOfGroup)(tissue, search, static_cast<uint32_t>(g));
  });
  search.pair.clear();
  for (const PairSearch::Part& part : search.part) search.pair.insert(search.pair.end(), part.pair.begin(), part.pair.end());
}

}  // namespace catgut
#endif  // HWY_ONCE
