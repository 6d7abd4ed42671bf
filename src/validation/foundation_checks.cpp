// SPDX-License-Identifier: Apache-2.0
// validation: a sheet of the wall on an elastic bed (wall::Mesh::foundation), compared with closed forms.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "validation/checks.h"
#include "validation/wall_rig.h"
#include "wall/wall.h"

namespace catgut::validation {

namespace {

using wall::Wall;

// A free sheet on an elastic bed: how far its middle sinks.
struct OnBed {
  double pressed = 0, line = 0;  // [m] under a pressure, under a force on a line across its middle
};
constexpr double kBed = 1e6, kPressure = 500, kLineForce = 0.2;  // [Pa/m], [Pa], [N]
constexpr double kSheet = 0.08;                                  // [m] of each side

OnBed on_bed(int columns, float step) {
  wall::Spec s;
  wall::SheetShape shape;
  shape.width = shape.height = static_cast<float>(kSheet);
  shape.thickness = 0.0015f, shape.columns = shape.rows = columns;
  s.mesh = wall::sheet(shape);
  s.mesh.foundation.assign(s.mesh.outer.size(), static_cast<float>(kBed));
  s.layer.front().thickness = shape.thickness, s.layer.front().poisson = 0;
  s.step = step, s.drag = 20;
  const Wall w = wall::build_wall(s);
  const uint32_t n = static_cast<uint32_t>(columns), half = n / 2, center = half * n + half;
  const auto depth = [&](const std::vector<Vec3>& f) {
    Wall q = w;
    settle(q, f, 0.6);
    return static_cast<double>(rest_middle(q, center).z - middle(q, center).z);
  };
  std::vector<Vec3> pressed(2 * w.model.mesh.outer.size()), line = pressed;
  float across = 0;  // mass of the middle column of nodes
  for (uint32_t j = 0; j < n; ++j) across += w.state.topology.mass[j * n + half];
  for (uint32_t c = 0; c < n * n; ++c) {
    const double area = static_cast<double>(w.state.topology.mass[c]) / (1050.0 * static_cast<double>(shape.thickness));
    pressed[2 * c].z = static_cast<float>(-kPressure * area);
    if (c % n == half) line[2 * c].z = static_cast<float>(-kLineForce) * w.state.topology.mass[c] / across;
  }
  return {depth(pressed), depth(line)};
}

}  // namespace

void check_foundation(Lines& out) {
  const double d = 6e5 * 0.0015 * 0.0015 * 0.0015 / 12, lambda = std::pow(kBed / (4 * d), 0.25);
  const double line = kLineForce / kSheet * lambda / (2 * kBed);
  OnBed got[5];
  for (int k = 0; k < 5; ++k) {
    const int substeps = k < 4 ? 8 << k : 16, columns = k < 4 ? 33 : 65;
    got[k] = on_bed(columns, kTick / static_cast<float>(substeps));
    const std::string name = std::to_string(2 * columns * columns) + " nodes, " + std::to_string(substeps) + " substeps a tick";
    out.add("modulus/foundation/pressure, " + name, kPressure / kBed, got[k].pressed, 1e-3, "m", "Winkler's bed: p / k");
    out.add("modulus/foundation/force on a line, " + name, line, got[k].line, 0.05, "m",
            "an infinite beam on an elastic foundation, Hetenyi 1946");
  }
  const auto by_depth = [](const OnBed& a, const OnBed& b) { return a.line < b.line; };
  const auto [low, high] = std::minmax_element(got, got + 4, by_depth);
  out.add("modulus/foundation/force on a line, spread over 8 to 64 substeps", 0, high->line / low->line - 1, 1e-3, "",
          "a rest");
}

}  // namespace catgut::validation
