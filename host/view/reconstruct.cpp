// SPDX-License-Identifier: Apache-2.0
#include "host/view/reconstruct.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <glm/common.hpp>
#include <glm/exponential.hpp>
#include <numbers>

#include "cl/program.hpp"
#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/common/threads.hpp"
#include "host/plan/message_text.hpp"
#include "host/plan/plan.hpp"
#include "host/propagate/propagator.hpp"
#include "host/scene/scene.hpp"
#include "host/view/compare.hpp"
#include "host/view/pupil.hpp"

namespace raywave {
namespace {

bool positive(double value) { return std::isfinite(value) && value > 0; }

/// A power of two near the field's largest number, or 1 when its square fits into a float anyway.
/// Division by it is exact.
double unit_of(const FieldStack& hologram) {
  float largest = 0;
  for (const auto& sample : hologram.samples)
    largest = std::max({largest, std::abs(sample.real()), std::abs(sample.imag())});
  return largest == 0 || (largest >= 0x1p-30f && largest <= 0x1p30f)
             ? 1
             : std::ldexp(1.0, std::ilogb(largest));
}

void check(const FieldStack& hologram, const HologramSpec& spec, const ReconstructSpec& what) {
  if (!std::isfinite(what.z_m)) throw InputError("z: must be finite");
  if (hologram.nx != spec.resolution.x || hologram.ny != spec.resolution.y) {
    throw InputError("reconstruction: the hologram has " + extent_text({hologram.nx, hologram.ny}) +
                     " samples, " + extent_text(spec.resolution) + " expected");
  }
  if (!std::isfinite(what.view.x) || !std::isfinite(what.view.y))
    throw InputError("view: must be two finite numbers");
  if (!positive(what.aperture.x) || !positive(what.aperture.y))
    throw InputError("aperture: must be > 0");
}

/// A colour of the light: its wavelength, its share of the light, and what of the SLM's phases it
/// keeps.
struct Colour {
  double wavelength_m = 1, share = 1, keeps = 0;
};

/// The colours of a Gaussian spectrum, so close together that light of neighbours meets in half a
/// spot of the hologram's; the laser's alone where it has one.
std::vector<Colour> colours_of(const SourceSpread& source, const HologramSpec& spec,
                               const ReconstructSpec& what, glm::ivec2 window) {
  const double middle_m = spec.wavelength_m;
  if (!(source.bandwidth_m > 0)) return {{middle_m, 1, 0}};
  constexpr double reach = 4;  // standard deviations
  constexpr int least = 7, most = 129;
  const double sigma_m = source.bandwidth_m / (2 * std::sqrt(2 * std::log(2.0)));
  // A colour moves light by its change times this
  const auto open_m = glm::dvec2(spec.resolution) * spec.pitch_m * glm::min(what.aperture, 1.0);
  const auto moved_m = (glm::dvec2(spec.resolution) + glm::dvec2(window)) * spec.pitch_m / 2.0 +
                       glm::abs(what.centre_m) +
                       std::abs(what.z_m) * middle_m * glm::abs(source.per_m);
  const auto spots =
      2 * reach * sigma_m / middle_m * moved_m / (middle_m * std::abs(what.z_m) / open_m);
  const int count = static_cast<int>(
      std::clamp(std::ceil(2 * std::max(spots.x, spots.y)) + 1, double{least}, double{most}));
  std::vector<Colour> colours;
  double sum = 0;
  for (int i = 0; i < count; ++i) {
    const double t = reach * (2.0 * i / (count - 1) - 1);
    const double wavelength_m = middle_m + t * sigma_m;
    if (!(wavelength_m > 0.5 * middle_m)) continue;
    colours.push_back({wavelength_m, std::exp(-t * t / 2), 1 - middle_m / wavelength_m});
    sum += colours.back().share;
  }
  for (auto& colour : colours) colour.share /= sum;
  return colours;
}

/// Factors of the columns or rows of a hologram in another colour.
std::vector<std::complex<double>> kept_along(const SourceSpread& source, const Colour& colour,
                                             int axis, int n, double pitch_m) {
  std::vector<std::complex<double>> factors;
  for (int i = 0; i < n && colour.keeps != 0; ++i) {
    const double away_m = (i - (n - 1) / 2.0) * (axis == 1 ? -pitch_m : pitch_m);
    factors.push_back(
        std::polar(1.0, 2 * std::numbers::pi * colour.keeps *
                            (source.per_m[axis] * away_m + source.per_m2[axis] * away_m * away_m)));
  }
  return factors;
}

/// The mean over a disc around each pixel, whose radii are given in pixels; black beyond the edge.
/// Pixels are squares of one brightness, whose second moments the disc is smaller by.
Image spread_over_disc(const Image& image, glm::dvec2 radius_px) {
  radius_px = glm::sqrt(glm::max(radius_px * radius_px - 1.0 / 3, 1e-4));
  struct Chord {
    int row;
    double half, weight;
  };
  // Lines through the disc, several to a row where it has few
  const int lines = static_cast<int>(std::clamp(std::ceil(128 / radius_px.y), 2.0, 64.0));
  const int reach = static_cast<int>(std::ceil(radius_px.y)) * lines;
  std::vector<Chord> chords;
  double all = 0;
  for (int k = -reach; k < reach; ++k) {
    const double y = (k + 0.5) / lines, t = 1 - y * y / (radius_px.y * radius_px.y);
    if (!(t > 0)) continue;
    const int row = static_cast<int>(std::floor(y + 0.5));
    const double half = radius_px.x * std::sqrt(t);
    chords.push_back({row, half, 1});
    all += 2 * half;
  }
  for (auto& chord : chords) chord.weight = 1 / all;
  Image spread{image.width, image.height, std::vector<float>(image.pixels.size())};
  auto& threads = cl::Threads::shared();
  const auto width = static_cast<std::size_t>(image.width);
  std::vector<double> sums((width + 1) * static_cast<std::size_t>(image.height));
  for (std::size_t y = 0; y < static_cast<std::size_t>(image.height); ++y)
    for (std::size_t x = 0; x < width; ++x)
      sums[y * (width + 1) + x + 1] =
          sums[y * (width + 1) + x] + double{image.pixels[y * width + x]};
  threads.for_each(
      threads.count(), static_cast<std::size_t>(image.height), 4,
      [&](std::size_t, std::size_t row) {
        std::vector<double> line(width);
        for (const auto& chord : chords) {
          const int from = static_cast<int>(row) + chord.row;
          if (from < 0 || from >= image.height) continue;
          const double* sum = sums.data() + static_cast<std::size_t>(from) * (width + 1);
          // Light of the row up to a place
          const auto up_to = [&](double at) {
            at = std::clamp(at, 0.0, static_cast<double>(width));
            const auto i = std::min(static_cast<std::size_t>(at), width - 1);
            return sum[i] + (at - static_cast<double>(i)) * (sum[i + 1] - sum[i]);
          };
          for (std::size_t x = 0; x < width; ++x) {
            const double middle = static_cast<double>(x) + 0.5;
            line[x] += chord.weight * (up_to(middle + chord.half) - up_to(middle - chord.half));
          }
        }
        for (std::size_t x = 0; x < width; ++x)
          spread.pixels[row * width + x] = static_cast<float>(line[x]);
      });
  return spread;
}

/// Samples of the largest pieces of a plane whose propagation fits into the device's memory.
///
/// throws  DeviceError where no pieces fit
glm::ivec2 piece_that_fits(const cl::Device& device, cl::FftBackend backend, glm::ivec2 size,
                           const HologramSpec& spec, const ReconstructSpec& what,
                           glm::ivec2 window) {
  constexpr int least = 256;
  const auto bytes = [](glm::ivec2 plane, std::uint64_t each) { return each * area_of(plane); };
  for (auto piece = size;;) {
    const auto padded = padded_size(piece, what.padding, spec.pitch_m, spec.wavelength_m, what.z_m);
    const std::string advice = "a smaller hologram needs less";
    std::vector<cl::MemoryNeed> needs{
        {"padded plane", bytes(padded, 8), advice},
        {"sum of spectra", bytes(padded, 8), advice},
        {"hologram field", bytes(piece, 8), advice},
        {"reconstruction", bytes(window, 4), "a smaller window needs less"}};
    if (backend == cl::FftBackend::clfft)
      needs.push_back({"work space of the FFT", bytes(padded, 8), advice});
    const int axis = piece.x < piece.y;
    const int half = (piece[axis] + 1) / 2;
    const auto shortage = cl::memory_shortage(device, needs);
    if (shortage.empty()) return piece;
    if (half < least) throw DeviceError(shortage);
    piece[axis] = half;
  }
}

/// The piece of a plane, with zeros where it reaches beyond.
std::vector<std::complex<float>> part_of(const std::vector<std::complex<float>>& plane,
                                         glm::ivec2 size, const WindowTile& part,
                                         glm::ivec2 piece) {
  std::vector<std::complex<float>> samples(area_of(piece));
  for (int y = 0; y < part.used.y; ++y)
    std::copy_n(plane.data() + static_cast<std::size_t>(part.first.y + y) * size.x + part.first.x,
                part.used.x, samples.data() + static_cast<std::size_t>(y) * piece.x);
  return samples;
}

/// The picture of one colour, which light of one direction shows.
Image of_colour(const cl::Device& device, cl::FftBackend backend, const FieldStack& hologram,
                HologramSpec spec, const ReconstructSpec& what, glm::ivec2 window,
                const Colour& colour, const std::function<void(double)>& progress) {
  spec.wavelength_m = colour.wavelength_m;
  std::optional<PupilFilter> pupil;
  if (what.pupil) pupil.emplace(spec, *what.pupil);
  // Of what is propagated: diffraction at a pupil spreads light beyond the hologram
  const glm::ivec2 size = pupil ? pupil->size() : spec.resolution;
  const int nx = hologram.nx, ny = hologram.ny;
  const auto across = kept_along(hologram.source, colour, 0, nx, spec.pitch_m.x),
             down = kept_along(hologram.source, colour, 1, ny, spec.pitch_m.y);
  const double unit = unit_of(hologram);
  const auto piece = piece_that_fits(device, backend, size, spec, what, window);
  Propagator propagator(device,
                        {piece, spec.pitch_m, spec.wavelength_m, what.padding, backend, what.z_m});
  const auto pieces = tiles_of(size, piece, spec.pitch_m);
  const auto target_of = [&](const WindowTile& from, const WindowTile& to) {
    return Target{to.centre_m - from.centre_m, -what.z_m};
  };
  auto tiles = tiles_of(window, piece, spec.pitch_m);
  for (auto& tile : tiles) tile.centre_m += what.centre_m;
  std::erase_if(tiles, [&](const WindowTile& tile) {
    return std::ranges::none_of(
        pieces, [&](const WindowTile& from) { return propagator.reaches(target_of(from, tile)); });
  });
  std::vector<Target> targets;  // of a hologram in one piece, which is loaded once
  for (const auto& tile : tiles) targets.push_back(target_of(pieces[0], tile));

  cl::ComplexBuffer field(device, area_of(piece), "hologram field");
  cl::Buffer<float> intensity(device, area_of(window), "reconstruction");
  intensity.fill_zero();
  const auto add_intensity =
      cl::Program(device, "kernels/view/reconstruct.cl", {}).kernel("add_intensity");

  std::vector<std::complex<float>> masked(static_cast<std::size_t>(nx) * ny), filtered;
  std::size_t done = 0;
  for (int frame = 0; frame < hologram.frames; ++frame) {
    for (int y = 0; y < ny; ++y) {
      for (int x = 0; x < nx; ++x) {
        const auto i = static_cast<std::size_t>(y) * nx + x;
        const bool open = lets_through(x, nx, what.view.x, what.aperture.x) &&
                          lets_through(y, ny, -what.view.y, what.aperture.y);
        auto value = std::complex<double>(hologram.samples[frame * masked.size() + i]) / unit;
        if (!across.empty()) value *= across[x] * down[y];
        masked[i] = open ? std::complex<float>(value) : 0;
      }
    }
    if (pupil) filtered = (*pupil)(masked);
    const auto& light = pupil ? filtered : masked;
    if (pieces.size() == 1) {
      field.write(light);
      propagator.load(field, 0, targets);
    }
    for (const auto& tile : tiles) {
      for (const auto& from : pieces) {
        const auto target = target_of(from, tile);
        if (pieces.size() > 1) {
          if (!propagator.reaches(target)) continue;
          field.write(part_of(light, size, from, piece));
          propagator.load(field, 0, std::array{target});
        }
        propagator.add(target);
      }
      propagator.collect(field);
      run_rows(device, add_intensity, tile.used.x, tile.used.y, field, intensity, piece.x, window.x,
               tile.first.x, tile.first.y, tile.used.x, tile.used.y,
               1.0f / static_cast<float>(hologram.frames));
      if (progress)
        progress(static_cast<double>(++done) / static_cast<double>(tiles.size() * hologram.frames));
    }
  }
  Image image{window.x, window.y, intensity.read()};
  for (float& value : image.pixels) {
    value = static_cast<float>(value * unit * unit);
    if (!std::isfinite(value))
      throw InputError(
          "reconstruction: the picture is brighter than a float holds; scale the hologram's field");
  }
  return image;
}

}  // namespace

std::vector<WindowTile> tiles_of(glm::ivec2 window, glm::ivec2 size, glm::dvec2 pitch_m) {
  std::vector<WindowTile> tiles;
  for (int y = 0; y < window.y; y += size.y) {
    for (int x = 0; x < window.x; x += size.x) {
      const glm::ivec2 first(x, y);
      // Both centres lie between samples where a size is even, so a tile may be off the hologram's
      // grid by half a sample.
      const glm::dvec2 offset = glm::dvec2(first) + (glm::dvec2(size) - glm::dvec2(window)) / 2.0;
      tiles.push_back(
          {first, glm::min(size, window - first), glm::dvec2(offset.x, -offset.y) * pitch_m});
    }
  }
  return tiles;
}

bool lets_through(int i, int n, double centre, double size) {
  return std::abs((2.0 * i + 1) / n - 1 - centre) <= size;
}

double eye_blur_m(const ViewerSpec& viewer, double z_m) {
  return blur_of_resolution * viewer.resolution_m.value_or(detail_for_eye_m(viewer, z_m));
}

glm::ivec2 picture_size(const std::optional<glm::dvec2>& window_m, glm::ivec2 hologram_size,
                        glm::dvec2 pitch_m) {
  if (!window_m) return hologram_size;
  if (!positive(window_m->x) || !positive(window_m->y))
    throw InputError("window: both sides must be > 0");
  const glm::dvec2 samples = glm::max(glm::round(*window_m / pitch_m), 1.0);
  const auto refuse = [&](const std::string& most) {
    throw InputError("window: it has " + most + " samples: it is " + length_text(window_m->x) +
                     " x " + length_text(window_m->y) + " in pixels of " + length_text(pitch_m.x) +
                     "; give a smaller one");
  };
  if (samples.x * samples.y > 1e9) refuse("more than 1e9");
  if (std::max(samples.x, samples.y) > 1e6) refuse("a side of more than 1e6");  // PNG's limit
  return samples;
}

Image reconstruct(const cl::Device& device, cl::FftBackend backend, const FieldStack& hologram,
                  const HologramSpec& spec, const ReconstructSpec& given,
                  const std::function<void(double)>& progress) {
  check(hologram, spec, given);
  auto what = given;
  // The hologram's own plane, so close beyond it that no phase differs: propagation divides by z
  constexpr double nearest_m = 1e-9;
  if (std::abs(what.z_m) < nearest_m) what.z_m = nearest_m;
  const auto& source = hologram.source;
  const auto window = picture_size(what.window_m, spec.resolution, spec.pitch_m);
  // A direction moves the picture by its tangent times the distance: light comes from beyond the
  // window, too
  const auto radius_px = source.size_rad / 2 * std::abs(what.z_m) / spec.pitch_m;
  const auto beyond = glm::ivec2(glm::ceil(radius_px));
  const auto colours = colours_of(source, spec, what, window);
  Image picture;
  for (std::size_t i = 0; i < colours.size(); ++i) {
    auto image = of_colour(
        device, backend, hologram, spec, what, window + 2 * beyond, colours[i], [&](double share) {
          if (progress)
            progress((static_cast<double>(i) + share) / static_cast<double>(colours.size()));
        });
    if (colours.size() == 1) {
      picture = std::move(image);
      continue;
    }
    picture.width = image.width;
    picture.height = image.height;
    picture.pixels.resize(image.pixels.size());
    for (std::size_t k = 0; k < picture.pixels.size(); ++k)
      picture.pixels[k] = static_cast<float>(double{picture.pixels[k]} +
                                             colours[i].share * double{image.pixels[k]});
  }
  if (beyond == glm::ivec2(0)) return picture;
  return cropped(spread_over_disc(picture, radius_px), {beyond.x, beyond.y, window.x, window.y});
}

}  // namespace raywave
