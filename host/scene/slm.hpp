// SPDX-License-Identifier: Apache-2.0
/// The SLM on the bench as the user describes it: how fields become grey levels, what each level
/// shows, and what stands behind the SLM. Section [slm] of a scene, or a file of its own
/// (docs/slm.md lists every key).
#pragma once

#include <array>
#include <complex>
#include <filesystem>
#include <glm/vec2.hpp>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "host/common/npy.hpp"
#include "host/scene/image.hpp"

namespace raywave {

// Look-up tables of SLMs: what each grey level shows.

/// What grey levels show: phases in turns or radians, or amplitudes. Levels that are not listed are
/// not used.
struct Lut {
  std::vector<int> levels;  // rising; empty: 0, 1, 2 ...
  std::vector<double> values;
  std::vector<double> amplitudes{};  // that come with phases; empty: 1 each

  bool operator==(const Lut&) const = default;
};

/// Reads text: a number for each level from 0 on, or a line for each with level and number, and an
/// amplitude where it comes with the phase, in any order. Headings, and comments behind #, are left
/// out. Where ; stands between numbers, a comma is a decimal point. Reads .npy, too: floats or
/// integers of shape (n), (n, 2), (n, 3).
///
/// level_count  of the panel
/// throws       InputError naming file and line
Lut load_lut(const std::filesystem::path& file, int level_count);

/// A table of rows of level and number, and an amplitude in all of them or in none.
///
/// where   starts messages
/// throws  InputError for levels that are no whole numbers of the panel, or are there twice
Lut lut_of_table(std::vector<std::vector<double>> rows, int level_count, const std::string& where);

/// What each level shows, of the LUT's values or amplitudes: between listed ones on a straight
/// line, beyond them as the nearest.
std::vector<double> shown_by_level(const Lut& lut, const std::vector<double>& listed,
                                   int level_count);

/// Replaces values that turn back, as noise of a measurement makes them, by the nearest ones (least
/// squares) that do not.
///
/// returns  the largest change; 0: there was none
double make_monotone(std::vector<double>& values);

/// How a complex field becomes one number per pixel. docs/slm.md gives formulas and papers.
enum class Encoding {
  phase,         // the field's phase; its amplitude is lost
  double_phase,  // two phases on a checkerboard whose mean is the field; phase SLMs
  off_axis,      // amplitude SLMs: interference with a tilted plane wave
  burckhardt,    // amplitude SLMs: three pixels of a row show three parts, 120 degrees apart
  lee,           // binary SLMs (DMDs): the width and place of stripes
  automatic      // double_phase or, where a scene fills the SLM's band, phase: the plan decides
};

constexpr auto names_of(Encoding) {
  return std::array{"phase", "double-phase", "off-axis", "burckhardt", "lee", "auto"};
}

/// True when levels stand for amplitudes, not for phases.
constexpr bool shows_amplitude(Encoding encoding) {
  return encoding == Encoding::off_axis || encoding == Encoding::burckhardt ||
         encoding == Encoding::lee;
}

/// Zernike polynomial by Noll's index, of the given root mean square over the unit disc.
/// source  Noll, J. Opt. Soc. Am. 66, 207 (1976)
struct ZernikeTerm {
  int noll = 1;
  double turns = 0;
};

/// The aperture in the Fourier plane of the optics behind the SLM.
struct StopSpec {
  glm::dvec2 size{1, 1};    // share of the SLM's band (1 / pitch) that passes, 0 to 1 per axis
  glm::dvec2 centre{0, 0};  // cycles per pixel, relative to the carrier
};

/// A picture that corrects the panel's unevenness.
struct FlatnessSpec {
  std::filesystem::path file;
  Image picture;        // as stored, integers divided by their largest; empty: none
  bool in_nm = false;   // error of the wavefront in nm, which is taken off; else levels, added
  bool centre = false;  // cropped or padded around its middle; else it must have the SLM's size
  std::string where;    // "scene.toml:12: slm: flatness", the start of messages
};

/// How bright the light is over the hologram.
struct BeamProfile {
  // Of a Gaussian, as far as 1/e^2 of the intensity is left; 0: there is none
  glm::dvec2 diameter_m{0, 0};
  std::filesystem::path file;
  std::shared_ptr<const Image> picture;  // intensity, stretched over the hologram; null: none
  std::string where;                     // "scene.toml:12: illumination: profile", for messages

  bool is_even() const { return diameter_m == glm::dvec2(0) && !picture; }
  bool operator==(const BeamProfile&) const = default;
};

/// Amplitude of the light at each pixel, row 0 the top, of mean square 1; empty where it is even.
std::vector<float> amplitudes_of(const BeamProfile& profile, glm::ivec2 size_px,
                                 glm::dvec2 pitch_m);

/// Light of the darkest pixel, over the mean.
double darkest_of(const BeamProfile& profile, glm::ivec2 size_px, glm::dvec2 pitch_m);

/// Amplitudes that a pixel gives back reach no farther than the darkest one's. Below this light of
/// it, over the mean, phases alone show more: of a teapot, 1.1 dB at 0.6 % and 18 dB at 0.02 %;
/// double phase 1.4 dB more at 3 %.
constexpr double least_darkest = 0.01;

/// Amplitude that a pixel which shines over the share `fill` of its pitch sends into a direction,
/// over that of a point, along one axis.
double amplitude_of_pixel(double fill, double cycles_per_pixel);

/// The light that falls onto the SLM, section [illumination].
struct Illumination {
  // Where it converges, before the hologram on the eye's side; < 0: it diverges from a point
  // beyond the hologram. Empty: its rays are parallel
  std::optional<double> focus_m;
  // Sines of its middle ray's direction: > 0 towards +x, +y
  glm::dvec2 sine{0, 0};
  BeamProfile profile{};
  double source_size_rad = 0;  // angular diameter of an evenly bright disc
  double bandwidth_m = 0;      // full width at half maximum of a Gaussian spectrum

  /// Its middle is one plane wave along the axis.
  bool is_plane() const { return !focus_m && sine == glm::dvec2(0); }
  /// Phase in turns at a place of the hologram, less that at the middle.
  ///
  /// accuracy  absolute 1e-9 turns for places up to 0.1 m off the middle
  double turns(glm::dvec2 at_m, double wavelength_m) const;
  /// Sines of the direction in which it travels there, to first order in the place.
  glm::dvec2 sine_at(glm::dvec2 at_m) const { return sine - curvature_per_m() * at_m; }
  /// By how much a sine falls per metre: 1 / focus.
  glm::dvec2 curvature_per_m() const;
  bool operator==(const Illumination&) const = default;
};

/// How much of its neighbours' phase, or amplitude, a pixel takes over.
struct Crosstalk {
  double sigma_m = 0;           // of a Gaussian that blurs what pixels are told; 0: none
  glm::ivec2 size{0, 0};        // columns and rows of `weights`, both odd
  std::vector<double> weights;  // measured, row 0 the top; they sum to 1. Empty: none

  bool any() const { return sigma_m > 0 || !weights.empty(); }
};

/// The weights of crosstalk, those of a Gaussian for the middle of a pixel.
Crosstalk kernel_of(const Crosstalk& crosstalk, glm::dvec2 pitch_m);

struct SlmSpec {
  Encoding encoding = Encoding::automatic;
  // Share of the pixels whose amplitude is shown in full; brighter ones are clipped
  double clip = 0.9;
  glm::dvec2 band{1, 1};      // share of the SLM's band that the field keeps before it is encoded
  int bits = 8;               // of a grey level: 8 or 10
  int levels = 256;           // number of different phases, or amplitudes, that are shown, >= 2
  int levels_per_turn = 256;  // grey levels to a turn of phase
  bool invert = false;        // phase falls as grey rises
  double offset_turns = 0;    // added to every phase
  // Phase in turns, or amplitude, that grey levels show at this wavelength; it never turns
  // back. Empty: linear
  Lut lut;
  FlatnessSpec flatness;
  std::vector<ZernikeTerm> zernike;  // added; radius of the unit disc: half of the longer side
  glm::dvec2 carrier{0, 0};          // cycles per pixel: moves the picture off the zero order
  // The same as a distance that the picture moves in the plane shift_distance_m
  glm::dvec2 shift_m{0, 0};
  double shift_distance_m = 0.1;
  std::optional<double> lens_m;         // focal length of a lens that is added, > 0 converging
  bool flip_x = false, flip_y = false;  // of the pictures that are written
  int rotate_deg = 0;                   // of the pictures, counterclockwise: 0, 90, 180 or 270
  std::optional<StopSpec> stop;         // empty: all light passes
  // Sides of the part of a pixel that shines, over the pitch; empty: pixels are points
  std::optional<glm::dvec2> fill;
  double undiffracted = 0;  // share of the light that leaves as it came
  Crosstalk crosstalk;
  std::optional<double> rate_per_s;  // frames that the panel shows; empty: any number
  Illumination illumination;         // what it adds to the light is taken off
  std::vector<std::string> notes;    // for the user, of a file of its own: a line each
};

/// Grey levels that a pixel can take.
constexpr int grey_levels_of(const SlmSpec& slm) { return 1 << slm.bits; }

/// The carrier that is added to each pixel, of slm.carrier or slm.shift, in cycles per pixel.
///
/// throws  InputError when the shift asks for more than the SLM's band
glm::dvec2 carrier_of(const SlmSpec& slm, glm::dvec2 pitch_m, double wavelength_m);

/// What grey levels show, and which of them are used.
struct LevelValues {
  std::vector<double> shown;  // by level: turns of phase, or amplitude
  std::vector<int> used;
  std::vector<double> amplitudes{};  // by level, that come with phases; empty: 1 each

  /// The used level whose state is nearest to the phase, at the mean amplitude of those used; the
  /// lowest of equals.
  int nearest_to_phase(double turns) const;
  /// Light of a level that shows a phase.
  std::complex<double> state(int level) const;
};
LevelValues values_of_levels(const SlmSpec& slm);

/// Whether pixels show other light than the phases that they are told: amplitudes that come with
/// them, crosstalk, undiffracted light.
bool adds_to_phases(const SlmSpec& slm);

/// What the light of another colour keeps of the phases that the SLM adds (SourceSpread).
SourceSpread source_spread(const SlmSpec& slm, glm::dvec2 pitch_m, double wavelength_m);

/// Share of the light of grey levels that is in the wanted wave when all phases are wanted alike:
/// sinc^2(1 / n) of n levels evenly spread. The rest makes twin pictures and haze. 1 where levels
/// show amplitudes.
double wanted_share_of_levels(const SlmSpec& slm);

/// The carrier that an encoding brings beside it: Burckhardt's parts stand on one.
glm::dvec2 own_carrier_of(Encoding encoding);

/// throws  InputError when the flatness picture has not the SLM's size, and may not be cropped or
///         padded
void require_fit(const FlatnessSpec& flatness, glm::ivec2 size_px);

}  // namespace raywave
