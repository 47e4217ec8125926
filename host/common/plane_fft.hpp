// SPDX-License-Identifier: Apache-2.0
/// FFTs of planes in the host's memory, by its threads, which leave out what is dark before the
/// transform or unwanted after it.
#pragma once

#include <complex>
#include <cstddef>
#include <vector>

#include "host/common/line_fft.hpp"
#include "host/common/transpose.hpp"

namespace raywave {

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
