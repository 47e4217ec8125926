// SPDX-License-Identifier: Apache-2.0
#include "host/common/error.hpp"
#include "host/display/display.hpp"

#ifdef RAYWAVE_SDL2
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <utility>

#include "host/common/text.hpp"
#include "host/display/sdl.hpp"
#endif

namespace raywave {

#ifdef RAYWAVE_SDL2
namespace {

constexpr double usual_rate_hz = 60;

/// The EDID of the monitor whose name SDL gives its display, where the kernel knows one such alone.
std::optional<Edid> edid_named(const std::string& name) {
  std::optional<Edid> found;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/sys/class/drm", error)) {
    std::ifstream in(entry.path() / "edid", std::ios::binary);
    const std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(in), {}};
    const auto edid = read_edid(bytes);
    if (!edid || edid->name.empty() || !name.starts_with(edid->name)) continue;
    if (found) return {};
    found = edid;
  }
  return found;
}

class WindowDisplay : public Display {
public:
  WindowDisplay() {
    sdl_.SDL_SetHint(SDL_HINT_RENDER_SCALE_QUALITY, "0");
    sdl_.SDL_SetHint(SDL_HINT_VIDEO_MINIMIZE_ON_FOCUS_LOSS, "0");
  }
  ~WindowDisplay() override {
    close();
    sdl_.SDL_QuitSubSystem(SDL_INIT_VIDEO);
  }

  std::vector<DisplayOutput> list() override;
  DisplayOutput open(const WantedOutput& wanted) override;
  void flip(const LevelFrame& frame, std::uint64_t refresh) override;
  Flip event() override { return last_; }
  void close() noexcept override;
  Json describe() const override;

private:
  std::string mode_command(const WantedOutput& wanted) const;
  void open_window(int number);
  bool make_renderer(std::uint32_t flags);
  bool waits_for_refreshes();
  void show_black();
  void handle_events();
  void read_back(const LevelFrame& frame);
  [[noreturn]] void fail(const std::string& what) {
    throw DeviceError("output " + one_line(output_.name) + ": " + what);
  }
  void require(bool done, const char* what) {
    if (!done) fail(std::string(what) + ": " + sdl_.SDL_GetError());
  }
  double period_s() const { return 1 / output_.rate_hz; }

  Sdl sdl_{"give --backend kms"};
  SDL_Window* window_ = nullptr;
  SDL_Renderer* renderer_ = nullptr;
  SDL_Texture* texture_ = nullptr;
  DisplayOutput output_;
  std::string driver_;
  std::vector<std::uint32_t> pixels_, drawn_;
  bool is_rate_known_ = false, has_vsync_ = false, reads_back_ = false;
  std::uint64_t swapped_ = 0, read_back_ = 0;
  double first_s_ = 0;
  Flip last_;
};

std::vector<DisplayOutput> WindowDisplay::list() {
  std::vector<DisplayOutput> outputs;
  for (int i = 0; i < sdl_.SDL_GetNumVideoDisplays(); ++i) {
    SDL_Rect place{};
    SDL_DisplayMode mode{};
    const char* const name = sdl_.SDL_GetDisplayName(i);
    if (sdl_.SDL_GetDisplayBounds(i, &place) != 0 || sdl_.SDL_GetDesktopDisplayMode(i, &mode) != 0)
      continue;
    auto& output = outputs.emplace_back();
    output.name = name ? name : std::to_string(i);
    output.place_px = {place.x, place.y};
    output.size_px = {mode.w, mode.h};
    // Whole numbers, cut: 59 is NTSC's
    const bool is_cut = (mode.refresh_rate + 1) % 10 == 0 || (mode.refresh_rate + 1) % 12 == 0;
    output.rate_hz = is_cut ? (mode.refresh_rate + 1) / 1.001 : mode.refresh_rate;
    output.edid = edid_named(output.name);
  }
  return outputs;
}

/// What sets the mode of an output on this desktop.
std::string WindowDisplay::mode_command(const WantedOutput& wanted) const {
  const auto mode = std::to_string(wanted.size_px.x) + "x" + std::to_string(wanted.size_px.y);
  if (std::string_view(sdl_.SDL_GetCurrentVideoDriver()) != "x11")
    return "set it to " + mode + (wanted.rate_hz > 0 ? format(" at %.4g Hz", wanted.rate_hz) : "") +
           ", scale 1 and no rotation in the desktop's settings";
  // SDL names monitors, where they have names
  const bool is_named = output_.name.find(' ') != std::string::npos;
  return "run xrandr --output " + (is_named ? "OUTPUT" : one_line(output_.name)) + " --mode " +
         mode + (wanted.rate_hz > 0 ? format(" --rate %.4g", wanted.rate_hz) : "") +
         " --scale 1 --rotate normal";
}

bool WindowDisplay::make_renderer(std::uint32_t flags) {
  if (renderer_) sdl_.SDL_DestroyRenderer(renderer_);
  renderer_ = sdl_.SDL_CreateRenderer(window_, -1, flags);
  return renderer_ != nullptr;
}

/// Whether swaps come back at the output's rate. Some drivers only say that they wait.
bool WindowDisplay::waits_for_refreshes() {
  std::array<double, 25> took_s;
  for (auto& one : took_s) {
    const double start_s = now_s();
    show_black();
    one = now_s() - start_s;
  }
  std::nth_element(took_s.begin(), took_s.begin() + 12, took_s.end());
  return std::abs(took_s[12] * output_.rate_hz - 1) < 0.03;
}

void WindowDisplay::show_black() {
  handle_events();
  sdl_.SDL_SetRenderDrawColor(renderer_, 0, 0, 0, 255);
  sdl_.SDL_RenderClear(renderer_);
  sdl_.SDL_RenderPresent(renderer_);
}

void WindowDisplay::open_window(int number) {
  window_ = sdl_.SDL_CreateWindow("raywave show", output_.place_px.x, output_.place_px.y,
                                  output_.size_px.x, output_.size_px.y,
                                  SDL_WINDOW_BORDERLESS | SDL_WINDOW_FULLSCREEN_DESKTOP |
                                      SDL_WINDOW_ALWAYS_ON_TOP | SDL_WINDOW_ALLOW_HIGHDPI);
  require(window_, "no window can be opened");
  sdl_.SDL_ShowCursor(SDL_DISABLE);
  has_vsync_ = make_renderer(SDL_RENDERER_ACCELERATED | SDL_RENDERER_PRESENTVSYNC) &&
               is_rate_known_ && waits_for_refreshes();
  if (!has_vsync_)
    require(make_renderer(SDL_RENDERER_ACCELERATED) || make_renderer(SDL_RENDERER_SOFTWARE),
            "nothing can be drawn");
  SDL_RendererInfo info{};
  sdl_.SDL_GetRendererInfo(renderer_, &info);
  driver_ = std::string(sdl_.SDL_GetCurrentVideoDriver()) + ", " + (info.name ? info.name : "?");
  for (int i = 0; i < 10; ++i) {  // until the window manager has placed the window
    show_black();
    sleep_until(now_s() + 0.02);
  }
  if (const int here = sdl_.SDL_GetWindowDisplayIndex(window_); here != number)
    fail("the desktop has put the window on output " + std::to_string(here) +
         " of --list; give --backend kms");
}

DisplayOutput WindowDisplay::open(const WantedOutput& wanted) {
  const auto outputs = list();
  const auto& chosen = find_output(outputs, wanted.name);
  output_ = chosen;
  reads_back_ = wanted.reads_back;
  if (output_.size_px != wanted.size_px)
    throw InputError("output " + one_line(output_.name) + " is " + size_text(output_.size_px) +
                     " pixels and the frames are " + size_text(wanted.size_px) + "; " +
                     mode_command(wanted));
  is_rate_known_ = output_.rate_hz > 0;
  // SDL tells whole numbers
  if (is_rate_known_ && wanted.rate_hz > 0 && std::abs(output_.rate_hz - wanted.rate_hz) > 1)
    throw InputError("output " + one_line(output_.name) +
                     format(" shows %.4g frames a second and the SLM is to show %.4g; ",
                            output_.rate_hz, wanted.rate_hz) +
                     mode_command(wanted));
  if (!is_rate_known_) output_.rate_hz = wanted.rate_hz > 0 ? wanted.rate_hz : usual_rate_hz;
  open_window(static_cast<int>(&chosen - outputs.data()));
  glm::ivec2 drawn(0);
  sdl_.SDL_GetRendererOutputSize(renderer_, &drawn.x, &drawn.y);
  if (drawn != wanted.size_px)
    throw InputError("output " + one_line(output_.name) + " is scaled: a window over it has " +
                     size_text(drawn) + " pixels and the frames have " + size_text(wanted.size_px) +
                     "; " + mode_command(wanted));
  texture_ = sdl_.SDL_CreateTexture(renderer_, SDL_PIXELFORMAT_ARGB8888,
                                    SDL_TEXTUREACCESS_STREAMING, drawn.x, drawn.y);
  require(texture_ && sdl_.SDL_SetTextureBlendMode(texture_, SDL_BLENDMODE_NONE) == 0,
          "no texture can be had");
  pixels_.resize(static_cast<std::size_t>(drawn.x) * static_cast<std::size_t>(drawn.y));
  return output_;
}

void WindowDisplay::handle_events() {
  for (SDL_Event event; sdl_.SDL_PollEvent(&event) != 0;) {
    if (event.type == SDL_QUIT) fail("the window was closed");
    if (event.type == SDL_DISPLAYEVENT && event.display.event == SDL_DISPLAYEVENT_DISCONNECTED)
      fail("an output was unplugged");
    if (event.type == SDL_RENDER_DEVICE_RESET || event.type == SDL_RENDER_TARGETS_RESET)
      fail("the graphics driver was reset");
  }
}

void WindowDisplay::read_back(const LevelFrame& frame) {
  drawn_.resize(pixels_.size());
  require(sdl_.SDL_RenderReadPixels(renderer_, nullptr, SDL_PIXELFORMAT_ARGB8888, drawn_.data(),
                                    4 * frame.size_px.x) == 0,
          "what was drawn cannot be read back");
  for (std::size_t i = 0; i < drawn_.size(); ++i)
    if ((drawn_[i] ^ pixels_[i]) & 0xffffff)
      fail("the graphics driver draws other levels than it was sent");
  ++read_back_;
}

void WindowDisplay::flip(const LevelFrame& frame, std::uint64_t refresh) {
  handle_events();
  const auto width = static_cast<std::size_t>(frame.size_px.x);
  for (int y = 0; y < frame.size_px.y; ++y)
    fill_row(frame, y, pixels_.data() + static_cast<std::size_t>(y) * width);
  require(sdl_.SDL_UpdateTexture(texture_, nullptr, pixels_.data(), 4 * frame.size_px.x) == 0 &&
              sdl_.SDL_RenderCopy(renderer_, texture_, nullptr, nullptr) == 0,
          "a frame cannot be drawn");
  if (reads_back_ || swapped_ == 0) read_back(frame);
  if (swapped_ > 0) {
    const auto steps = static_cast<double>(refresh - last_.refresh);
    sleep_until(has_vsync_ ? last_.time_s + (steps - 0.75) * period_s()
                           : first_s_ + static_cast<double>(refresh) * period_s());
  }
  const double asked_s = now_s();
  sdl_.SDL_RenderPresent(renderer_);
  Flip flip{0, now_s(), asked_s};
  if (swapped_ == 0) {
    first_s_ = flip.time_s;
  } else {
    // Without vsync the clock makes the refreshes
    const double since =
        has_vsync_ ? static_cast<double>(last_.refresh) + (flip.time_s - last_.time_s) / period_s()
                   : (flip.time_s - first_s_) / period_s();
    flip.refresh = std::max(last_.refresh + 1, static_cast<std::uint64_t>(std::llround(since)));
  }
  last_ = flip;
  ++swapped_;
}

void WindowDisplay::close() noexcept {
  if (texture_) sdl_.SDL_DestroyTexture(texture_);
  if (renderer_) sdl_.SDL_DestroyRenderer(renderer_);
  if (window_) {
    sdl_.SDL_DestroyWindow(window_);
    sdl_.SDL_ShowCursor(SDL_ENABLE);
  }
  texture_ = nullptr;
  renderer_ = nullptr;
  window_ = nullptr;
}

Json WindowDisplay::describe() const {
  return {{"backend", "window"},
          {"driver", driver_},
          {"output", output_.name},
          {"edid", output_.edid ? Json(output_.edid->id()) : Json()},
          {"size", {output_.size_px.x, output_.size_px.y}},
          {"rate_hz", output_.rate_hz},
          {"rate", is_rate_known_ ? "of the output" : "not known, assumed"},
          {"refreshes", has_vsync_ ? "of the output, by the times of swaps" : "of the clock"},
          {"proof", {{"read_back", read_back_}, {"swaps_returned", swapped_}}}};
}

}  // namespace

std::unique_ptr<Display> window_display() { return std::make_unique<WindowDisplay>(); }

#else

std::unique_ptr<Display> window_display() {
  throw InputError(
      "raywave was built without SDL2; install libsdl2-dev and build it again, or give --backend "
      "kms");
}

#endif

}  // namespace raywave
