// SPDX-License-Identifier: Apache-2.0
// geometry/editable_mesh: collapse, split and flip of edges, the operations of remeshing.
#include "geometry/editable_mesh.h"

#include <algorithm>

#include "core/check.h"
#include "geometry/topology.h"

namespace catgut {

namespace {

bool has(const Triangle& t, uint32_t v) { return t[0] == v || t[1] == v || t[2] == v; }

}  // namespace

EditableMesh::EditableMesh(const TriangleMesh& mesh)
    : position(mesh.position), triangle_(mesh.triangle), around_(mesh.position.size()), rim_(mesh.position.size(), 0) {
  for (uint32_t t = 0; t < triangle_.size(); ++t) {
    for (uint32_t v : triangle_[t]) around_[v].push_back(t);
  }
  for (const auto& loop : boundary_loops(triangle_)) {
    for (uint32_t v : loop) rim_[v] = 1;
  }
  for (const auto& a : around_) alive_ += !a.empty();
}

std::vector<uint32_t> EditableMesh::neighbors(uint32_t v) const {
  std::vector<uint32_t> out;
  for (uint32_t t : around_[v]) {
    for (uint32_t u : triangle_[t]) {
      if (u != v) out.push_back(u);
    }
  }
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

Vec3 EditableMesh::area_vector(const Triangle& t) const {
  return cross(position[t[1]] - position[t[0]], position[t[2]] - position[t[0]]);
}

Vec3 EditableMesh::normal(uint32_t v) const {
  Vec3 sum;
  for (uint32_t t : around_[v]) sum += area_vector(triangle_[t]);
  return normalized(sum);
}

int EditableMesh::opposite(uint32_t a, uint32_t b, uint32_t out[2]) const {
  int count = 0;
  for (uint32_t t : around_[a]) {
    const Triangle& x = triangle_[t];
    if (!has(x, b)) continue;
    CATGUT_CHECK(count < 2);
    for (int k = 0; k < 3; ++k) {
      if (x[k] == a || x[k] == b) continue;
      out[count++] = x[k];
      if (count == 2 && x[(k + 1) % 3] == a) std::swap(out[0], out[1]);  // c a b: this one runs a to b
    }
  }
  return count;
}

bool EditableMesh::rim_edge(uint32_t a, uint32_t b) const {
  uint32_t c[2];
  return rim_[a] && rim_[b] && opposite(a, b, c) == 1;
}

std::vector<std::pair<uint32_t, uint32_t>> EditableMesh::edges() const {
  std::vector<std::pair<uint32_t, uint32_t>> out;
  for (uint32_t v = 0; v < around_.size(); ++v) {
    for (uint32_t u : neighbors(v)) {
      if (v < u) out.push_back({v, u});
    }
  }
  return out;
}

void EditableMesh::remove(uint32_t t) {
  for (uint32_t v : triangle_[t]) {
    auto& list = around_[v];
    list.erase(std::find(list.begin(), list.end(), t));
  }
}

uint32_t EditableMesh::split(uint32_t a, uint32_t b, Vec3 p) {
  const uint32_t m = static_cast<uint32_t>(position.size());
  const bool rim = rim_edge(a, b);
  position.push_back(p);
  around_.emplace_back();
  rim_.push_back(rim);
  const std::vector<uint32_t> both = around_[a];
  for (uint32_t t : both) {
    if (!has(triangle_[t], b)) continue;
    Triangle second = triangle_[t];
    std::replace(second.begin(), second.end(), a, m);  // keeps b
    remove(t);
    std::replace(triangle_[t].begin(), triangle_[t].end(), b, m);  // keeps a
    const uint32_t s = static_cast<uint32_t>(triangle_.size());
    triangle_.push_back(second);
    for (uint32_t v : triangle_[t]) around_[v].push_back(t);
    for (uint32_t v : second) around_[v].push_back(s);
  }
  ++alive_;
  return m;
}

bool EditableMesh::collapse(uint32_t a, uint32_t b, Vec3 p, size_t rim_left) {
  uint32_t wing[2];
  const int wings = opposite(a, b, wing);
  if (rim_[a] && rim_[b] && (wings != 1 || rim_left <= 5)) return false;  // would pinch or close an opening
  const auto na = neighbors(a), nb = neighbors(b);
  std::vector<uint32_t> common;
  std::set_intersection(na.begin(), na.end(), nb.begin(), nb.end(), std::back_inserter(common));
  if (static_cast<int>(common.size()) != wings) return false;  // link condition
  for (uint32_t w : common) {
    if (neighbors(w).size() <= (rim_[w] ? 3u : 4u)) return false;  // a wing vertex loses a neighbor
  }
  for (const uint32_t v : {a, b}) {
    for (uint32_t t : around_[v]) {
      const Triangle& x = triangle_[t];
      if (has(x, a) && has(x, b)) continue;
      Vec3 c[3];
      for (int k = 0; k < 3; ++k) c[k] = x[k] == v ? p : position[x[k]];
      const Vec3 after = cross(c[1] - c[0], c[2] - c[0]), before = area_vector(x);
      if (dot(after, before) <= 0.3f * length(after) * length(before)) return false;
    }
  }
  const std::vector<uint32_t> of_b = around_[b];
  for (uint32_t t : of_b) {
    const bool dies = has(triangle_[t], a);
    remove(t);
    if (dies) continue;
    std::replace(triangle_[t].begin(), triangle_[t].end(), b, a);
    for (uint32_t v : triangle_[t]) around_[v].push_back(t);
  }
  rim_[a] = rim_[a] || rim_[b];
  position[a] = p;
  --alive_;
  return true;
}

bool EditableMesh::flip(uint32_t a, uint32_t b) {
  uint32_t c[2];
  if (opposite(a, b, c) != 2) return false;
  const auto nc = neighbors(c[0]);
  if (std::binary_search(nc.begin(), nc.end(), c[1])) return false;
  if (neighbors(a).size() <= 3 || neighbors(b).size() <= 3) return false;
  // Triangles a b c0 and b a c1 become c0 c1 b and c1 c0 a, with unchanged orientation.
  const Triangle old0{a, b, c[0]}, old1{b, a, c[1]}, new0{c[0], a, c[1]}, new1{c[1], b, c[0]};
  const Vec3 up = area_vector(old0) + area_vector(old1);
  if (dot(normalized(area_vector(old0)), normalized(area_vector(old1))) < 0.6f) return false;  // a crease must be preserved
  for (const Triangle& t : {new0, new1}) {
    if (dot(normalized(area_vector(t)), normalized(up)) < 0.6f) return false;
  }
  uint32_t slot[2];
  int found = 0;
  for (uint32_t t : around_[a]) {
    if (has(triangle_[t], b)) slot[found++] = t;
  }
  remove(slot[0]);
  remove(slot[1]);
  triangle_[slot[0]] = new0;
  triangle_[slot[1]] = new1;
  for (const uint32_t t : slot) {
    for (uint32_t v : triangle_[t]) around_[v].push_back(t);
  }
  return true;
}

bool EditableMesh::can_move(uint32_t v, Vec3 p) const {
  for (uint32_t t : around_[v]) {
    const Triangle& x = triangle_[t];
    Vec3 c[3];
    for (int k = 0; k < 3; ++k) c[k] = x[k] == v ? p : position[x[k]];
    const Vec3 after = cross(c[1] - c[0], c[2] - c[0]), before = area_vector(x);
    if (dot(after, before) <= 0.3f * length(after) * length(before)) return false;
  }
  return true;
}

TriangleMesh EditableMesh::finish(std::vector<uint32_t>* number) const {
  TriangleMesh out;
  std::vector<uint32_t> index(position.size(), ~0u);
  for (uint32_t v = 0; v < position.size(); ++v) {
    if (!alive(v)) continue;
    index[v] = static_cast<uint32_t>(out.position.size());
    out.position.push_back(position[v]);
  }
  for (uint32_t t = 0; t < triangle_.size(); ++t) {
    const Triangle& x = triangle_[t];
    const auto& list = around_[x[0]];
    if (std::find(list.begin(), list.end(), t) == list.end()) continue;
    out.triangle.push_back({index[x[0]], index[x[1]], index[x[2]]});
  }
  if (number) *number = std::move(index);
  return out;
}

}  // namespace catgut
