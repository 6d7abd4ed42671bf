// SPDX-License-Identifier: Apache-2.0
// assess: see stitch_map.h.
#include "assess/stitch_map.h"

#include <algorithm>
#include <cmath>

namespace catgut {
namespace {

constexpr double kSampleTime = 0.1;      // [s]
constexpr size_t kMostEvents = 20000;    // some hours of procedure
constexpr size_t kMostSamples = 216000;  // six hours

bool particle_by_particle(EventKind kind) {
  return kind == EventKind::particle_attached || kind == EventKind::particle_released || kind == EventKind::particle_passed ||
         kind == EventKind::loop_rejected;
}

void measure(StitchEdge& edge) {
  edge.along.assign(1, 0);
  for (size_t i = 0; i < edge.point.size(); ++i)
    edge.along.push_back(edge.along.back() + distance(edge.point[i], edge.point[(i + 1) % edge.point.size()]));
}

size_t nearest_point(const StitchEdge& edge, Vec3 p) {
  size_t best = 0;
  for (size_t i = 1; i < edge.point.size(); ++i)
    if (length2(edge.point[i] - p) < length2(edge.point[best] - p)) best = i;
  return best;
}

// From the point opposite to the start of `first`, in the same direction: opposite points have the same coordinate.
void run_beside(StitchEdge& edge, const StitchEdge& first) {
  const size_t n = edge.point.size();
  if (n < 3 || first.point.size() < 3) return;
  std::rotate(edge.point.begin(), edge.point.begin() + static_cast<std::ptrdiff_t>(nearest_point(edge, first.point[0])),
              edge.point.end());
  const Vec3 quarter = first.point[first.point.size() / 4];
  if (length2(edge.point[3 * n / 4] - quarter) < length2(edge.point[n / 4] - quarter))
    std::reverse(edge.point.begin() + 1, edge.point.end());
}

void add_bite(StitchMap& map, const PictureModel& picture, const Snapshot& seen, const Event& e) {
  if (e.which >= seen.active().bite.size()) return;
  const BiteView& view = seen.active().bite[e.which];
  StitchBite b;
  b.tick = e.tick;
  b.bite = e.which;
  b.suture = map.sutures;
  b.wall = view.wall;
  b.entry = at_rest(picture, seen, view.wall, view.entry);
  b.exit = at_rest(picture, seen, view.wall, view.exit);
  b.length = distance(b.entry, b.exit);
  b.depth = view.depth;
  b.entry_inside = view.entry_inside, b.exit_inside = view.exit_inside;
  if (e.which < map.angle.size()) b.entry_angle = map.angle[e.which];
  if (b.wall < map.edge.size() && !map.edge[b.wall].point.empty()) {
    const StitchEdge& edge = map.edge[b.wall];
    const OnEdge in = nearest_on(edge, b.entry), out = nearest_on(edge, b.exit);
    b.entry_along = in.along, b.entry_edge = in.distance;
    b.exit_along = out.along, b.exit_edge = out.distance;
    const auto before = std::find_if(map.bite.rbegin(), map.bite.rend(), [&](const StitchBite& o) { return o.wall == b.wall; });
    if (before != map.bite.rend())
      b.spacing = between(edge.length(), before->entry_along, before->exit_along, b.entry_along, b.exit_along);
  }
  map.bite.push_back(b);
}

void sample(StitchMap& map, const Snapshot& seen) {
  for (float t : seen.active().thread_tension) map.now.peak = std::max(map.now.peak, t);
  if (!seen.active().thread_tension.empty() && seen.active().needle_on_thread)
    map.now.needle = std::max(map.now.needle, seen.active().thread_tension.back());
  map.now.tick = seen.tick;
  if (static_cast<double>(++map.in_now) * map.tick_s < kSampleTime - 1e-6) return;
  if (map.tension.size() < kMostSamples) map.tension.push_back(map.now);
  map.now = {};
  map.in_now = 0;
}

template <typename Row>
void drop_after(std::vector<Row>& rows, uint64_t tick) {
  while (!rows.empty() && rows.back().tick > tick) rows.pop_back();
}

}  // namespace

StitchMap start_map(const PictureModel& picture, double tick_s) {
  StitchMap map;
  map.tick_s = tick_s;
  for (const std::vector<uint32_t>& rim : picture.rim) {
    StitchEdge edge;
    for (uint32_t i : rim) edge.point.push_back(picture.particle_rest[i]);
    if (!map.edge.empty()) run_beside(edge, map.edge[0]);
    measure(edge);
    map.edge.push_back(std::move(edge));
  }
  return map;
}

void note(StitchMap& map, const PictureModel& picture, const Snapshot& seen) {
  for (const Event& e : seen.event) {
    if (e.kind == EventKind::suture_loaded) ++map.sutures;
    if (e.kind == EventKind::tip_entered && e.which < 10000) {
      if (map.angle.size() <= e.which) map.angle.resize(e.which + 1, -1);
      map.angle[e.which] = e.value;
    }
    if (e.kind == EventKind::bite_completed) add_bite(map, picture, seen, e);
    if (!particle_by_particle(e.kind) && map.event.size() < kMostEvents) map.event.push_back(e);
  }
  sample(map, seen);
}

void rewind(StitchMap& map, uint64_t tick) {
  for (auto e = map.event.rbegin(); e != map.event.rend() && e->tick > tick; ++e)
    if (e->kind == EventKind::suture_loaded && map.sutures > 0) --map.sutures;
  drop_after(map.event, tick);
  drop_after(map.bite, tick);
  drop_after(map.tension, tick);
  map.now = {};
  map.in_now = 0;
}

Vec3 at_rest(const PictureModel& picture, const Snapshot& seen, uint32_t wall, Vec3 now, Quat* turned) {
  constexpr size_t kNear = 4;
  std::array<uint32_t, kNear> near{};
  std::array<float, kNear> far;
  far.fill(1e30f);
  for (uint32_t i = 0; i < picture.particle_rest.size(); ++i) {
    if (i < picture.wall.size() && picture.wall[i] != wall) continue;
    const float d = length2(seen.particle[i] - now);
    if (d >= far[kNear - 1]) continue;
    size_t k = kNear - 1;
    for (; k > 0 && far[k - 1] > d; --k) far[k] = far[k - 1], near[k] = near[k - 1];
    far[k] = d, near[k] = i;
  }
  Vec3 sum{};
  float weight = 0;
  for (size_t k = 0; k < kNear && far[k] < 1e30f; ++k) {
    const uint32_t i = near[k];
    const float w = 1 / (far[k] + 1e-8f);
    sum += w * (picture.particle_rest[i] + rotate(conjugate(seen.rotation[i]), now - seen.particle[i]));
    weight += w;
  }
  if (turned && weight > 0) *turned = seen.rotation[near[0]];
  return weight > 0 ? sum / weight : now;
}

OnEdge nearest_on(const StitchEdge& edge, Vec3 p) {
  OnEdge best;
  const size_t n = edge.point.size();
  for (size_t i = 0; i < n; ++i) {
    const Vec3 a = edge.point[i], ab = edge.point[(i + 1) % n] - a;
    const float l2 = length2(ab), t = l2 > 0 ? std::clamp(dot(p - a, ab) / l2, 0.0f, 1.0f) : 0;
    const float d = distance(p, a + ab * t);
    if (best.distance < 0 || d < best.distance) best = {edge.along[i] + t * (edge.along[i + 1] - edge.along[i]), d};
  }
  return best;
}

float between(float edge_length, float a0, float a1, float b0, float b1) {
  if (edge_length <= 0) return 0;
  const auto round = [&](float s) { return s - edge_length * std::floor(s / edge_length); };
  // As start and width, in the shorter direction.
  const auto stretch = [&](float s0, float s1) {
    const float w = round(s1 - s0);
    return w <= edge_length / 2 ? std::array<float, 2>{round(s0), w} : std::array<float, 2>{round(s1), edge_length - w};
  };
  const auto a = stretch(a0, a1), b = stretch(b0, b1);
  const float ahead = round(b[0] - a[0]) - a[1], behind = round(a[0] - b[0]) - b[1];
  return std::max(0.0f, std::min(ahead, behind));
}

}  // namespace catgut
