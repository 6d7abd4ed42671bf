// SPDX-License-Identifier: Apache-2.0
// tests/sim: the guarantees of the tick: same inputs, same bits, for any number of workers. A saved state continues
// identically; publishing changes nothing. Random hand motion breaks nothing.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>

#include "core/check.h"
#include "core/random.h"
#include "procedure/scene_file.h"
#include "sim/model.h"
#include "sim/state.h"
#include "surgeon/surgeon.h"

namespace catgut {
namespace {

bool long_run() { return std::getenv("CATGUT_LONG") != nullptr; }

// A short purse-string: three long bites on a short thread, pulled tight. All phases within some thirty simulated seconds.
SceneSpec short_scene() {
  SceneSpec s = read_scene("purse_string");
  s.technique.min_bites = 3;
  s.surgeon.bites = 3;
  return s;
}

std::unique_ptr<Surgeon> surgeon_of(const Model& model) {
  SurgeonSkill k;
  k.bites = model.scene.surgeon.bites;
  k.seed = model.scene.seed;
  return make_surgeon("purse_string", picture_model(model), k);
}

struct Played {
  std::vector<TickInput> input;
  std::vector<uint64_t> hash;            // after each tick
  size_t mid_bite = 0, mid_closure = 0;  // ticks
};

// The hands of `ticks` ticks of a scripted run, and what the state was after each.
Played scripted_run(const Model& model, size_t ticks) {
  Played run;
  StatePtr state = initial_state(model);
  Jobs jobs(1);
  Snapshot seen;
  const auto surgeon = surgeon_of(model);
  publish(model, *state, seen);
  for (size_t i = 0; i < ticks; ++i) {
    TickInput in;
    in.tick = i;
    if (i < 30) {
      for (ToolInput& h : in.hand) h.connected = 0;
    } else {
      in = surgeon->operate(seen, model.dt);
      in.tick = i;
    }
    step(model, *state, in, jobs);
    publish(model, *state, seen);
    run.input.push_back(in);
    run.hash.push_back(hash_state(model, *state));
    if (!run.mid_bite && phase_of(state->suture.suture[0]) == NeedlePhase::through) run.mid_bite = i + 5;
  }
  return run;
}

constexpr size_t kTicks = 1200;  // 20 s: two bites and the thread drawn through

class Scripted : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    model_ = build_model(short_scene());
    run_ = std::make_unique<Played>(scripted_run(*model_, kTicks));
  }
  static void TearDownTestSuite() { run_.reset(), model_.reset(); }
  static std::shared_ptr<const Model> model_;
  static std::unique_ptr<Played> run_;

  // Plays ticks from..to on `state` and compares every hash.
  static void play(State& state, size_t from, size_t to, int threads) {
    Jobs jobs(threads);
    for (size_t i = from; i < to; ++i) {
      step(*model_, state, run_->input[i], jobs);
      ASSERT_EQ(hash_state(*model_, state), run_->hash[i]) << "tick " << i << ", " << threads << " threads";
    }
  }
};
std::shared_ptr<const Model> Scripted::model_;
std::unique_ptr<Played> Scripted::run_;

TEST_F(Scripted, two_and_three_threads_give_the_same_bits) {
  for (int threads : {2, 3}) {
    StatePtr state = initial_state(*model_);
    play(*state, 0, long_run() ? kTicks : 600, threads);
  }
}

TEST_F(Scripted, saved_in_the_middle_of_a_bite_and_loaded_it_goes_on_bit_for_bit) {
  ASSERT_GT(run_->mid_bite, 0u);
  StatePtr state = initial_state(*model_);
  play(*state, 0, run_->mid_bite, 1);
  const std::vector<std::byte> bytes = save_state(*model_, *state);
  EXPECT_NE(phase_of(state->suture.suture[0]), NeedlePhase::outside);
  StatePtr other = initial_state(*model_);
  load_state(*model_, *other, bytes);
  EXPECT_EQ(hash_state(*model_, *other), run_->hash[run_->mid_bite - 1]);
  EXPECT_EQ(save_state(*model_, *other), bytes);
  play(*other, run_->mid_bite, std::min(kTicks, run_->mid_bite + 400), 1);
  // Undo: a state that has advanced is set back.
  load_state(*model_, *other, bytes);
  play(*other, run_->mid_bite, run_->mid_bite + 60, 2);
}

TEST_F(Scripted, publishing_changes_nothing_and_says_the_same_twice) {
  StatePtr state = initial_state(*model_);
  Jobs jobs(1);
  Snapshot a, b;
  for (size_t i = 0; i < 240; ++i) {
    step(*model_, *state, run_->input[i], jobs);
    publish(*model_, *state, a);
    if (i % 7 == 0) publish(*model_, *state, b);
    ASSERT_EQ(hash_state(*model_, *state), run_->hash[i]);
  }
  publish(*model_, *state, b);
  EXPECT_EQ(a.particle, b.particle);
  EXPECT_EQ(a.active().thread_order, b.active().thread_order);
  EXPECT_EQ(a.active().thread_tension, b.active().thread_tension);
  EXPECT_EQ(a.opening_area, b.opening_area);
  EXPECT_EQ(a.tick, b.tick);
}

// The whole procedure, saved and loaded while the opening closes.
TEST(WholeRun, saved_in_the_middle_of_the_closure_and_loaded_it_goes_on_bit_for_bit) {
  // Hands need not finish the ring to close it: shortening the loop of the state starts a closure.
  SceneSpec scene = short_scene();
  const auto model = build_model(scene);
  StatePtr state = initial_state(*model);
  Jobs jobs(1);
  TickInput idle;
  for (ToolInput& h : idle.hand) h.connected = 0;
  for (int i = 0; i < 10; ++i) step(*model, *state, idle, jobs);
  // A closure under way: the plan of a ring, half done.
  for (uint32_t i : model->technique.purse_string.rim_inner) {
    const Vec3 from = xyz(state->solver.x[i]);
    state->plan[0].pull.push_back({particle_point(i), from, Vec3{0.3f * from.x, from.y, 0.3f * from.z}});
  }
  state->plan[0].compliance = model->technique.purse_string.compliance;
  state->plan[0].progress = 0.4f;
  state->technique[0].purse_string.ring_complete = state->technique[0].purse_string.closing = true;
  state->technique[0].purse_string.path_start = 0.12f, state->technique[0].purse_string.path_end = 0.05f;
  for (int i = 0; i < 20; ++i) step(*model, *state, idle, jobs);
  ASSERT_FALSE(state->solver.attach.empty());
  const std::vector<std::byte> bytes = save_state(*model, *state);
  StatePtr other = initial_state(*model);
  load_state(*model, *other, bytes);
  for (int i = 0; i < 60; ++i) {
    step(*model, *state, idle, jobs);
    step(*model, *other, idle, jobs);
    ASSERT_EQ(hash_state(*model, *state), hash_state(*model, *other)) << i;
  }
}

TEST(Load, bytes_of_another_scene_are_refused) {
  const SceneSpec scene = short_scene();
  SceneSpec longer = scene, finer = scene;
  longer.thread.particles += 5;
  finer.body[0].particles += 30;
  const auto model = build_model(scene);
  StatePtr state = initial_state(*model);
  const std::vector<std::byte> before = save_state(*model, *state);
  for (const SceneSpec& s : {longer, finer}) {
    const auto other = build_model(s);
    StatePtr there = initial_state(*other);
    EXPECT_THROW(load_state(*model, *state, save_state(*other, *there)), InputError);
  }
  std::vector<std::byte> cut = before;
  cut.pop_back();
  EXPECT_THROW(load_state(*model, *state, cut), InputError);
  cut = before;
  cut.push_back({});
  EXPECT_THROW(load_state(*model, *state, cut), InputError);
  EXPECT_THROW(load_state(*model, *state, {}), InputError);
  EXPECT_EQ(save_state(*model, *state), before) << "a refused load changes nothing";
}

// A damaged state is refused or is a valid state of this scene: a tick on it is defined behavior, for any numbers.
TEST(Load, damaged_bytes_never_crash) {
  const auto model = build_model(short_scene());
  StatePtr state = initial_state(*model);
  Jobs jobs(1);
  TickInput idle;
  for (ToolInput& h : idle.hand) h.connected = 0;
  step(*model, *state, idle, jobs);
  const std::vector<std::byte> good = save_state(*model, *state);
  // The columns of positions, velocities and origins are any numbers; the structure follows them.
  const size_t columns = 8 + 2 * (8 + 16 * particle_count(*model)) + 8 + 16 * model->solver.tissue;
  Random random(3);
  int refused = 0;
  for (int k = 0; k < 300; ++k) {
    std::vector<std::byte> bytes = good;
    const size_t at = columns + random.next() % (bytes.size() - columns);
    bytes[at] ^= static_cast<std::byte>(1u << random.next() % 8);
    try {
      load_state(*model, *state, bytes);
      step(*model, *state, idle, jobs);
    } catch (const InputError&) { ++refused; }
  }
  EXPECT_GT(refused, 10);
  EXPECT_LT(refused, 250);
}

TEST(Scene, a_bound_on_what_tools_press_reaches_the_solver) {
  SceneSpec scene = read_scene("stay");
  EXPECT_EQ(build_model(scene)->solver.tool_force, 8);
  set_value(scene, "solver.tool_force=3");
  EXPECT_EQ(build_model(scene)->solver.tool_force, 3);
}

TEST(Sane, says_when_a_number_is_not_one_or_something_is_gone) {
  const auto model = build_model(short_scene());
  StatePtr state = initial_state(*model);
  EXPECT_TRUE(state_is_valid(*model, *state));
  const float x = state->solver.x[100].x;
  state->solver.x[100].x = std::nanf("");
  EXPECT_FALSE(state_is_valid(*model, *state));
  state->solver.x[100].x = 1.5f;
  EXPECT_FALSE(state_is_valid(*model, *state));
  EXPECT_TRUE(state_is_valid(*model, *state, 2));
  state->solver.x[100].x = x;
  state->solver.v[1300].y = INFINITY;
  EXPECT_FALSE(state_is_valid(*model, *state));
  state->solver.v[1300].y = 0;
  state->solver.body[model->solver.needle_body(0)].q.w = std::nanf("");
  EXPECT_FALSE(state_is_valid(*model, *state));
}

// --- random motion -------------------------------------------------------------------------------------------------------

struct Fling {
  double largest_energy = 0;  // [J]
  int grasps = 0, bites = 0;
  float median_ms = 0, p99_ms = 0;
};

// Both hands run at random targets within 0.25 m at up to 2 m/s, turning at up to 20 rad/s, jaws opening and closing at random.
void fling(uint64_t seed, float seconds, Fling& out) {
  const auto model = build_model(read_scene("purse_string"));
  StatePtr state = initial_state(*model);
  Jobs jobs(1);
  Random random(seed);
  struct Hand {
    Pose pose{{0, 0.1f, 0.1f}, {}};
    Vec3 goal, spin;
    float speed = 1, jaw = 1, jaw_goal = 1;
  };
  std::array<Hand, 2> hand;
  auto anywhere = [&] { return Vec3{random.uniform() - 0.5f, random.uniform() - 0.5f, random.uniform() - 0.5f} * 0.5f; };
  std::vector<float> ms;
  const int ticks = static_cast<int>(seconds / model->dt);
  for (int i = 0; i < ticks; ++i) {
    TickInput in;
    in.tick = static_cast<uint64_t>(i);
    for (size_t k = 0; k < 2; ++k) {
      Hand& h = hand[k];
      if (distance(h.pose.p, h.goal) < 0.01f || random.uniform() < 0.02f) {
        h.goal = anywhere();
        h.speed = 0.05f + 1.95f * random.uniform();
        // Every other time at the needle or the thread, so that they are caught and dragged along.
        const float aim = random.uniform();
        if (aim < 0.25f && state->suture.instrument[k].held == Held::nothing)
          h.goal = needle_point(model->solver.needle_arc[0], state->solver.body[model->solver.needle_body(0)],
                                kPi * random.uniform());
        else if (aim < 0.5f && state->suture.instrument[k].held == Held::nothing)
          h.goal = xyz(state->solver.x[state->solver.strand[0].order[random.next() % state->solver.strand[0].order.size()]]);
      }
      if (random.uniform() < 0.03f) {
        const Vec3 axis = normalized(Vec3{random.normal(), random.normal(), random.normal()}, {0, 1, 0});
        h.spin = axis * (20 * random.uniform());
      }
      if (random.uniform() < 0.04f) h.jaw_goal = random.uniform() < 0.5f ? 0.0f : 1.0f;
      const Vec3 way = h.goal - h.pose.p;
      const float far = length(way), step_length = std::min(far, h.speed * model->dt);
      if (far > 0) h.pose.p += way * (step_length / far);
      if (far < 0.015f) h.jaw_goal = random.uniform() < 0.7f ? 0.0f : 1.0f;
      h.pose.p = {std::clamp(h.pose.p.x, -0.25f, 0.25f), std::clamp(h.pose.p.y, -0.25f, 0.25f),
                  std::clamp(h.pose.p.z, -0.25f, 0.25f)};
      const float spin = length(h.spin);
      if (spin > 0) h.pose.q = normalized(axis_angle(h.spin / spin, spin * model->dt) * h.pose.q);
      h.jaw += std::clamp(h.jaw_goal - h.jaw, -0.2f, 0.2f);
      in.hand[k].pose = h.pose;
      in.hand[k].jaw = h.jaw;
    }
    const auto start = std::chrono::steady_clock::now();
    step(*model, *state, in, jobs);
    ms.push_back(std::chrono::duration<float, std::milli>(std::chrono::steady_clock::now() - start).count());
    ASSERT_TRUE(state_is_valid(*model, *state, 1.0f)) << "seed " << seed << ", tick " << i;
    for (const RigidBody& b : state->solver.body) ASSERT_LT(length(b.x), 1.0f) << "seed " << seed << ", tick " << i;
    out.largest_energy = std::max(out.largest_energy, kinetic_energy(*model, *state));
    for (const Event& e : state->event) {
      out.grasps += e.kind == EventKind::needle_grasped || e.kind == EventKind::thread_grasped;
      out.bites += e.kind == EventKind::tip_entered;
    }
    std::vector<uint32_t> order = state->solver.strand[0].order;
    std::sort(order.begin(), order.end());
    for (size_t n = 0; n < order.size(); ++n)
      ASSERT_EQ(order[n], model->solver.strand[0].first_slot + n) << "seed " << seed << ", tick " << i;
    double rest = 0;
    for (float r : state->solver.strand[0].rest) {
      ASSERT_GE(r, 0.0f) << "seed " << seed << ", tick " << i;
      rest += double{r};
    }
    ASSERT_NEAR(rest, double{model->solver.strand[0].spacing} * static_cast<double>(order.size() - 1), 1e-4)
        << "seed " << seed << ", tick " << i;
    // No dangling rows: rows of a bite exist only during one.
    if (phase_of(state->suture.suture[0]) == NeedlePhase::outside) {
      ASSERT_TRUE(state->solver.channel.empty() && !state->suture.suture[0].attached);
    }
    ASSERT_LE(state->solver.weld.size(), 4u);
  }
  // The hands disconnect: everything settles.
  TickInput none;
  for (ToolInput& h : none.hand) h.connected = 0;
  for (int i = 0; i < 180; ++i) step(*model, *state, none, jobs);
  ASSERT_TRUE(state_is_valid(*model, *state, 1.0f));
  EXPECT_LT(kinetic_energy(*model, *state), 0.02) << "seed " << seed;
  std::sort(ms.begin(), ms.end());
  out.median_ms = ms[ms.size() / 2], out.p99_ms = ms[ms.size() * 99 / 100];
}

void fling_all(int seeds, float seconds) {
  for (int seed = 1; seed <= seeds && !testing::Test::HasFatalFailure(); ++seed) {
    Fling f;
    fling(static_cast<uint64_t>(seed), seconds, f);
    std::printf("seed %d: largest kinetic energy %.3f J, %d grasps, %d bites begun, tick median %.2f ms, p99 %.2f ms\n", seed,
                f.largest_energy, f.grasps, f.bites, static_cast<double>(f.median_ms), static_cast<double>(f.p99_ms));
    std::fflush(stdout);
    EXPECT_LT(f.largest_energy,
              60.0);  // 5 m/s, the speed limit of a particle, for all of the tissue's scaled mass would be 2 kJ
  }
}

TEST(Fling, six_seconds_three_seeds) { fling_all(3, 6); }

TEST(Fling, sixty_seconds_ten_seeds) {
  if (!long_run()) GTEST_SKIP() << "set CATGUT_LONG=1";
  fling_all(10, 60);
}

}  // namespace
}  // namespace catgut
