// SPDX-License-Identifier: Apache-2.0
#include "cl/fft.hpp"

#include <stdexcept>

namespace raywave::cl {

// Each is defined in the one file that includes its library.
std::unique_ptr<Fft> make_clfft(const Device& device, const FftShape& shape);  // fft_clfft.cpp
std::unique_ptr<Fft> make_vkfft(const Device& device, const FftShape& shape);  // fft_vkfft.cpp

bool serves(FftBackend backend, const DeviceInfo& device) {
  return backend == FftBackend::host || device.online_compiler;
}

FftBackend default_backend(const DeviceInfo& device) {
  const bool is_gpu = device.kind == DeviceKind::gpu && serves(FftBackend::vkfft, device);
  return is_gpu ? FftBackend::vkfft : FftBackend::host;
}

std::unique_ptr<Fft> make_fft(const Device& device, FftBackend backend, const FftShape& shape) {
  const auto& info = device.info();
  const auto text = std::to_string(shape.nx) + " x " + std::to_string(shape.ny);
  if (backend == FftBackend::host)
    throw std::invalid_argument("make_fft: the host transforms lines");
  if (!serves(backend, info))
    throw DeviceError("FFT back end " + std::string(name_of(backend)) +
                      " needs an online compiler, which " + info.name +
                      " has not; back end host serves it");
  if (shape.nx < 1 || shape.ny < 1 || shape.live_nx < 1 || shape.live_ny < 1 ||
      shape.live_nx > shape.nx || shape.live_ny > shape.ny)
    throw DeviceError(
        "FFT of " + text + " samples, of which " + std::to_string(shape.live_nx) + " x " +
        std::to_string(shape.live_ny) +
        " are live: sizes must be 1 or more, and the live part no larger than the plane");
  return backend == FftBackend::vkfft ? make_vkfft(device, shape) : make_clfft(device, shape);
}

}  // namespace raywave::cl
