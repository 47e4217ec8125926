// SPDX-License-Identifier: Apache-2.0
/// FFTs of single lines of complex samples in the host's memory (FFTW).
#pragma once

#include <complex>
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <string>

namespace raywave {

struct FreeLines {
  void operator()(std::complex<float>* samples) const { std::free(samples); }
};

/// Host memory for lines, where LineFft can work on it.
using Lines = std::unique_ptr<std::complex<float>[], FreeLines>;

/// Memory for `samples` samples, which are not set.
///
/// name    for messages ("sum of spectra")
/// throws  DeviceError when memory is out
Lines make_lines(std::size_t samples, const std::string& name);
Lines make_zero_lines(std::size_t samples, const std::string& name);

/// Transforms of one line, not normalised: inverse(forward(f)) = size f. Any number of threads may
/// use it at the same time.
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
  /// The same with +.
  void inverse(const std::complex<float>* in, std::complex<float>* out) const;

private:
  struct Plans;
  std::size_t size_;
  std::unique_ptr<Plans> plans_;
};

}  // namespace raywave
