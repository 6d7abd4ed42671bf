// SPDX-License-Identifier: Apache-2.0
// validation: the list of checks and the small worlds they run in.
#include "validation/validation.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "core/check.h"
#include "validation/checks.h"

namespace catgut {
namespace validation {

void Lines::add(const std::string& name, double expected, double got, double tolerance, const std::string& unit,
                const std::string& source) {
  ValidationLine l{name, expected, got, 0, tolerance, unit, source, false};
  l.error = expected != 0 ? std::abs(got - expected) / std::abs(expected) : std::abs(got);
  l.ok = std::isfinite(got) && l.error <= tolerance;
  line.push_back(l);
  if (on_line) on_line(l);
}

ThreadRig::ThreadRig(std::span<const Vec3> position, float spacing, float mass, bool hold_last) {
  const uint32_t n = static_cast<uint32_t>(position.size());
  model.count = n;
  model.spacing = spacing;
  model.inv_mass = 1 / mass;
  model.bend_sweeps = 0;
  body_model.resize(2);
  body.resize(2);
  for (uint32_t i = 0; i < n; ++i) {
    thread.order.push_back(i);
    x.push_back(point(position[i]));
    inv_mass.push_back(1 / mass);
  }
  v.assign(n, {});
  prev = x;
  thread.rest.assign(n - 1, spacing);
  thread.tension.assign(n - 1, 0);
  thread.cut.assign(n - 1, 0);
  thread.hold.push_back({0, 0, {}});
  body[0].x = position[0];
  if (hold_last) thread.hold.push_back({n - 1, 1, {}});
  body[1].x = position[n - 1];
  scratch.resize(n);
}

void ThreadRig::step(float h) {
  std::fill(scratch.lambda.begin(), scratch.lambda.end(), 0.0f);
  prev = x;
  for (size_t i = 0; i < x.size(); ++i) add(x[i], (xyz(v[i]) + model.gravity * h) * h);
  for (const ThreadHold& hold : thread.hold) x[hold.slot] = prev[hold.slot];
  solve_thread(model, thread, scratch, x.data(), prev.data(), inv_mass.data(), body_model, body, h);
  const float keep = 1 / (h * (1 + damping * h));
  for (size_t i = 0; i < x.size(); ++i) set(v[i], (xyz(x[i]) - xyz(prev[i])) * keep);
}

TissueWorld::TissueWorld(std::span<const Vec3> rest, std::span<const float> mass,
                         std::span<const std::vector<uint32_t>> cluster) {
  model.tissue = model.count = static_cast<uint32_t>(rest.size());
  for (float m : mass) model.inv_mass.push_back(1 / m);
  model.shape = make_shape_model(rest, mass, cluster);
  model.body.resize(3);  // the two tools and the needle, fixed and far away: never candidates for contact
  model.gravity = model.tissue_gravity = {};
  model.shape_relaxation = 1;
}

void TissueWorld::start(std::span<const Vec3> position) {
  state = make_solver_state(model, position);
  prepare_scratch(model, scratch);
}

void TissueWorld::run(double seconds, Jobs& jobs) {
  const int steps = static_cast<int>(std::lround(seconds / model.h));
  for (int i = 0; i < steps; ++i) substep(model, state, scratch, jobs, nullptr);
}

Block make_block(int n, float spacing) {
  Block b;
  b.n = n;
  const float middle = 0.5f * static_cast<float>(n - 1);
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i)
        b.position.push_back(
            Vec3{static_cast<float>(i) - middle, static_cast<float>(j) - middle, static_cast<float>(k) - middle} * spacing);
  b.cluster.resize(1);
  for (uint32_t i = 0; i < b.position.size(); ++i) b.cluster[0].push_back(i);
  for (int k = 0; k + 1 < n; ++k)
    for (int j = 0; j + 1 < n; ++j)
      for (int i = 0; i + 1 < n; ++i) {
        auto at = [&](int c) { return b.at(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2 & 1)); };
        const int even[5][4] = {{0, 1, 2, 4}, {3, 1, 2, 7}, {5, 1, 4, 7}, {6, 2, 4, 7}, {1, 2, 4, 7}};
        for (const auto& e : even) {
          Tet t;
          for (size_t c = 0; c < 4; ++c) t[c] = at((i + j + k) % 2 == 0 ? e[c] : e[c] ^ 1);
          if (tet_volume(b.position[t[0]], b.position[t[1]], b.position[t[2]], b.position[t[3]]) < 0) std::swap(t[2], t[3]);
          b.tet.push_back(t);
        }
      }
  return b;
}

}  // namespace validation

std::vector<ValidationLine> run_validation(const std::function<void(const ValidationLine&)>& on_line, bool nightly,
                                           const std::string& only) {
  namespace v = validation;
  struct Group {
    const char* name;
    void (*run)(v::Lines& out, bool nightly);
  };
  const Group groups[] = {
      {"solver/thread",
       [](v::Lines& out, bool) { v::check_oscillator(out), v::check_hanging_chain(out), v::check_catenary(out); }},
      {"solver/tissue",
       [](v::Lines& out, bool) {
         v::check_bending(out), v::check_stiffness(out), v::check_momentum(out), v::check_rotation(out), v::check_volume(out);
       }},
      {"wall", [](v::Lines& out, bool) { v::check_wall(out); }},
      {"capstan", v::check_capstan},
      {"knot/overhand", v::check_overhand},
      {"knot/holding", v::check_holding},
      {"knot/shaking", v::check_shaking},
      {"knot/locking", [](v::Lines& out, bool all) { all ? v::check_locking(out) : void(); }},
      {"knot/names", v::check_names},
      {"knot/ties", v::check_ties},
      {"contact", v::check_contacts},
      {"tear/puncture", v::check_puncture},
      {"closure/eyelet", v::check_eyelets},
      {"closure/surface", v::check_lying},
      {"closure/interrupted", v::check_interrupted},
      {"closure/purse-string", [](v::Lines& out, bool all) { all ? v::check_purse_string(out) : void(); }},
      {"tear", v::check_tear},
      {"cut/paths", v::check_cuts},
      {"cut/pen", [](v::Lines& out, bool) { v::check_pen(out); }},
  };
  v::Lines lines;
  lines.on_line = on_line;
  bool any = false;
  std::string names;
  for (const Group& g : groups) {
    names += std::string(names.empty() ? "" : ", ") + g.name;
    if (std::string_view(g.name).substr(0, only.size()) != only) continue;
    any = true;
    g.run(lines, nightly);
  }
  if (!any) throw InputError("--only " + only, "no group of checks begins so", "give one of: " + names);
  return lines.line;
}

}  // namespace catgut
