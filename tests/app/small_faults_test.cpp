// SPDX-License-Identifier: Apache-2.0
// tests/app: one time format on the work screen.
#ifdef CATGUT_TESTS_WINDOW
#include <gtest/gtest.h>

#include "window/words.h"
#include "window/work_text.h"

namespace catgut {
namespace {

TEST(SmallFaults, the_log_and_the_status_show_minutes) {
  const PictureModel picture;
  SceneSpec scene;
  Snapshot seen;
  LiveStatus status;
  status.settling = false;
  status.metrics.time_s = 67.5;
  Steering steering;
  MouseHand mouse;
  std::deque<LogLine> log(1);
  log[0].time_s = 67.5, log[0].text = "bite completed";
  WorkView view;
  view.scene = &scene, view.status = &status, view.seen = &seen, view.picture = &picture;
  view.steering = &steering, view.mouse = &mouse, view.log = &log;
  size_t with_time = 0;
  for (const Panel& p : work_panels({&view, nullptr, false, {}, {}}, {}))
    for (const PanelLine& l : p.line) {
      EXPECT_EQ(l.text.find("67.5"), std::string::npos) << p.name << ": " << l.text;
      with_time += l.text.find("1:07.5") != std::string::npos;
    }
  EXPECT_EQ(with_time, 2u) << "log and status";
  EXPECT_EQ(clock_text(3600), "60:00.0");
}

}  // namespace
}  // namespace catgut
#endif
