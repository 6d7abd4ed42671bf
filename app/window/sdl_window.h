// SPDX-License-Identifier: Apache-2.0
// app/window: SDL and its window.
#pragma once
#include <SDL.h>

#include <cstdint>

namespace catgut {

constexpr const char* kHeadless = "run without it: catgut run purse_string --surgeon scripted --headless";

// Open while this object exists. Throws InputError without a display.
struct SdlWindow {
  SDL_Window* window = nullptr;
  uint64_t number = 0;  // of the X server

  SdlWindow(int width, int height, bool whole_screen = false);
  ~SdlWindow();
  SdlWindow(const SdlWindow&) = delete;
  SdlWindow& operator=(const SdlWindow&) = delete;
};

}  // namespace catgut
