// SPDX-License-Identifier: Apache-2.0
/// An SLM as an output of this computer: what sends it frames, and knows what became of each.
#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "host/common/json.hpp"
#include "host/display/edid.hpp"

namespace raywave {

/// A frame as the SLM is sent it, rows from the top.
struct LevelFrame {
  glm::ivec2 size_px{0, 0};
  int channels = 1;  // 1: a level for red, green and blue; 3: one of each
  std::vector<std::uint8_t> levels;
  std::string name, laser;  // for reports; of one laser, where they take turns: "638nm"
};

struct DisplayOutput {
  std::string name;  // "HDMI-A-1"
  glm::ivec2 place_px{0, 0}, size_px{0, 0};
  double rate_hz = 0;  // refreshes a second; 0: not known
  std::optional<Edid> edid;
};

/// What frames need of an output.
struct WantedOutput {
  std::string name;  // or Edid::id; empty: the only one
  glm::ivec2 size_px{0, 0};
  double rate_hz = 0;       // 0: any
  bool reads_back = false;  // each frame, not only the first
};

struct Flip {
  std::uint64_t refresh = 0;  // of the output, that the frame was new at; the first one's is 0
  double time_s = 0;          // of the monotonic clock
  double asked_s = 0;         // when the frame was handed over
};

/// The verbs are called in the order in which they stand here; flip and event in turn.
class Display {
public:
  virtual ~Display() = default;

  /// Outputs that are on, or could be.
  virtual std::vector<DisplayOutput> list() = 0;
  /// Takes an output, which then shows level 0. Returns it as it is now, with a rate.
  ///
  /// throws  InputError where it is not as wanted, with what mends it; DeviceError where it cannot
  ///         be had
  virtual DisplayOutput open(const WantedOutput& wanted) = 0;
  /// Hands a frame over, to be new at this refresh or the next that can be met. Waits until it may.
  ///
  /// throws  DeviceError when the output is gone
  virtual void flip(const LevelFrame& frame, std::uint64_t refresh) = 0;
  /// Waits until that frame is shown, as far as the display knows.
  virtual Flip event() = 0;
  /// Leaves the output as it was. May be called at any time, and again.
  virtual void close() noexcept = 0;
  /// For reports: what shows, and which proof there is that frames arrived.
  virtual Json describe() const = 0;
};

/// In a window over the whole output, by SDL; or through the kernel, without a desktop, by libdrm.
///
/// throws  InputError that says what to install where raywave was built without, or it is missing
std::unique_ptr<Display> window_display();
std::unique_ptr<Display> kms_display();

/// One of these by its name; empty: in a window where there is a desktop.
///
/// throws  InputError as they do, and for another name
std::unique_ptr<Display> display_by(const std::string& backend);

/// The output that is named by its name, by Edid::id or the beginning of that.
///
/// throws  InputError that lists what there is
const DisplayOutput& find_output(const std::vector<DisplayOutput>& all, const std::string& name);

/// "HDMI-A-1, 1920 x 1080 at 60 Hz, HOL-6013-00123"
std::string text_of(const DisplayOutput& output);

/// "1920 x 1080"
std::string size_text(glm::ivec2 size_px);

/// Whether an output's rate is the wanted one: those of films and NTSC are 0.1 % apart.
bool is_rate(double rate_hz, double wanted_hz);

/// A row of a frame as pixels of 32 bits: 0x00RRGGBB.
void fill_row(const LevelFrame& frame, int y, std::uint32_t* pixels);

/// Seconds of the monotonic clock.
double now_s();
void sleep_until(double time_s);

}  // namespace raywave
