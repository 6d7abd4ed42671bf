// SPDX-License-Identifier: Apache-2.0
// tests/runtime: the assessment of an interactive session is that of its recording, to the bit.
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <thread>

#include "procedure/scene_file.h"
#include "runtime/assessment.h"
#include "runtime/live.h"

namespace catgut {
namespace {

// Ticks as fast as the machine computes them.
bool go_on(Live& live, uint64_t ticks, const std::function<bool()>& enough) {
  Snapshot seen;
  for (uint64_t done = 0; done < ticks && !enough();) {
    live.look(seen);
    const uint64_t before = live.status().tick;
    int asked = 0;
    while (asked < 60 && live.command(LiveCommand::single_step)) ++asked;
    for (int wait = 0; wait < 20000 && live.status().tick < before + static_cast<uint64_t>(asked); ++wait) {
      std::this_thread::sleep_for(std::chrono::microseconds(200));
      live.look(seen);
    }
    if (live.status().tick == before) return false;
    done += static_cast<uint64_t>(asked);
  }
  return enough();
}

TEST(LiveAssessment, equals_that_of_the_recording) {
  const std::string file =
      (std::filesystem::path(testing::TempDir()) / ("assess_" + std::to_string(getpid()) + ".cgrec")).string();
  SceneSpec scene = read_scene("stay");
  LiveOptions options;
  options.surgeon = "scripted", options.record = file, options.start_paused = true, options.remarks = true;
  options.rubric = rubrics_for("", scene);
  ASSERT_EQ(options.rubric.size(), 1u);
  Live live(scene, options);
  std::vector<assess::Remark> remarks;
#ifdef CATGUT_SANITIZED
  constexpr uint64_t kTicks = 240;  // a bite is out of reach under a sanitizer
#else
  constexpr uint64_t kTicks = 2400;
#endif
  const bool sewn = go_on(live, kTicks, [&] {
    for (assess::Remark r; live.remark(r);) remarks.push_back(r);
    return live.status().metrics.bites >= 1;
  });
  LiveResult result = live.finish();
  if (kTicks > 1000) { EXPECT_TRUE(sewn) << "no bite in 40 s of the scripted surgeon"; }
  for (assess::Remark r; live.remark(r);) remarks.push_back(r);
  EXPECT_EQ(remarks.empty(), !sewn) << "a remark follows a bite";
  ASSERT_EQ(result.recorded.size(), 1u);
  EXPECT_EQ(result.recorded_from[0], 0u);
  assess::Result replayed = assess_recording(read_recording(file), file, 1, options.rubric);
  EXPECT_EQ(replayed.bite.size(), sewn ? 1u : 0u);
  result.assessment.surgeon = replayed.surgeon;  // "scripted" and "recording"
  EXPECT_EQ(assess::result_json(result.assessment), assess::result_json(replayed));
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace catgut
