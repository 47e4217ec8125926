// SPDX-License-Identifier: Apache-2.0
#include "host/encode/panel.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "host/common/error.hpp"
#include "host/common/threads.hpp"

namespace raywave {
namespace {

constexpr double units_per_turn = 65536;

double factorial(int n) {
  double product = 1;
  for (int i = 2; i <= n; ++i) product *= i;
  return product;
}

template <class Level>
void flip(LevelPictureOf<Level>& picture, bool x, bool y) {
  const auto nx = static_cast<std::ptrdiff_t>(picture.size_px.x);
  auto& levels = picture.levels;
  if (x)
    for (auto row = levels.begin(); row != levels.end(); row += nx) std::reverse(row, row + nx);
  if (y)
    for (auto top = levels.begin(), bottom = levels.end() - nx; top < bottom;
         top += nx, bottom -= nx)
      std::swap_ranges(top, top + nx, bottom);
}

/// A quarter turn counterclockwise.
template <class Level>
LevelPictureOf<Level> turned(const LevelPictureOf<Level>& picture) {
  const auto [nx, ny] = std::pair(picture.size_px.x, picture.size_px.y);
  LevelPictureOf<Level> result{{ny, nx}, {}};
  result.levels.reserve(picture.levels.size());
  for (int row = 0; row < nx; ++row)
    for (int column = 0; column < ny; ++column)
      result.levels.push_back(picture.levels[std::size_t{1} * column * nx + (nx - 1 - row)]);
  return result;
}

}  // namespace

template <class Level>
LevelPictureOf<Level> for_slm(LevelPictureOf<Level> picture, const SlmSpec& slm) {
  for (int turns = 0; turns < slm.rotate_deg / 90; ++turns) picture = turned(picture);
  flip(picture, slm.flip_x, slm.flip_y);
  return picture;
}

template <class Level>
LevelPictureOf<Level> from_slm(LevelPictureOf<Level> picture, const SlmSpec& slm) {
  flip(picture, slm.flip_x, slm.flip_y);
  for (int turns = slm.rotate_deg / 90; turns % 4 != 0; ++turns) picture = turned(picture);
  return picture;
}

void require_level_bytes(const SlmSpec& slm, std::size_t bytes) {
  if (bytes == (slm.bits > 8 ? 2 : 1)) return;
  throw InputError("slm.bits is " + std::to_string(slm.bits) +
                   ": this takes levels of 8 bits; encode, pattern and reconstruct take 10");
}

template LevelPictureOf<std::uint8_t> for_slm(LevelPictureOf<std::uint8_t>, const SlmSpec&);
template LevelPictureOf<std::uint16_t> for_slm(LevelPictureOf<std::uint16_t>, const SlmSpec&);
template LevelPictureOf<std::uint8_t> from_slm(LevelPictureOf<std::uint8_t>, const SlmSpec&);
template LevelPictureOf<std::uint16_t> from_slm(LevelPictureOf<std::uint16_t>, const SlmSpec&);

double zernike(int noll, double x, double y) {
  // Noll counts by radial degree n; within one, by azimuthal degree m, even indices the cosines.
  int n = 0, first = 1;
  while (first + n < noll) first += ++n;
  const int place = noll - first;
  const int m = n % 2 == 0 ? 2 * ((place + 1) / 2) : 2 * (place / 2) + 1;
  const double r = std::hypot(x, y), angle = std::atan2(y, x);
  double radial = 0;
  for (int s = 0; s <= (n - m) / 2; ++s)
    radial += (s % 2 == 0 ? 1 : -1) * factorial(n - s) /
              (factorial(s) * factorial((n + m) / 2 - s) * factorial((n - m) / 2 - s)) *
              std::pow(r, n - 2 * s);
  if (m == 0) return std::sqrt(n + 1.0) * radial;
  return std::sqrt(2.0 * (n + 1)) * radial *
         (noll % 2 == 0 ? std::cos(m * angle) : std::sin(m * angle));
}

Panel::Panel(const SlmSpec& slm, glm::ivec2 size_px, glm::dvec2 pitch_m, double wavelength_m,
             const std::optional<PanelPart>& part)
    : slm_(slm),
      size_(size_px),
      part_(part.value_or(PanelPart{size_px, {0, 0}})),
      pitch_m_(pitch_m),
      wavelength_m_(wavelength_m) {
  const auto& profile = slm_.illumination.profile;
  if (part && !profile.is_even())
    throw InputError(profile.where + ": how bright it is on parts of a hologram is not known");
  // Who has no plan has no scene that might fill the band.
  if (slm_.encoding == Encoding::automatic) slm_.encoding = Encoding::double_phase;
  make_levels();
  make_added();
  beam_ = amplitudes_of(profile, size_, pitch_m_);
  crosstalk_ = kernel_of(slm_.crosstalk, pitch_m_);
}

void Panel::make_levels() {
  const bool amplitude = shows_amplitude(slm_.encoding);
  const int grey_levels = grey_levels_of(slm_);
  const bool has_lut = !slm_.lut.values.empty();
  values_ = values_of_levels(slm_);
  for (int level = 0; level < grey_levels; ++level)
    shown_.push_back(amplitude ? values_.shown[static_cast<std::size_t>(level)]
                               : values_.state(level));

  const bool proportional =
      !has_lut && slm_.levels == grey_levels && (amplitude || slm_.levels_per_turn <= grey_levels);
  if (proportional || slm_.encoding == Encoding::lee) return;
  for (int i = 0; i < table_size; ++i) {
    if (amplitude) {
      const double steps = slm_.levels - 1;
      const double wanted = std::round(i / (table_size - 1.0) * steps) / steps;
      const auto away = [&](int level) {
        return std::abs(values_.shown[static_cast<std::size_t>(level)] - wanted);
      };
      level_table_.push_back(static_cast<std::uint16_t>(*std::ranges::min_element(
          values_.used, [&](int a, int b) { return away(a) < away(b); })));
    } else {
      const double steps = slm_.levels;
      const double wanted = slm_.levels == grey_levels
                                ? static_cast<double>(i) / table_size
                                : std::round(static_cast<double>(i) / table_size * steps) / steps;
      level_table_.push_back(static_cast<std::uint16_t>(values_.nearest_to_phase(wanted)));
    }
  }
}

double Panel::light_turns(int x, int y) const {
  const auto of_whole = glm::ivec2(x, y) + part_.first_px;
  const glm::dvec2 off_middle(of_whole.x - (part_.whole_px.x - 1) / 2.0,
                              (part_.whole_px.y - 1) / 2.0 - of_whole.y);
  return slm_.illumination.turns(off_middle * pitch_m_, wavelength_m_);
}

void Panel::make_added() {
  const auto carrier = carrier_of(slm_, pitch_m_, wavelength_m_);
  const auto& flatness = slm_.flatness;
  const auto& picture = flatness.picture;
  const bool is_flat = picture.pixels.empty();
  const auto whole = part_.whole_px;
  require_fit(flatness, whole);
  if (is_flat && slm_.zernike.empty() && !slm_.lens_m && carrier == glm::dvec2(0) &&
      slm_.offset_turns == 0 && slm_.illumination.is_plane())
    return;

  // Levels are to be added to grey, and phase may fall as grey rises.
  const bool falls =
      slm_.lut.values.empty() ? slm_.invert : slm_.lut.values.back() < slm_.lut.values.front();
  const double turns_per_value =
      flatness.in_nm ? -1e-9 / wavelength_m_
                     : (falls ? -1 : 1) * (grey_levels_of(slm_) - 1.0) / slm_.levels_per_turn;
  const int left = (picture.width - whole.x) / 2 + part_.first_px.x,
            top = (picture.height - whole.y) / 2 + part_.first_px.y;
  const double radius = 0.5 * std::max(whole.x * pitch_m_.x, whole.y * pitch_m_.y);
  added_.resize(std::size_t{1} * size_.x * size_.y);
  auto& threads = cl::Threads::shared();
  threads.for_each(
      threads.count(), static_cast<std::size_t>(size_.y), 8, [&](std::size_t, std::size_t row) {
        const int y = static_cast<int>(row);
        const double up = (whole.y - 1) / 2.0 - (y + part_.first_px.y);  // row 0 is the top
        for (int x = 0; x < size_.x; ++x) {
          const double right = x + part_.first_px.x - (whole.x - 1) / 2.0;
          const double x_m = right * pitch_m_.x, y_m = up * pitch_m_.y;
          double turns = slm_.offset_turns + carrier.x * right + carrier.y * up;
          turns -= light_turns(x, y);
          if (slm_.lens_m) turns -= (x_m * x_m + y_m * y_m) / (2 * wavelength_m_ * *slm_.lens_m);
          if (const int i = x + left, j = y + top;
              !is_flat && i >= 0 && j >= 0 && i < picture.width && j < picture.height)
            turns += turns_per_value * picture.pixels[std::size_t{1} * j * picture.width + i];
          for (const auto& term : slm_.zernike)
            turns += term.turns * zernike(term.noll, x_m / radius, y_m / radius);
          const double units = std::round((turns - std::floor(turns)) * units_per_turn);
          added_[std::size_t{1} * y * size_.x + x] =
              static_cast<std::uint16_t>(static_cast<std::uint32_t>(units) & 0xffff);
        }
      });
}

}  // namespace raywave
