// SPDX-License-Identifier: Apache-2.0
// validation: the wall with a modulus (src/wall) beside the material's constants and closed forms. Every line measures a body
// at rest from outside: forces that the check applies, and lengths.
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "anatomy/bowel.h"
#include "validation/checks.h"
#include "wall/wall.h"

namespace catgut::validation {

namespace {

using wall::Wall;

constexpr double kPi2 = 6.283185307179586;
constexpr float kTick = 1.0f / 60;

// Steps under external forces for `seconds`; they grow over the first third. force: 2 per column.
void settle(Wall& w, const std::vector<Vec3>& force, double seconds) {
  Jobs jobs(1);
  const int steps = static_cast<int>(std::lround(seconds / w.model.step));
  for (int i = 0; i < steps; ++i) {
    for (size_t c = 0; c < force.size(); ++c)
      w.scratch.external[c] =
          wall::float4(force[c] * std::min(1.0f, static_cast<float>(i) / (0.3f * static_cast<float>(steps))));
    wall::begin_step(w.model, w.state, w.scratch, jobs);
    wall::finish_step(w.model, w.state, jobs);
  }
}

Vec3 middle(const Wall& w, uint32_t c) { return wall::vec3(w.state.motion.x[2 * c]); }
Vec3 rest_middle(const Wall& w, uint32_t c) { return (w.model.mesh.outer[c] + w.model.mesh.inner[c]) * 0.5f; }

// A tube with its axis along z whose far end is held; columns may lie anywhere on it.
struct Tube {
  float radius, thickness, length;  // [m] of the mid-surface
};

// Mean height over the columns between two heights at rest.
double height_of(const Wall& w, float low, float high) {
  double sum = 0, n = 0;
  for (uint32_t c = 0; c < w.model.mesh.outer.size(); ++c) {
    const float z = rest_middle(w, c).z;
    if (z >= low && z <= high) sum += static_cast<double>(middle(w, c).z), ++n;
  }
  return sum / n;
}
double radius_of(const Wall& w, float low, float high) {
  double sum = 0, n = 0;
  for (uint32_t c = 0; c < w.model.mesh.outer.size(); ++c) {
    const float z = rest_middle(w, c).z;
    const Vec3 p = middle(w, c);
    if (z >= low && z <= high) sum += std::hypot(static_cast<double>(p.x), static_cast<double>(p.y)), ++n;
  }
  return sum / n;
}

// Modulus along: `force` [N] spread evenly over the columns of the near end, the stretch of the middle half of the tube.
double modulus_along(Wall w, const Tube& t, double force, double seconds) {
  std::vector<Vec3> f(w.state.motion.x.size());
  std::vector<uint32_t> end;
  for (uint32_t c = 0; c < w.model.mesh.outer.size(); ++c)
    if (rest_middle(w, c).z > -1e-4f) end.push_back(c);
  for (uint32_t c : end) f[2 * c].z = static_cast<float>(force / static_cast<double>(end.size()));
  const float a = -0.30f * t.length, b = -0.72f * t.length, band = 0.06f * t.length;
  const double rest = height_of(w, a - band, a + band) - height_of(w, b - band, b + band);
  settle(w, f, seconds);
  const double now = height_of(w, a - band, a + band) - height_of(w, b - band, b + band);
  return force / (kPi2 * t.radius * t.thickness) / (now / rest - 1);
}

// Modulus around: a pressure that acts on the mid-surface outward in the directions at rest; the widening at half length.
double modulus_around(Wall w, const Tube& t, double pressure, double seconds) {
  std::vector<Vec3> f(w.state.motion.x.size());
  for (uint32_t c = 0; c < w.model.mesh.outer.size(); ++c) {
    const double area = static_cast<double>(w.state.topology.mass[c]) / (1050.0 * t.thickness);
    const Vec3 p = rest_middle(w, c);
    f[2 * c] = normalized(Vec3{p.x, p.y, 0}) * static_cast<float>(pressure * area);
  }
  const float low = -0.55f * t.length, high = -0.40f * t.length;
  const double rest = radius_of(w, low, high);
  settle(w, f, seconds);
  return pressure * t.radius / t.thickness / (radius_of(w, low, high) / rest - 1);
}

wall::Spec tube_spec(int around, int rings, float step, const wall::Layer& layer) {
  wall::Spec s;
  wall::TubeShape shape;
  shape.around = around, shape.rings = rings;
  s.mesh = wall::tube(shape);
  s.layer = {layer};
  s.step = step;
  s.drag = 20;
  return s;
}
constexpr Tube kTube{0.01875f, 0.0025f, 0.070f};

void add_modulus(Lines& out, const std::string& name, double expected, double got) {
  out.add("modulus/" + name, expected, got, 0.05, "Pa",
          "the material's constant; uniaxial stress, force over area over strain");
}

void check_substeps(Lines& out) {
  wall::Layer layer;
  double along[4], around[4];
  int k = 0;
  for (const int substeps : {8, 16, 32, 64}) {
    const Wall w = wall::build_wall(tube_spec(32, 19, kTick / static_cast<float>(substeps), layer));
    along[k] = modulus_along(w, kTube, 1.0, 1.2), around[k] = modulus_around(w, kTube, 500, 1.2);
    const std::string name = "1216 nodes, " + std::to_string(substeps) + " substeps a tick";
    add_modulus(out, "along/" + name, 6e5, along[k]);
    add_modulus(out, "around/" + name, 6e5, around[k]);
    ++k;
  }
  const auto spread = [](const double(&v)[4]) { return *std::max_element(v, v + 4) / *std::min_element(v, v + 4) - 1; };
  out.add("modulus/along/spread over 8 to 64 substeps", 0, spread(along), 1e-3, "", "a constant of the material");
  out.add("modulus/around/spread over 8 to 64 substeps", 0, spread(around), 1e-3, "", "a constant of the material");
  const Wall fine = wall::build_wall(tube_spec(64, 38, 0.001f, layer));
  const double a4 = modulus_along(fine, kTube, 1.0, 1.2), r4 = modulus_around(fine, kTube, 500, 1.2);
  add_modulus(out, "along/4864 nodes, 1 ms", 6e5, a4);
  add_modulus(out, "around/4864 nodes, 1 ms", 6e5, r4);
  out.add("modulus/along/4864 nodes against 1216", along[1], a4, 0.07, "Pa", "a constant of the material");
  out.add("modulus/around/4864 nodes against 1216", around[1], r4, 0.07, "Pa", "a constant of the material");
}

// The bowel generator's own mesh, rows of triangles that are joined to slanted quads.
void check_generated(Lines& out) {
  BowelShape shape;
  shape.haustra = 0;
  shape.axis = {0, 0, 1};
  const BodyRest body = make_bowel(shape);
  std::vector<Vec3> outer, inner;
  for (size_t i = 0; i + 1 < body.position.size(); i += 2)
    outer.push_back(body.position[i]), inner.push_back(body.position[i + 1]);
  std::vector<std::array<uint32_t, 3>> triangle;
  for (const Triangle& t : body.surface)
    if (t[0] % 2 == 0 && t[1] % 2 == 0 && t[2] % 2 == 0 && std::max({t[0], t[1], t[2]}) / 2 < outer.size())
      triangle.push_back({t[0] / 2, t[1] / 2, t[2] / 2});
  wall::Spec s;
  s.mesh = wall::from_triangles(outer, inner, triangle, {0, 0, 1}, "bowel");
  for (size_t c = 0; c < outer.size(); ++c) s.mesh.held[c] = body.pinned[2 * c];
  s.drag = 20;
  const Wall w = wall::build_wall(s);
  const Tube t{shape.radius - 0.5f * shape.wall, shape.wall, shape.length - shape.pinned_length};
  add_modulus(out, "along/bowel generator, 1228 particles", 6e5, modulus_along(w, t, 1.0, 1.2));
  add_modulus(out, "around/bowel generator, 1228 particles", 6e5, modulus_around(w, t, 500, 1.2));
}

// Unequal moduli along and around, and fibers that straighten.
void check_material(Lines& out) {
  wall::Layer layer;
  layer.e_around = 1.7e6f;
  const Wall w = wall::build_wall(tube_spec(32, 19, 0.001f, layer));
  add_modulus(out, "anisotropic/along", 6e5, modulus_along(w, kTube, 1.0, 1.2));
  add_modulus(out, "anisotropic/around", 1.7e6, modulus_around(w, kTube, 1000, 1.2));

  // Terry et al. 2014: toe and stiff moduli of porcine small bowel. Nominal stress at strain e is
  // E e + (E_stiff - E) max(e - knee, 0); the contraction's stress vanishes in a free tube.
  wall::Layer curve;
  curve.e_along = 3.07e5f, curve.e_around = 1.80e5f;
  curve.stiff_along = 2.212e6f, curve.stiff_around = 1.389e6f;
  const Wall j = wall::build_wall(tube_spec(32, 19, 0.001f, curve));
  const double area = kPi2 * kTube.radius * kTube.thickness;
  for (const double strain : {0.10, 0.20, 0.45}) {
    const double stress = 3.07e5 * strain + (2.212e6 - 3.07e5) * std::max(strain - 0.30, 0.0);
    const double got = stress / modulus_along(j, kTube, stress * area, 2.0);
    out.add("modulus/J-curve/strain along at " + std::to_string(static_cast<int>(stress / 1000)) + " kPa", strain, got, 0.05,
            "", "bilinear curve, moduli of Terry et al. 2014");
  }
}

// A free ring pinched by two opposite forces: the diameter shrinks by 0.1488 F R^3 / (E I) (Timoshenko, Strength of Materials).
void check_ring(Lines& out) {
  for (const int around : {32, 64}) {
    wall::Spec s;
    wall::TubeShape shape;
    shape.around = around, shape.rings = 2, shape.length = 0.0025f, shape.held_rings = 0;
    shape.thickness = 0.0015f, shape.outer_radius = 0.02075f;
    s.mesh = wall::tube(shape);
    s.drag = 20;
    Wall w = wall::build_wall(s);
    const double r = 0.020, b = 0.0025, t = 0.0015, force = 1e-4;
    const double expected = 0.1488 * force * r * r * r / (6e5 * b * t * t * t / 12);
    std::vector<Vec3> f(w.state.motion.x.size());
    const uint32_t n = static_cast<uint32_t>(around), half = n / 2;
    const Vec3 in = normalized(rest_middle(w, half) - rest_middle(w, 0)) * static_cast<float>(force / 2);
    for (uint32_t ring = 0; ring < 2; ++ring) f[2 * (ring * n)] = in, f[2 * (ring * n + half)] = -in;
    const auto diameter = [&] { return static_cast<double>(distance(middle(w, 0), middle(w, half))); };
    const double before = diameter();
    settle(w, f, 2.0);
    out.add("modulus/ring/pinched, " + std::to_string(around) + " columns around", expected, before - diameter(), 0.03, "m",
            "0.1488 F R^3 / (E I), Timoshenko");
  }
}

}  // namespace

void check_wall(Lines& out) {
  check_substeps(out);
  check_generated(out);
  check_material(out);
  check_ring(out);
}

}  // namespace catgut::validation
