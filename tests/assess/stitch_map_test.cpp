// SPDX-License-Identifier: Apache-2.0
// tests/assess: positions of stitches, from synthetic tissue and from a surgeon's first bites.
#include "assess/stitch_map.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "procedure/scene_file.h"
#include "runtime/report.h"
#include "runtime/session.h"

namespace catgut {
namespace {

constexpr uint32_t kRound = 36;

// Two open tubes, one above the other, each a ring of particles at its edge and two more below; `turned`: the second starts
// elsewhere and runs the other way round.
PictureModel two_rings() {
  PictureModel p;
  for (uint32_t wall = 0; wall < 2; ++wall) {
    p.rim.emplace_back();
    for (int row = 0; row < 3; ++row)
      for (uint32_t i = 0; i < kRound; ++i) {
        const float turn = wall == 0 ? static_cast<float>(i) : 10.0f - static_cast<float>(i);
        const float a = 2 * kPi * turn / kRound, y = 0.004f * static_cast<float>(row);
        if (row == 0) p.rim[wall].push_back(static_cast<uint32_t>(p.particle_rest.size()));
        p.particle_rest.push_back({0.02f * std::cos(a), wall == 0 ? -y : 0.01f + y, 0.02f * std::sin(a)});
        p.wall.push_back(static_cast<uint8_t>(wall));
      }
  }
  return p;
}

struct Sewn {
  PictureModel picture = two_rings();
  Snapshot seen;
  StitchMap map = start_map(picture, 1.0 / 60);
  Quat turn = axis_angle({0, 0, 1}, 0.7f);
  Vec3 away{0.05f, 0.01f, 0};
  Sewn() {
    for (Vec3 r : picture.particle_rest) seen.particle.push_back(rotate(turn, r) + away), seen.rotation.push_back(turn);
  }
  static Vec3 on_wall(float angle, float edge, uint32_t wall = 0) {
    return {0.02f * std::cos(angle), wall == 0 ? -edge : 0.01f + edge, 0.02f * std::sin(angle)};
  }
  Vec3 moved(Vec3 p) const { return rotate(turn, p) + away; }
  void tick() {
    ++seen.tick;
    note(map, picture, seen);
    seen.event.clear();
  }
  void bite(Vec3 in, Vec3 out, uint32_t wall = 0) {
    BiteView b;
    b.entry = moved(in), b.exit = moved(out), b.wall = wall, b.depth = 0.0021f;
    const auto n = static_cast<uint32_t>(seen.active().bite.size());
    seen.active().bite.push_back(b);
    seen.event.push_back({.kind = EventKind::tip_entered, .which = n, .value = 0.5f, .where = {}, .tick = seen.tick + 1});
    seen.event.push_back({.kind = EventKind::bite_completed, .which = n, .value = 0, .where = {}, .tick = seen.tick + 1});
    tick();
  }
};

TEST(StitchMap, a_bite_lies_where_it_lies_on_the_tissue_at_rest) {
  Sewn s;
  s.bite(Sewn::on_wall(0.1f, 0.004f), Sewn::on_wall(0.4f, 0.003f));
  ASSERT_EQ(s.map.bite.size(), 1u);
  const StitchBite& b = s.map.bite[0];
  EXPECT_LT(distance(b.entry, Sewn::on_wall(0.1f, 0.004f)), 1e-5f) << "the organ was moved and turned in between";
  EXPECT_NEAR(b.entry_edge, 0.004f, 1e-4f);
  EXPECT_NEAR(b.exit_edge, 0.003f, 1e-4f);
  EXPECT_NEAR(b.exit_along - b.entry_along, 0.3f * 0.02f, 2e-4f);
  EXPECT_EQ(b.spacing, -1) << "there is none before it";
  EXPECT_FLOAT_EQ(b.depth, 0.0021f);
  EXPECT_FLOAT_EQ(b.entry_angle, 0.5f);
}

TEST(StitchMap, spacing_is_the_edge_that_nothing_holds) {
  Sewn s;
  s.bite(Sewn::on_wall(0.1f, 0.004f), Sewn::on_wall(0.4f, 0.004f));
  s.bite(Sewn::on_wall(0.7f, 0.004f), Sewn::on_wall(0.6f, 0.004f));  // sutured backward: its near end counts
  s.bite(Sewn::on_wall(0.7f, 0.004f, 1), Sewn::on_wall(0.9f, 0.004f, 1), 1);
  s.bite(Sewn::on_wall(0.65f, 0.004f), Sewn::on_wall(0.8f, 0.004f));
  EXPECT_NEAR(s.map.bite[1].spacing, 0.2f * 0.02f, 2e-4f);
  EXPECT_EQ(s.map.bite[2].spacing, -1) << "the other wall has its own row";
  EXPECT_EQ(s.map.bite[3].spacing, 0) << "they overlap";
}

TEST(StitchMap, walls_that_face_each_other_run_side_by_side) {
  Sewn s;
  for (float a : {0.3f, 2.0f, 5.0f}) {
    const float one = nearest_on(s.map.edge[0], Sewn::on_wall(a, 0)).along;
    const float other = nearest_on(s.map.edge[1], Sewn::on_wall(a, 0, 1)).along;
    EXPECT_NEAR(one, other, 4e-4f) << a;
  }
  EXPECT_NEAR(s.map.edge[0].length(), 2 * kPi * 0.02f, 5e-4f);
}

TEST(StitchMap, between_two_stretches_of_a_closed_edge) {
  EXPECT_FLOAT_EQ(between(100, 10, 20, 30, 40), 10);
  EXPECT_FLOAT_EQ(between(100, 20, 10, 40, 30), 10) << "either end first";
  EXPECT_FLOAT_EQ(between(100, 95, 5, 10, 12), 5) << "across the start";
  EXPECT_FLOAT_EQ(between(100, 90, 95, 2, 5), 7);
  EXPECT_FLOAT_EQ(between(100, 10, 30, 15, 20), 0);
  EXPECT_FLOAT_EQ(between(100, 15, 20, 10, 30), 0);
  EXPECT_FLOAT_EQ(between(0, 1, 2, 3, 4), 0);
}

TEST(StitchMap, what_is_taken_back_has_not_happened) {
  Sewn s;
  s.seen.active().thread_tension = {0.1f, 0.5f};
  s.bite(Sewn::on_wall(0.1f, 0.004f), Sewn::on_wall(0.4f, 0.004f));
  for (int i = 0; i < 60; ++i) s.tick();
  EXPECT_EQ(s.map.tension.size(), 10u) << "ten a second";
  EXPECT_FLOAT_EQ(s.map.tension[3].peak, 0.5f);
  s.seen.event.push_back({.kind = EventKind::suture_loaded, .which = 0, .value = 0, .where = {}, .tick = s.seen.tick + 1});
  s.bite(Sewn::on_wall(0.7f, 0.004f), Sewn::on_wall(0.9f, 0.004f));
  EXPECT_EQ(s.map.bite.back().suture, 1u);
  rewind(s.map, 30);
  EXPECT_EQ(s.map.bite.size(), 1u);
  EXPECT_EQ(s.map.sutures, 0u);
  EXPECT_LE(s.map.tension.back().tick, 30u);
  EXPECT_LE(s.map.event.back().tick, 30u);
}

TEST(StitchMap, numbers_that_no_bite_has_are_left_alone) {
  Sewn s;
  s.seen.event.push_back({.kind = EventKind::bite_completed, .which = 77, .value = 0, .where = {}, .tick = 1});
  s.seen.event.push_back({.kind = EventKind::tip_entered, .which = 0xffffffffu, .value = 0, .where = {}, .tick = 1});
  s.tick();
  EXPECT_TRUE(s.map.bite.empty());
}

TEST(StitchMap, a_surgeons_bites_are_where_he_was_told_to_make_them) {
#ifdef CATGUT_SANITIZED
  GTEST_SKIP() << "twenty seconds of a surgeon take minutes under a sanitizer";
#endif
  const SceneSpec scene = read_scene("purse_string");
  LiveResult result;
  PictureModel picture;
  SessionOptions options;
  options.seconds = 20;
  SessionHooks hooks;
  hooks.on_start = [&](const PictureModel& p) { picture = p, result.map = start_map(p, 1.0 / 60); };
  hooks.on_tick = [&](const Snapshot& seen, const std::string&) {
    note(result.map, picture, seen);
    update(result.metrics, seen, 1.0f / 60);
  };
  run_session(scene, options, hooks);
  ASSERT_GE(result.map.bite.size(), 2u);
  for (const StitchBite& b : result.map.bite) {
    EXPECT_NEAR(b.entry_edge, scene.surgeon.edge_distance, 0.0015f);
    EXPECT_NEAR(b.exit_edge, scene.surgeon.edge_distance, 0.0015f);
    EXPECT_NEAR(b.length, scene.surgeon.bite_length, 0.002f);
    EXPECT_GT(b.depth, 0.0003f);
  }
  const float pitch = result.map.edge[0].length() / static_cast<float>(scene.surgeon.bites);
  EXPECT_NEAR(result.map.bite[1].spacing, pitch - scene.surgeon.bite_length, 0.003f);

  const auto json = nlohmann::json::parse(session_json(scene, result));
  EXPECT_EQ(json["stitches"].size(), result.map.bite.size());
  EXPECT_TRUE(json["stitches"][0]["spacing_mm"].is_null());
  EXPECT_NEAR(json["stitches"][1]["spacing_mm"].get<double>(), 1e3 * static_cast<double>(result.map.bite[1].spacing), 0.01);
  EXPECT_EQ(json["tension"]["time_s"].size(), result.map.tension.size());
  EXPECT_EQ(json["bites"], result.map.bite.size());
}

}  // namespace
}  // namespace catgut
