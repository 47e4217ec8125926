// SPDX-License-Identifier: Apache-2.0
/// Complex FFTs of planes in a device's memory, behind one type for every back end there. Lines on
/// the host: host/common/plane_fft.hpp.
#pragma once

#include <memory>

#include "cl/buffer.hpp"
#include "host/common/fft_backend.hpp"

namespace raywave::cl {

using raywave::all_backends;
using raywave::FftBackend;
using raywave::name_of;

/// True when the back end can serve the device (clFFT and VkFFT need an online compiler).
bool serves(FftBackend backend, const DeviceInfo& device);

/// vkfft on GPUs with an online compiler (2.5 to 3.5 times as fast as clfft on an H100,
/// docs/devices.md), else host.
FftBackend default_backend(const DeviceInfo& device);

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
