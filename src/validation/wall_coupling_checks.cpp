// SPDX-License-Identifier: Apache-2.0
// validation: what acts on the wall by impulses: contact with friction, and a string through holes beside the static solution.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "validation/checks.h"
#include "validation/wall_rig.h"
#include "validation/wall_static.h"
#include "wall/contact.h"

namespace catgut::validation {

namespace {

// A capsule pressed onto the flank: what it feels is what the held end gives back, at any step.
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

  // A pad on a slope: it sticks below the angle of friction and slides as a block above it.
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
  StaticString string{weights_of(w, hole)};
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

// A string through twelve holes round a rim, drawn in by a tenth: the start of a purse-string.
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
  StaticString string{weights_of(w, hole)};
  const double from = still.length(string), drawn = 0.1 * from;
  string.length = from - drawn;
  const Drawn got = draw_string(w, hole, drawn, 3.0, 5e-5f);
  // The rim puckers, and there are many ways to: the static solution starts from the one that came about.
  still.start_from(w.state);
  still.solve({}, {string}, string.length, 1);
  out.add("closure/string/twelve holes round a rim drawn in by a tenth, tension", still.tension(string), got.tension, 0.005,
          "N", "static solution in double precision, string without thickness or friction");
}

}  // namespace

void check_wall_coupling(Lines& out) {
  check_contact(out);
  check_string(out);
  check_purse(out);
}

}  // namespace catgut::validation
