// SPDX-License-Identifier: Apache-2.0
#include "cl/fft.hpp"

namespace raywave::cl {

// Each is defined by the one file that sees its library.
std::unique_ptr<Fft> make_fftw(const Device& device, const FftShape& shape);   // fft_fftw.cpp
std::unique_ptr<Fft> make_clfft(const Device& device, const FftShape& shape);  // fft_clfft.cpp

std::string_view name_of(FftBackend backend) { return backend == FftBackend::host ? "host" : "clfft"; }

bool serves(FftBackend backend, const DeviceInfo& device) { return backend == FftBackend::host || device.online_compiler; }

FftBackend default_backend(const DeviceInfo& device) {
  const bool host = device.kind == DeviceKind::cpu || !serves(FftBackend::clfft, device);
  return host ? FftBackend::host : FftBackend::clfft;
}

std::size_t next_fast_size(FftBackend, std::size_t n) {
  const auto is_fast = [](std::size_t m) {
    for (const std::size_t factor : {2u, 3u, 5u, 7u}) {
      while (m % factor == 0) m /= factor;
    }
    return m == 1;
  };
  if (n < 1) n = 1;
  while (!is_fast(n)) ++n;
  return n;
}

std::unique_ptr<Fft> make_fft(const Device& device, FftBackend backend, const FftShape& shape) {
  const auto& info = device.info();
  const auto text = std::to_string(shape.nx) + " x " + std::to_string(shape.ny);
  if (!serves(backend, info))
    throw DeviceError("FFT back end " + std::string(name_of(backend)) + " needs an online compiler, which " + info.name +
                      " has not; back end host serves it");
  if (shape.nx < 1 || shape.ny < 1 || shape.live_nx < 1 || shape.live_ny < 1 || shape.live_nx > shape.nx || shape.live_ny > shape.ny)
    throw DeviceError("FFT of " + text + " samples, of which " + std::to_string(shape.live_nx) + " x " + std::to_string(shape.live_ny) +
                      " are live: sizes must be 1 or more, and the live part no larger than the plane");
  return backend == FftBackend::host ? make_fftw(device, shape) : make_clfft(device, shape);
}

}  // namespace raywave::cl
