// SPDX-License-Identifier: Apache-2.0
// tests/xr: a workplace with window, headset and a simulated wearer: a private X server, the test runtime in this process, its
// remote driver, and the layer that observes and disturbs. Each test is a process of its own (ctest).
#pragma once
#include <dlfcn.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <string>

#include "../hands/x_server.h"
#include "layer/layer.h"
#include "remote.h"
#include "window/window.h"

namespace catgut {

class AtTheHeadset : public testing::Test {
 protected:
  void SetUp() override {
    const std::string manifest = runtime();
    if (manifest.empty()) GTEST_SKIP() << "left out: the OpenXR test runtime is not built here; run tools/get_xr_runtime.sh";
    if (!renderer_available()) GTEST_SKIP() << "left out: no EGL driver here";
    if (!on_path("Xvfb")) GTEST_SKIP() << "left out: Xvfb is missing (Debian: apt install xvfb)";
    x_ = std::make_unique<XServer>();
    if (x_->display.empty()) GTEST_SKIP() << "left out: Xvfb does not start here";
    folder_ = std::filesystem::path(testing::TempDir()) / ("catgut_xr_" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_ / "monado");
    std::filesystem::create_directories(folder_ / "catgut");
    const int port = free_port();
    std::ofstream(folder_ / "monado/config_v0.json")
        << "{\"active\": \"remote\", \"remote\": {\"version\": 0, \"port\": " << port << ", \"view_count\": 2}}\n";
    setenv("DISPLAY", x_->display.c_str(), 1);
    setenv("SDL_VIDEODRIVER", "x11", 1);
    setenv("XDG_CONFIG_HOME", folder_.c_str(), 1);
    setenv("XDG_RUNTIME_DIR", folder_.c_str(), 1);
    setenv("XR_RUNTIME_JSON", manifest.c_str(), 1);
    setenv("XR_API_LAYER_PATH", CATGUT_XR_LAYER_FOLDER, 1);
    setenv("XR_ENABLE_API_LAYERS", "XR_APILAYER_CATGUT_test", 1);
    setenv("P_OVERRIDE_ACTIVE_CONFIG", "remote", 1);
    setenv("XRT_COMPOSITOR_NULL", "1", 1);
    for (const char* log : {"XRT_LOG", "XRT_COMPOSITOR_LOG", "OXR_DEBUG_LOG"}) setenv(log, "error", 0);
    void* library = dlopen(CATGUT_XR_LAYER, RTLD_NOW);
    ASSERT_NE(library, nullptr) << dlerror();
    layer_ = reinterpret_cast<XrLayerState* (*)()>(dlsym(library, "catgut_test_layer"))();
    remote_ = std::make_unique<Remote>(port);
    remote_->set(wearer_);
  }
  void TearDown() override {
    remote_.reset();
    // For a look at what was done: catgut replay FILE --from-head --video ...
    if (const char* keep = std::getenv("CATGUT_PICTURES"); keep && std::filesystem::exists(folder_ / "run.cgrec"))
      std::filesystem::copy_file(folder_ / "run.cgrec", std::filesystem::path(keep) / "run.cgrec",
                                 std::filesystem::copy_options::overwrite_existing);
    if (!folder_.empty()) std::filesystem::remove_all(folder_);
  }

  static std::string runtime() {
    if (const char* given = std::getenv("XR_RUNTIME_JSON")) return given;
    std::string out;
    if (std::FILE* f = popen(CATGUT_SOURCE_DIR "/tools/get_xr_runtime.sh --check", "r")) {
      for (int c; (c = std::fgetc(f)) != EOF && c != '\n';) out += static_cast<char>(c);
      pclose(f);
    }
    return out;
  }

  // Opens the window until `each`, called per frame, returns false or the time is over. Returns the program's exit code.
  int sit(PlayOptions options, double seconds, const std::function<bool(const WindowLook&)>& each) {
    remote_->set(wearer_);
    options.headset = true;
    options.width = 320, options.height = 200;
    options.seconds = seconds;
    options.watch = [&](const WindowLook& now) {
      remote_->set(wearer_);
      return each(now);
    };
    return play(options);
  }

  bool seen(XrLayerState* layer, int state) const { return layer->states_seen >> state & 1; }

  std::unique_ptr<XServer> x_;
  std::filesystem::path folder_;
  XrLayerState* layer_ = nullptr;
  std::unique_ptr<Remote> remote_;
  RemoteWearer wearer_;  // streamed before every frame
};

}  // namespace catgut
