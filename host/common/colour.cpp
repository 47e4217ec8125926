// SPDX-License-Identifier: Apache-2.0
#include "host/common/colour.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "host/common/text.hpp"

namespace raywave {
namespace {

constexpr double table_step_m = 5e-9;

// CIE 1931 2-degree standard observer, 380 to 780 nm in steps of 5 nm (CIE 018:2019, Table 6)
constexpr double observer[][3] = {{0.001368, 3.9e-05, 0.006450001},
                                  {0.002236, 6.4e-05, 0.01054999},
                                  {0.004243, 0.00012, 0.02005001},
                                  {0.00765, 0.000217, 0.03621},
                                  {0.01431, 0.000396, 0.06785001},
                                  {0.02319, 0.00064, 0.1102},
                                  {0.04351, 0.00121, 0.2074},
                                  {0.07763, 0.00218, 0.3713},
                                  {0.13438, 0.004, 0.6456},
                                  {0.21477, 0.0073, 1.03905},
                                  {0.2839, 0.0116, 1.3856},
                                  {0.3285, 0.01684, 1.62296},
                                  {0.34828, 0.023, 1.74706},
                                  {0.34806, 0.0298, 1.7826},
                                  {0.3362, 0.038, 1.77211},
                                  {0.3187, 0.048, 1.7441},
                                  {0.2908, 0.06, 1.6692},
                                  {0.2511, 0.0739, 1.5281},
                                  {0.19536, 0.09098, 1.28764},
                                  {0.1421, 0.1126, 1.0419},
                                  {0.09564, 0.13902, 0.8129501},
                                  {0.05795001, 0.1693, 0.6162},
                                  {0.03201, 0.20802, 0.46518},
                                  {0.0147, 0.2586, 0.3533},
                                  {0.0049, 0.323, 0.272},
                                  {0.0024, 0.4073, 0.2123},
                                  {0.0093, 0.503, 0.1582},
                                  {0.0291, 0.6082, 0.1117},
                                  {0.06327, 0.71, 0.07824999},
                                  {0.1096, 0.7932, 0.05725001},
                                  {0.1655, 0.862, 0.04216},
                                  {0.2257499, 0.9148501, 0.02984},
                                  {0.2904, 0.954, 0.0203},
                                  {0.3597, 0.9803, 0.0134},
                                  {0.4334499, 0.9949501, 0.008749999},
                                  {0.5120501, 1, 0.005749999},
                                  {0.5945, 0.995, 0.0039},
                                  {0.6784, 0.9786, 0.002749999},
                                  {0.7621, 0.952, 0.0021},
                                  {0.8425, 0.9154, 0.0018},
                                  {0.9163, 0.87, 0.001650001},
                                  {0.9786, 0.8163, 0.0014},
                                  {1.0263, 0.757, 0.0011},
                                  {1.0567, 0.6949, 0.001},
                                  {1.0622, 0.631, 0.0008},
                                  {1.0456, 0.5668, 0.0006},
                                  {1.0026, 0.503, 0.00034},
                                  {0.9384, 0.4412, 0.00024},
                                  {0.8544499, 0.381, 0.00019},
                                  {0.7514, 0.321, 0.0001},
                                  {0.6424, 0.265, 4.999999e-05},
                                  {0.5419, 0.217, 3e-05},
                                  {0.4479, 0.175, 2e-05},
                                  {0.3608, 0.1382, 1e-05},
                                  {0.2835, 0.107, 0},
                                  {0.2187, 0.0816, 0},
                                  {0.1649, 0.061, 0},
                                  {0.1212, 0.04458, 0},
                                  {0.0874, 0.032, 0},
                                  {0.0636, 0.0232, 0},
                                  {0.04677, 0.017, 0},
                                  {0.0329, 0.01192, 0},
                                  {0.0227, 0.00821, 0},
                                  {0.01584, 0.005723, 0},
                                  {0.01135916, 0.004102, 0},
                                  {0.008110916, 0.002929, 0},
                                  {0.005790346, 0.002091, 0},
                                  {0.004109457, 0.001484, 0},
                                  {0.002899327, 0.001047, 0},
                                  {0.00204919, 0.00074, 0},
                                  {0.001439971, 0.00052, 0},
                                  {0.0009999493, 0.0003611, 0},
                                  {0.0006900786, 0.0002492, 0},
                                  {0.0004760213, 0.0001719, 0},
                                  {0.0003323011, 0.00012, 0},
                                  {0.0002348261, 8.48e-05, 0},
                                  {0.0001661505, 6e-05, 0},
                                  {0.000117413, 4.24e-05, 0},
                                  {8.307527e-05, 3e-05, 0},
                                  {5.870652e-05, 2.12e-05, 0},
                                  {4.150994e-05, 1.499e-05, 0}};
constexpr std::size_t observer_size = std::size(observer);

/// (x, y) with Y = 1.
glm::dvec3 xyz_of(glm::dvec2 chromaticity) {
  const auto [x, y] = std::array{chromaticity.x, chromaticity.y};
  return {x / y, 1, (1 - x - y) / y};
}

glm::dvec3 white_xyz() { return xyz_of({0.3127, 0.3290}); }  // D65

}  // namespace

glm::dvec3 xyz_of_wavelength(double wavelength_m) {
  const double last = static_cast<double>(observer_size - 1),
               place = std::clamp((wavelength_m - least_visible_m) / table_step_m, 0.0, last);
  // Lagrange's cubic through four entries, those of the table's ends where there is none beyond
  const double first = std::clamp(std::floor(place) - 1, 0.0, last - 3), t = place - first;
  const double weights[] = {-(t - 1) * (t - 2) * (t - 3) / 6, t * (t - 2) * (t - 3) / 2,
                            -t * (t - 1) * (t - 3) / 2, t * (t - 1) * (t - 2) / 6};
  glm::dvec3 xyz(0);
  for (std::size_t i = 0; i < 4; ++i) {
    const auto& entry = observer[static_cast<std::size_t>(first) + i];
    xyz += weights[i] * glm::dvec3(entry[0], entry[1], entry[2]);
  }
  return {std::max(xyz.x, 0.0), std::max(xyz.y, 0.0), std::max(xyz.z, 0.0)};
}

glm::dvec2 chromaticity_of(glm::dvec3 xyz) {
  const double sum = xyz.x + xyz.y + xyz.z;
  return sum > 0 ? glm::dvec2(xyz.x, xyz.y) / sum : glm::dvec2(0);
}

glm::dvec3 lab_of(glm::dvec3 xyz, glm::dvec3 white) {
  const auto f = [](double share) {
    constexpr double bend = 6.0 / 29;
    return share > bend * bend * bend ? std::cbrt(share) : share / (3 * bend * bend) + 4.0 / 29;
  };
  const double x = f(xyz.x / white.x), y = f(xyz.y / white.y), z = f(xyz.z / white.z);
  return {116 * y - 16, 500 * (x - y), 200 * (y - z)};
}

double delta_e_2000(glm::dvec3 lab_a, glm::dvec3 lab_b) {
  using std::numbers::pi;
  const auto seventh = [](double c) {
    const double power = std::pow(c, 7);
    return std::sqrt(power / (power + std::pow(25.0, 7)));
  };
  const double mean_chroma = (std::hypot(lab_a.y, lab_a.z) + std::hypot(lab_b.y, lab_b.z)) / 2;
  const double stretch = 1 + 0.5 * (1 - seventh(mean_chroma));
  const double a1 = stretch * lab_a.y, a2 = stretch * lab_b.y;
  const double chroma1 = std::hypot(a1, lab_a.z), chroma2 = std::hypot(a2, lab_b.z);
  const auto hue_of = [](double a, double b) {
    if (a == 0 && b == 0) return 0.0;
    const double hue = std::atan2(b, a);
    return hue < 0 ? hue + 2 * pi : hue;
  };
  const double hue1 = hue_of(a1, lab_a.z), hue2 = hue_of(a2, lab_b.z);
  const bool grey = chroma1 * chroma2 == 0;

  double turn = grey ? 0 : hue2 - hue1;
  if (turn > pi) turn -= 2 * pi;
  if (turn < -pi) turn += 2 * pi;
  const double lightness = lab_b.x - lab_a.x, chroma = chroma2 - chroma1,
               hue = 2 * std::sqrt(chroma1 * chroma2) * std::sin(turn / 2);

  const double mean_l = (lab_a.x + lab_b.x) / 2, mean_c = (chroma1 + chroma2) / 2;
  double mean_hue = hue1 + hue2;
  if (!grey) {
    if (std::abs(hue1 - hue2) > pi) mean_hue += mean_hue < 2 * pi ? 2 * pi : -2 * pi;
    mean_hue /= 2;
  }
  const double degree = pi / 180;
  const double t = 1 - 0.17 * std::cos(mean_hue - 30 * degree) + 0.24 * std::cos(2 * mean_hue) +
                   0.32 * std::cos(3 * mean_hue + 6 * degree) -
                   0.20 * std::cos(4 * mean_hue - 63 * degree);
  const double from_blue = (mean_hue / degree - 275) / 25;
  const double twist = 60 * degree * std::exp(-from_blue * from_blue);
  const double off = (mean_l - 50) * (mean_l - 50);
  const double l = lightness / (1 + 0.015 * off / std::sqrt(20 + off)),
               c = chroma / (1 + 0.045 * mean_c), h = hue / (1 + 0.015 * mean_c * t);
  return std::sqrt(l * l + c * c + h * h - 2 * seventh(mean_c) * std::sin(twist) * c * h);
}

glm::dmat3 xyz_from_srgb() {
  const glm::dmat3 primaries(xyz_of({0.64, 0.33}), xyz_of({0.30, 0.60}), xyz_of({0.15, 0.06}));
  const auto share = glm::inverse(primaries) * white_xyz();
  return {primaries[0] * share.x, primaries[1] * share.y, primaries[2] * share.z};
}

double srgb_of(double linear) {
  const double v = std::clamp(linear, 0.0, 1.0);
  return v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055;
}

namespace {

/// Powers of lasers for a colour: powers[i] = dot(rows[i], rgb).
using PowersOfRgb = std::vector<glm::dvec3>;

/// Those of two or three lasers: the (pseudo-)inverse of their colours.
///
/// rgb      linear sRGB of each laser, for a power of one
/// returns  nothing for lasers on a line of the chromaticity diagram, which mix nothing else
PowersOfRgb powers_of(const std::vector<glm::dvec3>& rgb) {
  if (rgb.size() == 2) {
    constexpr double least_share = 1e-9;
    const double aa = glm::dot(rgb[0], rgb[0]), ab = glm::dot(rgb[0], rgb[1]),
                 bb = glm::dot(rgb[1], rgb[1]), square = aa * bb - ab * ab;
    if (!(square > least_share * aa * bb)) return {};
    return {(bb * rgb[0] - ab * rgb[1]) / square, (aa * rgb[1] - ab * rgb[0]) / square};
  }
  constexpr double least_volume = 5e-9;
  const glm::dmat3 lasers(rgb[0], rgb[1], rgb[2]);
  if (!(std::abs(glm::determinant(lasers)) > least_volume)) return {};
  const auto rows = glm::transpose(glm::inverse(lasers));
  return {rows[0], rows[1], rows[2]};
}

/// Mean mix of a primary of sRGB over the threes that mix it; without light that a laser would have
/// to take away where some can do so, else of those that need the least of it.
struct Mix {
  std::vector<double> powers;
  double taken = std::numeric_limits<double>::infinity();
  int parts = 0;

  void add(const PowersOfRgb& rows, const std::vector<std::size_t>& of, int primary) {
    double taken_here = 0;
    for (const auto& row : rows) taken_here += std::max(0.0, -row[primary]);
    if (taken_here > taken) return;
    if (taken_here < taken) std::fill(powers.begin(), powers.end(), 0), parts = 0;
    taken = taken_here;
    ++parts;
    for (std::size_t i = 0; i < of.size(); ++i) powers[of[i]] += rows[i][primary];
  }
};

}  // namespace

double white_error(glm::dvec3 rgb) {
  const auto wanted = xyz_from_srgb() * glm::dvec3(1);
  return delta_e_2000(lab_of(xyz_from_srgb() * rgb, wanted), lab_of(wanted, wanted));
}

LaserDrive drive_of(const LaserSet& lasers, const LaserBench& bench,
                    const std::vector<double>& light) {
  LaserDrive drive;
  const auto of = [](const std::vector<double>& values, std::size_t i) {
    return values.empty() ? 1 : values[i];
  };
  for (std::size_t i = 0; i < light.size(); ++i)
    drive.powers.push_back(light[i] / (of(bench.efficiencies, i) * of(bench.duties, i)));
  const double sum = std::accumulate(drive.powers.begin(), drive.powers.end(), 0.0);
  for (double& power : drive.powers) power = sum > 0 ? power / sum : 0;
  if (bench.powers.empty()) return drive;
  double largest = 0;
  for (std::size_t i = 0; i < light.size(); ++i) {
    drive.shares.push_back(drive.powers[i] / bench.powers[i]);
    largest = std::max(largest, drive.shares.back());
  }
  for (std::size_t i = 0; i < light.size(); ++i) {
    drive.shares[i] = largest > 0 ? drive.shares[i] / largest : 0;
    if (drive.shares[i] > 0) drive.full += lasers.rgb[i] / drive.shares[i];
  }
  const double luminance = (xyz_from_srgb() * drive.full).y;
  if (luminance > 0) drive.full /= luminance;
  return drive;
}

LaserSet laser_set(const std::vector<double>& wavelengths_m) {
  LaserSet set;
  set.wavelengths_m = wavelengths_m;
  const auto count = wavelengths_m.size();
  const auto rgb_from_xyz = glm::inverse(xyz_from_srgb());
  for (const double wavelength_m : wavelengths_m)
    set.rgb.push_back(rgb_from_xyz * xyz_of_wavelength(wavelength_m));

  std::array<Mix, 3> mixes;
  for (auto& mix : mixes) mix.powers.resize(count);
  std::vector<bool> is_in(count);  // every three, or both
  std::fill_n(is_in.begin(), std::min<std::size_t>(count, 3), true);
  do {
    std::vector<std::size_t> of;
    std::vector<glm::dvec3> rgb;
    for (std::size_t i = 0; i < count; ++i)
      if (is_in[i]) of.push_back(i), rgb.push_back(set.rgb[i]);
    if (const auto rows = powers_of(rgb); !rows.empty())
      for (int primary = 0; primary < 3; ++primary)
        mixes[static_cast<std::size_t>(primary)].add(rows, of, primary);
  } while (std::prev_permutation(is_in.begin(), is_in.end()));
  if (mixes[0].parts == 0) throw std::invalid_argument("their colours lie on a line");

  double sum = 0;
  for (std::size_t i = 0; i < count; ++i) {
    glm::dvec3 row;
    for (std::size_t k = 0; k < 3; ++k)
      row[static_cast<int>(k)] = mixes[k].powers[i] / mixes[k].parts;
    const double in_white = row.x + row.y + row.z;
    constexpr double least_power = 1e-6;
    if (!(in_white > least_power))
      throw std::invalid_argument("white (D65) has no light of " + length_text(wavelengths_m[i]) +
                                  " in it");
    set.from_rgb.push_back(row / in_white);
    set.rgb[i] *= in_white;
    set.white_powers.push_back(in_white);
    sum += in_white;
  }
  for (double& power : set.white_powers) power /= sum;
  return set;
}

}  // namespace raywave
