// SPDX-License-Identifier: Apache-2.0
// tests/surgeon: scripted hands move like hands, and only through ToolInput. The surgeon's room cannot include the simulation
// (tests/layers checks the dependencies), so it reads only Snapshots; here two surgeons with equal input act equally.
#include "surgeon/hands.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "core/random.h"
#include "procedure/scene_file.h"
#include "sim/simulation.h"
#include "surgeon/surgeon.h"

namespace catgut {
namespace {

TEST(Hands, move_no_faster_than_asked_and_arrive) {
  Random random(4);
  for (int run = 0; run < 50; ++run) {
    const float dt = run % 2 ? 1.0f / 60 : 1.0f / 1000, speed = 0.01f + 0.3f * random.uniform();
    ScriptedHand hand;
    const Pose goal{{0.3f * random.normal(), 0.3f * random.normal(), 0.3f * random.normal()},
                    normalized(Quat{random.normal(), random.normal(), random.normal(), random.normal()})};
    bool there = false;
    float before = 0;
    for (int i = 0; i < 2000000 && !there; ++i) {
      const Pose at = hand.pose;
      there = move_toward(hand, goal, speed, dt);
      const float now = distance(hand.pose.p, at.p) / dt;
      ASSERT_LE(now, speed * 1.001f + 1e-5f);
      ASSERT_LE(now, before + 1.5f * dt * 1.01f + 1e-4f + 0.001f / dt * 1e-3f) << "speeds up like a hand";
      ASSERT_LE(length(rotation_vector(hand.pose.q * conjugate(at.q))), 4.0f * dt * 1.2f + 1e-4f);
      before = now;
    }
    EXPECT_TRUE(there);
    EXPECT_LT(distance(hand.pose.p, goal.p), 0.0003f);
  }
}

TEST(Hands, jaw_closes_at_five_strokes_a_second) {
  ScriptedHand hand;
  int ticks = 0;
  while (!move_jaw(hand, 0, 1.0f / 60)) ++ticks;
  EXPECT_NEAR(ticks, 12, 1);
  EXPECT_NEAR(hand.jaw, 0, 1e-4f);
}

// The tremor's deviation is the requested one, at any tick rate.
TEST(Hands, tremor_has_the_asked_deviation) {
  for (const float rate : {60.0f, 240.0f, 1000.0f})
    for (const float deviation : {0.0001f, 0.0005f}) {
      ScriptedHand hand;
      Random random(9);
      double sum = 0, square = 0;
      size_t n = 0;
      for (int i = 0; i < 400000; ++i) {
        tremble(hand, deviation, random, 1 / rate);
        for (float c : {hand.tremor.x, hand.tremor.y, hand.tremor.z}) sum += double{c}, square += double{c} * double{c}, ++n;
      }
      EXPECT_NEAR(std::sqrt(square / static_cast<double>(n)), double{deviation}, 0.03 * double{deviation}) << rate;
      EXPECT_NEAR(sum / static_cast<double>(n), 0, 0.05 * double{deviation}) << rate;
    }
}

TEST(Hands, no_tremor_asked_none_given) {
  ScriptedHand hand;
  Random random(2);
  for (int i = 0; i < 100; ++i) tremble(hand, 0, random, 1.0f / 60);
  EXPECT_EQ(hand.tremor, Vec3{});
}

struct Scene {
  std::shared_ptr<const Model> model = build_model(read_scene("purse_string"));
  StatePtr state = initial_state(*model);
  Jobs jobs{1};
  Snapshot seen;
  Scene() { publish(*model, *state, seen); }
};

bool same(const HandInputs& a, const HandInputs& b) {
  for (size_t k = 0; k < 2; ++k)
    if (!(a[k].pose == b[k].pose) || !(a[k].velocity == b[k].velocity) || a[k].jaw != b[k].jaw ||
        a[k].sequence != b[k].sequence)
      return false;
  return true;
}

TEST(Surgeon, same_seed_same_hands_another_seed_other_hands) {
  Scene scene;
  SurgeonSkill skill, other;
  skill.seed = 5, other.seed = 6;
  const PictureModel picture = picture_model(*scene.model);
  const auto a = make_surgeon("purse_string", picture, skill), b = make_surgeon("purse_string", picture, skill),
             c = make_surgeon("purse_string", picture, other);
  bool differ = false;
  for (int i = 0; i < 240; ++i) {
    TickInput in;
    in.tick = static_cast<uint64_t>(i);
    in.hand = a->operate(scene.seen, 1.0f / 60).hand;
    ASSERT_TRUE(same(in.hand, b->operate(scene.seen, 1.0f / 60).hand)) << i;
    differ = differ || !same(in.hand, c->operate(scene.seen, 1.0f / 60).hand);
    step(*scene.model, *scene.state, in, scene.jobs);
    publish(*scene.model, *scene.state, scene.seen);
  }
  EXPECT_TRUE(differ);
}

// Over a whole bite: hands keep the speed limits of the skill, tremor excluded.
TEST(Surgeon, keeps_to_the_speed_of_its_skill) {
  Scene scene;
  SurgeonSkill skill;
  skill.tremor = 0;
  const auto surgeon = make_surgeon("purse_string", picture_model(*scene.model), skill);
  HandInputs before = surgeon->operate(scene.seen, 1.0f / 60).hand;
  float fastest = 0;
  for (int i = 0; i < 600; ++i) {
    TickInput in;
    in.tick = static_cast<uint64_t>(i);
    in.hand = surgeon->operate(scene.seen, 1.0f / 60).hand;
    for (size_t k = 0; k < 2; ++k) {
      fastest = std::max(fastest, distance(in.hand[k].pose.p, before[k].pose.p) * 60);
      ASSERT_GE(in.hand[k].jaw, 0.0f);
      ASSERT_LE(in.hand[k].jaw, 1.0f);
    }
    before = in.hand;
    step(*scene.model, *scene.state, in, scene.jobs);
    publish(*scene.model, *scene.state, scene.seen);
  }
  EXPECT_LE(fastest, 2 * skill.speed * 1.01f);  // following the needle's circle it may move at twice the speed
  EXPECT_GT(fastest, 0.5f * skill.speed);
}

// The surgeon reads nothing but the Snapshot: no file of its room names a room below or beside.
TEST(Surgeon, sees_the_snapshot_alone) {
  for (const char* name : {"surgeon.h", "hands.h", "hands.cpp", "plan.h", "plan.cpp", "sight.h", "sight.cpp", "scripted.h",
                           "scripted.cpp", "tying.cpp"}) {
    std::ifstream in(std::string(CATGUT_SOURCE_DIR) + "/src/surgeon/" + name);
    ASSERT_TRUE(in) << name;
    std::string line;
    while (std::getline(in, line))
      if (line.rfind("#include \"", 0) == 0) {
        EXPECT_TRUE(line.find("\"core/") != line.npos || line.find("\"exchange/") != line.npos ||
                    line.find("\"surgeon/") != line.npos)
            << line;
      }
  }
}

TEST(Surgeon, says_that_it_has_no_script) {
  Scene scene;
  EXPECT_THROW(make_surgeon("juggling", picture_model(*scene.model), {}), std::invalid_argument);
  EXPECT_THROW(make_surgeon("purse_string", {}, {}), std::invalid_argument);
}

}  // namespace
}  // namespace catgut
