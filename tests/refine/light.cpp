// SPDX-License-Identifier: Apache-2.0
#include "host/refine/light.hpp"

#include "tests/support/devices.hpp"
#include "tests/support/keys.hpp"
#include "tests/support/scenes.hpp"

namespace raywave::refinement {
namespace {

using Complex = std::complex<double>;
using std::numbers::pi;
using namespace test;

struct Setup {
  Optics optics;
  std::vector<Key> keys;
};

/// Odd and non-square holograms, apertures on and off the axis.
std::vector<Setup> setups() {
  std::vector<Setup> all;
  for (const glm::ivec2 size : {glm::ivec2(37, 29), {64, 48}, {33, 70}}) {
    Setup s;
    s.optics = {size, {3.74 * um, 3.74 * um}, 638e-9, 9 * um};
    const glm::ivec2 pixels = size - glm::ivec2(6, 4);
    for (const double z : {0.9 * mm, 1.6 * mm, -1.3 * mm}) {
      s.keys.push_back(key_at(z, {0, 0}, {1, 1}, pixels, s.optics.pitch_m));
      s.keys.push_back(key_at(z, {0.31, -0.22}, {0.5, 0.5}, pixels, s.optics.pitch_m));
      s.keys.push_back(key_at(z, {-0.9, 0.6}, {0.4, 0.7}, {20, 15}, {7 * um, 6 * um}));
    }
    all.push_back(s);
  }
  all[1].optics.pitch_m = {3.74 * um, 5 * um};
  return all;
}

/// Kernels of clFFT and VkFFT are compiled for each size, for seconds: all are tried with few.
cl::FftBackend usual_backend(const cl::Device& device) {
  return cl::default_backend(device.info());
}

/// The host's, which goes other ways, and the quickest to compile of the device's.
std::vector<cl::FftBackend> backends_for_spectra(const cl::Device& device) {
  std::vector<cl::FftBackend> backends{cl::FftBackend::host};
  if (cl::serves(cl::FftBackend::vkfft, device.info())) backends.push_back(cl::FftBackend::vkfft);
  return backends;
}

/// The hologram's pixels that the aperture leaves open; the rest is zero.
std::vector<Complex> masked(const FieldStack& field, int frame, const OpenPart& open) {
  std::vector<Complex> all(static_cast<std::size_t>(field.nx) * field.ny);
  for (int y = open.first.y; y < open.first.y + open.size.y; ++y) {
    for (int x = open.first.x; x < open.first.x + open.size.x; ++x)
      all[static_cast<std::size_t>(y) * field.nx + x] =
          field.samples[(static_cast<std::size_t>(frame) * field.ny + y) * field.nx + x];
  }
  return all;
}

/// Sum over the hologram of h exp(i k |x - p|^2 / (2 z)), conjugated as light that goes back to its
/// source: the intensity of a Fresnel propagation, up to a factor.
double direct_intensity(const Optics& optics, const std::vector<Complex>& h, double z_m,
                        glm::dvec2 place_m) {
  Complex sum = 0;
  for (int y = 0; y < optics.size.y; ++y) {
    for (int x = 0; x < optics.size.x; ++x) {
      const glm::dvec2 at((x - (optics.size.x - 1) / 2.0) * optics.pitch_m.x,
                          ((optics.size.y - 1) / 2.0 - y) * optics.pitch_m.y);
      const auto d = at - place_m;
      sum += h[static_cast<std::size_t>(y) * optics.size.x + x] *
             std::polar(1.0, -pi * (d.x * d.x + d.y * d.y) / (optics.wavelength_m * z_m));
    }
  }
  return std::norm(sum);
}

DEVICE_TEST("Fresnel pictures are the direct sums at the places that the grid names") {
  for (const auto backend : backends_of(device)) {
    auto tried = setups();
    if (backend != usual_backend(device)) tried.resize(1);
    for (const auto& s : tried) {
      const auto field = random_phases(s.optics.size, 2, 3);
      PhaseStack holograms(device);
      holograms.take(field);
      std::vector<PictureGrid> grids;
      for (const auto& key : s.keys)
        grids.push_back(picture_grid(s.optics, key, Propagation::fresnel));
      const auto light = Light::make(device, backend);
      light->fit(s.optics, grids);
      for (std::size_t key = 0; key < s.keys.size(); ++key) {
        const auto& grid = light->grid(key);
        const auto h = masked(field, 1, grid.open);
        light->show(holograms, 1, key);
        const auto plane = light->plane(key).read();
        double worst = 0;
        for (int y = grid.known_first.y; y < grid.known_first.y + grid.known_size.y; y += 7) {
          for (int x = grid.known_first.x; x < grid.known_first.x + grid.known_size.x; x += 5) {
            const double expected =
                direct_intensity(s.optics, h, s.keys[key].z_m, {grid.x_m(x), grid.y_m(y)});
            const double got =
                std::norm(Complex(plane[static_cast<std::size_t>(y) * grid.size.x + x]));
            worst = std::max(worst, std::abs(got - expected));
          }
        }
        // Relative to the mean intensity, the number of open pixels; peaks are 10 times as bright
        INFO(s.optics.size.x << " x " << s.optics.size.y << ", key " << key);
        CHECK(worst <= 2e-5 * grid.open.size.x * grid.open.size.y);
      }
    }
  }
}

/// The intensity that the exact propagation shows, of a spectrum sampled finely enough that nothing
/// wraps around: in double precision, up to the factor of direct_intensity.
struct AngularSpectrum {
  AngularSpectrum(const Optics& optics, const std::vector<Complex>& h, double z_m)
      : optics_(optics) {
    const auto n = optics.size;
    const auto phase = [&](int axis, int i, int k) {
      return -2 * pi * frequency_m(axis, k) * place_m(axis, i);
    };
    std::vector<Complex> rows(static_cast<std::size_t>(samples) * n.y);
    for (int y = 0; y < n.y; ++y)
      for (int k = 0; k < samples; ++k)
        for (int x = 0; x < n.x; ++x)
          rows[static_cast<std::size_t>(y) * samples + k] +=
              h[static_cast<std::size_t>(y) * n.x + x] * std::polar(1.0, phase(0, x, k));
    spectrum_.resize(static_cast<std::size_t>(samples) * samples);
    for (int l = 0; l < samples; ++l) {
      for (int y = 0; y < n.y; ++y) {
        const auto turned = std::polar(1.0, phase(1, y, l));
        for (int k = 0; k < samples; ++k)
          spectrum_[static_cast<std::size_t>(l) * samples + k] +=
              rows[static_cast<std::size_t>(y) * samples + k] * turned;
      }
      for (int k = 0; k < samples; ++k) {
        const double u = optics.wavelength_m * frequency_m(0, k),
                     v = optics.wavelength_m * frequency_m(1, l), square = u * u + v * v;
        spectrum_[static_cast<std::size_t>(l) * samples + k] *=
            square < 1
                ? std::polar(1.0, -2 * pi * z_m / optics.wavelength_m * (std::sqrt(1 - square) - 1))
                : 0;
      }
    }
    const auto pixel_m2 = optics.pitch_m.x * optics.pitch_m.y;
    factor_ = optics.wavelength_m * z_m / pixel_m2 / (1.0 * samples * samples);
  }
  double at(glm::dvec2 at_m) const {
    Complex sum = 0;
    for (int l = 0; l < samples; ++l) {
      Complex row = 0;
      for (int k = 0; k < samples; ++k)
        row += spectrum_[static_cast<std::size_t>(l) * samples + k] *
               std::polar(1.0, 2 * pi * frequency_m(0, k) * at_m.x);
      sum += row * std::polar(1.0, 2 * pi * frequency_m(1, l) * at_m.y);
    }
    return std::norm(sum * factor_);
  }

private:
  static constexpr int samples = 640;
  double frequency_m(int axis, int k) const {
    return (k - samples / 2) / (samples * optics_.pitch_m[axis]);
  }
  double place_m(int axis, int i) const {
    return (axis == 0 ? 1 : -1) * (i - (optics_.size[axis] - 1) / 2.0) * optics_.pitch_m[axis];
  }
  Optics optics_;
  std::vector<Complex> spectrum_;
  double factor_;
};

DEVICE_TEST(
    "corrected and exact pictures are those of the angular spectrum, in windows wider than pixels "
    "show from all of the hologram",
    "[slow]") {
  // 0.7 and 2.4 times what pixels show to one side, at 5 degrees, and at 18 degrees an axis
  const double z_m = 1.5 * mm, near_m = 0.25 * mm;
  const Optics usual{{96, 60}, {3.74 * um, 3.74 * um}, 638e-9, 9 * um},
      steep{{96, 60}, {1 * um, 1 * um}, 638e-9, 3 * um};
  const std::pair<Optics, Key> cases[] = {
      {usual, key_at(z_m, {0, 0}, {1, 1}, {100, 50}, usual.pitch_m)},
      {usual, key_at(z_m, {0.4, -0.2}, {0.5, 0.6}, {110, 60}, usual.pitch_m)},
      {usual, key_at(-z_m, {0.4, -0.2}, {0.5, 0.6}, {110, 60}, usual.pitch_m)},
      {steep, key_at(near_m, {0, 0}, {1, 1}, {200, 90}, steep.pitch_m)}};
  for (auto [optics, key] : cases) {
    const auto n = optics.size;
    // Plane waves up to 0.42 cycles per pixel, fainter towards the edges: of white light the band's
    // own limit reaches beyond any margin
    const auto open = open_part(n, key.view, key.aperture);
    std::mt19937 random(3);
    std::uniform_real_distribution<double> cycles(-0.42, 0.42);
    std::vector<Complex> lit(static_cast<std::size_t>(n.x) * n.y);
    const auto hann = [](int i, int all) { return std::pow(std::sin(pi * (i + 0.5) / all), 2); };
    for (int wave = 0; wave < 60; ++wave) {
      const glm::dvec2 f(cycles(random), cycles(random));
      const double turns = cycles(random);
      for (int y = open.first.y; y < open.first.y + open.size.y; ++y)
        for (int x = open.first.x; x < open.first.x + open.size.x; ++x)
          lit[static_cast<std::size_t>(y) * n.x + x] +=
              std::polar(hann(x - open.first.x, open.size.x) * hann(y - open.first.y, open.size.y),
                         2 * pi * (f.x * x + f.y * y + turns));
    }
    FieldStack field{n.x, n.y, 1, {}};
    std::vector<float> beam;
    for (const auto& value : lit) {
      field.samples.emplace_back(value);
      beam.push_back(static_cast<float>(std::abs(value)));
    }
    optics.showing.beam = std::make_shared<const std::vector<float>>(beam);
    const AngularSpectrum spectrum(optics, lit, key.z_m);
    for (const auto propagation : {Propagation::corrected, Propagation::exact}) {
      const auto grid = picture_grid(optics, key, propagation);
      CHECK((propagation == Propagation::exact) ==
            (grid.spectrum.finer.x == grid.spectrum.pixels.x));
      // Exact light has the unit of the hologram's, the others that of direct_intensity
      const double pixel_m2 = optics.pitch_m.x * optics.pitch_m.y,
                   factor = propagation == Propagation::exact
                                ? std::pow(pixel_m2 / (optics.wavelength_m * key.z_m), 2)
                                : 1;
      std::vector<std::size_t> seen;
      std::vector<double> expected;
      for (int i = 0; i < 8; ++i) {
        for (int j = 0; j < 5; ++j) {
          const auto at = grid.known_first +
                          grid.known_size * glm::ivec2(2 * i + 1, 2 * j + 1) / glm::ivec2(16, 10);
          seen.push_back(static_cast<std::size_t>(at.y) * grid.size.x + at.x);
          expected.push_back(spectrum.at({grid.x_m(at.x), grid.y_m(at.y)}) * factor);
        }
      }
      PhaseStack holograms(device);
      holograms.take(field);
      for (const auto backend : backends_for_spectra(device)) {
        const auto light = Light::make(device, backend);
        light->fit(optics, {grid});
        light->show(holograms, 0, 0);
        const auto plane = light->plane(0).read();
        double error = 0, all = 0;
        for (std::size_t i = 0; i < seen.size(); ++i) {
          const double got = std::norm(Complex(plane[seen[i]]));
          error += (got - expected[i]) * (got - expected[i]);
          all += expected[i] * expected[i];
        }
        CAPTURE(static_cast<int>(propagation), grid.spectrum.finer.x, optics.pitch_m.x);
        CHECK(std::sqrt(error / all) <= 1e-3);
      }
    }
  }
}

DEVICE_TEST("the way back is the adjoint: <A x, y> = <x, A* y>") {
  std::mt19937 random(7);
  std::normal_distribution<float> value;
  for (const auto propagation :
       {Propagation::fresnel, Propagation::corrected, Propagation::exact}) {
    auto tried = setups();
    if (propagation != Propagation::fresnel) {  // transforms of other sizes for each key
      tried = {tried[1]};
      tried[0].keys = {tried[0].keys[1]};
    }
    for (const auto& s : tried) {
      const auto field = random_phases(s.optics.size, 1, 9);
      PhaseStack holograms(device);
      holograms.take(field);
      std::vector<PictureGrid> grids;
      for (const auto& key : s.keys) grids.push_back(picture_grid(s.optics, key, propagation));
      for (const auto backend : propagation == Propagation::fresnel
                                    ? std::vector{usual_backend(device)}
                                    : backends_for_spectra(device)) {
        const auto light = Light::make(device, backend);
        light->fit(s.optics, grids);
        for (std::size_t key = 0; key < s.keys.size(); ++key) {
          const auto& grid = light->grid(key);
          const double unitary = light->unitary(key);
          light->show(holograms, 0, key);
          auto plane = light->plane(key).read();
          // y is zero outside the region
          Complex left = 0;
          double energy_y = 0;
          std::vector<std::complex<float>> y(plane.size());
          for (int row = 0; row < grid.region_size.y; ++row) {
            for (int column = 0; column < grid.region_size.x; ++column) {
              const auto at = static_cast<std::size_t>(grid.region_first.y + row) * grid.size.x +
                              grid.region_first.x + column;
              y[at] = {value(random), value(random)};
              left += Complex(plane[at]) * std::conj(Complex(y[at])) * unitary;
              energy_y += std::norm(Complex(y[at]));
            }
          }
          light->plane(key).write(y);
          const auto back = light->back(key).read();
          const auto pitch = light->back_pitch(key);
          const auto columns = light->column_chirp(key), rows = light->row_chirp(key);
          const auto open = grid.open;
          Complex right = 0;
          for (int row = 0; row < open.size.y; ++row) {
            for (int column = 0; column < open.size.x; ++column) {
              const Complex change = Complex(back[static_cast<std::size_t>(row) * pitch + column]) *
                                     std::conj(Complex(columns[column]) * Complex(rows[row])) *
                                     unitary;
              auto x =
                  Complex(field.samples[static_cast<std::size_t>(open.first.y + row) * field.nx +
                                        open.first.x + column]);
              if (grid.side < 0) x = std::conj(x);
              right += x * std::conj(change);
            }
          }
          const double scale =
              std::sqrt(energy_y * grid.open.size.x * grid.open.size.y);  // |x| |y|
          CAPTURE(s.optics.size.x, s.optics.size.y, key, static_cast<int>(propagation));
          CHECK(std::abs(left) > 1e-4 * scale);
          CHECK(std::abs(left - right) <= 1e-6 * scale);
        }
      }
    }
  }
}

/// Light from a hologram's pixels to the samples of a pupil's plane that are open, and from there
/// to a place of the plane z: Fresnel's integral through an eyepiece (Collins), whose last element
/// d no intensity sees.
double intensity_through_pupil(const Optics& optics, const PictureGrid& grid,
                               const std::vector<Complex>& h, double d, glm::dvec2 place_m) {
  const auto& pupil = grid.pupil.value();
  const double lambda = optics.wavelength_m, a = pupil.a, b = pupil.b_m, c = (a * d - 1) / b,
               z = grid.z_m;
  // Both ways are products over the axes
  const auto along = [&](int axis) {
    const double sign = axis == 0 ? 1 : -1;
    std::vector<Complex> weights(static_cast<std::size_t>(optics.size[axis]));
    for (int k = 0; k < grid.open.size[axis]; ++k) {
      const double n = optics.pupil_plane[axis], p_m = sign *
                                                       (grid.open.first[axis] + k - (n - 1) / 2) *
                                                       lambda * b / (n * optics.pitch_m[axis]);
      for (int i = 0; i < optics.size[axis]; ++i) {
        const double x_m = sign * (i - (optics.size[axis] - 1) / 2.0) * optics.pitch_m[axis],
                     to = (a * x_m * x_m - 2 * x_m * p_m + d * p_m * p_m) / b,
                     back = (a * place_m[axis] * place_m[axis] - 2 * place_m[axis] * p_m +
                             (c * z + d) * p_m * p_m) /
                            (a * z + b);
        weights[static_cast<std::size_t>(i)] += std::polar(1.0, pi * (to - back) / lambda);
      }
    }
    return weights;
  };
  const auto columns = along(0), rows = along(1);
  Complex sum = 0;
  for (int y = 0; y < optics.size.y; ++y)
    for (int x = 0; x < optics.size.x; ++x)
      sum += h[static_cast<std::size_t>(y) * optics.size.x + x] * columns[x] * rows[y];
  return std::norm(sum) / (1.0 * optics.pupil_plane.x * optics.pupil_plane.y);
}

/// Pupils behind eyepieces, in the focal plane and beside it; b < 0 crosses the axis.
std::vector<std::pair<Pupil, double>> pupils_with_d() {
  return {{{1 * mm, {0, 0}, 0, 50 * mm}, 0},
          {{1 * mm, {0, 0}, 0.2, 50 * mm}, 0.1},
          {{1 * mm, {0, 0}, -0.3, -40 * mm}, 0.4}};
}

/// Takes a field to the plane of the keys' pupil, which `optics` then knows.
void enter(Light& light, PhaseStack& holograms, const FieldStack& field,
           const std::vector<Key>& keys, Optics& optics) {
  optics.pupil_plane = pupil_plane_size(optics, keys);
  std::vector<PictureGrid> grids;
  for (const auto& key : keys) grids.push_back(picture_grid(optics, key, Propagation::fresnel));
  holograms.take(field);
  light.fit(optics, grids);
  light.enter_pupil(holograms, 0);
}

DEVICE_TEST("pictures through parts of a pupil's plane are direct sums, before the hologram too") {
  for (auto s : setups()) {
    const auto field = random_phases(s.optics.size, 1, 4);
    const auto h = masked(field, 0, {{0, 0}, s.optics.size});
    for (const auto& [pupil, d] : pupils_with_d()) {
      auto keys = s.keys;
      for (std::size_t key = 0; key < keys.size(); ++key) {
        keys[key].pupil = pupil;
        if (key % 2) keys[key].z_m *= -0.5;
      }
      // Kernels of VkFFT are compiled for each size
      const bool is_first = s.optics.size == setups()[0].optics.size && pupil.a == 0;
      for (const auto backend :
           is_first ? backends_for_spectra(device) : std::vector{usual_backend(device)}) {
        auto optics = s.optics;
        PhaseStack holograms(device);
        const auto light = Light::make(device, backend);
        enter(*light, holograms, field, keys, optics);
        for (std::size_t key = 0; key < keys.size(); ++key) {
          const auto& grid = light->grid(key);
          light->show(holograms, 0, key);
          const auto plane = light->plane(key).read();
          double worst = 0;
          for (int y = grid.known_first.y; y < grid.known_first.y + grid.known_size.y; y += 7)
            for (int x = grid.known_first.x; x < grid.known_first.x + grid.known_size.x; x += 5)
              worst = std::max(
                  worst,
                  std::abs(
                      std::norm(Complex(plane[static_cast<std::size_t>(y) * grid.size.x + x])) -
                      intensity_through_pupil(optics, grid, h, d, {grid.x_m(x), grid.y_m(y)})));
          CAPTURE(optics.size.x, key, pupil.a, pupil.b_m);
          CHECK(worst <= 2e-5 * grid.open.size.x * grid.open.size.y);
        }
      }
    }
  }
}

/// Of a disc: the sum over the samples of the pupil's plane, in double precision.
double intensity_through_disc(const Optics& optics, const PictureGrid& grid,
                              const std::vector<Complex>& h, double d, glm::dvec2 place_m) {
  const auto& pupil = grid.pupil.value();
  const double lambda = optics.wavelength_m, a = pupil.a, b = pupil.b_m, c = (a * d - 1) / b,
               z = grid.z_m;
  const auto n = optics.size, open = grid.open.size;
  const auto p_m = [&](int axis, int k) {
    const double all = optics.pupil_plane[axis], sign = axis == 0 ? 1 : -1;
    return sign * (grid.open.first[axis] + k - (all - 1) / 2) * lambda * b /
           (all * optics.pitch_m[axis]);
  };
  const auto to = [&](int axis, int k, int i) {
    const double x_m = (axis == 0 ? 1 : -1) * (i - (n[axis] - 1) / 2.0) * optics.pitch_m[axis],
                 p = p_m(axis, k);
    return std::polar(1.0, pi * (a * x_m * x_m - 2 * x_m * p + d * p * p) / b / lambda);
  };
  const auto back = [&](int axis, int k) {
    const double x_m = place_m[axis], p = p_m(axis, k);
    return std::polar(
        1.0, -pi * (a * x_m * x_m - 2 * x_m * p + (c * z + d) * p * p) / (a * z + b) / lambda);
  };
  const auto step_m = lambda * b / (glm::dvec2(optics.pupil_plane) * optics.pitch_m);
  Complex sum = 0;
  for (int k = 0; k < open.x; ++k) {
    // The hologram's columns, carried to this column of the pupil's plane
    std::vector<Complex> column(static_cast<std::size_t>(n.y));
    for (int i = 0; i < n.x; ++i) {
      const auto turn = to(0, k, i);
      for (int j = 0; j < n.y; ++j)
        column[static_cast<std::size_t>(j)] += turn * h[static_cast<std::size_t>(j) * n.x + i];
    }
    for (int l = 0; l < open.y; ++l) {
      const glm::dvec2 from_m = glm::dvec2(p_m(0, k), p_m(1, l)) - pupil.centre_m;
      const double away_m = glm::length(from_m),
                   wide_m = away_m > 0 ? glm::length(from_m * step_m) / away_m : 1,
                   share = std::clamp(0.5 + (pupil.diameter_m / 2 - away_m) / wide_m, 0.0, 1.0);
      if (share == 0) continue;
      Complex light = 0;
      for (int j = 0; j < n.y; ++j) light += to(1, l, j) * column[static_cast<std::size_t>(j)];
      sum += share * light * back(0, k) * back(1, l);
    }
  }
  return std::norm(sum) / (1.0 * optics.pupil_plane.x * optics.pupil_plane.y);
}

DEVICE_TEST("a disc of a pupil's plane shows the direct sum over what it lets through") {
  const auto s = setups()[1];
  const auto field = random_phases(s.optics.size, 1, 4);
  const auto h = masked(field, 0, {{0, 0}, s.optics.size});
  auto key = s.keys[0];
  key.pupil = Pupil{2 * mm, {0.7 * mm, -0.5 * mm}, 0.1, -40 * mm};
  key.is_disc = true;
  auto optics = s.optics;
  const auto eyebox_m = key.pupil->eyebox_m(
      {.resolution = optics.size, .pitch_m = optics.pitch_m, .wavelength_m = optics.wavelength_m});
  key.view = 2.0 * key.pupil->centre_m / eyebox_m;
  key.aperture = key.pupil->diameter_m / eyebox_m;
  for (const auto backend : backends_for_spectra(device)) {
    PhaseStack holograms(device);
    const auto light = Light::make(device, backend);
    enter(*light, holograms, field, {key}, optics);
    const auto& grid = light->grid(0);
    light->show(holograms, 0, 0);
    const auto plane = light->plane(0).read();
    double worst = 0;
    for (int y = grid.known_first.y; y < grid.known_first.y + grid.known_size.y; y += 15)
      for (int x = grid.known_first.x; x < grid.known_first.x + grid.known_size.x; x += 13)
        worst = std::max(
            worst,
            std::abs(std::norm(Complex(plane[static_cast<std::size_t>(y) * grid.size.x + x])) -
                     intensity_through_disc(optics, grid, h, 0.5, {grid.x_m(x), grid.y_m(y)})));
    CAPTURE(grid.open.size.x, grid.open.size.y);
    CHECK(worst <= 2e-5 * grid.open.size.x * grid.open.size.y);
  }
}

DEVICE_TEST("parts that tile the pupil's plane send a picture back as it was: A* A is 1") {
  for (const auto backend : backends_of(device)) {
    for (const auto& [pupil, d] : pupils_with_d()) {
      Optics optics{{64, 48}, {3.74 * um, 5 * um}, 638e-9, 9 * um};
      std::vector<Key> keys;
      for (const glm::dvec2 view : {glm::dvec2(-0.5, -0.5), {0.5, -0.5}, {-0.5, 0.5}, {0.5, 0.5}}) {
        // All of the plane is known
        keys.push_back(key_at(-0.4 * mm, view, {0.5, 0.5}, {300, 300}, optics.pitch_m));
        keys.back().pupil = pupil;
      }
      const auto field = random_phases(optics.size, 1, 6);
      PhaseStack holograms(device);
      const auto light = Light::make(device, backend);
      enter(*light, holograms, field, keys, optics);
      for (std::size_t key = 0; key < keys.size(); ++key) {
        light->show(holograms, 0, key);
        auto plane = light->plane(key).read();
        for (auto& sample : plane) sample *= std::complex<float>(0, 1);
        light->plane(key).write(plane);
        light->step(holograms, 0, key, 1);
      }
      // h + i h
      light->leave_pupil(holograms, 0, 1);
      const auto turned = holograms.read();
      double worst = 0;
      for (std::size_t i = 0; i < field.samples.size(); ++i)
        worst = std::max(worst, std::abs(Complex(turned.samples[i]) -
                                         Complex(field.samples[i]) * std::polar(1.0, pi / 4)));
      CAPTURE(pupil.a, pupil.b_m);
      CHECK(worst <= 1e-5);
    }
  }
}

}  // namespace
}  // namespace raywave::refinement
