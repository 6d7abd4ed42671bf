// SPDX-License-Identifier: Apache-2.0
// anatomy/bowel: builds the tube ring by ring and passes the sheet to anatomy/wall. Reads a BowelShape.
#include "anatomy/bowel.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "anatomy/bowel_surface.h"
#include "anatomy/wall.h"
#include "core/check.h"
#include "geometry/skin.h"

namespace catgut {

namespace {

constexpr double kTwoPi = 6.283185307179586;
constexpr int kFewest = 120, kMost = 200000;
constexpr float kLeastGap = 0.001f;  // [m] between the two walls of a folded bowel: no contact at rest
constexpr int kPictureVertices = 18000;

void check(const BowelShape& b) {
  const auto refuse = [&](const std::string& what, const std::string& next) { throw InputError(b.name, what, next); };
  const auto finite = [](float x) { return std::isfinite(x); };
  if (b.particles < kFewest || b.particles > kMost) {
    refuse(fmt::format("{} particles cannot make a bowel", b.particles), fmt::format("give {} to {}", kFewest, kMost));
  }
  if (!finite(b.radius) || !finite(b.length) || b.radius < 0.002f || b.radius > 0.5f || b.length < 0.004f || b.length > 2) {
    refuse(fmt::format("radius {} m and length {} m are out of range", b.radius, b.length),
           "give meters: radius 0.002..0.5, length 0.004..2");
  }
  if (!finite(b.wall) || b.wall < 1e-4f || b.wall > 0.5f * b.radius) {
    refuse(fmt::format("a wall of {} m does not fit a radius of {} m", b.wall, b.radius), "give 0.0001 m to half the radius");
  }
  if (!finite(b.haustra) || b.haustra < 0 || b.haustra > 0.25f * b.radius) {
    refuse(fmt::format("haustra {} m deep do not fit a radius of {} m", b.haustra, b.radius),
           "give 0 to a quarter of the radius");
  }
  if (b.taeniae < 0 || b.taeniae > 12) refuse(fmt::format("{} taeniae are out of range", b.taeniae), "give 0 to 12");
  if (!is_finite(b.position)) refuse("the position is not a number", "give three numbers in meters");
  if (!is_finite(b.axis) || length(b.axis) < 1e-6f)
    refuse("the axis has no direction", "give the direction of the near end, e.g. [0, 1, 0]");
  if (!finite(b.density) || b.density <= 0)
    refuse(fmt::format("density {} kg/m^3 is out of range", b.density), "give a positive number, e.g. 1050");
  if (!finite(b.pinned_length) || b.pinned_length < 0 || b.pinned_length > b.length) {
    refuse(fmt::format("pinned_length {} m is out of range", b.pinned_length), "give 0 to the bowel's length");
  }
  if (b.inner_radius == 0) {
    if (b.folded) refuse("a folded bowel needs its inner tube", "give inner_radius, the outer radius of the colon inside");
    return;
  }
  if (!finite(b.inner_radius) || b.inner_radius < 2 * b.wall) {
    refuse(fmt::format("an inner_radius of {} m leaves no tube with a wall of {} m", b.inner_radius, b.wall),
           "give at least twice the wall, or 0 for no inner tube");
  }
  // The folds of the outer tube reach inward.
  const float most = b.radius - b.haustra - b.wall - kLeastGap;
  if (b.inner_radius > most) {
    refuse(fmt::format("an inner_radius of {} m does not fit inside: the two walls need {} mm between them", b.inner_radius,
                       1e3f * kLeastGap),
           fmt::format("give at most {:.4f} m (radius less haustra, wall and gap)", most));
  }
  if (b.closed_start || b.closed_end) {
    refuse("a bowel with an inner tube cannot have closed ends", "leave out closed_start and closed_end, or inner_radius");
  }
  if (b.folded && b.length < b.radius) {
    refuse(fmt::format("a fold of radius {} m needs more than {} m of length", b.radius, b.length), "give at least the radius");
  }
  if (b.particles < 2 * kFewest) {
    refuse(fmt::format("{} particles cannot make two tubes", b.particles), fmt::format("give {} to {}", 2 * kFewest, kMost));
  }
}

struct Ring {
  double s;        // [m] along the profile
  double phase;    // [rad] of the first vertex
  int count;       // vertices; 1 is the top of a dome
  uint32_t first;  // sheet vertex
};

// Number of vertices of each of `rings` evenly spaced rings when a full ring has `full`: fewer where a dome narrows.
std::vector<int> ring_counts(const BowelShape& shape, const BowelSurface& surface, int rings, int full) {
  std::vector<int> count(rings);
  for (int i = 0; i < rings; ++i) {
    const double s = surface.profile_length() * i / (rings - 1);
    const bool top = (i == 0 && shape.closed_end) || (i == rings - 1 && shape.closed_start);
    count[i] = top ? 1 : std::max(5, static_cast<int>(std::lround(full * surface.ring_radius(s) / shape.radius)));
  }
  return count;
}

int sum(const std::vector<int>& count) {
  int total = 0;
  for (int c : count) total += c;
  return total;
}

// Rings whose vertices sum to exactly n, with triangles as near equilateral as rings allow. The rings of the far end get one
// vertex each of the remainder: the bowel is fixed there, and an odd ring matters least.
std::vector<Ring> lay_rings(const BowelShape& shape, const BowelSurface& surface, int n) {
  std::vector<int> best;
  double best_fault = 1e30;
  for (int rings = 4; rings * 6 <= 2 * n; ++rings) {
    int full = 6;
    while (sum(ring_counts(shape, surface, rings, full + 1)) <= n) ++full;
    std::vector<int> count = ring_counts(shape, surface, rings, full);
    if (sum(count) > n) break;
    const double row = surface.profile_length() / (rings - 1), column = kTwoPi * shape.radius / full;
    const double fault = std::abs(portable::log(row / column / 0.8660254));
    if (fault >= best_fault) continue;
    int left = n - sum(count);
    for (int whole = 1; whole >= 0; --whole) {  // full rings first, then those of the domes
      for (int i = rings - 1; i >= 0 && left > 0; --i) {
        if (count[i] == 1 || (count[i] == full) != (whole == 1)) continue;
        ++count[i], --left;
      }
    }
    if (left > 0) continue;
    best_fault = fault;
    best = std::move(count);
  }
  if (best.empty()) {
    throw InputError(shape.name, fmt::format("{} particles are too few for this shape", shape.particles),
                     "give more particles");
  }
  std::vector<Ring> ring;
  uint32_t first = 0;
  double phase = 0;
  for (size_t i = 0; i < best.size(); ++i) {
    ring.push_back(
        {surface.profile_length() * static_cast<double>(i) / static_cast<double>(best.size() - 1), phase, best[i], first});
    first += static_cast<uint32_t>(best[i]);
    phase += (i % 2 == 0 ? 0.5 : -0.5) * kTwoPi / best[i];  // half a step forward, half a step back: no spiral
  }
  return ring;
}

// Fills the strip between two rings, always with the shorter of the two possible next edges.
void zip(const Ring& a, const Ring& b, std::vector<Triangle>& triangle) {
  const double da = kTwoPi / a.count, db = kTwoPi / b.count;
  const long start = b.count > 1 ? std::lround((a.phase - b.phase) / db) : 0;  // the vertex of b nearest to a's first
  const auto va = [&](int i) { return a.first + static_cast<uint32_t>(i % a.count); };
  const auto vb = [&](int j) { return b.first + static_cast<uint32_t>((((start + j) % b.count) + b.count) % b.count); };
  const auto at_a = [&](int i) { return a.phase + da * i; };
  const auto at_b = [&](int j) { return b.phase + db * static_cast<double>(start + j); };
  const int na = a.count > 1 ? a.count : 0, nb = b.count > 1 ? b.count : 0;
  for (int i = 0, j = 0; i < na || j < nb;) {
    const bool step_a = j >= nb || (i < na && std::abs(at_a(i + 1) - at_b(j)) <= std::abs(at_b(j + 1) - at_a(i)));
    if (step_a) triangle.push_back({va(i), vb(j), va(i + 1)}), ++i;
    else triangle.push_back({va(i), vb(j), vb(j + 1)}), ++j;
  }
}

// One tube. vertices: of its visible mesh, rim edges in addition; everted: turned inside out, mucosa on its outer side.
BodyRest make_tube(const BowelShape& shape, int vertices, bool everted) {
  const BowelSurface surface(shape);
  const std::vector<Ring> rings = lay_rings(shape, surface, shape.particles / 2);

  TriangleMesh sheet;
  std::vector<Vec3> normal;
  std::vector<double> depth;  // [m] of each sheet vertex from the near end
  for (const Ring& r : rings) {
    for (int j = 0; j < r.count; ++j) {
      const double angle = r.phase + kTwoPi * j / r.count;
      sheet.position.push_back(surface.point(r.s, angle));
      normal.push_back(surface.normal(r.s, angle));
      depth.push_back(surface.depth(r.s));
    }
  }
  for (size_t i = 0; i + 1 < rings.size(); ++i) zip(rings[i], rings[i + 1], sheet.triangle);

  WallSpec wall{shape.name, shape.wall, shape.density, shape.particles % 2 == 1, 0};
  wall.extra_triangle = static_cast<uint32_t>(sheet.triangle.size()) - 1;  // of the last strip: the far end
  BodyRest body = thicken(sheet, normal, wall);
  body.name = shape.name;
  // Of a folded wall both ends are far ends.
  const float held_from = shape.length - shape.pinned_length;
  for (size_t v = 0; v < depth.size(); ++v) {
    const bool held = shape.pinned_length > 0 && static_cast<float>(depth[v]) >= held_from;
    body.pinned[2 * v] = body.pinned[2 * v + 1] = held;
  }
  if (wall.extra_particle) body.pinned.back() = shape.pinned_length > 0;

  if (everted) {
    for (TissueLayer& layer : body.layer) layer = layer == TissueLayer::serosa ? TissueLayer::mucosa : TissueLayer::serosa;
  }

  body.visible = bowel_picture(shape, surface, vertices, everted);
  const double spacing =
      std::sqrt(surface.profile_length() * kTwoPi * shape.radius / static_cast<double>(depth.size()) / 0.8660254);
  bind_skin(body.visible, body.position, static_cast<float>(2.0 * spacing), 2);
  return body;
}

// Adds `more` as the next wall: its particles follow, unconnected to the existing ones.
void join(BodyRest& body, BodyRest&& more) {
  const uint32_t first = static_cast<uint32_t>(body.position.size()),
                 vertex = static_cast<uint32_t>(body.visible.position.size());
  const auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
  const auto shifted = [](auto list, uint32_t by) {
    for (auto& row : list)
      for (uint32_t& i : row) i += by;
    return list;
  };
  body.wall.resize(first, 0);
  body.wall.resize(first + more.position.size(), static_cast<uint8_t>(body.walls));
  ++body.walls;
  append(body.position, more.position), append(body.mass, more.mass);
  append(body.pinned, more.pinned), append(body.layer, more.layer);
  append(body.cluster, shifted(more.cluster, first));
  append(body.tet, shifted(more.tet, first));
  append(body.surface, shifted(more.surface, first));
  // Near rims first, wall by wall; then the far ones.
  for (Rim& r : more.rim) {
    for (uint32_t& i : r.outer) i += first;
    for (uint32_t& i : r.inner) i += first;
  }
  std::vector<Rim> rim;
  for (size_t end = 0; end < body.rim.size(); ++end) rim.insert(rim.end(), {body.rim[end], more.rim[end]});
  body.rim = std::move(rim);
  VisibleMesh& mesh = body.visible;
  append(mesh.position, more.visible.position), append(mesh.normal, more.visible.normal);
  append(mesh.uv, more.visible.uv), append(mesh.layer, more.visible.layer);
  append(mesh.triangle, shifted(more.visible.triangle, vertex));
  append(mesh.skin_particle, shifted(more.visible.skin_particle, first));
  append(mesh.skin_weight, more.visible.skin_weight);
}

}  // namespace

BodyRest make_bowel(const BowelShape& shape) {
  check(shape);
  if (shape.inner_radius == 0) return make_tube(shape, kPictureVertices, false);
  if (shape.folded) {
    BowelShape whole = shape;
    whole.taeniae = 0;
    return make_tube(whole, kPictureVertices, true);
  }
  BowelShape outer = shape, inner = shape;
  outer.inner_radius = inner.inner_radius = 0;
  inner.radius = shape.inner_radius;
  outer.taeniae = 0;  // a rectum has none; the remaining folds are the rings of a prolapse
  const float part = shape.radius / (shape.radius + shape.inner_radius);
  // An even number, so that an odd particle, if any, is the inner tube's and outer sides keep even indices.
  outer.particles = 2 * static_cast<int>(std::lround(0.5f * part * static_cast<float>(shape.particles)));
  inner.particles = shape.particles - outer.particles;
  const int vertices = static_cast<int>(part * kPictureVertices);
  BodyRest body = make_tube(outer, vertices, true);
  join(body, make_tube(inner, kPictureVertices - vertices, false));
  return body;
}

}  // namespace catgut
