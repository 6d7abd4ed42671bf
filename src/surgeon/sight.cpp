// surgeon/sight: see sight.h.
#include "surgeon/sight.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace catgut {

Vec3 live_place(const PictureModel& picture, const Snapshot& seen, Vec3 rest, uint32_t wall, Quat* turned) {
  std::array<uint32_t, 4> near{};
  std::array<float, 4> d;
  d.fill(std::numeric_limits<float>::max());
  for (uint32_t i = 0; i < picture.particle_rest.size(); ++i) {
    if (i < picture.wall.size() && picture.wall[i] != wall) continue;
    const float d2 = length2(picture.particle_rest[i] - rest);
    for (size_t k = 0; k < 4; ++k)
      if (d2 < d[k]) {
        for (size_t j = 3; j > k; --j) d[j] = d[j - 1], near[j] = near[j - 1];
        d[k] = d2, near[k] = i;
        break;
      }
  }
  Vec3 sum{};
  float weight = 0;
  for (size_t k = 0; k < 4; ++k) {
    const float w = 1 / (d[k] + 1e-7f);
    sum += w * (seen.particle[near[k]] + rotate(seen.rotation[near[k]], rest - picture.particle_rest[near[k]]));
    weight += w;
  }
  if (turned) *turned = seen.rotation[near[0]];
  return sum / weight;
}

OpeningShape opening_shape(const PictureModel& picture, uint32_t wall) {
  const std::vector<uint32_t>& rim = picture.rim[wall];
  const std::vector<Vec3>& rest = picture.particle_rest;
  OpeningShape o;
  const float n = static_cast<float>(rim.size());
  Vec3 normal{}, body{};
  for (uint32_t i : rim) o.centre += rest[i] / n;
  for (size_t i = 0; i < rim.size(); ++i) {
    const Vec3 a = rest[rim[i]], b = rest[rim[(i + 1) % rim.size()]];
    normal += cross(a - o.centre, b - o.centre);
    o.round += distance(a, b);
    o.radius += distance(a, o.centre) / n;
  }
  float count = 0;
  for (size_t i = 0; i < rest.size(); ++i)
    if (i >= picture.wall.size() || picture.wall[i] == wall) body += rest[i], ++count;
  o.axis = normalized(normal);
  if (dot(o.axis, o.centre - body / count) < 0) o.axis = -o.axis;  // out of the opening
  return o;
}

size_t node_of(const Snapshot& seen, uint32_t slot) {
  const auto at = std::find(seen.thread_order.begin(), seen.thread_order.end(), slot);
  return at == seen.thread_order.end() ? 0 : static_cast<size_t>(at - seen.thread_order.begin());
}

Vec3 node_at(const Snapshot& seen, size_t node) { return seen.particle[seen.thread_order[node]]; }

float length_between(const Snapshot& seen, size_t a, size_t b) {
  float sum = 0;
  for (size_t i = std::min(a, b); i < std::max(a, b) && i + 1 < seen.thread_order.size(); ++i)
    sum += distance(node_at(seen, i), node_at(seen, i + 1));
  return sum;
}

size_t node_along(const Snapshot& seen, size_t from, float far, int way) {
  const size_t last = seen.thread_order.size() - 1;
  size_t at = from;
  for (float gone = 0; gone < far;) {
    if ((way > 0 && at == last) || (way < 0 && at == 0)) break;
    const size_t next = way > 0 ? at + 1 : at - 1, pair = std::min(at, next);
    if (pair < seen.thread_cut.size() && seen.thread_cut[pair]) break;
    gone += distance(node_at(seen, at), node_at(seen, next));
    at = next;
  }
  return at;
}

uint32_t locked_throws(const Snapshot& seen) {
  uint32_t sum = 0;
  for (const KnotView& k : seen.knot) sum += k.throws - (k.phase != KnotPhase::locked && k.throws > 0);
  return sum;
}

float needle_tension(const Snapshot& seen) { return seen.thread_tension.empty() ? 0 : seen.thread_tension.back(); }

size_t first_point_node(const Snapshot& seen) {
  size_t node = seen.thread_order.size();
  for (const SuturePointView& p : seen.suture_point) node = std::min(node, node_of(seen, p.anchored));
  return seen.suture_point.empty() ? 0 : node;
}

size_t last_point_node(const Snapshot& seen) {
  size_t node = 0;
  for (const SuturePointView& p : seen.suture_point) node = std::max(node, node_of(seen, p.anchored));
  return node;
}

}  // namespace catgut
