// SPDX-License-Identifier: Apache-2.0
// app/window: a lesson in the window: the current step, its instruction, and its demonstration on request. Time and
// state are runtime/live's; the steps and their goals are procedure/lesson's.
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
  // After every update of the picture and its events: detects completed steps, ends a completed demonstration. True: the step
  // has changed.
  bool look(Live& live, const Snapshot& seen, double wall_s);
  // The key: starts or stops the demonstration.
  void show(Live& live);

 private:
  const Lesson* lesson_ = nullptr;
  size_t step_ = 0;
  uint32_t epoch_ = 0;
  bool begun_ = false, showing_ = false, started_ = false, gave_up_ = false;
  double shown_at_ = -1;  // [s] wall time
  std::vector<Event> happened_;
};

// Below the field: the step, instruction, progress. hints: with details.
void lesson_panel(const LessonRun& run, bool hints);

// The planned bite and the distance of the needle from it, over the image: the circle that its tip should follow.
// While it is in tissue, bite distance and depth as text and color (blue: within tolerance, orange: outside). size: of the
// window.
void guide_overlay(const BiteGuide& guide, const ViewFrame& view, const PictureModel& picture, const Snapshot& seen,
                   float width, float height);

}  // namespace catgut
