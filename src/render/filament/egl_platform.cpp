// SPDX-License-Identifier: Apache-2.0
// render/filament/egl_platform: see egl_platform.h.
//
// The only file that uses a private interface. Filament 1.9.25's own platform on Linux needs an X server. Its base class
// for others, backend::OpenGLPlatform, is exported by the library but its header is not installed, so it is declared again
// here. The order of the virtual functions is that of the library's own vtable and must not change; room.cmake accepts no other
// version. Newer Filament has a public header and a headless EGL platform of its own.
#include "render/filament/egl_platform.h"

#include <X11/Xlib.h>
#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <algorithm>
#include <cstdint>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

// Xlib's macro names collide with ours and with Filament's.
#undef None
#undef Status
#undef Success

namespace filament::backend {

struct AcquiredImage;

class OpenGLPlatform : public DefaultPlatform {
 public:
  ~OpenGLPlatform() noexcept override;
  static Driver* createDefaultDriver(OpenGLPlatform* platform, void* sharedContext);
  virtual void terminate() noexcept = 0;
  virtual SwapChain* createSwapChain(void* nativeWindow, uint64_t& flags) noexcept = 0;
  virtual SwapChain* createSwapChain(uint32_t width, uint32_t height, uint64_t& flags) noexcept = 0;
  virtual void destroySwapChain(SwapChain* swapChain) noexcept = 0;
  virtual void createDefaultRenderTarget(uint32_t& framebuffer, uint32_t& colorbuffer, uint32_t& depthbuffer) noexcept;
  virtual void makeCurrent(SwapChain* drawSwapChain, SwapChain* readSwapChain) noexcept = 0;
  virtual void commit(SwapChain* swapChain) noexcept = 0;
  virtual void setPresentationTime(int64_t nanoseconds) noexcept = 0;
  virtual bool canCreateFence() noexcept;
  virtual Fence* createFence() noexcept = 0;
  virtual void destroyFence(Fence* fence) noexcept = 0;
  virtual FenceStatus waitFence(Fence* fence, uint64_t timeout) noexcept = 0;
  virtual Stream* createStream(void* nativeStream) noexcept = 0;
  virtual void destroyStream(Stream* stream) noexcept = 0;
  virtual void attach(Stream* stream, intptr_t tname) noexcept = 0;
  virtual void detach(Stream* stream) noexcept = 0;
  virtual void updateTexImage(Stream* stream, int64_t* timestamp) noexcept = 0;
  virtual ExternalTexture* createExternalTextureStorage() noexcept = 0;
  virtual void reallocateExternalStorage(ExternalTexture* ets, uint32_t w, uint32_t h, TextureFormat format) noexcept = 0;
  virtual void destroyExternalTextureStorage(ExternalTexture* ets) noexcept = 0;
  virtual AcquiredImage transformAcquiredImage(AcquiredImage source) noexcept;
  virtual bool setExternalImage(void* externalImage, void* texture) noexcept;
  virtual void retainExternalImage(void* externalImage) noexcept;
  virtual void releaseExternalImage(void* externalImage) noexcept;
  virtual void* createExternalImageTexture(void* externalImage) noexcept;
  virtual void destroyExternalImage(void* texture) noexcept;
};

}  // namespace filament::backend

namespace catgut {
namespace {

using filament::backend::Driver;
using filament::backend::FenceStatus;
using filament::backend::OpenGLPlatform;
using filament::backend::TextureFormat;

bool has(const char* extensions, std::string_view name) {
  std::istringstream words(extensions ? extensions : "");
  for (std::string word; words >> word;)
    if (word == name) return true;
  return false;
}

bool usable(EGLDisplay display) {
  return display != EGL_NO_DISPLAY && eglInitialize(display, nullptr, nullptr) && eglBindAPI(EGL_OPENGL_API);
}

// A graphics card's device, if its driver answers. Mesa beside a vendor's driver offers the surfaceless platform too, and would
// draw there on the processor while the card is idle.
EGLDisplay open_card(const char* client) {
  if (!has(client, "EGL_EXT_platform_device") || !has(client, "EGL_EXT_device_enumeration")) return EGL_NO_DISPLAY;
  EGLDeviceEXT devices[16];
  EGLint count = 0;
  if (!eglQueryDevicesEXT(16, devices, &count)) return EGL_NO_DISPLAY;
  for (EGLint i = 0; i < count; ++i) {
    if (has(eglQueryDeviceStringEXT(devices[i], EGL_EXTENSIONS), "EGL_MESA_device_software")) continue;
    const EGLDisplay display = eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, devices[i], nullptr);
    if (usable(display)) return display;
  }
  return EGL_NO_DISPLAY;
}

// A card first, then Mesa's surfaceless platform, which works without one.
EGLDisplay open_display() {
  const char* client = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  // eglGetPlatformDisplayEXT and not the core function: libepoxy aborts on that one while no display is current.
  if (!has(client, "EGL_EXT_platform_base"))
    throw std::runtime_error("no pictures: EGL on this machine has no platform displays");
  if (const EGLDisplay display = open_card(client); display != EGL_NO_DISPLAY) return display;
  if (has(client, "EGL_MESA_platform_surfaceless")) {
    const EGLDisplay display = eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
    if (usable(display)) return display;
  }
  throw std::runtime_error("no pictures: no EGL driver answers on this machine (Debian: apt install libgl1-mesa-dri libegl1)");
}

EGLDisplay open_x11(Display* connection) {
  if (has(eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS), "EGL_EXT_platform_x11") ||
      has(eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS), "EGL_KHR_platform_x11")) {
    const EGLDisplay display = eglGetPlatformDisplayEXT(EGL_PLATFORM_X11_EXT, connection, nullptr);
    if (usable(display)) return display;
  }
  throw std::runtime_error("no window: no EGL driver for this X server (Debian: apt install libgl1-mesa-dri libegl1)");
}

// 8-bit color with depth; for a window, of the visual it was created with, or rendering to it fails on some drivers.
EGLConfig choose_config(EGLDisplay display, EGLint surface, EGLint visual) {
  const EGLint wanted[] = {
      EGL_SURFACE_TYPE, surface, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_RED_SIZE,   8,  EGL_GREEN_SIZE, 8,
      EGL_BLUE_SIZE,    8,       EGL_ALPHA_SIZE,      visual ? 0 : 8, EGL_DEPTH_SIZE, 24, EGL_NONE};
  EGLint count = 0;
  eglChooseConfig(display, wanted, nullptr, 0, &count);
  std::vector<EGLConfig> configs(static_cast<size_t>(std::max(count, 0)));
  if (!eglChooseConfig(display, wanted, configs.data(), count, &count) || count < 1)
    throw std::runtime_error("no pictures: the EGL driver offers no 8-bit color with depth");
  for (const EGLConfig config : configs) {
    EGLint has_visual = 0;
    if (visual && eglGetConfigAttrib(display, config, EGL_NATIVE_VISUAL_ID, &has_visual) && has_visual == visual) return config;
  }
  return configs[0];
}

class EglPlatform final : public OpenGLPlatform {
 public:
  // All steps that can fail are here, on the caller's thread, where errors can be reported.
  EglPlatform() : display_(open_display()), config_(choose_config(display_, EGL_PBUFFER_BIT, 0)) { make_context(); }
  explicit EglPlatform(Window window) : connection_(XOpenDisplay(nullptr)) {
    XWindowAttributes attributes;
    if (!connection_ || !XGetWindowAttributes(connection_, window, &attributes)) {
      close_connection();
      throw std::runtime_error("no window: the X server does not answer");
    }
    try {
      display_ = open_x11(connection_);
      const auto visual = static_cast<EGLint>(XVisualIDFromVisual(attributes.visual));
      config_ = choose_config(display_, EGL_WINDOW_BIT | EGL_PBUFFER_BIT, visual);
      make_context();
    } catch (...) {
      close_connection();
      throw;
    }
  }
  EglPair pair() {
    EglPair p;
    p.display = display_, p.config = config_;
    p.context = new_context(context_);
    p.surface = pbuffer(1, 1);
    shared_ = true;
    return p;
  }
  // Without a window, one display for the whole process stays open: another renderer may be using it.
  ~EglPlatform() noexcept override {
    if (idle_ != EGL_NO_SURFACE) eglDestroySurface(display_, idle_);
    eglDestroyContext(display_, context_);
    if (connection_) eglTerminate(display_);
    close_connection();
  }

  int getOSVersion() const noexcept override { return 0; }

  Driver* createDriver(void* shared) noexcept override {
    eglBindAPI(EGL_OPENGL_API);  // per thread; this is Filament's thread
    if (!eglMakeCurrent(display_, idle_, idle_, context_)) return nullptr;
    return createDefaultDriver(this, shared);
  }
  void terminate() noexcept override {
    eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    eglReleaseThread();
  }
  SwapChain* createSwapChain(void* window, uint64_t&) noexcept override {
    if (!connection_) return nullptr;  // no windows here
    return reinterpret_cast<SwapChain*>(
        eglCreateWindowSurface(display_, config_, reinterpret_cast<EGLNativeWindowType>(window), nullptr));
  }
  SwapChain* createSwapChain(uint32_t width, uint32_t height, uint64_t&) noexcept override {
    return reinterpret_cast<SwapChain*>(pbuffer(EGLint(width), EGLint(height)));
  }
  void destroySwapChain(SwapChain* chain) noexcept override {
    if (!chain) return;
    eglMakeCurrent(display_, idle_, idle_, context_);
    eglDestroySurface(display_, reinterpret_cast<EGLSurface>(chain));
  }
  void makeCurrent(SwapChain* draw, SwapChain* read) noexcept override {
    eglMakeCurrent(display_, reinterpret_cast<EGLSurface>(draw), reinterpret_cast<EGLSurface>(read), context_);
    if (connection_) eglSwapInterval(display_, 1);
  }
  // Without a window nothing is shown here.
  void commit(SwapChain* chain) noexcept override {
    if (connection_) eglSwapBuffers(display_, reinterpret_cast<EGLSurface>(chain));
    // Another context reads the images next; it cannot wait for commands of this one.
    if (shared_) glFinish();
  }
  void setPresentationTime(int64_t) noexcept override {}
  Fence* createFence() noexcept override { return nullptr; }
  void destroyFence(Fence*) noexcept override {}
  FenceStatus waitFence(Fence*, uint64_t) noexcept override { return FenceStatus::ERROR; }
  Stream* createStream(void*) noexcept override { return nullptr; }
  void destroyStream(Stream*) noexcept override {}
  void attach(Stream*, intptr_t) noexcept override {}
  void detach(Stream*) noexcept override {}
  void updateTexImage(Stream*, int64_t*) noexcept override {}
  ExternalTexture* createExternalTextureStorage() noexcept override { return nullptr; }
  void reallocateExternalStorage(ExternalTexture*, uint32_t, uint32_t, TextureFormat) noexcept override {}
  void destroyExternalTextureStorage(ExternalTexture*) noexcept override {}

 private:
  void make_context() {
    context_ = new_context(EGL_NO_CONTEXT);
    idle_ = pbuffer(1, 1);
  }
  EGLContext new_context(EGLContext shared) {
    const EGLint wanted[] = {
        EGL_CONTEXT_MAJOR_VERSION,           4,       EGL_CONTEXT_MINOR_VERSION, 1, EGL_CONTEXT_OPENGL_PROFILE_MASK,
        EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
    const EGLContext context = eglCreateContext(display_, config_, shared, wanted);
    if (context == EGL_NO_CONTEXT) throw std::runtime_error("no pictures: the EGL driver has no OpenGL 4.1 core");
    return context;
  }
  void close_connection() noexcept {
    if (connection_) XCloseDisplay(connection_);
    connection_ = nullptr;
  }
  EGLSurface pbuffer(EGLint width, EGLint height) const {
    const EGLint size[] = {EGL_WIDTH, width, EGL_HEIGHT, height, EGL_NONE};
    return eglCreatePbufferSurface(display_, config_, size);
  }
  Display* connection_ = nullptr;  // for a window
  EGLDisplay display_ = EGL_NO_DISPLAY;
  EGLConfig config_ = nullptr;
  EGLContext context_ = EGL_NO_CONTEXT;
  EGLSurface idle_ = EGL_NO_SURFACE;
  bool shared_ = false;  // with a headset's runtime
};

}  // namespace

std::unique_ptr<filament::backend::Platform> make_egl_platform() { return std::make_unique<EglPlatform>(); }
std::unique_ptr<filament::backend::Platform> make_egl_platform(uint64_t window) {
  return std::make_unique<EglPlatform>(static_cast<Window>(window));
}
EglPair make_egl_pair() {
  auto platform = std::make_unique<EglPlatform>();
  EglPair pair = platform->pair();
  pair.platform = std::move(platform);
  return pair;
}

}  // namespace catgut
