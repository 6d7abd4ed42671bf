// SPDX-License-Identifier: Apache-2.0
// tests/instrument: commands exchange instruments, a parked clamp holds and pulls, and everything replays to the bit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/check.h"
#include "procedure/scene_file.h"
#include "runtime/session.h"
#include "sim/model.h"
#include "sim/recording.h"
#include "sim/state.h"

namespace catgut {
namespace {

// A bowel end with its rim at the origin, and instruments given as text.
SceneSpec scene_with(const std::string& instruments) {
  return parse_scene(R"(title = "instruments"
settle = 0.05
[[body]]
particles = 600
[thread]
particles = 30
[technique]
name = "none"
)" + instruments,
                     "instruments");
}

const char* const kFour = R"(
[[instrument]]
kind = "needle_holder"
where = "right"
[[instrument]]
kind = "forceps"
where = "left"
[[instrument]]
kind = "allis"
[[instrument]]
kind = "scissors"
)";

struct Field {
  std::shared_ptr<const Model> model;
  StatePtr state;
  Jobs jobs{1};
  TickInput input;
  Snapshot seen;
  std::vector<Event> events;
  std::vector<TickInput> inputs;
  std::vector<uint64_t> hashes;

  explicit Field(const SceneSpec& scene) : model(build_model(scene)), state(initial_state(*model)) {
    input.hand = no_hands();
    publish(*model, *state, seen);
  }
  void connect(size_t hand, Vec3 at) {
    input.hand[hand].connected = 1;
    input.hand[hand].pose = {at, axis_angle({1, 0, 0}, -0.5f * kPi)};  // points down
  }
  void tick() {
    inputs.push_back(input);
    step(*model, *state, input, jobs);
    publish(*model, *state, seen);
    for (const Event& e : seen.event) events.push_back(e);
    hashes.push_back(hash_state(*model, *state));
    input.commands.clear();
    ++input.tick;
  }
  void run(int ticks) {
    for (int i = 0; i < ticks; ++i) tick();
  }
  void order(CommandKind kind, uint8_t hand, uint16_t argument = 0) {
    input.commands.push({kind, hand, argument});
    tick();
  }
  size_t count(EventKind kind) const {
    return static_cast<size_t>(std::count_if(events.begin(), events.end(), [&](const Event& e) { return e.kind == kind; }));
  }
  InstrumentPlace place(size_t i) const { return seen.instrument[i].place; }
};

TEST(Instrument, a_scene_without_a_list_has_the_papers_two) {
  Field f(scene_with(""));
  ASSERT_EQ(f.seen.instrument.size(), 2u);
  const PictureModel picture = picture_model(*f.model);
  EXPECT_EQ(picture.instrument[0].kind, "needle_holder");
  EXPECT_EQ(picture.instrument[1].kind, "forceps");
  EXPECT_EQ(f.seen.tool[0].instrument, 0);
  EXPECT_EQ(f.seen.tool[1].instrument, 1);
  EXPECT_EQ(f.seen.tool[2].instrument, -1);
}

TEST(Instrument, every_row_of_the_table_can_be_in_a_scene) {
  for (const InstrumentModel& kind : instrument_table()) {
    Field f(scene_with("[[instrument]]\nkind = \"" + kind.name + "\"\nwhere = \"right\"\n"));
    f.connect(0, {0.05f, 0.05f, 0});
    f.run(30);
    EXPECT_TRUE(state_is_valid(*f.model, *f.state)) << kind.name;
    EXPECT_LT(distance(f.seen.tool[0].pose.p, f.input.hand[0].pose.p), 1e-3f) << kind.name << " does not follow its hand";
    for (uint32_t bit = 1; bit <= kAbsorb; bit <<= 1) EXPECT_STRNE(capability_name(bit), "");
  }
}

TEST(Instrument, unknown_kinds_and_two_in_one_hand_are_refused) {
  EXPECT_THROW(build_model(scene_with("[[instrument]]\nkind = \"alis\"\n")), InputError);
  EXPECT_THROW(build_model(scene_with("[[instrument]]\nwhere = \"left\"\n[[instrument]]\nwhere = \"left\"\n")), InputError);
  EXPECT_THROW(build_model(scene_with("[[instrument]]\nkind = \"forceps\"\nwhere = \"parked\"\n")), InputError);
}

TEST(Instrument, a_hand_swaps_lays_down_and_takes) {
  Field f(scene_with(kFour));
  f.connect(0, {0.05f, 0.05f, 0});
  f.run(5);
  f.order(CommandKind::swap, 0, 3);
  EXPECT_EQ(f.place(0), InstrumentPlace::tray);
  EXPECT_EQ(f.place(3), InstrumentPlace::hand);
  EXPECT_EQ(f.seen.tool[0].instrument, 3);
  f.run(20);
  EXPECT_LT(distance(f.seen.instrument[3].pose.p, f.input.hand[0].pose.p), 1e-3f);
  const Vec3 on_tray = f.seen.instrument[0].pose.p;
  f.run(20);
  EXPECT_EQ(f.seen.instrument[0].pose.p, on_tray) << "what lies on the tray does not move";
  f.order(CommandKind::lay_down, 0);
  EXPECT_EQ(f.seen.tool[0].instrument, -1);
  f.order(CommandKind::take, 0, 0);
  EXPECT_EQ(f.seen.tool[0].instrument, 0);
  EXPECT_EQ(f.count(EventKind::instrument_refused), 0u);
  EXPECT_EQ(f.count(EventKind::instrument_taken), 2u);
  EXPECT_EQ(f.count(EventKind::instrument_laid_down), 2u);
}

TEST(Instrument, what_cannot_be_done_changes_nothing) {
  Field f(scene_with(kFour));
  f.connect(0, {0.05f, 0.05f, 0});
  f.run(5);
  f.order(CommandKind::take, 0, 2);    // the hand is not empty
  f.order(CommandKind::swap, 0, 1);    // in the other hand
  f.order(CommandKind::swap, 0, 99);   // no such instrument
  f.order(CommandKind::park, 0);       // holds nothing
  f.order(CommandKind::lay_down, 1);   // not connected
  f.order(CommandKind::unpark, 0, 2);  // not parked
  EXPECT_EQ(f.count(EventKind::instrument_refused), 6u);
  EXPECT_EQ(f.seen.tool[0].instrument, 0);
  EXPECT_EQ(f.place(1), InstrumentPlace::hand);
  EXPECT_EQ(f.place(2), InstrumentPlace::tray);
}

// The hand clamps the rim's outer side with an Allis.
void clamp_the_rim(Field& f) {
  const PictureModel picture = picture_model(*f.model);
  const Vec3 rim = picture.particle_rest[picture.rim[0][0]];
  f.connect(0, rim + Vec3{0, 0.02f, 0});
  f.input.hand[0].jaw = 1;
  f.run(5);
  f.order(CommandKind::swap, 0, 2);
  for (int i = 0; i < 60 && f.count(EventKind::tissue_grasped) == 0; ++i) {
    f.input.hand[0].pose.p.y -= 0.0004f;
    f.input.hand[0].jaw = i % 2 ? 1.0f : 0.0f;
    f.tick();
  }
  f.input.hand[0].jaw = 0;
  f.tick();
}

TEST(Instrument, a_clamp_is_parked_holds_on_and_is_taken_up_again) {
  Field f(scene_with(kFour));
  clamp_the_rim(f);
  ASSERT_EQ(f.seen.instrument[2].held, Held::tissue);
  f.order(CommandKind::park, 0);
  EXPECT_EQ(f.place(2), InstrumentPlace::parked);
  EXPECT_EQ(f.seen.tool[0].instrument, -1);
  f.input.hand[0].jaw = 1;  // an open hand that has left the clamp does not open it
  f.run(120);
  EXPECT_EQ(f.seen.instrument[2].held, Held::tissue);
  EXPECT_EQ(f.count(EventKind::tissue_released), 0u);
  f.input.hand[0].jaw = 0;
  f.input.hand[0].pose = f.seen.instrument[2].pose;
  f.run(2);
  f.order(CommandKind::unpark, 0, 2);
  EXPECT_EQ(f.seen.tool[0].instrument, 2);
  EXPECT_EQ(f.seen.tool[0].held, Held::tissue);
  // Taken again it follows the hand, with the tissue; the open jaws release.
  f.input.hand[0].jaw = 1;
  f.run(3);
  EXPECT_EQ(f.seen.tool[0].held, Held::nothing);
  EXPECT_EQ(f.count(EventKind::tissue_released), 1u);
  EXPECT_EQ(f.count(EventKind::instrument_refused), 0u);
}

// A ratchet: the jaw of a device is open after it has worked with something else. Closed and opened, it lets go.
TEST(Instrument, a_clamp_that_an_open_hand_takes_up_holds_on_until_the_hand_has_closed) {
  for (const char* kind : {"guided", "physical"}) {
    Field f(scene_with("[[instrument]]\nkind = \"allis\"\nwhere = \"parked\"\nat = [0.02, 0.0, 0.0]\n[mechanics]\nkind = \"" +
                       std::string(kind) + "\"\n"));
    f.input.hand[0].jaw = 1;
    f.run(30);
    ASSERT_EQ(f.seen.instrument[0].held, Held::tissue) << kind;
    f.connect(0, f.seen.instrument[0].pose.p);
    f.order(CommandKind::unpark, 0, 0);
    ASSERT_EQ(f.seen.tool[0].instrument, 0) << kind;
    f.run(30);
    EXPECT_EQ(f.seen.tool[0].held, Held::tissue) << kind;
    f.input.hand[0].jaw = 0;
    f.run(5);
    EXPECT_EQ(f.seen.tool[0].held, Held::tissue) << kind;
    f.input.hand[0].jaw = 1;
    f.run(30);
    EXPECT_EQ(f.seen.tool[0].held, Held::nothing) << kind;
  }
}

TEST(Instrument, a_clamp_is_taken_over_from_an_assistant_and_not_from_the_other_hand) {
  for (const char* where : {"assistant_right", "left"}) {
    const size_t other = where == std::string("left") ? 1 : 2;
    Field f(scene_with("[[instrument]]\nkind = \"allis\"\nwhere = \"parked\"\nat = [0.02, 0.0, 0.0]\n"));
    f.run(30);
    f.connect(other, f.seen.instrument[0].pose.p);
    f.order(CommandKind::unpark, other, 0);
    ASSERT_EQ(f.seen.tool[other].held, Held::tissue);
    f.connect(0, f.seen.instrument[0].pose.p + Vec3{0.05f, 0, 0});
    f.order(CommandKind::unpark, 0, 0);
    f.run(30);
    EXPECT_EQ(f.seen.tool[other == 2 ? 0 : 1].instrument, 0) << where;
    EXPECT_EQ(f.seen.tool[other == 2 ? 0 : 1].held, Held::tissue) << where;
    EXPECT_EQ(f.seen.tool[other == 2 ? 2 : 0].instrument, -1) << where;
    EXPECT_EQ(f.count(EventKind::tissue_released), 0u);
  }
}

// At equilibrium the tissue carries the stated force, and deforms in proportion to it.
TEST(Instrument, a_parked_clamp_pulls_with_the_stated_force) {
  Field bare(scene_with(""));
  bare.run(240);
  float moved[2];  // [m]
  for (int i = 0; i < 2; ++i) {
    const float pull = i == 0 ? 0.2f : 0.4f;  // [N]
    Field f(scene_with("[[instrument]]\nkind = \"allis\"\nwhere = \"parked\"\nat = [0.02, 0.0, 0.0]\npull = [" +
                       std::to_string(pull) + ", 0.0, 0.0]\n"));
    f.run(240);
    const InstrumentView& v = f.seen.instrument[0];
    EXPECT_EQ(v.held, Held::tissue);
    EXPECT_NEAR(v.pull.x, pull, 0.05f * pull);
    EXPECT_LT(std::hypot(v.pull.y, v.pull.z), 0.05f * pull);
    EXPECT_TRUE(state_is_valid(*f.model, *f.state));
    moved[i] = f.seen.particle[v.held_slot].x - bare.seen.particle[v.held_slot].x;
  }
  EXPECT_GT(moved[0], 0.0f);
  EXPECT_NEAR(moved[1] / moved[0], 2, 0.4);
}

// At equilibrium the tissue carries what the cord has left.
TEST(Instrument, a_cord_slackens_as_its_clamp_goes_with_it) {
  Field f(
      scene_with("[[instrument]]\nkind = \"allis\"\nwhere = \"parked\"\nat = [0.02, 0.0, 0.0]\n"
                 "pull = [0.4, 0.0, 0.0]\nstretch = 0.002\n"));
  const float from = f.seen.instrument[0].pose.p.x;
  f.run(240);
  const InstrumentView& v = f.seen.instrument[0];
  const float left = 1 - (v.pose.p.x - from) / 0.002f;
  EXPECT_EQ(v.held, Held::tissue);
  EXPECT_LT(left, 0.8f);
  EXPECT_GT(left, 0.4f);
  EXPECT_NEAR(v.pull.x, 0.4f * left, 0.02f * 0.4f);
}

// A piece of bowel that nothing else holds does not fly away with its clamps, as it would with a constant pull.
TEST(Instrument, cords_lift_a_free_piece_no_farther_than_they_were_stretched) {
  for (const float stretch : {0.0f, 0.02f}) {
    std::string clamps = "[mechanics]\nkind = \"physical\"\n";
    for (const char* at : {"0.02", "-0.02"})
      clamps += "[[instrument]]\nkind = \"allis\"\nwhere = \"parked\"\nat = [" + std::string(at) +
                ", 0.0, 0.0]\npull = [0.0, 0.5, 0.0]\nstretch = " + std::to_string(stretch) + "\n";
    SceneSpec scene = scene_with(clamps);
    scene.body[0].pinned_length = 0;
    Field f(scene);
    const float from = f.seen.instrument[0].pose.p.y;
    f.run(60);
    const float after_a_second = f.seen.instrument[0].pose.p.y - from;
    f.run(60);
    const float after_two = f.seen.instrument[0].pose.p.y - from;
    if (stretch == 0) {
      EXPECT_GT(after_two, 0.2f);
      continue;
    }
    EXPECT_NEAR(after_two, after_a_second, 1e-4f);
    EXPECT_GT(after_two, 0.1f * stretch);
    EXPECT_LT(after_two, stretch);
  }
}

// Without a stated force: its weight, downward, unless the clamp lies on the drape.
TEST(Instrument, a_parked_clamp_pulls_with_its_weight) {
  Field f(scene_with("[[instrument]]\nkind = \"allis\"\nwhere = \"parked\"\nat = [0.02, 0.0, 0.0]\n"));
  f.run(240);
  const float weight = 9.81f / f.model->solver.body[0].inv_mass;
  EXPECT_EQ(f.seen.instrument[0].held, Held::tissue);
  EXPECT_LT(f.seen.instrument[0].pull.y, 0.0f);
  EXPECT_LT(length(f.seen.instrument[0].pull), 1.2f * weight) << "it cannot pull harder than it weighs";
}

// Above an Allis's grip force: it slips off, as an event without a hand.
TEST(Instrument, a_clamp_that_is_pulled_too_hard_slips) {
  Field f(scene_with("[[instrument]]\nkind = \"allis\"\nwhere = \"parked\"\nat = [0.02, 0.0, 0.0]\npull = [20.0, 0.0, 0.0]\n"));
  f.run(240);
  ASSERT_EQ(f.count(EventKind::tissue_released), 1u);
  const auto slipped =
      std::find_if(f.events.begin(), f.events.end(), [](auto& e) { return e.kind == EventKind::tissue_released; });
  EXPECT_EQ(slipped->who, kNoHand);
  EXPECT_GT(slipped->value, find_instrument("allis")->tissue_grip);
  EXPECT_EQ(f.seen.instrument[0].held, Held::nothing);
}

// Clamp, park, take: replayed from the start and from a saved state, for any number of workers.
TEST(Instrument, commands_replay_to_the_bit) {
  Field f(scene_with(kFour));
  clamp_the_rim(f);
  f.order(CommandKind::park, 0);
  const size_t at = f.inputs.size();
  const std::vector<std::byte> saved = save_state(*f.model, *f.state);
  f.run(30);
  f.order(CommandKind::take, 0, 0);
  f.run(30);
  for (const size_t from : {size_t{0}, at}) {
    StatePtr state = initial_state(*f.model);
    if (from > 0) load_state(*f.model, *state, saved);
    Jobs jobs(2);
    for (size_t i = from; i < f.inputs.size(); ++i) {
      step(*f.model, *state, f.inputs[i], jobs);
      ASSERT_EQ(hash_state(*f.model, *state), f.hashes[i]) << "tick " << i;
    }
  }
}

// Three hands: each moves its own instrument; a hand without one in the scene takes one from the tray.
TEST(Instrument, three_hands_hold_three_instruments) {
  Field f(scene_with(std::string(kFour) + "[[instrument]]\nkind = \"retractor\"\nwhere = \"assistant_right\"\n"));
  f.connect(0, {0.08f, 0.06f, 0.03f});
  f.connect(1, {-0.08f, 0.06f, 0.03f});
  f.connect(2, {0.0f, 0.08f, -0.08f});
  f.connect(3, {0.0f, 0.10f, 0.10f});
  f.run(20);
  f.order(CommandKind::take, 3, 3);
  f.run(20);
  const int has[] = {0, 1, 4, 3};
  for (size_t k = 0; k < kMaxHands; ++k) {
    EXPECT_EQ(f.seen.tool[k].instrument, has[k]);
    EXPECT_LT(distance(f.seen.tool[k].pose.p, f.input.hand[k].pose.p), 1e-3f) << k;
  }
}

// The scenes of this repository with more instruments and more hands run, and their recordings replay.
TEST(Instrument, scenes_with_clamps_three_hands_and_two_sutures_record_and_replay) {
  for (const char* name : {"clamps", "three_hands", "two_sutures"}) {
    const SceneSpec scene = read_scene(name);
    SessionOptions options;
    options.surgeon = "scripted";
    options.seconds = 3;
    options.threads = 2;
    options.record = testing::TempDir() + name + ".cgrec";
    const RunResult run = run_session(scene, options, {});
    const ReplayResult replay = replay_session(read_recording(options.record), options.record, true, 1, {});
    EXPECT_FALSE(replay.differs_at.has_value()) << name;
    EXPECT_EQ(replay.run.state_hash, run.state_hash) << name;
  }
}

}  // namespace
}  // namespace catgut
