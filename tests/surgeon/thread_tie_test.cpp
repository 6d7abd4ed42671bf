// SPDX-License-Identifier: Apache-2.0
// tests/surgeon: what a tie does when the stitch itself fails under it, and how it comes to a tail inside a bowel.
#include "surgeon/thread_tie.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "laid_throws.h"

namespace catgut {
namespace {

// A thread along x through a stitch at the origin; the forceps holds the needle, the needle holder is empty.
struct Stitch {
  PictureModel picture;
  Snapshot seen;
  std::array<ScriptedHand, 2> hands;
  Stitch() {
    std::vector<Vec3> straight;
    for (int i = 0; i < 120; ++i) straight.push_back({1e-3f * static_cast<float>(i - 40), 0, 0});
    thread(straight);
    seen.tool[1].held = Held::needle;
  }
  // Its bites are where it comes nearest to the origin.
  void thread(const std::vector<Vec3>& path) {
    SutureView& s = seen.active();
    s = {}, seen.particle = path;
    for (uint32_t i = 0; i < path.size(); ++i) s.thread_order.push_back(i);
    s.thread_tension.assign(path.size() - 1, 0), s.thread_cut.assign(path.size() - 1, 0);
    const auto lowest = std::min_element(path.begin(), path.end(), [](Vec3 a, Vec3 b) { return length2(a) < length2(b); });
    const auto middle = static_cast<uint32_t>(lowest - path.begin());
    for (const uint32_t node : {middle - 4, middle + 4}) {
      SuturePointView& p = s.suture_point.emplace_back();
      p.anchored = node, p.position = seen.particle[node];
    }
    s.needle.pose.p = path.back();
  }
};

// The bites were torn out by a pull: there is nothing to tie. A seed of altemeier ended the program here.
TEST(ThreadTie, fails_when_the_bites_of_its_stitch_are_torn_out) {
  Stitch s;
  ThreadTie tie(s.picture, s.hands, {});
  tie.begin(s.seen, 1, 1, true);
  for (int i = 0; i < 10; ++i) ASSERT_FALSE(tie.operate(s.seen, 1.0f / 60));
  EXPECT_FALSE(tie.failed());
  s.seen.active().suture_point.clear();
  EXPECT_TRUE(tie.operate(s.seen, 1.0f / 60));
  EXPECT_TRUE(tie.failed());
}

TEST(ThreadTie, fails_at_once_when_there_is_no_stitch) {
  Stitch s;
  s.seen.active().suture_point.clear();
  ThreadTie tie(s.picture, s.hands, {});
  tie.begin(s.seen, 1, 1, true);
  EXPECT_TRUE(tie.operate(s.seen, 1.0f / 60));
  EXPECT_TRUE(tie.failed());
}

// The hands go where they want to, and the jaws hold what they close on; no turn stays on them. Until the surgeon ends.
struct SlidingTurns {
  bool over = false;
  int grasps = 0;
  void run(Stitch& s, ThreadTie& tie) {
    ToolView& holder = s.seen.tool[0];
    for (int i = 0; i < 30000 && !over; ++i) {
      over = tie.operate(s.seen, 1.0f / 60);
      holder.pose = s.hands[0].pose;
      if (s.hands[0].jaw > 0.3f) holder.held = Held::nothing;
      else if (s.hands[0].jaw < 0.01f && holder.held == Held::nothing)
        for (uint32_t node = 0; node < 30; ++node)
          if (distance(holder.pose.p, s.seen.particle[node]) < 1e-3f)
            holder.held = Held::thread, holder.held_slot = node, ++grasps;
    }
  }
};

// It gave up with the tail in its jaws, and the hands, which went away, tore the bites out.
TEST(ThreadTie, lets_the_tail_go_before_it_gives_up) {
  Stitch s;
  ThreadTie tie(s.picture, s.hands, {});
  tie.begin(s.seen, 1, 1, true);
  SlidingTurns turns;
  turns.run(s, tie);
  ASSERT_TRUE(turns.over);
  EXPECT_TRUE(tie.failed());
  EXPECT_GT(turns.grasps, 5);
  EXPECT_EQ(s.seen.tool[0].held, Held::nothing);
}

// Of the fourth throw nothing comes: three hold, two do not.
TEST(ThreadTie, leaves_a_knot_of_three_throws_when_a_further_one_fails) {
  for (const size_t tied_already : {2u, 3u}) {
    std::vector<Laid> throws;
    for (size_t i = 0; i < tied_already; ++i) throws.push_back({3, i % 2 == 0 ? 1 : -1});
    Stitch s;
    s.thread(tied(throws, 40e-3f, 90e-3f));
    ThreadTie tie(s.picture, s.hands, {});
    for (int i = 0; i < 4; ++i) tie.begin(s.seen, 1, 1, i == 0);
    SlidingTurns turns;
    turns.run(s, tie);
    ASSERT_TRUE(turns.over);
    EXPECT_EQ(tie.failed(), tied_already == 2);
    EXPECT_EQ(tie.retries(), 6);
  }
}

// Jaws that have closed on the strand were taken for jaws with the tail: the hands drew them apart with 8 N (altemeier, seed
// 2).
TEST(ThreadTie, does_not_take_the_strand_for_the_tail) {
  Stitch s;
  ThreadTie tie(s.picture, s.hands, {});
  tie.begin(s.seen, 1, 1, true);
  ToolView& holder = s.seen.tool[0];
  int grasps = 0;
  for (int i = 0; i < 2000; ++i) {
    ASSERT_FALSE(tie.operate(s.seen, 1.0f / 60));
    ASSERT_NE(tie.doing(), "lift the tail");
    holder.pose = s.hands[0].pose;
    if (s.hands[0].jaw > 0.3f) holder.held = Held::nothing;
    else if (tie.doing() == "take the tail" && s.hands[0].jaw < 0.01f && holder.held == Held::nothing)
      holder.held = Held::thread, holder.held_slot = 60, ++grasps;
  }
  EXPECT_GT(grasps, 1);
}

// Jaws that go down to the tail slacken the strand: a loose turn falls between them, or off them beside the tail.
TEST(ThreadTie, takes_in_the_slack_while_the_jaws_go_down_to_the_tail) {
  const auto moves_apart = [](float tension) {  // [m] both hands, in the first quarter of a second
    Stitch s;
    ThreadTie tie(s.picture, s.hands, {});
    tie.begin(s.seen, 1, 1, true);
    tie.begin(s.seen, 1, 1, false);
    float before = 0;
    for (int ticks = 0, after = 0; ticks < 2000 && after < 15; ++ticks) {
      EXPECT_FALSE(tie.operate(s.seen, 1.0f / 60));
      s.seen.tool[0].pose = s.hands[0].pose;
      if (tie.doing() == "reach for the tail") s.seen.active().thread_tension.assign(119, tension), ++after;
      else before = distance(s.hands[0].pose.p, s.hands[1].pose.p);
    }
    EXPECT_EQ(tie.doing(), "reach for the tail");
    return distance(s.hands[0].pose.p, s.hands[1].pose.p) - before;
  };
  EXPECT_GT(moves_apart(0), 4e-3f);
  EXPECT_LT(moves_apart(0.1f), 0.5e-3f) << "a taut strand is not pulled";
}

// A stitch on the left of an upright bowel of 24 mm, whose tail hangs into the lumen and ends in its middle, 7 mm below the
// edge.
struct StitchOfRing : Stitch {
  StitchOfRing() {
    constexpr int kRound = 60;
    std::vector<Vec3> wall;
    for (int y = 0; y < 12; ++y)
      for (int i = 0; i < kRound; ++i) {
        const float angle = 2 * kPi * static_cast<float>(i) / kRound;
        wall.push_back({12e-3f * std::cos(angle), -2e-3f * static_cast<float>(y), 12e-3f * std::sin(angle)});
      }
    picture.columns = static_cast<uint32_t>(wall.size() / 2);
    SutureView& s = seen.active();
    for (uint32_t& slot : s.thread_order) slot += static_cast<uint32_t>(wall.size());
    for (SuturePointView& p : s.suture_point) p.anchored += static_cast<uint32_t>(wall.size());
    for (size_t i = 0; i < seen.particle.size(); ++i) {
      const float along = (static_cast<float>(i) - 40) / 40;  // of the tail: -1 its end, 0 the stitch
      seen.particle[i] = i < 40 ? Vec3{-12e-3f - 18e-3f * along, -7e-3f * along * along, 0}
                                : Vec3{-12e-3f - 60e-3f * along / 2, 30e-3f * along / 2, 0};
    }
    s.suture_point[0].position = {-13e-3f, -3e-3f, 0}, s.suture_point[1].position = {-11e-3f, -3e-3f, 0};
    s.needle.pose.p = seen.particle.back();
    wall.insert(wall.end(), seen.particle.begin(), seen.particle.end());
    seen.particle = wall;
  }
  // [m] of the needle holder's axis from the nearest of the wall, from 8 mm behind its tip.
  float room() const {
    const Pose& holder = seen.tool[0].pose;
    const Vec3 axis = rotate(holder.q, {0, 0, 1});
    float least = 1;
    for (size_t i = 0; i < 2 * picture.columns; ++i)
      for (float along = 8e-3f; along < 80e-3f; along += 1e-3f)
        least = std::min(least, distance(seen.particle[i], holder.p + axis * along));
    return least;
  }
  // The hands go where they want to. The least room until the jaws close on the tail.
  float room_until_they_close(ThreadTie& tie) {
    float least = 1;
    for (int i = 0; i < 1200 && !(tie.doing() == "take the tail" && hands[0].jaw < 0.1f); ++i) {
      if (tie.operate(seen, 1.0f / 60)) break;
      seen.tool[0].pose = hands[0].pose;
      least = std::min(least, room());
    }
    return least;
  }
  float from_tail() const {
    float least = 1;
    for (size_t i = 0; i < 40; ++i)
      least = std::min(least, distance(seen.tool[0].pose.p, seen.particle[2 * picture.columns + i]));
    return least;
  }
};

// It came from the front, flat, through the wall, and pressed on it with 8 N.
TEST(ThreadTie, takes_a_tail_in_the_lumen_from_above) {
  StitchOfRing s;
  ThreadTie tie(s.picture, s.hands, {});
  s.hands[0].pose = s.seen.tool[0].pose = {{0, 0.08f, 0.08f}, from_axes({1, 0, 0}, {0, 0, -1}, {0, 1, 0})};
  tie.begin(s.seen, 1, 1, true);
  EXPECT_GT(s.room_until_they_close(tie), 4e-3f);
  EXPECT_LT(s.from_tail(), 1e-3f);
}

// A tail on the slope of a bowel that lies along x: one jaw met the wall before the other one reached the tail, and pressed on
// it with 5 to 8 N.
TEST(ThreadTie, comes_square_to_the_wall_that_a_tail_lies_on) {
  for (const float aside : {-7e-3f, 4e-3f}) {  // [m] behind or before the ridge
    SCOPED_TRACE(aside);
    Stitch s;
    constexpr float kRadius = 12e-3f;
    std::vector<Vec3> wall;
    for (int x = -60; x <= 60; x += 2)
      for (int i = -8; i <= 8; ++i)
        for (const float radius : {kRadius, kRadius - 2e-3f}) {
          const float angle = 0.15f * static_cast<float>(i);
          wall.push_back({1e-3f * static_cast<float>(x), radius * std::cos(angle) - kRadius, radius * std::sin(angle)});
        }
    s.picture.columns = static_cast<uint32_t>(wall.size() / 2);
    const auto shift = static_cast<uint32_t>(wall.size());
    for (uint32_t& slot : s.seen.active().thread_order) slot += shift;
    for (SuturePointView& p : s.seen.active().suture_point) p.anchored += shift;
    for (size_t i = 0; i < 30; ++i)  // the tail; the stitch is on the ridge
      s.seen.particle[i] = {s.seen.particle[i].x, std::sqrt(kRadius * kRadius - aside * aside) - kRadius, aside};
    wall.insert(wall.end(), s.seen.particle.begin(), s.seen.particle.end());
    s.seen.particle = wall;
    const Vec3 out = normalized(Vec3{0, std::sqrt(kRadius * kRadius - aside * aside), aside});

    ThreadTie tie(s.picture, s.hands, {});
    tie.begin(s.seen, 1, 1, true);
    tie.begin(s.seen, 1, 1, false);
    for (int i = 0; i < 2000 && tie.doing() != "close on the tail"; ++i) {
      ASSERT_FALSE(tie.operate(s.seen, 1.0f / 60));
      s.seen.tool[0].pose = s.hands[0].pose;
    }
    ASSERT_EQ(tie.doing(), "close on the tail");
    const Pose& jaws = s.seen.tool[0].pose;
    EXPECT_LT(std::abs(dot(rotate(jaws.q, {1, 0, 0}), out)), 0.1f) << "they open along the wall";
    EXPECT_GT(dot(rotate(jaws.q, {0, 0, 1}), out), 0.8f) << "and do not lie on it";
  }
}

// Jaws that something holds back: the hand's spring pulls by how far it is ahead of them.
TEST(ThreadTie, presses_gently_on_what_lies_between_the_jaws_and_a_tail_in_the_lumen) {
  for (const char* stage : {"take the tail", "reach for the tail"}) {
    SCOPED_TRACE(stage);
    const bool winds = std::string(stage) != "take the tail";
    StitchOfRing s;
    ThreadTie tie(s.picture, s.hands, {.lumen = true});
    s.hands[0].pose = s.seen.tool[0].pose = {{0, 0.08f, 0.08f}, from_axes({1, 0, 0}, {0, 0, -1}, {0, 1, 0})};
    tie.begin(s.seen, 1, 1, true);
    if (winds) tie.begin(s.seen, 1, 1, false);  // the tail is taken with a turn on the jaws
    bool held_back = false;
    float most = 0;
    for (int i = 0, ticks = 0; i < 1200 && ticks < 60; ++i) {
      ASSERT_FALSE(tie.operate(s.seen, 1.0f / 60));
      if (held_back) ++ticks, most = std::max(most, distance(s.hands[0].pose.p, s.seen.tool[0].pose.p));
      else s.seen.tool[0].pose = s.hands[0].pose, held_back = tie.doing() == stage && s.from_tail() < 12e-3f;
    }
    ASSERT_TRUE(held_back);
    EXPECT_GT(most, 0.5e-3f);
    EXPECT_LT(most, 0.81e-3f) << "2.4 N with the 3 N/mm of a hand";
  }
}

}  // namespace
}  // namespace catgut
