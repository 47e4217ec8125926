// SPDX-License-Identifier: Apache-2.0
#include "host/view/pupil.hpp"

#include <functional>
#include <numeric>

#include "host/common/error.hpp"
#include "host/planning/make_plan.hpp"
#include "host/view/compare.hpp"
#include "host/view/lens.hpp"
#include "host/view/reconstruct.hpp"
#include "tests/support/devices.hpp"
#include "tests/support/render.hpp"

namespace raywave {
namespace {

using namespace test;
using std::numbers::pi;

constexpr auto host = cl::FftBackend::host;

// The oracle: what an eye's retina receives of the SLM's grey levels, in double precision, step by
// step. Light goes from plane to plane by Fresnel's integral, a sum over points. Each step but the
// pupil's edge is a product over the axes, so that it is a matrix for each.

using Complex = std::complex<double>;

struct Matrix {
  int rows = 0, columns = 0;
  std::vector<Complex> cells;
  Matrix(int r, int c) : rows(r), columns(c), cells(std::size_t(r) * c) {}
  Complex& operator()(int r, int c) { return cells[std::size_t(r) * columns + c]; }
  const Complex& operator()(int r, int c) const { return cells[std::size_t(r) * columns + c]; }
};

Matrix times(const Matrix& a, const Matrix& b) {
  Matrix product(a.rows, b.columns);
  for (int r = 0; r < a.rows; ++r)
    for (int k = 0; k < a.columns; ++k) {
      const auto factor = a(r, k);
      for (int c = 0; c < b.columns; ++c) {  // in parts: operator* looks for infinities
        const auto cell = b(k, c);
        product(r, c) += Complex(factor.real() * cell.real() - factor.imag() * cell.imag(),
                                 factor.real() * cell.imag() + factor.imag() * cell.real());
      }
    }
  return product;
}

Matrix transposed(const Matrix& a) {
  Matrix turned(a.columns, a.rows);
  for (int r = 0; r < a.rows; ++r)
    for (int c = 0; c < a.columns; ++c) turned(c, r) = a(r, c);
  return turned;
}

using Places = std::vector<double>;

/// n places around the axis; upwards, or downwards as rows of arrays.
Places places(int n, double pitch_m, double sign = 1) {
  Places all;
  for (int i = 0; i < n; ++i) all.push_back(sign * (i - (n - 1) / 2.0) * pitch_m);
  return all;
}

Matrix fresnel(const Places& to, const Places& from, double wavelength_m, double distance_m) {
  Matrix kernel(static_cast<int>(to.size()), static_cast<int>(from.size()));
  for (int r = 0; r < kernel.rows; ++r)
    for (int c = 0; c < kernel.columns; ++c)
      kernel(r, c) =
          std::polar(1.0, pi * (to[r] - from[c]) * (to[r] - from[c]) / (wavelength_m * distance_m));
  return kernel;
}

/// Multiplies rows by what a thin lens does, times a factor.
void pass_lens(
    Matrix& light, const Places& at, double wavelength_m, double focal_m,
    const std::function<double(double)>& open = [](double) { return 1.0; }) {
  for (int r = 0; r < light.rows; ++r)
    for (int c = 0; c < light.columns; ++c)
      light(r, c) *= std::polar(open(at[r]), -pi * at[r] * at[r] / (wavelength_m * focal_m));
}

struct Eye {
  ViewerSpec viewer;
  HologramSpec hologram;
  double retina_m = 17e-3;

  /// From the hologram's places to the pupil's.
  Matrix to_pupil(const Places& pupil_m, const Places& hologram_m) const {
    const double lambda = hologram.wavelength_m;
    if (!viewer.eyepiece_m) return fresnel(pupil_m, hologram_m, lambda, viewer.distance_m);
    const auto lens_m = places(2200, 2.4e-6);
    auto light = fresnel(lens_m, hologram_m, lambda, viewer.eyepiece_distance_m);
    // Its edge is soft
    pass_lens(light, lens_m, lambda, *viewer.eyepiece_m, [](double x_m) {
      const double beyond = std::clamp((std::abs(x_m) - 2.1e-3) / 0.5e-3, 0.0, 1.0);
      return 0.5 + 0.5 * std::cos(pi * beyond);
    });
    return times(fresnel(pupil_m, lens_m, lambda, viewer.eye_relief_m), light);
  }

  /// Places in the pupil along an axis.
  Places across(double place_m) const {
    const double pitch_m = 4e-6;
    auto all_m = places(static_cast<int>(viewer.pupil_m / pitch_m), pitch_m);
    for (auto& at_m : all_m) at_m += place_m;
    return all_m;
  }

  /// Light that reaches the square around a pupil.
  Matrix reach(const FieldStack& shown, glm::dvec2 place_m) const {
    const auto& h = hologram;
    Matrix light(shown.ny, shown.nx);
    for (std::size_t i = 0; i < light.cells.size(); ++i) light.cells[i] = Complex(shown.samples[i]);
    return times(times(to_pupil(across(place_m.y), places(shown.ny, h.pitch_m.y, -1)), light),
                 transposed(to_pupil(across(place_m.x), places(shown.nx, h.pitch_m.x))));
  }

  /// Intensities where the eye shows the pixels of the plane z_m, in focus.
  ///
  /// pupil  what reach() gives
  Image see(Matrix pupil, glm::dvec2 place_m, double z_m, glm::ivec2 window) const {
    const auto& h = hologram;
    const double lambda = h.wavelength_m, radius_m = viewer.pupil_m / 2;
    const auto px_m = across(place_m.x), py_m = across(place_m.y);
    // From the plane z to the pupil: p = a s + b slope, slope there = c s + d slope
    double a = 1, b = viewer.distance_m, c = 0, d = 1;
    if (const auto focal = viewer.eyepiece_m) {
      const double e = viewer.eyepiece_distance_m, t = viewer.eye_relief_m;
      a = 1 - t / *focal, b = e + t - e * t / *focal, c = -1 / *focal, d = 1 - e / *focal;
    }
    b += a * z_m;
    d += c * z_m;
    // The eye's lens focuses that plane
    const double power = d / b + 1 / retina_m;
    for (int r = 0; r < pupil.rows; ++r)
      for (int k = 0; k < pupil.columns; ++k) {
        const double x_m = px_m[k], y_m = py_m[r];
        const bool is_open = std::hypot(x_m - place_m.x, y_m - place_m.y) <= radius_m;
        pupil(r, k) *=
            is_open ? std::polar(1.0, -pi * (x_m * x_m + y_m * y_m) * power / lambda) : 0;
      }
    const auto on_retina = [&](Places seen_m) {
      for (auto& s_m : seen_m) s_m *= -retina_m / b;
      return seen_m;
    };
    const auto retina = times(
        times(fresnel(on_retina(places(window.y, h.pitch_m.y, -1)), py_m, lambda, retina_m), pupil),
        transposed(fresnel(on_retina(places(window.x, h.pitch_m.x)), px_m, lambda, retina_m)));
    Image image{window.x, window.y, {}};
    for (const auto& u : retina.cells) image.pixels.push_back(static_cast<float>(std::norm(u)));
    return image;
  }
};

/// What an SLM of 256 levels shows of points at several depths.
FieldStack levels_of_points(const HologramSpec& h) {
  FieldStack field{h.resolution.x, h.resolution.y, 1, {}};
  const std::array<glm::dvec3, 4> points{{{60 * um, 40 * um, 9 * mm},
                                          {-150 * um, 0, 12 * mm},
                                          {0, -100 * um, -7 * mm},
                                          {170 * um, 90 * um, -11 * mm}}};
  for (int j = 0; j < field.ny; ++j)
    for (int i = 0; i < field.nx; ++i) {
      const double x = (i - (field.nx - 1) / 2.0) * h.pitch_m.x,
                   y = ((field.ny - 1) / 2.0 - j) * h.pitch_m.y;
      Complex sum = 0;
      for (const auto& p : points) {
        const double r = std::copysign(std::hypot(x - p.x, y - p.y, p.z), p.z);
        sum += std::polar(1.0, std::remainder(2 * pi * r / h.wavelength_m, 2 * pi));
      }
      const double level = std::round(std::arg(sum) / (2 * pi) * 256);
      field.samples.emplace_back(std::polar(1.0, 2 * pi * level / 256));
    }
  return field;
}

DEVICE_TEST(
    "pictures through a pupil are those on a retina: levels, eyepiece, pupil and eye, summed") {
  const HologramSpec h{{96, 64}, {8 * um, 8 * um}, 638e-9};
  ViewerSpec bare, eyepiece, off_focus;
  bare.distance_m = 60 * mm;
  bare.pupil_m = 1.2 * mm;
  eyepiece.pupil_m = 1 * mm;
  eyepiece.eyepiece_m = eyepiece.eyepiece_distance_m = eyepiece.eye_relief_m = 50 * mm;
  off_focus = eyepiece;
  off_focus.eyepiece_distance_m = 45 * mm;
  off_focus.eye_relief_m = 40 * mm;
  const auto shown = levels_of_points(h);
  for (const auto& viewer : {bare, eyepiece, off_focus}) {
    const Eye eye{viewer, h};
    for (const glm::dvec2 place : {glm::dvec2(0, 0),
                                   {1.0 * mm, 0},
                                   {-0.9 * mm, 0.2 * mm},
                                   {0.3 * mm, 0.8 * mm},
                                   {0, -0.7 * mm}}) {
      const auto reached = eye.reach(shown, place);
      for (const double z_m : {-9 * mm, 10 * mm, 20 * mm}) {
        ReconstructSpec what{.z_m = z_m};
        what.pupil = pupil_at(viewer, place);
        const auto seen = reconstruct(device, host, shown, h, what);
        const auto figures =
            compare_pictures(eye.see(reached, place, z_m, h.resolution), seen, {0, 0, {}});
        CAPTURE(viewer.eyepiece_m.value_or(0), viewer.eyepiece_distance_m, place.x, place.y, z_m);
        INFO("PSNR " << figures.psnr_db << " dB");
        CHECK(figures.psnr_db > 40);
      }
    }
  }
}

/// An eye one focal length behind an eyepiece of 50 mm, one focal length before the SLM.
ViewerSpec near_eye(double pupil_m) {
  ViewerSpec viewer;
  viewer.pupil_m = pupil_m;
  viewer.eyepiece_m = viewer.eyepiece_distance_m = viewer.eye_relief_m = 50 * mm;
  return viewer;
}

FieldStack field_of(const HologramSpec& h, const std::function<double(double, double)>& turns) {
  FieldStack field{h.resolution.x, h.resolution.y, 1, {}};
  for (int j = 0; j < field.ny; ++j)
    for (int i = 0; i < field.nx; ++i)
      field.samples.emplace_back(
          std::polar(1.0, 2 * pi *
                              std::remainder(turns((i - (field.nx - 1) / 2.0) * h.pitch_m.x,
                                                   ((field.ny - 1) / 2.0 - j) * h.pitch_m.y),
                                             1.0)));
  return field;
}

/// Spherical wave of a point, where it is not too steep for the pixels.
FieldStack wave_of(const HologramSpec& h, glm::dvec2 at_m, double z_m) {
  auto field = field_of(h, [&](double x, double y) {
    return std::copysign(std::hypot(x - at_m.x, y - at_m.y, z_m), z_m) / h.wavelength_m;
  });
  const auto reach_m = 0.95 * std::abs(z_m) * h.wavelength_m / (2.0 * h.pitch_m);
  for (int j = 0; j < field.ny; ++j)
    for (int i = 0; i < field.nx; ++i) {
      const glm::dvec2 place((i - (field.nx - 1) / 2.0) * h.pitch_m.x,
                             ((field.ny - 1) / 2.0 - j) * h.pitch_m.y);
      if (glm::any(glm::greaterThan(glm::abs(place - at_m), reach_m)))
        field.samples[std::size_t(j) * field.nx + i] = 0;
    }
  return field;
}

double light_of(const Image& image) {
  return std::accumulate(image.pixels.begin(), image.pixels.end(), 0.0);
}

DEVICE_TEST("light of a frequency enters the eyebox, lambda f / pitch wide, at its share of it") {
  const HologramSpec h{{96, 80}, {8 * um, 6 * um}, 638e-9};
  const auto viewer = near_eye(0.6 * mm);
  for (const glm::dvec2 cycles : {glm::dvec2(0.3, 0), {-0.2, 0.25}, {0, -0.35}}) {
    const auto field = field_of(h, [&](double x, double y) {
      return cycles.x * x / h.pitch_m.x + cycles.y * y / h.pitch_m.y;
    });
    const glm::dvec2 expected = cycles * h.wavelength_m * 50e-3 / h.pitch_m;
    glm::dvec2 sum(0);
    double all = 0, farthest = 0;
    for (int j = -10; j <= 10; ++j)
      for (int i = -10; i <= 10; ++i) {
        const glm::dvec2 place = glm::dvec2(i, j) * 0.2 * mm;
        ReconstructSpec what{.z_m = -5 * mm};
        what.pupil = pupil_at(viewer, place);
        const double light = light_of(reconstruct(device, host, field, h, what));
        sum += light * place;
        all += light;
        if (light > 0.5 * h.resolution.x * h.resolution.y)
          farthest = std::max(farthest, glm::length(place - expected));
      }
    const auto eyebox_m = pupil_at(viewer, {}).eyebox_m(h);
    CHECK(std::abs(sum.x / all - expected.x) < 0.02 * eyebox_m.x / 2);
    CHECK(std::abs(sum.y / all - expected.y) < 0.02 * eyebox_m.y / 2);
    CHECK(farthest < 0.4 * mm);
  }
}

DEVICE_TEST("a point stays sharp within 2 lambda / pupil^2 dioptres: a quarter of a wave") {
  const HologramSpec h{{129, 127}, {8 * um, 8 * um}, 638e-9};
  const double z_m = 12 * mm;
  const auto field = wave_of(h, {0, 0}, z_m);
  for (const double pupil_m : {1.5 * mm, 2 * mm}) {
    const auto viewer = near_eye(pupil_m);
    // Brightness of the pixel on the axis, (sin(pi w) / (pi w))^2 at w waves on the pupil's edge.
    // The pupil stands in the focal plane: a plane at z is -z / f^2 dioptres away from it
    const auto on_axis = [&](double dioptres) {
      ReconstructSpec what{.z_m = -dioptres * 50 * mm * 50 * mm, .window_m = h.pitch_m * 1.01};
      what.pupil = pupil_at(viewer, {});
      return static_cast<double>(reconstruct(device, host, field, h, what).pixels.at(0));
    };
    const double at = -z_m / (50 * mm * 50 * mm), sharp = on_axis(at),
                 quarter = std::pow(std::sin(pi / 4) / (pi / 4), 2),
                 expected = 2 * h.wavelength_m / (pupil_m * pupil_m);
    double sum = 0;
    for (const double side : {-1.0, 1.0}) {
      double low = 0, high = 3 * expected;
      for (int step = 0; step < 14; ++step) {
        const double middle = (low + high) / 2;
        (on_axis(at + side * middle) > quarter * sharp ? low : high) = middle;
      }
      sum += low;
    }
    CAPTURE(pupil_m, sum / 2, expected);
    CHECK(std::abs(sum / 2 / expected - 1) < 0.02);
  }
}

DEVICE_TEST("seen through a moved pupil, lens and hologram put a point out of focus alike") {
  const HologramSpec h{{240, 200}, {8 * um, 8 * um}, 638e-9};
  const glm::dvec2 at(0.1 * mm, -0.06 * mm);
  ViewerSpec bare;
  bare.distance_m = 80 * mm;
  bare.pupil_m = 1 * mm;
  auto turned = near_eye(1 * mm);
  turned.eye_relief_m = 40 * mm;
  for (const double z_m : {9 * mm, -9 * mm}) {
    Scene scene{.hologram = h,
                .materials = {Material{.ambient = glm::dvec3(1), .diffuse = glm::dvec3(0)}},
                .objects = {Object{.mesh = std::filesystem::path(RAYWAVE_DATA_DIR) / "square.ply",
                                   .width_m = 24 * um,
                                   .position_m = {at, z_m}}}};
    const auto world = build_world(scene);
    const auto plan = make_plan(scene, world);
    const DeviceScene arrays(device, world, plan);
    const auto field = wave_of(h, at, z_m);
    for (const auto& viewer : {bare, near_eye(1 * mm), turned})
      for (const glm::dvec2 place : {glm::dvec2(0.7 * mm, 0), {-0.5 * mm, 0.6 * mm}}) {
        const auto pupil = pupil_at(viewer, place);
        const double seen_m = z_m + 6 * mm;
        const auto middle = [&](const Image& image) {
          glm::dvec2 sum(0);
          double all = 0;
          for (int j = 0; j < image.height; ++j)
            for (int i = 0; i < image.width; ++i) {
              const double v = image.pixels[std::size_t(j) * image.width + i];
              sum += v * glm::dvec2(i - (image.width - 1) / 2.0, (image.height - 1) / 2.0 - j);
              all += v;
            }
          return sum / all * h.pitch_m;
        };
        // The ray from the point to the pupil's middle, where it meets the plane looked at
        glm::dvec2 expected;
        for (int axis = 0; axis < 2; ++axis) {
          const double through = pupil.through_m(at[axis], z_m, place[axis]);
          expected[axis] = through + (at[axis] - through) * seen_m / z_m;
        }
        LensSpec lens{.z_m = seen_m, .points = 24};
        lens.pupil = pupil;
        ReconstructSpec shown{.z_m = seen_m};
        shown.pupil = pupil;
        const auto of_lens = middle(lens_picture(device, plan, arrays, lens)),
                   of_hologram = middle(reconstruct(device, host, field, h, shown));
        CAPTURE(z_m, viewer.eyepiece_m.value_or(0), place.x, place.y, expected.x, expected.y);
        CAPTURE(of_lens.x, of_lens.y, of_hologram.x, of_hologram.y);
        CHECK(glm::length(of_lens - expected) < h.pitch_m.x / 2);
        CHECK(glm::length(of_hologram - expected) < h.pitch_m.x);
      }
  }
}

DEVICE_TEST("pixels whose own order passes beside the pupil are dark, however coarse they are") {
  const HologramSpec coarse{{128, 80}, {8 * um, 8 * um}, 638e-9};
  ViewerSpec viewer;
  viewer.distance_m = 15 * mm;
  viewer.pupil_m = 0.3 * mm;
  const auto pupil = pupil_at(viewer, {0.45 * mm, 0});
  // Pixel x shows the pupil at (0.45 mm - x) / (lambda d): beyond their band where x < -0.15 mm
  const auto edge_m = 0.45 * mm - 638e-9 * 15 * mm / (2 * 8 * um);
  const auto field = field_of(coarse, [&](double x, double y) {
    return -((0.45 * mm - x) * (0.45 * mm - x) + y * y) / (2 * 638e-9 * 15 * mm);
  });
  ReconstructSpec what{.z_m = -1e-4};
  what.pupil = pupil;
  const auto seen = reconstruct(device, host, field, coarse, what);
  double dark = 0, light = 0;
  for (int j = 0; j < seen.height; ++j)
    for (int i = 0; i < seen.width; ++i) {
      const double x = (i - (seen.width - 1) / 2.0) * 8 * um;
      const double v = seen.pixels[std::size_t(j) * seen.width + i];
      (x < edge_m - 40 * um ? dark : light) += v;
    }
  CHECK(dark < 0.03 * light);
  CHECK(light > 100);
}

TEST_CASE("pupils that cannot be are refused with what would serve") {
  const HologramSpec h{{64, 64}, {2 * um, 2 * um}, 638e-9};
  const auto said = [&](const ViewerSpec& viewer, glm::dvec2 place) -> std::string {
    try {
      PupilFilter(h, pupil_at(viewer, place));
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  ViewerSpec viewer;
  CHECK(said(viewer, {0, 0}).empty());
  viewer.distance_m = 0;
  CHECK(said(viewer, {0, 0}).find("distance > 0") != std::string::npos);
  viewer.distance_m = 0.25;
  viewer.pupil_m = 2 * um;
  CHECK(said(viewer, {0, 0}).find("give a larger one") != std::string::npos);
  viewer.pupil_m = 4 * mm;
  CHECK(said(viewer, {0.2, 0}).find("place it farther away") != std::string::npos);
  viewer.eyepiece_m = 50 * mm;
  viewer.eyepiece_distance_m = viewer.eye_relief_m = 100 * mm;
  CHECK(said(viewer, {0, 0}).find("another eye_relief") != std::string::npos);
}

}  // namespace
}  // namespace raywave
