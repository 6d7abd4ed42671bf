// SPDX-License-Identifier: Apache-2.0
// runtime: the pictures of a run: single frames, a time-lapse film, a contact sheet. Reads snapshots during the run;
// writes files. With clips.h the only file above the render room that uses the renderer.
#pragma once
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "exchange/picture.h"
#include "exchange/snapshot.h"

namespace catgut {

struct PictureOptions {
  std::string frames;         // folder for one PNG per picture; empty: none
  std::string video;          // MP4; empty: none
  std::string contact_sheet;  // PNG of up to twelve moments; empty: none
  // Stills at full quality: simulated time [s] and PNG. In any order.
  std::vector<std::pair<double, std::string>> still;
  double speed = 4;  // simulated seconds per second of film
  double rate = 30;  // pictures per second of film
  int width = 640, height = 360;
  int still_width = 1920, still_height = 1080;
  // "follow", "close" or a name of fixed_camera (render/camera.h). Empty: films follow the work, stills and the film's end are
  // close-ups.
  std::string camera;
  double end_s = 2;  // [s] of film: the last state in close-up
  bool any() const { return !frames.empty() || !video.empty() || !contact_sheet.empty() || !still.empty(); }
};

class Pictures {
 public:
  // Throws InputError if this machine cannot render, encode or write there: before the run, not after it.
  Pictures(const PictureOptions& options, const PictureModel& model);
  ~Pictures();
  Pictures(const Pictures&) = delete;
  Pictures& operator=(const Pictures&) = delete;

  // Before tick(): from now on the camera is the head of a headset's wearer [world].
  void look_from(const Pose& head);
  // Before tick(): a ring marks what this head looks at.
  void mark_gaze(const Pose& head);
  // caption: what is being done; may be empty.
  void tick(const Snapshot& seen, const std::string& caption);
  void finish();  // completes the film and the contact sheet; throws InputError

 private:
  struct Studio;
  std::unique_ptr<Studio> studio_;
};

}  // namespace catgut
