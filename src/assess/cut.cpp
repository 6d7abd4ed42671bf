// SPDX-License-Identifier: Apache-2.0
// assess: see cut.h.
#include "assess/cut.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace catgut::assess {
namespace {

constexpr float kStretch = 0.001f;    // [m] of rim per sample; cells of a cut are smaller
constexpr float kEnd = 0.0005f;       // [m] an edge so near to an end of the organ is that end
constexpr float kOnSerosa = 0.0004f;  // [m] below it: faces are flat where the organ is round. Less than kEnd
constexpr double kMm = 1000;

struct Stretch {
  double sum = 0;
  Vec3 where;  // [m] now
  uint32_t count = 0;
};

Vec3 moved(const VisibleMesh& mesh, uint32_t v, const Snapshot& seen) {
  Vec3 now{};
  for (size_t k = 0; k < 4; ++k)
    if (mesh.skin_weight[v][k] != 0) now += seen.particle[mesh.skin_particle[v][k]] * mesh.skin_weight[v][k];
  return now;
}

}  // namespace

bool has_pen(const PictureModel& picture) {
  return std::any_of(picture.instrument.begin(), picture.instrument.end(),
                     [](const InstrumentPicture& i) { return (i.capabilities & kCauterize) != 0; });
}

void note_pen(PenFacts& pen, const PictureModel& picture, const Snapshot& seen, const TickInput& input, double tick_s) {
  for (const Command& c : input.commands) {
    if ((c.kind != CommandKind::cut && c.kind != CommandKind::new_suture) || c.hand >= kMaxHands) continue;
    const int held = seen.tool[c.hand].instrument;
    if (!input.hand[c.hand].connected || held < 0 || static_cast<size_t>(held) >= picture.instrument.size() ||
        (picture.instrument[static_cast<size_t>(held)].capabilities & kCauterize) == 0)
      continue;
    if (pen.tool == held && pen.mode == c.kind) pen.tool = -1;
    else pen.tool = held, pen.mode = c.kind;
  }
  if (pen.tool < 0) return;
  const auto which = static_cast<size_t>(pen.tool);
  const bool held = which < seen.instrument.size() && seen.instrument[which].place == InstrumentPlace::hand &&
                    seen.instrument[which].hand < kMaxHands && input.hand[seen.instrument[which].hand].connected;
  if (held) pen.seconds += tick_s;
  else pen.tool = -1;
}

CutPlaces cut_places(std::span<const StitchEdge> edges, const RestSurface& rest, const Snapshot& seen) {
  CutPlaces out;
  if (!seen.topology.picture) return out;
  const PictureModel& picture = *seen.topology.picture;
  for (uint32_t w = 0; w < edges.size(); ++w) {
    const StitchEdge& edge = edges[w];
    if (edge.point.size() < 3) continue;
    float far = 0;  // [m] from the rim to the other end
    for (size_t i = 0; i < picture.particle_rest.size(); ++i)
      if (i < picture.wall.size() && picture.wall[i] == w)
        if (const OnEdge at = nearest_on(edge, picture.particle_rest[i]); at.distance > far) far = at.distance;
    std::vector<Stretch> part(static_cast<size_t>(std::max(1.0f, std::round(edge.length() / kStretch))));
    for (const VisibleMesh& mesh : picture.body)
      for (uint32_t v = 0; v < mesh.position.size(); ++v) {
        if (mesh.layer[v] != TissueLayer::cut_edge) continue;
        const uint32_t of = mesh.skin_particle[v][0];
        if (of >= picture.wall.size() || picture.wall[of] != w) continue;
        const OnEdge at = nearest_on(edge, mesh.position[v]);
        if (at.distance < kEnd || at.distance > far - kEnd) continue;
        const SurfacePoint s = rest.serosa(w, mesh.position[v]);
        if (!s.valid || s.below > kOnSerosa) continue;  // the cut through the wall, and its inner side
        const auto k = static_cast<size_t>(at.along / edge.length() * static_cast<float>(part.size()));
        Stretch& here = part[std::min(k, part.size() - 1)];
        here.sum += static_cast<double>(at.distance) * kMm;
        here.where = moved(mesh, v, seen);
        ++here.count;
      }
    const size_t n = part.size();
    const double each = static_cast<double>(edge.length()) * kMm / static_cast<double>(n);
    const std::string of = edges.size() > 1 ? fmt::format("wall {}, ", w + 1) : "";
    for (size_t k = 0; k < n; ++k)
      if (part[k].count > 0)
        out.distance.push_back({part[k].sum / part[k].count, seen.tick, part[k].where,
                                fmt::format("{}{:.0f} mm along the rim", of, static_cast<double>(k) * each)});
    // Bridges, round the rim from a divided stretch on.
    const auto divided = std::find_if(part.begin(), part.end(), [](const Stretch& s) { return s.count > 0; });
    if (divided == part.end()) {
      if (edges.size() == 1)
        out.bridge.push_back({static_cast<double>(edge.length()) * kMm, seen.tick, edge.point[0], "all round"});
      continue;
    }
    const auto first = static_cast<size_t>(divided - part.begin());
    size_t bridges = 0;
    for (size_t k = 1; k <= n; ++k) {
      size_t open = 0;
      while (k + open <= n && part[(first + k + open) % n].count == 0) ++open;
      if (open == 0) continue;
      const size_t before = (first + k + n - 1) % n;
      out.bridge.push_back({static_cast<double>(open) * each, seen.tick, part[before].where,
                            fmt::format("{}bridge {} after {:.0f} mm", of, ++bridges, static_cast<double>(before + 1) * each)});
      k += open;
    }
    if (bridges == 0) out.bridge.push_back({0, seen.tick, part[first].where, of + "none"});
  }
  return out;
}

}  // namespace catgut::assess
