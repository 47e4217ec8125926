// SPDX-License-Identifier: Apache-2.0
/// Fields and pictures: propagation, encoding, and what a hologram shows.
#pragma once

#include <raywave/render.hpp>

namespace RAYWAVE_NAMESPACE {

struct PropagateOptions {
  // Target centre minus source centre
  Vec2 shift_m{0, 0};
  // 1 to 64: side of the transformed plane over the side of the field. From 2 on the plane is wider
  // where the distance needs it
  double padding = 2;
  // Of the points at which the field is told, about the target's centre; empty: those of the field
  std::optional<Vec2> out_pitch_m{};
  std::optional<std::array<int, 2>> out_size{};  // columns and rows
  DeviceOptions on{};
};

/// Field on a parallel plane whose centre is shifted sideways: the band-limited shifted angular
/// spectrum, with the phase of the true distance. Its adjoint is the propagation by the opposite
/// distance and shift.
///
/// field       complex samples, pitch_m apart, centred
/// distance_m  along the direction of travel; negative propagates back
/// throws      InputError when no frequency survives the band limit; the message gives the largest
///             usable shift
/// accuracy    relative L2 error <= 6e-7 against direct summation for fields inside window and band
///             (docs/accuracy.md); 3e-7 at points of another pitch (in double precision 3e-8),
///             which take four propagations for each window of the field's size that they spread
///             over
/// source      Matsushima, Opt. Express 18, 18453 (2010)
RAYWAVE_API Field propagate(const FieldView& field, const Pixels& pixels, double distance_m,
                            const PropagateOptions& options = {});

/// The same in double precision, on one thread of the host: for checks, not for speed.
/// `options.on` names the FFT whose padded size is taken.
RAYWAVE_API FieldDouble propagate(const FieldDoubleView& field, const Pixels& pixels,
                                  double distance_m, const PropagateOptions& options = {});

/// The plane looked at, and from where.
struct ViewOptions {
  double z_m = 0.1;                // > 0; < 0 on the eye's side of the hologram
  std::optional<Vec2> window_m{};  // size of the picture; empty: the hologram's
  // Centre of the part of the hologram that lets light through, in half holograms: (-1, -1) bottom
  // left to (1, 1) top right
  Vec2 view{0, 0};
  Vec2 aperture{1, 1};  // size of that part in holograms
  // The pupil of an eye that is looked through, as --pupil of the command line, in the hologram's
  // frame: "scene", "none", "3mm", "3mm@1mm,0". Of several places of the scene's the first. Empty:
  // the scene's where it has an eyepiece and no part of the hologram is looked through
  std::optional<std::string> pupil{};
  Vec2 centre_m{0, 0};  // of reconstruct's picture: x and y of the scene
  DeviceOptions on{};
  Progress progress{};
};

/// Intensity |u|^2 in the plane z, mean over the frames, on the hologram's pitch: what a sensor in
/// the image of that plane records.
///
/// throws  InputError when z, window, view, aperture or pupil are not possible
RAYWAVE_API Picture reconstruct(const FieldView& field, const Pixels& pixels,
                                const ViewOptions& options = {});

/// What the SLM shows with the levels of a hologram. In colour, the picture of all lasers in linear
/// sRGB, each with the power that Hologram::powers tells.
///
/// throws  as above
RAYWAVE_API Picture reconstruct(const Hologram& hologram, const ViewOptions& options = {});

/// Radiance in the plane z that an ideal lens in the hologram's place sees: the reference for
/// reconstruct, pixel by pixel. In colour it is linear sRGB.
///
/// points  per axis of the lens, 1 to 4096: points^2 rays per pixel
RAYWAVE_API Picture lens(const Scene& scene, const ViewOptions& options = {}, int points = 24);

struct PreviewOptions {
  // Of the plane in which the picture is measured; empty: the middle of the scene
  std::optional<double> z_m{};
  std::optional<Vec2> window_m{};  // empty: all of the scene that the hologram's pixels can show
  Vec2 view{0, 0};                 // as in ViewOptions
  DeviceOptions on{};
};

/// What an eye sees of the scene through the middle of the hologram, all depths in focus, one ray
/// to a pixel: the picture of `raywave preview`, at once. Pixels are the hologram's, or a whole
/// number of times as large, so that the longer side has at most 320 or so. In colour it is linear
/// sRGB.
///
/// throws  InputError when z, window or view are not possible
RAYWAVE_API Picture preview(const Scene& scene, const PreviewOptions& options = {});

/// Grey levels of a field, by the SLM's encoding, in the hologram's frame.
///
/// throws  InputError when the SLM's pictures do not fit the field
RAYWAVE_API Levels encode(const FieldView& field, const Slm& slm, const Pixels& pixels,
                          const DeviceOptions& on = {});

struct PatternOptions {
  double focal_m = 0.3;   // lens: to its focus along the light; < 0: it diverges
  double period_px = 16;  // blaze: pixels to a turn; checker: pixels to two squares
  Side to = Side::right;  // blaze: where the light goes
  DeviceOptions on{};
};

/// A test picture that tells on a bench whether an SLM is described right (docs/slm.md), as the SLM
/// is sent it: turned by slm.rotate, then flipped.
///
/// throws  InputError when the pixels cannot show it; the message gives what they can
RAYWAVE_API Levels pattern(Pattern pattern, std::array<int, 2> resolution, const Pixels& pixels,
                           const Slm& slm = {}, const PatternOptions& options = {});

/// The light that an SLM with these levels shows, behind the stop of its optics. Carrier, lens and
/// corrections are taken off again.
RAYWAVE_API Field shown(const Levels& levels, const Slm& slm, const Pixels& pixels);

/// A picture that a refined hologram should show, on the hologram's pitch.
struct Target {
  double z_m = 0;
  PictureView picture{};
  Vec2 view{0, 0}, aperture{1, 1};
};

/// Changes the phases of a field until it shows the targets. Returns samples of modulus 1.
///
/// options  iterations, brightness, blur_m (default: four pixels), budget_s and render.on count
RAYWAVE_API Field refine(const FieldView& start, const Pixels& pixels,
                         std::span<const Target> targets, const RefineOptions& options = {});

/// Figures of each pair of frames, averaged over the frames. A is the reference.
struct FieldComparison {
  double correlation = 0;   // 1 when b is a times a number
  double error = 0;         // |b - a| / |a|
  double error_scaled = 0;  // |c b - a| / |a| with the complex number c that makes it smallest
  double energy_ratio = 0;  // |b|^2 / |a|^2
};

/// throws  InputError when sizes or numbers of frames differ, or a frame is zero everywhere
RAYWAVE_API FieldComparison compare(const FieldView& a, const FieldView& b);

struct CompareOptions {
  double blur_px = 0;  // standard deviation of the Gaussian that both are blurred with first
  int border_px = 0;   // left out on every side
  Domain domain = Domain::intensity;
  std::optional<std::array<int, 4>> region{};  // x, y, width, height: of the speckle contrast
};

struct PictureComparison {
  double psnr_db = 0;  // infinite when b is a times a number
  double ssim = 0;
  double flip = 0;                        // mean FLIP, of the colours where there are some
  double scale = 0;                       // least-squares scale of b to a
  double contrast_a = 0, contrast_b = 0;  // speckle contrast

  /// CIEDE2000 of the pixels (docs/colour.md).
  struct Colours {
    double mean = 0, median = 0, most = 0;
    double most_of_95 = 0;  // 95 % of the pixels are at or below
  };
  std::optional<Colours> colours{};  // of pictures in colour; the other figures: of luminances
};

/// Compares pictures of linear values; a common factor of the brightness does not count
/// (docs/quality.md). Both are grey, or both are in colour.
///
/// throws  InputError when sizes or channels differ, a picture is black, or the options are not
///         possible
RAYWAVE_API PictureComparison compare(const PictureView& a, const PictureView& b,
                                      const CompareOptions& options = {});

struct QualityOptions {
  std::vector<double> depths_m{};     // ascending; empty: nearest, farthest, a little in front
  std::optional<Vec2> window_m{};     // of the pictures, around the axis; empty: as `quality` takes
  std::optional<double> blur_m{};     // standard deviation; empty: 0.6 of the detail that the
                                      // viewer makes out, at which plans predict
  bool views = true;                  // at the first depth also through quarters of the hologram
  std::vector<std::string> pupils{};  // ViewOptions::pupil, all places of each
  int lens_points = 12;               // per axis
  int border_px = 20;                 // left out on every side
  DeviceOptions on{};
  Progress progress{};
};

/// The part of a hologram that lets light through, as its viewer has it; or all of it, through the
/// pupil of an eye.
enum class View { whole, left, right, top, bottom, pupil };
constexpr auto names_of(View) {
  return std::array{"whole", "left", "right", "top", "bottom", "pupil"};
}

/// A picture of the hologram against that of an ideal lens, as a row of `raywave quality`.
struct QualityRow {
  double z_m = 0;
  View view = View::whole;
  PictureComparison levels{};    // of what the SLM shows
  PictureComparison field{};     // of the field, which no SLM shows
  double light_share = 0;        // of the SLM's light, that falls into the picture
  std::optional<double> haze{};  // where the lens sees nothing, of its brightest pixel
  Picture lens{}, hologram{};    // without border, averaged over squares to 640 columns at most
  double pupil_m = 0;            // View::pupil: its diameter, and its middle from the axis
  Vec2 pupil_place_m{0, 0};
};

/// How well a hologram shows its scene, as `raywave quality` measures it (docs/quality.md).
///
/// throws  InputError when the hologram has no field (RenderOptions::keep_field), or the pictures
///         are not possible
RAYWAVE_API std::vector<QualityRow> quality(const Hologram& hologram,
                                            const QualityOptions& options = {});

struct TradeOptions {
  bool quick = false;              // fewer values of each setting
  bool presets = false;            // nothing but the presets
  bool exhaustive = false;         // all combinations that plans choose among: hours
  int renders = 0;                 // timed per configuration; 0: 3 to 15 in a second
  std::vector<double> depths_m{};  // as QualityOptions
  std::optional<Vec2> window_m{};
  bool views = true;
  int lens_points = 8;
  int border_px = 20;
  // Presets and single settings against the sum of all points; empty: up to 512 x 512 pixels
  std::optional<bool> against_points{};
  // Where trade.json, trade.csv and trade.png are written, and an earlier run is gone on with;
  // empty: nowhere
  std::filesystem::path folder{};
  DeviceOptions on{};
  Progress progress{};
};

/// What the settings of a scene cost in time and gain in accuracy, as `raywave trade` measures it.
struct Trade {
  std::string text{};  // the tables that it prints
  std::string json{};  // trade.json (docs/planning.md)
  std::string csv{};   // trade.csv
  /// Along the frontier: rows are depths, columns the lens, then the fastest first.
  struct Sheet {
    int nx = 0, ny = 0, channels = 3;  // sRGB
    std::vector<std::uint8_t> values{};
  } sheet{};
};

/// Renders, times and judges configurations of a scene: minutes to hours.
///
/// throws  InputError for the scene and the options, DeviceError for the device, Cancelled
RAYWAVE_API Trade trade(const Scene& scene, const TradeOptions& options = {});

}  // namespace RAYWAVE_NAMESPACE
