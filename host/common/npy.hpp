// SPDX-License-Identifier: Apache-2.0
/// Complex fields as NumPy files (.npy format 1.0, little-endian complex64, C order).
#pragma once

#include <complex>
#include <cstdint>
#include <filesystem>
#include <glm/vec2.hpp>
#include <span>
#include <vector>

namespace raywave {

/// From which directions, and of which colours, light comes beside its middle: pictures add up what
/// each of them shows.
struct SourceSpread {
  double size_rad = 0;     // angular diameter of an evenly bright disc
  double bandwidth_m = 0;  // full width at half maximum of a Gaussian spectrum
  // Turns that the SLM adds and a field leaves out, per metre from the middle and per square
  // metre. Light of another colour keeps 1 - wavelength / its own of them
  glm::dvec2 per_m{0, 0}, per_m2{0, 0};

  bool any() const { return size_rad > 0 || bandwidth_m > 0; }
};

/// A stack of complex fields. One frame is stored with shape (ny, nx), more with (frames, ny, nx).
/// Row 0 is the top (largest y).
struct FieldStack {
  int nx = 0, ny = 0, frames = 1;
  std::vector<std::complex<float>> samples;
  SourceSpread source{};  // of what an SLM shows; no part of files
};

/// throws  InputError when the file is not a complex64 or complex128 array of 2 or 3 dimensions, is
///         cut short, or holds NaN or infinity
FieldStack load_npy(const std::filesystem::path& file);

/// A list or a small table of real numbers: shape (n) gives n rows of one number, (n, m) n of m.
///
/// throws  InputError for other types and shapes, more than 2^20 numbers, NaN and infinity
std::vector<std::vector<double>> load_npy_rows(const std::filesystem::path& file);

/// Writes uint8 or uint16 numbers of shape (frames, ny, nx), as the function below.
void save_npy(const std::filesystem::path& file, int nx, int ny, int frames,
              std::span<const std::uint8_t> numbers);
void save_npy(const std::filesystem::path& file, int nx, int ny, int frames,
              std::span<const std::uint16_t> numbers);

/// The file appears whole or not at all (temporary name, then rename).
void save_npy(const std::filesystem::path& file, int nx, int ny, int frames,
              std::span<const std::complex<float>> samples);

}  // namespace raywave
