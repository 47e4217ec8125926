// SPDX-License-Identifier: Apache-2.0
/// A panel of fields beside a picture: who fills it knows no window, who draws it no scene.
#pragma once

#include <cstddef>
#include <functional>
#include <glm/vec2.hpp>
#include <memory>
#include <span>
#include <string>

union SDL_Event;
struct SDL_Renderer;

namespace raywave {

/// Fields, one below the other. Each returns whether a person has just changed its value; what is
/// typed counts from Enter on.
class Fields {
public:
  virtual ~Fields() = default;

  virtual void text(const std::string& words) = 0;
  /// The next field stands beside the last one.
  virtual void beside() = 0;
  virtual bool button(const char* name) = 0;
  virtual bool check(const char* name, bool& value) = 0;
  virtual bool choice(const char* name, std::size_t& chosen, std::span<const std::string> of) = 0;
  /// Each is dragged by `step` a pixel, or typed after a double click.
  ///
  /// how  of printf: "%.2f"
  virtual bool numbers(const char* name, std::span<double> values, double step,
                       const char* how) = 0;
  /// Typed after Ctrl and a click, beyond the range, too.
  virtual bool slider(const char* name, double& value, glm::dvec2 range, const char* how) = 0;
};

/// Lays out a panel, as often as it is drawn.
using FillPanel = std::function<void(Fields&)>;

/// At the left of a window.
class SidePanel {
public:
#ifdef RAYWAVE_IMGUI
  static constexpr int width_px = 340;
#else
  static constexpr int width_px = 0;
#endif

  virtual ~SidePanel() = default;

  /// Returns whether an event is meant for the panel, and for nothing behind it.
  virtual bool takes(const SDL_Event& event) = 0;
  /// Over what was drawn.
  virtual void draw() = 0;
};

/// By Dear ImGui, one at a time; null where raywave was built without.
///
/// renderer  of SDL's, which outlives it
std::unique_ptr<SidePanel> side_panel(SDL_Renderer* renderer, FillPanel fill);

}  // namespace raywave
