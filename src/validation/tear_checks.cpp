// SPDX-License-Identifier: Apache-2.0
// validation: bites that tear out, and threads that break, against published forces. What is measured is the force on the
// hands, and what is left in the wall.
#include <algorithm>
#include <cmath>
#include <string>

#include "validation/checks.h"
#include "validation/suture_scenes.h"

namespace catgut::validation {
namespace {

double wide(float x) { return static_cast<double>(x); }

struct TearOut {
  float peak = 0;  // [N] of both hands together
  float torn = 0;  // [m]
  bool out = false;
  float left = 0;  // [m] how far the wall is from its rest 1 s after the hands are away
};

// One bite through the wall of a tube, `bite` from its edge; both ends of the thread are drawn away from it along the axis with
// `speed`, up to `way`. same_face: in and out on the outer face, `deepest` within the wall.
TearOut draw_out(float bite, int around, int rings, float way, bool same_face = false, float deepest = 0) {
  wall::TubeShape shape;
  shape.around = around, shape.rings = rings, shape.length = 0.025f;
  wall::Spec spec;
  spec.mesh = wall::tube(shape);
  spec.layer = wall::bowel_layers(0.0025f, 6e5f, 6e5f, 0.45f);
  spec.drag = 20;
  const wall::Wall w = wall::build_wall(spec);
  Sewn s;
  s.model = physical::make_model(w, knot_settings(0.2f));
  s.state.wall = w.state;
  const float in = 0.0175f, outside = 0.02f;
  std::vector<Stop> course{{}};
  for (const bool first : {true, false}) {
    const float r = first || same_face ? outside : in, y = same_face ? (first ? -0.0015f : 0.0015f) : 0.0f;
    physical::Hole hole = hole_at(w, {std::sqrt(r * r - y * y), y, -bite}, first || same_face ? 1.0f : -1.0f);
    hole.within = first;
    if (same_face) hole.deepest = deepest;
    course.push_back({mouth(s.model, s.state, hole), static_cast<int32_t>(s.state.hole.size())});
    s.state.hole.push_back(hole);
  }
  const float tail = bite + 0.01f;
  course[0].at = course[1].at + Vec3{0.002f, 0, tail};
  course.push_back({course[2].at + Vec3{same_face ? 0.002f : -0.002f, 0, tail}});
  s.state.thread = lay_course(course, 0.5e-3f, 0.1f);
  s.start();
  for (thread::Hold& h : s.hold) h.stiffness = 2000;
  const std::vector<wall::Float4> rest(s.state.wall.motion.x.begin(), s.state.wall.motion.x.end());
  TearOut out;
  const int parts = static_cast<int>(std::lround(way / 15e-6f));  // a millisecond each, 15 mm/s
  for (int i = 0; i < parts && !s.state.hole[0].out; ++i) {
    const Vec3 to[2] = {s.hold[0].to + Vec3{0, 0, 15e-6f}, s.hold[1].to + Vec3{0, 0, 15e-6f}};
    s.move_holds(to, 0.001f);
    out.peak = std::max(out.peak, s.hold[0].force.z + s.hold[1].force.z);
  }
  out.torn = s.state.hole[0].torn, out.out = s.state.hole[0].out;
  s.hold.clear();
  if (out.out) {
    remove_thread(s);
    s.run(1);
    for (size_t i = 0; i < rest.size(); ++i)
      out.left = std::max(out.left, distance(wall::vec3(rest[i]), wall::vec3(s.state.wall.motion.x[i])));
  }
  return out;
}

}  // namespace

void check_tear(Lines& out, bool nightly) {
  const std::string gong = "Gong et al. 2023: 4.62 +- 1.40 N, human small bowel, 803 tests";
  const TearOut deep = draw_out(6e-3f, 24, 8, 0.06f);
  out.add("tear/full-thickness bite 6 mm from the edge: force on the hands when it tears", 4.62, wide(deep.peak), 0.3, "N",
          gong);
  out.add("tear/the same: comes out, 1 for yes", 1, deep.out ? 1 : 0, 0, "", "drawn on beyond its strength");
  out.add("tear/the same: length of the slit", 6e-3, wide(deep.torn), 0.1, "m", "the way from the bite to the edge");
  out.add("tear/the same, thread away: distance of the wall from its rest", 0, wide(deep.left), 0.1e-3, "m", "elastic");
  const TearOut near = draw_out(2.5e-3f, 24, 8, 0.06f);
  out.add("tear/2.5 mm from the edge, part of the force at 6 mm", 0.5, wide(near.peak / deep.peak), 0.1, "",
          "in proportion up to 5 mm (assumption)");
  const TearOut muscle = draw_out(6e-3f, 24, 8, 0.06f, true, 0.0f), all = draw_out(6e-3f, 24, 8, 0.06f, true, -1.0f);
  out.add("tear/bite in and out on the outer face, serosa and muscle only, part of the force through all layers", 0.525,
          wide(muscle.peak / all.peak), 0.2, "",
          "layers carry by their stiffness (assumption); the thread also presses on the wall");
  if (nightly) {
    const TearOut fine = draw_out(6e-3f, 48, 16, 0.06f);
    out.add("tear/four times the elements: force", wide(deep.peak), wide(fine.peak), 0.05, "N",
            "the material's, not the mesh's");
  }
}

}  // namespace catgut::validation
