// SPDX-License-Identifier: Apache-2.0
// physical/tear: see the header.
#include "physical/tear.h"

#include <algorithm>
#include <cmath>

#include "physical/physical.h"

namespace catgut::physical {
namespace {

constexpr float kOut = 0.3e-3f;   // [m] a bite so near to the edge is out
constexpr float kMost = 0.2e-3f;  // [m] by which a bite tears in one step

// Moves a mouth along its face of the wall.
void drag(const Model& m, const State& s, SurfaceSearch& search, wall::Point& place, Vec3 move) {
  const wall::Weights w = wall::weights(m.wall, s.wall.topology, place);
  const Vec3 target = wall::place(w, s.wall.motion) + move;
  const int side = place.zeta < 0 ? -1 : 1;
  Foot best;
  best.gap = 1e9f;
  const Surface& surface = surface_of(m, s);
  for (uint32_t face = 0; face + 1 < surface.first_of_face.size(); ++face) {
    // A part of the wall that only touches this one is not torn into.
    if (surface.piece[w.column[0]] != surface.piece[column_of(m.wall, s.wall, face)]) continue;
    if (least_distance(box_of(m.wall, s.wall, search, face), target, side) > std::min(4 * kMost, std::abs(best.gap))) continue;
    for (uint32_t q = surface.first_of_face[face]; q < surface.first_of_face[face + 1]; ++q) {
      if (surface.patch[q].side != side) continue;
      const Foot foot = nearest_on_patch(m.wall, s.wall, surface, q, target);
      if (std::abs(foot.gap) < std::abs(best.gap)) best = foot;
    }
  }
  if (best.gap < 1e8f) place = best.point;
}

// [N] of the layers between two depths, at this distance from an edge.
float strength_of(const TearModel& t, float low, float high, float edge) {
  return t.strength * strength_share(t, low, high) * std::min(1.0f, edge / t.full_bite);
}

// Unit, out of the wall at a point.
Vec3 normal_at(const Model& m, const State& s, const wall::Point& p) {
  wall::Weights middle = wall::weights(m.wall, s.wall.topology, p), up = middle;
  up.zeta = 1, middle.zeta = 0;
  return normalized(wall::place(up, s.wall.motion) - wall::place(middle, s.wall.motion));
}

}  // namespace

TearModel make_tear(std::span<const wall::Layer> layer) {
  TearModel t;
  if (layer.empty()) return t;
  t.layer.clear();
  float thickness = 0, stiffness = 0, top = 0;
  const auto stiff = [](const wall::Layer& l) { return std::sqrt(l.e_along * l.e_around) * l.thickness; };
  for (const wall::Layer& l : layer) thickness += l.thickness, stiffness += stiff(l);
  for (const wall::Layer& l : layer) {
    top += l.thickness;
    t.layer.push_back({2 * top / thickness - 1, stiff(l) / stiffness});
  }
  return t;
}

float strength_share(const TearModel& t, float low, float high) {
  float bottom = -1, sum = 0;
  for (const TearModel::LayerShare& l : t.layer) {
    const float part = std::min(high, l.top) - std::max(low, bottom);
    if (part > 0) sum += l.share * part / (l.top - bottom);
    bottom = l.top;
  }
  return sum;
}

float edge_distance(const Model& m, const State& s, const wall::Point& point) {
  const wall::Weights w = wall::weights(m.wall, s.wall.topology, point);
  float sum = 0;
  for (size_t k = 0; k < 4; ++k)
    if (w.weight[k] != 0) sum += w.weight[k] * surface_of(m, s).edge_distance[w.column[k]];
  return sum;
}

float bite_strength(const Model& m, const State& s, uint32_t entry, uint32_t exit) {
  const Hole &a = s.hole[entry], &b = s.hole[exit];
  // Both mouths on one face: through the deepest point; where that is not known, to the middle of the wall.
  const float deep = a.deepest >= -1 ? a.deepest : a.place.zeta * b.place.zeta > 0 ? 0.0f : b.place.zeta;
  const float low = std::min({a.place.zeta, b.place.zeta, deep}), high = std::max({a.place.zeta, b.place.zeta, deep});
  const float edge = 0.5f * (edge_distance(m, s, a.place) + edge_distance(m, s, b.place));
  return strength_of(m.tear, low, high, edge);
}

bool tear_bites(const Model& m, State& s, std::span<const Vec3> impulse, SurfaceSearch& search) {
  const float h = m.wall.step, part = std::min(1.0f, h / m.tear.smoothing);
  thread::State& t = s.thread;
  bool out = false;
  for (size_t e = 0; e + 1 < t.eyelet.size(); ++e) {
    const uint32_t entry = t.eyelet[e].point, exit = t.eyelet[e + 1].point;
    Hole &a = s.hole[entry], &b = s.hole[exit];
    if (!a.within || std::max(entry, exit) >= impulse.size() || s.sleep.at(t.eyelet[e].segment)) continue;
    const Vec3 n = normal_at(m, s, a.place);
    const Vec3 force = (impulse[entry] + impulse[exit]) / h;
    a.load += (force - a.load) * part;
    const float load = length(a.load), excess = load - bite_strength(m, s, entry, exit);
    if (excess <= 0) continue;
    if (a.torn == 0) a.made = a.place, b.made = b.place;
    const float by = std::min(kMost, excess / m.tear.viscosity * h);
    const Vec3 move = normalized(a.load - n * dot(a.load, n)) * by;
    drag(m, s, search, a.place, move), drag(m, s, search, b.place, move);
    a.torn += by, b.torn += by, b.load = a.load;
    if (edge_distance(m, s, a.place) > kOut && edge_distance(m, s, b.place) > kOut) continue;
    a.out = b.out = out = true;
    t.eyelet.erase(t.eyelet.begin() + static_cast<std::ptrdiff_t>(e), t.eyelet.begin() + static_cast<std::ptrdiff_t>(e) + 2);
    --e;
  }
  return out;
}

void tear_channels(const Model& m, State& s, BodiesScratch& k) {
  const float h = m.wall.step, part = std::min(1.0f, h / m.tear.smoothing);
  const Surface& surface = surface_of(m, s);
  const auto place = [&](const wall::Point& p) {
    return wall::place(wall::weights(m.wall, s.wall.topology, p), s.wall.motion);
  };
  for (uint32_t i = 0; i < s.needle.size(); ++i) {
    Needle& n = s.needle[i];
    if (n.channels == 0) continue;
    std::array<Vec3, kMaxChannels> load{};
    for (const Row& row : k.row) {
      if (row.kind != Row::Kind::channel || row.key < channel_key(i, 0, 0) || row.key >= channel_key(i, kMaxChannels, 0))
        continue;
      load[(row.key - channel_key(i, 0, 0)) / 64] -= (row.impulse - row.axis * dot(row.impulse, row.axis)) / h;
    }
    for (uint32_t c = 0; c < n.channels; ++c) {
      Channel& channel = n.channel[c];
      if (channel.exit_hole != wall::kNone) continue;  // its thread bears the load
      const bool open = n.inside && c + 1 == n.channels;
      channel.load += (load[c] - channel.load) * part;
      float low = 1, high = -1, edge = 0, count = 0;
      const auto take = [&](const wall::Point& p) {
        low = std::min(low, p.zeta), high = std::max(high, p.zeta), edge += edge_distance(m, s, p), count += 1;
      };
      std::for_each(channel.point.begin(), channel.point.begin() + channel.count, take);
      if (open) take(n.tip);
      const float excess = length(channel.load) - strength_of(m.tear, low, high, edge / count);
      if (excess <= 0) continue;
      const Vec3 normal = normal_at(m, s, channel.point[0]);
      const Vec3 across = channel.load - normal * dot(channel.load, normal);
      if (length2(across) < 1e-12f) continue;
      const float by = std::min(kMost, excess / m.tear.viscosity * h);
      const auto drag = [&](wall::Point& p) {
        float off = 0;
        const wall::Point to = locate(m.wall, s.wall, surface, k, place(p) + normalized(across) * by, p, off);
        const bool on_face = std::abs(p.zeta) == 1;
        const float side = p.zeta;
        if (off < 4 * kMost) p = to;
        if (on_face) p.zeta = side;
      };
      const bool left = channel.exit_side != 0;
      for (size_t mouth = 0; mouth < 2; ++mouth) {
        if (mouth == 1 && !left) continue;
        if (channel.torn[mouth] == 0) channel.made[mouth] = channel.point[mouth == 0 ? 0 : channel.count - 1];
        channel.torn[mouth] += by;
      }
      std::for_each(channel.point.begin(), channel.point.begin() + channel.count, drag);
      if (open) drag(n.tip);
      if (channel.entry_hole != wall::kNone) {
        Hole& hole = s.hole[channel.entry_hole];
        hole.place = channel.point[0], hole.made = channel.made[0], hole.torn = channel.torn[0], hole.load = channel.load;
      }
      const float from_edge =
          std::min(edge_distance(m, s, channel.point[0]), edge_distance(m, s, channel.point[channel.count - 1]));
      if (from_edge > kOut) continue;
      leave_channel(n, c);
      break;  // the next one in the next step
    }
  }
}

}  // namespace catgut::physical
