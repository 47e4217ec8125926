// SPDX-License-Identifier: Apache-2.0
#include "host/encode/shown.hpp"

#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "host/common/error.hpp"
#include "host/common/plane_fft.hpp"
#include "host/common/threads.hpp"

namespace raywave {
namespace {

/// Whether the frequency of place i of n, in cycles per sample, lies in the band.
std::vector<bool> kept(int n, double size, double centre) {
  std::vector<bool> kept;
  for (int i = 0; i < n; ++i) {
    const double away = static_cast<double>(i) / n - centre;
    kept.push_back(std::abs(away - std::round(away)) <= size / 2);
  }
  return kept;
}

/// Transforms each line, leaves out what is not kept, and transforms back.
/// step  between the samples of a line; next  between the beginnings of lines
void filter_lines(std::span<std::complex<float>> plane, std::size_t count, std::size_t next,
                  std::size_t size, std::size_t step, const std::vector<bool>& kept) {
  const LineFft fft(size, false);
  auto& threads = cl::Threads::shared();
  std::vector<Lines> lines, spectra;
  for (std::size_t thread = 0; thread < threads.count(); ++thread) {
    lines.push_back(make_lines(size, "line of a hologram"));
    spectra.push_back(make_lines(size, "spectrum of a line"));
  }
  const float scale = 1.0f / static_cast<float>(size);
  threads.for_each(threads.count(), count, 16, [&](std::size_t thread, std::size_t i) {
    auto* line = lines[thread].get();
    auto* spectrum = spectra[thread].get();
    auto* first = plane.data() + i * next;
    for (std::size_t k = 0; k < size; ++k) line[k] = first[k * step];
    fft.forward(line, spectrum);
    for (std::size_t k = 0; k < size; ++k) spectrum[k] *= kept[k] ? scale : 0.0f;
    fft.inverse(spectrum, line);
    for (std::size_t k = 0; k < size; ++k) first[k * step] = line[k];
  });
}

/// shown_field for levels of either type.
template <class Level>
FieldStack shown_by(const Panel& panel, std::span<const std::vector<Level>> levels) {
  const auto size = panel.size_px();
  const auto pixels = std::size_t{1} * size.x * size.y;
  require_level_bytes(panel.slm(), sizeof(Level));
  std::vector<std::complex<double>> light(std::size_t{std::numeric_limits<Level>::max()} + 1);
  for (int level = 0; level < grey_levels_of(panel.slm()); ++level)
    light[level] = panel.shown(static_cast<std::size_t>(level));
  const auto& added = panel.added();
  const auto own = panel.own_carrier();
  const bool is_turned = !added.empty() || own != glm::dvec2(0);
  const auto& stop = panel.slm().stop;
  // Light that is not modulated passes the stop's plane in one point, however it falls onto the SLM
  const bool is_tilted = stop && !panel.slm().illumination.is_plane();

  FieldStack field{size.x, size.y, static_cast<int>(levels.size()), {}};
  field.samples.resize(pixels * levels.size());
  for (std::size_t frame = 0; frame < levels.size(); ++frame) {
    if (levels[frame].size() != pixels)
      throw InputError("the SLM has " + std::to_string(size.x) + " x " + std::to_string(size.y) +
                       " pixels, a picture for it " + std::to_string(levels[frame].size()));
    const auto plane = std::span(field.samples).subspan(frame * pixels, pixels);
    auto& threads = cl::Threads::shared();
    const auto light_turns = [&](std::size_t i) {
      return panel.light_turns(static_cast<int>(i % size.x), static_cast<int>(i / size.x));
    };
    threads.for_ranges(pixels, [&](std::size_t, std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) {
        auto value = light[levels[frame][i]];
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
  if (size.x < 1) filter_lines(plane, ny, nx, nx, 1, kept(plane_size.x, size.x, centre.x));
  // Rows run downwards, y upwards
  if (size.y < 1) filter_lines(plane, nx, 1, ny, nx, kept(plane_size.y, size.y, -centre.y));
}

FieldStack shown_field(const Panel& panel, std::span<const std::vector<std::uint8_t>> levels) {
  return shown_by(panel, levels);
}

FieldStack shown_field(const Panel& panel, std::span<const std::vector<std::uint16_t>> levels) {
  return shown_by(panel, levels);
}

}  // namespace raywave
