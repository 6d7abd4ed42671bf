// SPDX-License-Identifier: Apache-2.0
// app/xr: the wearer's controllers as OpenXR actions, bound for five kinds of controllers, and tracked hands. Only app/xr
// includes this.
#pragma once
#include <openxr/openxr.h>

#include <array>
#include <span>
#include <string>

#include "xr/space_hands.h"
#include "xr/vibration.h"

namespace catgut::xr {

struct Binding {
  const char* action;
  const char* path;  // below the profile: "/user/hand/left/input/grip/pose"
};
struct Profile {
  const char* path;  // "/interaction_profiles/..."
  const char* title;
  std::span<const Binding> binding;
};
// Khronos simple, Oculus Touch, Valve Index, HTC Vive, Microsoft motion controller, in this order.
std::span<const Profile> profiles();

class Actions {
 public:
  // Creates actions and suggests bindings. XR_SUCCESS, or the first error.
  XrResult create(XrInstance instance);
  // For a new session; after that the session's hands can be read. hand_tracking: the system offers it.
  XrResult attach(XrInstance instance, XrSession session, bool hand_tracking);
  void detach();  // before the session is destroyed

  // The hands at `time`, relative to `room`. XR_SESSION_NOT_FOCUSED: nothing is read and the hands are not tracked.
  XrResult read(XrSession session, XrSpace room, XrTime time, std::array<HandState, 2>& hand);
  XrResult vibrate(XrSession session, size_t side, const Vibration& v);
  std::string profile(XrInstance instance, XrSession session, size_t side) const;

 private:
  XrActionSet set_ = XR_NULL_HANDLE;
  XrAction grip_ = XR_NULL_HANDLE, aim_ = XR_NULL_HANDLE, jaw_ = XR_NULL_HANDLE, stick_ = XR_NULL_HANDLE,
           clutch_ = XR_NULL_HANDLE, cut_ = XR_NULL_HANDLE, new_suture_ = XR_NULL_HANDLE, swap_ = XR_NULL_HANDLE,
           menu_ = XR_NULL_HANDLE, vibration_ = XR_NULL_HANDLE;
  std::array<XrPath, 2> side_{};
  std::array<XrSpace, 2> grip_space_{}, aim_space_{};
  std::array<XrHandTrackerEXT, 2> tracker_{};
  PFN_xrCreateHandTrackerEXT create_tracker_ = nullptr;
  PFN_xrDestroyHandTrackerEXT destroy_tracker_ = nullptr;
  PFN_xrLocateHandJointsEXT locate_joints_ = nullptr;
};

Pose from_xr(const XrPosef& pose);

}  // namespace catgut::xr
