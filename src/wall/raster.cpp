// SPDX-License-Identifier: Apache-2.0
// wall/raster: see the header.
#include "wall/raster.h"

#include <algorithm>
#include <cmath>

namespace catgut::wall {
namespace {

constexpr int32_t kUnit = kLattice / kRaster;

// Triangle: row j has 8 - j cells that point up, then 7 - j that point down.
constexpr uint32_t up_cell(int i, int j) { return static_cast<uint32_t>(j * (2 * kRaster - j) + i); }
constexpr uint32_t down_cell(int i, int j) { return up_cell(i, j) + static_cast<uint32_t>(kRaster - j); }

void add(Raster& r, uint32_t a, uint32_t b, LatticePoint to) {
  r.link[r.links] = {a, b, r.center[a], to};
  for (const uint32_t c : {a, b})
    if (b != kNone) *std::find(r.of_cell[c].begin(), r.of_cell[c].end(), kNone) = r.links;
  ++r.links;
}
void add(Raster& r, uint32_t a, uint32_t b) { add(r, a, b, r.center[b]); }

Raster quad_raster() {
  Raster r;
  for (auto& c : r.of_cell) c.fill(kNone);
  const auto cell = [](int i, int j) { return static_cast<uint32_t>(j * kRaster + i); };
  for (int j = 0; j < kRaster; ++j)
    for (int i = 0; i < kRaster; ++i) r.center[cell(i, j)] = {i * kUnit + kUnit / 2, j * kUnit + kUnit / 2};
  for (int j = 0; j < kRaster; ++j)
    for (int i = 0; i + 1 < kRaster; ++i) add(r, cell(i, j), cell(i + 1, j)), add(r, cell(j, i), cell(j, i + 1));
  r.inner = r.links;
  const int last = kRaster - 1;
  for (uint32_t e = 0; e < 4; ++e)
    for (int k = 0; k < kRaster; ++k) {
      const uint32_t at[4] = {cell(k, 0), cell(last, k), cell(last - k, last), cell(0, last - k)};
      add(r, at[e], kNone, on_edge(true, e, k * kUnit + kUnit / 2));
    }
  return r;
}

Raster triangle_raster() {
  Raster r;
  r.edges = 3;
  for (auto& c : r.of_cell) c.fill(kNone);
  for (int j = 0; j < kRaster; ++j)
    for (int i = 0; i + j < kRaster; ++i) {
      r.center[up_cell(i, j)] = {i * kUnit + kUnit / 3, j * kUnit + kUnit / 3};
      if (i + j + 1 < kRaster) r.center[down_cell(i, j)] = {i * kUnit + 2 * kUnit / 3, j * kUnit + 2 * kUnit / 3};
    }
  for (int j = 0; j < kRaster; ++j)
    for (int i = 0; i + j + 1 < kRaster; ++i)
      add(r, down_cell(i, j), up_cell(i, j)), add(r, down_cell(i, j), up_cell(i + 1, j)),
          add(r, down_cell(i, j), up_cell(i, j + 1));
  r.inner = r.links;
  const int last = kRaster - 1;
  for (uint32_t e = 0; e < 3; ++e)
    for (int k = 0; k < kRaster; ++k) {
      const uint32_t at[3] = {up_cell(k, 0), up_cell(last - k, k), up_cell(0, last - k)};
      add(r, at[e], kNone, on_edge(false, e, k * kUnit + kUnit / 2));
    }
  return r;
}

// Which side of the line from a to b: true left of it, or on it.
bool left(LatticePoint a, LatticePoint b, LatticePoint p) {
  return int64_t{b.u - a.u} * (p.v - a.v) - int64_t{b.v - a.v} * (p.u - a.u) >= 0;
}

}  // namespace

const Raster& raster(bool quad) {
  static const Raster quads = quad_raster(), triangles = triangle_raster();
  return quad ? quads : triangles;
}

uint32_t cell_at(bool quad, float xi, float eta) {
  constexpr float kHalf = 0.5f * static_cast<float>(kRaster);
  if (quad) {
    const int i = std::clamp(static_cast<int>((xi + 1) * kHalf), 0, kRaster - 1);
    const int j = std::clamp(static_cast<int>((eta + 1) * kHalf), 0, kRaster - 1);
    return static_cast<uint32_t>(j * kRaster + i);
  }
  const float x = std::max(0.0f, xi * kHalf), y = std::max(0.0f, eta * kHalf);
  const int j = std::min(static_cast<int>(y), kRaster - 1), i = std::min(static_cast<int>(x), kRaster - 1 - j);
  const bool down = x - static_cast<float>(i) + (y - static_cast<float>(j)) > 1 && i + j + 1 < kRaster;
  return down ? down_cell(i, j) : up_cell(i, j);
}

LatticePoint to_lattice(bool quad, float xi, float eta) {
  const float s = 0.5f * static_cast<float>(kLattice), off = quad ? 1.0f : 0.0f;
  int32_t u = std::clamp(static_cast<int32_t>((xi + off) * s), 0, kLattice - 8);
  int32_t v = std::clamp(static_cast<int32_t>((eta + off) * s), 0, kLattice - 8);
  if (!quad && u + v > kLattice - 32) {
    const int32_t over = (u + v - (kLattice - 32)) / 2 + 1;
    u -= over, v -= over;
    if (u < 0) v += u, u = 0;
    if (v < 0) u += v, v = 0;
  }
  // Remainders that no line between centers has.
  return {(std::max(u, 0) & ~7) | 1, (std::max(v, 0) & ~7) | 4};
}

LatticePoint on_edge(bool quad, uint32_t e, int32_t t) {
  if (quad) {
    const LatticePoint at[4] = {{t, 0}, {kLattice, t}, {kLattice - t, kLattice}, {0, kLattice - t}};
    return at[e];
  }
  const LatticePoint at[3] = {{t, 0}, {kLattice - t, t}, {0, kLattice - t}};
  return at[e];
}

bool crosses(const Raster::Link& link, LatticePoint p, LatticePoint q) {
  return left(p, q, link.from) != left(p, q, link.to) && left(link.from, link.to, p) != left(link.from, link.to, q);
}

void border_of(bool quad, const Raster::Link& link, LatticePoint& a, LatticePoint& b) {
  const int32_t u = (link.from.u + link.to.u) / 2, v = (link.from.v + link.to.v) / 2, half = kUnit / 2;
  if (quad) {
    const bool across = link.from.v == link.to.v;  // cells side by side along u
    a = across ? LatticePoint{u, v - half} : LatticePoint{u - half, v};
    b = across ? LatticePoint{u, v + half} : LatticePoint{u + half, v};
    return;
  }
  // The middle of a side of a small triangle: on a line u, v or u + v of the lattice.
  if (u % kUnit == 0) a = {u, v - half}, b = {u, v + half};
  else if (v % kUnit == 0) a = {u - half, v}, b = {u + half, v};
  else a = {u + half, v - half}, b = {u - half, v + half};
}

uint64_t component(const Raster& r, const FaceCut& cut, uint32_t first) {
  uint64_t seen = uint64_t{1} << first, open = seen;
  while (open) {
    const uint32_t c = static_cast<uint32_t>(__builtin_ctzll(open));
    open &= open - 1;
    for (const uint32_t l : r.of_cell[c]) {
      if (l == kNone) break;
      if (cut.has(l)) continue;
      const uint32_t other = r.link[l].a == c ? r.link[l].b : r.link[l].a;
      const uint64_t bit = uint64_t{1} << other;
      if (!(seen & bit)) seen |= bit, open |= bit;
    }
  }
  return seen;
}

}  // namespace catgut::wall
