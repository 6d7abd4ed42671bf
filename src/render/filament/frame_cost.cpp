// SPDX-License-Identifier: Apache-2.0
// render/filament: frames on the backend that renders nothing; see render/frame_cost.h.
#include "render/frame_cost.h"

#include <time.h>

#include <stdexcept>

#include <filament/Renderer.h>
#include <filament/SwapChain.h>

#include "render/filament/start_engine.h"
#include "render/filament/theatre.h"

namespace catgut {
namespace {

double milliseconds(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return 1e3 * double(t.tv_sec) + 1e-6 * double(t.tv_nsec);
}

class NoopFrames final : public FrameCost {
 public:
  NoopFrames(const PictureModel& model, int width, int height, Quality quality, int eyes)
      : width_(width), height_(height), eyes_(eyes), engine_(start_engine_without_driver()) {
    chain_ = engine_->createSwapChain(uint32_t(width), uint32_t(height));
    renderer_ = engine_->createRenderer();
    theatre_ = std::make_unique<Theatre>(*engine_, model, quality, eyes);
    engine_->flushAndWait();
  }
  ~NoopFrames() override {
    theatre_.reset();
    engine_->destroy(renderer_);
    engine_->destroy(chain_);
    filament::Engine::destroy(&engine_);
  }

  Times frame(const Snapshot& snapshot, std::span<const Camera> cameras) override {
    const double caller = milliseconds(CLOCK_THREAD_CPUTIME_ID), all = milliseconds(CLOCK_PROCESS_CPUTIME_ID);
    renderer_->beginFrame(chain_);
    theatre_->show(snapshot, cameras, width_, height_, false);
    for (int i = 0; i < eyes_; ++i) renderer_->render(theatre_->view(i));
    renderer_->endFrame();
    const double submitted = milliseconds(CLOCK_THREAD_CPUTIME_ID);
    engine_->flushAndWait();
    return {submitted - caller, milliseconds(CLOCK_PROCESS_CPUTIME_ID) - all};
  }

 private:
  int width_, height_, eyes_;
  filament::Engine* engine_;
  filament::SwapChain* chain_ = nullptr;
  filament::Renderer* renderer_ = nullptr;
  std::unique_ptr<Theatre> theatre_;
};

}  // namespace

std::unique_ptr<FrameCost> make_frame_cost(const PictureModel& model, int width, int height, Quality quality, int eyes) {
  return std::make_unique<NoopFrames>(model, width, height, quality, eyes);
}

}  // namespace catgut
