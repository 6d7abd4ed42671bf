// SPDX-License-Identifier: Apache-2.0
// tests/assess: a session that stops early does not score above a complete one: made sessions in every build, sessions of
// scripted surgeons with CATGUT_LONG=1 (the nightly run).
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>

#include "assess/rubric.h"
#include "made_session.h"
#include "procedure/ability.h"
#include "runtime/assessment.h"

namespace catgut::assess {
namespace {
using namespace made;

// Bites in turn through both walls, one stitch every 4 mm, with the throws and cuts of the rubric; `judge` sees
// the session at these shares of its bites. The pause after each bite decides whether the session is slow.
void sew(const Rubric& rubric, const std::vector<double>& shares, int pause,
         const std::function<void(double, const Result&)>& judge) {
  const auto bites = static_cast<size_t>(rubric.whole.bites);
  const auto throws = static_cast<size_t>(rubric.whole.throws);
  const size_t per_knot = throws >= bites ? 2 : bites;  // single stitches, or a line that is tied at its end
  Session s;
  size_t done = 0;
  for (const double share : shares) {
    for (const auto wanted = static_cast<size_t>(share * rubric.whole.bites + 1e-9); done < wanted; ++done) {
      Plan p;
      p.wall = done % 2;
      p.edge_in = p.wall ? 4 : 8, p.edge_out = p.wall ? 8 : 4;
      p.angle_in = p.angle_out = 4.0 * static_cast<double>(done / 2) / static_cast<double>(kRadius * 1000) * 57.29577951308232;
      s.bite(p);
      s.tick(pause);
      if ((done + 1) % per_knot != 0) continue;
      std::vector<KnotThrow> knot;
      for (size_t k = 0; k < throws * per_knot / bites; ++k) knot.push_back({1, k % 2 ? -1 : 1, 1, 1.0f, 0.0002f});
      if (!knot.empty()) s.knot(knot);
      for (int cut = 0; cut < 2; ++cut) s.happen(EventKind::thread_cut, 0, 0.005f);
      s.tick();
    }
    if (done == bites) s.seen().closure = 1, s.pair(0.2);
    s.tick();
    judge(share, s.result());
  }
}

TEST(StopEarly, the_score_rises_with_the_part_of_the_task_that_was_done) {
  for (const std::string& name : rubric_names()) {
    const Rubric rubric = read_rubric(name);
    if (!rubric.needs_stitch) continue;  // tests/assess/cut_test.cpp
    ASSERT_GT(rubric.whole.bites, 0) << name << " does not state the whole task";
    const std::vector<int> pauses = std::getenv("CATGUT_LONG") ? std::vector<int>{0, 60, 300} : std::vector<int>{60};
    for (const int pause : pauses) {
      double before = 0;
      sew(rubric, {0, 0.25, 0.5, 0.75, 1}, pause, [&](double share, const Result& result) {
        const Score s = mark(rubric, result);
        EXPECT_GE(s.percent, before) << name << " at " << share << ", pauses of " << pause << " ticks";
        EXPECT_LE(s.percent, 100 * s.completed + 1e-9);
        EXPECT_TRUE(share > 0 || s.percent == 0) << name;
        EXPECT_TRUE(share < 1 || s.completed == 1) << name;
        EXPECT_TRUE(share == 1 || !s.passed) << name << " at " << share;
        double lost = 0;
        for (const LostPoint& l : s.lost) lost += l.points;
        EXPECT_NEAR(s.points + lost, s.of, 1e-6) << name << ": every lost point has a reason";
        before = s.percent;
        if (share < 1) return;
        Rubric open = rubric;
        open.whole = {};
        EXPECT_EQ(mark(open, result).points, s.points) << name << ": a complete session scores as without a whole task";
      });
      EXPECT_GT(before, 30) << name;
    }
  }
}

TEST(StopEarly, the_reason_names_what_is_missing) {
  const Rubric rubric = read_rubric("stay");
  Result one_bite;
  sew(rubric, {0.5}, 0, [&](double, const Result& result) { one_bite = result; });
  const Score s = mark(rubric, one_bite);
  EXPECT_DOUBLE_EQ(s.completed, 0.2);
  const LostPoint& last = s.lost.back();
  EXPECT_EQ(last.item, "whole_task");
  EXPECT_DOUBLE_EQ(last.points, 0.8 * s.of);
  EXPECT_EQ(
      last.why,
      "the task is not complete: 1 of 2 bites, 0 of 2 throws, 0 of 1 cuts of the thread; every item earns 20 % of its points, "
      "the part of the task that was done");
  Rubric open = rubric;  // a rubric that states no whole task, as an educator's of before, marks as before
  open.whole = {};
  EXPECT_DOUBLE_EQ(mark(open, one_bite).points, 5 * s.points);
}

// Sessions are marked after every bite and every throw, as if they had ended there.
TEST(StopEarly, no_scripted_surgeon_gains_by_stopping) {
  if (!std::getenv("CATGUT_LONG")) GTEST_SKIP() << "eight whole sessions: set CATGUT_LONG=1 (the nightly run)";
  for (const char* technique : {"stay", "connell", "lembert", "purse_string"})
    for (const char* level : {"scripted:novice", "scripted:expert"}) {
      SceneSpec scene = read_scene(technique);
      const std::vector<Rubric> rubric = rubrics_for("", scene);
      ASSERT_EQ(rubric.size(), 1u);
      SessionOptions options;
      options.surgeon = apply_ability(scene, level);
      Assessor assessor(scene);
      SessionHooks hooks;
      bool mark_now = false;
      hooks.on_tick = [&](const Snapshot& seen, const std::string&) {
        for (const Event& e : seen.event) mark_now |= e.kind == EventKind::bite_completed || e.kind == EventKind::throw_locked;
      };
      assessor.attach(hooks);
      std::vector<double> curve;
      const auto note = hooks.on_step;
      hooks.on_step = [&](const Model& model, const State& state, const TickInput& input) {
        note(model, state, input);
        if (mark_now) curve.push_back(assessor.finish({}, rubric).score[0].percent);
        mark_now = false;
      };
      const RunResult run = run_session(scene, options, hooks);
      const Score whole = assessor.finish(run, rubric).score[0];
      std::printf("%s, %s:", technique, level);
      for (const double percent : curve) std::printf(" %.1f", percent);
      std::printf(", whole %.1f %%, %.0f %% of the task\n", whole.percent, 100 * whole.completed);
      ASSERT_GE(curve.size(), 3u);
      for (const double percent : curve) EXPECT_LE(percent, whole.percent) << technique << ", " << level;
    }
}

}  // namespace
}  // namespace catgut::assess
