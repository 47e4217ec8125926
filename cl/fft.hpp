// SPDX-License-Identifier: Apache-2.0
/// Complex FFTs: of planes in a device's memory, behind one type for every back end there, and of
/// single lines on the host.
#pragma once

#include <array>
#include <cstdlib>
#include <memory>
#include <string>
#include <string_view>

#include "cl/buffer.hpp"

namespace raywave::cl {

enum class FftBackend {
  host,   // FFTW on the host, line by line: no transfer on CPU devices, one copy each way on others
  clfft,  // clFFT on the device
  vkfft,  // VkFFT on the device
};

inline constexpr std::array all_backends{FftBackend::host, FftBackend::clfft, FftBackend::vkfft};

std::string_view name_of(FftBackend backend);

/// True when the back end can serve the device (clFFT and VkFFT need an online compiler).
bool serves(FftBackend backend, const DeviceInfo& device);

/// host on CPUs and devices without an online compiler, else clfft.
FftBackend default_backend(const DeviceInfo& device);

/// The smallest size >= n that every back end transforms fast, so that all work on the same planes:
/// a product of 2, 3, 5 and 7 and, above 32, a multiple of 16 (FFTW takes 1.6 us for 1440 samples,
/// 2.5 to 4.2 us for 1350, 1372 and 1458).
std::size_t next_fast_size(std::size_t n);

struct FreeLines {
  void operator()(std::complex<float>* samples) const { std::free(samples); }
};

/// Host memory for lines, where LineFft can work on it.
using Lines = std::unique_ptr<std::complex<float>[], FreeLines>;

/// name  for messages ("sum of spectra"); the samples are not set
/// throws  MemoryError when memory is out
Lines make_lines(std::size_t samples, const std::string& name);
Lines make_zero_lines(std::size_t samples, const std::string& name);

/// Transforms of one line of complex samples in the host's memory, not normalised:
/// inverse(forward(f)) = size f. Any number of threads may use it at the same time.
///
/// Planning takes half a second for some thousand samples, once: FFTW's wisdom stays in the cache
/// folder, and while it does, results repeat to the bit. Lines below 512 samples, and those that
/// need not be fast, are planned without measuring.
///
/// accuracy  relative L2 error <= 2^-24 * sqrt(1 + log2(size)) against direct sums in double
///           (tests/cl/fft.cpp)
class LineFft {
public:
  static constexpr std::size_t alignment = 64;  // bytes, of the beginning of lines

  /// throws  DeviceError when FFTW cannot plan the size
  explicit LineFft(std::size_t size, bool is_fast = true);
  ~LineFft();
  LineFft(LineFft&&) noexcept;

  std::size_t size() const { return size_; }
  /// out[k] = sum of in[i] exp(-2 pi i k / size); the lines do not overlap, `in` is left as it was.
  void forward(const std::complex<float>* in, std::complex<float>* out) const;
  /// out[k] = sum of in[i] exp(+2 pi i k / size).
  void inverse(const std::complex<float>* in, std::complex<float>* out) const;

private:
  struct Plans;
  std::size_t size_;
  std::unique_ptr<Plans> plans_;
};

/// Plane of ny rows of nx samples, row-major. Only its first live_ny rows and live_nx columns hold
/// anything before `forward`, and only they are wanted after `inverse`: a back end may leave out
/// the rest of the work, and the rest of the plane is then undefined after `inverse`.
struct FftShape {
  std::size_t nx = 1, ny = 1;
  std::size_t live_nx = 1, live_ny = 1;
};

/// A plan for one shape on one device. Transforms are in place, not normalised: inverse(forward(f))
/// = nx ny f. A plan serves one thread at a time; different plans are independent.
///
/// accuracy  relative L2 error <= 2^-24 * sqrt(1 + log2(nx ny)) against direct sums in double, all
///           back ends (tests/cl/fft.cpp)
class Fft {
public:
  virtual ~Fft() = default;
  /// Sum of f exp(-2 pi i (x u / nx + y v / ny)); samples outside the live part must be zero.
  virtual void forward(ComplexBuffer& plane) = 0;
  /// Sum of f exp(+2 pi i (x u / nx + y v / ny)).
  virtual void inverse(ComplexBuffer& plane) = 0;
};

/// Plans for FftBackend::clfft or vkfft. The first plan of a shape takes seconds (on PoCL 8 to 30 s
/// and 2 s), later ones milliseconds, from the cache folder.
///
/// throws  DeviceError when the back end cannot serve the device or the size
std::unique_ptr<Fft> make_fft(const Device& device, FftBackend backend, const FftShape& shape);

}  // namespace raywave::cl
