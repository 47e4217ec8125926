// SPDX-License-Identifier: Apache-2.0
#include "host/display/display.hpp"

#include <memory>
#include <nlohmann/json.hpp>
#include <raywave/display.hpp>

#include "host/common/error.hpp"

namespace raywave::v0 {

struct Display::State {
  std::unique_ptr<raywave::Display> display;
  raywave::LevelFrame frame;
  std::uint64_t next = 0;
  bool is_open = true;
};

Display::Display(int columns, int rows, const DisplayOptions& options)
    : state_(std::make_unique<State>()) {
  if (columns < 1 || rows < 1) throw InputError("display: the size must be >= 1 x 1");
  if (!(options.rate_hz >= 0 && options.rate_hz <= 1e6))
    throw InputError("rate: must be 0 to 1e+06");
  state_->frame.size_px = {columns, rows};
  state_->display = display_by(options.backend);
  state_->display->open({options.output, {columns, rows}, options.rate_hz, options.read_back});
}

Display::~Display() = default;
Display::Display(Display&&) noexcept = default;
Display& Display::operator=(Display&&) noexcept = default;

Flip Display::show(std::span<const std::uint8_t> levels) {
  auto& frame = state_->frame;
  const auto pixels = std::size_t{1} * frame.size_px.x * frame.size_px.y;
  if (!state_->is_open) throw InputError("display: was closed");
  if (levels.size() != pixels && levels.size() != 3 * pixels)
    throw InputError("levels: there are " + std::to_string(levels.size()) +
                     ", and the display has " + size_text(frame.size_px) +
                     " pixels, of one or three each");
  frame.channels = levels.size() == pixels ? 1 : 3;
  frame.levels.assign(levels.begin(), levels.end());
  state_->display->flip(frame, state_->next);
  const auto flip = state_->display->event();
  state_->next = flip.refresh + 1;
  return {flip.refresh, flip.time_s, flip.time_s - flip.asked_s};
}

std::string Display::report() const { return state_->display->describe().dump(); }

void Display::close() noexcept {
  state_->is_open = false;
  state_->display->close();
}

}  // namespace raywave::v0
