// SPDX-License-Identifier: Apache-2.0
// wall/cut: see the header.
#include "wall/cut.h"

#include <algorithm>
#include <numeric>
#include <set>

namespace catgut::wall {
namespace {

constexpr int kCrumb = 3;  // cells: smaller parts of a face stay with a neighbor

uint32_t corners_of(const Model& m, uint32_t face) { return m.mesh.face[face][3] == kNone ? 3 : 4; }
bool is_quad(const Model& m, uint32_t face) { return m.mesh.face[face][3] != kNone; }
Vec3 rest_mid(const Model& m, uint32_t column) { return (m.mesh.outer[column] + m.mesh.inner[column]) * 0.5f; }

// The half link on the other side of an edge.
struct Beyond {
  uint32_t face, link;
  uint32_t corner, next;  // of that face: those that lie on corners e and e + 1 of this one
};
Beyond beyond(const Model& m, uint32_t face, uint32_t e, uint32_t k) {
  const uint32_t at = m.neighbor[face][e], other = at / 4, edge = at % 4, n = corners_of(m, other);
  const bool turned = m.mesh.face[other][edge] != m.mesh.face[face][e];  // as between two faces seen from one side
  const uint32_t a = turned ? (edge + 1) % n : edge, b = turned ? edge : (edge + 1) % n;
  return {other, raster(n == 4).over_edge(edge, turned ? kRaster - 1 - k : k), a, b};
}

constexpr Constant kScaled[] = {kA11,     kA12,     kA22,    kA16,    kA26,    kA66,       kB11,       kB12,       kB22,
                                kB16,     kB26,     kB66,    kE11,    kE12,    kE22,       kE16,       kE26,       kE66,
                                kStiff1,  kStiff2,  kThick,  kShear1, kShear2, kInPlane11, kInPlane12, kInPlane22, kTwist11,
                                kTwist12, kTwist22, kEdge11, kEdge12, kEdge22, kThick2,    kThick3,    kThick4};

// Everything that follows from the links: fragments, columns, and where each comes from.
struct Layout {
  std::vector<uint32_t> first_fragment;
  std::vector<Fragment> fragment;
  std::vector<uint32_t> source, was;  // per column: at rest, in the old topology
  std::vector<uint32_t> lane_was;     // per fragment
  std::vector<BlockCorners> corners;
};

Layout lay_out(const Model& m, const Topology& t) {
  const uint32_t faces = static_cast<uint32_t>(m.lane_of_face.size()), rest = static_cast<uint32_t>(m.mesh.outer.size());
  Layout out;
  out.first_fragment.assign(faces, kNone);
  std::vector<uint32_t> first(faces + 1);  // elements
  std::vector<uint8_t> touched(rest, 0);
  uint32_t elements = 0;
  for (uint32_t f = 0; f < faces; ++f) {
    first[f] = elements++;
    if (!t.cut[f].any()) continue;
    for (uint32_t k = 0; k < corners_of(m, f); ++k) touched[m.mesh.face[f][k]] = 1;
    const Raster& r = raster(is_quad(m, f));
    uint64_t left = component(r, t.cut[f], 0);
    if (left == ~uint64_t{0}) continue;
    out.first_fragment[f] = static_cast<uint32_t>(out.fragment.size());
    out.fragment.push_back({left, f, 0});
    for (uint64_t done = left; done != ~uint64_t{0}; done |= left) {
      left = component(r, t.cut[f], static_cast<uint32_t>(__builtin_ctzll(~done)));
      out.fragment.push_back({left, f, 0});
      ++elements;
    }
  }
  first[faces] = elements;

  // Corners of elements that are one column.
  std::vector<uint32_t> root(size_t{4} * elements);
  std::iota(root.begin(), root.end(), 0u);
  const auto find = [&](uint32_t a) {
    while (root[a] != a) a = root[a] = root[root[a]];
    return a;
  };
  const auto join = [&](uint32_t a, uint32_t b) {
    a = find(a), b = find(b);
    root[std::max(a, b)] = std::min(a, b);
  };
  const auto element = [&](uint32_t face, uint32_t cell) {
    uint32_t at = first[face];
    if (first[face + 1] - at == 1) return at;
    for (uint32_t i = out.first_fragment[face]; !(out.fragment[i].cells >> cell & 1); ++i) ++at;
    return at;
  };
  std::vector<uint32_t> any(rest, kNone);
  for (uint32_t f = 0; f < faces; ++f) {
    const uint32_t n = corners_of(m, f);
    const auto& face = m.mesh.face[f];
    const Raster& r = raster(n == 4);
    for (uint32_t k = 0; k < n; ++k) {
      if (!touched[face[k]]) {
        if (any[face[k]] == kNone) any[face[k]] = 4 * first[f] + k;
        else join(any[face[k]], 4 * first[f] + k);
      }
      if (m.neighbor[f][k] == kNone || m.neighbor[f][k] / 4 < f || (!touched[face[k]] && !touched[face[(k + 1) % n]])) continue;
      for (uint32_t i = 0; i < kRaster; ++i) {
        const uint32_t link = r.over_edge(k, i);
        const Beyond o = beyond(m, f, k, i);
        if (t.cut[f].has(link) || t.cut[o.face].has(o.link)) continue;
        const uint32_t a = 4 * element(f, r.link[link].a);
        const uint32_t b = 4 * element(o.face, raster(is_quad(m, o.face)).link[o.link].a);
        join(a + k, b + o.corner), join(a + (k + 1) % n, b + o.next);
      }
    }
  }

  // Numbers of columns: the first corner of a column keeps its number, the others follow in order.
  std::vector<uint32_t> number(size_t{4} * elements, kNone);
  std::vector<uint8_t> given(rest, 0);
  out.source.resize(rest), out.was.resize(rest);
  std::iota(out.source.begin(), out.source.end(), 0u);
  for (uint32_t f = 0; f < faces; ++f)
    for (uint32_t e = first[f]; e < first[f + 1]; ++e)
      for (uint32_t k = 0; k < corners_of(m, f); ++k) {
        const uint32_t column = m.mesh.face[f][k], a = find(4 * e + k);
        if (number[a] != kNone) continue;
        number[a] = column;
        const uint32_t cell =
            first[f + 1] - first[f] == 1
                ? 0
                : static_cast<uint32_t>(__builtin_ctzll(out.fragment[out.first_fragment[f] + e - first[f]].cells));
        const uint32_t lane = lane_at(m, t, f, cell), was = t.corners[lane / kLanesOfBlock].column[k][lane % kLanesOfBlock];
        if (!given[column]) {
          given[column] = 1, out.was[column] = was;
          continue;
        }
        number[a] = static_cast<uint32_t>(out.source.size());
        out.source.push_back(column), out.was.push_back(was);
      }

  // Lanes.
  out.corners.assign(t.corners.begin(), t.corners.begin() + static_cast<std::ptrdiff_t>(m.block.size()));
  for (uint32_t f = 0; f < faces; ++f) {
    const uint32_t n = corners_of(m, f), parts = first[f + 1] - first[f];
    for (uint32_t k = 0; k < 4; ++k) {
      const uint32_t lane = m.lane_of_face[f], corner = k < n ? k : 2;
      out.corners[lane / kLanesOfBlock].column[k][lane % kLanesOfBlock] =
          parts == 1 ? number[find(4 * first[f] + corner)] : m.mesh.face[f][corner];
    }
  }
  uint32_t next[2] = {0, 0};
  for (size_t i = 0; i < out.fragment.size(); ++i) {
    Fragment& part = out.fragment[i];
    const uint32_t n = corners_of(m, part.face), quad = n == 4;
    if (next[quad] % kLanesOfBlock == 0) {
      next[quad] = static_cast<uint32_t>(out.corners.size()) * kLanesOfBlock;
      out.corners.emplace_back().quads = quad;
    }
    const uint32_t e = first[part.face] + static_cast<uint32_t>(i) - out.first_fragment[part.face];
    out.lane_was.push_back(lane_at(m, t, part.face, static_cast<uint32_t>(__builtin_ctzll(part.cells))));
    part.lane = next[quad]++;
    for (uint32_t k = 0; k < 4; ++k)
      out.corners[part.lane / kLanesOfBlock].column[k][part.lane % kLanesOfBlock] = number[find(4 * e + (k < n ? k : 2))];
  }
  return out;
}

// Installs a layout. motion: null while a topology is restored.
void install(const Model& m, Layout&& l, Topology& t, Motion* motion) {
  const size_t wholes = m.block.size();
  t.extra.assign(l.corners.size() - wholes, {});
  if (motion) {
    std::vector<BlockTurn> turn(motion->turn.begin(), motion->turn.begin() + static_cast<std::ptrdiff_t>(wholes));
    turn.resize(l.corners.size());
    for (size_t b = wholes; b < turn.size(); ++b) turn[b].w.fill(1);
    for (size_t i = 0; i < l.fragment.size(); ++i) {
      const uint32_t from = l.lane_was[i], to = l.fragment[i].lane, in = from % kLanesOfBlock, at = to % kLanesOfBlock;
      const BlockTurn& a = motion->turn[from / kLanesOfBlock];
      BlockTurn& b = turn[to / kLanesOfBlock];
      b.x[at] = a.x[in], b.y[at] = a.y[in], b.z[at] = a.z[in], b.w[at] = a.w[in];
    }
    motion->turn.swap(turn);
    for (Column<Float4>* list : {&motion->x, &motion->v}) {
      const Column<Float4> before = *list;
      list->resize(2 * l.source.size());
      for (size_t c = 0; c < l.was.size(); ++c)
        for (size_t i = 0; i < 2; ++i) (*list)[2 * c + i] = before[2 * l.was[c] + i];
    }
  }
  for (const Fragment& part : l.fragment) {
    const uint32_t from = m.lane_of_face[part.face], block = part.lane / kLanesOfBlock - static_cast<uint32_t>(wholes);
    const float share = part_of_stiffness(part);
    for (uint32_t k = 0; k < kConstants; ++k)
      t.extra[block].constant[k][part.lane % kLanesOfBlock] = m.block[from / kLanesOfBlock].constant[k][from % kLanesOfBlock];
    for (const Constant k : kScaled) t.extra[block].constant[k][part.lane % kLanesOfBlock] *= share;
  }
  const std::vector<uint32_t> slot = t.slot;
  t.slot.resize(l.source.size());
  for (size_t c = 0; c < l.was.size(); ++c) t.slot[c] = slot[l.was[c]];
  t.corners = std::move(l.corners), t.source = std::move(l.source);
  t.first_fragment = std::move(l.first_fragment), t.fragment = std::move(l.fragment);
  renew_topology(m, t, false);
}

void make_room(const State& s, Scratch& k) {
  for (Column<Float4>* list : {&k.y, &k.force, &k.external, &k.answer}) list->resize(s.motion.x.size());
  k.block_force.resize(s.topology.corners.size());
  k.flat_corner.reserve(4 * kLanesOfBlock * k.block_force.size());
}

}  // namespace

Vec3 rest_place(const Model& m, const Point& p) {
  const auto& f = m.mesh.face[p.face];
  if (!is_quad(m, p.face))
    return rest_mid(m, f[0]) * (1 - 0.5f * (p.xi + p.eta)) + rest_mid(m, f[1]) * (0.5f * p.xi) +
           rest_mid(m, f[2]) * (0.5f * p.eta);
  const float a = 1 - p.xi, b = 1 + p.xi, c = 1 - p.eta, d = 1 + p.eta;
  return (rest_mid(m, f[0]) * (a * c) + rest_mid(m, f[1]) * (b * c) + rest_mid(m, f[2]) * (b * d) +
          rest_mid(m, f[3]) * (a * d)) *
         0.25f;
}

bool trace(const Model& m, const Point& from, const Point& to, std::vector<Mark>& marks) {
  // The shortest way from face to face; a cut moves by less than a face at a time.
  struct Step {
    uint32_t face, before, edge;  // the edge of `before` that leads here
  };
  std::array<Step, 256> queue;
  size_t count = 0, at = 0, level_end = 1;
  uint32_t level = 0;
  queue[count++] = {from.face, kNone, 0};
  while (at < count && queue[at].face != to.face) {
    if (at == level_end) {
      level_end = count;
      if (++level > kMaxWay) return false;
    }
    for (uint32_t e = 0; e < corners_of(m, queue[at].face); ++e) {
      const uint32_t over = m.neighbor[queue[at].face][e];
      if (over == kNone || count == queue.size()) continue;
      const bool seen = std::any_of(queue.begin(), queue.begin() + static_cast<std::ptrdiff_t>(count),
                                    [&](const Step& s) { return s.face == over / 4; });
      if (!seen) queue[count++] = {over / 4, static_cast<uint32_t>(at), e};
    }
    ++at;
  }
  if (at == count) return false;
  std::array<size_t, kMaxWay + 2> way;
  size_t length_of_way = 0;
  for (uint32_t i = static_cast<uint32_t>(at); i != kNone; i = queue[i].before) {
    if (length_of_way == way.size()) return false;
    way[length_of_way++] = i;
  }
  const Vec3 target = rest_place(m, to);
  LatticePoint p = to_lattice(is_quad(m, from.face), from.xi, from.eta);
  for (size_t i = length_of_way; i-- > 0;) {
    const uint32_t face = queue[way[i]].face;
    const Raster& r = raster(is_quad(m, face));
    LatticePoint q, next;
    if (i == 0) {
      q = to_lattice(is_quad(m, to.face), to.xi, to.eta);
    } else {
      // Where the straight line to the target crosses the edge, as on a plane.
      const Step& step = queue[way[i - 1]];
      const uint32_t n = corners_of(m, face), e = step.edge;
      Point here{face, 0, 0, 0};
      to_natural(n == 4, p, here.xi, here.eta);
      const Vec3 a = rest_mid(m, m.mesh.face[face][e]), along = rest_mid(m, m.mesh.face[face][(e + 1) % n]) - a;
      const float size2 = length2(along);
      const auto height = [&](Vec3 x, float& t) {
        t = dot(x - a, along) / size2;
        return length(x - a - along * t);
      };
      float ta = 0, tb = 0;
      const float ha = height(rest_place(m, here), ta), hb = height(target, tb);
      const float t = ha + hb > 0 ? (ta * hb + tb * ha) / (ha + hb) : ta;
      const int32_t unit =
          std::clamp(static_cast<int32_t>(std::clamp(t, 0.0f, 1.0f) * static_cast<float>(kLattice)), 1, kLattice - 1) | 1;
      q = on_edge(n == 4, e, unit);
      const uint32_t over = m.neighbor[face][e];
      const bool turned = m.mesh.face[over / 4][over % 4] != m.mesh.face[face][e];
      next = on_edge(is_quad(m, over / 4), over % 4, turned ? kLattice - unit : unit);
    }
    for (uint32_t l = 0; l < r.links; ++l)
      if (crosses(r.link[l], p, q)) marks.push_back({face, l});
    p = next;
  }
  return true;
}

CutResult cut_links(const Model& m, State& s, Scratch& k, std::span<const Mark> marks) {
  Topology& t = s.topology;
  CutResult out;
  if (t.cut.empty()) {
    const size_t faces = m.lane_of_face.size();
    t.cut.assign(faces, {}), t.factored.assign(faces, {}), t.first_fragment.assign(faces, kNone);
  }
  std::vector<Mark> fresh;
  for (const Mark& mark : marks)
    if (!t.cut[mark.face].has(mark.link)) t.cut[mark.face].set(mark.link), fresh.push_back(mark);
  // Crumbs stay with one of their neighbors.
  for (size_t i = 0; i < fresh.size(); ++i) {
    const uint32_t face = fresh[i].face;
    FaceCut& cut = t.cut[face];
    const Raster& r = raster(is_quad(m, face));
    if (fresh[i].link >= r.inner) continue;
    for (const uint32_t cell : {r.link[fresh[i].link].a, r.link[fresh[i].link].b}) {
      const uint64_t crumb = component(r, cut, cell);
      if (__builtin_popcountll(crumb) >= kCrumb) continue;
      bool held = false;  // over an edge
      for (uint32_t e = 0; e < r.edges && !held; ++e)
        for (uint32_t j = 0; j < kRaster && !held && m.neighbor[face][e] != kNone; ++j) {
          const uint32_t link = r.over_edge(e, j);
          if (!(crumb >> r.link[link].a & 1) || cut.has(link)) continue;
          const Beyond o = beyond(m, face, e, j);
          held = !t.cut[o.face].has(o.link);
        }
      if (held) continue;
      // By a single link: with more it would join what a later cut divides.
      for (const Mark& mark : fresh) {
        if (mark.face != face || mark.link >= r.inner || !cut.has(mark.link)) continue;
        if ((crumb >> r.link[mark.link].a & 1) == (crumb >> r.link[mark.link].b & 1)) continue;
        cut.clear(mark.link);
        break;
      }
    }
  }
  std::erase_if(fresh, [&](const Mark& mark) { return !t.cut[mark.face].has(mark.link); });
  if (fresh.empty()) return out;
  Layout layout = lay_out(m, t);
  if (layout.fragment.size() > max_fragments(m)) {
    for (const Mark& mark : fresh) t.cut[mark.face].clear(mark.link);
    out.refused = true;
    return out;
  }
  out.columns = static_cast<uint32_t>(layout.source.size()) - columns(s);
  out.divided = out.columns > 0 || layout.fragment.size() != t.fragment.size();
  if (!out.divided) return out;
  const uint32_t before = out.columns > 0 ? count_pieces(s) : 0;
  install(m, std::move(layout), t, &s.motion);
  make_room(s, k);
  out.freed = out.columns > 0 && count_pieces(s) > before;
  if (out.freed) refactor(m, s, k);
  return out;
}

uint32_t cut(const Model& m, State& s, Scratch& k, std::span<const std::array<uint32_t, 2>> edge) {
  std::set<std::array<uint32_t, 2>> cuts;
  for (const auto& e : edge) cuts.insert({std::min(e[0], e[1]), std::max(e[0], e[1])});
  std::vector<Mark> marks;
  for (uint32_t f = 0; f < m.lane_of_face.size(); ++f) {
    const uint32_t n = corners_of(m, f);
    const Raster& r = raster(n == 4);
    for (uint32_t e = 0; e < n; ++e)
      for (uint32_t i = 0; i < kRaster; ++i) {
        const uint32_t link = r.over_edge(e, i), lane = lane_at(m, s.topology, f, r.link[link].a);
        const auto& column = s.topology.corners[lane / kLanesOfBlock].column;
        const uint32_t a = column[e][lane % kLanesOfBlock], b = column[(e + 1) % n][lane % kLanesOfBlock];
        if (cuts.count({std::min(a, b), std::max(a, b)})) marks.push_back({f, link});
      }
  }
  const uint32_t before = columns(s);
  cut_links(m, s, k, marks);
  return columns(s) - before;
}

void refactor(const Model& m, State& s, Scratch& k) {
  renew_topology(m, s.topology, true);
  s.topology.factored = s.topology.cut;
  k.rhs.resize(s.topology.factor.size);
}

void restore(const Model& m, Topology& t) {
  const std::vector<FaceCut> cut = std::move(t.cut), factored = std::move(t.factored);
  const uint32_t version = t.version;
  t = {};
  t.corners.resize(m.block.size());
  for (uint32_t f = 0; f < m.lane_of_face.size(); ++f) {
    const uint32_t lane = m.lane_of_face[f], n = corners_of(m, f);
    t.corners[lane / kLanesOfBlock].quads = n == 4;
    for (uint32_t k = 0; k < 4; ++k)
      t.corners[lane / kLanesOfBlock].column[k][lane % kLanesOfBlock] = m.mesh.face[f][k < n ? k : 2];
  }
  t.source.resize(m.mesh.outer.size());
  std::iota(t.source.begin(), t.source.end(), 0u);
  renew_topology(m, t, true);
  if (!cut.empty()) {
    const auto any = [](const FaceCut& c) { return c.any(); };
    t.cut = factored;
    if (std::any_of(factored.begin(), factored.end(), any)) {
      install(m, lay_out(m, t), t, nullptr);
      renew_topology(m, t, true);
    }
    t.factored = factored, t.cut = cut;
    install(m, lay_out(m, t), t, nullptr);
  }
  t.version = version + 1;
}

uint32_t count_pieces(const State& s) {
  const std::vector<uint32_t> piece = pieces(s);
  uint32_t count = 0;
  for (uint32_t c = 0; c < piece.size(); ++c) count += piece[c] == c;
  return count;
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
