// SPDX-License-Identifier: Apache-2.0
// tests/hands: the stages of an operation by a user with a mouse or a gamepad, in lock step, without a window: clamps from the
// tray onto the rim, the pen along its line, the specimen away, scissors. window_stages_test has the same with real events.
#include <gtest/gtest.h>

#include <algorithm>

#include "lock_step.h"
#include "procedure/manager.h"
#include "procedure/procedure_file.h"
#include "runtime/cut_measures.h"

namespace catgut {
namespace {

constexpr float kLine = 0.025f;  // [m] from the rim, in scene altemeier; 6 mm in scene excision
constexpr std::array<float, 4> kClock{0, 0.5f * kPi, kPi, 1.5f * kPi};

enum class Device { mouse, pad };
std::unique_ptr<LockStep> sit_down(Device device, const std::string& scene, int ticks) {
  if (device == Device::mouse) return std::make_unique<AtTheMouse>(ticks, scene);
  return std::make_unique<AtThePad>(ticks, scene);
}

bool secure(Person& me) {
  for (const float angle : kClock)
    if (!me.take_instrument(0, "allis") || !me.grasp_rim(0, angle) || !me.park(0) || !me.carry(0, {0, 0.06f, 0})) return false;
  return true;
}

class Stages : public testing::TestWithParam<Device> {};
INSTANTIATE_TEST_SUITE_P(Devices, Stages, testing::Values(Device::mouse, Device::pad),
                         [](const auto& device) { return device.param == Device::mouse ? "by_mouse" : "by_gamepad"; });

TEST_P(Stages, four_clamps_are_closed_on_the_rim_and_parked) {
  const auto desk = sit_down(GetParam(), "altemeier", 2);
  const Procedure procedure = read_procedure("altemeier");
  ProcedureRun run;
  begin_run(run, procedure, desk->look().seen, 1.0 / 60);
  desk->after_tick = [&](const Snapshot& seen) { update_run(run, procedure, seen); };
  Person me(*desk);
  ASSERT_TRUE(secure(me)) << me.doing();
  EXPECT_EQ(desk->count(EventKind::instrument_parked), 4u);
  EXPECT_EQ(desk->count(EventKind::technique_fault), 0u);
  EXPECT_EQ(procedure.stage[run.stage].name, "cut") << "the goal of the first stage is reached";
  size_t holding = 0;
  for (const InstrumentView& i : desk->look().seen.instrument)
    holding += i.place == InstrumentPlace::parked && i.held == Held::tissue;
  EXPECT_EQ(holding, 4u);
}

// The operation is left after its first stage, saved, and resumed at the other device: the procedure continues with its cut.
TEST_P(Stages, a_saved_stage_is_resumed) {
  std::vector<std::byte> saved;
  {
    const auto desk = sit_down(GetParam() == Device::mouse ? Device::pad : Device::mouse, "altemeier", 2);
    Person me(*desk);
    ASSERT_TRUE(secure(me)) << me.doing();
    saved = desk->save();
  }
  const auto desk = sit_down(GetParam(), "altemeier", 2);
  desk->load(saved);
  const Procedure procedure = read_procedure("altemeier");
  ProcedureRun run;
  begin_run(run, procedure, desk->look().seen, 1.0 / 60);
  desk->after_tick = [&](const Snapshot& seen) { update_run(run, procedure, seen); };
  Person me(*desk);
  ASSERT_TRUE(me.take_instrument(0, "cautery")) << me.doing();
  ASSERT_TRUE(me.score(0, kLine, -0.5f * kPi, -0.1f * kPi)) << me.doing();
  ASSERT_LT(run.stage, procedure.stage.size());
  EXPECT_EQ(procedure.stage[run.stage].name, "cut");
  EXPECT_GE(desk->count(EventKind::wall_cut_through), 1u);
  size_t holding = 0;
  for (const InstrumentView& i : desk->look().seen.instrument)
    holding += i.place == InstrumentPlace::parked && i.held == Held::tissue;
  EXPECT_EQ(holding, 4u);
}

TEST_P(Stages, the_end_of_a_bowel_is_cut_off_and_carried_away) {
  const auto desk = sit_down(GetParam(), "excision", 2);
  std::string faults;
  float freed = 0;  // [kg] the heaviest piece
  desk->after_tick = [&](const Snapshot& seen) {
    for (const Event& e : seen.event)
      if (e.kind == EventKind::technique_fault) faults += std::string(" ") + fault_name(e.fault);
      else if (e.kind == EventKind::piece_freed) freed = std::max(freed, e.value);
  };
  Person me(*desk);
  ASSERT_TRUE(me.grasp_rim(1, kPi)) << me.doing();
  ASSERT_TRUE(me.cut_round(0, 0.006f)) << me.doing();
  EXPECT_NEAR(freed, 0.2f * 0.00455f, 0.0001f) << "6 mm of 30: slivers do not count";
  ASSERT_TRUE(me.carry(1, {-0.10f, 0.06f, 0})) << me.doing();
  EXPECT_EQ(desk->look().seen.tool[1].held, Held::tissue) << "the specimen is in the forceps";
  EXPECT_GT(measure_cut(desk->scene(), desk->look().seen).way, 0.08) << "it has come along";
  EXPECT_EQ(faults, "");
}

TEST_P(Stages, scissors_lengthen_an_opening_and_the_pen_stops_the_bleeding) {
  const auto desk = sit_down(GetParam(), "slit", 2);
  Person me(*desk);
  for (const float angle : {0.0f, kPi}) ASSERT_TRUE(me.snip(0, angle, 0.008f)) << me.doing();
  EXPECT_EQ(desk->count(EventKind::tissue_snipped), 2u);
  ASSERT_TRUE(me.take_instrument(0, "cautery")) << me.doing();
  const auto bleeding = [&] {
    const auto& all = desk->look().seen.wound.bleeding;
    return static_cast<size_t>(std::count_if(all.begin(), all.end(), [](const BleedingView& b) { return b.flow > 0; }));
  };
  const size_t before = bleeding(), stopped = me.coagulate(0);
  std::printf("%zu vessels bled, the pen stopped %zu\n", before, stopped);
  EXPECT_GT(before, 0u);
  EXPECT_GT(stopped, 0u);
  EXPECT_EQ(desk->look().seen.topology.pieces, 1u);
}

}  // namespace
}  // namespace catgut
