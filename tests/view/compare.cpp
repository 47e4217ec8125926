// SPDX-License-Identifier: Apache-2.0
#include "host/view/compare.hpp"

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <numeric>

#include "host/encode/shown.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/files.hpp"

namespace raywave {
namespace {

using Catch::Approx;
using std::numbers::pi;

constexpr double eps = std::numeric_limits<float>::epsilon();

FieldStack field_of(int nx, int ny,
                    const std::function<std::complex<double>(int x, int y)>& value) {
  FieldStack field{nx, ny, 1, {}};
  for (int y = 0; y < ny; ++y)
    for (int x = 0; x < nx; ++x) field.samples.emplace_back(value(x, y));
  return field;
}

/// Unit samples; modes of different numbers are orthogonal.
std::complex<double> mode(int number, int x, int nx) {
  return std::polar(1.0, 2 * pi * number * x / nx);
}

FieldStack random_field(int nx, int ny, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  return field_of(nx, ny, [&](int, int) { return std::complex(normal(random), normal(random)); });
}

FieldStack times(FieldStack field, std::complex<double> factor) {
  for (auto& s : field.samples) s = std::complex<float>(std::complex<double>(s) * factor);
  return field;
}

Image image_of(int width, int height, const std::function<double(int x, int y)>& value) {
  Image image{width, height, {}};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) image.pixels.push_back(static_cast<float>(value(x, y)));
  return image;
}

Image random_image(int width, int height, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  return image_of(width, height, [&](int, int) { return uniform(random); });
}

double mean_of(const Image& image) {
  return std::accumulate(image.pixels.begin(), image.pixels.end(), 0.0) /
         static_cast<double>(image.pixels.size());
}

/// Pixel of the picture continued by mirrors at its edges, found by walking.
double mirrored_pixel(const Image& image, int x, int y) {
  const auto fold = [](int i, int n) {
    while (i < 0 || i >= n) i = i < 0 ? -1 - i : 2 * n - 1 - i;
    return i;
  };
  return image
      .pixels[static_cast<std::size_t>(fold(y, image.height)) * image.width + fold(x, image.width)];
}

TEST_CASE(
    "a field turned by a phase correlates with itself by 1, and only the raw error sees the turn") {
  for (const auto& a : {random_field(17, 12, 1), random_field(1, 1, 2)}) {
    for (const double angle : {0.0, 0.3, pi / 2, pi}) {
      const auto c = compare_fields(a, times(a, std::polar(1.0, angle)));
      CHECK(c.correlation == Approx(1).margin(1e-12));
      CHECK(c.error == Approx(2 * std::sin(angle / 2)).margin(eps));
      CHECK(c.error_scaled <= eps);  // samples are rounded to float
      CHECK(c.energy_ratio == Approx(1).margin(eps));
    }
  }
}

TEST_CASE(
    "a field scaled has the square of the scale as energy ratio, also at the ends of float's "
    "range") {
  for (const double unit : {1e-30, 1.0, 1e30}) {
    const auto a = times(random_field(9, 7, 3), unit);
    const auto c = compare_fields(a, times(a, std::complex(0.0, 3.0)));
    CHECK(c.correlation == Approx(1).margin(1e-12));
    CHECK(c.energy_ratio == Approx(9).epsilon(eps));
    CHECK(c.error == Approx(std::sqrt(10)).epsilon(eps));
    CHECK(c.error_scaled <= eps);
  }
}

TEST_CASE(
    "a field at angle t to another correlates by cos t, and is wrong by sin t however scaled") {
  const int nx = 32, ny = 5;
  const auto a = field_of(nx, ny, [](int x, int) { return mode(1, x, nx); });
  for (const double t : {1e-3, 0.4, 1.2, pi / 2}) {
    const auto b = field_of(nx, ny, [&](int x, int) {
      return std::cos(t) * mode(1, x, nx) + std::sin(t) * mode(4, x, nx);
    });
    const auto c = compare_fields(a, b);
    CHECK(c.correlation == Approx(std::cos(t)).margin(eps));
    CHECK(c.error_scaled == Approx(std::sin(t)).margin(eps));
    CHECK(c.error == Approx(2 * std::sin(t / 2)).margin(eps));
    CHECK(c.energy_ratio == Approx(1).margin(2 * eps));
    // |c b - a|^2 has sin^2 t as its mean.
    double square = 0;
    for (const float d : c.difference.pixels) square += 1.0 * d * d / (nx * ny);
    CHECK(std::sqrt(square) == Approx(std::sin(t)).margin(2 * eps));
  }
}

TEST_CASE("pixels of squares show dots that are no whole number of squares apart without a beat") {
  constexpr int side = 4, squares = 100;
  Image dots{side * squares, side * squares, {}};
  dots.pixels.resize(std::size_t(dots.width) * dots.height);
  for (int y = 0; y < dots.height; ++y)
    for (int x = 0; x < dots.width; ++x)
      dots.pixels[std::size_t(y) * dots.width + x] = x % 17 < 2 && y % 17 < 2 ? 1.0f : 0.0f;
  const auto small = blurred(averaged(dots, side), 3);
  REQUIRE(small.width == squares);
  double sum = 0, squared = 0, count = 0;
  for (int y = 15; y < squares - 15; ++y)
    for (int x = 15; x < squares - 15; ++x) {
      const double v = small.pixels[std::size_t(y) * squares + x];
      sum += v;
      squared += v * v;
      ++count;
    }
  const double mean = sum / count, deviation = std::sqrt(squared / count - mean * mean);
  CHECK(mean == Catch::Approx(4 / (17.0 * 17)).epsilon(1e-3));
  CHECK(deviation < 5e-3 * mean);
  // Squares at the edge are smaller, and as bright
  const Image white{10, 7, std::vector<float>(70, 0.5f)};
  const auto edge = averaged(white, 4);
  CHECK(edge.width == 3);
  CHECK(edge.height == 2);
  for (const float v : edge.pixels) CHECK(v == Catch::Approx(0.5f));
}

TEST_CASE("frames are compared pairwise and averaged") {
  const int nx = 16;
  const auto first = field_of(nx, 2, [](int x, int) { return mode(1, x, nx); });
  const auto second = field_of(nx, 2, [](int x, int) { return mode(3, x, nx); });
  FieldStack a = first, b = times(first, 2);
  a.frames = b.frames = 2;
  a.samples.insert(a.samples.end(), first.samples.begin(), first.samples.end());
  b.samples.insert(b.samples.end(), second.samples.begin(), second.samples.end());
  const auto c = compare_fields(a, b);
  CHECK(c.correlation == Approx(0.5).margin(eps));                      // 1, 0
  CHECK(c.error == Approx((1 + std::sqrt(2)) / 2).margin(2 * eps));     // 1, sqrt 2
  CHECK(c.error_scaled == Approx(0.5).margin(2 * eps));                 // 0, 1
  CHECK(c.energy_ratio == Approx(2.5).margin(4 * eps));                 // 4, 1
  CHECK(c.difference.pixels[0] == Approx(std::sqrt(0.5)).margin(eps));  // rms of 0, 1
}

TEST_CASE("a hologram of levels correlates with the phase it was made of by sinc(1/256)") {
  const int n = 256 * 64;  // the phase runs evenly through 64 places in each level
  const auto phase = [](int x) { return (x + 0.5) / n; };
  const auto exact = field_of(n, 1, [&](int x, int) { return std::polar(1.0, 2 * pi * phase(x)); });
  std::vector<std::uint8_t> levels;
  for (int x = 0; x < n; ++x)
    levels.push_back(static_cast<std::uint8_t>(std::lround(phase(x) * 256) % 256));
  const Panel panel(SlmSpec{}, {n, 1}, glm::dvec2(1), 1);
  const double sinc = std::sin(pi / 256) / (pi / 256);
  CHECK(compare_fields(exact, shown_field(panel, std::vector<std::vector<std::uint8_t>>{levels}))
            .correlation == Approx(sinc).margin(eps));
}

TEST_CASE("PSNR of a picture that is off by d is 20 log10(peak / d), whatever the scale of B") {
  const double d = 0.01;
  // The error is orthogonal to B = 1
  const auto a = image_of(24, 10, [&](int x, int y) { return 1 + ((x + y) % 2 ? d : -d); });
  for (const double scale : {1e-12, 1.0, 3e7}) {
    const auto c = compare_pictures(a, image_of(24, 10, [&](int, int) { return scale; }));
    CHECK(c.psnr_db == Approx(20 * std::log10((1 + d) / d)).epsilon(1e-5));
    CHECK(c.scale * scale == Approx(1).epsilon(1e-6));
    for (int i = 0; i < 24; ++i)
      CHECK(c.difference.pixels[i] == Approx(i % 2 ? -d : d).epsilon(1e-5));
  }
}

TEST_CASE("equal pictures have an infinite PSNR, SSIM 1 and FLIP 0, and so have scaled ones") {
  for (const auto& a : {random_image(31, 20, 1), random_image(5, 3, 2), random_image(1, 1, 3)}) {
    auto b = a;
    for (float& v : b.pixels) v *= 0.25f;  // exact
    for (const auto& other : {a, b}) {
      const auto c = compare_pictures(a, other, {1.3, 0, {}});
      CHECK(c.psnr_db > 250);
      CHECK(c.ssim == Approx(1).margin(1e-12));
      CHECK(c.flip == 0);
    }
    CHECK(std::isinf(compare_pictures(a, a).psnr_db));
  }
}

/// IEC 61966-2-1
double on_screen(double linear) {
  const double v = std::min(std::max(linear, 0.0), 1.0);
  return v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055;
}

TEST_CASE(
    "pictures are compared as intensities, amplitudes or on a screen, as plain sums give it") {
  const auto a = random_image(23, 17, 1), b = random_image(23, 17, 2);
  const auto peak = *std::max_element(a.pixels.begin(), a.pixels.end());
  double ab = 0, bb = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    ab += 1.0 * a.pixels[i] * b.pixels[i];
    bb += 1.0 * b.pixels[i] * b.pixels[i];
  }
  const std::function<double(double)> to_a[] = {[](double v) { return v; },
                                                [](double v) { return std::sqrt(v); },
                                                [&](double v) { return on_screen(v / peak); }};
  const std::function<double(double)> to_b[] = {
      to_a[0], to_a[1], [&](double v) { return on_screen(v * ab / bb / peak); }};
  for (const auto domain : {Domain::intensity, Domain::amplitude, Domain::srgb}) {
    INFO(name_of(domain));
    const auto of_a = [&](std::size_t i) { return to_a[static_cast<int>(domain)](a.pixels[i]); };
    const auto of_b = [&](std::size_t i) { return to_b[static_cast<int>(domain)](b.pixels[i]); };
    double xy = 0, yy = 0, most = 0, squares = 0;
    for (std::size_t i = 0; i < a.pixels.size(); ++i) {
      xy += of_a(i) * of_b(i);
      yy += of_b(i) * of_b(i);
      most = std::max(most, of_a(i));
    }
    for (std::size_t i = 0; i < a.pixels.size(); ++i)
      squares += std::pow(xy / yy * of_b(i) - of_a(i), 2);
    const double psnr = 10 * std::log10(most * most * (23 * 17) / squares);
    PictureOptions how{.domain = domain};
    const auto c = compare_pictures(a, b, how);
    CHECK(c.psnr_db == Approx(psnr).epsilon(1e-9));
    CHECK(c.scale == Approx(xy / yy).epsilon(1e-9));
    CHECK(c.difference.pixels[5] == Approx(xy / yy * of_b(5) - of_a(5)).margin(1e-6));
    // Brightness counts in none; speckle contrast is always of intensities.
    auto brighter = b;
    for (float& v : brighter.pixels) v *= 4096;
    CHECK(compare_pictures(a, brighter, how).psnr_db == Approx(psnr).epsilon(1e-6));
    CHECK(c.contrast_a == compare_pictures(a, b).contrast_a);
    CHECK(choice_of<Domain>(name_of(domain), "domain") == domain);
  }
  CHECK_REFUSED(choice_of<Domain>("linear", "domain"), "there are intensity, amplitude and srgb");
}

TEST_CASE("the border counts in no figure but a region's") {
  const auto clean_a = random_image(20, 16, 1), clean_b = random_image(20, 16, 2);
  const int border = 3;
  const auto framed = [&](const Image& inner, double outside) {
    return image_of(inner.width + 2 * border, inner.height + 2 * border, [&](int x, int y) {
      x -= border, y -= border;
      const bool in = x >= 0 && y >= 0 && x < inner.width && y < inner.height;
      return in ? inner.pixels[static_cast<std::size_t>(y) * inner.width + x] : outside;
    });
  };
  const auto expected = compare_pictures(clean_a, clean_b);
  const auto got = compare_pictures(framed(clean_a, 50), framed(clean_b, 0), {0, border, {}});
  CHECK(got.psnr_db == expected.psnr_db);
  CHECK(got.ssim == expected.ssim);
  CHECK(got.flip == Approx(expected.flip).epsilon(1e-5));
  CHECK(got.contrast_a == expected.contrast_a);
  CHECK(got.difference.width == 20);
  CHECK(got.difference.pixels == expected.difference.pixels);
  const auto corner = compare_pictures(framed(clean_a, 50), framed(clean_b, 1),
                                       {0, border, Region{0, 0, border, border}});
  CHECK(corner.contrast_a == Approx(0).margin(1e-12));
}

TEST_CASE("a blurred cosine keeps exp(-(sigma w)^2 / 2) of its swing, and PSNR sees that") {
  // cos(pi k (x + 1/2) / n) is its own mirror image at both edges.
  const int n = 128, k = 12;
  const double w = pi * k / n, swing = 0.2;
  const auto a = image_of(n, 32, [&](int x, int) { return 1 + swing * std::cos(w * (x + 0.5)); });
  const auto flat = image_of(n, 32, [](int, int) { return 1; });
  for (const double sigma : {1.0, 2.5, 4.0}) {
    const double left = swing * std::exp(-sigma * sigma * w * w / 2);
    const auto b = blurred(a, sigma);
    for (int x = 0; x < n; ++x)
      // 4 sigma hold all but 6e-5
      CHECK(b.pixels[x] - 1 == Approx(left * std::cos(w * (x + 0.5))).margin(swing * 2e-4));
    double peak = 0;
    for (int x = 0; x < n; ++x) peak = std::max(peak, 1 + left * std::cos(w * (x + 0.5)));
    CHECK(compare_pictures(a, flat, {sigma, 0, {}}).psnr_db ==
          Approx(20 * std::log10(peak * std::sqrt(2) / left)).margin(0.01));
  }
}

TEST_CASE("the blur of a point is the Gaussian, cut off at 4 sigma, mirrored at the edges") {
  for (const double sigma : {0.5, 1.0, 3.3, 9.0}) {
    const int reach = static_cast<int>(std::floor(4 * sigma + 0.5));
    double sum = 0;
    for (int i = -reach; i <= reach; ++i) sum += std::exp(-i * i / (2 * sigma * sigma));
    for (const auto& [px, py] : {std::pair(20, 15), {0, 0}, {40, 29}, {2, 28}}) {
      const auto point =
          image_of(41, 30, [px = px, py = py](int x, int y) { return x == px && y == py; });
      const auto got = blurred(point, sigma);
      double worst = 0;
      for (int y = 0; y < 30; ++y) {
        for (int x = 0; x < 41; ++x) {
          double expected = 0;
          for (int j = -reach; j <= reach; ++j)
            for (int i = -reach; i <= reach; ++i)
              expected += mirrored_pixel(point, x + i, y + j) *
                          std::exp(-(i * i + j * j) / (2 * sigma * sigma)) / (sum * sum);
          worst = std::max(worst,
                           std::abs(got.pixels[static_cast<std::size_t>(y) * 41 + x] - expected));
        }
      }
      INFO("sigma " << sigma << ", point (" << px << ", " << py << ")");
      CHECK(worst <= eps / (sigma * sigma));  // the peak is about 1 / (2 pi sigma^2)
    }
  }
}

TEST_CASE(
    "the blur keeps the mean, also when wider than the picture, and changes nothing at sigma 0") {
  for (const auto& image :
       {random_image(37, 22, 4), random_image(1, 9, 5), random_image(1, 1, 6)}) {
    for (const double sigma : {0.3, 2.0, 50.0, 1000.0})
      CHECK(mean_of(blurred(image, sigma)) == Approx(mean_of(image)).epsilon(eps));
    CHECK(blurred(image, 0).pixels == image.pixels);
  }
  const auto wide = blurred(random_image(10, 10, 7), 100);
  for (const float v : wide.pixels) CHECK(v == Approx(wide.pixels[0]).epsilon(1e-4));
}

/// SSIM after its definition: weights, means and central moments of each 11 x 11 window, one window
/// after the other.
double direct_ssim(const Image& a, const Image& b, double range) {
  double sum_of_weights = 0, total = 0;
  const auto weight = [](int i, int j) { return std::exp(-(i * i + j * j) / 4.5); };
  for (int j = -5; j <= 5; ++j)
    for (int i = -5; i <= 5; ++i) sum_of_weights += weight(i, j);
  int windows = 0;
  for (int y = 5; y < a.height - 5; ++y) {
    for (int x = 5; x < a.width - 5; ++x, ++windows) {
      const auto window_mean = [&](const std::function<double(double, double)>& f) {
        double sum = 0;
        for (int j = -5; j <= 5; ++j) {
          for (int i = -5; i <= 5; ++i) {
            const std::size_t at = static_cast<std::size_t>(y + j) * a.width + x + i;
            sum += weight(i, j) / sum_of_weights * f(a.pixels[at], b.pixels[at]);
          }
        }
        return sum;
      };
      const double ma = window_mean([](double u, double) { return u; }),
                   mb = window_mean([](double, double v) { return v; });
      const double va = window_mean([&](double u, double) { return (u - ma) * (u - ma); });
      const double vb = window_mean([&](double, double v) { return (v - mb) * (v - mb); });
      const double cov = window_mean([&](double u, double v) { return (u - ma) * (v - mb); });
      const double c1 = 1e-4 * range * range, c2 = 9e-4 * range * range;
      total += (2 * ma * mb + c1) / (ma * ma + mb * mb + c1) * (2 * cov + c2) / (va + vb + c2);
    }
  }
  return total / windows;
}

TEST_CASE("SSIM is its definition's, window by window") {
  const auto a = random_image(33, 26, 1), noise = random_image(33, 26, 2);
  for (const double share : {0.05, 0.5, 1.0}) {
    const auto mixed = image_of(33, 26, [&](int x, int y) {
      const std::size_t at = static_cast<std::size_t>(y) * 33 + x;
      return (1 - share) * a.pixels[at] + share * noise.pixels[at];
    });
    const auto c = compare_pictures(a, mixed);
    auto scaled = mixed;
    for (float& v : scaled.pixels) v = static_cast<float>(v * c.scale);
    const double expected =
        direct_ssim(a, scaled, *std::max_element(a.pixels.begin(), a.pixels.end()));
    // The oracle's pixels are rounded to float once more
    CHECK(c.ssim == Approx(expected).margin(1e-6));
    CHECK(c.ssim < (share == 1 ? 0.2 : 0.999));
  }
}

TEST_CASE("fully developed speckle has contrast 1, and the mean of n patterns 1/sqrt(n)") {
  const int side = 500;
  std::mt19937 random(11);
  std::exponential_distribution<double> intensity;
  for (const int patterns : {1, 16}) {
    const auto image = image_of(side, side, [&](int, int) {
      double sum = 0;
      for (int i = 0; i < patterns; ++i) sum += intensity(random);
      return sum;
    });
    // The estimate from N exponential samples has the relative standard deviation 1/sqrt(N) =
    // 0.002, less for sums; five of them.
    CHECK(compare_pictures(image, image).contrast_a ==
          Approx(1 / std::sqrt(patterns)).epsilon(0.01));
  }
}

TEST_CASE("speckle contrast is that of the region alone") {
  const auto image = image_of(12, 10, [](int x, int y) {
    return x >= 4 && x < 8 && y >= 2 && y < 5 ? (x % 2 ? 1.25 : 0.75) : 100.0;
  });
  const auto c = compare_pictures(image, image, {0, 0, Region{4, 2, 4, 3}});
  CHECK(c.contrast_a == Approx(0.25).epsilon(1e-12));
  CHECK(c.contrast_b == c.contrast_a);
  CHECK(compare_pictures(image, image, {0, 0, Region{11, 9, 1, 1}}).contrast_a == 0);
}

TEST_CASE("colours run from blue over white to red and stay there beyond the ends") {
  const Image values{5, 1, {-9, -2, 0, 2, 9}};
  const std::vector<std::uint8_t> expected{33,  102, 172, 33, 102, 172, 255, 255,
                                           255, 178, 24,  43, 178, 24,  43};
  CHECK(diverging_colours(values, 2) == expected);
  CHECK(diverging_colours({1, 1, {0}}, 0) == std::vector<std::uint8_t>(3, 255));
  CHECK(diverging_colours({1, 1, {1}}, 2)[0] == 217);  // (255 + 178) / 2, rounded
  CHECK(largest_magnitude(values) == 9);
}

TEST_CASE("a picture's PNG is read as linear light, its EXR as it is, and colours are refused") {
  const Folder folder;
  const std::vector<std::uint8_t> levels{0, 10, 188, 255};
  save_picture(folder / "a.png", 4, 1, levels);
  const auto png = load_grey(folder / "a.png", "");
  CHECK(png.pixels[0] == 0);
  CHECK(png.pixels[1] == Approx(10 / 255.0 / 12.92).epsilon(1e-6));
  CHECK(png.pixels[2] == Approx(0.5028865).epsilon(1e-6));  // ((188/255 + 0.055) / 1.055)^2.4
  CHECK(png.pixels[3] == 1);
  const std::vector<float> values{-1, 0.25f, 1e-30f, 3e5f};
  save_picture(folder / "a.exr", 4, 1, values);
  CHECK(load_grey(folder / "a.exr", "").pixels == values);
  save_picture(folder / "rgb.png", 1, 1, std::vector<std::uint8_t>{1, 2, 3});
  CHECK_REFUSED(load_grey(folder / "rgb.png", ""), "must be grey; it has 3 channels");
}

TEST_CASE("inputs that cannot be compared are refused, with the reason") {
  const auto f = random_field(4, 3, 1);
  auto two_frames = f;
  two_frames.frames = 2;
  two_frames.samples.resize(24);
  const auto of_fields = [](const FieldStack& a, const FieldStack& b) {
    return input_error_of([&] { compare_fields(a, b); });
  };
  CHECK_SAYS(of_fields(f, random_field(3, 4, 1)), "A has 1 frame of 4 x 3, B 1 frame of 3 x 4");
  CHECK_SAYS(of_fields(f, two_frames), "A has 1 frame of 4 x 3, B 2 frames of 4 x 3");
  CHECK_SAYS(of_fields(two_frames, two_frames), "frame 2 of A is zero");
  CHECK_SAYS(of_fields(f, times(f, 0)), "frame 1 of B is zero");

  const auto p = random_image(8, 6, 1), black = image_of(8, 6, [](int, int) { return 0; });
  const auto of_pictures = [](const Image& a, const Image& b, const PictureOptions& how = {}) {
    return input_error_of([&] { compare_pictures(a, b, how); });
  };
  CHECK_SAYS(of_pictures(p, random_image(6, 8, 1)), "A is 8 x 6 pixels, B 6 x 8");
  CHECK_SAYS(of_pictures(black, p), "A is black");
  CHECK_SAYS(of_pictures(p, black), "B is black");
  CHECK_SAYS(of_pictures(p, p, {0, 3, {}}), "border: must be 0 to 2 pixels");
  CHECK_SAYS(of_pictures(p, p, {0, -1, {}}), "border: must be 0 to 2 pixels");
  CHECK(of_pictures(p, p, {0, 2, {}}).empty());
  for (const double sigma : {-1.0, 1001.0, std::numeric_limits<double>::quiet_NaN()})
    CHECK_SAYS(of_pictures(p, p, {sigma, 0, {}}), "blur: must be 0 to 1000 pixels");
  const int most = std::numeric_limits<int>::max();
  for (const Region& r : {Region{0, 0, 9, 1},
                          {7, 0, 2, 1},
                          {-1, 0, 2, 2},
                          {0, 0, 0, 1},
                          {0, 5, 1, most},
                          {most, 0, most, 1}})
    CHECK_SAYS(of_pictures(p, p, {0, 0, r}), "do not lie in the picture of 8 x 6");
  const auto half = image_of(8, 6, [](int x, int) { return x < 4 ? 1.0 : 0.0; });
  CHECK_SAYS(of_pictures(half, half, {0, 0, Region{5, 0, 2, 2}}), "A has no light");
}

}  // namespace
}  // namespace raywave
