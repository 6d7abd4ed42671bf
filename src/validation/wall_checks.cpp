// SPDX-License-Identifier: Apache-2.0
// validation: the wall with a modulus (src/wall) compared with material constants and closed forms. Every line measures a body
// at rest from outside: forces that the check applies, and lengths.
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "anatomy/bowel.h"
#include "validation/checks.h"
#include "validation/wall_rig.h"
#include "validation/wall_static.h"
#include "wall/contact.h"
#include "wall/cut.h"
#include "wall/wall.h"

namespace catgut::validation {

namespace {

using wall::Wall;

constexpr double kPi2 = 6.283185307179586;

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

// Every quad of the tube split into two prisms, along alternating diagonals, like unpaired triangles of an organ's mesh.
void check_prisms(Lines& out) {
  wall::Spec s = tube_spec(32, 19, 0.001f, {});
  const auto quads = s.mesh.face;
  s.mesh.face.clear(), s.mesh.along.clear();
  for (size_t f = 0; f < quads.size(); ++f) {
    const auto& q = quads[f];
    const size_t turn = (f + f / 32) % 2;
    s.mesh.face.push_back({q[turn], q[turn + 1], q[turn + 2], wall::kNone});
    s.mesh.face.push_back({q[turn], q[turn + 2], q[(turn + 3) % 4], wall::kNone});
    s.mesh.along.insert(s.mesh.along.end(), 2, Vec3{0, 0, 1});
  }
  const Wall w = wall::build_wall(s);
  add_modulus(out, "along/prisms, 1216 nodes", 6e5, modulus_along(w, kTube, 1.0, 1.2));
  add_modulus(out, "around/prisms, 1216 nodes", 6e5, modulus_around(w, kTube, 500, 1.2));
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

// A small pad pushes points of the outer face inward by 5 mm; returns the force.
struct Led {
  Wall wall;
  wall::Hold hold;
  std::vector<Vec3> home;
  double force = 0;  // [N]
};
Led lead_inward(Wall w, const std::vector<wall::Point>& points, float depth, double seconds) {
  Led out{std::move(w), {}, {}, 0};
  Wall& q = out.wall;
  Vec3 middle_of_points{};
  for (const wall::Point& p : points) {
    out.hold.point.push_back(wall::weights(q.model, q.state.topology, p));
    out.home.push_back(wall::place(out.hold.point.back(), q.state.motion));
    middle_of_points += out.home.back() / static_cast<float>(points.size());
  }
  const Vec3 in = normalized(Vec3{-middle_of_points.x, -middle_of_points.y, 0});
  out.hold.target = out.home;
  Jobs jobs(1);
  const int steps = static_cast<int>(std::lround(seconds / q.model.step));
  for (int i = 0; i < steps; ++i) {
    const float d = depth * std::min(1.0f, static_cast<float>(i) / (0.4f * static_cast<float>(steps)));
    for (size_t k = 0; k < points.size(); ++k) out.hold.target[k] = out.home[k] + in * d;
    wall::begin_step(q.model, q.state, q.scratch, jobs);
    wall::apply_hold(q.model, q.state, q.scratch, out.hold);
    wall::finish_step(q.model, q.state, jobs);
  }
  for (const Vec3& f : out.hold.force) out.force += static_cast<double>(dot(f, in));
  return out;
}

// Points of the outer face within a disc of 5 mm about the middle of the tube's flank.
std::vector<wall::Point> pad(const Wall& w) {
  std::vector<wall::Point> out{wall::nearest_point(w.model, w.state, {0.020f, 0, -0.035f}, 1)};
  for (int k = 0; k < 6; ++k) {
    const float a = static_cast<float>(kPi2 / 6 * k), y = 0.0025f * std::cos(a), z = 0.0025f * std::sin(a);
    out.push_back(wall::nearest_point(w.model, w.state, {std::sqrt(0.0004f - y * y), y, -0.035f + z}, 1));
  }
  return out;
}

void check_held(Lines& out) {
  double force[4];
  int k = 0;
  for (const int substeps : {8, 16, 32, 64}) {
    const Wall w = wall::build_wall(tube_spec(32, 19, kTick / static_cast<float>(substeps), {}));
    const Led led = lead_inward(w, pad(w), 0.005f, 1.2);
    force[k++] = led.force;
    if (substeps != 16) continue;
    // The same forces in the static solution push the same points to the same depth.
    StaticWall still(w);
    std::vector<StaticLoad> load;
    for (size_t i = 0; i < led.hold.point.size(); ++i) {
      const Vec3 f = led.hold.force[i];
      load.push_back({led.hold.point[i], {f.x, f.y, f.z}});
    }
    still.solve(load, {}, 0, 3);
    double depth = 0;
    for (size_t i = 0; i < led.home.size(); ++i)
      depth += (still.at(led.hold.point[i]) - Eigen::Vector3d(led.home[i].x, led.home[i].y, led.home[i].z)).norm() /
               static_cast<double>(led.home.size());
    out.add("modulus/held/pad pushed in, depth of its forces in the static solution", depth, 0.005, 0.005, "m",
            "Newton's method in double precision on the same elements");
  }
  out.add("modulus/held/force of the pad, spread over 8 to 64 substeps", 0,
          *std::max_element(force, force + 4) / *std::min_element(force, force + 4) - 1, 1e-3, "", "a force at rest");
  // A force spread over a disc of 5 mm; mean displacement of the disc's points.
  double depth[2];
  for (const bool fine : {false, true}) {
    Wall w = wall::build_wall(fine ? tube_spec(64, 38, 0.001f, {}) : tube_spec(32, 19, 0.001f, {}));
    std::vector<wall::Weights> disc;
    std::vector<Vec3> f(w.state.motion.x.size());
    const auto mean = [&] {
      double sum = 0;
      for (const wall::Weights& p : disc)
        sum += static_cast<double>(wall::place(p, w.state.motion).x) / static_cast<double>(disc.size());
      return sum;
    };
    for (int i = -8; i <= 8; ++i)
      for (int j = -8; j <= 8; ++j) {
        const float y = 0.0003f * static_cast<float>(i), z = 0.0003f * static_cast<float>(j);
        if (y * y + z * z > 0.0025f * 0.0025f) continue;
        disc.push_back(wall::weights(w.model, w.state.topology,
                                     wall::nearest_point(w.model, w.state, {std::sqrt(0.0004f - y * y), y, z - 0.035f}, 1)));
      }
    wall::Column<wall::Float4> list(f.size());
    for (const wall::Weights& p : disc) wall::add_to(list, p, Vec3{-0.12f / static_cast<float>(disc.size()), 0, 0});
    for (size_t c = 0; c < f.size(); ++c) f[c] = wall::vec3(list[c]);
    const double before = mean();
    settle(w, f, 1.2);
    depth[fine] = before - mean();
  }
  out.add("modulus/held/depth of 0.12 N on a disc of 5 mm, 4864 nodes against 1216", depth[0], depth[1], 0.07, "m",
          "the same tissue");
}

// A pulled tube at rest: changes within a second.
void check_drift(Lines& out) {
  Wall w = wall::build_wall(tube_spec(32, 19, 0.001f, {}));
  std::vector<Vec3> f(w.state.motion.x.size());
  for (uint32_t c = 0; c < 32; ++c) f[2 * c] = {0, c < 8 ? 0.01f : 0, 0.03f};
  settle(w, f, 2.0);
  const auto before = w.state.motion.x;
  Jobs jobs(1);
  for (int i = 0; i < 1000; ++i) {
    for (size_t c = 0; c < f.size(); ++c) w.scratch.external[c] = wall::float4(f[c]);
    wall::begin_step(w.model, w.state, w.scratch, jobs);
    wall::finish_step(w.model, w.state, jobs);
  }
  double moved = 0, pulled = 0;
  for (uint32_t c = 0; c < w.model.mesh.outer.size(); ++c) {
    moved = std::max(moved, static_cast<double>(distance(wall::vec3(before[2 * c]), middle(w, c))));
    pulled = std::max(pulled, static_cast<double>(distance(rest_middle(w, c), middle(w, c))));
  }
  out.add("modulus/drift/a second at rest, part of the deflection", 0, moved / pulled, 1e-3, "", "rest");
}

void check_inertia_and_cut(Lines& out) {
  for (const bool fine : {false, true}) {
    const int around = fine ? 64 : 32, rings = fine ? 38 : 19;
    const std::string nodes = fine ? "4864 nodes" : "1216 nodes";
    Wall old = wall::build_wall(tube_spec(around, rings, 0.001f, {}));
    const auto bound = [&](const std::string& when, const Wall& w, bool stiff) {
      wall::Scratch scratch = wall::make_scratch(w.model, w.state);
      out.add("modulus/inertia/largest eigenvalue, " + nodes + ", " + when, 0,
              static_cast<double>(wall::largest_eigenvalue(w.model, w.state, scratch, stiff)), 1.2, "",
              "stable below 2.67; 1.2 leaves room for large strain");
    };
    bound("built", old, false);
    // A slit from the rim, 25 mm long.
    std::vector<std::array<uint32_t, 2>> edge;
    for (int i = 0; i < (fine ? 13 : 6); ++i)
      edge.push_back({static_cast<uint32_t>(i * around), static_cast<uint32_t>((i + 1) * around)});
    wall::cut(old.model, old.state, old.scratch, edge);
    bound("cut", old, false);
    Wall fresh = old;
    wall::refactor(fresh.model, fresh.state, fresh.scratch);
    bound("cut, new factor", fresh, false);
    double gap[2];
    int k = 0;
    for (Wall* w : {&old, &fresh}) {
      // The lips are pulled apart at the rim.
      const wall::Topology& t = w->state.topology;
      uint32_t copy = 0;
      for (uint32_t c = static_cast<uint32_t>(around * rings); c < wall::columns(w->state); ++c)
        if (t.source[c] == 0) copy = c;
      const uint32_t beside = 1;  // a column on one side of the slit
      const auto on_its_side = [&](uint32_t c) {
        for (uint32_t g = t.gather_first[c]; g < t.gather_first[c + 1]; ++g)
          for (const auto& corner : t.corners[t.gather_from[g] / 64].column)
            if (corner[t.gather_from[g] % 16] == beside) return true;
        return false;
      };
      const Vec3 apart = normalized(rest_middle(*w, beside) - rest_middle(*w, 0)) * 0.02f;
      std::vector<Vec3> f(w->state.motion.x.size());
      f[0] = on_its_side(0) ? apart : -apart, f[2 * copy] = -f[0];
      settle(*w, f, 2.0);
      gap[k++] = static_cast<double>(distance(middle(*w, 0), middle(*w, copy)));
    }
    out.add("modulus/cut/gap of a slit with the old factor against a new one, " + nodes, gap[1], gap[0], 1e-3, "m",
            "the same rest");
  }
}

// A capsule pressed onto the flank: its force equals the reaction of the held end, at any step.
void check_contact(Lines& out) {
  double force[4], balance = 0;
  int k = 0;
  for (const float step : {0.002f, 0.001f, 0.0005f, 0.001f}) {
    const bool fine = k == 3;
    Wall w = wall::build_wall(fine ? tube_spec(64, 38, step, {}) : tube_spec(32, 19, step, {}));
    wall::ContactSolver solver;
    std::vector<wall::Obstacle> tool(1);
    tool[0].radius = 0.003f;
    Jobs jobs(1);
    const int steps = static_cast<int>(std::lround(1.2f / step));
    for (int i = 0; i < steps; ++i) {
      const float grow = 0.4f * static_cast<float>(steps), d = 0.004f * std::min(1.0f, static_cast<float>(i) / grow);
      tool[0].a = {0.023f - d, -0.01f, -0.0365f}, tool[0].b = {0.023f - d, 0.01f, -0.0365f};
      tool[0].speed_a = tool[0].speed_b = static_cast<float>(i) < grow ? Vec3{-0.004f / (grow * step), 0, 0} : Vec3{};
      wall::find_contacts(w.model, w.state, tool, solver);
      wall::warm_start(w.model, w.scratch, solver);
      wall::begin_step(w.model, w.state, w.scratch, jobs);
      wall::solve_contacts(w.model, w.state, w.scratch, tool, solver);
      wall::finish_step(w.model, w.state, jobs);
    }
    force[k++] = static_cast<double>(length(solver.force[0]));
    wall::elastic_forces(w.model, w.state, w.scratch);
    Vec3 held{};
    for (uint32_t c = 0; c < w.model.mesh.outer.size(); ++c)
      if (w.model.mesh.held[c]) held += wall::vec3(w.scratch.force[2 * c]);
    balance = std::max(balance, static_cast<double>(length(held + solver.force[0])) / force[k - 1]);
  }
  out.add("contact/wall/capsule pressed in 4 mm, spread over steps of 0.5 to 2 ms", 0,
          *std::max_element(force, force + 3) / *std::min_element(force, force + 3) - 1, 0.01, "", "a force at rest");
  out.add("modulus/held/force of the capsule, 4864 nodes against 1216", force[1], force[3], 0.07, "N", "the same tissue");
  out.add("contact/wall/what the capsule feels less what the held end bears", 0, balance, 0.01, "", "Newton's third law");

  // A pad on a slope: it sticks below the angle of friction and slides like a block above it.
  for (const double degrees : {10.0, 25.0}) {
    wall::Spec s;
    wall::SheetShape shape;
    shape.width = 0.03f, shape.height = 0.02f, shape.columns = 8, shape.rows = 6;
    s.mesh = wall::sheet(shape);
    s.drag = 0;
    const double a = degrees * kPi2 / 360;
    s.gravity = Vec3{static_cast<float>(std::sin(a)), 0, static_cast<float>(-std::cos(a))} * 9.81f;
    Wall w = wall::build_wall(s);
    wall::ContactSolver solver;
    std::vector<wall::Obstacle> plane(1);
    plane[0].kind = wall::Obstacle::Kind::plane;
    plane[0].a = {0, 0, -0.5f * shape.thickness}, plane[0].b = {0, 0, 1}, plane[0].friction = 0.3f;
    Jobs jobs(1);
    Vec3 start = middle(w, 20);
    for (int i = 0; i < 500; ++i) {
      if (i == 250 && degrees < 15) start = middle(w, 20);  // it has settled
      wall::find_contacts(w.model, w.state, plane, solver);
      wall::warm_start(w.model, w.scratch, solver);
      wall::begin_step(w.model, w.state, w.scratch, jobs);
      wall::solve_contacts(w.model, w.state, w.scratch, plane, solver);
      wall::finish_step(w.model, w.state, jobs);
    }
    const double moved = static_cast<double>((middle(w, 20) - start).x);
    const double slide = 0.5 * 0.25 * 9.81 * (std::sin(a) - 0.3 * std::cos(a));
    if (slide < 0)
      out.add("contact/wall/pad on a slope of 10 degrees, friction 0.3, creep in 0.25 s", 0, moved, 1e-6, "m", "Coulomb");
    else out.add("contact/wall/pad on a slope of 25 degrees, friction 0.3, slid in 0.5 s", slide, moved, 0.02, "m", "Coulomb");
  }
}

// A string drawn through holes of the wall, stepped at 50 us on a wall stepped at `step`: "consistent multi-rate".
struct Drawn {
  double tension = 0, gap = 0, sway = 0;  // [N], [m], [N] of tension in the last 0.2 s
};
Drawn draw_string(Wall& w, const std::vector<wall::Point>& hole, double drawn, double seconds, float dt) {
  wall::Coupling thread;
  thread.set_points(w.model, w.state.topology, hole);
  Jobs jobs(1);
  const size_t n = hole.size();
  const auto pull = [&](std::vector<Vec3>& g) {
    double sum = 0;
    g.assign(n, {});
    for (size_t i = 0; i < n; ++i) {
      const Vec3 d = thread.at[(i + 1) % n] - thread.at[i];
      const float l = length(d);
      sum += static_cast<double>(l);
      g[i] += d / l, g[(i + 1) % n] += d / -l;  // toward the neighbors
    }
    return sum;
  };
  std::vector<Vec3> g;
  thread.begin(w.model, w.state);
  const double from = pull(g);
  const int steps = static_cast<int>(std::lround(seconds / w.model.step));
  const int small = static_cast<int>(std::lround(w.model.step / dt));
  Drawn out;
  double low = 1e9, high = 0;
  for (int i = 0; i < steps; ++i) {
    wall::begin_step(w.model, w.state, w.scratch, jobs);
    thread.begin(w.model, w.state);
    const double rest = from - drawn * std::min(1.0, i / (0.5 * steps));
    double impulse = 0;
    for (int k = 0; k < small; ++k) {
      thread.advance(dt);
      const double over = pull(g) - rest;
      if (over <= 0) continue;
      double gwg = 0;
      for (size_t a = 0; a < n; ++a)
        for (size_t b = 0; b < n; ++b) gwg += static_cast<double>(thread.w[a * n + b] * dot(g[a], g[b]));
      const double p = over / (w.model.step * gwg);
      for (size_t a = 0; a < n; ++a) thread.push(a, g[a] * static_cast<float>(p));
      impulse += p;
    }
    thread.end(w.state, w.scratch);
    wall::finish_step(w.model, w.state, jobs);
    out.tension = impulse / w.model.step;
    if ((steps - i) * w.model.step < 0.2f) low = std::min(low, out.tension), high = std::max(high, out.tension);
  }
  out.sway = high - low;
  return out;
}

std::vector<wall::Weights> weights_of(const Wall& w, const std::vector<wall::Point>& hole) {
  std::vector<wall::Weights> out;
  for (const wall::Point& p : hole) out.push_back(wall::weights(w.model, w.state.topology, p));
  return out;
}

// Two tubes face to face, 8 mm apart, and a loop of string through four holes 4 mm from their edges.
void check_string(Lines& out) {
  wall::TubeShape shape;
  shape.around = 24, shape.rings = 8, shape.length = 0.025f;
  shape.center = {0, 0, 0.004f}, shape.axis = {0, 0, -1};
  wall::Spec s;
  s.mesh = wall::tube(shape);
  shape.center.z = -0.004f, shape.axis.z = 1;
  wall::append(s.mesh, wall::tube(shape));
  s.drag = 20;
  const double drawn = 0.007;
  std::vector<wall::Point> hole;
  const Wall w = wall::build_wall(s);
  for (const auto& [z, y] : {std::pair{0.008f, 0.002f}, {0.008f, -0.002f}, {-0.008f, -0.002f}, {-0.008f, 0.002f}})
    hole.push_back(wall::nearest_point(w.model, w.state, {0.01865f, y, z}, 0));
  const auto gap = [&](const auto& a, const auto& b) { return static_cast<double>(a - b); };
  StaticWall still(w);
  StaticString string{weights_of(w, hole), {}};
  const double from = still.length(string);
  string.length = from - drawn;
  still.solve({}, {string}, from, 7);
  const double tension = still.tension(string);
  const double closed = gap(still.at(string.through[0]).z(), still.at(string.through[3]).z());
  double open = 0.016;
  for (const float step : {0.001f, 0.0005f}) {
    s.step = step;
    Wall q = wall::build_wall(s);
    const Drawn got = draw_string(q, hole, drawn, 2.0, 5e-5f);
    const auto through = weights_of(q, hole);
    const double now = gap(wall::place(through[0], q.state.motion).z, wall::place(through[3], q.state.motion).z);
    const std::string name =
        "closure/string/four holes, wall at " + std::to_string(static_cast<int>(1e6f * step + 0.5f)) + " us, ";
    const std::string source = "static solution in double precision, string without thickness or friction";
    out.add(name + "tension", tension, got.tension, 0.005, "N", source);
    out.add(name + "closing of the gap", open - closed, open - now, 0.005, "m", source);
    out.add(name + "sway of the tension at rest", 0, got.sway / got.tension, 1e-3, "", "rest");
  }
}

// A string through twelve holes round a rim, shortened by a tenth: the start of a purse-string.
void check_purse(Lines& out) {
  wall::TubeShape shape;
  shape.around = 24, shape.rings = 8, shape.length = 0.025f;
  wall::Spec s;
  s.mesh = wall::tube(shape);
  s.drag = 20;
  Wall w = wall::build_wall(s);
  std::vector<wall::Point> hole;
  for (int k = 0; k < 12; ++k) {
    const float a = static_cast<float>(kPi2 / 12 * (k + 0.25));
    hole.push_back(wall::nearest_point(w.model, w.state, {0.0187f * std::cos(a), 0.0187f * std::sin(a), -0.004f}, 0));
  }
  StaticWall still(w);
  StaticString string{weights_of(w, hole), {}};
  const double from = still.length(string), drawn = 0.1 * from;
  string.length = from - drawn;
  const Drawn got = draw_string(w, hole, drawn, 3.0, 5e-5f);
  // The rim puckers, in one of many possible shapes: the static solution starts from the simulated one.
  still.start_from(w.state);
  still.solve({}, {string}, string.length, 1);
  out.add("closure/string/twelve holes round a rim drawn in by a tenth, tension", still.tension(string), got.tension, 0.005,
          "N", "static solution in double precision, string without thickness or friction");
}

}  // namespace

void check_wall(Lines& out) {
  check_substeps(out);
  check_generated(out);
  check_prisms(out);
  check_material(out);
  check_ring(out);
  check_held(out);
  check_foundation(out);
  check_drift(out);
  check_inertia_and_cut(out);
  check_contact(out);
  check_string(out);
  check_purse(out);
}

}  // namespace catgut::validation
