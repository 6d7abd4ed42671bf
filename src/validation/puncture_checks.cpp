// SPDX-License-Identifier: Apache-2.0
// validation: the forces of a needle that goes through the wall, as the hand that pushes it feels them.
#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include "physical/physical.h"
#include "validation/checks.h"
#include "validation/knot_scenes.h"

namespace catgut::validation {
namespace {

struct Punctured {
  float entry = 0, exit = 0;  // [N] largest force before the tip went in, and between there and the exit
  float drawn = 0;            // [N] mean while the shaft slides through
  int holes = 0;
};

// A nearly straight needle, 26 mm long, pushed along its axis through a sheet that is held at its border.
Punctured puncture(float speed, float stiffness, int columns, float wire_radius) {
  wall::SheetShape shape;
  shape.width = 0.03f, shape.height = 0.02f, shape.columns = 3 * columns + 1, shape.rows = 2 * columns + 1;
  wall::Spec spec;
  spec.mesh = wall::sheet(shape);
  for (size_t c = 0; c < spec.mesh.held.size(); ++c) {
    const Vec3 p = spec.mesh.outer[c];
    spec.mesh.held[c] = std::abs(p.x - 0.015f) > 0.0149f || std::abs(p.y - 0.01f) > 0.0099f;
  }
  const wall::Wall w = wall::build_wall(spec);
  physical::Model model = physical::make_model(w, knot_settings(0.3f));
  physical::NeedleShape needle;
  needle.radius = 1, needle.arc = 0.026f, needle.wire_radius = wire_radius;
  model.bodies.body = {physical::make_needle_body(needle)};
  model.bodies.body[0].stiffness = stiffness;
  model.needles.needle = {physical::make_needle(needle, 0)};
  const physical::NeedleModel& n = model.needles.needle[0];
  physical::State state;
  state.wall = w.state;
  std::vector<Vec3> path;
  for (int i = 0; i < 10; ++i) path.push_back({0.2f, 0.2f, 0.5e-3f * static_cast<float>(i)});
  state.thread = thread::make_state(path);
  state.bodies.body.resize(1), state.needle.resize(1);
  // The tip points down the z axis, off the mesh's lines.
  Pose pose;
  const float middle = 0.5f * needle.arc;
  const Vec3 tangent = arc_tangent(n, {}, middle);
  const Vec3 z = -tangent, x = {0, 0, 1};
  const Quat turn = from_axes(Vec3{0, 1, 0}, cross(Vec3{0, 0, 1}, Vec3{0, 1, 0}), {0, 0, 1}),
             own = from_axes(x, cross(z, x), z);
  pose.q = normalized(turn * conjugate(own));
  pose.p = Vec3{0.0158f, 0.0107f, 0.0025f} - rotate(pose.q, physical::tip_of(n, {}));
  physical::place_body(model.bodies.body[0], state.bodies.body[0], pose, 0);
  physical::Scratch scratch(model, state);
  Jobs jobs(1);
  std::vector<physical::HandTarget> target(1);
  Punctured out;
  int drawing = 0;
  float way = 0;
  for (int i = 0; i < 40000 && way < 0.018f; ++i) {
    way += speed * model.wall.step;
    pose.p.z -= speed * model.wall.step;
    target[0] = {pose, true};
    physical::Hands hands;
    hands.targets = target;
    physical::step(model, state, scratch, hands, jobs);
    const float felt = -state.bodies.body[0].hand_force.z;
    const uint32_t events = state.needle[0].events;
    out.holes += (events & physical::kEntered) != 0, out.holes += (events & physical::kLeft) != 0;
    if (out.holes == 0 || (events & physical::kEntered)) out.entry = std::max(out.entry, felt);
    else if (out.holes == 1 || (events & physical::kLeft)) {
      // The wall springs back from the entry first.
      if (state.needle[0].exit_row[0] != wall::kNone || state.needle[0].exit_row[1] != wall::kNone)
        if (events & physical::kLeft) out.exit = state.needle[0].exit_peak;
    } else if (way > 0.013f) out.drawn += felt, ++drawing;
  }
  out.drawn /= static_cast<float>(std::max(1, drawing));
  return out;
}

}  // namespace

void check_puncture(Lines& out, bool nightly) {
  const std::string who = "tear/puncture/";
  const physical::PunctureLaw law;
  const double entry = static_cast<double>(law.puncture), leave = entry * static_cast<double>(law.exit_share);
  const auto wide = [](float x) { return static_cast<double>(x); };
  const Punctured slow = puncture(0.005f, 3000, 4, 0.33e-3f), fast = puncture(0.015f, 3000, 4, 0.33e-3f);
  const Punctured soft = puncture(0.015f, 500, 4, 0.33e-3f), thin = puncture(0.015f, 3000, 4, 0.20e-3f);
  out.add(who + "wire 0.66 mm at 5 mm/s, largest force on the hand before it enters", entry, wide(slow.entry), 0.05, "N",
          "the law; independent of speed: Frick et al. 2001");
  out.add(who + "the same at 15 mm/s", entry, wide(fast.entry), 0.05, "N", "as above");
  out.add(who + "the same, a hand of 500 N/m", entry, wide(soft.entry), 0.05, "N", "the tissue's force, not the hand's");
  if (nightly) {
    const Punctured fine = puncture(0.015f, 3000, 8, 0.33e-3f);
    out.add(who + "the same, four times the columns", entry, wide(fine.entry), 0.05, "N", "independent of the mesh");
  }
  out.add(who + "entry within 0.48-1.8 N, 1 for yes", 1, slow.entry > 0.48f && slow.entry < 1.8f ? 1 : 0, 0, "",
          "Maloney et al.: 0.48-1.00 N in skin; colon 1.6-1.8 N a spike, doi 10.1007/s11548-021-02371-8");
  out.add(who + "second peak, where it leaves", leave, wide(slow.exit), 0.05, "N",
          "two peaks: Frick et al. 2001; share assumed");
  out.add(who + "wire 0.40 mm: entry", entry * 0.40 / 0.66, wide(thin.entry), 0.05, "N", "proportional to the diameter");
  out.add(who + "force on the hand while the shaft slides through 2.5 mm", wide(law.friction) * 2.5e-3, wide(slow.drawn), 0.15,
          "N", "friction per length of the law");
  out.add(who + "holes of one passage", 2, slow.holes, 0, "", "one on each face");
}

}  // namespace catgut::validation
