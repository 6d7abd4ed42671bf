// SPDX-License-Identifier: Apache-2.0
// tests/suture: thread through suture points (paper 2.3, figures 7 and 9). Weightless and placed directly, so that every length
// is known (see rig.h).
#include <gtest/gtest.h>

#include "rig.h"

namespace catgut {
namespace {

// One suture point at node `node`: the free end leads up from it, the needle's end straight out.
void one_point(Rig& rig, size_t node, Place& p) {
  rig.wait(0.1f);
  p = rig.place(0.4f, 0.004f);
  lock(rig, node, p.at);
  const Vec3 at = rig.point_at(0);
  const size_t n = rig.thread().order.size();
  lay(rig, 0, node - 1, at, p.up, -1);
  lay(rig, node + 1, n - 1, at, p.out, 1);
  put_needle(rig, xyz(rig.solver().x[rig.thread().order.back()]));
}

void draw_out(Rig& rig, const Place& p, float meters, float speed) {
  Pose to = rig.circle();
  to.p += p.out * meters;
  rig.needle_to(to, meters / speed);
}

// "The simulator temporarily anchors the next free particle at the needle's end to the suture point. This locks the thread at
// that location." (figure 7a)
TEST(Figure7, a_suture_point_locks_the_next_free_particle_behind_the_needle) {
  Rig rig(weightless(40));
  rig.wait(0.1f);
  const Place p = rig.place(0.4f, 0.004f);
  const size_t n = rig.thread().order.size();
  lay(rig, 0, n - 3, p.at, p.up, -1);
  lay(rig, n - 2, n - 1, p.at, p.out, 1);
  Bite bite;
  const int near = nearest_particle(rig.model->solver.collision, rig.state->scratch.candidates, rig.x(), p.at, 0.01f);
  bite.entry.point = particle_point(static_cast<uint32_t>(near));
  rig.sewn().bite.push_back(bite);
  const double length = rig.rest_length();
  const uint32_t next_free = rig.thread().order[n - 2];
  SutureContext context = rig.context();
  OneSuture one(context, 0);
  ASSERT_TRUE(place_suture_point(one, 0, false));
  ASSERT_EQ(rig.thread().anchor.size(), 1u);
  EXPECT_EQ(rig.thread().anchor[0].slot, next_free);
  EXPECT_LT(distance(xyz(rig.x()[next_free]), position_of(bite.entry.point, rig.x())), 1e-7f);
  EXPECT_NEAR(rig.rest_length(), length, 1e-7);
  EXPECT_TRUE(rig.order_is_whole());
  // A second hole directly behind the first: the particle behind passes the first suture point early (figure 7c).
  const uint32_t behind = rig.thread().order[n - 3];
  bite.exit.point = bite.entry.point;
  rig.sewn().bite[0] = bite;
  ASSERT_TRUE(place_suture_point(one, 0, true));
  ASSERT_EQ(rig.thread().anchor.size(), 2u);
  EXPECT_EQ(rig.thread().anchor[1].slot, behind);
  EXPECT_EQ(rig.node_of(next_free), n - 3) << "the first suture point keeps its particle";
  EXPECT_EQ(rig.node_of(behind), n - 2);
  EXPECT_NEAR(rig.rest_length(), length, 1e-7);
  EXPECT_TRUE(rig.order_is_whole());
}

// "... allowing tension T to build between the anchored particle and the particle still attached to the needle as it moves
// away. Once T exceeds a predefined threshold, the simulator advances the thread" (figure 7b): below the threshold nothing
// passes.
TEST(Figure7, tension_below_the_threshold_passes_nothing_above_it_thread_passes) {
  SceneSpec scene = weightless(40);
  scene.mechanics.pass_tension = 0.013f;  // one particle of tissue moves by a millimeter per 1.4 mN
  Rig rig(scene);
  Place p;
  one_point(rig, 34, p);
  const std::vector<uint32_t> order = rig.thread().order;
  const std::vector<float> rest = rig.thread().rest;
  // Tissue responds slowly and thread at once, so the needle creeps: 0.6 mm/s.
  float largest = 0;
  bool slid = false;
  for (int i = 0; i < 1200 && !slid; ++i) {
    draw_out(rig, p, 0.00001f, 0.0006f);
    const ThreadAnchor& a = rig.thread().anchor[0];
    slid = rig.thread().rest != rest;
    if (slid) break;
    largest = std::max(largest, a.tension_needle - a.tension_free);
    ASSERT_EQ(rig.thread().order, order);
    ASSERT_EQ(rig.count(EventKind::particle_passed), 0u);
  }
  ASSERT_TRUE(slid) << "tension never reached the threshold: " << largest;
  EXPECT_GT(largest, 0.3f * scene.mechanics.pass_tension) << "tension must build before thread slides";
  EXPECT_LT(largest, 1.2f * scene.mechanics.pass_tension);
  draw_out(rig, p, 0.008f, 0.01f);
  EXPECT_GE(rig.count(EventKind::particle_passed), 1u);
}

// Figure 7c: "The particle on the free end of the suture point moves to the midpoint of the needle end particle and the suture
// point." The stage alone, on a state that is due: exactly one particle, exactly the midpoint, nothing else moves.
TEST(Figure7, exactly_one_particle_passes_to_the_midpoint) {
  Rig rig(weightless(40));
  Place p;
  one_point(rig, 30, p);
  Strand& t = rig.thread();
  const float spacing = rig.model->solver.strand[0].spacing;
  t.rest[30] += t.rest[29] - 0.05f * spacing;  // as if nearly the whole pair on the free side had slid through
  t.rest[29] = 0.05f * spacing;
  const double length = rig.rest_length();
  const Strand before = t;
  const auto x = rig.solver().x;
  EventList events;
  SutureContext sewing = rig.context(events);
  pull(sewing);
  ASSERT_EQ(events.size(), 1u);
  EXPECT_EQ(events[0].kind, EventKind::particle_passed);
  EXPECT_EQ(events[0].value, 1.0f);
  const uint32_t passed = before.order[29], anchored = before.order[30], beyond = before.order[31];
  EXPECT_EQ(t.order[29], anchored);
  EXPECT_EQ(t.order[30], passed);
  EXPECT_EQ(t.order[31], beyond);
  EXPECT_LT(distance(xyz(rig.x()[passed]), lerp(rig.point_at(0), xyz(x[beyond]), 0.5f)), 1e-7f);
  for (uint32_t i = 0; i < rig.model->solver.count; ++i)
    if (i != passed) { ASSERT_EQ(xyz(rig.x()[i]), xyz(x[i])) << i; }
  EXPECT_NEAR(rig.rest_length(), length, 1e-7);
  // Called again, nothing passes.
  events.clear();
  pull(sewing);
  EXPECT_TRUE(events.empty());
}

// Beyond the paper: passing a particle is bookkeeping. Straight thread stays straight and nothing jumps,
// because the midpoint lies on it.
TEST(Figure7, passing_makes_no_jump) {
  Rig rig(weightless(40));
  Place p;
  one_point(rig, 30, p);
  float longest = 0, longest_passing = 0;
  for (int i = 0; i < 240; ++i) {
    const auto before = rig.solver().x;
    const std::vector<uint32_t> order = rig.thread().order;
    const size_t passes = rig.count(EventKind::particle_passed);
    draw_out(rig, p, 0.0001f, 0.006f);
    float moved = 0;
    for (uint32_t k = 0; k < rig.model->solver.tissue; ++k) moved = std::max(moved, distance(xyz(before[k]), xyz(rig.x()[k])));
    (rig.count(EventKind::particle_passed) > passes ? longest_passing : longest) =
        std::max(rig.count(EventKind::particle_passed) > passes ? longest_passing : longest, moved);
    double length = 0;
    for (size_t k = 0; k + 1 < rig.thread().order.size(); ++k)
      length += distance(xyz(rig.x()[rig.thread().order[k]]), xyz(rig.x()[rig.thread().order[k + 1]]));
    ASSERT_NEAR(length, rig.rest_length(), 0.01 * rig.rest_length());
  }
  EXPECT_GE(rig.count(EventKind::particle_passed), 5u);
  EXPECT_LT(longest_passing, longest + 0.0002f);
}

// Figure 7d: "Tension is resolved after particle movement." When the needle stops, the difference is at most the friction
// limit.
TEST(Figure7, tension_resolves_after_passing) {
  Rig rig(weightless(40));
  Place p;
  one_point(rig, 34, p);
  const Vec3 at_rest = rig.point_at(0);
  draw_out(rig, p, 0.012f, 0.02f);
  ASSERT_GE(rig.count(EventKind::particle_passed), 3u);
  rig.wait(0.5f);
  const ThreadAnchor& a = rig.thread().anchor[0];
  EXPECT_LE(a.tension_needle - a.tension_free, 1.05f * a.threshold() + 0.002f);
  const size_t passed = rig.count(EventKind::particle_passed);
  rig.wait(0.5f);
  EXPECT_EQ(rig.count(EventKind::particle_passed), passed) << "a resting thread passes nothing";
  // As much thread came through as the needle pulled, minus the tissue's displacement, held by friction: to one
  // particle.
  const float leans = dot(rig.point_at(0) - at_rest, p.out), spacing = rig.model->solver.strand[0].spacing;
  EXPECT_NEAR(static_cast<float>(passed) * spacing + leans, 0.012f, 1.1f * spacing);
}

// "If p10 is locked to a suture point, p11 through p13 and p7 through p9 will have collision disabled along with p10. ... A
// particle's ability to collide is restored as the thread is pulled through the suture point."
TEST(Collisions, are_off_for_the_locked_particle_and_three_neighbors_a_side_and_come_back) {
  Rig rig(weightless(40));
  Place p;
  one_point(rig, 20, p);
  std::vector<int> ever_off(40, 0);
  auto check = [&] {
    const size_t at = rig.node_of_point(0), n = rig.thread().order.size();
    for (size_t i = 0; i < n; ++i) {
      const bool off = (i + 3 >= at && i <= at + 3) || i + 4 >= n;  // the swage is held too
      const size_t slot = rig.thread().order[i] - rig.model->solver.strand[0].first_slot;
      ASSERT_EQ(rig.collides()[slot], off ? 0 : 1) << "node " << i << ", locked " << at;
      if (off && i + 4 < n) ever_off[slot] = 1;
    }
  };
  check();
  for (int i = 0; i < 60; ++i) {
    draw_out(rig, p, 0.0004f, 0.024f);
    check();
    if (HasFatalFailure()) return;
  }
  EXPECT_GE(rig.count(EventKind::particle_passed), 10u);
  // More particles had collisions off at some time than now: those that left collide again.
  EXPECT_GE(std::count(ever_off.begin(), ever_off.end(), 1), 15);
}

// Two suture points with slack between them.
void two_points(Rig& rig, size_t older, size_t newer, Place& p) {
  rig.wait(0.1f);
  const Place first = rig.place(0.0f, 0.004f);
  p = rig.place(0.4f, 0.004f);
  lock(rig, older, first.at);
  lock(rig, newer, p.at);
  const Vec3 a = rig.point_at(0), b = rig.point_at(1);
  const size_t n = rig.thread().order.size();
  lay(rig, 0, older - 1, a, first.up, -1);
  lay(rig, newer + 1, n - 1, b, p.out, 1);
  // The slack hangs outside as a flat arch.
  const float spacing = rig.model->solver.strand[0].spacing;
  const float length = spacing * static_cast<float>(newer - older), chord = distance(a, b);
  const float height = std::sqrt(std::max(0.0f, length * length - chord * chord)) * 0.5f;
  for (size_t i = older + 1; i < newer; ++i) {
    const float s = static_cast<float>(i - older) / static_cast<float>(newer - older);
    set(rig.solver().x[rig.thread().order[i]],
        lerp(a, b, s) + normalized(first.out + p.out) * (height * (1 - std::abs(2 * s - 1))));
  }
  put_needle(rig, xyz(rig.solver().x[rig.thread().order.back()]));
}

// Figure 9: (a), (b) while the thread between two suture points is longer than the way between them, "the particle on the free
// end of the thread adjacent to sp2 is moved"; (c) "there is no slack left between the two suture points, and pulling will
// happen" behind the older.
TEST(Figure9, slack_is_resolved_first_then_the_pull_comes_from_behind_the_older_point) {
  Rig rig(weightless(50));
  Place p;
  two_points(rig, 20, 29, p);
  const auto span = [&] { return rig.node_of_point(1) - rig.node_of_point(0); };
  const auto span_rest = [&] {
    double s = 0;
    for (size_t i = rig.node_of_point(0); i < rig.node_of_point(1); ++i) s += double{rig.thread().rest[i]};
    return s;
  };
  const size_t behind_at_start = rig.node_of_point(0);
  size_t before = span();
  ASSERT_GT(span_rest(), 1.3 * double{distance(rig.point_at(0), rig.point_at(1))});
  bool taut = false;
  double span_when_taut = 0;
  for (int i = 0; i < 150; ++i) {
    const size_t from_older = rig.node_of_point(0);
    draw_out(rig, p, 0.0002f, 0.012f);
    const double way = double{distance(rig.point_at(0), rig.point_at(1))};
    if (!taut) {
      if (rig.node_of_point(0) < from_older || rig.thread().anchor[0].slipping > 0) {
        taut = true;
        span_when_taut = span_rest();
        // The first thread to leave the older point does so when the span is taut.
        EXPECT_LT(span_rest(), 1.08 * way + 0.0002);
      } else {
        EXPECT_EQ(rig.node_of_point(0), behind_at_start) << "slack first";
        EXPECT_LE(span(), before) << "slack never grows while the needle pulls";
      }
    } else {
      EXPECT_NEAR(span_rest(), span_when_taut, 0.0016) << "a taut span passes on what it gets";
    }
    before = span();
  }
  EXPECT_TRUE(taut);
  EXPECT_LT(rig.node_of_point(0), behind_at_start) << "then the pull comes from behind the older point";
  EXPECT_TRUE(rig.order_is_whole());
}

// "Our simulation checks for slack sequentially from the suture point closest to the needle to the free end of the thread."
TEST(Figure9, suture_points_are_checked_from_the_needle_end) {
  Rig rig(weightless(60));
  Place p;
  two_points(rig, 20, 32, p);
  lock(rig, 45, rig.place(0.8f, 0.004f).at);
  Strand& t = rig.thread();
  const float used = 0.05f * rig.model->solver.strand[0].spacing;
  for (size_t node : {size_t{20}, size_t{32}, size_t{45}}) t.rest[node] += t.rest[node - 1] - used, t.rest[node - 1] = used;
  const double length = rig.rest_length();
  EventList events;
  SutureContext sewing = rig.context(events);
  pull(sewing);
  ASSERT_EQ(events.size(), 3u);
  for (uint32_t k = 0; k < 3; ++k) EXPECT_EQ(events[k].which, 2 - k);
  EXPECT_NEAR(rig.rest_length(), length, 1e-7);
  EXPECT_TRUE(rig.order_is_whole());
}

// The tail's end reaches the first suture point and stays: reported, never lost.
TEST(RanOut, the_free_end_holds_at_the_first_suture_point) {
  Rig rig(weightless(40));
  Place p;
  one_point(rig, 8, p);
  const double length = rig.rest_length();
  const uint32_t end = rig.thread().order.front();
  for (int i = 0; i < 90; ++i) {
    draw_out(rig, p, 0.0002f, 0.012f);
    ASSERT_TRUE(rig.order_is_whole());
    ASSERT_EQ(rig.thread().order.front(), end);
  }
  EXPECT_EQ(rig.node_of_point(0), 1u);
  EXPECT_GE(rig.count(EventKind::thread_exhausted), 1u);
  EXPECT_LE(rig.count(EventKind::thread_exhausted), 3u) << "said, not shouted";
  EXPECT_NEAR(rig.rest_length(), length, 1e-6);
  for (float r : rig.thread().rest) EXPECT_GT(r, 0.0f);
  // The needle returns: the tissue relaxes, everything is still in place.
  draw_out(rig, p, -0.01f, -0.02f);
  rig.wait(0.5f);
  EXPECT_TRUE(rig.order_is_whole());
}

// The same with several points in a row, all of whose spans become taut.
TEST(RanOut, with_two_points_the_older_one_holds) {
  Rig rig(weightless(40));
  Place p;
  two_points(rig, 5, 14, p);
  for (int i = 0; i < 90; ++i) draw_out(rig, p, 0.00025f, 0.015f);
  EXPECT_GE(rig.count(EventKind::thread_exhausted), 1u);
  EXPECT_EQ(rig.last(EventKind::thread_exhausted)->which, 0u);
  EXPECT_EQ(rig.node_of_point(0), 1u);
  EXPECT_TRUE(rig.order_is_whole());
  EXPECT_GT(rig.node_of_point(1), rig.node_of_point(0));
}

}  // namespace
}  // namespace catgut
