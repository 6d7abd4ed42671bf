// SPDX-License-Identifier: Apache-2.0
// tests/app: panels never hide the work. The scripted surgeon carries out the first lesson; at every step, in every size of
// window and text, needle tip, suture points, both jaws and the end of the tail are compared with the rectangles of the panels.
#ifdef CATGUT_TESTS_WINDOW
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <set>

#include "exchange/strand.h"
#include "procedure/manager.h"
#include "procedure/procedure_file.h"
#include "procedure/scripted_surgeon.h"
#include "render/orbit.h"
#include "runtime/guide.h"
#include "sim/simulation.h"
#include "window/work_text.h"

namespace catgut {
namespace {

struct Size {
  float width, height, text;
};

// As Window::resized and panel_text_size do it, for a font of fixed width.
TextSize text_of(const Size& s) {
  const float scale = std::clamp(std::min(s.height / 720, s.width / 1280), 0.7f, 4.0f) * s.text;
  return {0.602f * 16 * scale, 16 * scale + std::floor(5 * scale), std::floor(12 * scale), std::floor(10 * scale)};
}

std::string shown(const std::vector<PlacedPanel>& panels, const std::string& name) {
  for (const PlacedPanel& p : panels)
    if (p.name == name) {
      std::string all;
      for (const PanelLine& l : p.line) all += (all.empty() ? "" : " ") + l.text;
      return all;
    }
  return "";
}

void expect_all_uncovered(const char* which) {
  std::vector<Size> sizes;
  for (const auto& [w, h] : {std::pair{1280, 720}, {640, 360}, {3840, 2160}, {1024, 768}})
    for (const float text : {0.8f, 1.0f, 1.5f, 2.0f}) sizes.push_back({static_cast<float>(w), static_cast<float>(h), text});
  const Procedure lesson = read_procedure(which);
  const SceneSpec scene = scene_of(lesson);
  const auto model = build_model(scene);
  const PictureModel picture = picture_model(*model);
  const StatePtr state = initial_state(*model);
  const BitePlaces places = bite_places(scene, picture);
  Jobs jobs(1);
  Snapshot seen;
  publish(*model, *state, seen);
  const Orbit orbit = start_orbit(picture, seen.active().needle.pose.p);
  const auto surgeon = scripted_surgeon(scene, picture);

  LiveStatus status;
  status.settling = false;
  Steering steering = start_steering(picture, false);
  MouseHand mouse;
  std::deque<LogLine> log;
  WorkView view;
  view.scene = &scene, view.status = &status, view.seen = &seen, view.picture = &picture;
  view.steering = &steering, view.mouse = &mouse, view.log = &log;
  begin_run(status.procedure, lesson, seen, 1.0 / 60);

  std::vector<std::vector<PlacedPanel>> before(sizes.size());
  std::vector<std::optional<PanelRect>> inset(sizes.size());
  size_t insets = 0, tips = 0, inset_moves = 0;  // at 1280x720, text 1
  std::map<std::pair<uint32_t, size_t>, int> looked;
  size_t moves = 0, samples = 0, covered = 0;
  const auto look = [&] {
    WorkText work{&view, &lesson, true, next_bite(places, picture, seen), {}};
    const std::vector<Panel> panels = work_panels(work, {});
    for (size_t i = 0; i < sizes.size(); ++i) {
      const auto [w, h, text] = sizes[i];
      const Camera c = camera_of(orbit);
      const ViewFrame frame = view_frame(c.eye, c.target, c.up, c.fov_deg, h);
      const BiteGuide* guide = work.guide ? &*work.guide : nullptr;
      const auto placed =
          place_panels(panels, w, h, text_of(sizes[i]), work_points(seen, picture, frame, w, h, guide), before[i]);
      const auto regardless = place_panels(panels, w, h, text_of(sizes[i]), {});
      // The points, projected here once more: tip, suture points, tips of both tools.
      std::vector<std::pair<std::string, Vec3>> points{{"needle tip", on_needle(picture, seen.active().needle.pose, 1)},
                                                       {"needle holder", seen.tool[0].pose.p},
                                                       {"forceps", seen.tool[1].pose.p}};
      for (const SuturePointView& p : seen.active().suture_point) points.push_back({"suture point", p.position});
      if (!seen.active().suture_point.empty()) points.push_back({"end of the tail", node_at(seen, 0)});
      for (const auto& [name, p] : points) {
        const Vec3 d = p - c.eye, ahead = normalized(c.target - c.eye), right = normalized(cross(ahead, c.up)),
                   up = cross(right, ahead);
        const float depth = dot(d, ahead), focal = 0.5f * h / std::tan(0.5f * c.fov_deg * kPi / 180);
        const float x = 0.5f * w + focal * dot(d, right) / depth, y = 0.5f * h - focal * dot(d, up) / depth;
        for (const PlacedPanel& panel : regardless) covered += panel.rect.holds(x, y);
        for (const PlacedPanel& panel : placed)
          ASSERT_FALSE(panel.rect.holds(x, y)) << panel.name << " covers the " << name << " at step "
                                               << status.procedure.stage + 1 << ", " << w << "x" << h << ", text " << text;
      }
      // The magnifier.
      const auto was = std::exchange(inset[i], std::nullopt);
      if (ScreenPoint tip; on_screen(points[0].second, frame, w, h, tip)) {
        const auto side = static_cast<float>(inset_side(static_cast<int>(w), static_cast<int>(h)));
        inset[i] = place_inset(side, w, h, tip, work_points(seen, picture, frame, w, h, guide), placed, was);
        if (i == 1)
          ++tips, insets += inset[i].has_value(),
              inset_moves += was && inset[i] && (was->x != inset[i]->x || was->y != inset[i]->y);
      }
      if (inset[i]) {
        const PanelRect& r = *inset[i];
        ASSERT_TRUE(r.x >= 0 && r.y >= 0 && r.x + r.w <= w && r.y + r.h <= h);
        for (const PlacedPanel& panel : placed) ASSERT_FALSE(r.meets(panel.rect)) << "magnifier over " << panel.name;
        for (const auto& [name, p] : points) {
          ScreenPoint at;
          if (!on_screen(p, frame, w, h, at)) continue;
          ASSERT_FALSE(r.holds(at[0], at[1])) << "magnifier over the " << name << ", " << w << "x" << h << ", text " << text;
        }
      }
      for (const PlacedPanel& a : placed) {
        EXPECT_GE(a.rect.x, 0) << a.name;
        EXPECT_LE(a.rect.x + a.rect.w, w) << a.name;
        EXPECT_GE(a.rect.y, 0) << a.name;
        EXPECT_LE(a.rect.y + a.rect.h, h) << a.name;
        for (const PlacedPanel& b : placed) ASSERT_TRUE(&a == &b || !a.rect.meets(b.rect)) << a.name << " over " << b.name;
      }
      // The instruction itself can be read.
      const std::string instruction = shown(placed, "procedure");
      const ProcedureStage& s = lesson.stage[std::min<size_t>(status.procedure.stage, lesson.stage.size() - 1)];
      if (!finished(status.procedure, lesson)) {
        EXPECT_NE(instruction.find(s.title), std::string::npos) << w << "x" << h << ", text " << text;
        if (text <= 1.5f) {
          EXPECT_NE(instruction.find(s.text), std::string::npos) << instruction << " | " << w << "x" << h << ", text " << text;
        }
        if (text <= 1 && w > 1000) { EXPECT_FALSE(shown(placed, "state").empty()) << w << "x" << h; }
      }
      for (const PlacedPanel& a : placed)
        for (const PlacedPanel& b : before[i])
          moves += a.name == "procedure" && b.name == a.name && i == 5 &&
                   (std::abs(a.rect.x - b.rect.x) > 0.1f * w || std::abs(a.rect.y - b.rect.y) > 0.1f * h);
      before[i] = placed;
      ++looked[{status.procedure.stage, i}];
    }
    ++samples;
  };
  int tick = 0;
  while (!surgeon->done() && seen.time_s < 60 && !testing::Test::HasFatalFailure()) {
    step(*model, *state, surgeon->operate(seen, 1.0f / 60), jobs);
    publish(*model, *state, seen);
    status.reading = update_run(status.procedure, lesson, seen);
    for (const Event& e : seen.event) {
      LogLine line;
      line.text = words_for(e, line.bad), line.time_s = seen.time_s;
      if (!line.text.empty()) log.push_back(line);
      if (log.size() > 8) log.pop_front();
    }
    status.metrics.time_s = seen.time_s;
    if (status.reading || ++tick % 6 == 0) look();
  }
  EXPECT_TRUE(finished(status.procedure, lesson));
  std::set<uint32_t> stages;
  for (const auto& [key, n] : looked) stages.insert(key.first);
  EXPECT_GE(stages.size(), lesson.stage.size()) << "every step was looked at";
  EXPECT_GT(covered, 0u) << "without the help something would be covered";
  EXPECT_GT(static_cast<double>(insets), 0.9 * static_cast<double>(tips)) << "no room for the magnifier at 1280x720";
  std::printf("magnifier at 1280x720: shown in %zu of %zu pictures with the tip in view, moved %zu times\n", insets, tips,
              inset_moves);
  std::printf("%zu points covered without regard to the work; ", covered);
  std::printf("%zu pictures, %zu sizes, the instruction changed its place %zu times at 640x360\n", samples, sizes.size(),
              moves);
}

TEST(Layout, needle_points_and_jaws_are_uncovered_at_every_step_in_every_size) { expect_all_uncovered(kLessons[0]); }

TEST(Layout, so_they_are_in_the_second_lesson) {
  if (!std::getenv("CATGUT_LONG")) GTEST_SKIP() << "set CATGUT_LONG=1";
  expect_all_uncovered(kLessons[1]);
}

TEST(Layout, text_is_wrapped_by_characters) {
  const PanelLine lines[] = {{Tone::normal, "one two three"}, {Tone::bad, "\u00e4\u00f6\u00fc \u00df"}};
  const auto out = wrapped(lines, 7);
  ASSERT_EQ(out.size(), 3u);
  EXPECT_EQ(out[0].text, "one two");
  EXPECT_EQ(out[1].text, "three");
  EXPECT_EQ(out[2].text, "\u00e4\u00f6\u00fc \u00df");
  EXPECT_EQ(letters(out[2].text), 5u);
}

TEST(Layout, keys_fade_once_used) {
  WindowInput in;
  in.mouse.hand_changes = 1;
  UsedKeys used;
  used.note(in);
  const PictureModel picture;
  SceneSpec scene;
  Snapshot seen;
  LiveStatus status;
  status.settling = false;
  Steering steering;
  MouseHand mouse;
  std::deque<LogLine> log;
  WorkView view;
  view.scene = &scene, view.status = &status, view.seen = &seen, view.picture = &picture;
  view.steering = &steering, view.mouse = &mouse, view.log = &log;
  const auto keys = [&](UsedKeys u) {
    std::string all;
    for (const Panel& p : work_panels({&view, nullptr, false, {}, u}, {}))
      if (p.name == "keys")
        for (const PanelLine& l : p.line) all += l.text + "\n";
    return all;
  };
  EXPECT_NE(keys({}).find("Tab"), std::string::npos);
  EXPECT_EQ(keys(used).find("Tab"), std::string::npos);
  EXPECT_NE(keys(used).find("wheel"), std::string::npos);
}

// With --stage the surgeon has made the bites before it; the status names them.
TEST(Layout, a_later_stage_counts_the_bites_before_it) {
  const Procedure p = read_procedure("first_stitch");
  const SceneSpec scene = scene_of(p);
  Snapshot seen;
  seen.suture.resize(1);
  seen.suture[0].bite.resize(2);
  for (BiteView& b : seen.suture[0].bite) b.complete = true;
  LiveStatus status;
  status.settling = false;
  begin_run(status.procedure, p, seen, 1.0 / 60, 7);
  const PictureModel picture;
  Steering steering;
  MouseHand mouse;
  std::deque<LogLine> log;
  WorkView view;
  view.scene = &scene, view.status = &status, view.seen = &seen, view.picture = &picture;
  view.steering = &steering, view.mouse = &mouse, view.log = &log;
  std::string all;
  for (const Panel& panel : work_panels({&view, &p, true, {}, {}}, {}))
    for (const PanelLine& l : panel.line) all += l.text + "\n";
  EXPECT_NE(all.find("bites 2"), std::string::npos) << all;
}

TEST(Layout, wrong_surgery_is_named_on_the_screen_with_its_reason) {
  const Procedure p = read_procedure("altemeier");
  Snapshot seen;
  for (const char* name : {"inner tube", "off the line", "attached", "clamp torn out", "stitch over char"}) {
    const auto error = std::find_if(p.error.begin(), p.error.end(), [&](const auto& e) { return e.name == name; });
    ASSERT_NE(error, p.error.end()) << name;
    LiveStatus status;
    begin_run(status.procedure, p, seen, 1.0 / 60);
    status.procedure.error.push_back({0, 0, static_cast<uint32_t>(error - p.error.begin())});
    std::string text;
    for (const PanelLine& l : procedure_panel(p, status, seen, Guidance::practice, false).line) text += l.text + "\n";
    EXPECT_NE(text.find("! " + error->text + " " + error->why), std::string::npos) << text;
    EXPECT_GT(error->why.size(), 20u);
  }
}

// What a panel of a stage says.
TEST(Layout, no_stage_is_left_without_a_word) {
  const Procedure p = read_procedure("first_stitch");
  Snapshot seen;
  LiveStatus status;
  begin_run(status.procedure, p, seen, 1.0 / 60, 6);
  status.procedure.record[5].state = StageState::met;
  status.procedure.record[4].state = StageState::done;
  const auto all = [&] {
    std::string text;
    for (const PanelLine& l : procedure_panel(p, status, seen, Guidance::learn, true).line) text += l.text + "\n";
    return text;
  };
  EXPECT_NE(all().find("6 Approximate the bowel ends: already reached"), std::string::npos) << all();
  EXPECT_EQ(all().find("5 "), std::string::npos);
  EXPECT_EQ(all().find("Time stands still"), std::string::npos);
  status.reading = true;
  EXPECT_NE(all().find("Time stands still"), std::string::npos);
  EXPECT_EQ(all().find("release the tail"), std::string::npos) << "it is not held";
  seen.tool[0].held = Held::thread;
  EXPECT_NE(all().find("release the tail"), std::string::npos) << all();
}

}  // namespace
}  // namespace catgut
#endif
