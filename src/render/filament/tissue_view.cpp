// SPDX-License-Identifier: Apache-2.0
// render/filament/tissue_view: see tissue_view.h.
#include "render/filament/tissue_view.h"

#include <algorithm>
#include <unordered_map>

#include "core/hash.h"

namespace catgut {
namespace {

constexpr float kTile = 6.3f;  // [cm] one repeat of the tissue patterns

using Uv = std::array<float, 2>;

// The texture coordinate jumps back where the organ's circumference closes. A triangle across the jump would compress the whole
// texture into itself, so its far corners are duplicated one period further on.
struct Unwrapped {
  std::vector<uint32_t> source;
  std::vector<Uv> uv;  // in tiles
  std::vector<std::array<uint32_t, 3>> triangle;
};

Unwrapped unwrap(const VisibleMesh& mesh) {
  Unwrapped out;
  out.triangle = mesh.triangle;
  for (uint32_t v = 0; v < uint32_t(mesh.position.size()); ++v) {
    out.source.push_back(v);
    out.uv.push_back(v < mesh.uv.size() ? mesh.uv[v] : Uv{});
  }
  for (size_t axis = 0; axis < 2; ++axis) {
    float low = 1e30f, high = -1e30f;
    for (const Uv& c : out.uv) low = std::min(low, c[axis]), high = std::max(high, c[axis]);
    const float extent = high - low;
    // The period: the jump plus the step that the edge across it makes in space.
    double period_sum = 0;
    size_t jumps = 0;
    for (const auto& t : out.triangle)
      for (size_t k = 0; k < 3; ++k) {
        const uint32_t a = t[k], b = t[(k + 1) % 3];
        const float jump = std::abs(out.uv[a][axis] - out.uv[b][axis]);
        if (jump < 0.6f * extent || extent <= 0) continue;
        period_sum += double(
            jump + std::min(0.3f * extent, distance(mesh.position[out.source[a]], mesh.position[out.source[b]]) / 0.01f));
        ++jumps;
      }
    float stretch = 1 / kTile;
    if (jumps > 0) {
      const float period = float(period_sum / double(jumps));
      // A whole number of repeats, so that the pattern is continuous.
      stretch = std::max(1.0f, std::round(period / kTile)) / period;
      std::unordered_map<uint32_t, uint32_t> twin;
      for (auto& t : out.triangle) {
        float top = -1e30f;
        for (const uint32_t v : t) top = std::max(top, out.uv[v][axis]);
        for (uint32_t& v : t) {
          if (top - out.uv[v][axis] < 0.5f * period) continue;
          const auto [it, fresh] = twin.try_emplace(v, uint32_t(out.source.size()));
          if (fresh) {
            out.source.push_back(out.source[v]);
            Uv c = out.uv[v];
            c[axis] += period;
            out.uv.push_back(c);
          }
          v = it->second;
        }
      }
    }
    for (Uv& c : out.uv) c[axis] *= stretch;
  }
  return out;
}

// Ambient visibility of each vertex at rest: rays through a coarse grid of occupied cells. The deformed organ
// keeps it; its purpose is an inside darker than the rim, at every quality.
std::vector<float> baked_sky(const VisibleMesh& mesh, SkyCache& known) {
  std::vector<float> sky(mesh.position.size(), 1);
  if (mesh.position.empty()) return sky;
  const Box3 box = bounds(mesh.position);
  constexpr float cell = 0.0015f;
  const int nx = int((box.high.x - box.low.x) / cell) + 1, ny = int((box.high.y - box.low.y) / cell) + 1,
            nz = int((box.high.z - box.low.z) / cell) + 1;
  if (nx > 512 || ny > 512 || nz > 512) return sky;
  std::vector<uint8_t> filled(size_t(nx) * size_t(ny) * size_t(nz));
  const auto index = [&](Vec3 p) -> ptrdiff_t {
    const int x = int(std::floor((p.x - box.low.x) / cell)), y = int(std::floor((p.y - box.low.y) / cell)),
              z = int(std::floor((p.z - box.low.z) / cell));
    if (x < 0 || y < 0 || z < 0 || x >= nx || y >= ny || z >= nz) return -1;
    return (ptrdiff_t(z) * ny + y) * nx + x;
  };
  for (const Vec3 p : mesh.position)
    if (const ptrdiff_t i = index(p); i >= 0 && size_t(i) < filled.size()) filled[size_t(i)] = 1;
  constexpr int rays = 32;
  std::array<Vec3, rays> ray;
  for (int i = 0; i < rays; ++i) {
    const float y = 1 - (float(i) + 0.5f) / rays * 1.3f, r = std::sqrt(1 - y * y), a = 2.39996f * float(i);
    ray[size_t(i)] = {r * std::cos(a), y, r * std::sin(a)};
  }
  for (size_t v = 0; v < sky.size(); ++v) {
    const std::array<Vec3, 2> key{mesh.position[v], mesh.normal[v]};
    const auto [at, fresh] = known.try_emplace(hash_bytes(key.data(), sizeof key, 1), 0.0f);
    if (!fresh) {
      sky[v] = at->second;
      continue;
    }
    float seen = 0, all = 0;
    for (const Vec3 d : ray) {
      const float weight = dot(d, mesh.normal[v]);
      if (weight <= 0.05f) continue;
      all += weight;
      Vec3 p = mesh.position[v] + mesh.normal[v] * (2.2f * cell) + d * cell;
      bool open = true;
      for (ptrdiff_t i; open && (i = index(p)) >= 0; p += d * (0.8f * cell)) open = !filled[size_t(i)];
      seen += open ? weight : 0;
    }
    // Surfaces that face the ground still receive light reflected by the drape.
    sky[v] = at->second = all > 0 ? 0.15f + 0.85f * seen / all : 0.3f;
  }
  return sky;
}

// Position of a vertex of the cut between the organ's outside (0) and its inside (1), which selects the visible
// layer of the wall.
std::vector<float> baked_depth(const VisibleMesh& mesh) {
  if (!mesh.through.empty()) return mesh.through;
  std::vector<float> depth(mesh.position.size(), 0);
  std::vector<Vec3> outside, inside;
  std::vector<size_t> cut;
  for (size_t v = 0; v < depth.size() && v < mesh.layer.size(); ++v) {
    if (mesh.layer[v] == TissueLayer::mucosa) depth[v] = 1;
    if (mesh.layer[v] == TissueLayer::cut_edge) cut.push_back(v);
  }
  // Only vertices near a cut can be nearest to it.
  constexpr float far = 0.006f;
  std::vector<Vec3> sample;
  for (size_t i = 0; i < cut.size(); i += 16) sample.push_back(mesh.position[cut[i]]);
  for (size_t v = 0; v < depth.size() && v < mesh.layer.size(); ++v) {
    if (mesh.layer[v] == TissueLayer::cut_edge) continue;
    const bool near =
        std::any_of(sample.begin(), sample.end(), [&](Vec3 p) { return length2(p - mesh.position[v]) < far * far; });
    if (near) (mesh.layer[v] == TissueLayer::mucosa ? inside : outside).push_back(mesh.position[v]);
  }
  const auto away = [](const std::vector<Vec3>& points, Vec3 p) {
    float least = 1;
    for (const Vec3 q : points) least = std::min(least, length2(p - q));
    return std::sqrt(least);
  };
  for (const size_t v : cut) {
    const float a = away(outside, mesh.position[v]), b = away(inside, mesh.position[v]);
    depth[v] = std::clamp(a / std::max(a + b, 1e-6f), 0.001f, 0.999f);
  }
  return depth;
}

// Broad patches with more or less blood, larger than a repeat of the texture. 0..1
float flush(Vec3 p) {
  return 0.5f + 0.25f * std::sin(173 * p.x + 67 * p.y + 1.3f) * std::sin(91 * p.z - 139 * p.y + 0.4f) +
         0.25f * std::sin(59 * p.x - 83 * p.z + 2.1f) * std::sin(71 * p.y + 113 * p.x);
}

// Fat lies in lobules along the mesentery's side, where the vessels come from: behind an upright organ, below one that
// lies.
constexpr Vec3 kMesentery{0, -0.55f, -0.835f};

VertexLook look_of(const VisibleMesh& mesh, uint32_t v, Uv uv, float sky, float depth) {
  const TissueLayer layer = v < mesh.layer.size() ? mesh.layer[v] : TissueLayer::serosa;
  const Vec3 p = mesh.position[v];
  const float red = flush(p);
  Vec3 c;
  float vessels = 0;
  switch (layer) {
    case TissueLayer::serosa: {
      const float toward = dot(mesh.normal[v], kMesentery);
      c = lerp(srgb(244, 194, 182), srgb(236, 154, 148), red);
      // In drops and streaks along the organ, denser toward the mesentery itself.
      const float lobule = std::sin(1150 * p.x + 420 * p.y) * std::sin(930 * p.y - 610 * p.z + 380 * p.x) +
                           0.6f * std::sin(2300 * p.z + 700 * p.y) * std::sin(1900 * p.x - 1700 * p.y);
      const float fat = std::clamp((toward - 0.86f + 0.09f * lobule + 0.2f * (red - 0.5f)) / 0.10f, 0.0f, 1.0f);
      c = lerp(c, srgb(250, 226, 176), 0.6f * fat);
      vessels = (0.55f + 0.45f * std::clamp(0.5f + 0.9f * toward, 0.0f, 1.0f)) * (1 - 0.6f * fat);
      break;
    }
    case TissueLayer::mucosa:
      c = lerp(srgb(226, 136, 124), srgb(212, 108, 100), red), vessels = 0.2f;
      break;
    case TissueLayer::cut_edge:
      c = srgb(226, 150, 138);
      break;
  }
  return {{c.x, c.y, c.z, vessels}, {uv[0], uv[1]}, {sky, depth}};
}

constexpr float kReach = 0.0055f;  // [m] round a suture point: range of whitening by tension

// Degree of whitening: little for a gentle pull, strong for a newton.
float whiteness(float tension) { return 1 - std::exp(-1.6f * std::max(0.0f, tension - 0.05f)); }

void reach_from(TissueView& view, Vec3 point, std::vector<Reached>& out) {
  for (uint32_t v = 0; v < uint32_t(view.position.size()); ++v) {
    const float d2 = length2(view.position[v] - point);
    if (d2 > kReach * kReach) continue;
    const float near = 1 - std::sqrt(d2) / kReach;
    out.push_back({v, near * near * (3 - 2 * near)});
    // A puncture bleeds a little and stains its surroundings.
    const float stain = near * near * near;
    view.live[v].bloody = std::max(view.live[v].bloody, uint8_t(120 * stain * stain));
  }
}

// Char where a pen has been, and blood from vessels that a cut has opened.
bool scorch(TissueView& view, const Snapshot& snapshot) {
  bool changed = false;
  for (size_t i = 0; i < view.scarred.size(); ++i) {
    const uint32_t v = view.scarred[i], scar = view.mesh->scar[view.source[v]];
    const Scar now = scar < snapshot.scar.size() ? snapshot.scar[scar] : Scar{};
    VertexLive& live = view.live[v];
    uint8_t& before = view.stained[i];  // wiped blood disappears, that of a puncture stays
    changed = changed || live.charred != now.burnt || before != now.blood;
    if (before != now.blood) live.bloody = now.blood;
    live.charred = now.burnt, before = now.blood;
  }
  return changed;
}

// A groove goes down into the wall, across the surface.
void carve(TissueView& view, const Motions& motion, const Snapshot& snapshot, const Surface& surface) {
  for (const uint32_t v : view.scarred) {
    const uint32_t scar = view.mesh->scar[view.source[v]];
    if (scar >= snapshot.scar.size() || snapshot.scar[scar].depth == 0) continue;
    if (view.mesh->layer[view.source[v]] == TissueLayer::cut_edge) continue;
    const Vec3 normal = rotate(follow(view.vertex[v], motion.of).frame, {0, 0, 1});
    view.drawn[v] -= normal * (1e-5f * float(snapshot.scar[scar].depth));
    surface.position[v] = view.drawn[v];
  }
}

// Tension whitens the tissue round every suture point, gradually over several frames, like blood flow.
void blanch(filament::Engine& engine, TissueView& view, const Snapshot& snapshot) {
  bool changed = scorch(view, snapshot);
  const bool first = !view.shown;
  view.shown = true;
  view.reached.resize(snapshot.suture.size());
  bool fewer = false;  // a bite was undone, or a new suture started
  for (size_t s = 0; s < view.reached.size(); ++s)
    fewer = fewer || view.reached[s].size() > snapshot.suture[s].suture_point.size();
  if (fewer) {
    for (VertexLive& live : view.live) live.bloody = 0;
    for (auto& reached : view.reached) reached.clear();
  }
  for (size_t s = 0; s < view.reached.size(); ++s)
    while (view.reached[s].size() < snapshot.suture[s].suture_point.size()) {
      changed = true;
      const Vec3 point = snapshot.suture[s].suture_point[view.reached[s].size()].position;
      reach_from(view, point, view.reached[s].emplace_back());
    }
  for (const uint32_t v : view.pressed) view.press[v] = 0;
  const auto add = [&](const std::vector<Reached>& reached, float white) {
    for (const Reached& r : reached) {
      if (!view.live[r.vertex].listed) view.pressed.push_back(r.vertex);
      view.live[r.vertex].listed = 1;
      view.press[r.vertex] = std::max(view.press[r.vertex], r.weight * white);
    }
  };
  for (size_t s = 0; s < view.reached.size(); ++s)
    for (size_t i = 0; i < view.reached[s].size(); ++i) {
      const SuturePointView& point = snapshot.suture[s].suture_point[i];
      const float white = whiteness(std::max(point.tension_needle, point.tension_free));
      if (white > 0.02f) add(view.reached[s][i], white);
    }
  for (const uint32_t v : view.pressed) {
    const int want = int(255 * view.press[v]), have = view.live[v].blanched;
    if (want == have) continue;
    const int step = first ? want - have : std::clamp((want - have) / 6, -40, 40);
    view.live[v].blanched = uint8_t(have + (step != 0 ? step : want > have ? 1 : -1));
    changed = true;
  }
  std::erase_if(view.pressed, [&](uint32_t v) {
    if (view.press[v] > 0 || view.live[v].blanched > 0) return false;
    view.live[v].listed = 0;
    return true;
  });
  if (changed) set_live(engine, view.gpu, view.live);
}

// The pieces of thread round the opening that a purse-string closes, in order. Empty: none is being closed.
void find_gathers(TissueView& view, const Snapshot& snapshot) {
  constexpr float begun = 0.02f;  // of Snapshot::closure
  view.gather.clear();
  if (snapshot.closure <= begun || view.round.next.empty()) return;
  const auto angle_of = [&](Vec3 p) {
    constexpr float reach = 0.004f;
    float least = reach * reach, angle = -1;
    for (size_t v = 0; v < view.round.angle.size(); ++v)
      if (const float d = length2(view.position[v] - p); d < least) least = d, angle = view.round.angle[v];
    return angle;
  };
  struct Point {
    float angle;
    uint32_t bite;
  };
  std::vector<Point> point;
  for (const SuturePointView& p : snapshot.active().suture_point)
    if (const float a = angle_of(p.position); a >= 0) point.push_back({a, p.bite});
  if (point.size() < 6) return;
  std::sort(point.begin(), point.end(), [](const Point& a, const Point& b) { return a.angle < b.angle; });
  for (size_t i = 0; i < point.size(); ++i) {
    const Point &a = point[i], &b = point[(i + 1) % point.size()];
    view.gather.push_back({a.angle, b.angle + (i + 1 == point.size() ? 1.0f : 0.0f), a.bite == b.bite});
  }
}

// Folds the drawn wall where the opening is gathered.
void pucker(TissueView& view, const Motions& motion, const Surface& surface) {
  if (view.gather.empty()) return;
  for (size_t i = 0; i < view.vertex.size(); ++i) {
    const uint32_t v = view.source[i], next = view.round.next[v];
    if (next == RoundOrgan::kNone || view.round.step[v] <= 0) continue;
    const Vec3 step = view.position[next] - view.position[v];
    const Fold fold = fold_at(view.gather, view.round.angle[v], length(step) / view.round.step[v], view.round.length);
    if (std::abs(fold.out) < 1e-5f && std::abs(fold.slope) < 0.02f) continue;
    const Skinned here = follow(view.vertex[i], motion.of);
    const Vec3 out = rotate(here.frame * conjugate(view.vertex[i].frame), view.round.outward[v]);
    view.drawn[i] += out * fold.out;
    surface.position[i] = view.drawn[i];
  }
  // Where the wall is crumpled, rotations of particles say little about its faces: normals of the drawn triangles instead.
  std::vector<Vec3> normal(view.mesh->position.size());
  for (const auto& t : view.mesh->triangle) {
    const Vec3 n = cross(view.drawn[t[1]] - view.drawn[t[0]], view.drawn[t[2]] - view.drawn[t[0]]);
    for (const uint32_t v : t) normal[v] += n;
  }
  for (size_t i = 0; i < view.vertex.size(); ++i) {
    const Vec3 n = normal[view.source[i]];
    if (!(length2(n) > 1e-20f)) continue;
    const Quat frame = follow(view.vertex[i], motion.of).frame;
    surface.frame[i] = pack_frame(frame_of(normalized(n), rotate(frame, {1, 0, 0})), view.mirrored[i]);
  }
}

}  // namespace

TissueView make_tissue_view(filament::Engine& engine, filament::Scene& scene, const VisibleMesh& mesh,
                            filament::MaterialInstance* material, SkyCache& known) {
  TissueView view;
  view.mesh = &mesh;
  const Unwrapped flat = unwrap(mesh);
  const size_t n = flat.source.size();
  view.mirrored.assign(n, 0);
  // The texture's direction at a vertex: of the edge there that is closest to it.
  std::vector<float> best(n, -1);
  std::vector<Vec3> tangent(n, Vec3{1, 0, 0});
  for (const auto& t : flat.triangle) {
    for (size_t k = 0; k < 3; ++k)
      for (const size_t other : {(k + 1) % 3, (k + 2) % 3}) {
        const float du = flat.uv[t[other]][0] - flat.uv[t[k]][0], dv = flat.uv[t[other]][1] - flat.uv[t[k]][1];
        const float straight = std::abs(du) / (std::hypot(du, dv) + 1e-12f);
        if (straight <= best[t[k]]) continue;
        best[t[k]] = straight;
        const Vec3 step = mesh.position[flat.source[t[other]]] - mesh.position[flat.source[t[k]]];
        tangent[t[k]] = normalized(du < 0 ? -step : step, {1, 0, 0});
      }
    const Uv a = flat.uv[t[0]], b = flat.uv[t[1]], c = flat.uv[t[2]];
    if ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) < 0)
      for (const uint32_t v : t) view.mirrored[v] = 1;
  }
  const std::vector<float> sky = baked_sky(mesh, known), depth = baked_depth(mesh);
  std::vector<VertexLook> look(n);
  view.vertex.resize(n);
  for (size_t i = 0; i < n; ++i) {
    const uint32_t v = flat.source[i];
    look[i] = look_of(mesh, v, flat.uv[i], sky[v], depth[v]);
    view.vertex[i] = {mesh.skin_particle[v], mesh.skin_weight[v], mesh.position[v], frame_of(mesh.normal[v], tangent[i])};
    view.position.push_back(mesh.position[v]);
    view.frame.push_back(pack_frame(view.vertex[i].frame, view.mirrored[i]));
  }
  view.round = round_organ(mesh);
  view.source = flat.source;
  view.drawn = view.position;
  view.live.resize(n);
  view.press.assign(n, 0);
  for (uint32_t i = 0; i < uint32_t(n); ++i)
    if (flat.source[i] < mesh.scar.size() && mesh.scar[flat.source[i]] != kNoScar) view.scarred.push_back(i);
  view.stained.assign(view.scarred.size(), 0);
  view.gpu = make_mesh(engine, scene, look, flat.triangle, material, true, true);
  return view;
}

void move_tissue(filament::Engine& engine, TissueView& view, const Motions& motion, const Snapshot& snapshot) {
  for (size_t i = 0; i < view.vertex.size(); ++i) {
    if (!has_moved(view.vertex[i], motion)) continue;
    const Skinned at = follow(view.vertex[i], motion.of);
    view.position[i] = at.position;
    view.frame[i] = pack_frame(at.frame, view.mirrored[i]);
  }
  const Surface surface = new_surface(uint32_t(view.vertex.size()));
  std::copy(view.position.begin(), view.position.end(), surface.position.begin());
  std::copy(view.frame.begin(), view.frame.end(), surface.frame.begin());
  view.drawn = view.position;
  find_gathers(view, snapshot);
  pucker(view, motion, surface);
  carve(view, motion, snapshot, surface);
  // Of the particles, which are fewer: no vertex is farther from them than this.
  constexpr Vec3 margin{0.006f, 0.006f, 0.006f};
  const Box3 box = bounds(motion.seen);
  upload_surface(engine, view.gpu, surface, {box.low - margin, box.high + margin});
  blanch(engine, view, snapshot);
}

Nearest nearest_vertex(std::span<const TissueView> tissue, Vec3 point, float reach) {
  Nearest found;
  float least = reach * reach;
  for (size_t b = 0; b < tissue.size(); ++b)
    for (uint32_t v = 0; v < uint32_t(tissue[b].position.size()); ++v) {
      const float d2 = length2(tissue[b].position[v] - point);
      if (d2 < least) least = d2, found = {int(b), v};
    }
  return found;
}

}  // namespace catgut
