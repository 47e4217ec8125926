// SPDX-License-Identifier: Apache-2.0
#include "host/propagator.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>

#include "host/error.hpp"

namespace raywave {
namespace {

constexpr int packet = 16;                    // samples; rows of padded planes are whole packets of any device's lanes
constexpr double float_remainder_turns = 2;   // more needs two floats; docs/accuracy.md, "Propagation"
constexpr double most_remainder_turns = 2e6;  // two floats reduce turns below 2^22
constexpr double most_turns = 1e13;           // of the distance: double tells them to a thousandth

/// First and last of the frequencies k / (n pitch) kept; none when first > last.
struct Band {
  int first = 0, last = -1;
  bool contains(int k) const { return first <= k && k <= last; }
};

/// One axis of the padded plane. Along y everything counts downwards, like rows.
struct Axis {
  int padded = 1;
  double pitch_m = 1;

  double half_m() const { return padded * pitch_m / 2; }
  int lowest() const { return -(padded / 2); }
  int highest() const { return (padded - 1) / 2; }
  int signed_index(int i) const { return i <= highest() ? i : i - padded; }
  double frequency(int k) const { return k / (padded * pitch_m); }
  Band sampled(std::pair<double, double> band) const {
    const double step = 1 / (padded * pitch_m);
    const double first = std::max<double>(std::ceil(band.first / step), lowest());
    const double last = std::min<double>(std::floor(band.second / step), highest());
    return first <= last ? Band{static_cast<int>(first), static_cast<int>(last)} : Band{};
  }
};

double reduced(double turns) { return turns - std::round(turns); }

/// band_m's closed form where the other frequency leaves `wave_number` = sqrt(1/lambda^2 - v^2) to this axis: |shift - z u/w| <= half.
std::pair<double, double> band_of(double wave_number, double distance_m, double shift_m, double half_m) {
  constexpr double all = std::numeric_limits<double>::infinity();
  if (distance_m == 0) return std::abs(shift_m) <= half_m ? std::pair(-all, all) : std::pair(all, -all);
  const auto limit = [&](double t) { return wave_number * t / std::copysign(std::hypot(t, distance_m), distance_m); };
  return std::minmax({limit(shift_m - half_m), limit(shift_m + half_m)});
}

/// The frequencies kept of `axis` for each element of the other axis' transform.
std::vector<Band> bands_across(const Axis& axis, const Axis& other, double wavelength_m, double distance_m, double shift_m) {
  std::vector<Band> bands(other.padded);
  for (int i = 0; i < other.padded; ++i) {
    const double f = other.frequency(other.signed_index(i));
    const double left = 1 / (wavelength_m * wavelength_m) - f * f;
    if (left <= 0 && distance_m != 0) continue;  // evanescent
    bands[i] = axis.sampled(band_of(std::sqrt(std::max(left, 0.0)), distance_m, shift_m, axis.half_m()));
  }
  return bands;
}

/// Largest |shift| along `axis`, to the side of `shift_m`, at which a sampled frequency is left while the target is shifted by
/// other_shift_m along the other axis: what arrives there has the steepest sampled frequencies of both.
double largest_shift_m(const Axis& axis, double shift_m, const Axis& other, double other_shift_m, double wavelength_m, double distance_m) {
  if (distance_m == 0) return axis.half_m();
  const double steepest = std::ceil(1 / (wavelength_m * axis.frequency(1))) - 1;  // that is not evanescent
  const int last = std::abs(shift_m * distance_m < 0 ? axis.lowest() : axis.highest());
  const double u = std::min<double>(last, steepest) * axis.frequency(1);
  const double left = 1 / (wavelength_m * wavelength_m) - u * u;
  const auto band = other.sampled(band_of(std::sqrt(left), distance_m, other_shift_m, other.half_m()));
  const double v = band.first <= band.last ? other.frequency(std::max(-band.first, band.last)) : 0;
  return axis.half_m() + std::abs(distance_m) * u / std::sqrt(left - v * v);
}

std::string millimetres(double length_m) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g mm", length_m * 1e3);
  return text;
}

/// What the device needs to know of one propagation.
struct Transfer {
  std::vector<float> phase_x, phase_y;  // X and Y of kernels/propagate.cl
  std::vector<Band> bands_x, bands_y;   // per column those of rows, per row those of columns
  double remainder_turns = 0;           // at most, inside the band

  bool empty() const {
    for (int row = 0; row < std::ssize(bands_y); ++row) {
      const int k = row < (std::ssize(bands_y) + 1) / 2 ? row : row - static_cast<int>(std::ssize(bands_y));
      for (int u = bands_y[row].first; u <= bands_y[row].last; ++u) {
        if (bands_x[u < 0 ? u + bands_x.size() : u].contains(k)) return false;
      }
    }
    return true;
  }
};

Transfer transfer_of(const Axis& x, const Axis& y, double wavelength_m, glm::dvec2 shift_m, double distance_m) {
  const auto phases = [&](const Axis& axis, double shift, double constant) {
    std::vector<float> turns(axis.padded);
    for (int i = 0; i < axis.padded; ++i) {
      const double f = axis.frequency(axis.signed_index(i));
      turns[i] = static_cast<float>(reduced(shift * f - distance_m * wavelength_m * f * f / 2 + constant));
    }
    return turns;
  };
  const double down_m = -shift_m.y;
  Transfer t;
  t.phase_x = phases(x, shift_m.x, distance_m / wavelength_m);
  t.phase_y = phases(y, down_m, 0);
  t.bands_x = bands_across(y, x, wavelength_m, distance_m, down_m);
  t.bands_y = bands_across(x, y, wavelength_m, distance_m, shift_m.x);

  // Rows that no column keeps are dropped here, so that the device skips them whole.
  Band rows{std::numeric_limits<int>::max(), std::numeric_limits<int>::min()};
  for (const auto& b : t.bands_x) {
    if (b.first > b.last) continue;
    rows = {std::min(rows.first, b.first), std::max(rows.last, b.last)};
  }
  for (int i = 0; i < y.padded; ++i) {
    auto& band = t.bands_y[i];
    const int k = y.signed_index(i);
    if (!rows.contains(k)) band = {};
    if (band.first > band.last) continue;
    const double u = x.frequency(std::max(-band.first, band.last)), v = y.frequency(k);
    const double a = std::min(1.0, wavelength_m * wavelength_m * (u * u + v * v));
    const double sagitta = 1 - std::sqrt(1 - a);
    t.remainder_turns = std::max(t.remainder_turns, std::abs(distance_m) / (2 * wavelength_m) * sagitta * sagitta);
  }
  return t;
}

std::vector<std::int32_t> firsts_then_lasts(const std::vector<Band>& bands) {
  std::vector<std::int32_t> table(2 * bands.size());
  for (std::size_t i = 0; i < bands.size(); ++i) {
    table[i] = bands[i].first;
    table[bands.size() + i] = bands[i].last;
  }
  return table;
}

float low_part(double value) { return static_cast<float>(value - static_cast<double>(static_cast<float>(value))); }

/// (lambda f)^2 as high parts, then low parts.
std::vector<float> powers(const Axis& axis, double wavelength_m) {
  std::vector<float> table(2 * static_cast<std::size_t>(axis.padded));
  for (int i = 0; i < axis.padded; ++i) {
    const double sine = wavelength_m * axis.frequency(axis.signed_index(i));
    table[i] = static_cast<float>(sine * sine);
    table[axis.padded + i] = low_part(sine * sine);
  }
  return table;
}

void check(const PropagatorSpec& spec) {
  const auto positive = [](double value) { return std::isfinite(value) && value > 0; };
  if (spec.size.x < 1 || spec.size.y < 1) throw InputError("propagation: a plane needs at least 1 x 1 samples");
  if (!positive(spec.pitch_m.x) || !positive(spec.pitch_m.y)) throw InputError("propagation: pitch must be > 0");
  if (!positive(spec.wavelength_m)) throw InputError("propagation: wavelength must be > 0");
  if (!(spec.padding >= 1 && spec.padding <= 64)) throw InputError("propagation: padding must be 1 to 64");
}

}  // namespace

std::pair<double, double> band_m(double wavelength_m, double distance_m, double shift_m, double half_m) {
  return band_of(1 / wavelength_m, distance_m, shift_m, half_m);
}

glm::ivec2 padded_size(glm::ivec2 size, double padding, cl::FftBackend backend) {
  const auto fast = [&](double samples) { return static_cast<int>(cl::next_fast_size(backend, static_cast<std::size_t>(samples))); };
  return {packet * fast(std::ceil(size.x * padding / packet)), fast(std::ceil(size.y * padding))};
}

struct Propagator::State {
  State(const cl::Device& the_device, const PropagatorSpec& the_spec) : device(the_device), spec(the_spec) {
    check(spec);
    const auto padded = raywave::padded_size(spec.size, spec.padding, spec.backend);
    x = {padded.x, spec.pitch_m.x};
    y = {padded.y, spec.pitch_m.y};
    const auto size = [](int n) { return static_cast<std::size_t>(n); };
    spectrum = {device, size(x.padded) * size(y.padded), "padded plane"};
    sum = {device, size(x.padded) * size(y.padded), "sum of spectra"};
    fft = cl::make_fft(device, spec.backend, {size(x.padded), size(y.padded), size(spec.size.x), size(spec.size.y)});
    program = {device, "propagate.cl", options(false)};
    phase_x = {device, size(x.padded), "phases"};
    phase_y = {device, size(y.padded), "phases"};
    band_x = {device, 2 * size(x.padded), "band"};
    band_y = {device, 2 * size(y.padded), "band"};
    power_x = {device, powers(x, spec.wavelength_m), "frequencies"};
    power_y = {device, powers(y, spec.wavelength_m), "frequencies"};
  }

  cl::Options options(bool two_floats) const {
    return {{"RAYWAVE_LANES", std::to_string(device.info().float_lanes)}, {"RAYWAVE_TWO_FLOATS", two_floats ? "1" : "0"}};
  }

  /// Kernels walk along a row: all of it on CPUs, one packet of it per work-item elsewhere.
  void run_rows(cl::Kernel kernel, int nx, int ny, const auto&... args) const {
    const bool cpu = device.info().kind == cl::DeviceKind::cpu;
    const auto rows = static_cast<std::size_t>(ny);
    if (cpu) return kernel.run({1, rows}, {1, 1}, args...);
    kernel.run({static_cast<std::size_t>(nx), rows}, {64, 1}, args...);
  }

  Transfer transfer(glm::dvec2 shift_m, double distance_m) const { return transfer_of(x, y, spec.wavelength_m, shift_m, distance_m); }

  double side_m() const { return 2 * std::min(x.half_m(), y.half_m()); }

  /// throws  InputError, as Propagator::add
  Transfer checked_transfer(glm::dvec2 shift_m, double distance_m) const {
    if (!std::isfinite(shift_m.x) || !std::isfinite(shift_m.y) || !std::isfinite(distance_m))
      throw InputError("propagation: shift and distance must be finite");
    const std::string too_far = "propagation over " + millimetres(distance_m) + " is too far for its phase to be exact";
    if (std::abs(distance_m) / spec.wavelength_m > most_turns) throw InputError(too_far);
    auto result = transfer(shift_m, distance_m);
    if (result.empty()) {
      const double x_m = largest_shift_m(x, shift_m.x, y, -shift_m.y, spec.wavelength_m, distance_m);
      const double y_m = largest_shift_m(y, -shift_m.y, x, shift_m.x, spec.wavelength_m, distance_m);
      const bool beyond = std::abs(shift_m.x) > x_m || std::abs(shift_m.y) > y_m;
      throw InputError("propagation over " + millimetres(distance_m) + ": no light arrives at a plane shifted by " +
                       millimetres(shift_m.x) + ", " + millimetres(shift_m.y) +
                       (beyond
                            ? "; the largest usable shift is " + millimetres(x_m) + " in x, " + millimetres(y_m) + " in y"
                            : "; a padded plane " + millimetres(side_m()) + " wide samples too few directions to reach everywhere beyond " +
                                  millimetres(side_m() * side_m() / spec.wavelength_m) +
                                  ": give a shorter distance, a larger hologram or more padding"));
    }
    if (result.remainder_turns > most_remainder_turns) throw InputError(too_far);
    return result;
  }

  /// A stack of `frames` planes or more; one plane alone must be of that size.
  void check_field(const cl::ComplexBuffer& field, int frames = 1) const {
    const auto plane = static_cast<std::size_t>(spec.size.x) * spec.size.y;
    if (frames < 1 || field.size() % plane != 0 || field.size() / plane < static_cast<std::size_t>(frames))
      throw std::invalid_argument("Propagator: field of another size");
  }

  cl::Device device;
  PropagatorSpec spec;
  Axis x, y;
  cl::ComplexBuffer spectrum, sum;
  bool sum_holds_spectra = false;
  std::unique_ptr<cl::Fft> fft;
  cl::Program program, program_two_floats;
  bool has_two_floats = false;
  cl::Buffer<float> phase_x, phase_y, power_x, power_y;
  cl::Buffer<std::int32_t> band_x, band_y;
};

Propagator::Propagator(const cl::Device& device, const PropagatorSpec& spec) : state_(std::make_unique<State>(device, spec)) {}
Propagator::~Propagator() = default;
Propagator::Propagator(Propagator&&) noexcept = default;

glm::ivec2 Propagator::padded_size() const { return {state_->x.padded, state_->y.padded}; }

bool Propagator::reaches(glm::dvec2 shift_m, double distance_m) const { return !state_->transfer(shift_m, distance_m).empty(); }

double Propagator::farthest_m() const { return state_->side_m() * state_->side_m() / state_->spec.wavelength_m; }

void Propagator::require_reach(glm::dvec2 shift_m, double distance_m) const { state_->checked_transfer(shift_m, distance_m); }

void Propagator::load(const cl::ComplexBuffer& field, int frame) {
  auto& s = *state_;
  s.check_field(field, frame + 1);
  s.run_rows(s.program.kernel("pad"), s.x.padded, s.y.padded, field, s.spectrum, frame, s.spec.size.x, s.spec.size.y, s.x.padded,
             s.y.padded);
  s.fft->forward(s.spectrum);
}

void Propagator::add(glm::dvec2 shift_m, double distance_m) {
  auto& s = *state_;
  const auto transfer = s.checked_transfer(shift_m, distance_m);
  const bool two_floats = transfer.remainder_turns > float_remainder_turns;
  if (two_floats && !s.has_two_floats) {
    s.program_two_floats = {s.device, "propagate.cl", s.options(true)};
    s.has_two_floats = true;
  }
  s.phase_x.write(transfer.phase_x);
  s.phase_y.write(transfer.phase_y);
  s.band_x.write(firsts_then_lasts(transfer.bands_x));
  s.band_y.write(firsts_then_lasts(transfer.bands_y));
  const double depth_turns = distance_m / (2 * s.spec.wavelength_m);
  const double scale = 1 / (static_cast<double>(s.x.padded) * s.y.padded);
  s.run_rows((two_floats ? s.program_two_floats : s.program).kernel("multiply_add"), s.x.padded, s.y.padded, s.spectrum, s.sum, s.phase_x,
             s.phase_y, s.power_x, s.power_y, s.band_x, s.band_y, static_cast<float>(depth_turns), low_part(depth_turns),
             static_cast<float>(scale), s.x.padded, s.y.padded, static_cast<std::int32_t>(s.sum_holds_spectra));
  s.sum_holds_spectra = true;
}

void Propagator::collect(cl::ComplexBuffer& field) {
  auto& s = *state_;
  s.check_field(field);
  if (!s.sum_holds_spectra) return field.fill_zero();
  s.fft->inverse(s.sum);
  s.run_rows(s.program.kernel("crop"), s.spec.size.x, s.spec.size.y, s.sum, field, s.spec.size.x, s.spec.size.y, s.x.padded);
  s.sum_holds_spectra = false;
}

}  // namespace raywave
