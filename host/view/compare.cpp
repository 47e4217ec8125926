// SPDX-License-Identifier: Apache-2.0
#include "host/view/compare.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "host/common/colour.hpp"
#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/common/threads.hpp"
#include "host/plan/message_text.hpp"
#include "host/view/flip.hpp"

namespace raywave {
namespace {

constexpr double kSsimSigmaPx = 1.5;
constexpr int kSsimRadius = 5;

/// A picture in double precision: variances are small differences of large sums.
struct Plane {
  int width = 0, height = 0;
  std::vector<double> pixels;

  const double* row(int y) const { return pixels.data() + std::ptrdiff_t{y} * width; }
  double* row(int y) { return pixels.data() + std::ptrdiff_t{y} * width; }
};

Plane plane_of(const Image& image) {
  if (image.width < 1 || image.height < 1 ||
      image.pixels.size() != std::size_t{1} * image.width * image.height)
    throw std::invalid_argument("compare: the pixels do not fill width * height");
  return {image.width, image.height, {image.pixels.begin(), image.pixels.end()}};
}

constexpr double largest_float = std::numeric_limits<float>::max();

/// Values beyond float become its largest number.
Image image_of(const Plane& plane) {
  Image image{plane.width, plane.height, {}};
  for (const double value : plane.pixels)
    image.pixels.push_back(static_cast<float>(std::clamp(value, -largest_float, largest_float)));
  return image;
}

std::vector<double> blur_weights(double sigma_px) {
  if (!(sigma_px >= 0 && sigma_px <= most_blur_px))
    throw InputError("blur: must be 0 to " + number_text(most_blur_px) + " pixels, got " +
                     number_text(sigma_px));
  return gaussian_weights(sigma_px, static_cast<int>(4 * sigma_px + 0.5));
}

/// d c b a | a b c d | d c b a, for any i.
int mirrored(int i, int n) {
  const int in_period = ((i % (2 * n)) + 2 * n) % (2 * n);
  return std::min(in_period, 2 * n - 1 - in_period);
}

/// Convolves rows, then columns, with a symmetric kernel.
Plane smoothed(const Plane& plane, const std::vector<double>& weights) {
  const int width = plane.width, height = plane.height,
            radius = static_cast<int>(weights.size()) - 1;
  if (radius == 0) return plane;
  const auto for_each_row = [&](const auto& work) {
    auto& threads = cl::Threads::shared();
    threads.for_each(threads.count(), static_cast<std::size_t>(height), 16,
                     [&](std::size_t, std::size_t y) { work(static_cast<int>(y)); });
  };
  Plane rows{width, height, std::vector<double>(plane.pixels.size())};
  for_each_row([&](int y) {
    std::vector<double> padded(static_cast<std::size_t>(width) + 2 * radius);
    for (int x = -radius; x < width + radius; ++x)
      padded[x + radius] = plane.row(y)[mirrored(x, width)];
    for (int k = -radius; k <= radius; ++k) {
      for (int x = 0; x < width; ++x)
        rows.row(y)[x] += weights[std::abs(k)] * padded[x + radius + k];
    }
  });
  Plane result{width, height, std::vector<double>(plane.pixels.size())};
  for_each_row([&](int y) {
    for (int k = -radius; k <= radius; ++k) {
      const double* source = rows.row(mirrored(y + k, height));
      for (int x = 0; x < width; ++x) result.row(y)[x] += weights[std::abs(k)] * source[x];
    }
  });
  return result;
}

Plane cut_out(const Plane& plane, const Region& region) {
  Plane part{region.width, region.height, {}};
  for (int y = region.y; y < region.y + region.height; ++y)
    part.pixels.insert(part.pixels.end(), plane.row(y) + region.x,
                       plane.row(y) + region.x + region.width);
  return part;
}

void require_inside(const Region& r, const Plane& plane) {
  const bool inside = r.x >= 0 && r.y >= 0 && r.width >= 1 && r.height >= 1 &&
                      r.width <= plane.width - r.x && r.height <= plane.height - r.y;
  if (!inside) {
    throw InputError("region: " + extent_text({r.width, r.height}) + " pixels from (" +
                     std::to_string(r.x) + ", " + std::to_string(r.y) +
                     ") do not lie in the picture of " + extent_text({plane.width, plane.height}));
  }
}

double dot(const Plane& a, const Plane& b) {
  return std::inner_product(a.pixels.begin(), a.pixels.end(), b.pixels.begin(), 0.0);
}

Plane product(const Plane& a, const Plane& b) {
  Plane result = a;
  std::transform(a.pixels.begin(), a.pixels.end(), b.pixels.begin(), result.pixels.begin(),
                 std::multiplies<>());
  return result;
}

/// The factor of b that brings it nearest to a.
double best_scale(const Plane& a, const Plane& b) { return dot(b, a) / dot(b, b); }

double largest(const Plane& plane) { return *std::ranges::max_element(plane.pixels); }

/// Brings intensities to the domain that they are compared in.
void bring_to(Domain domain, Plane& a, Plane& b) {
  if (domain == Domain::intensity) return;
  if (domain == Domain::amplitude) {
    for (auto* plane : {&a, &b})
      for (double& v : plane->pixels) v = std::sqrt(std::max(v, 0.0));
    return;
  }
  const double white = largest(a), scale = best_scale(a, b);
  for (double& v : a.pixels) v = srgb_of(v / white);
  for (double& v : b.pixels) v = srgb_of(v * scale / white);
}

double contrast_of(const Plane& plane, const char* subject) {
  const double count = static_cast<double>(plane.pixels.size());
  const double mean = std::accumulate(plane.pixels.begin(), plane.pixels.end(), 0.0) / count;
  if (!(mean > 0))
    throw InputError(std::string("speckle contrast: ") + subject + " has no light there");
  double sum = 0;
  for (const double v : plane.pixels) sum += (v - mean) * (v - mean);
  return std::sqrt(sum / count) / mean;
}

/// Mean over the windows that lie wholly inside; where the picture is smaller than a window, over
/// all, with mirrored borders.
double mean_ssim(const Plane& a, const Plane& b, double dynamic_range) {
  const auto window = gaussian_weights(kSsimSigmaPx, kSsimRadius);
  const auto local = [&](const Plane& plane) { return smoothed(plane, window); };
  const Plane mean_a = local(a), mean_b = local(b);
  const Plane mean_aa = local(product(a, a)), mean_bb = local(product(b, b)),
              mean_ab = local(product(a, b));
  const double c1 = std::pow(0.01 * dynamic_range, 2), c2 = std::pow(0.03 * dynamic_range, 2);

  const int margin_x = a.width > 2 * kSsimRadius ? kSsimRadius : 0,
            margin_y = a.height > 2 * kSsimRadius ? kSsimRadius : 0;
  double sum = 0;
  for (int y = margin_y; y < a.height - margin_y; ++y) {
    for (int x = margin_x; x < a.width - margin_x; ++x) {
      const double ma = mean_a.row(y)[x], mb = mean_b.row(y)[x];
      const double variance_a = mean_aa.row(y)[x] - ma * ma,
                   variance_b = mean_bb.row(y)[x] - mb * mb;
      const double covariance = mean_ab.row(y)[x] - ma * mb;
      sum += (2 * ma * mb + c1) * (2 * covariance + c2) /
             ((ma * ma + mb * mb + c1) * (variance_a + variance_b + c2));
    }
  }
  return sum / (1.0 * (a.width - 2 * margin_x) * (a.height - 2 * margin_y));
}

/// A row or column of `count` values, `step` apart, weighed around the middles of its squares.
void weigh(const float* from, int count, std::size_t step, int side, float* to,
           std::size_t to_step) {
  for (int square = 0; square * side < count; ++square) {
    const double middle = square * side + (side - 1) / 2.0;
    double sum = 0, all = 0;
    for (int i = std::max(0, (square - 1) * side); i < std::min(count, (square + 2) * side); ++i) {
      const double weight = std::max(0.0, side - std::abs(i - middle));
      sum += weight * double{from[static_cast<std::size_t>(i) * step]};
      all += weight;
    }
    to[static_cast<std::size_t>(square) * to_step] = static_cast<float>(sum / all);
  }
}

}  // namespace

std::vector<double> gaussian_weights(double sigma_px, int radius) {
  std::vector<double> weights{1};
  double sum = 1;
  for (int k = 1; k <= radius; ++k) {
    weights.push_back(std::exp(-0.5 * k * k / (sigma_px * sigma_px)));
    sum += 2 * weights.back();
  }
  for (double& w : weights) w /= sum;
  return weights;
}

FieldComparison compare_fields(const FieldStack& a, const FieldStack& b) {
  const auto shape_text = [](const FieldStack& f) {
    return std::to_string(f.frames) + (f.frames == 1 ? " frame of " : " frames of ") +
           extent_text({f.nx, f.ny});
  };
  if (a.nx != b.nx || a.ny != b.ny || a.frames != b.frames)
    throw InputError("compare: the fields differ in size: A has " + shape_text(a) + ", B " +
                     shape_text(b));
  const std::size_t count = std::size_t{1} * a.nx * a.ny;
  if (count < 1 || a.frames < 1 || a.samples.size() != count * a.frames ||
      b.samples.size() != count * b.frames)
    throw std::invalid_argument("compare: the samples do not fill nx * ny * frames");

  FieldComparison result;
  std::vector<double> squares(count);
  for (int frame = 0; frame < a.frames; ++frame) {
    const auto at = [&](const FieldStack& f, std::size_t i) {
      return std::complex<double>(f.samples[frame * count + i]);
    };
    double energy_a = 0, energy_b = 0, raw = 0;
    std::complex<double> inner = 0;  // <b, a>
    for (std::size_t i = 0; i < count; ++i) {
      energy_a += std::norm(at(a, i));
      energy_b += std::norm(at(b, i));
      raw += std::norm(at(b, i) - at(a, i));
      inner += std::conj(at(b, i)) * at(a, i);
    }
    for (const auto& [name, energy] : {std::pair("A", energy_a), std::pair("B", energy_b)})
      if (energy == 0)
        throw InputError("compare: frame " + std::to_string(frame + 1) + " of " + name +
                         " is zero everywhere");

    // The residual is summed directly: sqrt(1 - correlation^2) loses all digits of a small error.
    const std::complex<double> scale = inner / energy_b;
    double residual = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const double square = std::norm(scale * at(b, i) - at(a, i));
      residual += square;
      squares[i] += square / a.frames;
    }
    result.correlation += std::abs(inner) / std::sqrt(energy_a * energy_b) / a.frames;
    result.error += std::sqrt(raw / energy_a) / a.frames;
    result.error_scaled += std::sqrt(residual / energy_a) / a.frames;
    result.energy_ratio += energy_b / energy_a / a.frames;
  }
  result.difference = {a.nx, a.ny, {}};
  for (const double square : squares)
    result.difference.pixels.push_back(
        static_cast<float>(std::min(std::sqrt(square), largest_float)));
  return result;
}

PictureComparison compare_pictures(const Image& a, const Image& b, const PictureOptions& options) {
  if (a.width != b.width || a.height != b.height) {
    throw InputError("compare: the pictures differ in size: A is " +
                     extent_text({a.width, a.height}) + " pixels, B " +
                     extent_text({b.width, b.height}));
  }
  const int border = options.border_px, widest_border = (std::min(a.width, a.height) - 1) / 2;
  if (border < 0 || border > widest_border) {
    throw InputError("border: must be 0 to " + std::to_string(widest_border) +
                     " pixels for a picture of " + extent_text({a.width, a.height}) + ", got " +
                     std::to_string(border));
  }
  const auto weights = blur_weights(options.blur_px);
  const Plane whole_a = smoothed(plane_of(a), weights), whole_b = smoothed(plane_of(b), weights);
  const Region inner{border, border, a.width - 2 * border, a.height - 2 * border};
  Plane reference = cut_out(whole_a, inner), judged = cut_out(whole_b, inner);
  if (!(largest(reference) > 0)) throw InputError("compare: A is black");
  if (dot(judged, judged) == 0) throw InputError("compare: B is black");
  PictureComparison result;
  if (options.flip) {
    const double scale = best_scale(reference, judged);
    Plane scaled = judged;
    for (double& v : scaled.pixels) v *= scale;
    result.flip =
        flip_of(std::array{image_of(reference)}, std::array{image_of(scaled)}, largest(reference));
  }
  bring_to(options.domain, reference, judged);
  if (dot(judged, judged) == 0) throw InputError("compare: B has no light where A has some");
  const double peak = largest(reference);

  const Region region = options.region.value_or(inner);
  require_inside(region, whole_a);
  result.contrast_a = contrast_of(cut_out(whole_a, region), "A");
  result.contrast_b = contrast_of(cut_out(whole_b, region), "B");

  result.scale = best_scale(reference, judged);
  for (double& v : judged.pixels) v *= result.scale;
  Plane difference = judged;
  for (std::size_t i = 0; i < difference.pixels.size(); ++i)
    difference.pixels[i] -= reference.pixels[i];
  const double mean_square =
      dot(difference, difference) / static_cast<double>(difference.pixels.size());
  result.psnr_db = 10 * std::log10(peak * peak / mean_square);
  result.ssim = mean_ssim(reference, judged, peak);
  result.difference = image_of(difference);
  return result;
}

Image blurred(const Image& image, double sigma_px) {
  return image_of(smoothed(plane_of(image), blur_weights(sigma_px)));
}

std::vector<std::uint8_t> diverging_colours(const Image& values, double full) {
  // The end colours of ColorBrewer's RdBu
  constexpr std::array<double, 3> red{178, 24, 43}, blue{33, 102, 172};
  std::vector<std::uint8_t> rgb;
  rgb.reserve(3 * values.pixels.size());
  for (const float value : values.pixels) {
    const double share = full > 0 ? std::clamp(value / full, -1.0, 1.0) : 0;
    const auto& end = share < 0 ? blue : red;
    for (const double channel : end)
      rgb.push_back(
          static_cast<std::uint8_t>(std::lround(255 + std::abs(share) * (channel - 255))));
  }
  return rgb;
}

Image cropped(const Image& image, const Region& part) {
  Image inner{part.width, part.height, {}};
  for (int y = part.y; y < part.y + part.height; ++y) {
    const auto row = image.pixels.begin() + std::ptrdiff_t{y} * image.width + part.x;
    inner.pixels.insert(inner.pixels.end(), row, row + part.width);
  }
  return inner;
}

double largest_magnitude(const Image& values) {
  double largest = 0;
  for (const float value : values.pixels)
    largest = std::max(largest, std::abs(static_cast<double>(value)));
  return largest;
}

Image averaged(const Image& image, int side) {
  if (side == 1) return image;
  const auto across = static_cast<std::size_t>((image.width + side - 1) / side),
             width = static_cast<std::size_t>(image.width),
             height = static_cast<std::size_t>(image.height);
  std::vector<float> rows(across * height);
  for (std::size_t y = 0; y < height; ++y)
    weigh(&image.pixels[y * width], image.width, 1, side, &rows[y * across], 1);
  Image result{static_cast<int>(across), (image.height + side - 1) / side, {}};
  result.pixels.resize(across * static_cast<std::size_t>(result.height));
  for (std::size_t x = 0; x < across; ++x)
    weigh(&rows[x], image.height, across, side, &result.pixels[x], across);
  return result;
}

double light_in_picture(const Image& lens, const Image& hologram) {
  const float least = *std::ranges::max_element(lens.pixels) / 100;
  int left = lens.width, right = -1, top = lens.height, bottom = -1;
  for (int y = 0; y < lens.height; ++y) {
    for (int x = 0; x < lens.width; ++x) {
      if (lens.pixels[std::size_t{1} * y * lens.width + x] <= least) continue;
      left = std::min(left, x);
      right = std::max(right, x);
      top = std::min(top, y);
      bottom = y;
    }
  }
  const auto part = cropped(hologram, {left, top, right - left + 1, bottom - top + 1});
  return std::accumulate(part.pixels.begin(), part.pixels.end(), 0.0);
}

}  // namespace raywave
