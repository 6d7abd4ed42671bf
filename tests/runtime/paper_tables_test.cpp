// SPDX-License-Identifier: Apache-2.0
// tests/runtime: the paper's tables: the phase of a tick, and the positions of the figures.
#include <gtest/gtest.h>

#include "procedure/procedure_file.h"
#include "procedure/scene_file.h"
#include "runtime/paper_tables.h"

namespace catgut {
namespace {

Event of(EventKind kind) {
  Event e;
  e.kind = kind;
  return e;
}

TEST(PaperTables, a_tick_belongs_to_one_phase) {
  PaperPhase phase(false);
  const auto at = [&](std::vector<Event> events, bool done = false) { return phase(events, true, done); };
  EXPECT_EQ(phase({}, false, false), "Start");
  EXPECT_EQ(at({}), "During suturing");
  EXPECT_EQ(at({of(EventKind::tip_entered), of(EventKind::bite_completed)}), "During suturing");
  EXPECT_EQ(at({of(EventKind::loop_formed)}), "During looping");
  EXPECT_EQ(at({of(EventKind::throw_started)}), "During looping");
  EXPECT_EQ(at({of(EventKind::throw_locked)}), "During looping") << "until something else is begun";
  EXPECT_EQ(at({of(EventKind::tip_entered)}), "During suturing");
  EXPECT_EQ(at({of(EventKind::loop_formed)}), "During looping");
  EXPECT_EQ(at({}, true), "After completion");

  PaperPhase lembert(true);
  const auto then = [&](EventKind kind) { return lembert(std::vector<Event>{of(kind)}, true, false); };
  EXPECT_EQ(then(EventKind::tip_entered), "Suture #1");
  EXPECT_EQ(then(EventKind::loop_formed), "Loop #1");
  EXPECT_EQ(then(EventKind::suture_loaded), "Suture #2");
  EXPECT_EQ(then(EventKind::loop_formed), "Loop #2");
}

TEST(PaperTables, a_row_holds_ours_and_theirs) {
  PaperTable table;
  table.technique = "connell", table.preset = "default";
  table.executions = table.sewn = 2;
  table.phase = {{"During looping", {1, 3}, {4, 4}}, {"A phase of our own", {1, 1}, {1, 1}}};
  const std::string text = paper_markdown(table);
  EXPECT_NE(text.find("2 of 2 executions completed"), std::string::npos) << text;
  const size_t row = text.find("| During looping");
  ASSERT_NE(row, std::string::npos) << text;
  const std::string line = text.substr(row, text.find('\n', row) - row);
  EXPECT_NE(line.find("250 ±   0 |  65.7 |  4.00 ± 0.00 |  15.7 |  2.00 ± 1.00 |   8.0 |                  4.0"),
            std::string::npos)
      << line;
  EXPECT_NE(paper_csv(table).find("connell,default,1,During looping,2,250.0,0.0,4.000,0.000,2.000,1.000,65.70,15.70,7.99\n"),
            std::string::npos)
      << paper_csv(table);
  EXPECT_NE(paper_csv(table).find("A phase of our own,2,1000.0,0.0,1.000,0.000,1.000,0.000,,,\n"), std::string::npos);
}

// Every tick is counted once, every fourth picture is rendered, and an interrupted run does not count as sutured.
TEST(PaperTables, executions_are_measured_phase_by_phase) {
  SceneSpec scene = read_scene("purse_string");
  set_value(scene, "duration=1");
  size_t pictures = 0;
  const PaperTable table = measure_paper(
      scene, 2, 1, [&](const PictureModel&) -> PictureCost { return [&](const Snapshot&) { return ++pictures, 100.0; }; });
  EXPECT_EQ(table.executions, 2);
  EXPECT_EQ(table.sewn, 0);
  EXPECT_EQ(table.particles, 1403u);
  EXPECT_EQ(pictures, 2u * 15u);
  ASSERT_EQ(table.phase.size(), 2u);
  EXPECT_EQ(table.phase[0].phase, "Start");
  EXPECT_EQ(table.phase[1].phase, "During suturing");
  for (const PhaseCost& p : table.phase) {
    ASSERT_EQ(p.solver_ms.size(), 2u);
    for (size_t i = 0; i < 2; ++i) {
      EXPECT_GT(p.solver_ms[i], 0);
      EXPECT_GT(p.frame_ms[i], 100 + p.solver_ms[i] * 0.5);
    }
  }
}

// A procedure's stages are the phases.
TEST(PaperTables, a_procedure_is_measured_stage_by_stage) {
  SceneSpec scene = read_scene("purse_string");
  set_value(scene, "duration=4");
  const Procedure procedure = read_procedure("purse_string");
  ASSERT_EQ(procedure.scene, "purse_string");
  const PaperTable table = measure_paper(scene, 1, 1, {}, {}, &procedure);
  EXPECT_EQ(table.technique, "purse_string");
  ASSERT_GE(table.phase.size(), 3u);
  EXPECT_EQ(table.phase[0].phase, "Start");
  EXPECT_EQ(table.phase[1].phase, procedure.stage[0].name);
  EXPECT_EQ(table.phase[2].phase, procedure.stage[1].name);
  for (const PhaseCost& p : table.phase) EXPECT_EQ(p.solver_ms.size(), 1u);
}

}  // namespace
}  // namespace catgut
