// SPDX-License-Identifier: Apache-2.0
// tests/procedure: procedures as data. Every file of procedures/ is carried out by the scripted surgeon; wrong orders and
// missing steps are carried out too and have to be reported with their reason; errors of a file name its line.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

#include "core/check.h"
#include "procedure/manager.h"
#include "procedure/measures.h"
#include "procedure/procedure_file.h"
#include "procedure/scene_file.h"
#include "procedure/scripted_surgeon.h"
#include "runtime/session.h"
#include "sim/simulation.h"

namespace catgut {
namespace {

std::string read_file(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

constexpr const char* kHead = "title = \"t\"\nscene = \"stay\"\n";
constexpr const char* kStage = "[[stage]]\nname = \"a\"\ntitle = \"A\"\ntext = \"Do a.\"\ngoal = {needle_in_holder = 1}\n";

std::string fault(const std::string& text) {
  try {
    parse_procedure(text, "p.toml");
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    return error.what();
  }
  return "no fault";
}

TEST(ProcedureFile, every_error_names_its_line_and_the_nearest_word) {
  const std::string good = std::string(kHead) + kStage;
  EXPECT_EQ(fault(good), "no fault");
  const struct {
    std::string text, place, says;
  } kBad[] = {
      {"title = \"t\"\n", "p.toml", "a procedure has no \"scene\""},
      {"title = \"t\"\nscene = \"stya\"\n" + std::string(kStage), "p.toml:2", "did you mean \"stay\"?"},
      {std::string(kHead) + "technique = \"lembert\"\n" + kStage, "p.toml:3", "has technique \"stay\""},
      {std::string(kHead) + "tray = [\"neeedle_holder\"]\n" + kStage, "p.toml", "did you mean \"needle_holder\"?"},
      {good + "gaol = 1\n", "p.toml:8", "did you mean \"goal\"?"},
      {std::string(kHead) + "[[stages]]\n", "p.toml:3", "did you mean \"stage\"?"},
      {std::string(kHead) + "[[stage]]\nname = \"a\"\ntitle = \"A\"\ntext = \"x\"\n", "p.toml:3", "has no \"goal\""},
      {std::string(kHead) + "[[stage]]\nname = \"a\"\ntitle = \"A\"\ntext = \"x\"\ngoal = {bite = {min = 1}}\n", "p.toml:7",
       "did you mean \"bites\"?"},
      {good + "good = {time_s = {most = 3}}\n", "p.toml:8", "\"most\" is not a bound"},
      {good + "good = {time_s = {min = 3, max = 2}}\n", "p.toml:8", "min is above max"},
      {good + "demo = [\"bit 1\"]\n", "p.toml:8", "did you mean \"bite\"?"},
      {good + "demo = [\"bite x\"]\n", "p.toml:8", "write for example \"bite 2\""},
      {good + "demo_from = \"b\"\n", "p.toml:8", "no stage \"b\""},
      {good + "repeat = {from = \"a\", times = 1}\n", "p.toml:8", "a whole number from 2 to 100"},
      {good + "skip = {when = {bites = 1}}\n", "p.toml:8", "has no \"text\""},
      {good + kStage, "p.toml:8", "two stages have the name \"a\""},
      {good + "[[error]]\nname = \"e\"\ntext = \"E.\"\nwhy = \"W.\"\n", "p.toml:8", "needs either \"on\""},
      {good + "[[error]]\nname = \"e\"\ntext = \"E.\"\nwhy = \"W.\"\non = \"throw_start\"\n", "p.toml:12",
       "did you mean \"throw_started\"?"},
      {good + "[[error]]\nname = \"e\"\ntext = \"E.\"\nwhy = \"W.\"\non = \"thread_cut\"\nin = [\"b\"]\n", "p.toml:13",
       "no stage \"b\""},
      {good + "title = \n", "p.toml:8", ""},
  };
  for (const auto& bad : kBad) {
    const std::string says = fault(bad.text);
    EXPECT_EQ(says.rfind(bad.place, 0), 0u) << says << "\nin\n" << bad.text;
    EXPECT_NE(says.find(bad.says), std::string::npos) << says;
  }
}

TEST(ProcedureFile, repeated_stages_are_numbered) {
  const Procedure p = read_procedure("purse_string");
  ASSERT_EQ(p.stage.size(), 25u);
  EXPECT_EQ(p.stage[1].name, "bite 1");
  EXPECT_EQ(p.stage[3].title, "Bite 2 of 12");
  EXPECT_EQ(p.stage[22].name, "reload 11");
  EXPECT_EQ(p.stage[3].demo.front().number, 2u);
  EXPECT_EQ(find_stage(p, "bite 7", "--stage"), 13u);
  EXPECT_EQ(find_stage(p, "24", "--stage"), 23u);
}

TEST(ProcedureFile, the_page_lists_every_measure) {
  const std::string page = read_file(std::string(CATGUT_SOURCE_DIR) + "/docs/procedures.md");
  for (const Measure& m : measures())
    if (m.value) { EXPECT_NE(page.find("| `" + m.name + "` |"), std::string::npos) << m.name; }
}

// A scene with hands that carry out tasks of the plan, in any order.
struct Field {
  explicit Field(const Procedure& p, int threads = 1) : procedure(p), scene(scene_of(p)), jobs(threads) {
    model = build_model(scene);
    picture = picture_model(*model);
    state = initial_state(*model);
    TickInput nothing;
    for (ToolInput& hand : nothing.hand) hand.connected = 0;
    while (seen.time_s < static_cast<double>(scene.settle)) go(nothing);
    begin_run(run, procedure, seen, dt);
  }
  void go(const TickInput& in) {
    step(*model, *state, in, jobs);
    publish(*model, *state, seen);
    update_run(run, procedure, seen);
  }
  void carry_out(
      Surgeon& surgeon, const std::function<bool()>& enough = [] { return false; }) {
    while (!surgeon.done() && !finished(run, procedure) && !enough() && seen.time_s < 420)
      go(surgeon.operate(seen, static_cast<float>(dt)));
  }
  void carry_out(const std::vector<size_t>& tasks) {
    carry_out(*make_demonstrator(plan_of(scene), picture, skill_of(scene), tasks));
  }
  size_t errors(const std::string& name) const {
    size_t n = 0;
    for (const ErrorNote& e : run.error)
      n += (e.error < procedure.error.size() ? procedure.error[e.error].name : "skipped") == name;
    return n;
  }
  Procedure procedure;
  SceneSpec scene;
  std::shared_ptr<const Model> model;
  PictureModel picture;
  StatePtr state;
  Jobs jobs;
  Snapshot seen;
  ProcedureRun run;
  double dt = 1.0 / 60;
};

class EveryProcedure : public testing::TestWithParam<std::string> {};

TEST_P(EveryProcedure, is_carried_out_by_the_scripted_surgeon_without_an_error) {
  const Procedure procedure = read_procedure(GetParam());
  if (read_scene(procedure.scene).mechanics.kind == "physical" && !std::getenv("CATGUT_LONG"))
    GTEST_SKIP() << "a minute and more with physical mechanics: CATGUT_LONG=1 runs it";
  Field field(procedure);
  for (size_t k = 0; k < field.procedure.stage.size(); ++k) demo_tasks(field.procedure, k, field.scene, field.picture);
  const auto surgeon = scripted_surgeon(field.scene, field.picture);
  field.carry_out(*surgeon);
  EXPECT_TRUE(faultless(field.run, field.procedure)) << run_table(field.run, field.procedure);
  // Pulling the thread through may close the lips of the skin before the stage that asks for it.
  for (size_t k = 0; k < field.procedure.stage.size(); ++k) {
    const bool early = field.procedure.scene == "skin" && field.procedure.stage[k].name == "approximate";
    const StageState state = field.run.record[k].state;
    EXPECT_TRUE(state == StageState::done || (early && state == StageState::met)) << field.procedure.stage[k].name;
  }
}
INSTANTIATE_TEST_SUITE_P(Procedures, EveryProcedure, testing::ValuesIn(procedure_names()),
                         [](const auto& i) { return i.param; });

// The worked example of the educator's page.
TEST(ProcedureFile, the_example_of_the_page_runs) {
  const std::string page = read_file(std::string(CATGUT_SOURCE_DIR) + "/docs/procedures.md"),
                    fence = "```toml\n# one_bite.toml";
  const size_t from = page.find(fence);
  ASSERT_NE(from, std::string::npos);
  const size_t start = from + 8;
  Field field(parse_procedure(page.substr(start, page.find("```", start) - start), "one_bite.toml"));
  field.carry_out(*scripted_surgeon(field.scene, field.picture));
  EXPECT_TRUE(faultless(field.run, field.procedure)) << run_table(field.run, field.procedure);
}

// Tasks of the stay suture: 0 pick_up, 1 bite, 2 hand_back, 3 bite, 4 pull_tail, 5 draw, 6 regrip, 7 throw, 8 throw.
TEST(WrongSurgery, a_knot_after_one_bite_is_reported_with_its_reason) {
  Field field(read_procedure("stay"));
  field.carry_out({0, 1, 4, 6, 7});
  EXPECT_GE(field.errors("early throw"), 1u) << run_table(field.run, field.procedure);
  EXPECT_FALSE(faultless(field.run, field.procedure));
  EXPECT_EQ(field.run.record[3].state, StageState::active) << "the right bite is missing, not skipped";
  EXPECT_EQ(field.run.record[4].state, StageState::waiting);
  const std::string table = run_table(field.run, field.procedure);
  EXPECT_NE(table.find("First both bites"), std::string::npos) << table;
  EXPECT_NE(table.find("right bite                 not finished"), std::string::npos) << table;
  EXPECT_NE(table.find("not reached"), std::string::npos);
}

TEST(WrongSurgery, a_throw_before_approximation_is_a_skipped_stage) {
  Field field(read_procedure("stay"));
  field.carry_out({0, 1, 2, 3, 4, 6, 7});
  const std::string table = run_table(field.run, field.procedure);
  EXPECT_EQ(field.run.record[5].state, StageState::skipped) << table;
  EXPECT_EQ(field.errors("skipped"), 1u) << table;
  EXPECT_NE(table.find("before the edges were together"), std::string::npos) << table;
  EXPECT_EQ(field.run.record[6].state, StageState::done) << table;
}

TEST(WrongSurgery, the_needle_cut_off_at_once_is_reported) {
  Field field(read_procedure("stay"));
  const std::vector<size_t> cut =
      demo_tasks(field.procedure, find_stage(field.procedure, "cut", ""), field.scene, field.picture);
  field.carry_out({0, 1, 2, 3, 4, 5, 6, cut.front()});
  EXPECT_EQ(field.errors("early cut"), 1u) << run_table(field.run, field.procedure);
  EXPECT_FALSE(finished(field.run, field.procedure));
}

// --- the manager alone, with Snapshots made by hand ----------------------------------------------------------------------

Procedure small() {
  return parse_procedure(std::string(kHead) + R"(
[[stage]]
name = "take"
title = "Take"
text = "Take it."
goal = {needle_in_holder = 1}
[[stage]]
name = "wrap"
title = "Wrap"
text = "Wrap it."
goal = {wraps = {min = 1}}
guard = {when = {tissue_held = 1}, text = "Hold the tissue first."}
[[stage]]
name = "throw"
title = "Throw"
text = "Throw it."
goal = {throw_started = {min = 1}}
skip = {when = {thread_cut = {min = 1}}, text = "The thread is gone.", error = true}
[[stage.hint]]
when = {holder_holds_thread = 1}
text = "pull"
[[stage.hint]]
text = "grasp"
[[error]]
name = "dropped"
on = "needle_released"
value = 0.5
in = ["wrap"]
text = "Dropped."
why = "Hold it."
[[error]]
name = "hard"
when = {peak_force_n = {min = 5}}
text = "Too hard."
why = "Gently."
)",
                         "small.toml");
}

struct Hand {
  Procedure p = small();
  Snapshot seen;
  ProcedureRun run;
  Hand() {
    seen.instrument.resize(1);
    begin_run(run, p, seen, 0.01);
  }
  void tick(std::vector<Event> events = {}) {
    ++seen.tick;
    seen.event = std::move(events);
    update_run(run, p, seen);
  }
};

TEST(Manager, a_goal_counts_only_after_its_guard) {
  Hand h;
  h.tick();
  EXPECT_EQ(h.run.stage, 0u);
  h.seen.tool[0].held = Held::needle;
  h.tick();
  EXPECT_EQ(h.run.stage, 1u);
  EXPECT_EQ(guard_of(h.run, h.p), "Hold the tissue first.");
  h.seen.tool[0].loop_wraps = 1;
  h.tick();
  EXPECT_EQ(h.run.stage, 1u) << "the guard has not held";
  h.seen.instrument[0].held = Held::tissue;
  h.tick();
  EXPECT_EQ(h.run.stage, 2u);
  EXPECT_EQ(hint_of(h.run, h.p, h.seen), "grasp");
  h.seen.tool[0].held = Held::thread;
  EXPECT_EQ(hint_of(h.run, h.p, h.seen), "pull");
}

TEST(Manager, errors_count_once_per_event_and_once_per_rise) {
  Hand h;
  h.tick({{EventKind::needle_released, 0, 0, 3, {}}});
  EXPECT_TRUE(h.run.error.empty()) << "not in that stage";
  h.seen.tool[0].held = Held::needle;
  h.tick();
  h.tick({{EventKind::needle_released, 0, 0, 0, {}}});
  EXPECT_TRUE(h.run.error.empty()) << "laid down, not dropped";
  h.tick({{EventKind::needle_released, 0, 0, 3, {}}, {EventKind::needle_released, 0, 0, 4, {}}});
  EXPECT_EQ(h.run.error.size(), 2u);
  h.seen.tool[0].force = {0, 9, 0};
  h.tick();
  h.tick();
  EXPECT_EQ(h.run.error.size(), 3u);
  EXPECT_EQ(h.run.record[1].errors, 3u);
}

// The scene of clamps has more instruments than the first stage needs.
TEST(Manager, an_instrument_off_the_stages_tray_is_an_error) {
  const Procedure p = parse_procedure(R"(title = "t"
scene = "three_hands"
tray = ["needle_holder", "forceps"]
[[stage]]
name = "a"
title = "A"
text = "a"
goal = {needle_in_holder = 1}
[[stage]]
name = "b"
title = "B"
text = "b"
tray = ["scissors"]
goal = {thread_cut = {min = 1}}
)",
                                      "tray.toml");
  const auto index = [&](const std::string& kind) {
    return static_cast<uint32_t>(std::find(p.instrument.begin(), p.instrument.end(), kind) - p.instrument.begin());
  };
  ASSERT_LT(index("scissors"), p.instrument.size());
  Snapshot seen;
  ProcedureRun run;
  begin_run(run, p, seen, 0.01);
  const auto take = [&](const std::string& kind) {
    ++seen.tick;
    seen.event = {{EventKind::instrument_taken, 0, index(kind), 0, {}}};
    update_run(run, p, seen);
  };
  take("forceps");
  EXPECT_TRUE(run.error.empty());
  take("scissors");
  ASSERT_EQ(run.error.size(), 1u);
  EXPECT_EQ(p.error[run.error[0].error].name, "tray");
  seen.tool[0].held = Held::needle;
  take("scissors");  // the stage ends in the same tick; the event belonged to it
  EXPECT_EQ(run.stage, 1u);
  take("scissors");
  EXPECT_EQ(run.error.size(), 2u) << "on the tray of the second stage";
}

TEST(Manager, no_stage_is_left_without_a_word) {
  Hand h;
  h.seen.tool[0].held = Held::needle;
  h.seen.tool[0].loop_wraps = 1;
  h.seen.instrument[0].held = Held::tissue;
  h.tick();  // the first is done, the second already reached
  EXPECT_EQ(h.run.record[0].state, StageState::done);
  EXPECT_EQ(h.run.record[1].state, StageState::met);
  h.tick({{EventKind::thread_cut, 0, 0, 0, {}}});
  EXPECT_EQ(h.run.record[2].state, StageState::skipped);
  EXPECT_TRUE(finished(h.run, h.p));
  EXPECT_FALSE(faultless(h.run, h.p));
  const std::string table = run_table(h.run, h.p);
  EXPECT_NE(table.find("already reached"), std::string::npos);
  EXPECT_NE(table.find("The thread is gone."), std::string::npos);
  const std::vector<Feedback> said = feedback(h.run, h.p);
  ASSERT_EQ(said.size(), 3u);
  EXPECT_TRUE(said[0].well && said[1].well);
  EXPECT_FALSE(said[2].well);
}

TEST(Manager, saved_in_the_middle_it_continues_alike) {
  const Procedure p = read_procedure("stay");
  Field field(p);
  const auto surgeon = scripted_surgeon(field.scene, field.picture);
  std::vector<std::byte> saved;
  ProcedureRun other;
  uint64_t saved_at = 0;
  field.carry_out(*surgeon, [&] {
    if (saved.empty() && field.run.stage == 3 && field.seen.active().needle.in_tissue) {
      saved = save_run(field.run), other = load_run(saved, p), saved_at = field.seen.tick;
    } else if (!saved.empty() && field.seen.tick > saved_at) {
      update_run(other, p, field.seen);
    }
    return field.run.stage >= 6;
  });
  ASSERT_FALSE(saved.empty());
  EXPECT_EQ(save_run(other), save_run(field.run));
  EXPECT_THROW(load_run(saved, small()), InputError);
  saved.pop_back();
  EXPECT_THROW(load_run(saved, p), InputError);
}

TEST(Manager, workers_and_replay_give_the_same_bytes) {
  const Procedure p = read_procedure("stay");
  std::vector<std::vector<std::byte>> ends;
  for (const int threads : {1, 3}) {
    Field field(p, threads);
    field.carry_out(*scripted_surgeon(field.scene, field.picture), [&] { return field.run.stage >= 3; });
    ends.push_back(save_run(field.run));
  }
  EXPECT_EQ(ends[0], ends[1]);
  const std::string file = testing::TempDir() + "procedure.cgrec";
  const SceneSpec scene = scene_of(p);
  std::vector<ProcedureRun> runs(2);
  for (ProcedureRun& run : runs) {
    SessionHooks hooks;
    hooks.on_tick = [&](const Snapshot& seen, const std::string&) {
      if (run.begun) update_run(run, p, seen);
      else if (seen.time_s > 0.49) begin_run(run, p, seen, 1.0 / 60);
    };
    if (&run == &runs[0]) {
      SessionOptions options;
      options.seconds = 9, options.record = file;
      run_session(scene, options, hooks);
    } else {
      replay_session(read_recording(file), file, false, 2, hooks);
    }
  }
  EXPECT_GE(runs[0].stage, 2u);
  EXPECT_EQ(save_run(runs[0]), save_run(runs[1]));
  std::remove(file.c_str());
}

}  // namespace
}  // namespace catgut
