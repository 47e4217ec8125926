// SPDX-License-Identifier: Apache-2.0
#include "host/view/reconstruct.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <glm/common.hpp>

#include "cl/program.hpp"
#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/propagate/propagator.hpp"
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
  if (!positive(std::abs(what.z_m)))
    throw InputError("z: must not be 0: > 0 is beyond the hologram, < 0 on the eye's side");
  if (hologram.nx != spec.resolution.x || hologram.ny != spec.resolution.y) {
    throw InputError("reconstruction: the hologram has " + std::to_string(hologram.nx) + " x " +
                     std::to_string(hologram.ny) + " samples, " +
                     std::to_string(spec.resolution.x) + " x " + std::to_string(spec.resolution.y) +
                     " expected");
  }
  if (!std::isfinite(what.view.x) || !std::isfinite(what.view.y))
    throw InputError("view: must be two finite numbers");
  if (!positive(what.aperture.x) || !positive(what.aperture.y))
    throw InputError("aperture: must be > 0");
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
                  const HologramSpec& spec, const ReconstructSpec& what,
                  const std::function<void(double)>& progress) {
  check(hologram, spec, what);
  const auto window = picture_size(what.window_m, spec.resolution, spec.pitch_m);
  std::optional<PupilFilter> pupil;
  if (what.pupil) pupil.emplace(spec, *what.pupil);
  // Of what is propagated: diffraction at a pupil spreads light beyond the hologram
  const glm::ivec2 size = pupil ? pupil->size() : spec.resolution;
  const auto bytes = [](glm::ivec2 plane, std::uint64_t each) {
    return each * static_cast<std::uint64_t>(plane.x) * plane.y;
  };
  const auto padded = padded_size(size, what.padding, spec.pitch_m, spec.wavelength_m, what.z_m);
  const std::string advice = "a smaller hologram or window needs less";
  cl::require_memory(device,
                     std::vector<cl::MemoryNeed>{{"padded plane", bytes(padded, 8), advice},
                                                 {"sum of spectra", bytes(padded, 8), advice},
                                                 {"hologram field", bytes(size, 8), advice},
                                                 {"reconstruction", bytes(window, 4), advice}});
  const double unit = unit_of(hologram);
  Propagator propagator(device,
                        {size, spec.pitch_m, spec.wavelength_m, what.padding, backend, what.z_m});
  auto tiles = tiles_of(window, size, spec.pitch_m);
  std::erase_if(tiles, [&](const WindowTile& tile) {
    return !propagator.reaches({tile.centre_m, -what.z_m});
  });
  std::vector<Target> targets;
  for (const auto& tile : tiles) targets.push_back({tile.centre_m, -what.z_m});

  cl::ComplexBuffer field(device, static_cast<std::size_t>(size.x) * size.y, "hologram field");
  cl::Buffer<float> intensity(device, static_cast<std::size_t>(window.x) * window.y,
                              "reconstruction");
  intensity.fill_zero();
  auto add_intensity =
      cl::Program(device, "kernels/view/reconstruct.cl", {}).kernel("add_intensity");
  const bool cpu = device.info().kind == cl::DeviceKind::cpu;

  std::vector<std::complex<float>> masked(hologram.samples.size() /
                                          static_cast<std::size_t>(hologram.frames));
  std::size_t done = 0;
  for (int frame = 0; frame < hologram.frames; ++frame) {
    for (int y = 0; y < hologram.ny; ++y) {
      for (int x = 0; x < hologram.nx; ++x) {
        const auto i = static_cast<std::size_t>(y) * hologram.nx + x;
        const bool open = lets_through(x, hologram.nx, what.view.x, what.aperture.x) &&
                          lets_through(y, hologram.ny, -what.view.y, what.aperture.y);
        masked[i] =
            open ? std::complex<float>(
                       std::complex<double>(hologram.samples[frame * masked.size() + i]) / unit)
                 : 0;
      }
    }
    field.write(pupil ? (*pupil)(masked) : masked);
    propagator.load(field, 0, targets);
    for (const auto& tile : tiles) {
      propagator.add({tile.centre_m, -what.z_m});
      propagator.collect(field);
      const auto columns = static_cast<std::size_t>(cpu ? 1 : tile.used.x),
                 rows = static_cast<std::size_t>(tile.used.y);
      add_intensity.run({columns, rows}, {cpu ? 1u : 64u, 1}, field, intensity, size.x, window.x,
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

}  // namespace raywave
