// SPDX-License-Identifier: Apache-2.0
// tests/xr: see layer.h. The loader calls xrNegotiateLoaderApiLayerInterface, then gets every function through the layer's own
// xrGetInstanceProcAddr (OpenXR loader specification, section 4).
#include "layer.h"

#include <openxr/openxr.h>
#include <string.h>

#include <algorithm>
#include <string>

namespace {

catgut::XrLayerState state;
PFN_xrGetInstanceProcAddr next_get = nullptr;
XrInstance instance_now = XR_NULL_HANDLE;
XrSession session_now = XR_NULL_HANDLE;
bool session_dead = false, instance_dead = false, focus_gone = false;

template <typename Function>
Function next(const char* name) {
  PFN_xrVoidFunction function = nullptr;
  next_get(instance_now, name, &function);
  return reinterpret_cast<Function>(function);
}

XrResult dead() {
  if (instance_dead) return XR_ERROR_INSTANCE_LOST;
  if (state.lose == 2) session_dead = true, state.lose = 0;
  if (state.lose == 3) {
    instance_dead = true, state.lose = 0;
    return XR_ERROR_INSTANCE_LOST;
  }
  return session_dead ? XR_ERROR_SESSION_LOST : XR_SUCCESS;
}

void note(XrSessionState now) {
  state.state = now;
  state.states_seen |= 1u << now;
}

void state_event(XrEventDataBuffer* event, XrSessionState now) {
  XrEventDataSessionStateChanged change{};
  change.type = XR_TYPE_EVENT_DATA_SESSION_STATE_CHANGED;
  change.session = session_now;
  change.state = now;
  memcpy(event, &change, sizeof change);
  note(now);
}

XrResult XRAPI_CALL poll_event(XrInstance instance, XrEventDataBuffer* event) {
  if (instance_dead) return XR_ERROR_INSTANCE_LOST;
  if (state.lose == 1 && session_now) {
    state.lose = 0;
    session_dead = true;
    state_event(event, XR_SESSION_STATE_LOSS_PENDING);
    return XR_SUCCESS;
  }
  if (session_now && state.unfocused != focus_gone && state.state >= XR_SESSION_STATE_SYNCHRONIZED) {
    focus_gone = state.unfocused;
    state_event(event, focus_gone ? XR_SESSION_STATE_VISIBLE : XR_SESSION_STATE_FOCUSED);
    return XR_SUCCESS;
  }
  const XrResult r = next<PFN_xrPollEvent>("xrPollEvent")(instance, event);
  if (r == XR_SUCCESS && event->type == XR_TYPE_EVENT_DATA_SESSION_STATE_CHANGED)
    note(reinterpret_cast<const XrEventDataSessionStateChanged*>(event)->state);
  return r;
}

XrResult XRAPI_CALL get_system(XrInstance instance, const XrSystemGetInfo* info, XrSystemId* system) {
  if (instance_dead) return XR_ERROR_INSTANCE_LOST;
  if (state.absent) return XR_ERROR_FORM_FACTOR_UNAVAILABLE;
  return next<PFN_xrGetSystem>("xrGetSystem")(instance, info, system);
}

XrResult XRAPI_CALL create_session(XrInstance instance, const XrSessionCreateInfo* info, XrSession* session) {
  const XrResult r = next<PFN_xrCreateSession>("xrCreateSession")(instance, info, session);
  if (XR_SUCCEEDED(r)) session_now = *session, session_dead = focus_gone = false, ++state.sessions;
  return r;
}

XrResult XRAPI_CALL destroy_session(XrSession session) {
  session_now = XR_NULL_HANDLE;
  session_dead = false;
  ++state.destroyed;
  return next<PFN_xrDestroySession>("xrDestroySession")(session);
}

XrResult XRAPI_CALL destroy_instance(XrInstance instance) {
  const XrResult r = next<PFN_xrDestroyInstance>("xrDestroyInstance")(instance);
  instance_now = XR_NULL_HANDLE;
  instance_dead = session_dead = false;
  return r;
}

XrResult XRAPI_CALL wait_frame(XrSession session, const XrFrameWaitInfo* info, XrFrameState* frame) {
  if (const XrResult r = dead(); r != XR_SUCCESS) return r;
  const XrResult r = next<PFN_xrWaitFrame>("xrWaitFrame")(session, info, frame);
  if (state.dark) frame->shouldRender = XR_FALSE;
  return r;
}

XrResult XRAPI_CALL end_frame(XrSession session, const XrFrameEndInfo* info) {
  if (const XrResult r = dead(); r != XR_SUCCESS) return r;
  const XrResult r = next<PFN_xrEndFrame>("xrEndFrame")(session, info);
  if (XR_FAILED(r)) return r;
  ++state.frames;
  for (uint32_t i = 0; i < info->layerCount; ++i) {
    if (info->layers[i]->type != XR_TYPE_COMPOSITION_LAYER_PROJECTION) continue;
    const auto* layer = reinterpret_cast<const XrCompositionLayerProjection*>(info->layers[i]);
    for (uint32_t k = 0; k < 2 && k < layer->viewCount; ++k) {
      const XrCompositionLayerProjectionView& v = layer->views[k];
      catgut::XrLayerState::Eye& e = state.eye[k];
      memcpy(e.position, &v.pose.position, sizeof e.position);
      memcpy(e.orientation, &v.pose.orientation, sizeof e.orientation);
      const float fov[] = {v.fov.angleLeft, v.fov.angleRight, v.fov.angleUp, v.fov.angleDown};
      memcpy(e.fov, fov, sizeof fov);
      const XrRect2Di& rect = v.subImage.imageRect;
      const int32_t box[] = {rect.offset.x, rect.offset.y, rect.extent.width, rect.extent.height};
      memcpy(e.rect, box, sizeof box);
    }
    ++state.projections;
  }
  return r;
}

XrResult XRAPI_CALL sync_actions(XrSession session, const XrActionsSyncInfo* info) {
  if (const XrResult r = dead(); r != XR_SUCCESS) return r;
  const XrResult r = next<PFN_xrSyncActions>("xrSyncActions")(session, info);
  return r == XR_SUCCESS && focus_gone ? XR_SESSION_NOT_FOCUSED : r;
}

XrResult XRAPI_CALL apply_haptics(XrSession session, const XrHapticActionInfo* info, const XrHapticBaseHeader* feedback) {
  if (const XrResult r = dead(); r != XR_SUCCESS) return r;
  const XrResult r = next<PFN_xrApplyHapticFeedback>("xrApplyHapticFeedback")(session, info, feedback);
  if (feedback->type == XR_TYPE_HAPTIC_VIBRATION) {
    const auto* v = reinterpret_cast<const XrHapticVibration*>(feedback);
    char path[XR_MAX_PATH_LENGTH] = "";
    uint32_t size = 0;
    next<PFN_xrPathToString>("xrPathToString")(instance_now, info->subactionPath, sizeof path, &size, path);
    const uint32_t i = state.pulses;
    if (i < catgut::XrLayerState::kPulses)
      state.pulse[i] = {std::string(path) == "/user/hand/right" ? 1u : 0u, v->amplitude, v->frequency, v->duration, r};
    ++state.pulses;
  }
  return r;
}

XrResult XRAPI_CALL get_proc(XrInstance instance, const char* name, PFN_xrVoidFunction* function) {
  struct Row {
    const char* name;
    PFN_xrVoidFunction function;
  };
#define ROW(name, function) \
  { name, reinterpret_cast<PFN_xrVoidFunction>(function) }
  static const Row rows[] = {ROW("xrGetInstanceProcAddr", get_proc),   ROW("xrPollEvent", poll_event),
                             ROW("xrGetSystem", get_system),           ROW("xrCreateSession", create_session),
                             ROW("xrDestroySession", destroy_session), ROW("xrDestroyInstance", destroy_instance),
                             ROW("xrWaitFrame", wait_frame),           ROW("xrEndFrame", end_frame),
                             ROW("xrSyncActions", sync_actions),       ROW("xrApplyHapticFeedback", apply_haptics)};
#undef ROW
  for (const Row& row : rows)
    if (strcmp(row.name, name) == 0) {
      *function = row.function;
      return XR_SUCCESS;
    }
  return next_get(instance, name, function);
}

// The part of the loader's interface that a layer needs; its header is not installed with the loader.
struct NextInfo {
  uint32_t type, version;
  size_t size;
  char name[XR_MAX_API_LAYER_NAME_SIZE];
  PFN_xrGetInstanceProcAddr get;
  XrResult(XRAPI_PTR* create)(const XrInstanceCreateInfo*, const struct CreateInfo*, XrInstance*);
  NextInfo* next;
};
struct CreateInfo {
  uint32_t type, version;
  size_t size;
  void* loader;
  char settings[512];
  NextInfo* next;
};
struct LoaderInfo {
  uint32_t type, version;
  size_t size;
  uint32_t min_interface, max_interface;
  XrVersion min_api, max_api;
};
struct LayerRequest {
  uint32_t type, version;
  size_t size;
  uint32_t interface_version;
  XrVersion api_version;
  PFN_xrGetInstanceProcAddr get;
  XrResult(XRAPI_PTR* create)(const XrInstanceCreateInfo*, const CreateInfo*, XrInstance*);
};

XrResult XRAPI_CALL create_instance(const XrInstanceCreateInfo* info, const CreateInfo* layer, XrInstance* instance) {
  CreateInfo rest = *layer;
  rest.next = layer->next->next;
  next_get = layer->next->get;
  const XrResult r = layer->next->create(info, &rest, instance);
  if (XR_SUCCEEDED(r)) instance_now = *instance;
  return r;
}

}  // namespace

extern "C" {

__attribute__((visibility("default"))) catgut::XrLayerState* catgut_test_layer() { return &state; }

__attribute__((visibility("default"))) XrResult XRAPI_CALL xrNegotiateLoaderApiLayerInterface(const LoaderInfo* loader,
                                                                                              const char*,
                                                                                              LayerRequest* request) {
  if (!loader || !request) return XR_ERROR_INITIALIZATION_FAILED;
  request->interface_version = 1;
  request->api_version = XR_CURRENT_API_VERSION;
  request->get = get_proc;
  request->create = create_instance;
  return XR_SUCCESS;
}
}
