// SPDX-License-Identifier: Apache-2.0
#include "host/encode/shown.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "host/common/error.hpp"
#include "host/common/plane_fft.hpp"
#include "host/common/threads.hpp"
#include "host/plan/message_text.hpp"

namespace raywave {
namespace {

/// What is kept of the frequency of place i of n, times 1 / n, by its distance from the centre in
/// cycles per sample, -0.5 to 0.5.
std::vector<float> kept(int n, double centre, const auto& share) {
  std::vector<float> kept;
  for (int i = 0; i < n; ++i) {
    const double away = static_cast<double>(i) / n - centre;
    kept.push_back(1.0f / static_cast<float>(n) *
                   static_cast<float>(share(away - std::round(away))));
  }
  return kept;
}

std::vector<float> kept_in_band(int n, double size, double centre) {
  return kept(n, centre, [&](double away) { return std::abs(away) <= size / 2 ? 1 : 0; });
}

/// The transform of a pixel that shines over `width` of its pitch, in the order around the carrier.
std::vector<float> kept_by_pixel(int n, double width, double carrier) {
  return kept(n, carrier, [&](double away) { return amplitude_of_pixel(width, carrier + away); });
}

/// Transforms each line, multiplies what is kept, and transforms back.
/// step  between the samples of a line; next  between the beginnings of lines
void filter_lines(std::span<std::complex<float>> plane, std::size_t count, std::size_t next,
                  std::size_t size, std::size_t step, const std::vector<float>& kept) {
  const LineFft fft(size, false);
  auto& threads = cl::Threads::shared();
  std::vector<Lines> lines, spectra;
  for (std::size_t thread = 0; thread < threads.count(); ++thread) {
    lines.push_back(make_lines(size, "line of a hologram"));
    spectra.push_back(make_lines(size, "spectrum of a line"));
  }
  threads.for_each(threads.count(), count, 16, [&](std::size_t thread, std::size_t i) {
    auto* line = lines[thread].get();
    auto* spectrum = spectra[thread].get();
    auto* first = plane.data() + i * next;
    for (std::size_t k = 0; k < size; ++k) line[k] = first[k * step];
    fft.forward(line, spectrum);
    for (std::size_t k = 0; k < size; ++k) spectrum[k] *= kept[k];
    fft.inverse(spectrum, line);
    for (std::size_t k = 0; k < size; ++k) first[k * step] = line[k];
  });
}

/// Light of pixels that are no points, in the order around the carrier.
void show_pixels(std::span<std::complex<float>> plane, glm::ivec2 size, glm::dvec2 fill,
                 glm::dvec2 carrier) {
  const auto nx = static_cast<std::size_t>(size.x), ny = static_cast<std::size_t>(size.y);
  filter_lines(plane, ny, nx, nx, 1, kept_by_pixel(size.x, fill.x, carrier.x));
  filter_lines(plane, nx, 1, ny, nx, kept_by_pixel(size.y, fill.y, -carrier.y));
}

/// The light of pixels that take over some of what their neighbours are told; at the edge that is
/// what the last pixel is told.
template <class Level>
void blur_states(const Panel& panel, const std::vector<Level>& levels,
                 std::span<std::complex<float>> plane) {
  const auto size = panel.size_px();
  const auto& kernel = panel.crosstalk();
  const auto reach = kernel.size / 2;
  const auto& values = panel.values();
  const bool is_amplitude = shows_amplitude(panel.slm().encoding);
  auto& threads = cl::Threads::shared();
  threads.for_each(
      threads.count(), static_cast<std::size_t>(size.y), 8, [&](std::size_t, std::size_t row) {
        for (int x = 0; x < size.x; ++x) {
          double shown = 0, amplitude = 0;
          auto weight = kernel.weights.begin();
          for (int j = -reach.y; j <= reach.y; ++j) {
            const auto y = std::clamp(static_cast<int>(row) + j, 0, size.y - 1);
            for (int i = -reach.x; i <= reach.x; ++i, ++weight) {
              const auto level = static_cast<std::size_t>(
                  levels[std::size_t{1} * y * size.x + std::clamp(x + i, 0, size.x - 1)]);
              shown += *weight * values.shown[level];
              if (!values.amplitudes.empty()) amplitude += *weight * values.amplitudes[level];
            }
          }
          if (values.amplitudes.empty()) amplitude = 1;
          plane[row * size.x + x] = std::complex<float>(
              is_amplitude ? shown : std::polar(amplitude, 2 * std::numbers::pi * shown));
        }
      });
}

/// shown_field for levels of either type.
template <class Level>
FieldStack shown_by(const Panel& panel, std::span<const std::vector<Level>> levels,
                    FieldStack field = {}) {
  const auto size = panel.size_px();
  const auto pixels = std::size_t{1} * size.x * size.y;
  require_level_bytes(panel.slm(), sizeof(Level));
  std::vector<std::complex<double>> light(std::size_t{std::numeric_limits<Level>::max()} + 1);
  for (int level = 0; level < grey_levels_of(panel.slm()); ++level)
    light[level] = panel.shown(static_cast<std::size_t>(level));
  const std::vector<std::complex<float>> rounded(light.begin(), light.end());
  const auto& added = panel.added();
  const auto own = panel.own_carrier();
  const bool is_turned = !added.empty() || own != glm::dvec2(0);
  const auto& stop = panel.slm().stop;
  // Light that is not modulated passes the stop's plane in one point, however it falls onto the SLM
  const bool is_tilted = stop && !panel.slm().illumination.is_plane();

  const auto& slm = panel.slm();
  const double modulated = std::sqrt(1 - slm.undiffracted), plain = std::sqrt(slm.undiffracted);
  const auto& beam = panel.beam();
  const bool has_crosstalk = !panel.crosstalk().weights.empty();
  const bool is_ideal = !has_crosstalk && !slm.fill && plain == 0 && beam.empty() && !is_turned;

  field.nx = size.x;
  field.ny = size.y;
  field.frames = static_cast<int>(levels.size());
  field.source = panel.source();
  field.samples.resize(pixels * levels.size());
  for (std::size_t frame = 0; frame < levels.size(); ++frame) {
    if (levels[frame].size() != pixels)
      throw InputError("the SLM has " + extent_text(size) + " pixels, a picture for it " +
                       std::to_string(levels[frame].size()));
    const auto plane = std::span(field.samples).subspan(frame * pixels, pixels);
    auto& threads = cl::Threads::shared();
    const auto light_turns = [&](std::size_t i) {
      return panel.light_turns(static_cast<int>(i % size.x), static_cast<int>(i / size.x));
    };
    if (has_crosstalk) blur_states(panel, levels[frame], plane);
    if (slm.fill) {
      if (!has_crosstalk)
        for (std::size_t i = 0; i < pixels; ++i) plane[i] = rounded[levels[frame][i]];
      show_pixels(plane, size, *slm.fill, panel.carrier());
    }
    threads.for_ranges(pixels, [&](std::size_t, std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last && is_ideal; ++i) plane[i] = rounded[levels[frame][i]];
      for (std::size_t i = first; i < last && !is_ideal; ++i) {
        auto value =
            has_crosstalk || slm.fill ? std::complex<double>(plane[i]) : light[levels[frame][i]];
        if (plain > 0) value = modulated * value + plain;
        if (!beam.empty()) value *= double{beam[i]};
        if (is_turned) {
          double turns = added.empty() ? 0 : added[i] / 65536.0;
          turns +=
              own.x * static_cast<double>(i % size.x) - own.y * static_cast<double>(i / size.x);
          if (is_tilted) turns += light_turns(i);
          value *= std::polar(1.0, -2 * std::numbers::pi * turns);
        }
        plane[i] = std::complex<float>(value);
      }
    });
    if (stop) keep_band(plane, size, stop->size, stop->centre);
    if (!is_tilted) continue;
    threads.for_ranges(pixels, [&](std::size_t, std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i)
        plane[i] *= std::complex<float>(std::polar(1.0, 2 * std::numbers::pi * light_turns(i)));
    });
  }
  return field;
}

}  // namespace

void keep_band(std::span<std::complex<float>> plane, glm::ivec2 plane_size, glm::dvec2 size,
               glm::dvec2 centre) {
  const auto nx = static_cast<std::size_t>(plane_size.x),
             ny = static_cast<std::size_t>(plane_size.y);
  if (size.x < 1) filter_lines(plane, ny, nx, nx, 1, kept_in_band(plane_size.x, size.x, centre.x));
  // Rows run downwards, y upwards
  if (size.y < 1) filter_lines(plane, nx, 1, ny, nx, kept_in_band(plane_size.y, size.y, -centre.y));
}

FieldStack shown_field(const Panel& panel, std::span<const std::vector<std::uint8_t>> levels,
                       FieldStack memory) {
  return shown_by(panel, levels, std::move(memory));
}

FieldStack shown_field(const Panel& panel, std::span<const std::vector<std::uint16_t>> levels) {
  return shown_by(panel, levels);
}

}  // namespace raywave
