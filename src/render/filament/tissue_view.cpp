// render/filament/tissue_view: see tissue_view.h.
#include "render/filament/tissue_view.h"

#include <unordered_map>

#include "geometry/skin.h"

namespace catgut {
namespace {

constexpr float kTile = 4;  // [cm] one repeat of the tissue patterns

using Uv = std::array<float, 2>;

// The texture coordinate jumps back where the organ's circumference closes. A triangle across the jump would squeeze the whole
// texture into itself, so its far corners are drawn again one period further on.
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
      // A whole number of repeats, so that the pattern meets itself.
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

// How much of the sky each vertex sees at rest: rays through a coarse grid of cells that hold vertices. The deformed organ
// keeps it; what matters is that the inside is darker than the rim, in every quality.
std::vector<float> baked_sky(const VisibleMesh& mesh) {
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
    // What faces the ground entirely still gets what the drape throws back.
    sky[v] = all > 0 ? 0.15f + 0.85f * seen / all : 0.3f;
  }
  return sky;
}

VertexLook look_of(const VisibleMesh& mesh, uint32_t v, Uv uv, float sky) {
  const TissueLayer layer = v < mesh.layer.size() ? mesh.layer[v] : TissueLayer::serosa;
  Vec3 c;
  float vessels = 0, mucosa = 0;
  switch (layer) {
    case TissueLayer::serosa:
      c = srgb(228, 160, 146), vessels = 0.9f;
      break;
    case TissueLayer::mucosa:
      c = srgb(206, 92, 88), vessels = 0.35f, mucosa = 1;
      break;
    case TissueLayer::cut_edge:
      c = srgb(240, 204, 190);
      break;
  }
  return {{c.x, c.y, c.z, vessels}, {uv[0], uv[1]}, {sky, mucosa}};
}

}  // namespace

TissueView make_tissue_view(filament::Engine& engine, filament::Scene& scene, const VisibleMesh& mesh,
                            filament::MaterialInstance* material) {
  TissueView view;
  view.mesh = &mesh;
  const Unwrapped flat = unwrap(mesh);
  const size_t n = flat.source.size();
  view.source = flat.source;
  view.along.resize(n);
  view.against.assign(n, 0);
  view.mirrored.assign(n, 0);
  std::vector<float> best(n, -1);
  for (const auto& t : flat.triangle) {
    for (size_t k = 0; k < 3; ++k)
      for (const size_t other : {(k + 1) % 3, (k + 2) % 3}) {
        const float du = flat.uv[t[other]][0] - flat.uv[t[k]][0], dv = flat.uv[t[other]][1] - flat.uv[t[k]][1];
        const float straight = std::abs(du) / (std::hypot(du, dv) + 1e-12f);
        if (straight <= best[t[k]]) continue;
        best[t[k]] = straight;
        view.along[t[k]] = flat.source[t[other]];
        view.against[t[k]] = du < 0;
      }
    const Uv a = flat.uv[t[0]], b = flat.uv[t[1]], c = flat.uv[t[2]];
    if ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) < 0)
      for (const uint32_t v : t) view.mirrored[v] = 1;
  }
  const std::vector<float> sky = baked_sky(mesh);
  std::vector<VertexLook> look(n);
  for (size_t i = 0; i < n; ++i) look[i] = look_of(mesh, flat.source[i], flat.uv[i], sky[flat.source[i]]);
  view.position.resize(mesh.position.size());
  view.normal.resize(mesh.position.size());
  view.drawn_position.resize(n);
  view.drawn_normal.resize(n);
  view.drawn_tangent.resize(n);
  view.gpu = make_mesh(engine, scene, look, flat.triangle, material, true);
  return view;
}

void move_tissue(filament::Engine& engine, TissueView& view, const PictureModel& model, const Snapshot& snapshot) {
  skin(*view.mesh, model.particle_rest, snapshot.particle, snapshot.rotation, view.position, view.normal);
  for (size_t i = 0; i < view.source.size(); ++i) {
    const Vec3 p = view.position[view.source[i]], step = view.position[view.along[i]] - p;
    view.drawn_position[i] = p;
    view.drawn_normal[i] = view.normal[view.source[i]];
    view.drawn_tangent[i] = view.against[i] ? -step : step;
  }
  // Tangents are steps of about a millimetre; unit length is what the frame expects.
  for (Vec3& t : view.drawn_tangent) t = normalized(t, {1, 0, 0});
  set_surface(engine, view.gpu, view.drawn_position, view.drawn_normal, view.drawn_tangent, view.mirrored);
}

}  // namespace catgut
