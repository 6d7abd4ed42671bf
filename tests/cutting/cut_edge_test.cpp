// SPDX-License-Identifier: Apache-2.0
// tests/cutting: bites near an edge that a cut has made. A tube is cut all round; a bite below the cut is drawn out over the
// cut edge. The force and the slit are compared with those of a tube whose end lies where the other was cut.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "validation/suture_scenes.h"
#include "wall/laminate.h"

namespace catgut::validation {
namespace {

constexpr float kBeyond = 0.0083f;  // [m] of tube that is cut off; the cut passes within faces

wall::Wall tube_of(float length, int rings) {
  wall::TubeShape shape;
  shape.around = 24, shape.rings = rings, shape.length = length;
  wall::Spec spec;
  spec.mesh = wall::tube(shape);
  spec.layer = wall::bowel_layers(0.0025f, 6e5f, 6e5f, 0.45f);
  spec.drag = 20;
  return wall::build_wall(spec);
}

// All links of the wall that join cells above and below `z` at rest.
std::vector<wall::Mark> all_round(const wall::Model& m, float z) {
  std::vector<wall::Mark> marks;
  wall::Point from, first;
  const auto at = [&](float angle) {
    wall::Wall w;
    w.model = m;
    const float r = 0.5f * (0.0175f + 0.02f);
    wall::Point best;
    float least = 1;
    for (uint32_t face = 0; face < m.mesh.face.size(); ++face)
      for (float xi = -0.9375f; xi < 1; xi += 0.125f)
        for (float eta = -0.9375f; eta < 1; eta += 0.125f) {
          const wall::Point p{face, xi, eta, 0};
          const float far = distance(wall::rest_place(m, p), {r * portable::cos(angle), r * portable::sin(angle), z});
          if (far < least) least = far, best = p;
        }
    EXPECT_LT(least, 0.4e-3f);
    return best;
  };
  constexpr int kParts = 72;
  for (int i = 0; i <= kParts; ++i) {
    const wall::Point next = i == kParts ? first : at(2 * kPi * static_cast<float>(i) / kParts);
    if (i == 0) first = next;
    else EXPECT_TRUE(wall::trace(m, from, next, marks));
    from = next;
  }
  return marks;
}

struct Drawn {
  float peak = 0;  // [N] of both hands
  float torn = 0;  // [m]
  bool out = false;
};

// A bite `bite` below an edge at z = `edge`, drawn out along the axis.
Drawn draw_out(const wall::Wall& w, float edge, float bite) {
  Sewn s;
  s.model = physical::make_model(w, knot_settings(0.2f));
  s.state.wall = w.state;
  std::vector<Stop> course{{}};
  for (const bool first : {true, false}) {
    physical::Hole hole = hole_at(w, {first ? 0.02f : 0.0175f, 0, edge - bite}, first ? 1.0f : -1.0f);
    hole.within = first;
    course.push_back({mouth(s.model, s.state, hole), static_cast<int32_t>(s.state.hole.size())});
    s.state.hole.push_back(hole);
  }
  const float tail = bite + kBeyond + 0.012f;
  course[0].at = course[1].at + Vec3{0.004f, 0, tail};
  course.push_back({course[2].at + Vec3{-0.004f, 0, tail}});
  s.state.thread = lay_course(course, 0.5e-3f, 0.1f);
  s.start();
  if (edge < 0) {
    physical::cut(s.model, s.state, *s.scratch, all_round(s.model.wall, edge));
    EXPECT_EQ(wall::count_pieces(s.state.wall), 2u);
    // The specimen is carried away.
    for (uint32_t c = 0; c < wall::columns(s.state.wall); ++c)
      if (physical::surface_of(s.model, s.state).piece[c] == physical::surface_of(s.model, s.state).piece[0])
        s.state.wall.motion.x[2 * c].z += 0.2f;
  }
  for (thread::Hold& h : s.hold) h.stiffness = 2000;
  Drawn out;
  for (int i = 0; i < 1500 && !s.state.hole[0].out; ++i) {
    const Vec3 to[2] = {s.hold[0].to + Vec3{0, 0, 25e-6f}, s.hold[1].to + Vec3{0, 0, 25e-6f}};
    s.move_holds(to, 0.001f);
    out.peak = std::max(out.peak, s.hold[0].force.z + s.hold[1].force.z);
  }
  out.torn = s.state.hole[0].torn, out.out = s.state.hole[0].out;
  return out;
}

TEST(CutEdge, a_bite_near_it_pulls_out_by_the_same_law_as_near_a_rim) {
  const wall::Wall plain = tube_of(0.025f, 8), longer = tube_of(0.025f + kBeyond, 11);
  for (const float bite : {0.0025f, 0.0012f}) {
    const Drawn rim = draw_out(plain, 0, bite), cut = draw_out(longer, -kBeyond, bite);
    std::printf("bite %.1f mm from the edge: %.2f N at a rim, %.2f N at a cut edge; torn %.2f and %.2f mm\n",
                static_cast<double>(1e3f * bite), static_cast<double>(rim.peak), static_cast<double>(cut.peak),
                static_cast<double>(1e3f * rim.torn), static_cast<double>(1e3f * cut.torn));
    EXPECT_TRUE(rim.out && cut.out);
    EXPECT_NEAR(cut.peak / rim.peak, 1, 0.15f);
    EXPECT_NEAR(cut.torn, rim.torn, 0.4e-3f);
  }
}

}  // namespace
}  // namespace catgut::validation
