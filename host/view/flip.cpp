// SPDX-License-Identifier: Apache-2.0
#include "host/view/flip.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <glm/glm.hpp>
#include <glm/gtc/constants.hpp>
#include <vector>

#include "host/common/colour.hpp"
#include "host/common/threads.hpp"

namespace raywave {
namespace {

using Kernel = std::vector<float>;  // an odd number of weights

struct Plane {
  std::ptrdiff_t width, height;
  std::vector<float> pixels;

  Plane(std::ptrdiff_t w, std::ptrdiff_t h)
      : width(w), height(h), pixels(static_cast<std::size_t>(w * h)) {}
  float* row(std::ptrdiff_t y) { return pixels.data() + y * width; }
  const float* row(std::ptrdiff_t y) const { return pixels.data() + y * width; }
};

void for_each_row(std::ptrdiff_t height, const std::function<void(std::ptrdiff_t)>& work) {
  auto& threads = cl::Threads::shared();
  threads.for_each(threads.count(), static_cast<std::size_t>(height), 16,
                   [&](std::size_t, std::size_t y) { work(static_cast<std::ptrdiff_t>(y)); });
}

/// Correlates rows with one kernel and columns with another; the pixels of the edge go on beyond.
Plane filtered(const Plane& plane, const Kernel& of_rows, const Kernel& of_columns) {
  Plane rows(plane.width, plane.height), result(plane.width, plane.height);
  for_each_row(plane.height, [&](std::ptrdiff_t y) {
    const auto radius = static_cast<std::ptrdiff_t>(of_rows.size() / 2);
    std::vector<float> padded(static_cast<std::size_t>(plane.width + 2 * radius));
    for (std::ptrdiff_t x = -radius; x < plane.width + radius; ++x)
      padded[static_cast<std::size_t>(x + radius)] =
          plane.row(y)[std::clamp<std::ptrdiff_t>(x, 0, plane.width - 1)];
    for (std::size_t k = 0; k < of_rows.size(); ++k)
      for (std::ptrdiff_t x = 0; x < plane.width; ++x)
        rows.row(y)[x] += of_rows[k] * padded[static_cast<std::size_t>(x) + k];
  });
  for_each_row(plane.height, [&](std::ptrdiff_t y) {
    const auto radius = static_cast<std::ptrdiff_t>(of_columns.size() / 2);
    for (std::size_t k = 0; k < of_columns.size(); ++k) {
      const auto from = y + static_cast<std::ptrdiff_t>(k) - radius;
      const float* source = rows.row(std::clamp<std::ptrdiff_t>(from, 0, plane.height - 1));
      for (std::ptrdiff_t x = 0; x < plane.width; ++x)
        result.row(y)[x] += of_columns[k] * source[x];
    }
  });
  return result;
}

template <class F>
Kernel kernel(int radius, const F& value) {
  Kernel weights;
  for (int x = -radius; x <= radius; ++x) weights.push_back(static_cast<float>(value(x)));
  return weights;
}

/// Makes the positive weights sum to 1, and the negative ones to -1.
Kernel balanced(Kernel weights) {
  double positive = 0, negative = 0;
  for (const float w : weights) (w > 0 ? positive : negative) += std::abs(double{w});
  for (float& w : weights) w = static_cast<float>(w / (w > 0 ? positive : negative));
  return weights;
}

/// The eye's contrast sensitivity in one opponent channel: a sum of Gaussians (of degrees).
struct Sensitivity {
  struct Term {
    double amplitude, width;
  };
  std::vector<Term> terms;
};
const std::array<Sensitivity, 3> sensitivities{
    {{{{1, 0.0047}}}, {{{1, 0.0053}}}, {{{34.1, 0.04}, {13.5, 0.025}}}}};
constexpr double widest = 0.04;

/// What an eye makes out of an opponent channel.
Plane seen(const Plane& channel, const Sensitivity& sensitivity) {
  const double ppd = flip_pixels_per_degree, pi = glm::pi<double>();
  const int radius = static_cast<int>(std::ceil(3 * std::sqrt(widest / (2 * pi * pi)) * ppd));
  Plane sum(channel.width, channel.height);
  double total = 0;
  for (const auto& [amplitude, width] : sensitivity.terms) {
    const auto weights = kernel(radius, [&, width = width](int x) {
      return std::exp(-pi * pi * x * x / (ppd * ppd * width));
    });
    double line = 0;
    for (const float w : weights) line += double{w};
    const double height = amplitude * std::sqrt(pi / width);
    total += height * line * line;
    const auto part = filtered(channel, weights, weights);
    for (std::size_t i = 0; i < sum.pixels.size(); ++i)
      sum.pixels[i] += static_cast<float>(height) * part.pixels[i];
  }
  for (float& value : sum.pixels) value = static_cast<float>(double{value} / total);
  return sum;
}

/// The opponent channels Y, Cx, Cz: L*, a*, b* without their cube roots.
glm::dvec3 opponent_of(glm::dvec3 of_white) {
  return {116 * of_white.y - 16, 500 * (of_white.x - of_white.y), 200 * (of_white.y - of_white.z)};
}
glm::dvec3 of_white_of(glm::dvec3 opponent) {
  const double y = (opponent.x + 16) / 116;
  return {y + opponent.y / 500, y, y - opponent.z / 200};
}

/// L*, a*, b* in which colours fade where it is dark (Hunt's effect).
glm::dvec3 hunt_of(glm::dvec3 rgb) {
  static const auto xyz = xyz_from_srgb();
  static const auto white = xyz * glm::dvec3(1);
  const auto lab = lab_of(xyz * rgb, white);
  return {lab.x, 0.01 * lab.x * lab.y, 0.01 * lab.x * lab.z};
}

/// HyAB distance, compressed.
double colour_difference(glm::dvec3 a, glm::dvec3 b) {
  const auto d = a - b;
  return std::pow(std::abs(d.x) + std::hypot(d.y, d.z), 0.7);
}

/// A picture as an eye sees it: colours in Hunt's L*, a*, b*, and how strong edges and points are.
struct SeenPicture {
  std::vector<glm::dvec3> colours;
  std::vector<float> edges, points;
};

std::vector<float> strengths(const Plane& brightness, const Kernel& across, const Kernel& along) {
  const auto x = filtered(brightness, across, along), y = filtered(brightness, along, across);
  std::vector<float> result;
  for (std::size_t i = 0; i < x.pixels.size(); ++i)
    result.push_back(std::hypot(x.pixels[i], y.pixels[i]));
  return result;
}

SeenPicture seen_picture(std::span<const Image> channels, double white) {
  const auto to_xyz = xyz_from_srgb();
  const auto to_rgb = glm::inverse(to_xyz);
  const auto xyz_white = to_xyz * glm::dvec3(1);
  std::array<Plane, 3> opponent{Plane(channels[0].width, channels[0].height),
                                Plane(channels[0].width, channels[0].height),
                                Plane(channels[0].width, channels[0].height)};
  for (std::size_t i = 0; i < channels[0].pixels.size(); ++i) {
    glm::dvec3 rgb;
    for (int c = 0; c < 3; ++c) {
      const auto& channel = channels[channels.size() == 3 ? static_cast<std::size_t>(c) : 0];
      rgb[c] = std::clamp(double{channel.pixels[i]} / white, 0.0, 1.0);
    }
    const auto values = opponent_of(to_xyz * rgb / xyz_white);
    for (int c = 0; c < 3; ++c)
      opponent[static_cast<std::size_t>(c)].pixels[i] = static_cast<float>(values[c]);
  }

  SeenPicture result;
  auto brightness = opponent[0];
  for (float& value : brightness.pixels) value = (value + 16) / 116;
  const double sigma = 0.5 * 0.082 * flip_pixels_per_degree;  // of the eye's own edge detector
  const int radius = static_cast<int>(std::ceil(3 * sigma));
  const auto bell = [&](int x) { return std::exp(-x * x / (2 * sigma * sigma)); };
  auto along = kernel(radius, bell);
  double sum = 0;
  for (const float w : along) sum += double{w};
  for (float& w : along) w = static_cast<float>(double{w} / sum);
  result.edges =
      strengths(brightness, balanced(kernel(radius, [&](int x) { return -x * bell(x); })), along);
  const auto bump = [&](int x) { return (x * x / (sigma * sigma) - 1) * bell(x); };
  result.points = strengths(brightness, balanced(kernel(radius, bump)), along);

  for (std::size_t c = 0; c < 3; ++c) opponent[c] = seen(opponent[c], sensitivities[c]);
  result.colours.resize(channels[0].pixels.size());
  for_each_row(opponent[0].height, [&](std::ptrdiff_t y) {
    for (std::ptrdiff_t x = 0; x < opponent[0].width; ++x) {
      const auto at = [&](std::size_t c) { return double{opponent[c].row(y)[x]}; };
      const auto rgb = to_rgb * (of_white_of({at(0), at(1), at(2)}) * xyz_white);
      result.colours[static_cast<std::size_t>(y * opponent[0].width + x)] =
          hunt_of(glm::clamp(rgb, 0.0, 1.0));
    }
  });
  return result;
}

/// The largest difference of colours is 1; the smaller ones are given most of the range.
double spread(double difference) {
  static const double largest = colour_difference(hunt_of({0, 1, 0}), hunt_of({0, 0, 1}));
  const double knee = 0.4 * largest;
  if (difference < knee) return 0.95 / knee * difference;
  return 0.95 + (difference - knee) / (largest - knee) * 0.05;
}

}  // namespace

double flip_of(std::span<const Image> reference, std::span<const Image> test, double white) {
  const auto a = seen_picture(reference, white), b = seen_picture(test, white);
  double sum = 0;
  for (std::size_t i = 0; i < a.colours.size(); ++i) {
    const double of_colour = spread(colour_difference(a.colours[i], b.colours[i]));
    const double feature = std::max(std::abs(double{a.edges[i]} - double{b.edges[i]}),
                                    std::abs(double{a.points[i]} - double{b.points[i]}));
    const double of_features = std::clamp(std::sqrt(feature / std::sqrt(2.0)), 0.0, 1.0);
    sum += std::pow(of_colour, 1 - of_features);
  }
  return sum / static_cast<double>(a.colours.size());
}

}  // namespace raywave
