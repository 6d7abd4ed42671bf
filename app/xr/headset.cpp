// SPDX-License-Identifier: Apache-2.0
// app/xr: the OpenXR session; see headset.h. Order of calls: section 4 of the OpenXR 1.0 specification (frame loop) and section
// 9 (session states).
#include "xr/headset.h"

#include <EGL/egl.h>
#include <GL/glx.h>
#include <time.h>

#define XR_USE_GRAPHICS_API_OPENGL
#define XR_USE_PLATFORM_EGL
#define XR_USE_PLATFORM_XLIB
#define XR_USE_TIMESPEC
#include <openxr/openxr.h>
#include <openxr/openxr_platform.h>

#undef None
#undef Status
#undef Success

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <sstream>
#include <stdexcept>
#include <utility>
#include <vector>

#include "runtime/live.h"
#include "xr/actions.h"
#include "xr/resolution.h"

namespace catgut::xr {
namespace {

constexpr double kRetry = 1;            // [s] between attempts to find a lost headset again
constexpr int64_t kSrgb = 0x8C43;       // GL_SRGB8_ALPHA8
constexpr double kImagePatience = 0.5;  // [s] for an image that the runtime still reads
constexpr double kEnding = 1;           // [s] for the runtime to end the session
constexpr float kRecent = 0.05f;        // share of a new value in the averages of HeadsetCounts

std::string name_of(XrInstance instance, XrResult result) {
  char text[XR_MAX_RESULT_STRING_SIZE] = "";
  if (instance && XR_SUCCEEDED(xrResultToString(instance, result, text))) return text;
  return "OpenXR error " + std::to_string(result);
}

Frustum from_xr(const XrFovf& f) {
  return {std::tan(f.angleLeft), std::tan(f.angleRight), std::tan(f.angleDown), std::tan(f.angleUp)};
}

}  // namespace

const char* headset_state_name(HeadsetState state) {
  switch (state) {
    case HeadsetState::off:
      return "off";
    case HeadsetState::idle:
      return "idle";
    case HeadsetState::synchronized:
      return "synchronized";
    case HeadsetState::visible:
      return "visible";
    case HeadsetState::focused:
      return "focused";
  }
  return "";
}

// Search order: OpenXR loader specification, section 3 (active runtime on Linux).
bool headset_offered() {
  const auto value = [](const char* name, const std::string& otherwise) {
    const char* given = std::getenv(name);
    return given && given[0] ? std::string(given) : otherwise;
  };
  std::error_code error;
  if (const std::string file = value("XR_RUNTIME_JSON", ""); !file.empty()) return std::filesystem::exists(file, error);
  std::vector<std::string> folders{value("XDG_CONFIG_HOME", value("HOME", "") + "/.config")};
  std::istringstream more(value("XDG_CONFIG_DIRS", "/etc/xdg") + ":/etc");
  for (std::string one; std::getline(more, one, ':');) folders.push_back(one);
  for (const std::string& folder : folders)
    for (const char* name : {"active_runtime.json", "active_runtime.x86_64.json"})
      if (std::filesystem::exists(std::filesystem::path(folder) / "openxr/1" / name, error)) return true;
  return false;
}

struct Headset::Work {
  HeadsetOptions options;
  bool failed = false, left = false;  // left: the user ended the session in the runtime's menu
  double retry_at = 0;                // [s] on wall_seconds(); 0: not waiting

  XrInstance instance = XR_NULL_HANDLE;
  bool egl = false, hand_tracking = false;
  PFN_xrConvertTimeToTimespecTimeKHR to_timespec = nullptr;
  PFN_xrGetOpenGLGraphicsRequirementsKHR requirements = nullptr;
  XrSystemId system = XR_NULL_SYSTEM_ID;
  std::string system_name;
  std::unique_ptr<EyeRenderer> renderer;
  Actions actions;

  XrSession session = XR_NULL_HANDLE;
  XrSessionState state = XR_SESSION_STATE_UNKNOWN;
  bool running = false, begun = false, lost = false, quiet = false;
  XrSpace room = XR_NULL_HANDLE, head = XR_NULL_HANDLE;
  bool on_floor = false;
  struct Eye {
    XrSwapchain chain = XR_NULL_HANDLE;
    int width = 0, height = 0;
    bool acquired = false;
  };
  std::array<Eye, 2> eye;
  std::array<XrView, 2> view;
  XrFrameState frame_state{XR_TYPE_FRAME_STATE};
  bool recentered = false;
  HeadsetFrame last;
  Resolution resolution;
  HeadsetCounts counts;
  double waited_at = 0;  // [s] when the last frame started
  int64_t shown_before = 0;

  void report(const std::string& line) {
    if (options.report) options.report(line);
  }
  HeadsetState public_state() const {
    if (!session || lost) return HeadsetState::off;
    if (!running) return HeadsetState::idle;
    if (state == XR_SESSION_STATE_FOCUSED) return HeadsetState::focused;
    return state == XR_SESSION_STATE_VISIBLE ? HeadsetState::visible : HeadsetState::synchronized;
  }

  void connect();
  void make_instance();
  void make_session();
  void make_images();
  void poll_events();
  void end_session();
  void close_session();
  void close_instance();
  void handle(const XrEventDataBuffer& event);
  void change_to(XrSessionState next);
  bool check(XrResult r, const char* call);
  void lose(const std::string& why);
  uint64_t clock_ns(XrTime t) const {
    timespec at{};
    if (!to_timespec || XR_FAILED(to_timespec(instance, t, &at))) return wall_ns();
    return static_cast<uint64_t>(at.tv_sec) * 1000000000u + static_cast<uint64_t>(at.tv_nsec);
  }
  void locate(HeadsetFrame& frame);
};

// Throws std::runtime_error with the reason.
void Headset::Work::make_instance() {
  // The loader prints to standard error on its own; the reason is reported here instead.
  setenv("XR_LOADER_DEBUG", "none", 0);
  uint32_t count = 0;
  XrResult r = xrEnumerateInstanceExtensionProperties(nullptr, 0, &count, nullptr);
  if (XR_FAILED(r)) throw std::runtime_error("no OpenXR runtime is active on this machine");
  std::vector<XrExtensionProperties> offered(count, {XR_TYPE_EXTENSION_PROPERTIES});
  xrEnumerateInstanceExtensionProperties(nullptr, count, &count, offered.data());
  const auto offers = [&](const char* name) {
    for (const XrExtensionProperties& e : offered)
      if (std::strcmp(e.extensionName, name) == 0) return true;
    return false;
  };
  std::vector<const char*> wanted;
  if (!offers(XR_KHR_OPENGL_ENABLE_EXTENSION_NAME)) throw std::runtime_error("the OpenXR runtime does not accept OpenGL");
  wanted.push_back(XR_KHR_OPENGL_ENABLE_EXTENSION_NAME);
  const char* binding = std::getenv("CATGUT_XR_BINDING");  // "xlib" or "egl", for a runtime with a fault in one of them
  egl = offers(XR_MNDX_EGL_ENABLE_EXTENSION_NAME) && !(binding && std::string(binding) == "xlib");
  if (egl) wanted.push_back(XR_MNDX_EGL_ENABLE_EXTENSION_NAME);
  const bool timespec_time = offers(XR_KHR_CONVERT_TIMESPEC_TIME_EXTENSION_NAME);
  if (timespec_time) wanted.push_back(XR_KHR_CONVERT_TIMESPEC_TIME_EXTENSION_NAME);
  hand_tracking = offers(XR_EXT_HAND_TRACKING_EXTENSION_NAME);
  if (hand_tracking) wanted.push_back(XR_EXT_HAND_TRACKING_EXTENSION_NAME);
  XrInstanceCreateInfo info{XR_TYPE_INSTANCE_CREATE_INFO};
  std::strcpy(info.applicationInfo.applicationName, "Catgut");
  std::strcpy(info.applicationInfo.engineName, "Catgut");
  info.applicationInfo.apiVersion = XR_MAKE_VERSION(1, 0, 0);
  info.enabledExtensionCount = static_cast<uint32_t>(wanted.size());
  info.enabledExtensionNames = wanted.data();
  r = xrCreateInstance(&info, &instance);
  if (XR_FAILED(r)) {
    instance = XR_NULL_HANDLE;
    throw std::runtime_error(r == XR_ERROR_RUNTIME_UNAVAILABLE
                                 ? "no OpenXR runtime is active on this machine"
                                 : "the OpenXR runtime does not start (" + name_of(nullptr, r) + ")");
  }
  const auto get = [&](const char* name, auto& function) {
    xrGetInstanceProcAddr(instance, name, reinterpret_cast<PFN_xrVoidFunction*>(&function));
  };
  if (timespec_time) get("xrConvertTimeToTimespecTimeKHR", to_timespec);
  get("xrGetOpenGLGraphicsRequirementsKHR", requirements);
  if (r = actions.create(instance); XR_FAILED(r)) throw std::runtime_error("no actions (" + name_of(instance, r) + ")");
}

void Headset::Work::make_session() {
  XrSystemGetInfo get{XR_TYPE_SYSTEM_GET_INFO};
  get.formFactor = XR_FORM_FACTOR_HEAD_MOUNTED_DISPLAY;
  XrResult r = xrGetSystem(instance, &get, &system);
  quiet = r == XR_ERROR_INSTANCE_LOST || r == XR_ERROR_RUNTIME_FAILURE;
  if (r == XR_ERROR_FORM_FACTOR_UNAVAILABLE || r == XR_ERROR_FORM_FACTOR_UNSUPPORTED)
    throw std::runtime_error("the OpenXR runtime finds no headset");
  if (XR_FAILED(r)) throw std::runtime_error("no headset (" + name_of(instance, r) + ")");
  XrSystemHandTrackingPropertiesEXT hands{XR_TYPE_SYSTEM_HAND_TRACKING_PROPERTIES_EXT};
  XrSystemProperties properties{XR_TYPE_SYSTEM_PROPERTIES};
  if (hand_tracking) properties.next = &hands;
  if (XR_SUCCEEDED(xrGetSystemProperties(instance, system, &properties))) system_name = properties.systemName;
  XrGraphicsRequirementsOpenGLKHR needs{XR_TYPE_GRAPHICS_REQUIREMENTS_OPENGL_KHR};
  if (requirements) requirements(instance, system, &needs);  // required before a session

  if (!renderer) renderer = make_eye_renderer(egl ? GlBinding::egl : GlBinding::xlib, options.font);
  renderer->make_current();
  const GlHandles gl = renderer->handles();
  XrGraphicsBindingEGLMNDX by_egl{XR_TYPE_GRAPHICS_BINDING_EGL_MNDX};
  XrGraphicsBindingOpenGLXlibKHR by_xlib{XR_TYPE_GRAPHICS_BINDING_OPENGL_XLIB_KHR};
  by_egl.getProcAddress = reinterpret_cast<PFNEGLGETPROCADDRESSPROC>(gl.get_proc_address);
  by_egl.display = gl.display, by_egl.config = gl.config, by_egl.context = gl.context;
  by_xlib.xDisplay = static_cast<Display*>(gl.display);
  by_xlib.visualid = gl.visual;
  by_xlib.glxFBConfig = static_cast<GLXFBConfig>(gl.config);
  by_xlib.glxDrawable = gl.drawable;
  by_xlib.glxContext = static_cast<GLXContext>(gl.context);
  XrSessionCreateInfo create{XR_TYPE_SESSION_CREATE_INFO};
  if (egl) create.next = &by_egl;
  else create.next = &by_xlib;
  create.systemId = system;
  r = xrCreateSession(instance, &create, &session);
  if (XR_FAILED(r)) {
    session = XR_NULL_HANDLE;
    throw std::runtime_error("no session (" + name_of(instance, r) + ")");
  }
  ++counts.sessions;
  state = XR_SESSION_STATE_UNKNOWN;
  running = begun = lost = false;

  // The floor if the runtime knows it: a table then stays where it is when the headset is taken off and put on again.
  XrReferenceSpaceCreateInfo space{XR_TYPE_REFERENCE_SPACE_CREATE_INFO};
  space.poseInReferenceSpace.orientation.w = 1;
  space.referenceSpaceType = XR_REFERENCE_SPACE_TYPE_STAGE;
  on_floor = XR_SUCCEEDED(xrCreateReferenceSpace(session, &space, &room));
  if (!on_floor) {
    space.referenceSpaceType = XR_REFERENCE_SPACE_TYPE_LOCAL;
    if (r = xrCreateReferenceSpace(session, &space, &room); XR_FAILED(r))
      throw std::runtime_error("no reference space (" + name_of(instance, r) + ")");
  }
  space.referenceSpaceType = XR_REFERENCE_SPACE_TYPE_VIEW;
  xrCreateReferenceSpace(session, &space, &head);
  make_images();
  if (r = actions.attach(instance, session, hand_tracking && hands.supportsHandTracking); XR_FAILED(r))
    throw std::runtime_error("no controllers (" + name_of(instance, r) + ")");
}

void Headset::Work::make_images() {
  uint32_t count = 0;
  std::array<XrViewConfigurationView, 2> views{};
  views.fill({XR_TYPE_VIEW_CONFIGURATION_VIEW});
  xrEnumerateViewConfigurationViews(instance, system, XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO, 2, &count, views.data());
  if (count != 2) throw std::runtime_error("the headset does not have two views");
  uint32_t formats = 0;
  xrEnumerateSwapchainFormats(session, 0, &formats, nullptr);
  std::vector<int64_t> format(formats);
  xrEnumerateSwapchainFormats(session, formats, &formats, format.data());
  if (std::find(format.begin(), format.end(), kSrgb) == format.end())
    throw std::runtime_error("the headset accepts no 8-bit sRGB images");
  for (int i = 0; i < 2; ++i) {
    Eye& e = eye[size_t(i)];
    e.width = static_cast<int>(views[size_t(i)].recommendedImageRectWidth);
    e.height = static_cast<int>(views[size_t(i)].recommendedImageRectHeight);
    XrSwapchainCreateInfo info{XR_TYPE_SWAPCHAIN_CREATE_INFO};
    info.usageFlags = XR_SWAPCHAIN_USAGE_COLOR_ATTACHMENT_BIT | XR_SWAPCHAIN_USAGE_SAMPLED_BIT;
    info.format = kSrgb;
    info.sampleCount = info.faceCount = info.arraySize = info.mipCount = 1;
    info.width = static_cast<uint32_t>(e.width), info.height = static_cast<uint32_t>(e.height);
    renderer->make_current();
    if (const XrResult r = xrCreateSwapchain(session, &info, &e.chain); XR_FAILED(r))
      throw std::runtime_error("no images (" + name_of(instance, r) + ")");
    uint32_t images = 0;
    xrEnumerateSwapchainImages(e.chain, 0, &images, nullptr);
    std::vector<XrSwapchainImageOpenGLKHR> image(images, {XR_TYPE_SWAPCHAIN_IMAGE_OPENGL_KHR});
    xrEnumerateSwapchainImages(e.chain, images, &images, reinterpret_cast<XrSwapchainImageBaseHeader*>(image.data()));
    std::vector<uint32_t> names;
    for (const XrSwapchainImageOpenGLKHR& m : image) names.push_back(m.image);
    renderer->make_current();
    renderer->set_images(i, names, e.width, e.height);
  }
  view.fill({XR_TYPE_VIEW});
}

void Headset::Work::poll_events() {
  for (int i = 0; i < 64 && !lost; ++i) {
    XrEventDataBuffer event{XR_TYPE_EVENT_DATA_BUFFER};
    const XrResult r = xrPollEvent(instance, &event);
    if (r != XR_SUCCESS) {
      if (XR_FAILED(r)) check(r, "xrPollEvent");
      break;
    }
    handle(event);
  }
}

// Out of a running session in the specified order: STOPPING, xrEndSession, EXITING. Frames without a picture until then: a
// runtime may wait for them.
void Headset::Work::end_session() {
  options.report = {};
  if (!session || !running || lost || XR_FAILED(xrRequestExitSession(session))) return;
  const double until = wall_seconds() + kEnding;
  while (!lost && wall_seconds() < until) {
    poll_events();
    if (!running || lost) continue;
    renderer->make_current();
    frame_state = {XR_TYPE_FRAME_STATE};
    if (!check(xrWaitFrame(session, nullptr, &frame_state), "xrWaitFrame")) break;
    if (!check(xrBeginFrame(session, nullptr), "xrBeginFrame")) break;
    XrFrameEndInfo end{XR_TYPE_FRAME_END_INFO};
    end.displayTime = frame_state.predictedDisplayTime;
    end.environmentBlendMode = XR_ENVIRONMENT_BLEND_MODE_OPAQUE;
    if (!check(xrEndFrame(session, &end), "xrEndFrame")) break;
  }
}

void Headset::Work::close_session() {
  if (!session) return;
  if (renderer) {
    renderer->drop_images();
    renderer->make_current();
  }
  actions.detach();
  for (Eye& e : eye) {
    if (e.chain) xrDestroySwapchain(e.chain);
    e = {};
  }
  for (XrSpace* space : {&room, &head}) {
    if (*space) xrDestroySpace(*space);
    *space = XR_NULL_HANDLE;
  }
  xrDestroySession(session);
  session = XR_NULL_HANDLE;
  state = XR_SESSION_STATE_UNKNOWN;
  running = begun = lost = false;
}

void Headset::Work::close_instance() {
  close_session();
  if (instance) xrDestroyInstance(instance);
  instance = XR_NULL_HANDLE;
  to_timespec = nullptr, requirements = nullptr;
}

void Headset::Work::connect() {
  const bool first = counts.sessions == 0;
  try {
    if (!instance) make_instance();
    make_session();
    retry_at = 0;
    report((first ? "headset: " : "headset: back: ") + (system_name.empty() ? std::string("connected") : system_name) +
           (egl ? " (OpenGL by EGL)" : " (OpenGL by X11)"));
  } catch (const std::runtime_error& why) {
    // A headset that is away needs no new instance: the runtime still answers.
    if (first || quiet) close_instance();
    else close_session();
    quiet = false;
    if (first) {
      failed = true;
      report(std::string("headset: ") + why.what() + "; the session continues in the window (docs/headset.md)");
    } else {
      retry_at = wall_seconds() + kRetry;
    }
  }
}

void Headset::Work::lose(const std::string& why) {
  if (!lost) report("headset: " + why + "; the session continues in the window and returns to the headset when it is back");
  lost = true;
}

// False: the call failed. A lost session or instance is closed by the next poll().
bool Headset::Work::check(XrResult r, const char* call) {
  if (XR_SUCCEEDED(r)) return true;
  if (r == XR_ERROR_SESSION_LOST || r == XR_ERROR_SESSION_NOT_RUNNING) {
    if (r == XR_ERROR_SESSION_LOST) lose("the session was lost");
  } else if (r == XR_ERROR_INSTANCE_LOST || r == XR_ERROR_RUNTIME_FAILURE) {
    lose("the OpenXR runtime quit");
    quiet = true;  // the instance is unusable too
  } else {
    lose(std::string(call) + " failed (" + name_of(instance, r) + ")");
  }
  return false;
}

void Headset::Work::change_to(XrSessionState next) {
  const HeadsetState was = public_state();
  state = next;
  switch (next) {
    case XR_SESSION_STATE_READY: {
      XrSessionBeginInfo begin{XR_TYPE_SESSION_BEGIN_INFO};
      begin.primaryViewConfigurationType = XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO;
      renderer->make_current();
      running = check(xrBeginSession(session, &begin), "xrBeginSession");
      break;
    }
    case XR_SESSION_STATE_STOPPING:
      running = begun = false;
      check(xrEndSession(session), "xrEndSession");
      break;
    case XR_SESSION_STATE_LOSS_PENDING:
      lose("the connection to the headset was lost");
      break;
    case XR_SESSION_STATE_EXITING:
      report("headset: the session was ended; the simulation continues in the window");
      lost = left = true;
      break;
    default:
      break;
  }
  const HeadsetState now = public_state();
  if (now == was || lost) return;
  if (now == HeadsetState::focused) report("headset: in use");
  else if (was == HeadsetState::focused) report("headset: out of focus; instruments stay where they are until it is back");
}

void Headset::Work::handle(const XrEventDataBuffer& event) {
  switch (event.type) {
    case XR_TYPE_EVENT_DATA_SESSION_STATE_CHANGED: {
      const auto& change = reinterpret_cast<const XrEventDataSessionStateChanged&>(event);
      if (change.session == session) change_to(change.state);
      break;
    }
    case XR_TYPE_EVENT_DATA_INSTANCE_LOSS_PENDING:
      lose("the OpenXR runtime quit");
      quiet = true;
      break;
    case XR_TYPE_EVENT_DATA_REFERENCE_SPACE_CHANGE_PENDING: {
      const auto& change = reinterpret_cast<const XrEventDataReferenceSpaceChangePending&>(event);
      recentered = recentered ||
                   (change.referenceSpaceType == (on_floor ? XR_REFERENCE_SPACE_TYPE_STAGE : XR_REFERENCE_SPACE_TYPE_LOCAL));
      break;
    }
    case XR_TYPE_EVENT_DATA_INTERACTION_PROFILE_CHANGED:
      for (size_t side = 0; side < 2; ++side) last.profile[side] = actions.profile(instance, session, side);
      break;
    default:
      break;
  }
}

void Headset::Work::locate(HeadsetFrame& frame) {
  XrViewLocateInfo info{XR_TYPE_VIEW_LOCATE_INFO};
  info.viewConfigurationType = XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO;
  info.displayTime = frame_state.predictedDisplayTime;
  info.space = room;
  XrViewState view_state{XR_TYPE_VIEW_STATE};
  uint32_t count = 0;
  std::array<XrView, 2> now;
  now.fill({XR_TYPE_VIEW});
  constexpr XrViewStateFlags valid = XR_VIEW_STATE_POSITION_VALID_BIT | XR_VIEW_STATE_ORIENTATION_VALID_BIT;
  if (check(xrLocateViews(session, &info, &view_state, 2, &count, now.data()), "xrLocateViews") && count == 2 &&
      (view_state.viewStateFlags & valid) == valid) {
    view = now;
    frame.posed = true;
    for (size_t i = 0; i < 2; ++i) frame.eye[i] = xr::from_xr(view[i].pose), frame.frustum[i] = from_xr(view[i].fov);
    frame.head = {0.5f * (frame.eye[0].p + frame.eye[1].p), nlerp(frame.eye[0].q, frame.eye[1].q, 0.5f)};
  }
  const XrResult r = actions.read(session, room, frame_state.predictedDisplayTime, frame.hand);
  if (r != XR_SESSION_NOT_FOCUSED) check(r, "xrSyncActions");
}

Headset::Headset(const HeadsetOptions& options) : work_(std::make_unique<Work>()) {
  work_->options = options;
  work_->connect();
}

Headset::~Headset() {
  work_->end_session();
  work_->close_instance();
  work_->renderer.reset();
}

bool Headset::poll() {
  Work& w = *work_;
  if (w.failed) return false;
  if (w.lost) {
    if (w.quiet) w.close_instance();
    else w.close_session();
    w.quiet = w.lost = false;
    w.retry_at = w.left ? 0 : wall_seconds() + kRetry;
    w.failed = w.left;
    return false;
  }
  if (!w.session) {
    if (w.retry_at > 0 && wall_seconds() >= w.retry_at) w.connect();
    return false;
  }
  w.poll_events();
  return w.running && !w.lost;
}

HeadsetState Headset::state() const { return work_->public_state(); }
bool Headset::failed() const { return work_->failed; }
EyeRenderer* Headset::renderer() { return work_->renderer.get(); }

bool Headset::wait(HeadsetFrame& frame) {
  Work& w = *work_;
  if (!w.running || w.lost) return false;
  w.renderer->make_current();
  w.frame_state = {XR_TYPE_FRAME_STATE};
  if (!w.check(xrWaitFrame(w.session, nullptr, &w.frame_state), "xrWaitFrame")) return false;
  w.waited_at = wall_seconds();
  if (!w.check(xrBeginFrame(w.session, nullptr), "xrBeginFrame")) return false;
  w.begun = true;
  w.last.render = w.frame_state.shouldRender;
  w.last.posed = false;
  w.last.recentered = std::exchange(w.recentered, false);
  w.last.shown_ns = w.clock_ns(w.frame_state.predictedDisplayTime);
  w.last.period_ns = static_cast<uint64_t>(w.frame_state.predictedDisplayPeriod);
  w.last.hand = {};
  w.locate(w.last);
  frame = w.last;
  return true;
}

void Headset::submit(const HeadsetFrame& frame, EyeRenderer::Frame picture, const Place& place, float work) {
  Work& w = *work_;
  if (!w.begun || !w.running) return;
  w.begun = false;
  w.renderer->make_current();
  std::array<XrCompositionLayerProjectionView, 2> layer_view{};
  bool drawn = frame.render && frame.posed && !w.lost;
  picture.width = std::max(16, static_cast<int>(w.resolution.part * static_cast<float>(w.eye[0].width)) & ~1);
  picture.height = std::max(16, static_cast<int>(w.resolution.part * static_cast<float>(w.eye[0].height)) & ~1);
  for (size_t i = 0; i < 2 && drawn; ++i) {
    Work::Eye& e = w.eye[i];
    XrSwapchainImageWaitInfo patience{XR_TYPE_SWAPCHAIN_IMAGE_WAIT_INFO};
    patience.timeout = static_cast<XrDuration>(kImagePatience * 1e9);
    drawn = e.acquired = w.check(xrAcquireSwapchainImage(e.chain, nullptr, &picture.image[i]), "xrAcquireSwapchainImage");
    if (drawn) {
      const XrResult r = xrWaitSwapchainImage(e.chain, &patience);
      drawn = r == XR_SUCCESS;
      if (XR_FAILED(r)) w.check(r, "xrWaitSwapchainImage");
    }
    picture.camera[i] = eye_camera(place.to_world(frame.eye[i]), frame.frustum[i], work);
  }
  drawn = drawn && w.renderer->draw(picture);
  w.renderer->make_current();
  for (size_t i = 0; i < 2; ++i) {
    Work::Eye& e = w.eye[i];
    if (std::exchange(e.acquired, false) && !w.lost)
      w.check(xrReleaseSwapchainImage(e.chain, nullptr), "xrReleaseSwapchainImage");
    XrCompositionLayerProjectionView& v = layer_view[i];
    v = {XR_TYPE_COMPOSITION_LAYER_PROJECTION_VIEW};
    v.pose = w.view[i].pose, v.fov = w.view[i].fov;
    v.subImage.swapchain = e.chain;
    v.subImage.imageRect = {{0, 0}, {picture.width, picture.height}};
  }
  if (w.lost) return;
  XrCompositionLayerProjection layer{XR_TYPE_COMPOSITION_LAYER_PROJECTION};
  layer.space = w.room;
  layer.viewCount = 2;
  layer.views = layer_view.data();
  const XrCompositionLayerBaseHeader* layers[] = {reinterpret_cast<const XrCompositionLayerBaseHeader*>(&layer)};
  XrFrameEndInfo end{XR_TYPE_FRAME_END_INFO};
  end.displayTime = w.frame_state.predictedDisplayTime;
  end.environmentBlendMode = XR_ENVIRONMENT_BLEND_MODE_OPAQUE;
  end.layerCount = drawn ? 1 : 0;
  end.layers = layers;
  if (!w.check(xrEndFrame(w.session, &end), "xrEndFrame")) return;

  HeadsetCounts& c = w.counts;
  ++c.frames;
  const double now = wall_seconds(), spent = now - w.waited_at;
  const auto period = static_cast<double>(frame.period_ns) * 1e-9, shown = static_cast<double>(frame.shown_ns) * 1e-9;
  const int64_t step = w.frame_state.predictedDisplayTime - std::exchange(w.shown_before, w.frame_state.predictedDisplayTime);
  if (drawn && c.frames > 1) c.late += is_late(now, shown, 1e-9 * static_cast<double>(step), period);
  if (drawn && !w.options.whole_resolution) w.resolution.note(static_cast<float>(spent), static_cast<float>(period));
  c.resolution = w.resolution.part;
  const auto recent = [](float& value, double fresh) {
    value += (value == 0 ? 1 : kRecent) * (static_cast<float>(fresh) - value);
  };
  recent(c.work_ms, 1e3 * spent);
  recent(c.lead_ms, 1e3 * (shown - w.waited_at));
}

void Headset::vibrate(size_t side, const Vibration& v) {
  Work& w = *work_;
  if (v.amplitude <= 0 || w.state != XR_SESSION_STATE_FOCUSED || !w.running || w.lost) return;
  w.check(w.actions.vibrate(w.session, side, v), "xrApplyHapticFeedback");
}

void Headset::leave() {
  Work& w = *work_;
  if (w.session && w.running && !w.lost) xrRequestExitSession(w.session);
}

const HeadsetCounts& Headset::counts() const { return work_->counts; }

}  // namespace catgut::xr
