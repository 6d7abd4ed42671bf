// SPDX-License-Identifier: Apache-2.0
// app/window: the tone of an active electrosurgical pen, as its generator has to give: lower for cutting, higher for
// coagulation. The window's thread sets the mode, the sound card's reads it.
#pragma once
#include <SDL.h>

#include <atomic>
#include <span>

#include "exchange/instrument.h"

namespace catgut {

constexpr int kSoundRate = 48000;  // [1/s]
float tone_of(PenMode mode);       // [Hz]; 0: silence

// Continues from call to call: without a jump at a change of tone, and fading in and out.
class PenTone {
 public:
  void fill(std::span<float> samples, PenMode mode);

 private:
  double phase_ = 0;  // 0 .. 1
  float hertz_ = 0, loud_ = 0;
};

// Silent where the machine has no sound.
class PenSound {
 public:
  PenSound() = default;
  ~PenSound();
  PenSound(const PenSound&) = delete;
  PenSound& operator=(const PenSound&) = delete;
  void open();
  void set(PenMode mode) { mode_.store(mode, std::memory_order_relaxed); }

 private:
  PenTone tone_;
  std::atomic<PenMode> mode_{PenMode::off};
  SDL_AudioDeviceID device_ = 0;
  bool tried_ = false;
};

}  // namespace catgut
