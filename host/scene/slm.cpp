// SPDX-License-Identifier: Apache-2.0
#include "host/scene/slm.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <complex>
#include <fstream>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numbers>
#include <numeric>
#include <string_view>

#include "host/common/error.hpp"
#include "host/common/npy.hpp"
#include "host/common/text.hpp"

namespace raywave {
namespace {

constexpr double most_crosstalk_px = 3;
constexpr std::uintmax_t most_lut_bytes = 1 << 20;

/// The first word of a line that is no number; empty: there is none. Numbers stand between spaces,
/// commas, semicolons or tabs.
std::string_view read_numbers(std::string_view line, std::vector<double>& numbers) {
  constexpr std::string_view separators = " \t,;\r\"";
  for (line = line.substr(0, line.find('#'));;) {
    const auto first = line.find_first_not_of(separators);
    if (first == std::string_view::npos) return {};
    line.remove_prefix(first);
    const auto word = line.substr(0, line.find_first_of(separators));
    double number = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(number))
      return word;
    numbers.push_back(number);
    line.remove_prefix(word.size());
  }
}

/// Rows of one to three numbers.
using Rows = std::vector<std::vector<double>>;

/// Whether rows have level and number, or level, number and amplitude; all else is a list.
bool is_table(const Rows& rows) {
  if (!rows.empty() && rows[0].size() == 2) return true;
  return rows.size() > 1 && std::all_of(rows.begin(), rows.end(), [](const auto& row) {
           return row.size() == 3 && row[0] == std::floor(row[0]);
         });
}

Rows read_text(const std::filesystem::path& file, const std::string& name) {
  std::ifstream stream(file);
  Rows rows;
  int line_number = 0;
  for (std::string line; std::getline(stream, line);) {
    const std::string where = name + ":" + std::to_string(++line_number);
    if (constexpr std::string_view mark = "\xef\xbb\xbf";
        line_number == 1 && line.starts_with(mark))
      line.erase(0, mark.size());  // of UTF-8, which spreadsheets write
    if (line.find(';') != std::string::npos) std::replace(line.begin(), line.end(), ',', '.');
    std::vector<double> numbers;
    const auto word = read_numbers(line, numbers);
    if (!word.empty() && rows.empty() && numbers.empty()) continue;  // a heading
    if (!word.empty()) throw InputError(where + ": " + in_quotes(word) + " is no number");
    if (numbers.empty()) continue;
    if (!rows.empty() && rows[0].size() == 2 && numbers.size() != 2)
      throw InputError(where + ": two columns expected, level and phase, got " +
                       std::to_string(numbers.size()));
    rows.push_back(std::move(numbers));
  }
  return rows;
}

Lut lut_of_rows(const Rows& rows, int level_count, const std::string& name) {
  Lut lut;
  if (is_table(rows)) return lut_of_table(rows, level_count, name);
  for (const auto& row : rows) lut.values.insert(lut.values.end(), row.begin(), row.end());
  const auto count = lut.values.size();
  if (count < 2 || count > static_cast<std::size_t>(level_count))
    throw InputError(name + ": a LUT has a number for each level, 2 to " +
                     std::to_string(level_count) + " of them, or a line for each with level and " +
                     "number; got " + std::to_string(count) + " numbers");
  return lut;
}

std::string size_text(int width, int height) {
  return std::to_string(width) + " x " + std::to_string(height);
}

}  // namespace

Lut lut_of_table(std::vector<std::vector<double>> rows, int level_count, const std::string& where) {
  std::sort(rows.begin(), rows.end());
  Lut lut;
  for (const auto& row : rows) {
    const double level = row[0];
    if (level != std::floor(level) || level < 0 || level >= level_count)
      throw InputError(where + ": " + number_text(level) + " is no level of 0 to " +
                       std::to_string(level_count - 1));
    if (!lut.levels.empty() && lut.levels.back() == static_cast<int>(level))
      throw InputError(where + ": level " + number_text(level) + " is there twice");
    lut.levels.push_back(static_cast<int>(level));
    lut.values.push_back(row[1]);
    if (row.size() > 2) lut.amplitudes.push_back(row[2]);
  }
  if (lut.levels.size() < 2) throw InputError(where + ": a LUT has two levels or more");
  return lut;
}

Lut load_lut(const std::filesystem::path& file, int level_count) {
  const std::string name = one_line(file.string());
  std::error_code error;
  if (std::filesystem::file_size(file, error) > most_lut_bytes || error)
    throw InputError(name + ": too large for a LUT (at most 1 MiB)");
  return lut_of_rows(extension_of(file) == ".npy" ? load_npy_rows(file) : read_text(file, name),
                     level_count, name);
}

std::vector<double> shown_by_level(const Lut& lut, const std::vector<double>& listed,
                                   int level_count) {
  std::vector<double> shown;
  const auto count = listed.size();
  const auto level_of = [&](std::size_t i) {
    return lut.levels.empty() ? static_cast<int>(i) : lut.levels[i];
  };
  std::size_t next = 0;  // the first that is listed from here on
  for (int level = 0; level < level_count; ++level) {
    while (next < count && level_of(next) < level) ++next;
    const auto before = next == 0 ? 0 : next - 1, after = std::min(next, count - 1);
    const int step = level_of(after) - level_of(before);
    const double share = step == 0 ? 0 : static_cast<double>(level - level_of(before)) / step;
    shown.push_back(listed[before] + share * (listed[after] - listed[before]));
  }
  return shown;
}

LevelValues values_of_levels(const SlmSpec& slm) {
  const bool amplitude = shows_amplitude(slm.encoding);
  const int grey_levels = grey_levels_of(slm);
  const bool has_lut = !slm.lut.values.empty();
  LevelValues values;
  for (int level = 0; level < grey_levels && !has_lut; ++level) {
    const double turns = static_cast<double>(level) / slm.levels_per_turn;
    values.shown.push_back(amplitude ? level / (grey_levels - 1.0) : slm.invert ? -turns : turns);
  }
  if (has_lut) values.shown = shown_by_level(slm.lut, slm.lut.values, grey_levels);
  if (!slm.lut.amplitudes.empty())
    values.amplitudes = shown_by_level(slm.lut, slm.lut.amplitudes, grey_levels);
  values.used = slm.lut.levels;
  if (values.used.empty()) {
    values.used.resize(has_lut ? slm.lut.values.size() : values.shown.size());
    std::iota(values.used.begin(), values.used.end(), 0);
  }
  return values;
}

std::complex<double> LevelValues::state(int level) const {
  const auto i = static_cast<std::size_t>(level);
  return std::polar(amplitudes.empty() ? 1.0 : amplitudes[i], 2 * std::numbers::pi * shown[i]);
}

int LevelValues::nearest_to_phase(double turns) const {
  double mean = 0;
  if (!amplitudes.empty())
    for (const int level : used)
      mean += amplitudes[static_cast<std::size_t>(level)] / static_cast<double>(used.size());
  // Of one amplitude the nearest phase on the circle is the nearest state, and rounds less
  const auto away = [&](int level) {
    const double off = shown[static_cast<std::size_t>(level)] - turns;
    return amplitudes.empty()
               ? std::abs(off - std::round(off))
               : std::abs(state(level) - std::polar(mean, 2 * std::numbers::pi * turns));
  };
  return *std::min_element(used.begin(), used.end(),
                           [&](int a, int b) { return away(a) < away(b); });
}

bool adds_to_phases(const SlmSpec& slm) {
  return slm.undiffracted > 0 || slm.crosstalk.any() || !values_of_levels(slm).amplitudes.empty();
}

double wanted_share_of_levels(const SlmSpec& slm) {
  if (shows_amplitude(slm.encoding)) return 1;
  const auto values = values_of_levels(slm);
  const bool is_even = slm.levels < grey_levels_of(slm);
  constexpr int phases = 720;
  std::complex<double> sum = 0;
  double left = 0;  // of the light
  for (int i = 0; i < phases; ++i) {
    const double turns = (i + 0.5) / phases,
                 wanted = is_even ? std::round(turns * slm.levels) / slm.levels : turns;
    const auto state = values.state(values.nearest_to_phase(wanted));
    sum += state * std::polar(1.0, -2 * std::numbers::pi * turns);
    left += std::norm(state);
  }
  return left > 0 ? std::norm(sum) / (left * phases) : 0;
}

double make_monotone(std::vector<double>& values) {
  const double sign = values.back() < values.front() ? -1 : 1;
  struct Block {
    double sum = 0;
    std::size_t count = 0;
    double mean() const { return sum / static_cast<double>(count); }
  };
  std::vector<Block> blocks;  // neighbours that turn back get their mean
  for (const double value : values) {
    Block block{sign * value, 1};
    for (; !blocks.empty() && blocks.back().mean() > block.mean(); blocks.pop_back())
      block = {block.sum + blocks.back().sum, block.count + blocks.back().count};
    blocks.push_back(block);
  }
  double largest = 0;
  auto at = values.begin();
  for (const auto& block : blocks) {
    if (block.count == 1) {
      ++at;
      continue;
    }
    for (std::size_t i = 0; i < block.count; ++i, ++at) {
      largest = std::max(largest, std::abs(*at - sign * block.mean()));
      *at = sign * block.mean();
    }
  }
  return largest;
}

double Illumination::turns(glm::dvec2 at_m, double wavelength_m) const {
  if (!focus_m) return glm::dot(sine, at_m) / wavelength_m;
  // The differences of squared distances over their sum: nothing large is subtracted.
  const glm::dvec2 focus = *focus_m * sine;
  const double to_middle = std::abs(*focus_m),
               from_there = std::sqrt(std::max(
                   0.0, to_middle * to_middle + glm::dot(at_m, at_m) - 2 * glm::dot(at_m, focus))),
               longer =
                   (glm::dot(at_m, at_m) - 2 * glm::dot(at_m, focus)) / (from_there + to_middle);
  return (*focus_m > 0 ? -longer : longer) / wavelength_m;
}

glm::dvec2 Illumination::curvature_per_m() const {
  return focus_m ? (1.0 - sine * sine) / *focus_m : glm::dvec2(0);
}

std::vector<float> amplitudes_of(const BeamProfile& profile, glm::ivec2 size_px,
                                 glm::dvec2 pitch_m) {
  if (profile.is_even()) return {};
  std::vector<float> amplitudes(std::size_t{1} * size_px.x * size_px.y);
  const Image* picture = profile.picture.get();
  double sum = 0;
  for (int y = 0; y < size_px.y; ++y) {
    for (int x = 0; x < size_px.x; ++x) {
      const glm::dvec2 share((x + 0.5) / size_px.x, (y + 0.5) / size_px.y);
      double value = 0;
      if (picture) {
        // Between the middles of the picture's pixels on straight lines
        const glm::dvec2 last(picture->width - 1, picture->height - 1),
            at = glm::clamp(share * (last + 1.0) - 0.5, glm::dvec2(0), last);
        const glm::ivec2 low(at), high = glm::min(low + 1, glm::ivec2(last));
        const auto pixel = [&](int i, int j) {
          return double{picture->pixels[std::size_t{1} * j * picture->width + i]};
        };
        const glm::dvec2 t = at - glm::dvec2(low);
        const double above = pixel(low.x, low.y) * (1 - t.x) + pixel(high.x, low.y) * t.x,
                     below = pixel(low.x, high.y) * (1 - t.x) + pixel(high.x, high.y) * t.x;
        value = std::sqrt(above * (1 - t.y) + below * t.y);
      } else {
        // exp(-2 r^2 / w^2) of the intensity, w half the diameter
        const auto r = (share - 0.5) * glm::dvec2(size_px) * pitch_m / (profile.diameter_m / 2.0);
        value = std::exp(-glm::dot(r, r));
      }
      amplitudes[std::size_t{1} * y * size_px.x + x] = static_cast<float>(value);
      sum += value * value;
    }
  }
  const double root = std::sqrt(sum / static_cast<double>(amplitudes.size()));
  if (!(root > 0))
    throw InputError(profile.where + " leaves the hologram dark; give a wider or brighter one");
  for (float& a : amplitudes) a = static_cast<float>(double{a} / root);
  return amplitudes;
}

double darkest_of(const BeamProfile& profile, glm::ivec2 size_px, glm::dvec2 pitch_m) {
  if (profile.is_even()) return 1;
  // Beams are smooth: as many places tell it
  const auto places = glm::min(size_px, glm::ivec2(512));
  const auto beam =
      amplitudes_of(profile, places, pitch_m * glm::dvec2(size_px) / glm::dvec2(places));
  const double least = *std::min_element(beam.begin(), beam.end());
  return least * least;
}

double amplitude_of_pixel(double fill, double cycles_per_pixel) {
  const double t = std::numbers::pi * fill * cycles_per_pixel;
  return fill * (t == 0 ? 1 : std::sin(t) / t);
}

Crosstalk kernel_of(const Crosstalk& crosstalk, glm::dvec2 pitch_m) {
  if (!(crosstalk.sigma_m > 0)) return crosstalk;
  // What pixels are told is a step function, whose blur is looked at in the middle of a pixel
  const auto along = [&](int axis) {
    if (crosstalk.sigma_m > most_crosstalk_px * pitch_m[axis])
      throw InputError("slm.crosstalk: " + length_text(crosstalk.sigma_m) + " is more than " +
                       number_text(most_crosstalk_px) + " pixels of " + length_text(pitch_m[axis]) +
                       ": such a panel shows no hologram");
    const double width = crosstalk.sigma_m / pitch_m[axis] * std::numbers::sqrt2;
    std::vector<double> weights;
    const int reach = static_cast<int>(std::ceil(4 * crosstalk.sigma_m / pitch_m[axis]));
    for (int i = -reach; i <= reach; ++i)
      weights.push_back((std::erf((i + 0.5) / width) - std::erf((i - 0.5) / width)) / 2);
    return weights;
  };
  const auto across = along(0), down = along(1);
  Crosstalk kernel;
  kernel.size = {static_cast<int>(across.size()), static_cast<int>(down.size())};
  for (const double v : down)
    for (const double u : across) kernel.weights.push_back(u * v);
  const double sum = std::accumulate(kernel.weights.begin(), kernel.weights.end(), 0.0);
  for (double& w : kernel.weights) w /= sum;
  return kernel;
}

SourceSpread source_spread(const SlmSpec& slm, glm::dvec2 pitch_m, double wavelength_m) {
  const auto& light = slm.illumination;
  SourceSpread spread{light.source_size_rad, light.bandwidth_m, {}, {}};
  if (!(spread.bandwidth_m > 0)) return spread;
  spread.per_m = carrier_of(slm, pitch_m, wavelength_m) / pitch_m +
                 own_carrier_of(slm.encoding) / pitch_m - light.sine / wavelength_m;
  spread.per_m2 = light.curvature_per_m() / (2 * wavelength_m);
  if (slm.lens_m) spread.per_m2 -= 1 / (2 * wavelength_m * *slm.lens_m);
  return spread;
}

glm::dvec2 carrier_of(const SlmSpec& slm, glm::dvec2 pitch_m, double wavelength_m) {
  if (slm.shift_m == glm::dvec2(0)) return slm.carrier;
  // Light of direction cosine s along x advances by s pitch / wavelength per pixel. It comes from
  // behind the SLM: what moves the picture to +x in the plane z > 0 turns the light towards -x.
  const double distance_m = std::copysign(
      std::hypot(slm.shift_m.x, slm.shift_m.y, slm.shift_distance_m), slm.shift_distance_m);
  const auto carrier = -slm.shift_m / distance_m * pitch_m / wavelength_m;
  if (std::max(std::abs(carrier.x), std::abs(carrier.y)) > 0.5)
    throw InputError("slm.shift: " + length_text(slm.shift_m.x) + ", " +
                     length_text(slm.shift_m.y) + " at " + length_text(slm.shift_distance_m) +
                     " needs a carrier of " + number_text(carrier.x) + ", " +
                     number_text(carrier.y) + " cycles per pixel, and pixels of " +
                     length_text(std::max(pitch_m.x, pitch_m.y)) +
                     " show at most 0.5; give a smaller shift, or hologram.pitch");
  return carrier;
}

glm::dvec2 own_carrier_of(Encoding encoding) {
  return encoding == Encoding::burckhardt ? glm::dvec2(-1.0 / 3, 0) : glm::dvec2(0);
}

void require_fit(const FlatnessSpec& flatness, glm::ivec2 size_px) {
  const auto& picture = flatness.picture;
  if (picture.pixels.empty() || flatness.centre ||
      (picture.width == size_px.x && picture.height == size_px.y))
    return;
  throw InputError(flatness.where + ": the picture is " + size_text(picture.width, picture.height) +
                   ", the SLM " + size_text(size_px.x, size_px.y) +
                   "; give flatness_fit = \"centre\" to crop or pad it around its middle");
}

}  // namespace raywave
