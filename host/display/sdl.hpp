// SPDX-License-Identifier: Apache-2.0
/// SDL2, as windows call it.
#pragma once

#define SDL_MAIN_HANDLED
#include <SDL.h>

#include <functional>
#include <string>
#include <type_traits>

#include "host/common/error.hpp"
#include "host/display/loaded.hpp"

#define RAYWAVE_SDL_FUNCTIONS(use)                                                          \
  use(SDL_SetMainReady) use(SDL_SetHint) use(SDL_InitSubSystem) use(SDL_QuitSubSystem)      \
      use(SDL_GetError) use(SDL_GetCurrentVideoDriver) use(SDL_GetNumVideoDisplays)         \
          use(SDL_GetDisplayName) use(SDL_GetDisplayBounds) use(SDL_GetDesktopDisplayMode)  \
              use(SDL_CreateWindow) use(SDL_DestroyWindow) use(SDL_SetWindowTitle)          \
                  use(SDL_GetWindowSize) use(SDL_GetWindowDisplayIndex) use(SDL_ShowCursor) \
                      use(SDL_PollEvent) use(SDL_GetModState) use(SDL_GetKeyName)           \
                          use(SDL_CreateRenderer) use(SDL_DestroyRenderer)                  \
                              use(SDL_GetRendererInfo) use(SDL_GetRendererOutputSize)       \
                                  use(SDL_CreateTexture) use(SDL_DestroyTexture)            \
                                      use(SDL_SetTextureBlendMode) use(SDL_UpdateTexture)   \
                                          use(SDL_RenderCopy) use(SDL_RenderClear)          \
                                              use(SDL_SetRenderDrawColor)                   \
                                                  use(SDL_RenderReadPixels) use(SDL_RenderPresent)

namespace raywave {

struct Sdl {
#define RAYWAVE_MEMBER(name) std::function<std::remove_pointer_t<decltype(&::name)>> name;
  RAYWAVE_SDL_FUNCTIONS(RAYWAVE_MEMBER)
#undef RAYWAVE_MEMBER

  /// Loads SDL, and begins to show windows.
  ///
  /// advice  where there is no desktop
  /// throws  InputError that says what to install, DeviceError where there is no desktop
  explicit Sdl(const char* advice) {
    const LoadedLibrary library("libSDL2-2.0.so.0", "libsdl2-2.0-0");
#define RAYWAVE_FIND(name) library.find(#name, name);
    RAYWAVE_SDL_FUNCTIONS(RAYWAVE_FIND)
#undef RAYWAVE_FIND
    SDL_SetMainReady();
    SDL_SetHint(SDL_HINT_NO_SIGNAL_HANDLERS, "1");
    const bool has_begun = SDL_InitSubSystem(SDL_INIT_VIDEO) == 0;
    const std::string driver(has_begun ? SDL_GetCurrentVideoDriver() : "");
    // Where there is no desktop, SDL draws for nobody
    if (!has_begun || driver == "dummy" || driver == "offscreen")
      throw DeviceError("no window can be opened: " +
                        std::string(has_begun ? "there is no desktop" : SDL_GetError()) + "; " +
                        advice);
  }
};

}  // namespace raywave
