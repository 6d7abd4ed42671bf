// SPDX-License-Identifier: Apache-2.0
// render/camera: where pictures are taken from. Reads the model and snapshots; writes nothing.
#pragma once
#include "core/math.h"
#include "exchange/picture.h"
#include "exchange/snapshot.h"

namespace catgut {

struct Camera {
  Vec3 eye, target, up{0, 1, 0};  // [m]
  float fov_deg = 30;             // vertical
};

// The whole operating field from the surgeon's side.
Camera overview(const PictureModel& model);

// Looks at the work from outside the organ and slowly goes round with it. Everything it does is smoothed and its turning speed
// is bounded, so that a needle that is regrasped or a run that skips ahead never makes the picture jump.
struct FollowCamera {
  explicit FollowCamera(const PictureModel& model);

  // The camera dt [s] after the previous call; the first call starts at the work without easing in.
  Camera update(const Snapshot& snapshot, float dt);

  float elevation = 0.80f;     // [rad] above the horizon; a little more or less where the tools' shafts hide less then
  float beside = 0.7f;         // [rad] round from the needle's side of the organ, toward where the shafts hide less
  float turn_speed = 0.35f;    // [rad/s] at most
  float settle_time = 1.2f;    // [s] in which most of a change of target is made up
  float half_height = 0.034f;  // [m] of the picture, at the target, with the needle at the tissue; more when it is drawn away
  float fov_deg = 30;

 private:
  Vec3 focus_;
  float field_;
  Vec3 target_;
  float azimuth_ = 0.6f, speed_ = 0;  // [rad], [rad/s]
  size_t choice_ = 0;                 // of the places to look from
  float lift_ = 0;                    // [rad] above `elevation` now
  float half_ = 0;                    // [m] half the picture's height now
  bool front_ = false;                // it stays on the surgeon's side: two bowel ends lie across the field
  bool started_ = false;
};

}  // namespace catgut
