// SPDX-License-Identifier: Apache-2.0
#include "cl/fft.hpp"

#include <algorithm>
#include <stdexcept>

namespace raywave::cl {

// Each is defined in the one file that includes its library.
std::unique_ptr<Fft> make_clfft(const Device& device, const FftShape& shape);  // fft_clfft.cpp
std::unique_ptr<Fft> make_vkfft(const Device& device, const FftShape& shape);  // fft_vkfft.cpp

std::string_view name_of(FftBackend backend) {
  switch (backend) {
    case FftBackend::host:
      return "host";
    case FftBackend::clfft:
      return "clfft";
    case FftBackend::vkfft:
      break;
  }
  return "vkfft";
}

bool serves(FftBackend backend, const DeviceInfo& device) {
  return backend == FftBackend::host || device.online_compiler;
}

FftBackend default_backend(const DeviceInfo& device) {
  const bool host = device.kind == DeviceKind::cpu || !serves(FftBackend::clfft, device);
  return host ? FftBackend::host : FftBackend::clfft;
}

std::size_t next_fast_size(std::size_t n) {
  constexpr std::size_t packet = 16;
  const auto is_fast = [](std::size_t m) {
    for (const std::size_t factor : {2u, 3u, 5u, 7u}) {
      while (m % factor == 0) m /= factor;
    }
    return m == 1;
  };
  const std::size_t step = n > 2 * packet ? packet : 1;
  std::size_t steps = std::max<std::size_t>(1, (n + step - 1) / step);
  while (!is_fast(steps)) ++steps;
  return steps * step;
}

Lines make_lines(std::size_t samples, const std::string& name) {
  const std::size_t bytes =
      (samples * sizeof(std::complex<float>) / LineFft::alignment + 1) * LineFft::alignment;
  Lines lines(static_cast<std::complex<float>*>(std::aligned_alloc(LineFft::alignment, bytes)));
  if (!lines) throw MemoryError(name + ": " + format_bytes(bytes) + " asked, out of host memory");
  return lines;
}

Lines make_zero_lines(std::size_t samples, const std::string& name) {
  auto lines = make_lines(samples, name);
  std::fill_n(lines.get(), samples, std::complex<float>{});
  return lines;
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
