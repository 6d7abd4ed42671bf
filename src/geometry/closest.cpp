// SPDX-License-Identifier: Apache-2.0
// geometry/closest: nearest points on triangles, one by one or through a tree of boxes. Reads meshes, writes nothing.
#include "geometry/closest.h"

#include <algorithm>
#include <numeric>

#include "core/check.h"

namespace catgut {

ClosestOnTriangle closest_on_triangle(Vec3 p, Vec3 a, Vec3 b, Vec3 c) {
  // Ericson, Real-Time Collision Detection, 5.1.5: by Voronoi region.
  const Vec3 ab = b - a, ac = c - a, ap = p - a;
  const float d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return {a, {1, 0, 0}};
  const Vec3 bp = p - b;
  const float d3 = dot(ab, bp), d4 = dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return {b, {0, 1, 0}};
  const float vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    const float t = d1 / (d1 - d3);
    return {a + ab * t, {1 - t, t, 0}};
  }
  const Vec3 cp = p - c;
  const float d5 = dot(ab, cp), d6 = dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return {c, {0, 0, 1}};
  const float vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    const float t = d2 / (d2 - d6);
    return {a + ac * t, {1 - t, 0, t}};
  }
  const float va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const float t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {b + (c - b) * t, {0, 1 - t, t}};
  }
  const float inv = 1.0f / (va + vb + vc);
  const float v = vb * inv, w = vc * inv;
  return {a + ab * v + ac * w, {1 - v - w, v, w}};
}

SurfaceTree::SurfaceTree(const TriangleMesh& mesh) : mesh_(mesh), order_(mesh.triangle.size()) {
  CATGUT_CHECK(!mesh.triangle.empty());
  std::iota(order_.begin(), order_.end(), 0u);
  node_.resize(1);
  build(0, 0, static_cast<uint32_t>(order_.size()));
}

void SurfaceTree::build(uint32_t node, uint32_t first, uint32_t last) {
  Vec3 low = mesh_.position[mesh_.triangle[order_[first]][0]], high = low;
  for (uint32_t i = first; i < last; ++i) {
    for (uint32_t v : mesh_.triangle[order_[i]]) {
      const Vec3 p = mesh_.position[v];
      low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
  }
  if (last - first <= 4) {
    node_[node] = {low, high, first, last - first};
    return;
  }
  const Vec3 size = high - low;
  const int k = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const auto middle_of = [&](uint32_t t) {
    const Triangle& x = mesh_.triangle[t];
    return mesh_.position[x[0]][k] + mesh_.position[x[1]][k] + mesh_.position[x[2]][k];
  };
  const uint32_t half = first + (last - first) / 2;
  std::nth_element(order_.begin() + first, order_.begin() + half, order_.begin() + last, [&](uint32_t a, uint32_t b) {
    const float ma = middle_of(a), mb = middle_of(b);
    return ma != mb ? ma < mb : a < b;
  });
  const uint32_t child = static_cast<uint32_t>(node_.size());
  node_.resize(node_.size() + 2);
  node_[node] = {low, high, child, 0};
  build(child, first, half);
  build(child + 1, half, last);
}

SurfaceTree::Hit SurfaceTree::nearest(Vec3 p) const {
  Hit best{{}, ~0u, 3e38f};
  const auto box_distance2 = [&](const Node& n) {
    return length2(
        p - Vec3{std::clamp(p.x, n.low.x, n.high.x), std::clamp(p.y, n.low.y, n.high.y), std::clamp(p.z, n.low.z, n.high.z)});
  };
  uint32_t stack[64];
  int depth = 0;
  stack[depth++] = 0;
  while (depth > 0) {
    const Node& n = node_[stack[--depth]];
    if (box_distance2(n) > best.distance2) continue;
    if (n.count == 0) {
      const bool left_first = box_distance2(node_[n.first]) <= box_distance2(node_[n.first + 1]);
      stack[depth++] = n.first + (left_first ? 1 : 0);
      stack[depth++] = n.first + (left_first ? 0 : 1);
      continue;
    }
    for (uint32_t i = n.first; i < n.first + n.count; ++i) {
      const Triangle& t = mesh_.triangle[order_[i]];
      const Vec3 q = closest_on_triangle(p, mesh_.position[t[0]], mesh_.position[t[1]], mesh_.position[t[2]]).point;
      const float d2 = length2(q - p);
      if (d2 < best.distance2 || (d2 == best.distance2 && order_[i] < best.triangle)) best = {q, order_[i], d2};
    }
  }
  return best;
}

}  // namespace catgut
