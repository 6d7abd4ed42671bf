// SPDX-License-Identifier: Apache-2.0
// tests/surgeon: the direction from which jaws come for a tail, between a wall and another stitch.
#include "surgeon/reach.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace catgut {
namespace {

// An upright wall in the plane x = 15 mm, 10 mm higher than a tail that ends at the origin, and another suture, far away.
struct Field {
  PictureModel picture;
  Snapshot seen;
  Field() {
    for (int y = -20; y <= 10; ++y)
      for (int z = -20; z <= 20; ++z)
        seen.particle.push_back({15e-3f, 1e-3f * static_cast<float>(y), 1e-3f * static_cast<float>(z)});
    if (seen.particle.size() % 2) seen.particle.push_back({15e-3f, -21e-3f, 0});
    picture.columns = static_cast<uint32_t>(seen.particle.size() / 2);
    seen.suture.resize(2);
    for (SutureView& s : seen.suture)
      for (int i = 0; i < 30; ++i) s.thread_order.push_back(add({-1e-3f * static_cast<float>(i), 0, 0}));
    move_other({0, 1, 0});
  }
  uint32_t add(Vec3 p) {
    seen.particle.push_back(p);
    return static_cast<uint32_t>(seen.particle.size()) - 1;
  }
  void move_other(Vec3 to) {
    for (const uint32_t i : seen.suture[1].thread_order) seen.particle[i] = to;
  }
};
const Vec3 kFlat = normalized(Vec3{1, 0.4f, 0}), kSteep = normalized(Vec3{1, 3, 0}), kBehind = normalized(Vec3{0, 1, -1});

TEST(Reach, jaws_come_over_a_wall_and_not_through_it) {
  const Field f;
  const std::array way{kFlat, kSteep};
  EXPECT_EQ(clear_shaft(f.picture, f.seen, {}, way), 1u);
  const std::array other_side{normalized(Vec3{-1, 0.4f, 0}), kSteep};
  EXPECT_EQ(clear_shaft(f.picture, f.seen, {}, other_side), 0u) << "the first that is clear";
}

TEST(Reach, jaws_keep_clear_of_the_knot_of_another_stitch) {
  Field f;
  f.move_other(kSteep * 30e-3f);
  const std::array way{kSteep, kBehind};
  EXPECT_EQ(clear_shaft(f.picture, f.seen, {}, way), 1u);
  f.move_other(Vec3{0, 1, 0});
  EXPECT_EQ(clear_shaft(f.picture, f.seen, {}, way), 0u);
}

TEST(Reach, the_normal_of_a_wall_points_to_the_side_where_one_is) {
  Field f;
  f.seen.particle.clear();
  for (int y = 0; y <= 20; ++y)
    for (int i = 0; i < 60; ++i)
      for (const float radius : {12e-3f, 10e-3f}) {
        const float angle = 2 * kPi * static_cast<float>(i) / 60;
        f.seen.particle.push_back({radius * std::cos(angle), -1e-3f * static_cast<float>(y), radius * std::sin(angle)});
      }
  f.picture.columns = static_cast<uint32_t>(f.seen.particle.size() / 2);
  for (const float angle : {0.3f, 2.0f}) {
    const Vec3 radial{std::cos(angle), 0, std::sin(angle)}, down{0, -10e-3f, 0};
    EXPECT_GT(dot(wall_normal(f.picture, f.seen, radial * 12.5e-3f + down), radial), 0.98f);
    EXPECT_LT(dot(wall_normal(f.picture, f.seen, radial * 9.5e-3f + down), radial), -0.98f) << "in the lumen";
  }
  EXPECT_EQ(wall_normal(f.picture, f.seen, {0, 0.1f, 0}).y, 1) << "none near";
}

TEST(Reach, where_nothing_is_clear_it_takes_the_direction_with_most_room) {
  Field f;
  f.move_other(kFlat * 12e-3f);
  const std::array way{kFlat, normalized(Vec3{1, 0.8f, 0})};
  EXPECT_EQ(clear_shaft(f.picture, f.seen, {}, way), 1u);
}

TEST(Reach, room_counts_other_strands_and_walls_but_not_its_own) {
  Field f;
  EXPECT_FLOAT_EQ(room_at(f.picture, f.seen, {}, true, 4e-3f), 4e-3f);
  EXPECT_NEAR(room_at(f.picture, f.seen, {13e-3f, 0, 0}, true, 4e-3f), 2e-3f, 1e-5f);
  EXPECT_FLOAT_EQ(room_at(f.picture, f.seen, {13e-3f, 0, 0}, false, 4e-3f), 4e-3f);
  f.move_other({0, 1e-3f, 0});
  EXPECT_NEAR(room_at(f.picture, f.seen, {}, false, 4e-3f), 1e-3f, 1e-6f);
}

}  // namespace
}  // namespace catgut
