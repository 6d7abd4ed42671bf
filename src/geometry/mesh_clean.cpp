// SPDX-License-Identifier: Apache-2.0
// geometry/mesh_clean: welds, orients and checks a mesh from a file, and reports what is unusable.
#include "geometry/mesh_clean.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/check.h"
#include "geometry/topology.h"

namespace catgut {

namespace {

struct HalfEdge {
  uint64_t key;
  uint32_t triangle;
  bool forward;  // runs from the smaller to the larger vertex
  bool operator<(const HalfEdge& o) const { return key != o.key ? key < o.key : triangle < o.triangle; }
};

std::vector<HalfEdge> sorted_edges(const TriangleMesh& mesh) {
  std::vector<HalfEdge> edge;
  for (uint32_t t = 0; t < mesh.triangle.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const uint32_t a = mesh.triangle[t][k], b = mesh.triangle[t][(k + 1) % 3];
      edge.push_back({edge_key(a, b), t, a < b});
    }
  }
  std::sort(edge.begin(), edge.end());
  return edge;
}

void check_edges(const TriangleMesh& mesh, const std::vector<HalfEdge>& edge, const std::string& where) {
  size_t bad = 0;
  Vec3 first;
  for (size_t i = 0; i < edge.size();) {
    size_t j = i;
    while (j < edge.size() && edge[j].key == edge[i].key) ++j;
    if (j - i > 2 && bad++ == 0) first = mesh.position[edge[i].key >> 32];
    i = j;
  }
  if (bad == 0) return;
  throw InputError(where,
                   fmt::format("{} edges belong to more than two triangles (not a manifold surface), the first near "
                               "({:.4f}, {:.4f}, {:.4f}) m",
                               bad, first.x, first.y, first.z),
                   "clean it in a mesh editor (Blender: Merge by Distance, then Select Non Manifold), or choose a single node");
}

// Flips triangles until neighbors agree; returns the piece of each triangle (pieces are connected along edges).
std::vector<uint32_t> orient_pieces(TriangleMesh& mesh, const std::vector<HalfEdge>& edge, uint32_t& pieces,
                                    const std::string& where) {
  struct Link {
    uint32_t other;
    bool agrees;
  };
  std::vector<std::vector<Link>> link(mesh.triangle.size());
  for (size_t i = 0; i + 1 < edge.size(); ++i) {
    if (edge[i].key != edge[i + 1].key) continue;
    const bool agrees = edge[i].forward != edge[i + 1].forward;
    link[edge[i].triangle].push_back({edge[i + 1].triangle, agrees});
    link[edge[i + 1].triangle].push_back({edge[i].triangle, agrees});
  }
  constexpr uint32_t none = ~0u;
  std::vector<uint32_t> piece(mesh.triangle.size(), none), queue;
  std::vector<uint8_t> turned(mesh.triangle.size(), 0);
  pieces = 0;
  for (uint32_t seed = 0; seed < piece.size(); ++seed) {
    if (piece[seed] != none) continue;
    piece[seed] = pieces;
    queue.assign(1, seed);
    for (size_t head = 0; head < queue.size(); ++head) {
      const uint32_t t = queue[head];
      for (const Link& l : link[t]) {
        const uint8_t want = l.agrees ? turned[t] : 1 - turned[t];
        if (piece[l.other] == none) {
          piece[l.other] = pieces;
          turned[l.other] = want;
          queue.push_back(l.other);
        } else if (turned[l.other] != want) {
          throw InputError(where, "the surface has only one side (like a Moebius band)",
                           "repair the mesh: no wall can be built inside it");
        }
      }
    }
    ++pieces;
  }
  for (size_t t = 0; t < turned.size(); ++t) {
    if (turned[t]) std::swap(mesh.triangle[t][1], mesh.triangle[t][2]);
  }
  return piece;
}

// The surface with each opening closed by a fan about its center.
TriangleMesh capped(const TriangleMesh& mesh) {
  TriangleMesh closed = mesh;
  for (const auto& loop : boundary_loops(mesh.triangle)) {
    Vec3 middle;
    for (uint32_t v : loop) middle += mesh.position[v] / static_cast<float>(loop.size());
    const uint32_t m = static_cast<uint32_t>(closed.position.size());
    closed.position.push_back(middle);
    for (size_t i = 0; i < loop.size(); ++i) closed.triangle.push_back({m, loop[i], loop[(i + 1) % loop.size()]});
  }
  return closed;
}

// Winding number of the closed surface round p: about 1 (or -1) inside, 0 outside (Van Oosterom and Strackee 1983).
double winding(const TriangleMesh& closed, Vec3 p) {
  double sum = 0;
  for (const Triangle& t : closed.triangle) {
    const Vec3 a = closed.position[t[0]] - p, b = closed.position[t[1]] - p, c = closed.position[t[2]] - p;
    const double la = length(a), lb = length(b), lc = length(c);
    sum += 2 * portable::atan2(static_cast<double>(dot(a, cross(b, c))),
                               la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
  }
  return sum / (4 * 3.14159265358979);
}

bool lies_inside(const TriangleMesh& inner, const TriangleMesh& outer_closed) {
  const size_t step = inner.triangle.size() / 200 + 1;  // a sample of about 200 points is sufficient
  size_t inside = 0, asked = 0;
  for (size_t t = 0; t < inner.triangle.size(); t += step, ++asked) {
    inside += std::abs(winding(outer_closed, inner.position[inner.triangle[t][0]])) > 0.5;
  }
  return 10 * inside >= 8 * asked;  // near its opening it may protrude a little
}

// Organ files often contain the wall twice, outside and lumen: keeps the outer surface and drops specks.
void keep_outer_piece(TriangleMesh& mesh, const std::vector<uint32_t>& piece, uint32_t pieces, const std::string& where) {
  if (pieces == 1) return;
  std::vector<TriangleMesh> part(pieces, TriangleMesh{mesh.position, {}});
  for (size_t t = 0; t < piece.size(); ++t) part[piece[t]].triangle.push_back(mesh.triangle[t]);
  std::vector<double> area(pieces);
  for (size_t i = 0; i < pieces; ++i) area[i] = surface_area(part[i]);
  const double largest = *std::max_element(area.begin(), area.end());
  size_t best = pieces, left = 0;
  double best_volume = -1;
  for (size_t i = 0; i < pieces; ++i) {
    if (area[i] < 0.01 * largest) continue;
    ++left;
    const double volume = std::abs(enclosed_volume(capped(part[i])));
    if (volume > best_volume) best_volume = volume, best = i;
  }
  const TriangleMesh closed = capped(part[best]);
  for (size_t i = 0; i < pieces; ++i) {
    if (i == best || area[i] < 0.01 * largest || lies_inside(part[i], closed)) continue;
    throw InputError(
        where,
        fmt::format("{} separate surfaces side by side, of {:.2f} cm^2 and {:.2f} cm^2 among others; an organ must be one",
                    left, 1e4 * area[best], 1e4 * area[i]),
        "export one of them, or name a single node with path#node");
  }
  mesh.triangle = std::move(part[best].triangle);
}

// Two fans of triangles that touch only in a vertex each get their own: otherwise the vertex has no ring of neighbors.
void split_touching_fans(TriangleMesh& mesh) {
  std::vector<std::vector<uint32_t>> around(mesh.position.size());
  for (uint32_t t = 0; t < mesh.triangle.size(); ++t) {
    for (uint32_t v : mesh.triangle[t]) around[v].push_back(t);
  }
  for (uint32_t v = 0; v < around.size(); ++v) {
    std::vector<uint32_t> left = around[v];
    bool first_fan = true;
    while (!left.empty()) {
      std::vector<uint32_t> fan{left[0]};
      left.erase(left.begin());
      for (size_t head = 0; head < fan.size(); ++head) {
        for (size_t i = 0; i < left.size();) {
          const Triangle &a = mesh.triangle[fan[head]], &b = mesh.triangle[left[i]];
          const bool share = std::any_of(a.begin(), a.end(),
                                         [&](uint32_t x) { return x != v && std::find(b.begin(), b.end(), x) != b.end(); });
          if (share) fan.push_back(left[i]), left.erase(left.begin() + static_cast<std::ptrdiff_t>(i));
          else ++i;
        }
      }
      if (!first_fan) {
        const uint32_t copy = static_cast<uint32_t>(mesh.position.size());
        mesh.position.push_back(Vec3{mesh.position[v]});
        for (uint32_t t : fan) std::replace(mesh.triangle[t].begin(), mesh.triangle[t].end(), v, copy);
      }
      first_fan = false;
    }
  }
}

TriangleMesh without_unused(const TriangleMesh& mesh) {
  std::vector<uint32_t> index(mesh.position.size(), ~0u);
  for (const Triangle& t : mesh.triangle) {
    for (uint32_t v : t) index[v] = 0;
  }
  TriangleMesh out;
  for (size_t v = 0; v < index.size(); ++v) {
    if (index[v] == ~0u) continue;
    index[v] = static_cast<uint32_t>(out.position.size());
    out.position.push_back(mesh.position[v]);
  }
  for (const Triangle& t : mesh.triangle) out.triangle.push_back({index[t[0]], index[t[1]], index[t[2]]});
  return out;
}

void turn_outward(TriangleMesh& mesh) {
  if (enclosed_volume(capped(mesh)) >= 0) return;
  for (Triangle& t : mesh.triangle) std::swap(t[1], t[2]);
}

}  // namespace

float diagonal(const TriangleMesh& mesh) {
  if (mesh.position.empty()) return 0;
  Vec3 low = mesh.position[0], high = low;
  for (Vec3 p : mesh.position) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  return distance(low, high);
}

TriangleMesh weld(const TriangleMesh& mesh, float tolerance) {
  const size_t n = mesh.position.size();
  std::vector<uint32_t> order(n), target(n);
  std::iota(order.begin(), order.end(), 0u);
  std::iota(target.begin(), target.end(), 0u);
  std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
    const float xa = mesh.position[a].x, xb = mesh.position[b].x;
    return xa != xb ? xa < xb : a < b;
  });
  // A sweep along x: only vertices within the tolerance in x can be the same.
  for (size_t i = 0; i < n; ++i) {
    if (target[order[i]] != order[i]) continue;
    const Vec3 p = mesh.position[order[i]];
    for (size_t j = i + 1; j < n && mesh.position[order[j]].x - p.x <= tolerance; ++j) {
      if (target[order[j]] == order[j] && distance(mesh.position[order[j]], p) <= tolerance) target[order[j]] = order[i];
    }
  }
  TriangleMesh out{mesh.position, {}};
  std::vector<std::pair<Triangle, uint32_t>> sorted;
  for (const Triangle& t : mesh.triangle) {
    const Triangle w{target[t[0]], target[t[1]], target[t[2]]};
    if (w[0] == w[1] || w[1] == w[2] || w[2] == w[0]) continue;
    Triangle s = w;
    std::sort(s.begin(), s.end());
    sorted.push_back({s, static_cast<uint32_t>(out.triangle.size())});
    out.triangle.push_back(w);
  }
  std::sort(sorted.begin(), sorted.end());
  std::vector<uint8_t> twice(out.triangle.size(), 0);
  for (size_t i = 1; i < sorted.size(); ++i) twice[sorted[i].second] = sorted[i].first == sorted[i - 1].first;
  std::vector<Triangle> kept;
  for (size_t t = 0; t < twice.size(); ++t) {
    if (!twice[t]) kept.push_back(out.triangle[t]);
  }
  out.triangle = std::move(kept);
  return without_unused(out);
}

TriangleMesh clean_mesh(const TriangleMesh& mesh, const std::string& where) {
  const auto refuse_flat = [&] {
    throw InputError(where, "its triangles have no area", "export a surface mesh with triangles of real size");
  };
  if (mesh.triangle.empty())
    throw InputError(where, "no triangles", "export a surface mesh, not points, lines or a scene without shapes");
  const float size = diagonal(mesh);
  if (!(surface_area(mesh) > 1e-8 * size * size)) refuse_flat();
  TriangleMesh out = weld(mesh, 5e-6f * size);
  if (out.triangle.empty()) refuse_flat();
  const auto edge = sorted_edges(out);
  check_edges(out, edge, where);
  uint32_t pieces = 0;
  const auto piece = orient_pieces(out, edge, pieces, where);
  keep_outer_piece(out, piece, pieces, where);
  split_touching_fans(out);
  out = without_unused(out);
  turn_outward(out);
  return out;
}

}  // namespace catgut
