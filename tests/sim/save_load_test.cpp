// SPDX-License-Identifier: Apache-2.0
// tests/sim: State is all that changes. A run that is saved, loaded into a fresh state and continued is identical to
// the run that continued. Same hash, same events, same Snapshot with all force patches. And reflect names every member.
#include <gtest/gtest-spi.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "core/archive.h"
#include "procedure/scene_file.h"
#include "runtime/hands.h"
#include "sim/model.h"
#include "sim/state.h"

namespace catgut {
namespace {

template <typename T>
std::vector<std::byte> bytes_of(const T& value) {
  std::vector<std::byte> out;
  ByteSink sink{out};
  Writer write(sink);
  write(value);
  return out;
}

// Saves `state`, loads it elsewhere, steps both and compares everything observable.
void step_both(const Model& model, State& state, const TickInput& input, Jobs& jobs, Jobs& other_jobs, StatePtr& other) {
  const std::vector<std::byte> saved = save_state(model, state);
  load_state(model, *other, saved);
  Snapshot went_on, loaded;
  publish(model, state, went_on), publish(model, *other, loaded);
  ASSERT_EQ(bytes_of(went_on), bytes_of(loaded)) << "loaded, before tick " << state.tick;
  step(model, state, input, jobs);
  step(model, *other, input, other_jobs);
  ASSERT_EQ(hash_state(model, state), hash_state(model, *other)) << "tick " << input.tick;
  ASSERT_EQ(bytes_of(state.event), bytes_of(other->event)) << "tick " << input.tick;
  publish(model, state, went_on), publish(model, *other, loaded);
  ASSERT_EQ(bytes_of(went_on), bytes_of(loaded)) << "tick " << input.tick;
}

// Events of the last tick are in the state: a stage may begin in the tick in which something was cut or torn.
TEST(SaveLoad, takes_every_event_and_fault) {
  const SceneSpec scene = read_scene("stay");
  const std::shared_ptr<const Model> model = build_model(scene);
  StatePtr state = initial_state(*model), other = initial_state(*model);
  const auto good = [&](const Event& event) {
    state->event.list.assign(1, event);
    load_state(*model, *other, save_state(*model, *state));
    EXPECT_EQ(bytes_of(other->event), bytes_of(state->event));
  };
  Event event;
  for (int kind = 0; kind < static_cast<int>(EventKind::count_); ++kind) {
    event.kind = static_cast<EventKind>(kind);
    EXPECT_NO_THROW(good(event)) << event_name(event.kind);
  }
  for (int fault = 0; fault < static_cast<int>(Fault::count_); ++fault) {
    event.fault = static_cast<Fault>(fault);
    EXPECT_NO_THROW(good(event)) << fault_name(event.fault);
  }
  event.fault = Fault::none, event.kind = EventKind::count_;
  EXPECT_THROW(good(event), InputError);
}

class EveryScene : public testing::TestWithParam<const char*> {};

TEST_P(EveryScene, saved_and_loaded_at_every_seventh_tick_goes_on_as_if_nothing_had_happened) {
  const bool whole = std::getenv("CATGUT_LONG") != nullptr;
  const SceneSpec scene = read_scene(GetParam());
  const std::shared_ptr<const Model> model = build_model(scene);
  const Hands hands = make_hands("scripted", scene, picture_model(*model));
  StatePtr state = initial_state(*model), other = initial_state(*model);
  Jobs one(1), two(2);
  Snapshot seen;
  publish(*model, *state, seen);
  const uint64_t settle = static_cast<uint64_t>(scene.settle / model->dt);
  const uint64_t last = whole ? 1000000 : settle + static_cast<uint64_t>(9 / model->dt);
  size_t compared = 0, in_tissue = 0, events = 0;
  for (TickInput input; input.tick < last && !hands.surgeon->done(); ++input.tick) {
    if (input.tick < settle) {
      for (ToolInput& h : input.hand) h.connected = 0;
    } else {
      const TickInput wanted = hands.surgeon->operate(seen, model->dt);
      input.hand = wanted.hand, input.commands = wanted.commands;
    }
    if (input.tick % 7 == 0) {
      // A run with one worker is compared with one with two, and vice versa.
      Jobs &mine = compared % 2 ? one : two, &others = compared % 2 ? two : one;
      ASSERT_NO_FATAL_FAILURE(step_both(*model, *state, input, mine, others, other));
      ++compared;
      in_tissue += !state->suture.suture[0].open.empty();
      events += state->event.size();
    } else {
      step(*model, *state, input, one);
    }
    publish(*model, *state, seen);
  }
  std::printf("%s: %zu ticks compared, %zu with the needle in the tissue, %zu events in them\n", GetParam(), compared,
              in_tissue, events);
  EXPECT_GT(compared, 70u);
  EXPECT_GT(in_tissue, 5u);
  EXPECT_FALSE(hands.surgeon->gave_up()) << "the procedure was not whole";
}

INSTANTIATE_TEST_SUITE_P(Scenes, EveryScene,
                         testing::Values("purse_string", "connell", "stay", "lembert", "stress_one_body", "stress_two_bodies",
                                         "two_sutures", "clamps", "three_hands", "interrupted"),
                         [](const auto& scene) { return std::string(scene.param); });

// A jaw closes in the tick directly after a load: nearby objects must be found by then.
TEST(SaveLoad, jaws_that_close_on_tissue_right_after_a_load_hold_it) {
  const std::shared_ptr<const Model> model = build_model(read_scene("purse_string"));
  StatePtr state = initial_state(*model), other = initial_state(*model);
  Jobs one(1), two(2);
  const uint32_t rim = model->technique.purse_string.rim_outer[0];
  TickInput input;
  input.hand[1].connected = 0;
  input.hand[0].pose.q = axis_angle({1, 0, 0}, -0.5f * kPi);  // points down
  for (int i = 0; i < 30; ++i, ++input.tick) {
    input.hand[0].pose.p = xyz(state->solver.x[rim]) + Vec3{0, 0.001f, 0};
    step(*model, *state, input, one);
  }
  input.hand[0].jaw = 0;
  step_both(*model, *state, input, one, two, other);
  const auto grasped = [](const Event& e) { return e.kind == EventKind::tissue_grasped; };
  EXPECT_TRUE(std::any_of(other->event.begin(), other->event.end(), grasped)) << "there was nothing to hold";
}

TEST(SaveLoad, the_hash_of_a_state_is_that_of_its_bytes) {
  const std::shared_ptr<const Model> model = build_model(read_scene("stay"));
  StatePtr state = initial_state(*model);
  Jobs jobs(1);
  TickInput input;
  for (int i = 0; i < 5; ++i) step(*model, *state, input, jobs);
  const std::vector<std::byte> bytes = save_state(*model, *state);
  EXPECT_EQ(hash_state(*model, *state), hash_bytes(bytes.data(), bytes.size()));
}

// --- reflect names every member ---------------------------------------------------------------------------------------------

// Ranges of the members that reflect names. A gap between two of them must be padding: less than the next one's alignment.
struct Members : Archive<Members> {
  struct Member {
    std::ptrdiff_t at, size, align;
  };
  const char* base;
  std::vector<Member> member;
  explicit Members(const void* of) : base(static_cast<const char*>(of)) {}
  template <typename T>
  void operator()(T& v) {
    cache(v);
    look_into(v);
  }
  template <typename T>
  void cache(T& v) {
    member.push_back({reinterpret_cast<const char*>(&v) - base, sizeof v, alignof(T)});
  }
  template <typename T>
  static void look_into(T& v);
};

template <typename T>
void expect_every_member(T& value) {
  Members m(&value);
  reflect(m, value);
  std::sort(m.member.begin(), m.member.end(), [](const auto& a, const auto& b) { return a.at < b.at; });
  std::ptrdiff_t end = 0;
  for (const Members::Member& next : m.member) {
    EXPECT_LT(next.at - end, next.align) << "a member before byte " << next.at << " of " << __PRETTY_FUNCTION__;
    end = next.at + next.size;
  }
  EXPECT_LT(static_cast<std::ptrdiff_t>(sizeof value) - end, static_cast<std::ptrdiff_t>(alignof(T)))
      << "the last member of " << __PRETTY_FUNCTION__;
}

template <typename T>
void Members::look_into(T& v) {
  using Plain = std::remove_cvref_t<T>;
  if constexpr (kIsVector<Plain>) {
    typename Plain::value_type element{};
    look_into(element);
  } else if constexpr (kIsArray<Plain>) {
    for (auto& element : v) look_into(element);
  } else if constexpr (!kLeaf<Plain>) {
    expect_every_member(v);
  }
}

TEST(Reflect, names_every_member_of_the_state_and_of_the_snapshot) {
  for (const char* scene : {"stay", "interrupted"}) {
    const std::shared_ptr<const Model> model = build_model(read_scene(scene));
    expect_every_member(*initial_state(*model));
  }
  Snapshot snapshot;
  expect_every_member(snapshot);
}

struct Forgetful {
  float named = 0, forgotten = 0, last = 0;
};
constexpr void reflect(auto& a, Like<Forgetful> auto& f) { a(f.named), a(f.last); }

TEST(Reflect, the_test_itself_notices_a_forgotten_member) {
  Forgetful f;
  EXPECT_NONFATAL_FAILURE(expect_every_member(f), "a member before byte 8");
}

TEST(Reflect, types_without_padding_are_copied_whole_and_others_are_not) {
  EXPECT_TRUE(kPacked<EmbeddedPoint> && kPacked<Weld> && kPacked<Attachment> && kPacked<Tether> && kPacked<Vec4>);
  EXPECT_FALSE(kPacked<ThreadAnchor>) << "its flags could be read as values that no flag has";
  EXPECT_FALSE(kPacked<Forgetful>);
  EXPECT_FALSE(kPacked<Event>);
}

// A strand that will sleep soon has noted what it presses on, and so has one that sleeps.
TEST(SaveLoad, thread_that_falls_asleep_is_saved_at_any_tick) {
  const SceneSpec scene = read_scene("interrupted");
  const std::shared_ptr<const Model> model = build_model(scene);
  const Hands hands = make_hands("scripted", scene, picture_model(*model));
  StatePtr state = initial_state(*model), other = initial_state(*model);
  Jobs one(1), two(2);
  Snapshot seen;
  publish(*model, *state, seen);
  TickInput rest;
  for (ToolInput& hand : rest.hand) hand.connected = 0;
  int before = 0, asleep = 0;
  for (int t = 0; t < 60 * 40 && asleep == 0; ++t) {
    TickInput input = t < 30 || hands.surgeon->done() ? rest : hands.surgeon->operate(seen, model->dt);
    input.tick = state->tick;
    const physical::Sleep& sleep = state->physical.world.sleep;
    const bool noted = !sleep.load.empty(), sleeps = noted && sleep.strand[sleep.load[0].strand].asleep;
    before += noted && !sleeps, asleep += sleeps;
    if (noted) ASSERT_NO_FATAL_FAILURE(step_both(*model, *state, input, one, two, other));
    else step(*model, *state, input, one);
    publish(*model, *state, seen);
  }
  std::printf("%d ticks before it sleeps, %d asleep\n", before, asleep);
  EXPECT_GT(before, 5);
  EXPECT_GT(asleep, 0);
}

}  // namespace
}  // namespace catgut
