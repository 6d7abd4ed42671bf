// SPDX-License-Identifier: Apache-2.0
// render: pictures read back from the Filament renderer, without a window. See renderer.h.
#include <stdexcept>

#include <filament/Engine.h>
#include <filament/Renderer.h>
#include <filament/SwapChain.h>

#include "render/filament/egl_platform.h"
#include "render/filament/start_engine.h"
#include "render/filament/theatre.h"
#include "render/renderer.h"

namespace catgut {
namespace {

class FilamentRenderer final : public Renderer {
 public:
  FilamentRenderer(const PictureModel& model, int width, int height, Quality quality)
      : width_(width), height_(height), platform_(make_egl_platform()), engine_(start_engine(*platform_)) {
    chain_ = engine_->createSwapChain(uint32_t(width), uint32_t(height));
    renderer_ = engine_->createRenderer();
    theatre_ = std::make_unique<Theatre>(*engine_, model, quality);
  }

  ~FilamentRenderer() override {
    theatre_.reset();
    engine_->destroy(renderer_);
    engine_->destroy(chain_);
    filament::Engine::destroy(&engine_);
  }

  Image render(const Snapshot& snapshot, const Camera& camera, const Overlay& overlay) override {
    Image image = make_image(width_, height_, {0, 0, 0, 255});
    draw_into(snapshot, camera, overlay, width_, height_, image);
    for (size_t i = 3; i < image.rgba.size(); i += 4) image.rgba[i] = 255;
    draw_caption(image, overlay.caption);
    return image;
  }

  void draw(const Snapshot& snapshot, const Camera& camera, const Overlay& overlay) override {
    Image one = make_image(1, 1, {0, 0, 0, 255});  // reading any pixel waits for all of them
    draw_into(snapshot, camera, overlay, 1, 1, one);
  }
  void set_resolution_scale(float part) override { theatre_->set_resolution_scale(part); }

 private:
  void draw_into(const Snapshot& snapshot, const Camera& camera, const Overlay& overlay, int read_width, int read_height,
                 Image& image) {
    theatre_->show(snapshot, camera, width_, height_, overlay.suture_points);
    theatre_->set_inset(overlay.inset, height_);
    // Filament may request to skip a frame when the driver is behind; a requested image is always rendered.
    bool begun = false;
    for (int i = 0; i < 20 && !begun; ++i)
      if (!(begun = renderer_->beginFrame(chain_))) engine_->flushAndWait();
    if (!begun) throw std::runtime_error("no picture: the graphics driver does not accept a frame");
    renderer_->render(theatre_->view());
    if (filament::View* inset = theatre_->inset_view()) renderer_->render(inset);
    renderer_->readPixels(
        0, 0, uint32_t(read_width), uint32_t(read_height),
        {image.rgba.data(), image.rgba.size(), filament::Texture::Format::RGBA, filament::Texture::Type::UBYTE});
    renderer_->endFrame();
    engine_->flushAndWait();
  }

  int width_, height_;
  std::unique_ptr<filament::backend::Platform> platform_;
  filament::Engine* engine_ = nullptr;
  filament::SwapChain* chain_ = nullptr;
  filament::Renderer* renderer_ = nullptr;
  std::unique_ptr<Theatre> theatre_;
};

}  // namespace

std::unique_ptr<Renderer> make_renderer(const PictureModel& model, int width, int height, Quality quality) {
  if (width < 16 || height < 16 || width > 8192 || height > 8192)
    throw std::runtime_error("a picture of " + std::to_string(width) + "x" + std::to_string(height) +
                             " pixels cannot be made; choose 16 to 8192 each way");
  return std::make_unique<FilamentRenderer>(model, width, height, quality);
}

bool renderer_available() {
  try {
    make_egl_platform();
    return true;
  } catch (const std::runtime_error&) { return false; }
}

}  // namespace catgut
