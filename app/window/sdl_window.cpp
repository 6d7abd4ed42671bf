// SPDX-License-Identifier: Apache-2.0
// app/window: see sdl_window.h.
#include "window/sdl_window.h"

#include <SDL_syswm.h>
#include <fmt/format.h>

#include <string>

#include "core/check.h"

namespace catgut {
namespace {

void close(SDL_Window* window) {
  if (window) SDL_DestroyWindow(window);
  SDL_Quit();
}

}  // namespace

SdlWindow::SdlWindow(int width, int height, bool whole_screen) {
  // Rendering uses EGL on X11; a Wayland desktop provides it through XWayland.
  SDL_SetHintWithPriority(SDL_HINT_VIDEODRIVER, "x11", SDL_HINT_DEFAULT);
  SDL_SetHint(SDL_HINT_NO_SIGNAL_HANDLERS, "1");
  if (SDL_Init(SDL_INIT_VIDEO | SDL_INIT_GAMECONTROLLER) != 0)
    throw InputError("window", fmt::format("no display ({})", SDL_GetError()), kHeadless);
  int left = SDL_WINDOWPOS_CENTERED, top = SDL_WINDOWPOS_CENTERED;
  // A stand may run without a window manager, and only that would enlarge the window.
  if (SDL_DisplayMode screen; whole_screen && SDL_GetDesktopDisplayMode(0, &screen) == 0)
    left = top = 0, width = screen.w, height = screen.h;
  window = SDL_CreateWindow(
      "Catgut", left, top, width, height,
      SDL_WINDOW_RESIZABLE | SDL_WINDOW_SHOWN | static_cast<Uint32>(whole_screen ? SDL_WINDOW_FULLSCREEN_DESKTOP : 0));
  SDL_SysWMinfo info;
  SDL_VERSION(&info.version);
  if (!window || !SDL_GetWindowWMInfo(window, &info) || info.subsystem != SDL_SYSWM_X11) {
    const std::string why = window ? "it is not an X11 window" : SDL_GetError();
    close(window);
    throw InputError("window", "it cannot be opened (" + why + ")", kHeadless);
  }
  number = info.info.x11.window;
}

SdlWindow::~SdlWindow() { close(window); }

}  // namespace catgut
