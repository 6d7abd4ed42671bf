// SPDX-License-Identifier: Apache-2.0
// app/window: a lesson at the window: which step a user is at, what to do, and the surgeon who shows it on request. Time and
// state are runtime/live's, the steps and how they are recognized procedure/lesson's.
#pragma once
#include <vector>

#include "device/steer.h"
#include "procedure/lesson.h"
#include "runtime/live.h"

namespace catgut {

class LessonRun {
 public:
  void begin(const Lesson& lesson) { *this = {}, lesson_ = &lesson; }
  void end() { *this = {}; }
  bool on() const { return lesson_; }
  const Lesson& lesson() const { return *lesson_; }
  size_t step() const { return step_; }
  bool all_done() const { return lesson_ && step_ >= lesson_->step.size(); }
  bool showing() const { return showing_; }
  bool gave_up() const { return gave_up_; }

  void note_event(const Event& event) { happened_.push_back(event); }
  // After every look at the field and its events: recognizes steps, ends a demonstration that has shown what it should. True:
  // another step than before.
  bool look(Live& live, const Snapshot& seen, double wall_s);
  // The key: the surgeon shows the step, or stops showing.
  void show(Live& live);

 private:
  const Lesson* lesson_ = nullptr;
  size_t step_ = 0;
  uint32_t epoch_ = 0;
  bool begun_ = false, showing_ = false, started_ = false, gave_up_ = false;
  double shown_at_ = -1;  // [s] wall time
  std::vector<Event> happened_;
};

// Below the field: the step, how, progress. hints: with how it is done.
void lesson_panel(const LessonRun& run, bool hints);

// Where the next bite goes and how near the needle is to it, over the picture: the circle that its tip should follow, and,
// while it is in the tissue, bite distance and depth in words and colors (blue: as it should be, orange: not). size: of the
// window.
void guide_overlay(const BiteGuide& guide, const ViewFrame& view, const PictureModel& picture, const Snapshot& seen,
                   float width, float height);

}  // namespace catgut
