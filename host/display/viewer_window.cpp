// SPDX-License-Identifier: Apache-2.0
#include "host/display/viewer_window.hpp"

#include "host/common/error.hpp"

#ifdef RAYWAVE_SDL2
#include <algorithm>
#include <cctype>
#include <chrono>
#include <glm/common.hpp>
#include <optional>
#include <thread>
#include <utility>

#include "host/display/display.hpp"
#include "host/display/sdl.hpp"
#endif

namespace raywave {

#ifdef RAYWAVE_SDL2
namespace {

class SdlViewerWindow : public ViewerWindow {
public:
  SdlViewerWindow(glm::ivec2 size_px, FillPanel fill) : fill_(std::move(fill)) {
    sdl_.SDL_SetHint(SDL_HINT_RENDER_SCALE_QUALITY, "1");
    constexpr int panel_px = SidePanel::width_px;
    window_ = sdl_.SDL_CreateWindow("raywave view", SDL_WINDOWPOS_UNDEFINED,
                                    SDL_WINDOWPOS_UNDEFINED, panel_px + size_px.x,
                                    std::max(size_px.y, 2 * panel_px), SDL_WINDOW_RESIZABLE);
    if (window_) renderer_ = sdl_.SDL_CreateRenderer(window_, -1, 0);
    if (!renderer_) fail();
    show_panel(true);
  }
  ~SdlViewerWindow() override {
    panel_.reset();
    if (texture_) sdl_.SDL_DestroyTexture(texture_);
    if (renderer_) sdl_.SDL_DestroyRenderer(renderer_);
    if (window_) sdl_.SDL_DestroyWindow(window_);
    sdl_.SDL_QuitSubSystem(SDL_INIT_VIDEO);
  }

  std::vector<UserAction> wait(double seconds) override {
    std::vector<UserAction> actions;
    if (panel_ && redraws_ > 0 && now_s() - shown_s_ > 1.0 / 60) show();
    SDL_Event event;
    // SDL_WaitEventTimeout sends events to the window, which X may get after the window has gone
    if (sdl_.SDL_PollEvent(&event) == 0) {
      std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
      return actions;
    }
    do {
      const bool is_panels = panel_ && panel_->takes(event);
      // Fields look as they are in the second frame; keys change them, too
      if (is_panels || event.type == SDL_KEYDOWN) redraws_ = 2;
      if (is_panels) continue;
      if (const auto action = action_of(event)) actions.push_back(*action);
    } while (sdl_.SDL_PollEvent(&event) != 0);
    return actions;
  }

  void draw(glm::ivec2 size_px, std::span<const std::uint8_t> rgb,
            const std::string& title) override {
    if (!texture_ || size_px != size_px_) {
      if (texture_) sdl_.SDL_DestroyTexture(texture_);
      texture_ = sdl_.SDL_CreateTexture(renderer_, SDL_PIXELFORMAT_RGB24,
                                        SDL_TEXTUREACCESS_STREAMING, size_px.x, size_px.y);
      size_px_ = size_px;
      if (!texture_) fail();
    }
    if (sdl_.SDL_UpdateTexture(texture_, nullptr, rgb.data(), 3 * size_px.x) != 0) fail();
    sdl_.SDL_SetWindowTitle(window_, title.c_str());
    show();
    redraws_ = 1;
  }

  bool show_panel(bool is_wanted) override {
    if (is_wanted != (panel_ != nullptr))
      panel_ = is_wanted ? side_panel(renderer_, fill_) : nullptr;
    return panel_ != nullptr;
  }

private:
  [[noreturn]] void fail() { throw DeviceError(std::string("the window: ") + sdl_.SDL_GetError()); }

  /// The picture as large as it fits beside the panel.
  void show() {
    --redraws_;
    shown_s_ = now_s();
    if (!texture_) return;
    glm::ivec2 space(1);
    sdl_.SDL_GetWindowSize(window_, &space.x, &space.y);
    const glm::ivec2 corner(panel_ ? SidePanel::width_px : 0, 0);
    space = glm::max(space - corner, 1);
    const auto scales = glm::dvec2(space) / glm::dvec2(size_px_);
    const auto size =
        glm::max(glm::ivec2(glm::round(std::min(scales.x, scales.y) * glm::dvec2(size_px_))), 1);
    const auto first = corner + (space - size) / 2;
    place_ = {first.x, first.y, size.x, size.y};
    sdl_.SDL_RenderClear(renderer_);
    if (sdl_.SDL_RenderCopy(renderer_, texture_, nullptr, &place_) != 0) fail();
    if (panel_) panel_->draw();
    sdl_.SDL_RenderPresent(renderer_);
  }

  std::optional<UserAction> action_of(const SDL_Event& event) {
    UserAction action;
    action.is_second = (sdl_.SDL_GetModState() & KMOD_SHIFT) != 0;
    if (event.type == SDL_QUIT) {
      action.kind = UserAction::Kind::close;
    } else if (event.type == SDL_KEYDOWN) {
      action.key = sdl_.SDL_GetKeyName(event.key.keysym.sym);
      for (char& c : action.key) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    } else if (event.type == SDL_MOUSEWHEEL) {
      action.kind = UserAction::Kind::wheel;
      action.by = {event.wheel.x, event.wheel.y};
    } else if (event.type == SDL_MOUSEMOTION &&
               (event.motion.state & (SDL_BUTTON_LMASK | SDL_BUTTON_RMASK)) != 0) {
      action.kind = UserAction::Kind::drag;
      action.by = glm::dvec2(event.motion.xrel, -event.motion.yrel) / static_cast<double>(place_.h);
      action.is_second |= (event.motion.state & SDL_BUTTON_RMASK) != 0;
    } else {
      if (event.type == SDL_WINDOWEVENT) show();
      return {};
    }
    return action;
  }

  Sdl sdl_{"--record writes pictures without one"};
  SDL_Window* window_ = nullptr;
  SDL_Renderer* renderer_ = nullptr;
  SDL_Texture* texture_ = nullptr;
  glm::ivec2 size_px_{0, 0};
  SDL_Rect place_{0, 0, 1, 1};  // of the picture in the window
  FillPanel fill_;
  std::unique_ptr<SidePanel> panel_;
  int redraws_ = 0;
  double shown_s_ = 0;
};

}  // namespace

std::unique_ptr<ViewerWindow> viewer_window(glm::ivec2 size_px, FillPanel fill) {
  return std::make_unique<SdlViewerWindow>(size_px, std::move(fill));
}

#else

std::unique_ptr<ViewerWindow> viewer_window(glm::ivec2, FillPanel) {
  throw InputError(
      "raywave was built without SDL2; install libsdl2-dev and build it again, or give --record");
}

#endif

}  // namespace raywave
