// SPDX-License-Identifier: Apache-2.0
#include "host/display/display.hpp"

#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <ctime>

#include "host/common/error.hpp"
#include "host/common/text.hpp"

namespace raywave {

std::unique_ptr<Display> display_by(const std::string& backend) {
  if (!backend.empty() && backend != "window" && backend != "kms")
    throw InputError("backend " + in_quotes(backend) + ": unknown; there are window and kms");
  const bool has_desktop = std::getenv("DISPLAY") || std::getenv("WAYLAND_DISPLAY");
  return backend == "window" || (backend.empty() && has_desktop) ? window_display() : kms_display();
}

std::string size_text(glm::ivec2 size_px) {
  return std::to_string(size_px.x) + " x " + std::to_string(size_px.y);
}

std::string text_of(const DisplayOutput& output) {
  auto text = one_line(output.name) + ", " + size_text(output.size_px);
  if (output.rate_hz > 0) text += format(" at %.4g Hz", output.rate_hz);
  if (output.edid) text += ", " + one_line(output.edid->id());
  if (output.edid && !output.edid->name.empty()) text += " (" + one_line(output.edid->name) + ")";
  return text;
}

const DisplayOutput& find_output(const std::vector<DisplayOutput>& all, const std::string& name) {
  std::string names;
  const DisplayOutput* found = nullptr;
  int count = 0;
  for (const auto& output : all) {
    names += (names.empty() ? "" : "; ") + text_of(output);
    const auto id = output.edid ? output.edid->id() : "";
    if (!name.empty() && name != output.name && name != id && !id.starts_with(name + "-")) continue;
    found = &output;
    ++count;
  }
  if (all.empty()) throw DeviceError("no output is connected");
  if (count == 1) return *found;
  throw InputError("--output" +
                   (name.empty()
                        ? ": one of several is needed"
                        : " " + in_quotes(name) +
                              (count == 0 ? ": there is no such output" : ": several are meant")) +
                   "; there are: " + names);
}

bool is_rate(double rate_hz, double wanted_hz) {
  return std::abs(rate_hz - wanted_hz) <= 0.005 * wanted_hz;
}

void fill_row(const LevelFrame& frame, int y, std::uint32_t* pixels) {
  const auto width = static_cast<std::size_t>(frame.size_px.x);
  const auto* level = frame.levels.data() + static_cast<std::size_t>(y * frame.channels) * width;
  if (frame.channels == 1)
    for (std::size_t x = 0; x < width; ++x) pixels[x] = level[x] * 0x010101u;
  else
    for (std::size_t x = 0; x < width; ++x, level += 3)
      pixels[x] = level[0] * 0x10000u + level[1] * 0x100u + level[2];
}

double now_s() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

void sleep_until(double time_s) {
  const double whole = std::floor(time_s);
  const timespec end{static_cast<time_t>(whole), static_cast<long>(1e9 * (time_s - whole))};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &end, nullptr) == EINTR) {
  }
}

}  // namespace raywave
