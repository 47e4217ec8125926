// SPDX-License-Identifier: Apache-2.0
/// A window for pictures, and what a person does in it.
#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "host/display/side_panel.hpp"

namespace raywave {

struct UserAction {
  enum class Kind { key, drag, wheel, close };
  Kind kind = Kind::key;
  std::string key;         // as SDL names it, in small letters: "left", "h", "="
  glm::dvec2 by{0, 0};     // to the right and up: of a drag, over the picture's height; of a wheel
  bool is_second = false;  // with the right button or Shift
};

class ViewerWindow {
public:
  virtual ~ViewerWindow() = default;

  /// What was done since the last call, but in the panel; waits so long where there was nothing.
  virtual std::vector<UserAction> wait(double seconds) = 0;
  /// Shows a picture as large as the window lets it.
  ///
  /// rgb     3 bytes for each pixel, rows from the top
  /// throws  DeviceError when nothing can be drawn
  virtual void draw(glm::ivec2 size_px, std::span<const std::uint8_t> rgb,
                    const std::string& title) = 0;
  /// Shows the panel, as at first, or hides it. Returns whether it is there.
  virtual bool show_panel(bool is_wanted) = 0;
};

/// By SDL2.
///
/// size_px  of its first picture
/// fill     the panel, from wait and draw
/// throws   InputError that says what to install, DeviceError where there is no desktop
std::unique_ptr<ViewerWindow> viewer_window(glm::ivec2 size_px, FillPanel fill);

}  // namespace raywave
