// SPDX-License-Identifier: Apache-2.0
// tests/cutting: what a cut opens bleeds, and what stops it; heat beside the pen's tip; scissors; clamps. Flow and loss against
// their closed forms, the number of vessels against the length of the cut on several meshes, conduction against the diffusion
// equation, and the force at which a clamp is torn out against its grip.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "field.h"
#include "procedure/scripted_surgeon.h"
#include "sim/recording.h"

namespace catgut {
namespace {

using physical::Bleed;

// The same with other instruments: in the right hand, in the left one, on the tray.
SceneSpec with(const char* right, const char* tray = "", int particles = 400) {
  SceneSpec s = Field::scene_of(particles);
  s.instrument[0].kind = right;
  if (*tray) {
    s.instrument.push_back(s.instrument[1]);
    s.instrument.back().kind = tray, s.instrument.back().where = "tray";
  }
  return s;
}

// Closes scissors on the rim: the blades reach `deep` [m] into the bowel along its axis.
void snip_at(Field& f, float angle, float deep) {
  const Vec3 out{portable::cos(angle), 0, portable::sin(angle)}, down{0, -1, 0};
  ToolInput& hand = f.input.hand[0];
  hand.connected = 1;
  const Pose open{out * (f.scene.body[0].radius - 0.5f * f.scene.body[0].wall) + down * deep,
                  from_axes(out, cross(Vec3{0, 1, 0}, out), {0, 1, 0})};
  hand.jaw = 1, hand.pose = {open.p + Vec3{0, 0.05f, 0}, open.q};
  f.tick();
  hand.pose = open;
  for (int i = 0; i < 12; ++i) f.tick();
  hand.jaw = 0;
  for (int i = 0; i < 3; ++i) f.tick();
}

TEST(Bleeding, a_vessel_bleeds_by_poiseuilles_law_and_clots) {
  const physical::BleedModel law;
  // pi 8 kPa (0.2 mm)^4 / (128 * 3.5 mPa s * 5 mm) = 18 ul/s.
  EXPECT_NEAR(vessel_flow(law, 0.2e-3f) / 1.795e-8f, 1, 0.001f);
  EXPECT_NEAR(vessel_flow(law, 0.1e-3f) / vessel_flow(law, 0.2e-3f), 1.0f / 16, 1e-6f);
  Field f;
  std::vector<Bleed> bleed(1);
  bleed[0].open = 1e-8f;
  for (int i = 0; i < 6000; ++i) bleed_on(law, f.model->physical->world.wall, {}, 0.01f, bleed);
  const double expected = 1e-8 * 180 * (1 - std::exp(-60.0 / 180));
  EXPECT_NEAR(static_cast<double>(bleed[0].lost) / expected, 1, 0.002);
}

// Vessels per length of cut, whatever the mesh.
TEST(Bleeding, a_cut_opens_as_many_vessels_as_its_length_has) {
  const physical::BleedModel law;
  for (const int particles : {400, 1600}) {
    const auto model = build_model(Field::scene_of(particles));
    const wall::Model& wall = model->physical->world.wall;
    std::vector<wall::Mark> marks;
    float length = 0;
    for (float depth = 0.002f; depth < 0.028f; depth += 1e-3f) {
      wall::Point before;
      for (int i = 0; i <= 100; ++i) {
        const float angle = 2 * kPi * static_cast<float>(i) / 100, r = 0.0115f;
        const wall::Point at = wall::nearest_point(wall, model->physical->start.wall,
                                                   {r * portable::cos(angle), -depth, r * portable::sin(angle)}, 0);
        if (i > 0) {
          wall::trace(wall, before, at, marks);
          length += distance(wall::rest_place(wall, before), wall::rest_place(wall, at));
        }
        before = at;
      }
    }
    std::vector<Bleed> by_blade, by_pen;
    size_t opened = 0, charred = 0;
    for (const wall::Mark& mark : marks) {
      by_blade.clear(), by_pen.clear();
      open_vessel(law, wall, mark, false, by_blade), open_vessel(law, wall, mark, true, by_pen);
      opened += by_blade.size(), charred += by_pen.size();
    }
    const float expected = length / law.spacing;
    std::printf("%d particles: %zu vessels in %.2f m of cut, expected %.0f; the pen leaves %zu open\n", particles, opened,
                static_cast<double>(length), static_cast<double>(expected), charred);
    // A path in steps of cells is up to sqrt(2) longer than its line.
    EXPECT_GT(static_cast<float>(opened), 0.8f * expected);
    EXPECT_LT(static_cast<float>(opened), 1.5f * expected);
    EXPECT_LT(charred, opened / 2);
    EXPECT_GT(charred, 0u);
  }
}

// Closes the scissors round the rim until something bleeds.
void make_it_bleed(Field& f) {
  for (int i = 0; i < 8 && f.excision().bleed.empty(); ++i) snip_at(f, 0.7f * static_cast<float>(i), 0.008f);
  ASSERT_FALSE(f.excision().bleed.empty());
}
TEST(Bleeding, scissors_divide_the_wall_between_their_blades_and_it_bleeds) {
  Field f(with("scissors"));
  const double mass = f.mass();
  snip_at(f, 0.3f, 0.008f);
  ASSERT_EQ(f.of(EventKind::tissue_snipped).size(), 1u);
  EXPECT_NEAR(f.of(EventKind::tissue_snipped)[0].value, 0.008f, 0.0008f);
  EXPECT_FALSE(f.state->physical.world.wall.topology.fragment.empty());
  for (int i = 0; i < 10; ++i) f.tick();
  EXPECT_EQ(f.of(EventKind::tissue_snipped).size(), 1u) << "closed blades cut no further";
  ASSERT_TRUE(f.seen.topology.picture);
  EXPECT_LT(opening_of(*f.seen.topology.picture), 1e-6);
  EXPECT_NEAR(f.mass() / mass, 1, 1e-6);
  EXPECT_EQ(measure_cut(f.scene, f.seen).pieces, 1u);
  EXPECT_EQ(f.seen.wound.damaged, 0) << "no heat";
  make_it_bleed(f);
  for (int i = 0; i < 60; ++i) f.tick();
  const std::vector<Event> started = f.of(EventKind::bleeding_started);
  ASSERT_EQ(started.size(), f.excision().bleed.size());
  const BleedingView& first = f.seen.wound.bleeding[0];
  const float seconds = static_cast<float>(f.state->tick - started[0].tick) * f.model->dt;
  EXPECT_NEAR(first.lost / (started[0].value * seconds), 1, 0.02f);
  uint32_t stained = 0;
  for (const Scar& scar : f.seen.scar) stained += scar.blood > 100;
  EXPECT_GT(stained, 0u) << "the blood is drawn";
}

// Shorter than the edge of the mesh that it follows: no face is divided, and yet the cut is drawn.
TEST(Bleeding, a_snip_along_an_edge_that_divides_nothing_is_drawn) {
  Field f(with("scissors"));
  const auto edges = [&] {
    const auto& layer = f.seen.topology.picture->body[0].layer;
    return std::count(layer.begin(), layer.end(), TissueLayer::cut_edge);
  };
  const auto divided = [&] {
    const wall::Topology& t = f.state->physical.world.wall.topology;
    return std::pair{t.fragment.size(), t.source.size()};
  };
  snip_at(f, 0.3f, 0.008f);  // from here on there is a picture of cuts
  const PictureModel picture = picture_model(*f.model);
  size_t along = 0;
  for (const uint32_t i : picture.rim[0]) {
    const Vec3 p = picture.particle_rest[i];
    if (p.x > 0) continue;
    const auto before = divided();
    const auto drawn = edges();
    const size_t snips = f.of(EventKind::tissue_snipped).size();
    snip_at(f, portable::atan2(p.z, p.x), 0.002f);
    if (divided() != before || f.of(EventKind::tissue_snipped).size() == snips) continue;
    ++along;
    EXPECT_GT(edges(), drawn);
    EXPECT_LT(opening_of(*f.seen.topology.picture), 1e-6);
  }
  EXPECT_GT(along, 0u);
}

TEST(Bleeding, coagulation_closes_a_vessel_and_heats_the_tissue_round_it) {
  Field f(with("scissors", "cautery"));
  make_it_bleed(f);
  // The pen comes from the tray into the right hand, onto the first vessel.
  f.input.hand[0].pose.p.y += 0.05f;
  f.tick();
  f.input.commands.push({CommandKind::swap, 0, 2}), f.tick();
  const uint32_t which = 0;
  const auto go = [&] {
    const Vec3 at = f.seen.wound.bleeding[which].at, out = normalized(Vec3{at.x, 0, at.z});
    f.input.hand[0].pose = {at + out * (0.5f * f.scene.body[0].wall), from_axes({0, 1, 0}, cross(out, {0, 1, 0}), out)};
    f.tick();
  };
  for (int i = 0; i < 6; ++i) go();
  ASSERT_GT(f.seen.wound.bleeding[which].flow, 0);
  f.input.commands.push({CommandKind::new_suture, 0, 0});
  for (int i = 0; i < 90; ++i) go();
  EXPECT_EQ(f.seen.wound.bleeding[which].flow, 0);
  ASSERT_EQ(f.of(EventKind::bleeding_stopped).size(), 1u);
  EXPECT_EQ(f.of(EventKind::bleeding_stopped)[0].which, which);
  std::printf("30 W for 1.5 s: damage reaches %.2f mm\n", 1e3 * static_cast<double>(f.seen.wound.thermal_spread));
  EXPECT_GT(f.seen.wound.thermal_spread, 0.5e-3f);
  EXPECT_LT(f.seen.wound.thermal_spread, 4e-3f);
}

TEST(Bleeding, a_swab_stops_what_it_presses_on_and_wipes_it) {
  Field f(with("scissors", "swab"));
  make_it_bleed(f);
  f.input.hand[0].pose.p.y += 0.05f;
  f.tick();
  f.input.commands.push({CommandKind::swap, 0, 2}), f.tick();
  const auto press = [&](float deep) {
    const Vec3 at = f.seen.wound.bleeding[0].at, out = normalized(Vec3{at.x, 0, at.z});
    f.input.hand[0].pose = {at + out * (0.5f * f.scene.body[0].wall + 0.005f - deep),
                            from_axes({0, 1, 0}, cross(out, {0, 1, 0}), out)};
    for (int i = 0; i < 20; ++i) f.tick();
  };
  press(0.005f);
  EXPECT_EQ(f.seen.wound.bleeding[0].flow, 0) << "pressed with " << length(f.seen.tool[0].force) << " N";
  EXPECT_LT(f.excision().bleed[0].on_wall, 1e-9f);
  EXPECT_GT(f.excision().bleed[0].open, 0) << "not closed yet";
  press(-0.03f);
  EXPECT_GT(f.seen.wound.bleeding[0].flow, 0) << "it bleeds again";
  uint32_t stopped = 0;
  for (const Event& e : f.of(EventKind::bleeding_stopped)) stopped += e.which == 0;
  EXPECT_GE(stopped, 1u);
}

TEST(Bleeding, a_bleeding_state_continues_to_the_bit_and_shows_the_same) {
  Field f(with("scissors"));
  make_it_bleed(f);
  for (int i = 0; i < 40; ++i) f.tick();
  StatePtr other = initial_state(*f.model);
  load_state(*f.model, *other, save_state(*f.model, *f.state));
  Jobs two(2);
  for (int i = 0; i < 8; ++i) {
    f.input.tick = f.state->tick;
    step(*f.model, *other, f.input, two);
    f.tick();
    ASSERT_EQ(hash_state(*f.model, *f.state), hash_state(*f.model, *other)) << "tick " << i;
  }
  Snapshot loaded;
  publish(*f.model, *other, loaded);
  ASSERT_EQ(loaded.wound.bleeding.size(), f.seen.wound.bleeding.size());
  EXPECT_EQ(loaded.wound.bleeding[0].lost, f.seen.wound.bleeding[0].lost);
}

// --- heat --------------------------------------------------------------------------------------------------------------

TEST(Heat, a_hot_spot_spreads_as_the_diffusion_equation_says) {
  for (const int particles : {400, 1600}) {
    const auto model = build_model(Field::scene_of(particles));
    const wall::Model& wall = model->physical->world.wall;
    const wall::Topology& whole = model->physical->start.wall.topology;
    const physical::HeatModel law;
    physical::Heat heat;
    physical::HeatScratch scratch;
    const wall::Point tip = wall::nearest_point(wall, model->physical->start.wall, {0.0115f, -0.012f, 0}, 0);
    heat_at(law, wall, tip, 30, true, 0.05f, heat);  // 1.5 J, half of it into the tissue: some 20 K
    const auto moments = [&] {
      double sum = 0, first = 0, second = 0;
      for (uint32_t face = 0; face < heat.warmer.size(); ++face)
        for (uint32_t c = 0; c < wall::kCells; ++c) {
          if (heat.warmer[face][c] == 0) continue;
          const bool quad = wall.mesh.face[face][3] != wall::kNone;
          wall::Point p{face, 0, 0, 0};
          wall::to_natural(quad, wall::raster(quad).center[c], p.xi, p.eta);
          const double y = static_cast<double>(wall::rest_place(wall, p).y), t = static_cast<double>(heat.warmer[face][c]);
          sum += t, first += t * y, second += t * y * y;
        }
      return std::array{sum, second / sum - first * first / (sum * sum)};
    };
    const auto before = moments();
    constexpr float kTime = 2;
    for (int i = 0; i < 120; ++i) conduct(law, wall, whole, std::span(&tip, 1), kTime / 120, scratch, heat);
    const auto after = moments();
    const double expected = 2 * 1.4e-7 * static_cast<double>(kTime);
    std::printf("%d particles: variance grew by %.3f mm2, expected %.3f; heat %.3f of its own\n", particles,
                1e6 * (after[1] - before[1]), 1e6 * expected, after[0] / before[0]);
    // Cells of a face with four corners exchange heat along its two edges alone. With unit edges u and v that is a diffusivity
    // of u u' + v v' instead of 1: along this organ, whose faces are rhombi, less than one. Faces of three corners have it in
    // all directions.
    double share = 0, area = 0;
    for (uint32_t face = 0; face < wall.mesh.face.size(); ++face) {
      const auto& c = wall.mesh.face[face];
      const auto at = [&](uint32_t column) { return 0.5f * (wall.mesh.outer[column] + wall.mesh.inner[column]); };
      const bool quad = c[3] != wall::kNone;
      const Vec3 u = at(c[1]) - at(c[0]), v = at(quad ? c[3] : c[2]) - at(c[0]);
      if (distance(at(c[0]), wall::rest_place(wall, tip)) > 0.006f) continue;
      const double size = static_cast<double>(length(cross(u, v)) * (quad ? 1.0f : 0.5f));
      const Vec3 a = normalized(u), b = normalized(v);
      area += size, share += size * (quad ? static_cast<double>(a.y * a.y + b.y * b.y) : 1.0);
    }
    std::printf("  growth %.3f of the closed form; the faces' two directions make %.3f\n", (after[1] - before[1]) / expected,
                share / area);
    EXPECT_NEAR((after[1] - before[1]) / expected, share / area, 0.1);
    EXPECT_NEAR(after[0] / before[0], std::exp(-static_cast<double>(kTime) / 60), 0.06);
  }
}

TEST(Heat, damage_beside_a_cut_is_thinner_than_beside_coagulation_and_grows_with_time) {
  const auto spread_of = [](bool coagulate, float seconds) {
    Field f;
    f.hold(0, 0.004f), f.tick(), f.tick();
    f.hold(0), f.tick(), f.tick();
    f.input.commands.push({coagulate ? CommandKind::new_suture : CommandKind::cut, 0, 0});
    const int ticks = static_cast<int>(seconds * 60);
    for (int i = 0; i < ticks; ++i) {
      if (!coagulate) f.hold(0.008f * static_cast<float>(i));  // 6 mm/s
      f.tick();
    }
    f.input.commands.push({coagulate ? CommandKind::new_suture : CommandKind::cut, 0, 0});
    for (int i = 0; i < 60; ++i) f.hold(0.008f * static_cast<float>(coagulate ? 0 : ticks), 0.01f), f.tick();
    return f.seen.wound.thermal_spread;
  };
  const float cut = spread_of(false, 1.5f), brief = spread_of(true, 0.5f), lasting = spread_of(true, 2);
  std::printf("damage beside the tip: cut %.2f mm; coagulated for 0.5 s %.2f mm, for 2 s %.2f mm\n",
              1e3 * static_cast<double>(cut), 1e3 * static_cast<double>(brief), 1e3 * static_cast<double>(lasting));
  EXPECT_LT(cut, 1e-3f);
  EXPECT_GT(brief, cut);
  EXPECT_GT(lasting, brief);
  EXPECT_LT(lasting, 4e-3f);
}

// --- clamps, and wrong surgery ------------------------------------------------------------------------------------------

// An Allis clamp closed on the rim, pulled straight up by a force. [ticks] until it is torn out; 0: it holds for 1 s.
struct Clamped {
  uint64_t torn = 0;
  Field f;
  static SceneSpec scene_of(float pull) {
    SceneSpec s = with("cautery");
    InstrumentSpec clamp;
    clamp.name = "clamp", clamp.kind = "allis", clamp.where = "parked";
    clamp.at = {0.0115f, 0, 0}, clamp.pull = {0, pull, 0};
    s.instrument.push_back(clamp);
    return s;
  }
  explicit Clamped(float pull) : f(scene_of(pull)) {
    for (int i = 0; i < 60 && torn == 0; ++i) {
      f.tick();
      if (!f.of(Fault::clamp_torn_out).empty()) torn = f.state->tick;
    }
  }
};

TEST(Clamps, a_parked_clamp_holds_its_tissue_and_crushes_it) {
  const Clamped c(1);
  EXPECT_EQ(c.torn, 0u);
  EXPECT_EQ(c.f.seen.instrument[2].place, InstrumentPlace::parked);
  EXPECT_EQ(c.f.seen.instrument[2].held, Held::tissue);
  EXPECT_GT(c.f.seen.instrument[2].pose.p.y, 0) << "it pulls the rim up";
  ASSERT_EQ(c.f.of(EventKind::tissue_crushed).size(), 1u);
  const Event crushed = c.f.of(EventKind::tissue_crushed)[0];
  EXPECT_EQ(crushed.which, 2u);
  // 12 N of pull and friction 0.35 on both sides need 17 N on jaws of 4 x 3 mm.
  EXPECT_NEAR(crushed.value, 17.1f / (0.004f * 0.003f), 0.02f * crushed.value);
}

TEST(Clamps, a_clamp_that_is_pulled_too_hard_is_torn_out_once_and_lies_on_its_tray) {
  const Clamped c(20);
  ASSERT_NE(c.torn, 0u);
  const std::vector<Event> torn = c.f.of(Fault::clamp_torn_out);
  ASSERT_EQ(torn.size(), 1u);
  EXPECT_EQ(torn[0].which, 2u);
  EXPECT_NEAR(torn[0].value, 20, 1e-3f);
  EXPECT_EQ(c.f.seen.instrument[2].place, InstrumentPlace::tray);
  EXPECT_EQ(c.f.seen.instrument[2].held, Held::nothing);
}

TEST(WrongSurgery, a_pen_that_goes_through_the_inner_tube_first_is_reported_once) {
  SceneSpec s = Field::scene_of(400);
  BodySpec inner = s.body[0];
  inner.name = "colon", inner.radius = 0.008f;
  s.body.push_back(inner);
  Field f(s);
  physical::State& world = f.state->physical.world;
  physical::Scratch scratch(f.model->physical->world, world);
  f.state->physical.cutting.mode[0] = PenMode::cut;
  f.state->event.start(0);
  const auto lead = [&](float above) {
    for (float angle = 0; angle < 0.5f; angle += 0.5e-3f) {
      f.hold(angle, above);
      world.bodies.body[0].pose = f.input.hand[0].pose;
      use_pens(*f.model, *f.state, scratch, 0.001f);
    }
  };
  const auto faults = [&] {
    uint32_t count = 0;
    for (const Event& e : f.state->event) count += e.fault == Fault::inner_wall_cut;
    return count;
  };
  lead(0);
  EXPECT_TRUE(f.state->physical.cutting.opened);
  EXPECT_EQ(faults(), 0u) << "the outer tube is the planned one";
  lead(0.008f - f.scene.body[0].radius);
  EXPECT_EQ(faults(), 1u);
}

TEST(WrongSurgery, a_bite_through_char_is_reported) {
  const SceneSpec scene = read_scene("interrupted");
  const std::shared_ptr<const Model> model = build_model(scene);
  const StatePtr state = initial_state(*model);
  auto& burnt = state->physical.cutting.excision.burnt;
  burnt.resize(model->physical->world.wall.mesh.face.size());
  for (auto& face : burnt) face.fill(1);
  const std::unique_ptr<Surgeon> surgeon = scripted_surgeon(scene, picture_model(*model));
  Jobs jobs(1);
  Snapshot seen;
  TickInput input, no_hands;
  for (ToolInput& hand : no_hands.hand) hand.connected = 0;
  publish(*model, *state, seen);
  uint32_t entered = 0, faults = 0;
  uint64_t t = 0;
  for (; t < 900 && entered == 0; ++t) {
    input = t < 5 ? no_hands : surgeon->operate(seen, model->dt);
    input.tick = t;
    step(*model, *state, input, jobs);
    publish(*model, *state, seen);
    for (const Event& e : seen.event) entered += e.kind == EventKind::tip_entered, faults += e.fault == Fault::bite_in_char;
  }
  std::printf("the tip entered char in tick %d\n", static_cast<int>(t));
  ASSERT_EQ(entered, 1u);
  EXPECT_EQ(faults, 1u);
}

}  // namespace
}  // namespace catgut
