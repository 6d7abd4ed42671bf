// SPDX-License-Identifier: Apache-2.0
// tests/cutting: wrong surgery in the scene "altemeier", by hands that a test leads: it stays wrong, and the procedure reports
// it once, with the reason, where a trainee reads it: in the results here; tests/app has the panel.
#include <gtest/gtest.h>

#include <utility>

#include "field.h"
#include "procedure/manager.h"
#include "procedure/procedure_file.h"
#include "procedure/scripted_surgeon.h"

namespace catgut {
namespace {

// A coarse mesh, with one instrument in the right hand and the forceps in the left.
SceneSpec with(const std::string& right) {
  SceneSpec s = read_scene("altemeier");
  s.body[0].particles = 600, s.body[1].particles = 240;
  s.suture.resize(1);
  bool taken = false;
  std::erase_if(s.instrument, [&](InstrumentSpec& i) {
    if (i.kind == "forceps") return false;
    if (i.kind != right) return i.kind == "allis" || i.kind == "needle_holder";
    return std::exchange(taken, true);
  });
  for (InstrumentSpec& i : s.instrument)
    if (i.kind == right) i.where = "right";
  return s;
}

struct Trainee {
  Field f;
  Procedure procedure = read_procedure("altemeier");
  ProcedureRun run;
  explicit Trainee(const SceneSpec& scene) : f(scene) {
    f.line = scene.surgeon.edge_distance;
    begin_run(run, procedure, f.seen, static_cast<double>(f.model->dt));
    f.after_tick = [this] { update_run(run, procedure, f.seen); };
  }
  Trainee(const Trainee&) = delete;

  void hold(size_t hand, Vec3 at, Vec3 x, Vec3 shaft, float jaw, int ticks = 1) {
    shaft = normalized(shaft), x = normalized(x - shaft * dot(x, shaft));
    ToolInput& h = f.input.hand[hand];
    h.connected = 1, h.jaw = jaw;
    h.pose = {at, from_axes(x, cross(shaft, x), shaft)};
    for (int i = 0; i < ticks; ++i) f.tick();
  }
  // What the hand holds is closed on the rim, at this angle, and pulled up so far, at 0.1 m/s.
  void grasp_and_pull(size_t hand, float angle, float far) {
    const Vec3 out{portable::cos(angle), 0, portable::sin(angle)};
    const Vec3 rim = out * (f.scene.body[0].radius - 0.5f * f.scene.body[0].wall) - Vec3{0, 0.002f, 0};
    hold(hand, rim + Vec3{0, 0.03f, 0}, out, {0, 1, 0}, 1, 2);
    hold(hand, rim, out, {0, 1, 0}, 1, 12);
    hold(hand, rim, out, {0, 1, 0}, 0, 10);
    ASSERT_EQ(f.seen.tool[hand].held, Held::tissue);
    for (float up = 0; up < far; up += 0.1f * f.model->dt) hold(hand, rim + Vec3{0, up, 0}, out, {0, 1, 0}, 0);
  }
  void expect_reported(const std::string& name) const {
    ASSERT_EQ(run.error.size(), 1u) << run_table(run, procedure);
    const auto& error = procedure.error[run.error[0].error];
    EXPECT_EQ(error.name, name);
    EXPECT_NE(run_table(run, procedure).find(error.text + " " + error.why), std::string::npos) << run_table(run, procedure);
    EXPECT_FALSE(faultless(run, procedure));
    EXPECT_FALSE(finished(run, procedure));
    bool reported = false;
    for (const Feedback& b : feedback(run, procedure))
      reported = reported || (!b.well && b.text.find(error.text) != std::string::npos);
    EXPECT_TRUE(reported) << "in the results, stage by stage";
  }
};

TEST(WrongAltemeier, the_inner_tube_is_cut_first) {
  Trainee t(with("cautery"));
  const BodySpec& colon = t.f.scene.body[1];
  const float inner = colon.radius - colon.wall, down = 0.004f;
  const auto tip = [&](float angle, float radius, float y) {
    const Vec3 out{portable::cos(angle), 0, portable::sin(angle)};
    t.hold(0, out * radius + Vec3{0, y, 0}, cross(Vec3{0, 1, 0}, out), Vec3{0, 1, 0} - out * 0.2f, 0);
  };
  const float level = colon.position.y - down;
  for (float y = 0.02f; y > level; y -= 0.004f) tip(0, 0.003f, y);
  for (float r = 0.003f; r < inner; r += 0.0005f) tip(0, r, level);
  t.f.switch_pen();
  for (float angle = 0; angle < 0.6f; angle += 0.006f) tip(angle, inner, level);
  ASSERT_EQ(t.f.of(Fault::inner_wall_cut).size(), 1u);
  t.expect_reported("inner tube");
}

TEST(WrongAltemeier, the_cut_leaves_the_line) {
  Trainee t(with("cautery"));
  t.f.line += 0.004f;
  t.f.cut(0, 0.7f, 0.006f);
  ASSERT_EQ(t.f.of(Fault::cut_off_line).size(), 1u);
  EXPECT_NEAR(t.f.of(Fault::cut_off_line)[0].value, 0.004f, 0.0007f);
  t.expect_reported("off the line");
}

TEST(WrongAltemeier, an_incomplete_circle_is_pulled) {
  Trainee t(with("cautery"));
  t.f.cut(0, 0.7f, 0.006f);
  t.f.input.hand[0].pose.p += Vec3{0.05f, 0.05f, 0};
  t.grasp_and_pull(1, kPi, 0.015f);
  ASSERT_EQ(t.f.of(Fault::pulled_attached).size(), 1u);
  EXPECT_EQ(t.f.of(Fault::pulled_attached)[0].who, 1);
  EXPECT_TRUE(t.f.of(EventKind::piece_freed).empty());
  EXPECT_EQ(measure_cut(t.f.scene, t.f.seen).pieces, 2u) << "two tubes, nothing has come off";
  t.expect_reported("attached");
}

TEST(WrongAltemeier, a_clamp_is_torn_out) {
  SceneSpec scene = with("allis");
  for (InstrumentSpec& i : scene.instrument)
    if (i.kind == "allis")
      i.where = "parked", i.at = {scene.body[0].radius - 0.5f * scene.body[0].wall, 0, 0}, i.pull = {0, 20, 0};
  Trainee t(scene);
  for (int i = 0; i < 60 && t.f.of(Fault::clamp_torn_out).empty(); ++i) t.f.tick();
  ASSERT_EQ(t.f.of(Fault::clamp_torn_out).size(), 1u);
  EXPECT_EQ(t.f.seen.instrument[t.f.of(Fault::clamp_torn_out)[0].which].held, Held::nothing);
  t.expect_reported("clamp torn out");
}

TEST(WrongAltemeier, a_stitch_goes_through_char) {
  const SceneSpec scene = with("needle_holder");
  Trainee t(scene);
  auto& burnt = t.f.state->physical.cutting.excision.burnt;
  burnt.resize(t.f.model->physical->world.wall.mesh.face.size());
  for (auto& face : burnt) face.fill(1);
  // Nothing is cut here, and the anastomosis' bites would be in the way: any bite in the wall does.
  const std::unique_ptr<Surgeon> surgeon =
      make_demonstrator("purse_string_thread", picture_model(*t.f.model), skill_of(scene), {0, 1, 2, 3});
  while (t.f.of(EventKind::tip_entered).empty() && t.f.state->tick < 1500) {
    t.f.input = surgeon->operate(t.f.seen, t.f.model->dt);
    t.f.tick();
  }
  ASSERT_EQ(t.f.of(EventKind::tip_entered).size(), 1u) << surgeon->doing();
  ASSERT_EQ(t.f.of(Fault::bite_in_char).size(), 1u);
  t.expect_reported("stitch over char");
}

}  // namespace
}  // namespace catgut
