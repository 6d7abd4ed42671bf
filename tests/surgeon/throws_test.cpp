// SPDX-License-Identifier: Apache-2.0
// tests/surgeon: throws are counted in curves that are known, drawn tight or wide, tilted, with a short or a long tail.
#include "surgeon/throws.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <vector>

#include "laid_throws.h"

namespace catgut {
namespace {

// Turned about the vertical by `tilt` [rad] within 20 mm of height, sheared and waved: one-to-one, so it stays the knot that it
// is.
std::vector<Vec3> bent(std::vector<Vec3> thread, float tilt, float lean) {
  for (Vec3& p : thread) {
    p = rotate(axis_angle({0, 1, 0}, tilt * p.y / 20e-3f), p);
    p.y += lean * p.x, p.z += 2e-3f * lean * std::sin(600 * p.y);
  }
  return thread;
}

void expect_count(const std::vector<Vec3>& thread, int right, int left, const char* what) {
  const SeenThrows seen = see_throws(thread);
  EXPECT_EQ(seen.right, right) << what;
  EXPECT_EQ(seen.left, left) << what;
}

TEST(Throws, are_counted_whether_tight_wide_or_tilted) {
  for (const float tail : {6e-3f, 40e-3f})
    for (const float strand : {15e-3f, 90e-3f}) {
      expect_count(tied({}, tail, strand), 0, 0, "a stitch");
      expect_count(tied({{1, 1}}, tail, strand), 0, 0, "crossed strands");
      expect_count(tied({{3, 1}}, tail, strand), 1, 0, "right-handed");
      expect_count(tied({{3, -1}}, tail, strand), 0, 1, "left-handed");
      for (const float radius : {0.4e-3f, 12e-3f})
        for (const float half_length : {1.5e-3f, 20e-3f})
          for (const float tilt : {0.0f, 0.6f, -1.2f}) {
            const Laid second{3, -1, radius, half_length};
            SCOPED_TRACE(testing::Message() << "radius " << radius << ", half length " << half_length << ", tilt " << tilt
                                            << ", tail " << tail << ", strand " << strand);
            const auto expect = [&](const std::vector<Laid>& throws, int right, int left, const char* what) {
              expect_count(bent(tied(throws, tail, strand), tilt, tilt), right, left, what);
            };
            expect({second}, 0, 1, "one throw");
            expect({{3, 1}, second}, 1, 1, "a wide second throw");
            expect({{5, 1}, second}, 1, 1, "a second throw on a double one");
            expect({{3, -1}, second}, 0, 2, "a granny");
            expect({{3, 1}, {1, -1, radius, half_length}}, 1, 0, "hands only crossed");
            expect({second, {3, 1}, {3, -1}}, 1, 2, "a third throw");
          }
    }
}

TEST(Throws, a_surgeons_throw_is_told_from_a_single_one) {
  for (const float radius : {0.4e-3f, 6e-3f})
    for (const float tilt : {0.0f, -1.2f}) {
      const auto turns = [&](const std::vector<Laid>& throws) {
        return see_throws(bent(tied(throws, 20e-3f, 60e-3f), tilt, tilt)).turns;
      };
      SCOPED_TRACE(testing::Message() << "radius " << radius << ", tilt " << tilt);
      EXPECT_EQ(turns({}), 0);
      EXPECT_EQ(turns({{3, -1, radius}}), 1);
      EXPECT_EQ(turns({{5, -1, radius}}), 2) << "two turns";
      EXPECT_EQ(turns({{3, 1, radius}, {3, -1}}), 1) << "a square knot";
      EXPECT_EQ(turns({{5, 1, radius}, {3, -1}, {3, 1}}), 2) << "2-1-1";
    }
}

// The strand is wound round the tail and pulled off its end: no throw.
TEST(Throws, turns_that_the_tail_was_not_drawn_through_are_none) {
  std::vector<Vec3> thread;
  for (int i = 0; i <= 60; ++i)
    thread.push_back({-30e-3f + 0.45e-3f * static_cast<float>(i), 10e-3f, 0});  // tail, toward the stitch
  add_line(thread, {-3e-3f, 0, 0}), add_line(thread, {3e-3f, 0, 0}), add_line(thread, {3e-3f, 10e-3f, 4e-3f});
  for (int i = 0; i <= 200; ++i) {  // two turns, back and forth again
    const float s = static_cast<float>(i) / 200, out = 1 - std::abs(2 * s - 1), angle = 4 * kPi * s;
    thread.push_back({-20e-3f * out, 10e-3f + 4e-3f * std::sin(angle) + 3e-3f * s, 4e-3f * std::cos(angle)});
  }
  add_line(thread, {20e-3f, 60e-3f, 20e-3f});
  const SeenThrows seen = see_throws(thread);
  EXPECT_EQ(seen.alternating(), 0) << seen.right << " right, " << seen.left << " left";
}

// A thread of a scene (interrupted_tied, seed 1) at the moment when the hands have crossed: the second throw lies in a wide
// loop.
TEST(Throws, a_wide_throw_of_a_scene_is_counted) {
  std::ifstream in(CATGUT_SOURCE_DIR "/tests/surgeon/wide_throw.txt");
  std::vector<Vec3> thread;
  for (Vec3 p; in >> p.x >> p.y >> p.z;) thread.push_back(1e-3f * p);  // [mm] in the file
  ASSERT_EQ(thread.size(), 200u);
  expect_count(thread, 1, 1, "square knot");
  // And while it is turned, scaled and mirrored.
  for (const float angle : {0.5f, 1.3f, 2.9f}) {
    std::vector<Vec3> other;
    for (const Vec3& p : thread) other.push_back(rotate(axis_angle(normalized(Vec3{1, 2, -1}), angle), p) * (0.5f + angle));
    expect_count(other, 1, 1, "turned and scaled");
  }
}

// A finished stitch of altemeier (seed 2, commit 7ff8759, 420 s), which had shown five throws until then: jaws that came for
// another tail have put its short end through its own last throw. It holds, and was counted as no knot at all.
TEST(Throws, below_an_end_that_passed_back_through_the_last_one_are_counted) {
  std::ifstream in(CATGUT_SOURCE_DIR "/tests/surgeon/tangled_end.txt");
  std::vector<Vec3> thread;
  for (Vec3 p; in >> p.x >> p.y >> p.z;) thread.push_back(1e-3f * p);
  ASSERT_EQ(thread.size(), 84u);
  expect_count(thread, 2, 2, "four of its five throws");
  std::reverse(thread.begin(), thread.end());
  expect_count(thread, 2, 2, "from the other end");
}

TEST(Throws, the_next_one_has_the_other_hand) {
  EXPECT_EQ((SeenThrows{0, 0}).alternating(), 0);
  EXPECT_EQ((SeenThrows{1, 0}).alternating(), 1);
  EXPECT_EQ((SeenThrows{1, 1}).alternating(), 2);
  EXPECT_EQ((SeenThrows{2, 0}).alternating(), 1) << "a granny knot: its throws have the same hand";
  EXPECT_EQ((SeenThrows{1, 2}).alternating(), 3);
  EXPECT_EQ((SeenThrows{1, 0}).next(1), -1);
  EXPECT_EQ((SeenThrows{1, 1}).next(1), 1);
  EXPECT_EQ((SeenThrows{0, 1}).next(-1), 1);
  EXPECT_EQ((SeenThrows{0, 0}).next(-1), -1);
}

}  // namespace
}  // namespace catgut
