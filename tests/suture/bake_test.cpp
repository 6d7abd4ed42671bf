// SPDX-License-Identifier: Apache-2.0
// tests/suture: a new needle and thread: tied thread is baked, the rest removed, and nothing else grows.
#include <gtest/gtest.h>

#include "tie.h"

namespace catgut {
namespace {

void press(Rig& r, size_t hand = 0) { r.order(CommandKind::new_suture, hand); }

TickInput new_suture_by_hand_0() {
  TickInput input;
  input.commands.push({CommandKind::new_suture, 0, 0});
  return input;
}

// Ties two throws, or one, and cuts both ends.
void tie_and_cut(Tie& r, int throws = 2) {
  const size_t before = r.count(EventKind::throw_locked);
  for (int k = 0; k < throws; ++k) {
    if (k > 0) r.wrap(k % 2 ? -1 : 1);
    r.take();
    r.pull_tight();
  }
  ASSERT_EQ(r.count(EventKind::throw_locked), before + static_cast<size_t>(throws));
  r.open(0);
  const Knot k = r.sewn().knot.back();
  snip(r, between(r, r.node_of(k.slot[0]) - 5));
  snip(r, between(r, r.node_of(k.slot[1]) + 4));
}

std::vector<Event> settle(Tie& r) {
  EventList events;
  SutureContext sewing = r.context(events);
  EXPECT_TRUE(new_suture(sewing, r.model->start, r.model->needle_start, new_suture_by_hand_0()));
  return events.list;
}

// [m] of thread from the knot to the first suture point, on to the last, and from there to the knot.
std::array<float, 3> lengths(Tie& r) {
  const Knot& k = r.sewn().knot[0];
  const std::array<size_t, 4> at = {r.node_of(k.slot[0]), r.node_of_point(0), r.node_of_point(1), r.node_of(k.slot[1])};
  std::array<float, 3> length{};
  for (size_t p = 0; p < 3; ++p)
    for (size_t i = at[p]; i < at[p + 1]; ++i) length[p] += r.thread().rest[i];
  return length;
}
// The two thread paths from one point to the other.
float shorter_way(Tie& r) {
  const std::array<float, 3> length = lengths(r);
  return std::min(length[1], length[0] + length[2]);
}

void expect_fresh(Rig& r) {
  const StatePtr fresh = initial_state(*r.model);
  const SolverState &a = r.solver(), &b = fresh->solver;
  EXPECT_EQ(a.strand[0].order, b.strand[0].order);
  EXPECT_EQ(a.strand[0].rest, b.strand[0].rest);
  EXPECT_EQ(a.strand[0].cut, b.strand[0].cut);
  EXPECT_EQ(a.strand[0].anchor.size(), 0u);
  ASSERT_EQ(a.strand[0].hold.size(), 1u);
  EXPECT_EQ(a.strand[0].hold[0].kind, HoldKind::swage);
  EXPECT_EQ(a.weld.size(), 2u);
  EXPECT_TRUE(a.channel.empty());
  EXPECT_TRUE(r.sewn().point.empty());
  EXPECT_TRUE(r.sewn().knot.empty());
  for (const ToolLoop& l : r.suture().loop) EXPECT_EQ(l.wraps, 0u);
  for (const InstrumentState& h : r.suture().instrument) EXPECT_EQ(h.held, Held::nothing);
}

TEST(Settle, a_tied_stitch_becomes_a_curve_and_pins) {
  TieSetup setup;
  setup.particles = 110;
  Tie r(setup);
  tie_and_cut(r);
  if (HasFatalFailure()) return;
  const Knot k = r.sewn().knot[0];
  const size_t first = r.node_of(k.slot[0]);
  std::vector<Vec3> where;
  const std::vector<uint32_t> order = r.thread().order;
  size_t cut0 = 0, cut1 = 0;
  for (size_t i = 0; i < r.thread().cut.size(); ++i)
    if (r.thread().cut[i]) (i < first ? cut0 : cut1) = i;
  const float way = shorter_way(r);
  const Vec3 ends[2] = {r.point_at(0), r.point_at(1)};
  const Vec3 knot = position_of(k.target, r.x());
  for (size_t i = cut0 + 1; i <= cut1; ++i) where.push_back(xyz(r.x()[order[i]]));
  EventList events;
  SutureContext sewing = r.context(events);
  ASSERT_TRUE(new_suture(sewing, r.model->start, r.model->needle_start, new_suture_by_hand_0()));
  // The curve: every particle of the piece, at its position; tails included, cut-off thread removed.
  ASSERT_EQ(r.suture().settled.size(), 1u);
  Snapshot seen;
  publish(*r.model, *r.state, seen);
  ASSERT_EQ(seen.settled.size(), 1u);
  ASSERT_EQ(seen.settled[0].node.size(), where.size());
  for (size_t i = 0; i < where.size(); ++i) EXPECT_LT(distance(seen.settled[0].node[i], where[i]), 1e-4f) << i;
  ASSERT_EQ(seen.settled[0].knot.size(), 1u);
  EXPECT_LT(distance(seen.settled[0].knot[0], knot), 1e-5f);
  // Both paths between the points are thread that holds them; the shorter one carries the load.
  ASSERT_EQ(r.solver().pin.size(), 1u);
  const Tether& pin = r.solver().pin[0];
  EXPECT_EQ(pin.owner, TetherOwner::stitch);
  EXPECT_NEAR(pin.length, way, 1e-7f);
  EXPECT_LT(distance(position_of(pin.a, r.x()), ends[0]), 1e-4f);
  EXPECT_LT(distance(position_of(pin.b, r.x()), ends[1]), 1e-4f);
  expect_fresh(r);
  EXPECT_EQ(r.sewn().bite.size(), 2u) << "bites stay listed";
  ASSERT_EQ(events.size(), 2u);
  EXPECT_EQ(events[0].kind, EventKind::suture_baked);
  EXPECT_EQ(events[1].kind, EventKind::suture_loaded);
  EXPECT_EQ(events[1].which, 0u);
  EXPECT_EQ(r.sewn().suture_index, 1u);
  const uint32_t slots = r.model->solver.strand[0].first_slot;
  for (uint32_t i = slots; i < r.model->solver.count; ++i) EXPECT_EQ(xyz(r.x()[i]), r.model->start[i]);
  EXPECT_EQ(r.needle().x, r.model->needle_start[0].p);
}

// Thread holds two points from both sides; the tether has the length of the shorter path.
TEST(Settle, of_two_ways_between_the_same_points_the_shorter_holds) {
  for (const float inside : {0.3f, 3.0f}) {
    TieSetup setup;
    setup.particles = 110;
    Tie r(setup);
    tie_and_cut(r);
    if (HasFatalFailure()) return;
    for (size_t i = r.node_of_point(0); i < r.node_of_point(1); ++i) r.thread().rest[i] *= inside;
    const std::array<float, 3> length = lengths(r);
    ASSERT_EQ(length[1] < length[0] + length[2], inside < 1);
    const float way = shorter_way(r);
    settle(r);
    ASSERT_EQ(r.solver().pin.size(), 1u);
    EXPECT_NEAR(r.solver().pin[0].length, way, 1e-7f);
  }
}

// A tied stitch of two bites: in and out, in and out. Its points in order along the thread, and the slack thread in it.
struct TwoBites : Tie {
  std::array<uint32_t, 4> slot{};
  static TieSetup long_enough() {
    TieSetup setup;
    setup.particles = 120;
    setup.newer = 34;
    return setup;
  }
  explicit TwoBites(bool one_wall = true) : Tie(long_enough()) {
    tie_and_cut(*this);
    if (testing::Test::HasFatalFailure()) return;
    const std::array<size_t, 4> node = {node_of_point(0), node_of_point(0) + 2, node_of_point(1) - 2, node_of_point(1)};
    const Vec3 from = point_at(0), to = point_at(1);
    for (const size_t k : {size_t{1}, size_t{2}}) lock(*this, node[k], lerp(from, to, k == 1 ? 0.3f : 0.7f));
    for (size_t k = 0; k < 4; ++k) slot[k] = thread().order[node[k]];
    auto& point = sewn().point;  // the first, the last, and the two between
    if (one_wall) point[2].bite = point[0].bite;
    point[3].bite = point[1].bite;
    for (size_t i = node[0]; i < node[3]; ++i) thread().tension[i] = 0;
  }
  float between_points(size_t a, size_t b) {
    float length = 0;
    for (size_t i = node_of(slot[a]); i < node_of(slot[b]); ++i) length += thread().rest[i];
    return length;
  }
  Vec3 at_point(size_t k) {
    const auto& anchor = thread().anchor;
    return position_of(
        std::find_if(anchor.begin(), anchor.end(), [&](const ThreadAnchor& a) { return a.slot == slot[k]; })->point, x());
  }
};

// A knot is not a point of the tissue: its effect is to hold the two ends of its stitch together.
TEST(Settle, both_ends_of_a_stitch_are_held_through_its_knot) {
  TwoBites r;
  if (HasFatalFailure()) return;
  const std::array<float, 3> length = lengths(r);
  const float gap = r.between_points(1, 2);
  std::array<Vec3, 4> at;
  for (size_t k = 0; k < 4; ++k) at[k] = r.at_point(k);
  settle(r);
  ASSERT_EQ(r.solver().pin.size(), 2u);
  const Tether &round = r.solver().pin[0], &inner = r.solver().pin[1];
  EXPECT_NEAR(round.length, length[0] + length[2], 1e-7f);
  EXPECT_LT(distance(position_of(round.a, r.x()), at[0]), 1e-4f);
  EXPECT_LT(distance(position_of(round.b, r.x()), at[3]), 1e-4f);
  EXPECT_NEAR(inner.length, gap, 1e-7f);
  EXPECT_LT(distance(position_of(inner.a, r.x()), at[1]), 1e-4f);
  EXPECT_LT(distance(position_of(inner.b, r.x()), at[2]), 1e-4f);
}

// Two suture points of one bite are a passage through a wall, which holds itself. A tether there would be solved in every
// substep from now on, without effect.
TEST(Settle, a_wall_that_carries_nothing_gets_no_pin) {
  struct Case {
    const char* what;
    bool one_wall;
    float tension;  // [N] at one place inside
    size_t pins;
    TetherOwner owner;
  };
  for (const Case& c : {Case{"two walls, slack", false, 0, 3, TetherOwner::stitch}, Case{"one wall, slack", true, 0.09f, 2, {}},
                        Case{"one wall, drawn in", true, 0.11f, 3, TetherOwner::passage}}) {
    SCOPED_TRACE(c.what);
    TwoBites r(c.one_wall);
    if (HasFatalFailure()) return;
    r.thread().tension[r.node_of(r.slot[0]) + 1] = c.tension;
    const Vec3 in = r.at_point(0), out = r.at_point(1);
    settle(r);
    ASSERT_EQ(r.solver().pin.size(), c.pins);
    if (c.pins < 3) continue;
    const Tether& pin = r.solver().pin[1];
    EXPECT_EQ(pin.owner, c.owner);
    EXPECT_LT(distance(position_of(pin.a, r.x()), in), 1e-4f);
    EXPECT_LT(distance(position_of(pin.b, r.x()), out), 1e-4f);
  }
}

// Later stitches take the load of a passage, or the tissue settles: its tether is removed when the next suture is loaded.
TEST(Settle, a_passage_is_pinned_as_long_as_it_carries_something) {
  for (const float pull : {0.11f, 0.09f}) {
    TwoBites r;
    if (HasFatalFailure()) return;
    r.thread().tension[r.node_of(r.slot[0]) + 1] = 0.2f;
    settle(r);
    ASSERT_EQ(r.solver().pin.size(), 3u);
    for (Tether& pin : r.solver().pin)
      pin.lambda = pin.owner == TetherOwner::passage ? -pull * r.model->solver.h * r.model->solver.h : 0;
    settle(r);
    EXPECT_EQ(r.solver().pin.size(), pull > 0.1f ? 3u : 2u) << "and what holds walls together stays, slack or not";
  }
}

// The technique's closure holds the walls together pair by pair; a stitch on such a pair would only oppose it.
TEST(Settle, places_that_a_pin_holds_already_get_no_second) {
  struct Case {
    const char* what;
    float aside;   // [m] of the existing tether
    float longer;  // [m] than the thread between the points
    size_t pins;
  };
  for (const Case& c : {Case{"none near", 0.02f, 0, 2}, Case{"as tight", 0.001f, 0, 1}, Case{"tighter", 0, -0.001f, 1},
                        Case{"looser", 0, 0.001f, 2}}) {
    SCOPED_TRACE(c.what);
    TieSetup setup;
    setup.particles = 110;
    Tie r(setup);
    tie_and_cut(r);
    if (HasFatalFailure()) return;
    const float length = shorter_way(r);
    Tether there;
    const auto particle_near = [&](Vec3 at) {
      uint32_t best = 0;
      for (uint32_t i = 1; i < r.model->solver.tissue; ++i)
        if (distance(xyz(r.x()[i]), at) < distance(xyz(r.x()[best]), at)) best = i;
      return particle_point(best);
    };
    there.a = particle_near(r.point_at(0) + Vec3{0, 0, c.aside});
    there.b = particle_near(r.point_at(1) + Vec3{0, 0, c.aside});
    ASSERT_EQ(distance(position_of(there.a, r.x()), r.point_at(0)) < 0.003f, c.aside < 0.01f);
    there.length = length + c.longer;
    there.owner = TetherOwner::stitch;  // a plan's tethers are rebuilt every tick
    r.solver().pin.push_back(there);
    settle(r);
    EXPECT_EQ(r.solver().pin.size(), c.pins);
  }
}

// Fewer particles carry the tether, and nothing moves because of that, not even in deformed tissue.
TEST(Settle, a_pin_hangs_on_six_particles_at_most) {
  TieSetup setup;
  setup.particles = 110;
  Tie r(setup);
  tie_and_cut(r);
  if (HasFatalFailure()) return;
  // The first point uses the maximum number of particles.
  EmbeddedPoint& point = r.thread().anchor[r.sewn().point[0].anchor].point;
  const Vec3 at = r.point_at(0);
  std::vector<uint32_t> near(r.model->solver.tissue);
  for (uint32_t i = 0; i < near.size(); ++i) near[i] = i;
  std::sort(near.begin(), near.end(),
            [&](uint32_t a, uint32_t b) { return distance(xyz(r.x()[a]), at) < distance(xyz(r.x()[b]), at); });
  point.count = EmbeddedPoint::kMaxParticles;
  for (uint32_t i = 0; i < point.count; ++i)
    point.particle[i] = near[i], point.weight[i] = 1.0f / static_cast<float>(EmbeddedPoint::kMaxParticles);
  // The outermost of them, which the tether will omit, have been moved.
  for (uint32_t i = EmbeddedPoint::kMaxParticles - 4; i < EmbeddedPoint::kMaxParticles; ++i)
    set(r.solver().x[near[i]], xyz(r.x()[near[i]]) + Vec3{0, 0.003f, 0});
  const EmbeddedPoint a = point, b = r.thread().anchor[r.sewn().point[1].anchor].point;
  const float length = shorter_way(r);
  settle(r);
  ASSERT_EQ(r.solver().pin.size(), 1u);
  for (const Tether& pin : r.solver().pin)
    for (const EmbeddedPoint* end : {&pin.a, &pin.b}) {
      EXPECT_GE(end->count, 1u);
      EXPECT_LE(end->count, 6u);
      float weight = 0;
      for (uint32_t i = 0; i < end->count; ++i) weight += end->weight[i];
      EXPECT_NEAR(weight, 1, 1e-5f);
    }
  const Tether& pin = r.solver().pin[0];
  const float before = distance(position_of(a, r.x()), position_of(b, r.x())) - length,
              now = distance(position_of(pin.a, r.x()), position_of(pin.b, r.x())) - pin.length;
  EXPECT_GT(distance(position_of(a, r.x()), position_of(pin.a, r.x())), 1e-4f) << "the end lies elsewhere";
  EXPECT_NEAR(now, before, 1e-6f) << "and draws as the thread drew";
}

// Tissue held together by thread stays together when it is pulled.
TEST(Settle, the_pins_hold_what_the_thread_held) {
  float apart[2];
  for (const bool held : {true, false}) {
    TieSetup setup;
    setup.particles = 110;
    Tie r(setup);
    tie_and_cut(r);
    if (HasFatalFailure()) return;
    const EmbeddedPoint a = r.thread().anchor[r.sewn().point[0].anchor].point,
                        b = r.thread().anchor[r.sewn().point[1].anchor].point;
    press(r);
    if (!held) r.solver().pin.clear();
    const Vec3 pa = position_of(a, r.x()), pb = position_of(b, r.x()), way = normalized(pb - pa);
    for (const auto& [point, from, sign] : {std::tuple{a, pa, -1.0f}, std::tuple{b, pb, 1.0f}}) {
      Attachment pull;
      pull.point = point;
      pull.target = from + way * (0.004f * sign);
      pull.compliance = 0.02f;
      r.solver().attach.push_back(pull);
    }
    r.wait(1.0f);
    apart[held ? 0 : 1] = distance(position_of(a, r.x()), position_of(b, r.x()));
  }
  EXPECT_LT(apart[0], apart[1] - 0.0005f);
}

TEST(Settle, not_with_the_needle_in_the_tissue) {
  Rig r;
  r.wait(0.2f);
  const Place p = r.place(0.4f);
  r.approach(p);
  r.drive(p, -1.0f, 0.4f);
  ASSERT_NE(phase_of(r.sewn()), NeedlePhase::outside);
  const uint32_t bite = r.sewn().open.back().bite;
  const Vec3 needle = r.needle().x;
  press(r, 1);
  r.input.hand[1].connected = 1;
  r.input.hand[1].pose = {{0.1f, 0.1f, 0}, {}};
  r.tick();
  press(r, 1);
  ASSERT_EQ(r.count(EventKind::technique_fault), 1u) << "a hand that is not there presses nothing";
  EXPECT_EQ(r.last(EventKind::technique_fault)->fault, Fault::needle_in_tissue);
  EXPECT_EQ(r.last(EventKind::technique_fault)->which, bite);
  EXPECT_EQ(r.count(EventKind::suture_loaded), 0u);
  EXPECT_LT(distance(r.needle().x, needle), 0.002f);
}

TEST(Settle, what_was_not_tied_is_taken_away_and_said) {
  Tie r;
  r.take();
  ASSERT_EQ(r.sewn().knot.size(), 1u);
  press(r);
  EXPECT_EQ(r.count(EventKind::throw_undone), 1u);
  ASSERT_EQ(r.count(EventKind::technique_fault), 1u);
  EXPECT_EQ(r.last(EventKind::technique_fault)->fault, Fault::cut_before_knot);
  EXPECT_EQ(r.count(EventKind::suture_baked), 0u);
  EXPECT_EQ(r.count(EventKind::suture_loaded), 1u);
  EXPECT_EQ(r.count(EventKind::thread_released), 1u);
  EXPECT_TRUE(r.suture().settled.empty());
  EXPECT_TRUE(r.solver().pin.empty());
}

TEST(Settle, a_knot_that_does_not_hold_is_said_and_long_ends_are_trimmed) {
  TieSetup setup;
  setup.particles = 110;
  Tie r(setup);
  r.take();
  r.pull_tight();
  ASSERT_EQ(r.count(EventKind::throw_locked), 1u);
  r.let_go();  // the ghost's weld is the test's own
  press(r);
  ASSERT_EQ(r.count(EventKind::technique_fault), 1u);
  EXPECT_EQ(r.last(EventKind::technique_fault)->fault, Fault::too_few_throws);
  ASSERT_EQ(r.suture().settled.size(), 1u);
  // Two tails of 30 mm at most, and what is between.
  EXPECT_LT(r.suture().settled[0].node.size(), 2 * 19 + 15u);
  EXPECT_GT(r.suture().settled[0].node.size(), 2 * 10u);
}

// "Cost and counts": no input of a tick grows.
TEST(Settle, ten_stitches_leave_nothing_but_themselves) {
  TieSetup setup;
  setup.particles = 100;
  Tie r(setup);
  r.setup.turns = 1.25f;
  std::vector<size_t> bytes;
  for (int k = 0; k < 10; ++k) {
    if (k > 0) {
      r.sew(0.2f + 0.5f * static_cast<float>(k));
      r.put_tool();
      r.tick();
    }
    tie_and_cut(r, 1);
    if (HasFatalFailure()) return;
    if (r.ghost >= 0) r.let_go();
    press(r);
    r.input.hand[0].jaw = 0.7f;
    ASSERT_EQ(r.suture().settled.size(), static_cast<size_t>(k) + 1);
    EXPECT_EQ(r.solver().pin.size(), static_cast<size_t>(k) + 1);
    EXPECT_EQ(r.solver().weld.size(), 2u);
    EXPECT_TRUE(r.solver().attach.empty());
    EXPECT_TRUE(r.thread().anchor.empty());
    EXPECT_EQ(r.thread().hold.size(), 1u);
    EXPECT_TRUE(r.sewn().knot.empty());
    EXPECT_TRUE(r.sewn().point.empty());
    bytes.push_back(save_state(*r.model, *r.state).size());
    const std::vector<std::byte> saved = save_state(*r.model, *r.state);
    StatePtr again = initial_state(*r.model);
    load_state(*r.model, *again, saved);
    EXPECT_EQ(save_state(*r.model, *again), saved);
    Jobs jobs(2);
    step(*r.model, *again, r.input, jobs);
    r.tick();
    EXPECT_EQ(hash_state(*r.model, *again), hash_state(*r.model, *r.state));
  }
  EXPECT_EQ(r.sewn().suture_index, 10u);
  // Each leaves its curve, its tethers and its bites: the same for every stitch, except for the length of its tails.
  for (size_t k = 1; k < bytes.size(); ++k) EXPECT_LT(bytes[k] - bytes[k - 1], 3000u);
}

// The same commands, the same bits: by inputs alone.
TEST(Settle, replays_the_same) {
  std::vector<uint64_t> hash[2];
  for (int run = 0; run < 2; ++run) {
    Rig r;
    Jobs jobs(run + 1);
    for (int i = 0; i < 90; ++i) {
      ToolInput& hand = r.input.hand[1];
      hand.connected = i > 5;
      hand.pose = {{0.06f - 0.0002f * static_cast<float>(i), -0.034f, 0.01f}, {}};
      r.input.commands.clear();
      if (i == 30 || i == 60) r.input.commands.push({CommandKind::new_suture, 1, 0});
      if (i == 40 || i == 50) r.input.commands.push({CommandKind::cut, 1, 0});
      r.input.tick = r.state->tick;
      step(*r.model, *r.state, r.input, jobs);
      hash[run].push_back(hash_state(*r.model, *r.state));
    }
    EXPECT_EQ(r.sewn().suture_index, 2u);
  }
  EXPECT_EQ(hash[0], hash[1]);
}

}  // namespace
}  // namespace catgut
