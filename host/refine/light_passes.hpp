// SPDX-License-Identifier: Apache-2.0
/// Propagation from a hologram to a picture and back, by the host's threads.
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <functional>
#include <map>
#include <vector>

#include "host/common/plane_fft.hpp"

namespace raywave::refinement {

/// What light passes along x or y, from the open part of the hologram on.
struct LightLine {
  std::size_t open = 1;     // samples of the open part
  std::size_t picture = 1;  // of its transform
  // Where it is propagated over its spectrum first: samples of that, and of the transform of finer
  // samples; 0: it is not
  std::size_t spectrum = 0, finer = 0;
  std::size_t between() const { return spectrum > 0 ? spectrum : open; }  // samples of a row
  double sine = 0;                          // from a sample of the spectrum to the next
  std::vector<std::complex<float>> phases;  // of the spectrum, beside those of kernels/refine
  // Of the finer samples that are lit, before the last transform; none: these are the picture's
  std::vector<std::complex<float>> chirp;
};

struct LightPath {
  LightLine x, y;
  float turns = 0, more = 0;  // of the spectrum: kernels/refine/spectrum.h
  bool inverse = true;        // the last transform; forward otherwise
  int transforms() const;     // FFTs of planes
};

/// Transforms along x and along y commute, but for the phases of a spectrum. So three passes over
/// memory do all: rows of the open part, which become a spectrum's; columns, with its phases on
/// their way to the picture; rows of the picture.
class LightPasses {
public:
  using Sample = std::complex<float>;

  LightPasses();

  /// Plans the transforms of a path, and takes memory for so many rows of its picture: otherwise
  /// the first `show` does.
  ///
  /// throws  DeviceError when memory is out
  void prepare(const LightPath& path, std::size_t rows);

  /// The picture's light.
  ///
  /// open    writes a row of the open part; called by several threads
  /// wanted  the part of the picture that is made, in rows of path.x.picture samples; it does not
  ///         go on past an end. The rest of its rows may change
  void show(const LightPath& path, const std::function<void(std::size_t row, Sample* to)>& open,
            Sample* picture, const PlanePart& wanted);
  /// The adjoint.
  ///
  /// live  the part of the picture that is not zero
  /// open  takes a row of the open part; called by several threads
  void back(const LightPath& path, const Sample* picture, const PlanePart& live,
            const std::function<void(std::size_t row, const Sample* from)>& open);

private:
  /// Lines for one thread.
  struct Scratch {
    Lines first, finer, finer_transformed, picture;
    Lines columns, columns_transformed;  // of a tile
    std::size_t line = 0, column = 0;    // samples that they have room for
  };
  /// Transforms along x or y; null where there is none.
  struct Ffts {
    Ffts(LightPasses& passes, const LightLine& line);
    const LineFft *spectrum, *finer, *picture;
  };
  void fit(const LightPath& path, std::size_t rows);
  Sample* tile(std::size_t number) const { return between_.get() + number * rows_ * tile_width; }
  void gather(std::size_t row, std::size_t samples, Sample* line) const;
  void scatter(const Sample* line, std::size_t row, std::size_t samples) const;
  /// work(scratch, i) for i = 0, ..., count - 1, of which a thread takes `grain` at a time.
  struct Pass {
    std::size_t count, grain;
    std::function<void(Scratch&, std::size_t)> work;
  };
  void run(const std::array<Pass, 3>& passes);
  Pass over_columns(std::size_t count, std::size_t line, const LinePart& from, const LinePart& to,
                    const std::function<void(Scratch&, std::size_t column, const Sample* from,
                                             Sample* to)>& work) const;

  static constexpr std::size_t tile_width = 16;  // columns: two cache lines
  std::map<std::size_t, LineFft> ffts_;
  Transpose transpose_ = transpose_here();
  std::vector<Scratch> scratch_;
  // Rows between the passes, in tiles: 16 samples of each row next to each other
  Lines between_;
  std::size_t widest_ = 0, capacity_ = 0, rows_ = 0, pitch_ = 0;
};

}  // namespace raywave::refinement
