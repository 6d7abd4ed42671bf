// SPDX-License-Identifier: Apache-2.0
// anatomy/organ: reads an organ's surface from a file and makes a soft body from it. See the header for the steps.
#include "anatomy/organ.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "anatomy/sheet_picture.h"
#include "anatomy/wall.h"
#include "core/check.h"
#include "geometry/mesh_io.h"
#include "geometry/polygon.h"
#include "geometry/remesh.h"
#include "geometry/topology.h"

namespace catgut {

namespace {

using Loop = std::vector<uint32_t>;

void check(const OrganImport& o) {
  const auto refuse = [&](const std::string& what, const std::string& next) { throw InputError(o.name, what, next); };
  if (o.particles < 120 || o.particles > 200000)
    refuse(fmt::format("{} particles cannot make an organ", o.particles), "give 120 to 200000");
  if (!(o.wall >= 1e-4f && o.wall <= 0.05f))
    refuse(fmt::format("wall {} m is out of range", o.wall), "give meters: 0.0001 to 0.05");
  if (!is_finite(o.position)) refuse("the position is not a number", "give three numbers in meters");
  if (!is_finite(o.axis) || length(o.axis) < 1e-6f)
    refuse("the axis has no direction", "give the direction of the rim, e.g. [0, 1, 0]");
  if (!(o.density > 0) || !std::isfinite(o.density))
    refuse(fmt::format("density {} kg/m^3 is out of range", o.density), "give a positive number, e.g. 1050");
  if (!(o.pinned_length >= 0 && o.pinned_length <= 2))
    refuse(fmt::format("pinned_length {} m is out of range", o.pinned_length), "give 0 to 2 m");
}

std::vector<Vec3> points(const TriangleMesh& mesh, const Loop& loop) {
  std::vector<Vec3> p;
  for (uint32_t v : loop) p.push_back(mesh.position[v]);
  return p;
}

// The openings, longest first.
std::vector<Loop> rims_by_length(const TriangleMesh& mesh) {
  std::vector<Loop> loops = boundary_loops(mesh.triangle);
  std::stable_sort(loops.begin(), loops.end(),
                   [&](const Loop& a, const Loop& b) { return loop_length(points(mesh, a)) > loop_length(points(mesh, b)); });
  return loops;
}

Quat turn_onto(Vec3 from, Vec3 to) {
  const float c = dot(from, to);
  if (c < -0.9999f) return axis_angle(any_perpendicular(from), kPi);
  const Vec3 a = cross(from, to);
  return normalized(Quat{a.x, a.y, a.z, 1 + c});
}

// Moves the surface into place; returns a vertex position on the chosen rim, or nothing for a closed surface.
std::vector<Vec3> place(TriangleMesh& mesh, const OrganImport& o) {
  const std::vector<Loop> rims = rims_by_length(mesh);
  const int wanted = std::max(o.rim, 0);
  if (!rims.empty() && wanted >= static_cast<int>(rims.size())) {
    std::string lengths;
    for (const Loop& l : rims)
      lengths += fmt::format("{}{:.1f}", lengths.empty() ? "" : ", ", 1e3f * loop_length(points(mesh, l)));
    throw InputError(o.name,
                     fmt::format("there is no rim {}: the openings of {} measure {} mm around", wanted, o.mesh, lengths),
                     fmt::format("choose 0 to {}", rims.size() - 1));
  }
  if (rims.empty() && o.rim >= 0) throw InputError(o.name, o.mesh + " is closed and has no rim to choose", "leave rim out");
  Vec3 center;
  Quat turn;
  if (rims.empty()) {
    double area = 0;
    for (const Triangle& t : mesh.triangle) {
      const Vec3 a = mesh.position[t[0]], b = mesh.position[t[1]], c = mesh.position[t[2]];
      const float w = length(cross(b - a, c - a));
      center += (a + b + c) * (w / 3);
      area += w;
    }
    center = center / static_cast<float>(area);
  } else {
    const auto p = points(mesh, rims[wanted]);
    center = loop_center(p);
    turn = turn_onto(loop_normal(p), normalized(o.axis));
  }
  for (Vec3& p : mesh.position) p = o.position + rotate(turn, p - center);
  return rims.empty() ? std::vector<Vec3>{} : points(mesh, rims[wanted]);
}

// The loop of the remeshed sheet that lies on the chosen rim.
Loop find_rim(const TriangleMesh& sheet, const std::vector<Vec3>& chosen) {
  Loop best;
  float best_far = 3e38f;
  for (const Loop& loop : boundary_loops(sheet.triangle)) {
    float far = 0;  // of the original rim's points from this loop
    for (Vec3 p : chosen) {
      float near = 3e38f;
      for (uint32_t v : loop) near = std::min(near, distance(p, sheet.position[v]));
      far = std::max(far, near);
    }
    if (far < best_far) best_far = far, best = loop;
  }
  return best;
}

// Renumbers ring by ring outward from `start`, so that the solver reads neighbors from adjacent memory.
TriangleMesh in_rings(const TriangleMesh& sheet, const Loop& start) {
  const auto next = vertex_neighbors(sheet.triangle, sheet.position.size());
  std::vector<uint32_t> order = start, number(sheet.position.size(), ~0u);
  for (uint32_t i = 0; i < order.size(); ++i) number[order[i]] = i;
  for (size_t head = 0; head < order.size(); ++head) {
    for (uint32_t u : next[order[head]]) {
      if (number[u] != ~0u) continue;
      number[u] = static_cast<uint32_t>(order.size());
      order.push_back(u);
    }
  }
  TriangleMesh out;
  for (uint32_t v : order) out.position.push_back(sheet.position[v]);
  for (const Triangle& t : sheet.triangle) out.triangle.push_back({number[t[0]], number[t[1]], number[t[2]]});
  // Each triangle starts with its lowest vertex; triangles are sorted too.
  for (Triangle& t : out.triangle) std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  std::sort(out.triangle.begin(), out.triangle.end());
  return out;
}

// [m] of each vertex from `start` along edges (Dijkstra).
std::vector<float> way_from(const TriangleMesh& sheet, const Loop& start) {
  const auto next = vertex_neighbors(sheet.triangle, sheet.position.size());
  std::vector<float> way(sheet.position.size(), 3e38f);
  std::set<std::pair<float, uint32_t>> open;
  for (uint32_t v : start) open.insert({way[v] = 0, v});
  while (!open.empty()) {
    const auto [d, v] = *open.begin();
    open.erase(open.begin());
    for (uint32_t u : next[v]) {
      const float w = d + distance(sheet.position[v], sheet.position[u]);
      if (w >= way[u]) continue;
      open.erase({way[u], u});
      open.insert({way[u] = w, u});
    }
  }
  return way;
}

// Distance along the organ for textures. With several openings it is relaxed so that all points of a rim have the same value
// (a harmonic function). Cross sections then follow the organ and end flush at its rims.
std::vector<float> ease_along(const TriangleMesh& sheet, std::vector<float> along, const std::vector<Loop>& rims) {
  if (rims.size() < 2) return along;
  std::vector<uint8_t> fixed(along.size(), 0);
  for (const Loop& rim : rims) {
    float mean = 0;
    for (uint32_t v : rim) mean += along[v] / static_cast<float>(rim.size());
    for (uint32_t v : rim) along[v] = mean, fixed[v] = 1;
  }
  const auto next = vertex_neighbors(sheet.triangle, along.size());
  constexpr int sweeps = 400;
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    for (size_t v = 0; v < along.size(); ++v) {
      if (fixed[v]) continue;
      float sum = 0;
      for (uint32_t u : next[v]) sum += along[u];
      along[v] += 1.6f * (sum / static_cast<float>(next[v].size()) - along[v]);  // over-relaxed
    }
  }
  return along;
}

// Distance of each sheet vertex from the fixed region [m].
std::vector<float> from_hold(const TriangleMesh& sheet, const std::vector<float>& along, const std::vector<Loop>& rims) {
  std::vector<float> far(sheet.position.size(), 3e38f);
  if (rims.size() > 1) {
    for (size_t v = 0; v < far.size(); ++v) {
      for (size_t r = 1; r < rims.size(); ++r) {
        for (uint32_t u : rims[r]) far[v] = std::min(far[v], distance(sheet.position[v], sheet.position[u]));
      }
    }
  } else if (rims.size() == 1) {
    const float end = *std::max_element(along.begin(), along.end());
    for (size_t v = 0; v < far.size(); ++v) far[v] = end - along[v];
  } else {
    float low = 3e38f;
    for (Vec3 p : sheet.position) low = std::min(low, p.y);
    for (size_t v = 0; v < far.size(); ++v) far[v] = sheet.position[v].y - low;
  }
  return far;
}

}  // namespace

BodyRest import_organ(const OrganImport& import) {
  check(import);
  const auto [path, node] = split_mesh_path(import.mesh);
  TriangleMesh surface = read_mesh(path, node);
  const std::vector<Vec3> chosen = place(surface, import);
  TriangleMesh sheet = remesh(surface, static_cast<size_t>(import.particles / 2), import.mesh);

  Loop start = find_rim(sheet, chosen);
  if (start.empty()) {  // closed: start at the top
    const auto lower = [](Vec3 a, Vec3 b) { return a.y < b.y; };
    start = {
        static_cast<uint32_t>(std::max_element(sheet.position.begin(), sheet.position.end(), lower) - sheet.position.begin())};
  }
  sheet = in_rings(sheet, start);
  const std::vector<Loop> rims = boundary_loops(sheet.triangle);  // the first starts with vertex 0: the chosen one
  for (uint32_t i = 0; i < start.size(); ++i) start[i] = i;
  const std::vector<float> along = way_from(sheet, start), hold = from_hold(sheet, along, rims);

  // The odd particle lies in the fixed region.
  WallSpec wall{import.name, import.wall, import.density, import.particles % 2 == 1, 0};
  float nearest = 3e38f;
  for (uint32_t t = 0; t < sheet.triangle.size(); ++t) {
    const Triangle& x = sheet.triangle[t];
    const float d = std::max({hold[x[0]], hold[x[1]], hold[x[2]]});
    if (d < nearest) nearest = d, wall.extra_triangle = t;
  }
  BodyRest body = thicken(sheet, wall_directions(sheet, import.wall), wall);
  body.name = import.name;
  for (size_t v = 0; v < hold.size(); ++v) body.pinned[2 * v] = body.pinned[2 * v + 1] = hold[v] < import.pinned_length;
  if (wall.extra_particle) body.pinned.back() = nearest < import.pinned_length;
  body.visible = sheet_picture(sheet, body, ease_along(sheet, along, rims));
  return body;
}

}  // namespace catgut
