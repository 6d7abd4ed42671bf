// SPDX-License-Identifier: Apache-2.0
// thread/pairs: broad phase of segments against each other and tools. The list is kept until a move of half its margin.
// The memory of a pair is carried over by key, so a refresh only changes which pairs are evaluated. Reads positions; writes the
// crossings.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <utility>

#include "thread/internal.h"

namespace catgut::thread {
namespace {

constexpr size_t kBlock = 8;  // segments that share a bounding sphere
// Segments round two holes in adjacent segments, in addition to skipped_neighbors, that do not touch each other. The node
// between such holes waits beyond one until the other lets it on: what is drawn from it to its neighbors is not where the
// thread is.
constexpr size_t kRoundHoles = 3;

CATGUT_CLONES void half_lengths(size_t segments, const float* __restrict x, const float* __restrict y,
                                const float* __restrict z, float* __restrict half) {
  for (size_t i = 0; i < segments; ++i) half[i] = 0.5f * std::sqrt(x[i] * x[i] + y[i] * y[i] + z[i] * z[i]);
}
CATGUT_CLONES void middles(size_t segments, const float* __restrict x, float* __restrict middle) {
  for (size_t i = 0; i < segments; ++i) middle[i] = 0.5f * (x[i] + x[i + 1]);
}

// 1 for each segment with its midpoint within reach of p.
CATGUT_CLONES void near_middles(const float* __restrict x, const float* __restrict y, const float* __restrict z,
                                const float* __restrict half, Vec3 p, float reach, uint8_t* __restrict near) {
  for (size_t k = 0; k < kBlock; ++k) {
    const float dx = x[k] - p.x, dy = y[k] - p.y, dz = z[k] - p.z, r = reach + half[k];
    near[k] = dx * dx + dy * dy + dz * dz < r * r;
  }
}

}  // namespace

uint32_t skipped_neighbors(const Settings& settings, const State& state) {
  // A strand that turns back at its minimum radius (its own) needs this much length in between.
  const float shortest = *std::min_element(state.rest.begin(), state.rest.end());
  return std::max(2u, static_cast<uint32_t>(std::ceil(1.6f * settings.material.diameter / shortest)));
}

void refresh_pairs(const Settings& settings, State& state, Scratch& s, std::span<const ToolCapsule> tools, float time) {
  const size_t m = state.segments(), blocks = (m + kBlock - 1) / kBlock;
  const float reach = settings.material.diameter + settings.list_margin;
  const uint32_t skip = skipped_neighbors(settings, state);
  middles(m, state.x.x.data(), s.middle.x.data());
  middles(m, state.x.y.data(), s.middle.y.data());
  middles(m, state.x.z.data(), s.middle.z.data());
  find_edges(state, s);
  half_lengths(m, s.e.x.data(), s.e.y.data(), s.e.z.data(), s.half.data());
  for (size_t b = 0; b < blocks; ++b) {
    const size_t first = b * kBlock, end = std::min(m, first + kBlock);
    Vec3 center{};
    for (size_t i = first; i < end; ++i) center += s.middle.at(i);
    center = center / static_cast<float>(end - first);
    float radius = 0;
    for (size_t i = first; i < end; ++i) radius = std::max(radius, distance(center, s.middle.at(i)) + s.half[i]);
    s.block_middle[b] = center, s.block_radius[b] = radius;
  }
  s.new_key.clear(), s.new_budget.clear(), s.new_crossing.clear();
  size_t old = 0;
  auto keep = [&](uint32_t key) {
    if (s.new_key.size() >= s.max_crossings) {
      ++state.overflow;
      return;
    }
    while (old < state.key.size() && state.key[old] < key) ++old;
    const bool known = old < state.key.size() && state.key[old] == key;
    s.new_key.push_back(key);
    s.new_budget.push_back(known ? state.budget[old] : 0.0f);
    s.new_crossing.push_back(known ? state.crossing[old] : Crossing{});
  };
  // Tools near a block, as bits.
  std::fill_n(s.block_tools.begin(), blocks, std::array<uint64_t, kMaxTools / 64>{});
  for (size_t k = 0; k < tools.size(); ++k) {
    const Vec3 from = lerp(tools[k].a, tools[k].to_a, time), along = lerp(tools[k].b, tools[k].to_b, time) - from;
    const float size2 = std::max(length2(along), 1e-12f), far = tools[k].radius + std::max(0.0f, tools[k].widens) + reach;
    for (size_t b = 0; b < blocks; ++b) {
      const Vec3 off = s.block_middle[b] - from;
      const float r = 1.001f * (far + s.block_radius[b]);
      if (length2(off - along * clamp01(dot(off, along) / size2)) < r * r) s.block_tools[b][k / 64] |= uint64_t{1} << k % 64;
    }
  }
  std::fill_n(s.holed.begin(), m, uint8_t{0});  // 1: a hole is in this segment and in the next one
  for (size_t e = 0; e + 1 < state.eyelet.size(); ++e)
    s.holed[state.eyelet[e].segment] = state.eyelet[e].segment + 1 == state.eyelet[e + 1].segment;
  const auto round_holes = [&](size_t i, size_t j) {
    return j <= i + skip + kRoundHoles && std::find(&s.holed[i], &s.holed[j], 1) != &s.holed[j];
  };
  uint8_t near[kBlock];
  size_t near_blocks = 0;
  for (size_t i = 0; i < m; ++i) {
    // Blocks that any segment of this one's block can reach.
    if (const size_t own = i / kBlock; i % kBlock == 0) {
      near_blocks = 0;
      for (size_t b = own; b < blocks; ++b) {
        const float r = 1.001f * (reach + s.block_radius[own] + s.block_radius[b]);
        if (length2(s.block_middle[b] - s.block_middle[own]) <= r * r) s.near_block[near_blocks++] = static_cast<uint32_t>(b);
      }
    }
    if (state.broken[i]) continue;
    const Vec3 at = s.middle.at(i), a = s.e.at(i);
    const float half = s.half[i];
    // Where the thread is cut, its next segments are another piece.
    uint32_t near_by = 1;
    while (near_by < skip && i + near_by < m && !state.broken[i + near_by]) ++near_by;
    for (size_t n = 0; n < near_blocks; ++n) {
      const size_t b = s.near_block[n];
      if (b < (i + near_by + 1) / kBlock) continue;
      const float r = reach + half + s.block_radius[b];
      if (length2(s.block_middle[b] - at) > r * r) continue;
      const size_t first = b * kBlock;
      near_middles(&s.middle.x[first], &s.middle.y[first], &s.middle.z[first], &s.half[first], at, reach + half, near);
      uint64_t left;  // a byte for each
      static_assert(sizeof left == kBlock && std::endian::native == std::endian::little);
      std::memcpy(&left, near, sizeof left);
      for (; left != 0; left &= left - 1) {
        const size_t j = first + static_cast<size_t>(std::countr_zero(left)) / 8;
        if (j <= i + near_by || j >= m || state.broken[j] || round_holes(i, j)) continue;
        const Vec3 p = between(state, i, j), c = s.e.at(j);
        float u, v;
        closest_points(p, a, c, u, v);
        if (length2(p + a * u - c * v) < reach * reach) keep(static_cast<uint32_t>(i << 16 | j));
      }
    }
    const std::array<uint64_t, kMaxTools / 64>& tools_here = s.block_tools[i / kBlock];
    for (size_t word = 0; word < tools_here.size(); ++word)
      for (uint64_t left = tools_here[word]; left != 0; left &= left - 1) {
        const size_t k = 64 * word + static_cast<size_t>(std::countr_zero(left));
        const ToolCapsule& tool = tools[k];
        if (i >= tool.own_first && i <= tool.own_last) continue;
        const Vec3 ta = lerp(tool.a, tool.to_a, time), tb = lerp(tool.b, tool.to_b, time);
        const float far = tool.radius + std::max(0.0f, tool.widens) + 0.5f * settings.material.diameter + settings.list_margin;
        const Vec3 p = state.position(i) - ta, c = tb - ta;
        float u, v;
        closest_points(p, a, length2(c) > 1e-12f ? c : Vec3{1e-6f, 0, 0}, u, v);
        if (length2(p + a * u - c * v) < far * far) keep(static_cast<uint32_t>(i << 16 | (kTool + k)));
      }
  }
  // All of them have the same capacity.
  state.key.swap(s.new_key), state.budget.swap(s.new_budget), state.crossing.swap(s.new_crossing);
  for (auto [to, from] :
       {std::pair{&state.listed.x, &state.x.x}, std::pair{&state.listed.y, &state.x.y}, std::pair{&state.listed.z, &state.x.z}})
    to->assign(from->begin(), from->end());
  state.travel = 0;
  ++state.refreshes;
}

}  // namespace catgut::thread
