// SPDX-License-Identifier: Apache-2.0
// tests/cutting: an electrosurgical pen held in a hand cuts the bowel of a scene. Depth against its energy balance; a state
// saved in the middle of a cut continues to the bit and shows the same; the drawn surface is closed and keeps its mass; what
// the pen does is reported, and wrong surgery as a fault; a bowel cut all round is two pieces with the whole mass. With
// CATGUT_LONG the scripted surgeon does the whole scene; an unfinished circle that is pulled stays one piece.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "field.h"
#include "procedure/scripted_surgeon.h"
#include "runtime/planned_line.h"
#include "runtime/session.h"
#include "sim/recording.h"

namespace catgut {
namespace {

TEST(Cutting, power_and_time_decide_whether_the_wall_is_scored_or_divided) {
  Field f;
  const double mass = f.mass();
  f.cut(0, 0.9f, 0.015f);  // 2 mm of wall bear 10 mm/s
  float depth = 0;
  int count = 0;
  for (const physical::Groove& g : f.excision().groove) {
    const float angle = portable::atan2(g.at.z, g.at.x);
    if (angle > 0.25f && angle < 0.65f) depth += g.outer, ++count;
  }
  ASSERT_GT(count, 5);
  depth /= static_cast<float>(count);
  // efficiency P / (energy kerf speed), with the speed on the middle of the wall.
  const BodySpec& bowel = f.scene.body[0];
  const float speed = 0.015f * (1 - 0.5f * bowel.wall / bowel.radius);
  const float expected = 0.5f * kCutPower / (2.0e9f * 0.5e-3f * speed);
  std::printf("40 W at 15 mm/s: %.3f mm deep, balance %.3f mm\n", static_cast<double>(1e3f * depth),
              static_cast<double>(1e3f * expected));
  EXPECT_NEAR(depth / expected, 1, 0.1f);
  EXPECT_TRUE(f.state->physical.world.wall.topology.fragment.empty()) << "scored, not divided";
  ASSERT_TRUE(f.seen.topology.picture);
  EXPECT_LT(opening_of(*f.seen.topology.picture), 1e-6);
  const CutMeasures scored = measure_cut(f.scene, f.seen);
  EXPECT_EQ(scored.pieces, 1u);
  EXPECT_EQ(scored.deviation, 0) << "no cut edge yet";
  f.cut(-2.0f, -1.0f, 0.008f);
  EXPECT_FALSE(f.state->physical.world.wall.topology.fragment.empty()) << "divided";
  const CutMeasures slit = measure_cut(f.scene, f.seen);
  std::printf("slit: cut edge at most %.2f mm from the line, drawn mass %.6f g before, %.6f g after\n", 1e3 * slit.deviation,
              1e3 * scored.mass, 1e3 * slit.mass);
  EXPECT_EQ(slit.pieces, 1u);
  EXPECT_GT(slit.deviation, 0);
  EXPECT_LT(slit.deviation, 0.0008);
  EXPECT_LT(opening_of(*f.seen.topology.picture), 1e-6) << "cut edges are drawn";
  EXPECT_NEAR(slit.mass / scored.mass, 1, 1e-6);
  EXPECT_NEAR(f.mass() / mass, 1, 1e-6);
}

TEST(Cutting, a_state_saved_in_the_middle_of_a_cut_continues_to_the_bit_and_shows_the_same) {
  Field f;
  f.hold(0, 0.004f), f.tick(), f.tick();
  f.hold(0), f.tick(), f.tick();
  f.switch_pen();
  f.draw(0, 1.0f, 0.009f);
  ASSERT_FALSE(f.state->physical.world.wall.topology.fragment.empty()) << "there is a cut to save";
  ASSERT_TRUE(f.excision().touching);
  StatePtr other = initial_state(*f.model);
  load_state(*f.model, *other, save_state(*f.model, *f.state));
  Snapshot loaded;
  Jobs two(2);
  publish(*f.model, *other, loaded);
  EXPECT_EQ(loaded.topology.version, f.seen.topology.version);
  ASSERT_TRUE(loaded.topology.picture);
  EXPECT_EQ(loaded.particle, f.seen.particle);
  EXPECT_EQ(loaded.topology.picture->body[0].position, f.seen.topology.picture->body[0].position);
  EXPECT_EQ(loaded.topology.picture->body[0].skin_particle, f.seen.topology.picture->body[0].skin_particle);
  for (int i = 1; i <= 15; ++i) {
    f.hold(1.0f + 0.012f * static_cast<float>(i));
    f.input.tick = f.state->tick;
    step(*f.model, *other, f.input, two);
    f.tick();
    ASSERT_EQ(hash_state(*f.model, *f.state), hash_state(*f.model, *other)) << "tick " << i;
  }
  publish(*f.model, *other, loaded);
  EXPECT_EQ(loaded.particle, f.seen.particle);
  EXPECT_EQ(loaded.topology.picture->body[0].triangle, f.seen.topology.picture->body[0].triangle);
}

TEST(Cutting, what_the_pen_does_is_reported) {
  Field f;
  f.cut(0, 0.6f, 0.015f);
  ASSERT_EQ(f.of(EventKind::pen_activated).size(), 1u);
  EXPECT_EQ(f.of(EventKind::pen_activated)[0].value, kCutPower);
  ASSERT_EQ(f.of(EventKind::pen_deactivated).size(), 1u);
  const Event off = f.of(EventKind::pen_deactivated)[0];
  EXPECT_NEAR(off.value, static_cast<float>(off.tick - f.of(EventKind::pen_activated)[0].tick) * f.model->dt, 1e-5f);
  ASSERT_EQ(f.of(EventKind::wall_scored).size(), 1u) << "not through at 15 mm/s";
  float deepest = 0;
  for (const physical::Groove& g : f.excision().groove) deepest = std::max(deepest, g.outer);
  EXPECT_EQ(f.of(EventKind::wall_scored)[0].value, deepest);
  EXPECT_TRUE(f.of(EventKind::wall_cut_through).empty());
  f.cut(2, 2.6f, 0.006f);
  EXPECT_EQ(f.of(EventKind::wall_scored).size(), 1u) << "the second is not only scored";
  ASSERT_EQ(f.of(EventKind::wall_cut_through).size(), 1u);
  const Event through = f.of(EventKind::wall_cut_through)[0];
  EXPECT_LT(through.value, 0.0008f) << "half a cell from the line";
  EXPECT_GE(through.value, 0);
  EXPECT_NEAR(std::hypot(through.where.x, through.where.z), f.scene.body[0].radius, 0.001f);
  EXPECT_NEAR(through.where.y, -kLine, 0.001f);
  EXPECT_NEAR(portable::atan2(through.where.z, through.where.x), 2.0f, 0.15f) << "where the cut began";
  EXPECT_TRUE(f.of(EventKind::piece_freed).empty());
  for (const Event& e : f.events) EXPECT_NE(e.kind, EventKind::technique_fault) << fault_name(e.fault);
}

TEST(Cutting, a_cut_off_the_line_is_a_fault_once) {
  Field f;
  f.line = kLine + 0.0035f;
  f.cut(0, 0.8f, 0.006f);
  ASSERT_EQ(f.of(Fault::cut_off_line).size(), 1u);
  EXPECT_NEAR(f.of(Fault::cut_off_line)[0].value, 0.0035f, 0.0006f);
  // Without a plan no deviation is reported.
  Field free;
  free.scene.surgeon.plan.clear();
  free.model = build_model(free.scene), free.state = initial_state(*free.model);
  free.line = f.line;
  free.cut(0, 0.5f, 0.006f);
  ASSERT_EQ(free.of(EventKind::wall_cut_through).size(), 1u);
  EXPECT_EQ(free.of(EventKind::wall_cut_through)[0].value, -1);
  EXPECT_TRUE(free.of(Fault::cut_off_line).empty());
}

// A pen that follows the displayed line has no deviation from the planned cut; burnt parts of the line are not displayed.
TEST(Cutting, the_planned_line_is_drawn_where_deviations_are_measured) {
  for (const char* name : {"excision", "altemeier"}) {
    SceneSpec scene = read_scene(name);
    scene.body[0].particles = 600;
    for (InstrumentSpec& i : scene.instrument)
      if (i.kind == "cautery") i.where = "right";
    Field f(scene);
    f.line = scene.surgeon.edge_distance;
    const PictureModel picture = picture_model(*f.model);
    PlannedLine line(scene, picture);
    double length_all = 0;
    for (const LinePiece& p : line.on(picture, f.seen)) {
      EXPECT_NEAR(p.a.y, -f.line, 1e-4f);
      EXPECT_GT(dot(p.out, p.a), 0);
      length_all += static_cast<double>(length(p.b - p.a));
    }
    EXPECT_NEAR(length_all / (2 * static_cast<double>(kPi * scene.body[0].radius)), 1, 0.03) << "all round, once";
    const float from = 0.3f, to = 1.1f;
    const auto angle = [](Vec3 p) { return portable::atan2(p.z, p.x); };
    const auto follow = [&](float at) {
      f.hold(at);
      float nearest = 10;
      for (const LinePiece& p : line.on(picture, f.seen))
        if (const float off = std::abs(angle(p.a) - at); off < nearest) nearest = off, f.input.hand[0].pose.p = p.a;
      f.tick();
    };
    f.hold(from, 0.004f), f.tick(), f.tick();
    follow(from);
    f.switch_pen();
    // The line burns away under the pen: he aims a little ahead.
    for (float at = from; at < to; at += 0.005f / 60 / scene.body[0].radius) follow(at);
    ASSERT_EQ(f.of(EventKind::wall_cut_through).size(), 1u);
    EXPECT_LT(f.of(EventKind::wall_cut_through)[0].value, 0.5e-3f);
    EXPECT_TRUE(f.of(Fault::cut_off_line).empty());
    size_t cut = 0, left = 0;
    for (const LinePiece& p : line.on(picture, f.seen)) {
      const float at = angle(0.5f * (p.a + p.b));
      if (at > from + 0.1f && at < to - 0.1f) ++cut;
      if (at > to + 0.3f || at < from - 0.3f) ++left;
    }
    std::printf("%s: %zu pieces drawn where it was cut, %zu elsewhere\n", name, cut, left);
    EXPECT_EQ(cut, 0u);
    EXPECT_GT(left, 50u);
  }
}

TEST(Cutting, a_cut_beside_a_suture_is_a_fault_once) {
  for (const float beside : {0.0f, 0.004f}) {
    Field f;
    // Thread runs through a hole; the world stands still, so it may be anywhere.
    physical::State& world = f.state->physical.world;
    const physical::Model& m = f.model->physical->world;
    physical::Hole hole;
    float least = 1;
    for (uint32_t face = 0; face < m.wall.mesh.face.size(); ++face)
      for (float xi = -0.75f; xi < 1; xi += 0.5f)
        for (float eta = -0.75f; eta < 1; eta += 0.5f) {
          const bool quad = m.wall.mesh.face[face][3] != wall::kNone;
          const wall::Point p{face, quad ? xi : 0.5f * (xi + 1), quad ? eta : 0.5f * (eta + 1), 1};
          const Vec3 at = wall::rest_place(m.wall, p), out{portable::cos(0.2f), 0, portable::sin(0.2f)};
          const float far =
              distance(at, out * (f.scene.body[0].radius - 0.5f * f.scene.body[0].wall) - Vec3{0, kLine + beside, 0});
          if (far < least) least = far, hole.place = p;
        }
    ASSERT_LT(least, 0.0008f);
    world.hole.push_back(hole);
    world.thread.eyelet.push_back({});
    physical::Scratch scratch(m, world);
    f.state->physical.cutting.mode[0] = PenMode::cut;
    f.state->event.start(0);
    for (float angle = 0; angle < 0.5f; angle += 0.006e-3f / f.scene.body[0].radius) {
      f.hold(angle);
      world.bodies.body[0].pose = f.input.hand[0].pose;
      use_pens(*f.model, *f.state, scratch, 0.001f);
    }
    uint32_t faults = 0;
    for (const Event& e : f.state->event) faults += e.fault == Fault::cut_at_suture;
    EXPECT_EQ(faults, beside > 0 ? 0u : 1u);
  }
}

TEST(Cutting, buttons_of_a_hand_without_a_pen_do_not_cut_tissue) {
  Field f;
  f.hold(0), f.tick();
  f.input.hand[1] = f.input.hand[0], f.input.hand[1].pose.p.y += 0.1f;
  f.input.commands.push({CommandKind::cut, 1, 0});  // the forceps
  f.tick();
  EXPECT_TRUE(f.excision().passed.empty());
  f.switch_pen(), f.tick(), f.tick();
  EXPECT_TRUE(f.excision().touching);
  f.input.hand[0].connected = 0;
  f.tick();
  EXPECT_FALSE(f.excision().touching) << "without a hand the pen is off";
}

// --- the whole excision -----------------------------------------------------------------------------------------------

TEST(Cutting, the_scripted_surgeon_excises_the_end_and_a_replay_repeats_it) {
  if (!std::getenv("CATGUT_LONG")) GTEST_SKIP() << "CATGUT_LONG=1 runs it";
  const SceneSpec scene = read_scene("excision");
  SessionOptions options;
  options.surgeon = "scripted";
  options.record = testing::TempDir() + "excision.cgrec";
  const RunResult run = run_session(scene, options, {});
  for (const ExpectationResult& e : run.expect) EXPECT_TRUE(e.ok) << e.want.name << " " << e.got;
  std::printf("longest tick %.1f ms, median %.1f ms\n", run.tick_ms.max, run.tick_ms.median);
  const ReplayResult again = replay_session(read_recording(options.record), "recording", true, 2, {});
  EXPECT_EQ(again.run.state_hash, run.state_hash);
  EXPECT_EQ(again.run.events, run.events);
  EXPECT_EQ(run.events.at("piece_freed"), 1u);
  EXPECT_TRUE(run.faults.empty());
}

// All round; then the tissue near the edge is turned over, as a whole, about a circle in the wall.
TEST(Cutting, an_edge_that_is_turned_outward_is_measured) {
  Field f;
  f.cut(0, 2 * kPi + 0.1f, 0.006f);
  ASSERT_EQ(f.of(EventKind::piece_freed).size(), 1u);
  EXPECT_LT(measure_cut(f.scene, f.seen).eversion, 0.3) << "lips open by themselves";
  const BodySpec& body = f.scene.body[0];
  const float hinge = body.radius - 0.5f * body.wall, below = body.position.y - kLine - 0.004f;
  Snapshot turned = f.seen;
  for (const float angle : {1.0f, -0.5f}) {
    for (size_t i = 0; i < turned.particle.size(); ++i) {
      const Vec3 p = f.seen.particle[i], out = normalized(Vec3{p.x, 0, p.z}, {1, 0, 0});
      const float r = std::hypot(p.x, p.z) - hinge, y = p.y - below;
      if (y < 0) continue;
      const float c = portable::cos(angle), s = portable::sin(angle);
      turned.particle[i] = out * (hinge + r * c + y * s) + Vec3{0, below + y * c - r * s, 0};
    }
    const double before = measure_cut(f.scene, f.seen).eversion, after = measure_cut(f.scene, turned).eversion;
    EXPECT_NEAR(after, std::max(0.0, before + static_cast<double>(angle)), 0.02) << angle;
  }
}

// Points 0.3 mm in front of the middle of every triangle of the edge that stays: some cells away from its vertices.
TEST(Cutting, the_gap_of_an_anastomosis_is_measured_to_the_surface_of_the_cut_edge) {
  Field f;
  f.cut(0, 2 * kPi + 0.1f, 0.006f);
  ASSERT_EQ(f.of(EventKind::piece_freed).size(), 1u);
  EXPECT_EQ(measure_cut(f.scene, f.seen).ring_gap, 0) << "one body";
  PictureModel picture = *f.seen.topology.picture;
  const VisibleMesh& mesh = picture.body[0];
  std::vector<Vec3> now(mesh.position.size());
  for (size_t v = 0; v < now.size(); ++v)
    for (size_t k = 0; k < 4; ++k) now[v] += f.seen.particle[mesh.skin_particle[v][k]] * mesh.skin_weight[v][k];
  const float edge = f.scene.body[0].position.y - kLine;
  std::vector<uint32_t> rim;
  float widest = 0;
  for (const auto& t : mesh.triangle) {
    const auto of_edge = [&](uint32_t v) {
      return mesh.layer[v] == TissueLayer::cut_edge && std::abs(mesh.position[v].y - edge) < 1e-3f;
    };
    if (!of_edge(t[0]) || !of_edge(t[1]) || !of_edge(t[2])) continue;
    const Vec3 n = normalized(cross(now[t[1]] - now[t[0]], now[t[2]] - now[t[0]])),
               middle = (now[t[0]] + now[t[1]] + now[t[2]]) / 3;
    if (n.y < 0.9f || std::abs(middle.y - edge) > 1e-3f) continue;  // the edge of what was cut off, which has fallen
    widest = std::max(widest, distance(middle, now[t[0]]));
    rim.push_back(static_cast<uint32_t>(f.seen.particle.size()));
    f.seen.particle.push_back(middle + n * 0.3e-3f);
  }
  ASSERT_GT(rim.size(), 40u);
  EXPECT_GT(widest, 0.6e-3f);
  picture.rim = {{}, rim};
  f.seen.topology.picture = DividedPicture(std::make_shared<const PictureModel>(picture));
  EXPECT_NEAR(measure_cut(f.scene, f.seen).ring_gap, 0.3e-3, 0.01e-3);
}

TEST(Cutting, an_unfinished_circle_that_is_pulled_stays_one_piece) {
  if (!std::getenv("CATGUT_LONG")) GTEST_SKIP() << "CATGUT_LONG=1 runs it";
  Field f(800);
  const std::unique_ptr<Surgeon> surgeon = scripted_surgeon(f.scene, picture_model(*f.model));
  int switched = 0;
  while (!surgeon->done() && f.state->tick < 6000) {
    TickInput wanted = surgeon->operate(f.seen, f.model->dt);
    f.input.hand = wanted.hand;
    // The pen goes off after two thirds of the circle, and stays off.
    for (const Command& c : wanted.commands) switched += c.kind == CommandKind::cut, f.input.commands.push(c);
    if (switched > 1) f.input.commands.clear();
    if (switched == 1 && f.excision().path.size() > 200) f.switch_pen(), switched = 2;
    f.tick();
  }
  EXPECT_TRUE(surgeon->gave_up());
  EXPECT_NE(surgeon->doing().find("still attached"), std::string::npos) << surgeon->doing();
  const CutMeasures cut = measure_cut(f.scene, f.seen);
  EXPECT_EQ(cut.pieces, 1u);
  EXPECT_EQ(cut.way, 0);
  // Pulled all the same: the hand feels that it is attached.
  ASSERT_EQ(f.seen.tool[1].held, Held::tissue);
  float felt = 0;
  for (int i = 0; i < 60 && f.seen.tool[1].held == Held::tissue; ++i) {
    f.input.hand[1].pose.p.y += 0.0003f;
    f.tick();
    felt = std::max(felt, length(f.seen.tool[1].force));
  }
  std::printf("pulled 18 mm: at most %.2f N on the hand\n", static_cast<double>(felt));
  EXPECT_GT(felt, 0.5f);
  ASSERT_EQ(f.of(Fault::pulled_attached).size(), 1u);
  EXPECT_EQ(f.of(Fault::pulled_attached)[0].who, 1);
  EXPECT_TRUE(f.of(EventKind::piece_freed).empty());
  EXPECT_EQ(measure_cut(f.scene, f.seen).pieces, 1u);
}

}  // namespace
}  // namespace catgut
