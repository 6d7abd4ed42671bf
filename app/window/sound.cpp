// SPDX-License-Identifier: Apache-2.0
// app/window: see sound.h.
#include "window/sound.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/math.h"

namespace catgut {
namespace {

constexpr float kCutTone = 440, kCoagulateTone = 660;  // [Hz] chosen: distinct by ear
constexpr float kLoudness = 0.12f;                     // of the whole range
constexpr float kFade = 0.008f;                        // [s]

}  // namespace

float tone_of(PenMode mode) { return mode == PenMode::cut ? kCutTone : mode == PenMode::coagulate ? kCoagulateTone : 0; }

void PenTone::fill(std::span<float> samples, PenMode mode) {
  const float wanted = tone_of(mode), step = kLoudness / (kFade * kSoundRate);
  if (wanted > 0) hertz_ = wanted;
  for (float& s : samples) {
    loud_ = wanted > 0 ? std::min(kLoudness, loud_ + step) : std::max(0.0f, loud_ - step);
    phase_ += static_cast<double>(hertz_) / kSoundRate;
    phase_ -= std::floor(phase_);
    const float turn = 2 * kPi * static_cast<float>(phase_);
    s = loud_ * (std::sin(turn) + 0.25f * std::sin(3 * turn));
  }
}

void PenSound::open() {
  if (std::exchange(tried_, true) || SDL_InitSubSystem(SDL_INIT_AUDIO) != 0) return;
  SDL_AudioSpec wanted{};
  wanted.freq = kSoundRate, wanted.format = AUDIO_F32SYS, wanted.channels = 1, wanted.samples = 1024;
  wanted.userdata = this;
  wanted.callback = [](void* self, Uint8* bytes, int count) {
    auto& me = *static_cast<PenSound*>(self);
    me.tone_.fill({reinterpret_cast<float*>(bytes), static_cast<size_t>(count) / sizeof(float)},
                  me.mode_.load(std::memory_order_relaxed));
  };
  device_ = SDL_OpenAudioDevice(nullptr, 0, &wanted, nullptr, 0);
  if (device_) SDL_PauseAudioDevice(device_, 0);
}

PenSound::~PenSound() {
  if (device_) SDL_CloseAudioDevice(device_);
}

}  // namespace catgut
