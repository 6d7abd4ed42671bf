// SPDX-License-Identifier: Apache-2.0
// app/xr: see actions.h.
#include "xr/actions.h"

#include <cstring>
#include <vector>

namespace catgut::xr {
namespace {

Vec3 vector_of(const XrVector3f& v) { return {v.x, v.y, v.z}; }

XrPath path_of(XrInstance instance, const char* text) {
  XrPath path = XR_NULL_PATH;
  xrStringToPath(instance, text, &path);
  return path;
}

bool located(XrSpace space, XrSpace base, XrTime time, Pose& out) {
  XrSpaceLocation at{XR_TYPE_SPACE_LOCATION};
  if (XR_FAILED(xrLocateSpace(space, base, time, &at))) return false;
  constexpr XrSpaceLocationFlags valid = XR_SPACE_LOCATION_POSITION_VALID_BIT | XR_SPACE_LOCATION_ORIENTATION_VALID_BIT;
  // Without "tracked" the pose is a guess (dead reckoning, or an arm model): an instrument must not follow that.
  constexpr XrSpaceLocationFlags tracked = XR_SPACE_LOCATION_POSITION_TRACKED_BIT;
  if ((at.locationFlags & valid) != valid || !(at.locationFlags & tracked)) return false;
  out = from_xr(at.pose);
  return is_finite(out.p);
}

bool pinch_of(const XrHandJointLocationEXT* joint, HandState& hand) {
  constexpr XrSpaceLocationFlags wanted = XR_SPACE_LOCATION_POSITION_VALID_BIT | XR_SPACE_LOCATION_POSITION_TRACKED_BIT;
  constexpr XrHandJointEXT kJoints[] = {XR_HAND_JOINT_THUMB_TIP_EXT, XR_HAND_JOINT_INDEX_TIP_EXT,
                                        XR_HAND_JOINT_THUMB_PROXIMAL_EXT, XR_HAND_JOINT_INDEX_PROXIMAL_EXT};
  std::array<Vec3, 4> p;
  for (size_t i = 0; i < 4; ++i) {
    if ((joint[kJoints[i]].locationFlags & wanted) != wanted) return false;
    p[i] = vector_of(joint[kJoints[i]].pose.position);
  }
  pinch({p[0], p[1], p[2], p[3]}, hand);
  return true;
}

}  // namespace

Pose from_xr(const XrPosef& pose) {
  const XrQuaternionf& q = pose.orientation;
  return {vector_of(pose.position), normalized(Quat{q.x, q.y, q.z, q.w})};
}

XrResult Actions::create(XrInstance instance) {
  *this = {};
  side_ = {path_of(instance, "/user/hand/left"), path_of(instance, "/user/hand/right")};
  XrActionSetCreateInfo set{XR_TYPE_ACTION_SET_CREATE_INFO};
  std::strcpy(set.actionSetName, "surgery");
  std::strcpy(set.localizedActionSetName, "Surgery");
  if (const XrResult r = xrCreateActionSet(instance, &set, &set_); XR_FAILED(r)) return r;
  struct Row {
    const char *name, *title;
    XrActionType type;
    XrAction* action;
  };
  const Row rows[] = {{"grip", "Instrument", XR_ACTION_TYPE_POSE_INPUT, &grip_},
                      {"aim", "Pointer", XR_ACTION_TYPE_POSE_INPUT, &aim_},
                      {"jaw", "Close the jaws", XR_ACTION_TYPE_FLOAT_INPUT, &jaw_},
                      {"stick", "Table height and loupe", XR_ACTION_TYPE_VECTOR2F_INPUT, &stick_},
                      {"clutch", "Clutch", XR_ACTION_TYPE_BOOLEAN_INPUT, &clutch_},
                      {"cut", "Cut", XR_ACTION_TYPE_BOOLEAN_INPUT, &cut_},
                      {"new_suture", "New suture", XR_ACTION_TYPE_BOOLEAN_INPUT, &new_suture_},
                      {"swap", "Next instrument", XR_ACTION_TYPE_BOOLEAN_INPUT, &swap_},
                      {"menu", "Pause; hold to recenter", XR_ACTION_TYPE_BOOLEAN_INPUT, &menu_},
                      {"vibration", "Vibration", XR_ACTION_TYPE_VIBRATION_OUTPUT, &vibration_}};
  for (const Row& row : rows) {
    XrActionCreateInfo info{XR_TYPE_ACTION_CREATE_INFO};
    std::strcpy(info.actionName, row.name);
    std::strcpy(info.localizedActionName, row.title);
    info.actionType = row.type;
    info.countSubactionPaths = 2;
    info.subactionPaths = side_.data();
    if (const XrResult r = xrCreateAction(set_, &info, row.action); XR_FAILED(r)) return r;
  }
  for (const Profile& profile : profiles()) {
    std::vector<XrActionSuggestedBinding> bindings;
    for (const Binding& b : profile.binding)
      for (const Row& row : rows)
        if (std::strcmp(row.name, b.action) == 0) bindings.push_back({*row.action, path_of(instance, b.path)});
    XrInteractionProfileSuggestedBinding suggested{XR_TYPE_INTERACTION_PROFILE_SUGGESTED_BINDING};
    suggested.interactionProfile = path_of(instance, profile.path);
    suggested.suggestedBindings = bindings.data();
    suggested.countSuggestedBindings = static_cast<uint32_t>(bindings.size());
    // A runtime may not know a profile; the others remain.
    if (const XrResult r = xrSuggestInteractionProfileBindings(instance, &suggested);
        XR_FAILED(r) && r != XR_ERROR_PATH_UNSUPPORTED)
      return r;
  }
  return XR_SUCCESS;
}

XrResult Actions::attach(XrInstance instance, XrSession session, bool hand_tracking) {
  XrSessionActionSetsAttachInfo info{XR_TYPE_SESSION_ACTION_SETS_ATTACH_INFO};
  info.countActionSets = 1;
  info.actionSets = &set_;
  if (const XrResult r = xrAttachSessionActionSets(session, &info); XR_FAILED(r)) return r;
  for (size_t side = 0; side < 2; ++side) {
    for (const bool aim : {false, true}) {
      XrActionSpaceCreateInfo space{XR_TYPE_ACTION_SPACE_CREATE_INFO};
      space.action = aim ? aim_ : grip_;
      space.subactionPath = side_[side];
      space.poseInActionSpace.orientation.w = 1;
      if (const XrResult r = xrCreateActionSpace(session, &space, aim ? &aim_space_[side] : &grip_space_[side]); XR_FAILED(r))
        return r;
    }
  }
  if (!hand_tracking) return XR_SUCCESS;
  const auto get = [&](const char* name, auto& function) {
    xrGetInstanceProcAddr(instance, name, reinterpret_cast<PFN_xrVoidFunction*>(&function));
  };
  get("xrCreateHandTrackerEXT", create_tracker_);
  get("xrDestroyHandTrackerEXT", destroy_tracker_);
  get("xrLocateHandJointsEXT", locate_joints_);
  for (size_t side = 0; create_tracker_ && side < 2; ++side) {
    XrHandTrackerCreateInfoEXT tracker{XR_TYPE_HAND_TRACKER_CREATE_INFO_EXT};
    tracker.hand = side == 0 ? XR_HAND_LEFT_EXT : XR_HAND_RIGHT_EXT;
    tracker.handJointSet = XR_HAND_JOINT_SET_DEFAULT_EXT;
    if (XR_FAILED(create_tracker_(session, &tracker, &tracker_[side]))) tracker_[side] = XR_NULL_HANDLE;
  }
  return XR_SUCCESS;
}

void Actions::detach() {
  for (size_t side = 0; side < 2; ++side) {
    if (tracker_[side] && destroy_tracker_) destroy_tracker_(tracker_[side]);
    for (XrSpace* space : {&grip_space_[side], &aim_space_[side]}) {
      if (*space) xrDestroySpace(*space);
      *space = XR_NULL_HANDLE;
    }
    tracker_[side] = XR_NULL_HANDLE;
  }
}

XrResult Actions::read(XrSession session, XrSpace room, XrTime time, std::array<HandState, 2>& hand) {
  hand = {};
  const XrActiveActionSet active{set_, XR_NULL_PATH};
  XrActionsSyncInfo sync{XR_TYPE_ACTIONS_SYNC_INFO};
  sync.countActiveActionSets = 1;
  sync.activeActionSets = &active;
  if (const XrResult r = xrSyncActions(session, &sync); r != XR_SUCCESS) return r;
  for (size_t side = 0; side < 2; ++side) {
    HandState& h = hand[side];
    XrActionStateGetInfo get{XR_TYPE_ACTION_STATE_GET_INFO};
    get.subactionPath = side_[side];
    const auto pressed = [&](XrAction action) {
      XrActionStateBoolean s{XR_TYPE_ACTION_STATE_BOOLEAN};
      get.action = action;
      return XR_SUCCEEDED(xrGetActionStateBoolean(session, &get, &s)) && s.isActive && s.currentState;
    };
    XrActionStatePose pose{XR_TYPE_ACTION_STATE_POSE};
    get.action = grip_;
    const bool there = XR_SUCCEEDED(xrGetActionStatePose(session, &get, &pose)) && pose.isActive;
    h.tracked = there && located(grip_space_[side], room, time, h.grip);
    if (h.tracked && !located(aim_space_[side], room, time, h.aim)) h.aim = h.grip;
    XrActionStateFloat jaw{XR_TYPE_ACTION_STATE_FLOAT};
    get.action = jaw_;
    if (XR_SUCCEEDED(xrGetActionStateFloat(session, &get, &jaw)) && jaw.isActive) h.trigger = jaw.currentState;
    XrActionStateVector2f stick{XR_TYPE_ACTION_STATE_VECTOR2F};
    get.action = stick_;
    if (XR_SUCCEEDED(xrGetActionStateVector2f(session, &get, &stick)) && stick.isActive)
      h.stick_x = stick.currentState.x, h.stick_y = stick.currentState.y;
    h.clutch = pressed(clutch_), h.cut = pressed(cut_), h.new_suture = pressed(new_suture_);
    h.swap = pressed(swap_), h.menu = pressed(menu_);
    if (h.tracked || !tracker_[side] || !locate_joints_) continue;
    XrHandJointsLocateInfoEXT where{XR_TYPE_HAND_JOINTS_LOCATE_INFO_EXT};
    where.baseSpace = room;
    where.time = time;
    std::array<XrHandJointLocationEXT, XR_HAND_JOINT_COUNT_EXT> joint{};
    XrHandJointLocationsEXT joints{XR_TYPE_HAND_JOINT_LOCATIONS_EXT};
    joints.jointCount = XR_HAND_JOINT_COUNT_EXT;
    joints.jointLocations = joint.data();
    if (XR_SUCCEEDED(locate_joints_(tracker_[side], &where, &joints)) && joints.isActive) pinch_of(joint.data(), h);
  }
  return XR_SUCCESS;
}

XrResult Actions::vibrate(XrSession session, size_t side, const Vibration& v) {
  XrHapticActionInfo info{XR_TYPE_HAPTIC_ACTION_INFO};
  info.action = vibration_;
  info.subactionPath = side_[side];
  XrHapticVibration pulse{XR_TYPE_HAPTIC_VIBRATION};
  pulse.amplitude = std::clamp(v.amplitude, 0.0f, 1.0f);
  pulse.duration = v.seconds > 0 ? static_cast<XrDuration>(1e9 * static_cast<double>(v.seconds)) : XR_MIN_HAPTIC_DURATION;
  pulse.frequency = v.frequency_hz > 0 ? v.frequency_hz : static_cast<float>(XR_FREQUENCY_UNSPECIFIED);
  return xrApplyHapticFeedback(session, &info, reinterpret_cast<const XrHapticBaseHeader*>(&pulse));
}

std::string Actions::profile(XrInstance instance, XrSession session, size_t side) const {
  XrInteractionProfileState state{XR_TYPE_INTERACTION_PROFILE_STATE};
  if (XR_FAILED(xrGetCurrentInteractionProfile(session, side_[side], &state)) || state.interactionProfile == XR_NULL_PATH)
    return "";
  char text[XR_MAX_PATH_LENGTH] = "";
  uint32_t size = 0;
  xrPathToString(instance, state.interactionProfile, sizeof text, &size, text);
  for (const Profile& p : profiles())
    if (std::strcmp(p.path, text) == 0) return p.title;
  return text;
}

}  // namespace catgut::xr
