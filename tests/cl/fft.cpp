// SPDX-License-Identifier: Apache-2.0
#include "cl/fft.hpp"

#include <cmath>
#include <functional>

#include "host/common/plane_fft.hpp"
#include "host/reference/propagation.hpp"
#include "tests/support/devices.hpp"

namespace raywave {
using cl::FftBackend;
using cl::FftShape;
using Plane = std::vector<std::complex<double>>;

namespace {

/// The sums that define the transform.
Plane direct_dft(const Plane& plane, std::size_t nx, std::size_t ny, int sign) {
  return reference::direct_transform(plane, {static_cast<int>(nx), static_cast<int>(ny)}, sign);
}

Plane random_plane(std::size_t nx, std::size_t ny, std::size_t live_nx, std::size_t live_ny,
                   unsigned seed) {
  std::mt19937 random(seed);
  // Floats, so that device and oracle start from the same numbers
  std::uniform_real_distribution<float> value(-1, 1);
  Plane plane(nx * ny);
  for (std::size_t y = 0; y < live_ny; ++y) {
    for (std::size_t x = 0; x < live_nx; ++x) plane[y * nx + x] = {value(random), value(random)};
  }
  return plane;
}

enum class Direction { forward, inverse };

/// The host's transform of a plane, line by line.
void transform_on_host(std::vector<std::complex<float>>& plane, std::size_t nx, std::size_t ny,
                       Direction direction) {
  const auto lines = [&](std::size_t n, std::size_t count, std::size_t stride,
                         std::size_t distance) {
    const LineFft fft(n);
    const auto in_line = make_lines(n, "line"), out_line = make_lines(n, "line");
    std::complex<float>*in = in_line.get(), *out = out_line.get();
    for (std::size_t line = 0; line < count; ++line) {
      for (std::size_t i = 0; i < n; ++i) in[i] = plane[line * distance + i * stride];
      const std::vector<std::complex<float>> before(in, in + n);
      direction == Direction::forward ? fft.forward(in, out) : fft.inverse(in, out);
      CHECK(std::equal(before.begin(), before.end(), in));
      for (std::size_t i = 0; i < n; ++i) plane[line * distance + i * stride] = out[i];
    }
  };
  lines(nx, ny, 1, nx);
  lines(ny, nx, nx, 1);
}

/// A back end's transform of planes of one shape; fails when it writes behind the plane.
class Transform {
public:
  Transform(const cl::Device& device, FftBackend backend, const FftShape& shape)
      : device_(device), shape_(shape) {
    if (backend != FftBackend::host) fft_ = cl::make_fft(device, backend, shape);
  }

  Plane operator()(Direction direction, const Plane& plane) const {
    const std::complex<float> canary(12345, -54321);
    std::vector<std::complex<float>> samples(plane.begin(), plane.end());
    samples.resize(plane.size() + 64, canary);
    if (fft_) {
      cl::ComplexBuffer buffer(device_, samples, "plane");
      direction == Direction::forward ? fft_->forward(buffer) : fft_->inverse(buffer);
      buffer.read(samples);
    } else {
      transform_on_host(samples, shape_.nx, shape_.ny, direction);
    }
    CHECK(std::all_of(samples.end() - 64, samples.end(), [&](auto s) { return s == canary; }));
    return Plane(samples.begin(), samples.end() - 64);
  }

private:
  cl::Device device_;
  FftShape shape_;
  std::unique_ptr<cl::Fft> fft_;
};

double norm(const Plane& plane) {
  double sum = 0;
  for (const auto& value : plane) sum += std::norm(value);
  return std::sqrt(sum);
}

/// Relative L2 error of the first live_ny rows and live_nx columns.
double error_of(const Plane& found, const Plane& expected, std::size_t nx, std::size_t live_nx,
                std::size_t live_ny) {
  double error = 0, size = 0;
  for (std::size_t y = 0; y < live_ny; ++y) {
    for (std::size_t x = 0; x < live_nx; ++x) {
      error += std::norm(found[y * nx + x] - expected[y * nx + x]);
      size += std::norm(expected[y * nx + x]);
    }
  }
  return std::sqrt(error / size);
}

/// c eps sqrt(log2 n), the growth of rounding errors in an FFT.
double tolerance(std::size_t nx, std::size_t ny) {
  const double c = 1.5;  // measured: FFTW <= 0.64, clFFT on PoCL <= 0.64, but 0.94 at 1 x 7
  return c * 0x1p-24 * std::sqrt(1 + std::log2(static_cast<double>(nx * ny)));
}

/// Calls f for every device and every back end that serves it.
void for_each_backend(const std::function<void(const cl::Device&, FftBackend)>& f) {
  for (const auto& device : test::all_devices()) {
    for (const auto backend : test::backends_of(device)) {
      INFO(device.info().name << ", " << cl::name_of(backend));
      f(device, backend);
    }
  }
}

void check_against_direct_sum(const cl::Device& device, FftBackend backend, const FftShape& shape) {
  INFO(shape.nx << " x " << shape.ny << ", live " << shape.live_nx << " x " << shape.live_ny);
  const auto [nx, ny, live_nx, live_ny] = shape;
  const Transform transform(device, backend, shape);
  const auto field = random_plane(nx, ny, live_nx, live_ny, 1);
  const double forward_error =
      error_of(transform(Direction::forward, field), direct_dft(field, nx, ny, -1), nx, nx, ny);
  const auto spectrum = random_plane(nx, ny, nx, ny, 2);
  const double inverse_error = error_of(transform(Direction::inverse, spectrum),
                                        direct_dft(spectrum, nx, ny, 1), nx, live_nx, live_ny);
  CHECK(forward_error <= tolerance(nx, ny));
  CHECK(inverse_error <= tolerance(nx, ny));
}

}  // namespace

TEST_CASE("both transforms equal the direct sum in double") {
  for_each_backend([](const cl::Device& device, FftBackend backend) {
    // clFFT on PoCL takes seconds for each new shape.
    std::vector<std::pair<std::size_t, std::size_t>> sizes{{1, 1}, {1, 7}, {12, 18}, {60, 35}};
    if (backend == FftBackend::host)
      sizes.insert(sizes.end(), {{7, 1}, {5, 3}, {8, 8}, {64, 48}, {17, 23}});
    for (const auto& [nx, ny] : sizes) check_against_direct_sum(device, backend, {nx, ny, nx, ny});
  });
}

TEST_CASE(
    "with a live corner, forward is the transform of the zero-padded field and inverse is right "
    "in the corner") {
  for_each_backend([](const cl::Device& device, FftBackend backend) {
    check_against_direct_sum(device, backend, {60, 35, 31, 18});
    if (backend != FftBackend::clfft) check_against_direct_sum(device, backend, {48, 20, 17, 5});
  });
}

TEST_CASE(
    "inverse after forward returns nx ny times the field, energy and sums are kept, and back ends "
    "agree") {
  const std::size_t nx = 384, ny = 240;
  const double samples = nx * ny;
  const auto f = random_plane(nx, ny, nx, ny, 3), g = random_plane(nx, ny, nx, ny, 4);
  Plane sum(f.size());
  for (std::size_t i = 0; i < f.size(); ++i) sum[i] = 0.5 * f[i] - 2.0 * g[i];
  std::vector<Plane> spectra;
  for_each_backend([&](const cl::Device& device, FftBackend backend) {
    const Transform transform(device, backend, {nx, ny, nx, ny});
    const auto F = transform(Direction::forward, f), G = transform(Direction::forward, g);
    CHECK(std::abs(norm(F) / norm(f) / std::sqrt(samples) - 1) <= tolerance(nx, ny));

    auto back = transform(Direction::inverse, F);
    for (auto& value : back) value /= samples;
    CHECK(error_of(back, f, nx, nx, ny) <= 2 * tolerance(nx, ny));

    Plane expected(f.size());
    for (std::size_t i = 0; i < f.size(); ++i) expected[i] = 0.5 * F[i] - 2.0 * G[i];
    CHECK(error_of(transform(Direction::forward, sum), expected, nx, nx, ny) <=
          2 * tolerance(nx, ny));

    spectra.push_back(F);
    CHECK(error_of(F, spectra.front(), nx, nx, ny) <= 2 * tolerance(nx, ny));
  });
}

TEST_CASE("a second plan of one shape gives the same bits") {
  for_each_backend([](const cl::Device& device, FftBackend backend) {
    const FftShape shape{384, 240, 384, 240};
    const auto field = random_plane(shape.nx, shape.ny, shape.nx, shape.ny, 5);
    const auto spectrum = [&] {
      return Transform(device, backend, shape)(Direction::forward, field);
    };
    CHECK(spectrum() == spectrum());
  });
}

TEST_CASE("sizes that are not positive, or live parts beyond the plane, are errors") {
  for_each_backend([](const cl::Device& device, FftBackend backend) {
    if (backend == FftBackend::host) {
      CHECK_THROWS_AS(LineFft(0), cl::DeviceError);
      return;
    }
    CHECK_THROWS_AS(cl::make_fft(device, backend, {0, 8, 0, 8}), cl::DeviceError);
    CHECK_THROWS_AS(cl::make_fft(device, backend, {8, 8, 9, 8}), cl::DeviceError);
  });
}

DEVICE_TEST("a size that clFFT cannot do is an error that says which it can") {
  if (!cl::serves(FftBackend::clfft, device.info())) return;
  CHECK_SAYS(test::device_error_of([&] {
               cl::make_fft(device, FftBackend::clfft, {17, 4, 17, 4});
             }),
             "products of 2, 3, 5, 7");
}

TEST_CASE(
    "the next fast size is the smallest that is no smaller: a product of 2, 3, 5 and 7 and, above "
    "32, a multiple of 16") {
  std::vector<bool> is_fast(20001);
  for (std::size_t a = 1; a <= 20000; a *= 2)
    for (std::size_t b = a; b <= 20000; b *= 3)
      for (std::size_t c = b; c <= 20000; c *= 5)
        for (std::size_t d = c; d <= 20000; d *= 7) is_fast[d] = d <= 32 || d % 16 == 0;
  std::size_t wrong = 0, expected = 20160;
  for (std::size_t n = 20000; n >= 1; --n) {
    if (is_fast[n]) expected = n;
    wrong += next_fast_size(n) != expected;
  }
  CHECK(wrong == 0);
  CHECK(next_fast_size(0) == 1);
  CHECK(next_fast_size(1350) == 1440);
}

TEST_CASE("long lines are planned by measuring and equal the direct sum") {
  for (const std::size_t n : {511u, 512u, 720u, 1000u}) {
    const auto line = random_plane(n, 1, n, 1, 6);
    for (const auto direction : {Direction::forward, Direction::inverse}) {
      std::vector<std::complex<float>> samples(line.begin(), line.end());
      transform_on_host(samples, n, 1, direction);
      const auto expected = direct_dft(line, n, 1, direction == Direction::forward ? -1 : 1);
      CHECK(error_of(Plane(samples.begin(), samples.end()), expected, n, n, 1) <= tolerance(n, 1));
    }
  }
}

TEST_CASE("GPUs take VkFFT, other devices and those without a compiler the host's FFT") {
  cl::DeviceInfo device{.kind = cl::DeviceKind::gpu, .online_compiler = true};
  CHECK(cl::default_backend(device) == FftBackend::vkfft);
  device.kind = DeviceKind::accelerator;
  CHECK(cl::default_backend(device) == FftBackend::host);
  device.kind = cl::DeviceKind::cpu;
  CHECK(cl::default_backend(device) == FftBackend::host);
  device.kind = cl::DeviceKind::gpu;
  device.online_compiler = false;
  CHECK(cl::default_backend(device) == FftBackend::host);
  CHECK_FALSE(cl::serves(FftBackend::clfft, device));
}

}  // namespace raywave
