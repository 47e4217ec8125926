// SPDX-License-Identifier: Apache-2.0
/// FFTs of planes in the host's memory, by its threads, which leave out what is dark before the
/// transform or unwanted after it.
#pragma once

#include <complex>
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

namespace raywave {

// FFTs of single lines of complex samples in the host's memory (FFTW).

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

// Transposition of parts of planes, between rows in memory and lines for FFTs.

/// to[c * to_pitch + r] = from[r * from_pitch + c] for r < rows and c < columns.
using Transpose = void (*)(const std::complex<float>* from, std::size_t from_pitch,
                           std::size_t rows, std::size_t columns, std::complex<float>* to,
                           std::size_t to_pitch);

/// The fastest for this CPU.
Transpose transpose_here();

/// Samples from one line to the next in scratch memory: whole cache lines, an odd number, so that
/// lines do not contend for one place.
constexpr std::size_t pitch_of_lines(std::size_t line) { return ((line + 7) / 8 | 1) * 8; }

/// `count` samples of a line from number `first` on, past its end to its beginning.
struct LinePart {
  std::size_t first = 0, count = 0;
};

struct PlanePart {
  LinePart x, y;
};

/// Transforms of ny rows of nx samples in place, not normalised: inverse(forward(f)) = nx ny f.
/// A plan serves one thread at a time.
///
/// accuracy  as LineFft
class PlaneFft {
public:
  /// row_stride  samples in memory from a row to the next; 0: nx
  /// throws      DeviceError when FFTW cannot plan a size
  PlaneFft(std::size_t nx, std::size_t ny, std::size_t row_stride = 0);

  /// Sum of f exp(-2 pi i (x u / nx + y v / ny)).
  ///
  /// live    taken as zero elsewhere, whatever the plane holds there
  /// wanted  the part that is right afterwards; samples outside both parts may change
  void forward(std::complex<float>* plane, const PlanePart& live, const PlanePart& wanted);
  /// The same with +.
  void inverse(std::complex<float>* plane, const PlanePart& live, const PlanePart& wanted);

private:
  /// Lines for one thread.
  struct Scratch {
    Lines in, out;
  };
  void transform(std::complex<float>* plane, const PlanePart& live, const PlanePart& wanted,
                 bool inverse);
  void rows(std::complex<float>* plane, const LinePart& rows, const LinePart& live,
            const LinePart& wanted, bool inverse);
  void columns(std::complex<float>* plane, const LinePart& columns, const LinePart& live,
               const LinePart& wanted, bool inverse);

  std::size_t nx_, ny_, row_stride_;
  LineFft row_fft_, column_fft_;
  Transpose transpose_ = transpose_here();
  std::vector<Scratch> scratch_;  // one per thread
};

}  // namespace raywave
