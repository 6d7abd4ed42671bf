// SPDX-License-Identifier: Apache-2.0
// render/camera: the camera of images and films. Reads the model and snapshots; writes nothing.
#pragma once
#include <optional>
#include <string>

#include "core/math.h"
#include "exchange/picture.h"
#include "exchange/snapshot.h"

namespace catgut {

// Field of view of a headset's eye: tangents of its four half angles, left and down negative. right == left: none.
struct Frustum {
  float left = 0, right = 0, down = 0, up = 0;
};

struct Camera {
  Vec3 eye, target, up{0, 1, 0};  // [m]
  float fov_deg = 30;             // vertical
  Frustum frustum{};              // replaces fov_deg
};

// Position in an image of that size [pixels], from its upper left corner. False: behind the camera. Without a frustum.
bool project(const Camera& camera, Vec3 point, float width, float height, float& x, float& y);

// The camera at a headset's eye, which looks along -z. work: [m] distance of what it looks at, for near plane and shadows.
Camera eye_camera(const Pose& eye, const Frustum& frustum, float work);

// The point that a headset's wearer looks at, by the direction of the head: no eye is tracked. The first tissue within three
// degrees of it, else the point at the distance of the field's center.
Vec3 gaze_point(const Pose& head, const PictureModel& picture, const Snapshot& seen);

// From the same eye, only `half_height` [m] round a point: what a magnifier shows.
Camera magnified(const Camera& camera, Vec3 point, float half_height);

// The whole operating field from the surgeon's side.
Camera overview(const PictureModel& model);

// A close view of the decisive thing of a moment (the needle in the wall, the turns of a throw, a knot, the finished repair)
// from the side where tools and tissue hide least of it. Without memory: the same snapshot gives the same view.
Camera close_up(const PictureModel& model, const Snapshot& snapshot);

// A view that does not move: "overview", "front", "left", "right", "top", or six numbers "X,Y,Z,X,Y,Z" [m], the eye and the
// point it looks at. None for other names.
std::optional<Camera> fixed_camera(const std::string& name, const PictureModel& model);

// Looks at the work from outside the organ and slowly orbits with it. All motion is smoothed and its turning speed
// is bounded, so that a regrasped needle or a skip in time never causes a jump.
struct FollowCamera {
  explicit FollowCamera(const PictureModel& model);

  // The camera dt [s] after the previous call; the first call starts at the target without easing in.
  Camera update(const Snapshot& snapshot, float dt);

  float elevation = 0.80f;     // [rad] above the horizon; varies slightly to reduce occlusion by the tools' shafts
  float beside = 0.7f;         // [rad] round from the needle's side of the organ, toward less occlusion by the shafts
  float turn_speed = 0.35f;    // [rad/s] maximum
  float settle_time = 1.2f;    // [s] time constant of a change of target
  float half_height = 0.034f;  // [m] of the image, at the target, with the needle at the tissue; more when it is pulled away
  float fov_deg = 30;

 private:
  Vec3 focus_;
  float field_;
  Vec3 target_;
  float azimuth_ = 0.6f, speed_ = 0;  // [rad], [rad/s]
  size_t choice_ = 0;                 // of the viewpoints
  float lift_ = 0;                    // [rad] above `elevation`, current
  float half_ = 0;                    // [m] half the image's height, current
  bool front_ = false;                // stays on the surgeon's side: two bowel ends lie across the field
  float needle_radius_, needle_arc_;  // [m], [rad] of the first suture
  bool started_ = false;
};

}  // namespace catgut
