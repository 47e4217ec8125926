// SPDX-License-Identifier: Apache-2.0
/// An SLM in numbers: what each grey level shows, which level shows a wanted phase, and what is
/// added to each pixel. Encoding and judging share them.
#pragma once

#include <complex>
#include <cstdint>
#include <glm/vec2.hpp>
#include <optional>
#include <vector>

#include "host/scene/slm.hpp"

namespace raywave {

/// Where a part of an SLM lies: columns and rows of the whole, and the part's first ones.
struct PanelPart {
  glm::ivec2 whole_px{1, 1}, first_px{0, 0};
};

class Panel {
public:
  static constexpr int table_size = 4096;

  /// size_px  columns and rows of the SLM, or of a part of it: other pixels are then not known
  /// throws   InputError when the flatness picture does not fit the SLM, a carrier or shift exceeds
  ///          its band, or a part is asked for under a beam that is not even
  Panel(const SlmSpec& slm, glm::ivec2 size_px, glm::dvec2 pitch_m, double wavelength_m,
        const std::optional<PanelPart>& part = {});

  const SlmSpec& slm() const { return slm_; }
  glm::ivec2 size_px() const { return size_; }
  /// On the whole SLM, of the first column and row that are known.
  glm::ivec2 first_px() const { return part_.first_px; }

  /// Levels by phase (i / table_size turns) or amplitude (i / (table_size - 1)); empty where they
  /// are proportional. Wanted and shown phase differ by half a step of the table more than levels
  /// alone would have it: 1/8192 turn.
  const std::vector<std::uint16_t>& level_table() const { return level_table_; }

  /// Phase added to each pixel, in units of 1/65536 turn, rows from the top; empty: none. Carrier,
  /// lens, flatness, Zernike terms and offset, less the phase of the light that falls onto it.
  const std::vector<std::uint16_t>& added() const { return added_; }

  /// Phase in turns of the light that falls onto a pixel; column x, row y from the top.
  double light_turns(int x, int y) const;

  /// The carrier that the picture stands on beside the one that is added, in cycles per pixel:
  /// Burckhardt's encoding brings its own.
  glm::dvec2 own_carrier() const { return own_carrier_of(slm_.encoding); }

  /// Light of a pixel with this level, relative to the light that falls on it: of modulus 1 for
  /// phases, unless the LUT knows amplitudes, real for amplitudes. Neighbours and what is
  /// undiffracted do not count.
  std::complex<double> shown(std::size_t level) const { return shown_[level]; }
  const LevelValues& values() const { return values_; }

  /// Amplitude of the light that falls onto each pixel, of mean square 1; empty: 1 everywhere.
  const std::vector<float>& beam() const { return beam_; }
  /// Without weights where pixels keep to themselves.
  const Crosstalk& crosstalk() const { return crosstalk_; }
  /// What the light of other directions and colours is to a field that is shown.
  SourceSpread source() const { return source_spread(slm_, pitch_m_, wavelength_m_); }
  /// The carrier that the light leaves the pixels with, in cycles per pixel.
  glm::dvec2 carrier() const { return carrier_of(slm_, pitch_m_, wavelength_m_) + own_carrier(); }

private:
  void make_levels();
  void make_added();

  SlmSpec slm_;
  glm::ivec2 size_;
  PanelPart part_;
  glm::dvec2 pitch_m_;
  double wavelength_m_;
  std::vector<std::uint16_t> level_table_;
  std::vector<std::uint16_t> added_;
  LevelValues values_;
  std::vector<std::complex<double>> shown_;  // by level
  std::vector<float> beam_;
  Crosstalk crosstalk_;
};

/// throws  InputError when the SLM's levels have not the size of Level: more than 8 bits take two
///         bytes
void require_level_bytes(const SlmSpec& slm, std::size_t bytes);

/// Levels of one frame, row 0 the top. A level is a std::uint8_t, or a std::uint16_t where it has
/// more bits.
template <class Level>
struct LevelPictureOf {
  glm::ivec2 size_px{0, 0};
  std::vector<Level> levels;
};
using LevelPicture = LevelPictureOf<std::uint8_t>;

/// The picture as the SLM wants it: turned by slm.rotate_deg, then flipped.
template <class Level>
LevelPictureOf<Level> for_slm(LevelPictureOf<Level> picture, const SlmSpec& slm);
/// for_slm taken back.
template <class Level>
LevelPictureOf<Level> from_slm(LevelPictureOf<Level> picture, const SlmSpec& slm);

/// Zernike polynomial of Noll's index, of mean square 1 over the unit disc.
///
/// source  Noll, J. Opt. Soc. Am. 66, 207 (1976), Table I
double zernike(int noll, double x, double y);

}  // namespace raywave
