// SPDX-License-Identifier: Apache-2.0
// tests/validation: every line of `catgut validate` holds.
#include "validation/validation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "validation/contact_scenes.h"
#include "validation/swept.h"

namespace catgut {
namespace {

TEST(Validation, every_check_holds) {
  const std::vector<ValidationLine> lines = run_validation();
  EXPECT_GT(lines.size(), 40u);
  for (const ValidationLine& l : lines)
    EXPECT_TRUE(l.ok) << l.name << ": expected " << l.expected << " " << l.unit << ", got " << l.got << ", error " << l.error
                      << " above " << l.tolerance << " (" << l.source << ")";
}

// Random events of `contact` in which something sank in by 0.3 to 3.2 mm: needles that were slowed within a step, thread in a
// pit of four faces and behind its corner, walls in a crease, walls that thread turned inside out, walls, needles and tools
// that landed elsewhere than the thread or a contact foresaw.
TEST(Contact, nothing_sinks_in_where_it_did_before) {
  using namespace validation;
  struct Events {
    ContactBody body;
    std::vector<int> numbers;
    uint64_t seed = 11;
  };
  const Events events[] = {{ContactBody::tube, {201, 326, 387, 1198}},
                           {ContactBody::ends, {473}},
                           {ContactBody::pads, {118, 170, 216, 556, 873, 1449}},
                           {ContactBody::pads, {351}, 12},
                           {ContactBody::pads, {58, 64}, 16},
                           {ContactBody::pads, {180, 232, 318}, 17},
                           {ContactBody::pads, {161, 169, 482}, 18},
                           {ContactBody::pads, {134}, 20},
                           {ContactBody::pads, {34}, 24},
                           {ContactBody::tubes, {488, 1395}},
                           {ContactBody::bowel, {336}}};
  for (const auto& [body, numbers, seed] : events) {
    ContactBench bench(seed, body);
    for (const int number : numbers) {
      bench.events = number / 5 * 5;  // where its group begins, at rest
      while (bench.events <= number) bench.event(8, 1);
      for (int p = 0; p < kContactPairs; ++p) {
        EXPECT_LE(bench.deepest[p], 0.3e-3f) << name_of(body) << " " << number << " " << name_of(static_cast<ContactPair>(p));
        EXPECT_EQ(bench.passed[p], 0) << name_of(body) << " " << number << " " << name_of(static_cast<ContactPair>(p));
      }
    }
  }
}

// The hands of these pairs lead the ends of two pieces across each other. Their numbers in the thread are next to each other.
TEST(Contact, ends_of_two_pieces_do_not_pass_each_other) {
  for (const uint64_t seed : {124u, 424u, 488u}) {
    float nearest = 1;
    EXPECT_EQ(validation::pull_hooked_bights(seed, 8, 1, nearest), 0) << seed;
    EXPECT_GT(nearest, 0.95f) << seed;
  }
}

// The judge of contact/: what a wall goes round is inside, wherever its nearest face looks.
TEST(Contact, a_point_is_inside_a_bent_wall_and_not_beside_it) {
  using namespace validation;
  const ContactBench bench(11, ContactBody::pads);
  const physical::Model& m = bench.model;
  Skin skin(m, bench.rest.wall);
  wall::State bent = bench.rest.wall;
  const auto expect_sound = [&](const wall::State& s, const char* how) {
    skin.follow(m, s);
    for (uint32_t f = 0; f < m.wall.mesh.face.size(); ++f) {
      const auto& corners = m.wall.mesh.face[f];
      if (std::any_of(corners.begin(), corners.end(), [&](uint32_t c) { return c != wall::kNone && m.wall.mesh.held[c]; }))
        continue;  // beside the open end
      wall::Point p{f, 0.3f, 0.3f, 0};
      const auto at = [&](float zeta) {
        p.zeta = zeta;
        return wall::place(wall::weights(m.wall, s.topology, p), s.motion);
      };
      for (const float zeta : {-0.95f, -0.5f, 0.0f, 0.5f, 0.95f}) EXPECT_TRUE(skin.inside(at(zeta))) << how << f << " " << zeta;
      for (const float zeta : {-1.05f, -1.5f, 1.05f, 1.5f}) EXPECT_FALSE(skin.inside(at(zeta))) << how << f << " " << zeta;
    }
  };
  expect_sound(bent, "at rest ");
  // Round a cylinder of 12 mm across z: directors turn along.
  const float radius = 0.012f;
  for (uint32_t c = 0; c < wall::columns(bent); ++c) {
    const Vec3 at = wall::vec3(bent.motion.x[2 * c]), d = wall::vec3(bent.motion.x[2 * c + 1]);
    const float a = at.z / radius, sine = std::sin(a), cosine = std::cos(a), out = radius + at.y;
    bent.motion.x[2 * c] = wall::float4({at.x, out * cosine - radius, out * sine});
    bent.motion.x[2 * c + 1] = wall::float4({d.x, d.y * cosine - d.z * sine, d.y * sine + d.z * cosine});
  }
  expect_sound(bent, "bent ");
}

// Four faces meet in a pit whose corner is a saddle: beside it a point may be in front of one of them and yet inside.
TEST(Contact, the_sum_of_normals_says_that_a_point_at_a_corner_is_inside) {
  using namespace validation;
  const ContactBench bench(11, ContactBody::tube);
  const physical::Model& m = bench.model;
  Skin skin(m, bench.rest.wall);
  Random random(5);
  int settled = 0, right = 0;
  for (int bend = 0; bend < 80; ++bend) {
    wall::State bent = bench.rest.wall;
    const auto& faces = m.wall.mesh.face;
    const uint32_t c = faces[static_cast<size_t>(random.uniform() * 200) + 40][0];
    if (m.wall.mesh.held[c]) continue;
    const auto any = [&](float most) {
      return Vec3{2 * random.uniform() - 1, 2 * random.uniform() - 1, 2 * random.uniform() - 1} * most;
    };
    const auto shift = [&](uint32_t column, Vec3 by) {
      bent.motion.x[2 * column] = wall::float4(wall::vec3(bent.motion.x[2 * column]) + by);
    };
    for (const auto& f : faces)
      for (size_t k = 0; k < 4; ++k)
        if (f[k] == c) shift(f[(k + 1) % 4], any(2.0e-3f)), shift(f[(k + 3) % 4], any(2.0e-3f));
    shift(c, normalized(wall::vec3(bent.motion.x[2 * c + 1])) * -1e-3f);
    skin.follow(m, bent);
    const Vec3 corner = wall::outer(bent, c);
    for (int i = 0; i < 200; ++i) {
      const Vec3 p = corner + any(0.3e-3f);
      physical::NearestFoot nearest;
      for (uint32_t q = 0; q < m.surface.patch.size(); ++q) nearest.offer(nearest_on_patch(m.wall, bent, m.surface, q, p), p);
      const float alone = nearest.best.gap;
      nearest.settle_side(m.wall, bent, m.surface, p);
      if (alone < 0 || nearest.best.gap > 0) continue;
      ++settled, right += skin.inside(p);
    }
  }
  EXPECT_GT(settled, 20);
  EXPECT_EQ(right, settled);
}

// The judge of knot/names can say no: one strand moves through another, or past its end, or touches it and turns back.
TEST(Validation, a_strand_that_passes_through_another_is_counted) {
  using validation::Place;
  std::vector<Place> before(6), after;
  const std::vector<uint8_t> broken{0, 0, 1, 0, 0};
  for (size_t i = 0; i < 3; ++i) {
    const double x = 1e-3 * (static_cast<double>(i) - 0.7);
    before[i] = {x, 0, 0}, before[3 + i] = {0, x, 0.2e-3};
  }
  after = before;
  for (size_t i = 3; i < 6; ++i) after[i].z = -0.2e-3;
  EXPECT_EQ(validation::count_passes(before, after, broken), 1);
  EXPECT_EQ(validation::count_passes(after, before, broken), 1);
  for (size_t i = 3; i < 6; ++i) after[i].z = 0.01e-3;
  EXPECT_EQ(validation::count_passes(before, after, broken), 0);
  for (size_t i = 3; i < 6; ++i) before[i].x = after[i].x = 2e-3, after[i].z = -0.2e-3;
  EXPECT_EQ(validation::count_passes(before, after, broken), 0);
}

}  // namespace
}  // namespace catgut
