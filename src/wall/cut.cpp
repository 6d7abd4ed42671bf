// SPDX-License-Identifier: Apache-2.0
// wall/cut: see the header.
#include "wall/cut.h"

#include <algorithm>
#include <set>

namespace catgut::wall {

uint32_t cut(const Model& m, State& s, Scratch& k, std::span<const std::array<uint32_t, 2>> edge) {
  Topology& t = s.topology;
  Motion& motion = s.motion;
  std::set<std::array<uint32_t, 2>> cuts;
  std::set<uint32_t> touched;
  for (const auto& e : edge) {
    cuts.insert({std::min(e[0], e[1]), std::max(e[0], e[1])});
    touched.insert(e[0]), touched.insert(e[1]);
  }
  const uint32_t before = columns(s);
  // Faces round each column are joined across every edge that is not cut; each further group gets a copy of the column.
  struct Corner {
    uint32_t lane, k, next, previous;  // columns beside it in its face, as they were
    uint32_t group;
  };
  struct Remap {
    uint32_t lane, k, column;
  };
  std::vector<Remap> remap;
  std::vector<uint32_t> source;
  for (const uint32_t c : touched) {
    if (c >= before) continue;
    std::vector<Corner> corner;
    for (uint32_t g = t.gather_first[c]; g < t.gather_first[c + 1]; ++g) {
      const uint32_t from = t.gather_from[g], in = from % kLanesOfBlock, at = from / kLanesOfBlock % 4;
      const uint32_t block = from / (4 * kLanesOfBlock), n = t.corners[block].quads ? 4 : 3;
      const auto& column = t.corners[block].column;
      corner.push_back({block * kLanesOfBlock + in, at, column[(at + 1) % n][in], column[(at + n - 1) % n][in],
                        static_cast<uint32_t>(corner.size())});
    }
    const auto joined = [&](uint32_t other, const Corner& a, const Corner& b) {
      return other != kNone && (a.next == other || a.previous == other) && (b.next == other || b.previous == other) &&
             !cuts.count({std::min(c, other), std::max(c, other)});
    };
    for (bool changed = true; changed;) {
      changed = false;
      for (Corner& a : corner)
        for (Corner& b : corner)
          if (a.group > b.group && (joined(a.next, a, b) || joined(a.previous, a, b))) a.group = b.group, changed = true;
    }
    std::vector<uint32_t> group;
    for (const Corner& a : corner)
      if (std::find(group.begin(), group.end(), a.group) == group.end()) group.push_back(a.group);
    for (size_t g = 1; g < group.size(); ++g) {
      const uint32_t copy = before + static_cast<uint32_t>(source.size());
      source.push_back(c);
      for (const Corner& a : corner)
        if (a.group == group[g]) remap.push_back({a.lane, a.k, copy});
    }
  }
  for (const Remap& r : remap) {
    BlockCorners& corners = t.corners[r.lane / kLanesOfBlock];
    corners.column[r.k][r.lane % kLanesOfBlock] = r.column;
    if (!corners.quads && r.k == 2) corners.column[3][r.lane % kLanesOfBlock] = r.column;
  }
  for (const uint32_t c : source) {
    t.source.push_back(t.source[c]);
    t.slot.push_back(t.slot[c]);
    for (Column<Float4>* list : {&motion.x, &motion.v})
      for (uint32_t i = 0; i < 2; ++i) list->push_back(Float4{(*list)[2 * c + i]});
    for (Column<Float4>* list : {&k.y, &k.force, &k.external, &k.answer})
      for (uint32_t i = 0; i < 2; ++i) list->push_back({});
  }
  if (!source.empty()) renew_topology(m, t, false);
  return static_cast<uint32_t>(source.size());
}

void refactor(const Model& m, State& s, Scratch& k) {
  renew_topology(m, s.topology, true);
  k.rhs.resize(s.topology.factor.size);
}

std::vector<uint32_t> pieces(const State& s) {
  const uint32_t n = columns(s);
  std::vector<uint32_t> piece(n);
  for (uint32_t c = 0; c < n; ++c) piece[c] = c;
  const auto root = [&](uint32_t c) {
    while (piece[c] != c) c = piece[c] = piece[piece[c]];
    return c;
  };
  for (uint32_t c = 0; c < n; ++c)
    for (uint32_t g = s.topology.gather_first[c]; g < s.topology.gather_first[c + 1]; ++g) {
      const uint32_t from = s.topology.gather_from[g], block = from / (4 * kLanesOfBlock), in = from % kLanesOfBlock;
      for (const auto& corner : s.topology.corners[block].column) {
        const uint32_t a = root(c), b = root(corner[in]);
        piece[std::max(a, b)] = std::min(a, b);
      }
    }
  for (uint32_t c = 0; c < n; ++c) piece[c] = root(c);
  return piece;
}

}  // namespace catgut::wall
