// SPDX-License-Identifier: Apache-2.0
#include "anatomy/bowel.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numeric>

#include "body_checks.h"
#include "core/check.h"
#include "geometry/polygon.h"

namespace catgut {
namespace {

BowelShape shape_with(int particles) {
  BowelShape shape;
  shape.particles = particles;
  return shape;
}

TEST(Bowel, HasExactlyTheParticlesAsked) {
  for (const int n : {200, 401, 1185, 1228, 4054}) {
    SCOPED_TRACE(n);
    const BodyRest body = make_bowel(shape_with(n));
    expect_sound(body, static_cast<size_t>(n));
    EXPECT_EQ(euler_characteristic(body.surface), 0);  // a tube with a wall is a torus
    EXPECT_EQ(body.rim.size(), 2u);
    const double mass = std::accumulate(body.mass.begin(), body.mass.end(), 0.0);
    EXPECT_NEAR(mass, 1050 * total_tet_volume(body), 1e-4 * mass);
  }
}

TEST(Bowel, WallHasTheVolumeOfTheTube) {
  for (const int n : {401, 1185, 1228, 4054}) {
    BowelShape shape = shape_with(n);
    shape.haustra = 0;
    const BodyRest body = make_bowel(shape);
    const double smooth = 3.14159265 * (0.02 * 0.02 - 0.0175 * 0.0175) * 0.07;
    // A ring of 16 is a coarse polygon, 2.6 % smaller than its circle.
    EXPECT_NEAR(total_tet_volume(body), smooth, (n > 1000 ? 0.02 : 0.03) * smooth);
  }
}

TEST(Bowel, RimIsTheCircleOfTheSpecification) {
  BowelShape shape;
  shape.position = {0.01f, 0.3f, -0.2f};
  shape.axis = {1, 2, 0.5f};
  const BodyRest body = make_bowel(shape);
  expect_sound(body, 1228);
  const auto loop = points(body, body.rim[0].outer);
  EXPECT_NEAR(loop_length(loop), 0.126, 0.001);
  EXPECT_NEAR(distance(loop_center(loop), shape.position), 0, 1e-5);
  EXPECT_NEAR(dot(loop_normal(loop), normalized(shape.axis)), 1, 1e-5);
  EXPECT_NEAR(dot(loop_normal(points(body, body.rim[1].outer)), normalized(shape.axis)), -1, 1e-5);
  for (size_t i = 0; i < loop.size(); ++i) {
    EXPECT_NEAR(distance(loop[i], loop[(i + 1) % loop.size()]), distance(loop[0], loop[1]), 1e-5);
    EXPECT_NEAR(distance(body.position[body.rim[0].inner[i]], loop[i]), 0.0025, 1e-5);
  }
}

TEST(Bowel, ParticlesAreEvenlySpaced) {
  for (const int n : {401, 1185, 1228, 4054}) {
    const BodyRest body = make_bowel(shape_with(n));
    double sum = 0, low = 1, high = 0;
    size_t count = 0;
    int worst_valence = 6;
    for (uint32_t v = 0; v + 1 < body.position.size(); v += 2) {  // outer side
      int valence = 0;
      for (const uint32_t m : body.cluster[v]) {
        if (m == v || m % 2 == 1) continue;
        const double d = distance(body.position[v], body.position[m]);
        sum += d, ++count, low = std::min(low, d), high = std::max(high, d), ++valence;
      }
      worst_valence = std::max(worst_valence, valence);
    }
    const double mean = sum / static_cast<double>(count);
    std::printf("%d particles: spacing mean %.2f mm, %.2f..%.2f, largest valence %d, rim %zu\n", n, 1e3 * mean, 1e3 * low,
                1e3 * high, worst_valence, body.rim[0].outer.size());
    EXPECT_GT(low, 0.75 * mean);
    EXPECT_LT(high, 1.35 * mean);
    EXPECT_LE(worst_valence, 7);
  }
}

TEST(Bowel, ClusterLinksGoBothWays) {
  const BodyRest body = make_bowel(shape_with(1228));
  size_t one_way = 0;
  for (uint32_t c = 0; c < body.cluster.size(); ++c) {
    for (const uint32_t m : body.cluster[c]) {
      const auto& back = body.cluster[m];
      one_way += std::find(back.begin(), back.end(), c) == back.end();
    }
  }
  EXPECT_EQ(one_way, 0u);
}

TEST(Bowel, ClosedEndsClose) {
  for (const bool near : {false, true}) {
    for (const bool far : {false, true}) {
      SCOPED_TRACE(2 * near + far);
      BowelShape shape = shape_with(1185);
      shape.closed_end = near;
      shape.closed_start = far;
      const BodyRest body = make_bowel(shape);
      expect_sound(body, 1185);
      EXPECT_EQ(body.rim.size(), static_cast<size_t>(!near) + static_cast<size_t>(!far));
      EXPECT_EQ(euler_characteristic(body.surface), near && far ? 4 : near || far ? 2 : 0);  // two spheres, one, a torus
      float low = 1;
      for (const Vec3 p : body.position) low = std::min(low, p.y);
      EXPECT_NEAR(low, -0.07, 1e-4);
      if (!near) { EXPECT_NEAR(loop_length(points(body, body.rim[0].outer)), 0.126, 0.0015); }
    }
  }
}

TEST(Bowel, OnlyTheFarEndIsHeld) {
  BowelShape shape = shape_with(1185);
  const BodyRest body = make_bowel(shape);
  size_t held = 0;
  for (size_t i = 0; i < body.position.size(); ++i) {
    held += body.pinned[i];
    EXPECT_EQ(body.pinned[i] != 0, body.position[i].y < -0.062f) << i;
  }
  EXPECT_GT(held, 100u);
  shape.pinned_length = 0;
  const BodyRest free = make_bowel(shape);
  EXPECT_EQ(std::accumulate(free.pinned.begin(), free.pinned.end(), 0), 0);
}

TEST(Bowel, PicturePassesThroughTheParticles) {
  const BodyRest body = make_bowel(BowelShape{});
  for (size_t i = 0; i < body.position.size(); ++i) {
    const TissueLayer layer = body.layer[i];
    float nearest = 1;
    for (size_t v = 0; v < body.visible.position.size(); ++v) {
      if (body.visible.layer[v] != layer) continue;
      const Vec3 d = body.position[i] - body.visible.position[v];
      if (length2(d) < 1.5e-6f) nearest = std::min(nearest, std::abs(dot(d, body.visible.normal[v])));
    }
    ASSERT_LT(nearest, 5e-5f) << i;
  }
}

TEST(Bowel, SameShapeSameBits) {
  const BodyRest a = make_bowel(shape_with(1185)), b = make_bowel(shape_with(1185));
  EXPECT_TRUE(std::equal(a.position.begin(), a.position.end(), b.position.begin()));
  EXPECT_EQ(a.cluster, b.cluster);
  EXPECT_EQ(a.visible.skin_weight, b.visible.skin_weight);
}

// --- the remainder of a resected prolapse (paper 2.5.4): one tube inside another ---------------------------------------------

BowelShape folded(int particles) {
  BowelShape shape = shape_with(particles);
  shape.wall = 0.0022f;
  shape.inner_radius = 0.0125f;
  return shape;
}

// The surface's triangles that lie on one wall.
std::vector<Triangle> of_wall(const BodyRest& body, int wall) {
  std::vector<Triangle> out;
  for (const Triangle& t : body.surface)
    if (body.wall[t[0]] == wall) out.push_back(t);
  return out;
}

TEST(FoldedBowel, HasExactlyTheParticlesAskedSharedByArea) {
  for (const int n : {401, 1185, 2000, 4053, 4054, 4055}) {
    SCOPED_TRACE(n);
    const BodyRest body = make_bowel(folded(n));
    expect_sound(body, static_cast<size_t>(n));
    EXPECT_EQ(body.walls, 2);
    ASSERT_EQ(body.wall.size(), static_cast<size_t>(n));
    const auto outer = std::count(body.wall.begin(), body.wall.end(), 0);
    EXPECT_EQ(outer % 2, 0);
    EXPECT_NEAR(static_cast<double>(outer) / n, 20 / 32.5, 1.0 / n);
    EXPECT_TRUE(std::is_sorted(body.wall.begin(), body.wall.end()));
    const double mass = std::accumulate(body.mass.begin(), body.mass.end(), 0.0);
    EXPECT_NEAR(mass, 1050 * total_tet_volume(body), 1e-4 * mass);
  }
}

TEST(FoldedBowel, EachWallIsWatertightAndFacesOutward) {
  const BodyRest body = make_bowel(folded(4054));
  size_t triangles = 0;
  for (const int wall : {0, 1}) {
    const std::vector<Triangle> surface = of_wall(body, wall);
    triangles += surface.size();
    EXPECT_TRUE(watertight(surface));
    EXPECT_EQ(euler_characteristic(surface), 0);
    const double r = wall == 0 ? 0.020 : 0.0125, in = r - 0.0022, tube = 3.14159265 * (r * r - in * in) * 0.07;
    EXPECT_NEAR(enclosed_volume({body.position, surface}), tube, 0.08 * tube) << "haustra and polygons take a little";
  }
  EXPECT_EQ(triangles, body.surface.size());
  for (const Triangle& t : body.surface)
    for (uint32_t i : t) ASSERT_EQ(body.wall[i], body.wall[t[0]]);
}

TEST(FoldedBowel, NothingTiesOneWallToTheOther) {
  const BodyRest body = make_bowel(folded(4055));
  for (const auto& cluster : body.cluster)
    for (uint32_t i : cluster) ASSERT_EQ(body.wall[i], body.wall[cluster[0]]);
  for (const Tet& t : body.tet)
    for (uint32_t i : t) ASSERT_EQ(body.wall[i], body.wall[t[0]]);
  // The visible mesh's two tubes differ in their distance from the axis; each follows its own particles.
  for (size_t v = 0; v < body.visible.position.size(); ++v) {
    const Vec3 p = body.visible.position[v];
    const int wall = std::hypot(p.x, p.z) > 0.015f ? 0 : 1;
    for (int k = 0; k < 4; ++k) ASSERT_EQ(body.wall[body.visible.skin_particle[v][k]], wall) << v;
  }
}

TEST(FoldedBowel, RimsAreLevelAndNearOnesComeFirst) {
  const BodyRest body = make_bowel(folded(4054));
  ASSERT_EQ(body.rim.size(), 4u);
  for (size_t r = 0; r < 4; ++r) {
    SCOPED_TRACE(r);
    const int wall = r % 2;
    const auto outer = points(body, body.rim[r].outer);
    for (uint32_t i : body.rim[r].outer) EXPECT_EQ(body.wall[i], wall);
    EXPECT_NEAR(loop_length(outer), 6.2832 * (wall == 0 ? 0.020 : 0.0125), 0.001);
    for (size_t i = 0; i < outer.size(); ++i) {
      EXPECT_NEAR(outer[i].y, r < 2 ? 0 : -0.07, 1e-5);
      EXPECT_LT(std::hypot(body.position[body.rim[r].inner[i]].x, body.position[body.rim[r].inner[i]].z),
                std::hypot(outer[i].x, outer[i].z));
    }
    EXPECT_NEAR(dot(loop_normal(outer), Vec3{0, r < 2 ? 1.0f : -1.0f, 0}), 1, 1e-5);
  }
  for (size_t i = 0; i < body.position.size(); ++i) EXPECT_EQ(body.pinned[i] != 0, body.position[i].y < -0.062f) << i;
}

// A prolapse is bowel turned inside out over itself: mucosa outside and in the lumen, serosa on the two sides that meet.
TEST(FoldedBowel, SerosaFacesSerosa) {
  const BodyRest body = make_bowel(folded(4054));
  for (size_t i = 0; i < body.position.size(); ++i) {
    const float r = std::hypot(body.position[i].x, body.position[i].z);
    const bool between = body.wall[i] == 0 ? r < 0.0189f - 0.0008f : r > 0.0125f - 0.0011f;
    ASSERT_EQ(body.layer[i] == TissueLayer::serosa, between) << i << " at " << r;
  }
  for (size_t v = 0; v < body.visible.position.size(); ++v) {
    if (body.visible.layer[v] == TissueLayer::cut_edge) continue;
    const Vec3 p = body.visible.position[v], n = body.visible.normal[v];
    const bool outward = n.x * p.x + n.z * p.z > 0, outer_tube = std::hypot(p.x, p.z) > 0.015f;
    ASSERT_EQ(body.visible.layer[v] == TissueLayer::serosa, outward != outer_tube) << v;
  }
}

TEST(FoldedBowel, RefusesAnInnerTubeThatDoesNotFit) {
  const auto message = [](BowelShape shape) {
    try {
      make_bowel(shape);
    } catch (const InputError& e) { return std::string(e.what()); }
    return std::string("accepted");
  };
  BowelShape shape = folded(4054);
  shape.inner_radius = 0.0161f;  // 20 less 0.8 of folds, 2.2 of wall and 1 of gap leave 16.0 mm
  EXPECT_NE(message(shape).find("give at most 0.0160 m"), std::string::npos) << message(shape);
  shape.inner_radius = 0.0159f;
  EXPECT_EQ(message(shape), "accepted");
  for (const float r : {-0.01f, 0.003f, NAN}) {
    shape.inner_radius = r;
    EXPECT_NE(message(shape).find("inner_radius"), std::string::npos) << r;
  }
  shape = folded(4054);
  shape.closed_start = true;
  EXPECT_NE(message(shape).find("closed"), std::string::npos);
  shape = folded(200);
  EXPECT_NE(message(shape).find("two tubes"), std::string::npos);
}

TEST(Bowel, RefusesWhatCannotBeBuilt) {
  const auto message = [](BowelShape shape) {
    try {
      make_bowel(shape);
    } catch (const InputError& e) { return std::string(e.what()); }
    return std::string("accepted");
  };
  BowelShape shape;
  shape.wall = 0.015f;
  EXPECT_NE(message(shape).find("wall"), std::string::npos);
  shape = {};
  shape.particles = 10;
  EXPECT_NE(message(shape).find("particles"), std::string::npos);
  shape = {};
  shape.axis = {0, 0, 0};
  EXPECT_NE(message(shape).find("axis"), std::string::npos);
  shape = {};
  shape.radius = 20;
  EXPECT_NE(message(shape).find("meters"), std::string::npos);
  shape = {};
  shape.pinned_length = NAN;
  EXPECT_NE(message(shape).find("pinned_length"), std::string::npos);
}

TEST(FoldedBowel, IsOneWallThatTurnsOverAtTheTip) {
  BowelShape shape;
  shape.particles = 4054;
  shape.radius = 0.022f, shape.inner_radius = 0.0115f, shape.length = 0.080f, shape.wall = 0.0025f, shape.haustra = 0;
  shape.pinned_length = 0.045f;
  shape.folded = true;
  shape.axis = {0, 0.6f, 0.8f};
  shape.position = {0.01f, 0.02f, 0.03f};
  const BodyRest body = make_bowel(shape);
  expect_sound(body, 4054, true);
  EXPECT_EQ(body.walls, 1);
  EXPECT_EQ(euler_characteristic(body.surface), 0);  // one tube with a wall
  ASSERT_EQ(body.rim.size(), 2u);                    // the colon's opening and the rectum's, both at the far end
  const float lumen = shape.inner_radius - shape.wall;
  EXPECT_NEAR(loop_length(points(body, body.rim[0].outer)), 2 * kPi * lumen, 0.02f * 2 * kPi * lumen);
  EXPECT_NEAR(loop_length(points(body, body.rim[1].outer)), 2 * kPi * shape.radius, 0.02f * 2 * kPi * shape.radius);
  float top = -1;
  for (size_t i = 0; i < body.position.size(); ++i) {
    const Vec3 d = body.position[i] - shape.position;
    const float along = dot(d, shape.axis), r = length(d - shape.axis * along);
    top = std::max(top, along);
    // In the wall of a tube or of the turn; nothing in the cavity between the two or in the lumen.
    const float turn = 0.5f * (shape.radius - lumen), middle = lumen + turn;
    const float from = along < -turn ? std::abs(r - middle) : std::hypot(r - middle, along + turn);
    EXPECT_LT(from, turn + 1e-5f);
    EXPECT_GT(from, turn - shape.wall - 1e-5f);
    // Mucosa is what one sees.
    EXPECT_EQ(body.layer[i] == TissueLayer::mucosa, from > turn - 0.5f * shape.wall);
    EXPECT_EQ(body.pinned[i] != 0, along <= -(shape.length - shape.pinned_length) + 1e-5f) << along;
  }
  EXPECT_LE(top, 1e-5f);
  EXPECT_GT(top, -3e-4f);  // the rings lie a step apart
  // Volume of the two tubes and of half a torus' shell (Pappus).
  const double w = shape.wall, turn = 0.5 * (shape.radius - lumen), middle = lumen + turn, straight = shape.length - turn;
  const double area = kPi * (turn * turn - (turn - w) * (turn - w)) / 2;
  const double tubes =
      kPi * straight *
      (shape.radius * shape.radius - (shape.radius - w) * (shape.radius - w) + (lumen + w) * (lumen + w) - lumen * lumen);
  EXPECT_NEAR(total_tet_volume(body), tubes + 2 * kPi * middle * area, 0.03 * tubes);
}

TEST(FoldedBowel, NeedsAnInnerTube) {
  BowelShape shape;
  shape.folded = true;
  EXPECT_THROW(make_bowel(shape), InputError);
}

}  // namespace
}  // namespace catgut
