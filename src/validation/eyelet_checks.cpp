// SPDX-License-Identifier: Apache-2.0
// validation: the thread in holes of the wall: closing force against a static solution, friction against Euler-Eytelwein.
#include <algorithm>
#include <cmath>
#include <string>

#include "validation/checks.h"
#include "validation/suture_scenes.h"
#include "validation/wall_static.h"

namespace catgut::validation {
namespace {

double wide(float x) { return static_cast<double>(x); }
Eigen::Vector3d wide(Vec3 p) { return {wide(p.x), wide(p.y), wide(p.z)}; }

// Two tubes 8 mm apart, four holes 4 mm from their edges, both ends of the thread drawn by `drawn`.
void check_closing(Lines& out, float drawn, float wall_step, float substep) {
  const wall::Wall w = two_tubes(0.008f, 24, 8, wall_step);
  Sewn sewn;
  sewn.model = physical::make_model(w, knot_settings(0.2f));
  sewn.model.surface_contact = sewn.model.lip_contact = false;  // the holes are points of the mid-surface
  sewn.model.thread.substep = substep;
  sewn.model.thread.substeps = static_cast<int>(std::lround(wall_step / substep));
  sewn.state.wall = w.state;
  std::vector<wall::Weights> through;
  std::vector<Stop> course{{}};
  for (const auto& [z, y] : {std::pair{0.008f, 0.002f}, {0.008f, -0.002f}, {-0.008f, -0.002f}, {-0.008f, 0.002f}}) {
    const physical::Hole hole = hole_at(w, {0.01865f, y, z}, 0);
    through.push_back(wall::weights(w.model, w.state.topology, hole.place));
    course.push_back({mouth(sewn.model, sewn.state, hole), static_cast<int32_t>(sewn.state.hole.size())});
    sewn.state.hole.push_back(hole);
  }
  course[0].at = course[1].at + Vec3{0, 0.03f, 0};
  course.push_back({course[4].at + Vec3{0, 0.03f, 0}});
  sewn.state.thread = lay_course(course, 0.5e-3f, 0);
  sewn.start();
  const Vec3 end[2] = {sewn.hold[0].to, sewn.hold[1].to};
  const Vec3 drawn_to[2] = {end[0] + normalized(end[0] - course[1].at) * drawn,
                            end[1] + normalized(end[1] - course[4].at) * drawn};

  StaticWall still(w);
  StaticString string{through, {}};
  for (const float rest : sewn.state.thread.rest) string.length += wide(rest);
  string.stiffness = wide(sewn.model.thread.material.axial_stiffness) / string.length;
  for (int i = 1; i <= 7; ++i) {
    string.end = {wide(lerp(end[0], drawn_to[0], static_cast<float>(i) / 7)),
                  wide(lerp(end[1], drawn_to[1], static_cast<float>(i) / 7))};
    still.solve({}, {string}, string.length, 1);
  }
  const double tension = still.tension(string), closed = 0.016 - (still.at(through[0]).z() - still.at(through[3]).z());

  sewn.move_holds(drawn_to, 1);
  sewn.run(1);
  const auto z = [&](size_t i) { return wide(mouth(sewn.model, sewn.state, sewn.state.hole[i]).z); };
  const thread::State& t = sewn.state.thread;
  const double middle = wide(t.tension[(t.eyelet[1].segment + t.eyelet[2].segment) / 2]);
  const std::string name = "closure/eyelet/four holes, drawn " + std::to_string(std::lround(1e3f * drawn)) + " mm, wall at " +
                           std::to_string(std::lround(1e6f * wall_step)) + " us, thread at " +
                           std::to_string(std::lround(1e6f * substep)) + " us, ";
  const std::string source = "static solution in double precision, frictionless string of the same stiffness";
  out.add(name + "tension between the tubes", tension, middle, 0.005, "N", source);
  out.add(name + "closing of the gap", closed, 0.016 - (z(0) - z(3)), 0.005, "m", source);
}

// A thread in and out of a tube's wall; one end is pulled with a constant force, the other is drawn away, then let back.
void check_friction(Lines& out, int holes, float mu, float tension) {
  wall::TubeShape shape;
  shape.around = 24, shape.rings = 8, shape.length = 0.025f;
  wall::Spec spec;
  spec.mesh = wall::tube(shape);
  spec.drag = 20;
  const wall::Wall w = wall::build_wall(spec);
  Sewn sewn;
  sewn.model = physical::make_model(w, knot_settings(0.2f));
  sewn.model.surface_contact = sewn.model.lip_contact = false;
  sewn.state.wall = w.state;
  // Through the wall, 6 mm along its other face, back: a hole for each mouth of a channel.
  std::vector<Stop> course{{}};
  for (int i = 0; i < holes; ++i) {
    const float z = -0.004f - 0.006f * static_cast<float>(i / 2), side = i % 4 == 0 || i % 4 == 3 ? 1.0f : -1.0f;
    const physical::Hole hole = hole_at(w, {0.01875f + 0.00125f * side, 0, z}, side);
    course.push_back({mouth(sewn.model, sewn.state, hole), i});
    sewn.state.hole.push_back(hole);
  }
  course[0].at = course[1].at + Vec3{0.005f, 0, 0.03f};
  const Vec3 last = course.back().at;
  course.push_back({last + (holes == 1 ? Vec3{-0.03f, 0, 0} : Vec3{-0.005f, 0, -0.02f})});
  sewn.state.thread = lay_course(course, 0.5e-3f, mu);
  sewn.start();
  const Vec3 out_way = normalized(course[0].at - course[1].at), far_way = normalized(course.back().at - last);
  sewn.pull = {{sewn.hold[1].node, far_way * tension}};
  sewn.hold.resize(1);
  const Vec3 start = sewn.hold[0].to;
  const auto measure = [&](Vec3 to, float seconds) {
    // Log of the ratio of the mean tensions, and the mean turning, while it slides.
    const int parts = 200;
    double near = 0, far = 0, angle = 0;
    const Vec3 from = sewn.hold[0].to;
    for (int i = 1; i <= parts; ++i) {
      const Vec3 there = lerp(from, to, static_cast<float>(i) / parts);
      sewn.move_holds({&there, 1}, seconds / parts);
      if (i <= parts / 2) continue;  // slip and the wall have settled
      const thread::State& t = sewn.state.thread;
      near += wide(t.tension[5]), far += wide(t.tension[t.segments() - 6]);
      for (const thread::Eyelet& e : t.eyelet) angle += wide(e.angle);
    }
    const double n = parts - parts / 2;
    return std::pair{std::log(near / far), angle / n};
  };
  sewn.run(0.3f);
  const auto [drawn, angle] = measure(start + out_way * 12e-3f, 1.2f);
  const auto [back, angle_back] = measure(start, 1.2f);
  const std::string name = "closure/eyelet/" + std::to_string(holes) + (holes == 1 ? " hole" : " holes") + ", friction " +
                           std::to_string(mu).substr(0, 3) + ", " + std::to_string(tension).substr(0, 4) + " N, ";
  const double tolerance = holes == 1 ? 0.02 : 0.05;
  out.add(name + "drawn: log of the tensions' ratio", wide(mu) * angle, drawn, tolerance, "", "Euler-Eytelwein");
  out.add(name + "let back", -wide(mu) * angle_back, back, tolerance, "", "Euler-Eytelwein");
}

}  // namespace

void check_eyelets(Lines& out, bool nightly) {
  check_closing(out, 0.004f, 0.001f, 50e-6f);
  check_closing(out, 0.007f, 0.001f, 50e-6f);
  if (nightly)
    for (const float drawn : {0.002f, 0.004f, 0.007f})
      for (const float wall_step : {0.001f, 0.0005f})
        for (const float substep : {25e-6f, 50e-6f, 100e-6f})
          if (wall_step == 0.001f || substep < 100e-6f) check_closing(out, drawn, wall_step, substep);
  for (const int holes : {1, 6})
    for (const float mu : {0.1f, 0.2f, 0.3f, 0.4f})
      if (nightly || mu == 0.2f) check_friction(out, holes, mu, holes == 1 ? 1.0f : 2 * std::exp(-mu * 8));
}

}  // namespace catgut::validation
