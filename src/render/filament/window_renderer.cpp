// SPDX-License-Identifier: Apache-2.0
// render: the Filament renderer in a window; see render/window.h. The panels are a separate view, drawn last.
#include "render/window.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <stdexcept>

#include <filagui/ImGuiHelper.h>
#include <filament/Engine.h>
#include <filament/Renderer.h>
#include <filament/SwapChain.h>
#include <filament/View.h>
#include <filament/Viewport.h>
#include <imgui.h>

#include "render/filament/egl_platform.h"
#include "render/filament/start_engine.h"
#include "render/filament/theatre.h"

namespace catgut {
namespace {

// [pixels] text heights with their own glyphs; others scale the nearest. 720 lines have 16, 1080: 24, 1440: 32, 2160: 48.
constexpr std::array<float, 11> kTextHeights{11, 13, 16, 19, 22, 24, 28, 32, 40, 48, 64};

class FilamentWindow final : public WindowRenderer {
 public:
  FilamentWindow(uint64_t window, int width, int height, const std::string& font)
      : platform_(make_egl_platform(window)), engine_(start_engine(*platform_)) {
    chain_ = engine_->createSwapChain(reinterpret_cast<void*>(static_cast<uintptr_t>(window)));
    renderer_ = engine_->createRenderer();
    renderer_->setClearOptions({{0.02f, 0.10f, 0.09f, 1}, true, false});
    panel_view_ = engine_->createView();
    panel_view_->setPostProcessingEnabled(false);
    panel_view_->setShadowingEnabled(false);
    panels_ = std::make_unique<filagui::ImGuiHelper>(engine_, panel_view_, utils::Path());
    // All heights at once: the panels' materials keep the first glyphs that they receive.
    ImFontAtlas& letters = *ImGui::GetIO().Fonts;
    letters.Clear();
    const bool there = !font.empty() && std::filesystem::exists(font);
    for (const float pixels : kTextHeights) {
      ImFontConfig built_in;
      built_in.SizePixels = pixels;
      if (there) letters.AddFontFromFileTTF(font.c_str(), pixels);
      else letters.AddFontDefault(&built_in);
    }
    panels_->createAtlasTexture(engine_);
    text_height(16);
    resize(width, height);
  }

  ~FilamentWindow() override {
    // The driver may still read the glyphs, which the panels own: before the first frame nothing has waited for it.
    engine_->flushAndWait();
    panels_.reset();
    theatre_.reset();
    engine_->destroy(panel_view_);
    engine_->destroy(renderer_);
    engine_->destroy(chain_);
    filament::Engine::destroy(&engine_);
  }

  void stage(const PictureModel* model, Quality quality) override {
    theatre_.reset();
    if (!model) return;
    theatre_ = std::make_unique<Theatre>(*engine_, *model, quality);
    coarse_ = 1, still_s_ = 0, sharp_ = false;
  }

  void set_resolution_scale(float part) override {
    coarse_ = part;
    if (theatre_) theatre_->set_resolution_scale(part);
  }

  void resize(int width, int height) override {
    width_ = std::max(width, 16), height_ = std::max(height, 16);
    panel_view_->setViewport({0, 0, uint32_t(width_), uint32_t(height_)});
    panels_->setDisplaySize(width_, height_);
  }

  void text_height(float pixels) override {
    const auto nearest = std::min_element(kTextHeights.begin(), kTextHeights.end(),
                                          [&](float a, float b) { return std::abs(a - pixels) < std::abs(b - pixels); });
    ImGuiIO& io = ImGui::GetIO();
    io.FontDefault = io.Fonts->Fonts[static_cast<int>(nearest - kTextHeights.begin())];
    io.FontGlobalScale = pixels / *nearest;
  }

  bool draw(const Frame& frame) override {
    // First check whether there will be a frame: uploads without one would accumulate while the driver is behind.
    bool begun = renderer_->beginFrame(chain_);
    for (int i = 0; frame.copy && !begun && i < 20; ++i) {
      engine_->flushAndWait();
      begun = renderer_->beginFrame(chain_);
    }
    if (!begun) return false;
    const bool field = theatre_ && frame.snapshot;
    if (field) sharpen(frame);
    if (field) theatre_->show(*frame.snapshot, frame.camera, width_, height_, frame.suture_points);
    if (field) theatre_->set_inset(frame.inset, height_);
    // Without a field, the panels' view clears the previous image.
    panel_view_->setBlendMode(field ? filament::View::BlendMode::TRANSLUCENT : filament::View::BlendMode::OPAQUE);
    panels_->render(frame.dt, [&](filament::Engine*, filament::View*) {
      if (frame.panels) frame.panels();
    });
    if (field) renderer_->render(theatre_->view());
    if (filament::View* inset = field ? theatre_->inset_view() : nullptr) renderer_->render(inset);
    renderer_->render(panel_view_);
    if (frame.copy) {
      Image& image = *frame.copy;
      image = make_image(width_, height_, {0, 0, 0, 255});
      renderer_->readPixels(
          0, 0, uint32_t(width_), uint32_t(height_),
          {image.rgba.data(), image.rgba.size(), filament::Texture::Format::RGBA, filament::Texture::Type::UBYTE});
    }
    renderer_->endFrame();
    if (frame.copy) {
      engine_->flushAndWait();
      for (size_t i = 3; i < frame.copy->rgba.size(); i += 4) frame.copy->rgba[i] = 255;
    }
    return true;
  }

 private:
  // A picture in which nothing moves may take longer: it is drawn at the window's whole resolution.
  void sharpen(const Frame& frame) {
    const bool moved = frame.snapshot->tick != last_tick_ || distance(frame.camera.eye, last_eye_) > 1e-5f ||
                       distance(frame.camera.target, last_target_) > 1e-5f;
    last_tick_ = frame.snapshot->tick, last_eye_ = frame.camera.eye, last_target_ = frame.camera.target;
    still_s_ = moved ? 0 : still_s_ + frame.dt;
    const bool sharp = still_s_ > kStill;
    if (sharp != sharp_ && coarse_ < 1) theatre_->set_resolution_scale(sharp ? 1 : coarse_);
    sharp_ = sharp;
  }

  static constexpr float kStill = 0.4f;  // [s]
  uint64_t last_tick_ = 0;
  Vec3 last_eye_, last_target_;
  float coarse_ = 1, still_s_ = 0;
  bool sharp_ = false;
  std::unique_ptr<filament::backend::Platform> platform_;
  filament::Engine* engine_ = nullptr;
  filament::SwapChain* chain_ = nullptr;
  filament::Renderer* renderer_ = nullptr;
  filament::View* panel_view_ = nullptr;
  std::unique_ptr<filagui::ImGuiHelper> panels_;
  std::unique_ptr<Theatre> theatre_;
  int width_ = 640, height_ = 360;
};

}  // namespace

std::unique_ptr<WindowRenderer> make_window_renderer(uint64_t window, int width, int height, const std::string& font) {
  return std::make_unique<FilamentWindow>(window, width, height, font);
}

}  // namespace catgut
