// SPDX-License-Identifier: Apache-2.0
/// Two-dimensional complex FFT on a device's memory, behind one type for every back end.
#pragma once

#include <memory>
#include <string_view>

#include "cl/buffer.hpp"

namespace raywave::cl {

enum class FftBackend {
  host,   // FFTW on the mapped buffer: no transfer on CPU devices, one copy each way on others
  clfft,  // clFFT on the device
};

std::string_view name_of(FftBackend backend);

/// Whether the back end can serve the device (clFFT needs an online compiler).
bool serves(FftBackend backend, const DeviceInfo& device);

/// host on CPUs and devices without an online compiler, else clfft.
FftBackend default_backend(const DeviceInfo& device);

/// The smallest size >= n that the back end transforms fast: a product of 2, 3, 5 and 7, for both alike, so that they work on the same
/// planes. (The host does any size; clFFT also 11 and 13, slower.)
std::size_t next_fast_size(FftBackend backend, std::size_t n);

/// Plane of ny rows of nx samples, row-major. Only its first live_ny rows and live_nx columns hold anything before `forward`, and only they
/// are wanted after `inverse`: a back end may leave out the rest of the work, and the rest of the plane is then undefined after `inverse`.
struct FftShape {
  std::size_t nx = 1, ny = 1;
  std::size_t live_nx = 1, live_ny = 1;
};

/// A plan for one shape on one device. Transforms are in place, not normalised: inverse(forward(f)) = nx ny f. A plan serves one thread at
/// a time; different plans are independent.
///
/// accuracy  relative L2 error <= 2^-24 * sqrt(1 + log2(nx ny)) against direct sums in double, both back ends (tests/fft.cpp)
class Fft {
public:
  virtual ~Fft() = default;
  virtual void forward(
      ComplexBuffer& plane) = 0;  // sum of f exp(-2 pi i (x u / nx + y v / ny)); samples outside the live part must be zero
  virtual void inverse(ComplexBuffer& plane) = 0;  // the same with +
};

/// Plans. The first plan of a shape takes seconds (host: 3 s for 3840 x 2160; clFFT on PoCL: 8 to 30 s), later ones milliseconds, from the
/// cache folder. Planes below 256 x 256 samples are planned without measuring. While the cache folder is kept, results repeat to the bit.
///
/// throws  DeviceError when the back end cannot serve the device or the size
std::unique_ptr<Fft> make_fft(const Device& device, FftBackend backend, const FftShape& shape);

}  // namespace raywave::cl
