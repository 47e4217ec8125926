// SPDX-License-Identifier: Apache-2.0
#include "host/view/reconstruct.hpp"

#include "host/common/error.hpp"
#include "host/reference/propagation.hpp"
#include "host/scene/scene.hpp"
#include "host/view/colour_picture.hpp"
#include "tests/support/devices.hpp"
#include "tests/support/render.hpp"

namespace raywave {
namespace {

using namespace test;
using std::numbers::pi;

constexpr auto host = cl::FftBackend::host;

/// Spherical wave of a point at (x, y, z) in front of the hologram, weighted by exp(-(r/waist)^2)
/// about (cx, cy) when waist > 0.
FieldStack point_hologram(const HologramSpec& h, glm::dvec3 point_m, double waist_m = 0,
                          glm::dvec2 centre_m = {}) {
  FieldStack field{h.resolution.x, h.resolution.y, 1, {}};
  for (int j = 0; j < field.ny; ++j) {
    for (int i = 0; i < field.nx; ++i) {
      const double x = (i - (field.nx - 1) / 2.0) * h.pitch_m.x,
                   y = ((field.ny - 1) / 2.0 - j) * h.pitch_m.y;
      const double r = std::hypot(x - point_m.x, y - point_m.y, point_m.z);
      const double off = std::hypot(x - centre_m.x, y - centre_m.y);
      const double weight = waist_m > 0 ? std::exp(-off * off / (waist_m * waist_m)) : 1;
      field.samples.emplace_back(
          std::polar(weight, std::remainder(2 * pi * r / h.wavelength_m, 2 * pi)));
    }
  }
  return field;
}

DEVICE_TEST(
    "a point in any quadrant focuses within one pixel and one depth of focus of where it is") {
  const HologramSpec h{{192, 160}, {4 * um, 4 * um}, 638e-9};
  for (const glm::dvec2 xy : {glm::dvec2(0.15 * mm, 0.11 * mm),
                              {-0.15 * mm, 0.11 * mm},
                              {-0.15 * mm, -0.11 * mm},
                              {0.15 * mm, -0.11 * mm}}) {
    const double z = 10 * mm;
    const auto hologram = point_hologram(h, {xy.x, xy.y, z});
    const double side = 192 * h.pitch_m.x,
                 depth_of_focus = 2 * h.wavelength_m * z * z / (side * side);
    double best_z = 0;
    Peak best{};
    for (int step = -6; step <= 6; ++step) {
      ReconstructSpec what{.z_m = z + step * depth_of_focus / 2};
      const auto peak = peak_of(reconstruct(device, host, hologram, h, what), h.pitch_m);
      if (peak.intensity > best.intensity) best = peak, best_z = what.z_m;
    }
    CHECK(std::abs(best.x_m - xy.x) <= h.pitch_m.x);
    CHECK(std::abs(best.y_m - xy.y) <= h.pitch_m.y);
    CHECK(std::abs(best_z - z) <= depth_of_focus);
  }
}

DEVICE_TEST(
    "a window larger than the hologram is seamless and the direct sum's, whatever the parities") {
  const HologramSpec h{{96, 80}, {0.5 * um, 0.5 * um}, 638e-9};
  const double z = 60 * um;
  // Comes from the upper right, across the tile's corner at (24, 20) um.
  const auto hologram = point_hologram(h, {50 * um, 42 * um, 120 * um}, 5 * um);
  const auto source = reference::to_double(hologram.samples);
  for (const glm::ivec2 window : {glm::ivec2(150, 131), {193, 80}, {192, 240}}) {
    ReconstructSpec what{.z_m = z, .window_m = glm::dvec2(window) * h.pitch_m};
    const auto image = reconstruct(device, host, hologram, h, what);
    REQUIRE(image.width == window.x);
    REQUIRE(image.height == window.y);
    const float brightest = *std::max_element(image.pixels.begin(), image.pixels.end());
    for (const int row : {window.y / 4, window.y / 2 - 1, window.y / 2}) {
      // Pieces of the row, each as the middle row of a plane of the hologram's size.
      for (int first = 0; first < window.x; first += h.resolution.x) {
        const double y = (window.y - 1) / 2.0 - row,
                     x = first + h.resolution.x / 2 - (window.x - 1) / 2.0;
        reference::Setup setup{h.resolution, h.pitch_m, h.wavelength_m, {}, -z};
        // Centres of even sizes lie between samples
        setup.shift_m = glm::dvec2(x - 0.5, y - 0.5) * h.pitch_m;
        const auto direct = reference::rayleigh_sommerfeld(source, setup, {h.resolution.y / 2 - 1});
        float worst = 0;
        for (int i = 0; i < h.resolution.x && first + i < window.x; ++i) {
          const float got = image.pixels[static_cast<std::size_t>(row) * window.x + first + i];
          worst =
              std::max(worst, std::abs(got - static_cast<float>(std::norm(direct[i]))) / brightest);
        }
        CAPTURE(window.x, window.y, row, first);
        // Measured 3e-4, where a beam lies across the edge of a tile's band
        CHECK(worst < 1e-3f);
      }
    }
  }
}

DEVICE_TEST("a hologram too large for the device's memory is propagated in pieces, to the same") {
  const HologramSpec h{{621, 501}, {4 * um, 4 * um}, 638e-9};
  const auto hologram = point_hologram(h, {0.4 * mm, 0.3 * mm, 30 * mm}, 1 * mm, {0.2 * mm, 0});
  const ReconstructSpec what{.z_m = 24 * mm, .window_m = glm::dvec2(2.8 * mm, 1.7 * mm)};
  auto info = device.info();
  info.memory_bytes = 17 << 20;  // less than one piece needs
  const auto whole = reconstruct(device, host, hologram, h, what),
             pieces = reconstruct(cl::Device(info), host, hologram, h, what);
  REQUIRE(pieces.width == whole.width);
  const float brightest = *std::max_element(whole.pixels.begin(), whole.pixels.end());
  float worst = 0;
  for (std::size_t i = 0; i < whole.pixels.size(); ++i)
    worst = std::max(worst, std::abs(pieces.pixels[i] - whole.pixels[i]) / brightest);
  CHECK(worst < 2e-3f);
  CHECK(worst > 0);  // not by the same way
  info.memory_bytes = 1 << 20;
  CHECK_SAYS(device_error_of([&] { reconstruct(cl::Device(info), host, hologram, h, what); }),
             "a smaller");
}

DEVICE_TEST("seen from +x, a point beyond the plane looked at moves to +x, one before it to -x") {
  const HologramSpec h{{160, 128}, {4 * um, 4 * um}, 638e-9};
  const auto hologram = point_hologram(h, {0, 0, 12 * mm});
  const auto place = [&](glm::dvec2 view, double z_m) {
    ReconstructSpec what{.z_m = z_m, .view = view, .aperture = {0.4, 0.4}};
    const auto image = reconstruct(device, host, hologram, h, what);
    glm::dvec2 sum(0);
    double weight = 0;
    for (int j = 0; j < image.height; ++j) {
      for (int i = 0; i < image.width; ++i) {
        const double w = image.pixels[static_cast<std::size_t>(j) * image.width + i];
        sum += w * glm::dvec2(i - (image.width - 1) / 2.0, (image.height - 1) / 2.0 - j);
        weight += w;
      }
    }
    return sum / weight;
  };
  // The line from a place (vx, vy, 0) on the hologram to the point meets the plane z at (1 - z / 12
  // mm) of (vx, vy): on the same side in front of the point, on the other behind it.
  for (const glm::dvec2 view : {glm::dvec2(0.5, 0), {0, 0.5}, {-0.4, -0.5}}) {
    for (const double z_m : {9 * mm, 15 * mm}) {
      const auto expected = view * glm::dvec2(80, 64) * (1 - z_m / (12 * mm));
      const auto got = place(view, z_m);
      INFO("view " << view.x << ", " << view.y << ", z " << z_m << ": " << got.x << ", " << got.y);
      CHECK(std::abs(got.x - expected.x) < 1.5);
      CHECK(std::abs(got.y - expected.y) < 1.5);
    }
  }
}

DEVICE_TEST(
    "a picture around another middle is that part of a wider one, also beside the hologram") {
  const HologramSpec h{{96, 80}, {4 * um, 4 * um}, 638e-9};
  const auto hologram = point_hologram(h, {0.25 * mm, -0.1 * mm, 8 * mm});
  const auto picture = [&](glm::ivec2 size, glm::ivec2 middle_px) {
    ReconstructSpec what{.z_m = 8 * mm, .window_m = glm::dvec2(size) * h.pitch_m};
    what.centre_m = glm::dvec2(middle_px) * h.pitch_m;
    return reconstruct(device, host, hologram, h, what);
  };
  const auto wide = picture({192, 160}, {0, 0}), part = picture({32, 16}, {60, -24});
  double worst = 0, brightest = 0;
  for (int y = 0; y < 16; ++y) {
    for (int x = 0; x < 32; ++x) {
      const float there = wide.pixels[static_cast<std::size_t>(y + 72 + 24) * 192 + x + 80 + 60],
                  here = part.pixels[static_cast<std::size_t>(y) * 32 + x];
      worst = std::max(worst, double{std::abs(there - here)});
      brightest = std::max(brightest, double{here});
    }
  }
  CHECK(brightest > 100);  // the point's image
  CHECK(worst <= 0.01 * brightest);
}

DEVICE_TEST("frames are averaged") {
  const HologramSpec h{{40, 32}, {2 * um, 2 * um}, 638e-9};
  const auto a = point_hologram(h, {10 * um, 0, 1 * mm}),
             b = point_hologram(h, {-20 * um, 6 * um, 1 * mm});
  FieldStack both{40, 32, 2, a.samples};
  both.samples.insert(both.samples.end(), b.samples.begin(), b.samples.end());
  ReconstructSpec what{.z_m = 1 * mm, .window_m = glm::dvec2(100 * um, 70 * um)};
  for (const auto backend : backends_of(device)) {
    const auto of_a = reconstruct(device, backend, a, h, what),
               of_b = reconstruct(device, backend, b, h, what);
    double last = 0;
    const auto of_both =
        reconstruct(device, backend, both, h, what, [&](double share) { last = share; });
    CHECK(last == 1.0);
    for (std::size_t i = 0; i < of_both.pixels.size(); ++i)
      CHECK_THAT(of_both.pixels[i],
                 Catch::Matchers::WithinAbs((of_a.pixels[i] + of_b.pixels[i]) / 2, 1e-5));
  }
}

DEVICE_TEST("parts of a window that no light reaches are black") {
  const HologramSpec h{{32, 32}, {10 * um, 10 * um}, 638e-9};
  ReconstructSpec what{.z_m = 1 * mm, .window_m = glm::dvec2(5 * mm, 0.3 * mm)};
  const auto image = reconstruct(device, host, point_hologram(h, {0, 0, 2 * mm}), h, what);
  CHECK(image.pixels.front() == 0);
  CHECK(image.pixels[image.pixels.size() / 2 + image.width / 2] > 0);
}

DEVICE_TEST("a picture in the hologram's own plane is its light, sample for sample") {
  const HologramSpec h{{32, 24}, {10 * um, 10 * um}, 638e-9};
  auto hologram = point_hologram(h, {0.04 * mm, -0.02 * mm, 2 * mm});
  for (std::size_t i = 0; i < hologram.samples.size(); ++i)
    hologram.samples[i] *= static_cast<float>(1 + i % 7);
  const auto image = reconstruct(device, host, hologram, h, {.z_m = 0});
  double light = 0, shown = 0, apart = 0;
  for (std::size_t i = 0; i < image.pixels.size(); ++i) light += std::norm(hologram.samples[i]);
  for (const auto pixel : image.pixels) shown += pixel;
  for (std::size_t i = 0; i < image.pixels.size(); ++i)
    apart =
        std::max(apart, std::abs(image.pixels[i] / shown - std::norm(hologram.samples[i]) / light));
  CHECK(apart * static_cast<double>(image.pixels.size()) < 1e-3);
}

DEVICE_TEST("impossible reconstructions are refused") {
  const HologramSpec h{{8, 8}, {4 * um, 4 * um}, 638e-9};
  const auto hologram = point_hologram(h, {0, 0, 1 * mm});
  const auto refused = [&](const ReconstructSpec& what) {
    CHECK_THROWS_AS(reconstruct(device, host, hologram, h, what), InputError);
  };
  ReconstructSpec what{.z_m = std::nan("")};
  refused(what);
  what = {};
  what.window_m = glm::dvec2(1e6, 1e6);
  refused(what);
  what.window_m = glm::dvec2(-1, 1);
  refused(what);
  what = {};
  what.aperture = {0, 1};
  refused(what);
  CHECK_THROWS_AS(reconstruct(device, host, hologram, {{8, 9}, h.pitch_m, h.wavelength_m}, {}),
                  InputError);
}

TEST_CASE("exposure puts the percentile at white, on the sRGB curve, and leaves black black") {
  Image image{101, 1, {}};
  for (int i = 0; i <= 100; ++i) image.pixels.push_back(static_cast<float>(i));
  const auto pixels = expose_to({&image, 1}, 50);
  CHECK(white_of({&image, 1}, 50) == 50);
  CHECK(pixels[0] == 0);
  CHECK(pixels[50] == 255);
  CHECK(pixels[100] == 255);
  CHECK(pixels[25] == 188);  // sRGB of one half: 0.7354
  const auto exposed = [](const Image& one, double percentile) {
    return expose_to({&one, 1}, white_of({&one, 1}, percentile));
  };
  CHECK(exposed({2, 2, {0, 0, 0, 0}}, 99) == std::vector<std::uint8_t>(4));
  CHECK(exposed({2, 2, {0, 0, 0, 3}}, 50) == std::vector<std::uint8_t>{0, 0, 0, 255});
  CHECK(exposed({}, 99).empty());
}

}  // namespace
}  // namespace raywave
