// SPDX-License-Identifier: Apache-2.0
// solver/tissue_pairs: reads positions, writes boxes and pairs. Compiled once per instruction set (Highway) and chosen at run
// time. Comparisons only select candidates, so every instruction set finds every pair that touches.
#include "solver/tissue_pairs.h"

#include <cmath>

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

// Bit k of the result: test(k) of lanes k. Sixteen at a time, for any register width.
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
  V most[2] = {hn::Zero(d), hn::Zero(d)};  // two, for instruction-level parallelism
  size_t i = 0;
  for (; i + 2 * kLanes <= count; i += 2 * kLanes)
    for (size_t k = 0; k < 2; ++k)
      most[k] = hn::Max(most[k], hn::Abs(hn::Sub(hn::LoadU(d, at + i + k * kLanes), hn::LoadU(d, was + i + k * kLanes))));
  alignas(64) float lane[kLanes];
  hn::Store(hn::Max(most[0], most[1]), d, lane);
  float along[4] = {};
  for (size_t k = 0; k < kLanes; ++k) along[k % 4] = HWY_MAX(along[k % 4], lane[k]);
  for (; i < count; ++i) along[i % 4] = HWY_MAX(along[i % 4], at[i] > was[i] ? at[i] - was[i] : was[i] - at[i]);
  return std::sqrt(along[0] * along[0] + along[1] * along[1] + along[2] * along[2]);
}

// Which blocks of group g have moved by more than `limit` along an axis since their pairs were found, or are NaN; bit k: its
// block k. The present positions become their origins.
uint32_t MovedBlocks(const Vec4* x, Column<Vec4>& origin, PairSearch& search, uint32_t g, float limit) {
  const D d;
  const uint32_t particles = static_cast<uint32_t>(origin.size());
  uint32_t moved = 0;
  for (uint32_t k = 0; k < kBlock && (g * kBlock + k) * kBlock < particles; ++k) {
    const uint32_t first = (g * kBlock + k) * kBlock, count = HWY_MIN(kBlock, particles - first);
    const float *at = &x[first].x, *was = &origin[first].x;
    bool stays = true;
    size_t i = 0;
    for (; i + kLanes <= 4 * size_t{count}; i += kLanes)
      stays = stays && hn::AllTrue(d, hn::Le(hn::Abs(hn::Sub(hn::LoadU(d, at + i), hn::LoadU(d, was + i))), hn::Set(d, limit)));
    for (; i < 4 * size_t{count}; ++i) stays = stays && (at[i] > was[i] ? at[i] - was[i] : was[i] - at[i]) <= limit;
    if (stays) continue;
    moved |= 1u << k;
    for (i = first; i < first + count; ++i) {
      origin[i] = x[i];
      search.at[0][i] = x[i].x, search.at[1][i] = x[i].y, search.at[2][i] = x[i].z;
    }
  }
  return moved;
}

// Pairs whose first particle is in a block of group g, if that block or one near it has moved. Near blocks: those near before
// or now, with slightly more than the reach, so that the test of the pairs alone decides what is listed.
void PairsOfGroup(const TissueCollision& tissue, PairSearch& search, uint32_t g) {
  const D d;
  PairSearch::Part& part = search.part[g];
  const BlockBoxes &boxes = search.swept, &built = search.built;
  const float reach = 1.0001f * (2 * tissue.largest_radius + tissue.pair_margin);
  const uint32_t end = HWY_MIN(boxes.blocks, (g + 1) * kBlock);
  for (uint32_t ba = g * kBlock; ba < end; ++ba) {
    float from[3], to[3];
    for (size_t axis = 0; axis < 3; ++axis)
      from[axis] = built.block.lower[axis][ba] - reach, to[axis] = built.block.upper[axis][ba] + reach;
    part.near.clear();
    bool anew = false;
    const TissueCollision::ExclusionMask* exclusion = tissue.exclusion.data() + tissue.exclusion_first[ba];
    const TissueCollision::ExclusionMask* const last_kin = tissue.exclusion.data() + tissue.exclusion_first[ba + 1];
    for (uint32_t base = g / 16 * 16; base < boxes.groups; base += 16) {
      uint32_t groups = BoxesThatMeet(boxes.group, base, from, to);
      for (; groups != 0; groups &= groups - 1) {
        const uint32_t other = base + static_cast<uint32_t>(__builtin_ctz(groups));
        if (other < g) continue;
        uint32_t blocks = BoxesThatMeet(boxes.block, size_t{other} * kBlock, from, to);
        if (other == g) blocks &= ~0u << (ba - g * kBlock);
        anew = anew || (blocks & search.part[other].moved) != 0;
        for (; blocks != 0; blocks &= blocks - 1) {
          const uint32_t bb = other * kBlock + static_cast<uint32_t>(__builtin_ctz(blocks));
          while (exclusion != last_kin && exclusion->block < bb) ++exclusion;
          part.near.push_back({bb, exclusion != last_kin && exclusion->block == bb ? exclusion->allowed.data() : nullptr});
        }
      }
    }
    if (!anew) continue;  // the block itself is among them
    std::vector<PairCandidate>& pair = search.of_block[ba];
    pair.clear();
    // Their boxes side by side: most of a near block's particles are out of a particle's reach, and one test covers
    // sixteen.
    Boxes& near_box = part.near_box;
    if (near_box.lower[0].size() < part.near.size()) near_box.resize(part.near.size());
    const size_t padded = (part.near.size() + 15) / 16 * 16;
    for (size_t axis = 0; axis < 3; ++axis)
      for (size_t k = 0; k < padded; ++k) {
        const bool is = k < part.near.size();
        near_box.lower[axis][k] = is ? built.block.lower[axis][part.near[k].block] : 0.0f;
        near_box.upper[axis][k] = is ? built.block.upper[axis][part.near[k].block] : 0.0f;
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
          const uint32_t allowed = near.allowed ? near.allowed[i - ba * kBlock] : 0xffffu;
          if (allowed == 0) continue;  // neighbors in the wall
          uint32_t close =
              allowed & Sixteen([&](size_t k) HWY_ATTR {
                const size_t at = size_t{near.block} * kBlock + k;
                const V dx = hn::Sub(hn::Load(d, search.at[0].data() + at), px);
                const V dy = hn::Sub(hn::Load(d, search.at[1].data() + at), py);
                const V dz = hn::Sub(hn::Load(d, search.at[2].data() + at), pz);
                const V touch = hn::Add(own, hn::Load(d, search.radius.data() + at));
                return hn::Le(hn::Add(hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy)), hn::Mul(dz, dz)), hn::Mul(touch, touch));
              });
          for (; close != 0; close &= close - 1)
            pair.push_back({i, near.block * kBlock + static_cast<uint32_t>(__builtin_ctz(close))});
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

namespace catgut {

HWY_EXPORT(MakeBoxes);
HWY_EXPORT(FurthestMove);
HWY_EXPORT(MovedBlocks);
HWY_EXPORT(PairsOfGroup);

namespace {

// Particles of neighboring blocks that are too close at rest ever to collide.
void find_kin(TissueCollision& t, std::span<const Vec4> rest) {
  BlockBoxes boxes;
  Jobs alone;
  make_boxes(t, rest.data(), boxes, alone);
  float furthest = 0;
  for (const float reach : t.rest_reach) furthest = std::max(furthest, reach);
  for (uint32_t ba = 0; ba < boxes.blocks; ++ba) {
    t.exclusion_first.push_back(static_cast<uint32_t>(t.exclusion.size()));
    auto corner = [&](const std::array<Column<float>, 3>& of) { return Vec3{of[0][ba], of[1][ba], of[2][ba]}; };
    const Vec3 grow{furthest, furthest, furthest};
    for_blocks_near(boxes, corner(boxes.block.lower) - grow, corner(boxes.block.upper) + grow, [&](uint32_t bb) {
      if (bb < ba) return;
      TissueCollision::ExclusionMask exclusion{bb, {}};
      bool all = bb != ba;
      for (uint32_t i = ba * kBlock; i < std::min(t.particles, (ba + 1) * kBlock); ++i)
        for (uint32_t j = bb * kBlock; j < std::min(t.particles, (bb + 1) * kBlock); ++j) {
          const float apart = std::max(t.rest_reach[i], t.rest_reach[j]);
          const bool allowed = i < j && (t.body[i] != t.body[j] || length2(xyz(rest[j]) - xyz(rest[i])) >= apart * apart);
          all = all && allowed;
          if (allowed)
            exclusion.allowed[i % kBlock] = static_cast<uint16_t>(exclusion.allowed[i % kBlock] | 1u << (j % kBlock));
        }
      if (!all) t.exclusion.push_back(exclusion);
    });
  }
  t.exclusion_first.push_back(static_cast<uint32_t>(t.exclusion.size()));
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
  // Wide enough to last long, but not so wide that slightly compressed particles of the wall itself fill the list.
  const float nearest = rest_reach.empty() ? 1.0f : *std::min_element(rest_reach.begin(), rest_reach.end());
  t.pair_margin = std::clamp(0.5f * (nearest - 2 * t.largest_radius), 0.0002f, 0.002f);
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
  if (!search.filled) return true;
  float furthest = 0;
  for (const float move : search.moved) furthest = std::max(furthest, move);
  return furthest > 0.5f * tissue.pair_margin;  // two particles, each half the margin
}

namespace {

// Expands the boxes of group g, and its own, by those of `by`.
void join_boxes(const BlockBoxes& by, BlockBoxes& boxes, uint32_t g) {
  auto join = [](const Boxes& other, Boxes& box, size_t k) {
    for (size_t axis = 0; axis < 3; ++axis) {
      box.lower[axis][k] = std::min(box.lower[axis][k], other.lower[axis][k]);
      box.upper[axis][k] = std::max(box.upper[axis][k], other.upper[axis][k]);
    }
  };
  join(by.group, boxes.group, g);
  for (uint32_t b = g * kBlock; b < std::min(boxes.blocks, (g + 1) * kBlock); ++b) join(by.block, boxes.block, b);
}

void list_pairs(const TissueCollision& tissue, PairSearch& search, Jobs& jobs) {
  jobs.each(search.built.groups, 1, [&](size_t g, size_t) {
    HWY_DYNAMIC_DISPATCH(PairsOfGroup)(tissue, search, static_cast<uint32_t>(g));
  });
  search.pair.clear();
  for (const std::vector<PairCandidate>& pair : search.of_block)
    search.pair.insert(search.pair.end(), pair.begin(), pair.end());
}

}  // namespace

void list_tissue_pairs(const TissueCollision& tissue, const Column<Vec4>& origin, PairSearch& search, Jobs& jobs) {
  make_boxes(tissue, origin.data(), search.built, jobs);
  search.swept = search.built;
  const size_t padded = size_t{search.built.blocks} * kBlock;
  for (size_t axis = 0; axis < 3; ++axis) search.at[axis].assign(padded, kNowhere);
  for (size_t i = 0; i < tissue.particles; ++i)
    search.at[0][i] = origin[i].x, search.at[1][i] = origin[i].y, search.at[2][i] = origin[i].z;
  search.radius.assign(tissue.radius.begin(), tissue.radius.end());
  search.radius.resize(padded);
  search.of_block.resize(search.built.blocks);
  search.part.resize(search.built.groups);
  for (PairSearch::Part& part : search.part) part.moved = (1u << kBlock) - 1;
  search.filled = true;
  list_pairs(tissue, search, jobs);
}

void find_tissue_pairs(const TissueCollision& tissue, const Vec4* x, Column<Vec4>& origin, PairSearch& search, Jobs& jobs) {
  if (origin.size() != tissue.particles) {
    origin.assign(x, x + tissue.particles);
    search.filled = false;
  }
  if (!search.filled) return list_tissue_pairs(tissue, origin, search, jobs);
  // Particles that have moved by less than half the staleness limit may keep their origin: often most of the tissue.
  const float limit = 0.25f * tissue.pair_margin / std::sqrt(3.0f);
  search.swept = search.built;
  jobs.each(search.built.groups, 1, [&](size_t at, size_t) {
    const uint32_t g = static_cast<uint32_t>(at);
    search.part[g].moved = HWY_DYNAMIC_DISPATCH(MovedBlocks)(x, origin, search, g, limit);
    if (search.part[g].moved == 0) return;
    HWY_DYNAMIC_DISPATCH(MakeBoxes)(tissue, origin.data(), search.built, g);
    join_boxes(search.built, search.swept, g);
  });
  list_pairs(tissue, search, jobs);
}

}  // namespace catgut
#endif  // HWY_ONCE
