// SPDX-License-Identifier: Apache-2.0
#include "host/propagate/propagator.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>

#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/propagate/propagator_engine.hpp"

namespace raywave {
namespace {

// More needs two floats; docs/accuracy.md, "Propagation"
constexpr double float_remainder_turns = 2;
constexpr double most_remainder_turns = 2e6;  // two floats reduce turns below 2^22
constexpr double most_turns = 1e13;           // of the distance: double tells them to a thousandth
constexpr std::size_t most_transfers = 64;    // remembered, some 100 KB each

double reduced(double turns) { return turns - std::round(turns); }

/// 1 / the frequencies between the bands of light that is kept and of light that is kept whole, at
/// both ends of `axis`.
std::pair<float, float> fades_along(const Axis& axis, double wavelength_m, double distance_m,
                                    double shift_m) {
  const auto band = [&](double reach_m) {
    return axis.sampled(band_m(wavelength_m, distance_m, shift_m, reach_m));
  };
  const auto kept = band(axis.reach_m()), whole = band(axis.whole_reach_m());
  // Half a step is the first frequency's share of a fade: two such steps make none.
  const auto fade = [](int steps) { return 1 / std::max(static_cast<float>(steps), 0.5f); };
  if (kept.empty() || whole.empty()) return {2.0f, 2.0f};
  return {fade(whole.first - kept.first), fade(kept.last - whole.last)};
}

/// The frequencies kept of `axis` for each element of the other axis' transform.
std::vector<Band> bands_across(const Axis& axis, const Axis& other, double wavelength_m,
                               double distance_m, double shift_m) {
  std::vector<Band> bands(other.padded);
  for (int i = 0; i < other.padded; ++i) {
    const double f = other.frequency(other.signed_index(i));
    const double left = 1 / (wavelength_m * wavelength_m) - f * f;
    if (left <= 0 && distance_m != 0) continue;  // evanescent
    bands[i] =
        axis.sampled(band_of(std::sqrt(std::max(left, 0.0)), distance_m, shift_m, axis.reach_m()));
  }
  return bands;
}

/// Largest |shift| along `axis` at which a sampled frequency is left while the target is shifted by
/// other_shift_m along the other axis: what arrives there has the steepest sampled frequencies of
/// both.
double largest_shift_m(const Axis& axis, const Axis& other, double other_shift_m,
                       double wavelength_m, double distance_m) {
  if (distance_m == 0) return axis.reach_m();
  // Steeper frequencies are evanescent.
  const double steepest = std::ceil(1 / (wavelength_m * axis.frequency(1))) - 1;
  const double u = std::min<double>(axis.highest(), steepest) * axis.frequency(1);
  const double left = 1 / (wavelength_m * wavelength_m) - u * u;
  const auto band =
      other.sampled(band_of(std::sqrt(left), distance_m, other_shift_m, other.reach_m()));
  const double v = band.first <= band.last ? other.frequency(std::max(-band.first, band.last)) : 0;
  return axis.reach_m() + std::abs(distance_m) * u / std::sqrt(left - v * v);
}

std::vector<std::int32_t> firsts_then_lasts(const std::vector<Band>& bands) {
  std::vector<std::int32_t> table(2 * bands.size());
  for (std::size_t i = 0; i < bands.size(); ++i) {
    table[i] = bands[i].first;
    table[bands.size() + i] = bands[i].last;
  }
  return table;
}

float low_part(double value) {
  return static_cast<float>(value - static_cast<double>(static_cast<float>(value)));
}

Transfer transfer_of(const Axis& x, const Axis& y, double wavelength_m, const Target& target) {
  const double distance_m = target.distance_m, right_m = target.shift_m.x,
               down_m = -target.shift_m.y;
  const auto phases = [&](const Axis& axis, double shift, double constant) {
    std::vector<float> turns(axis.padded);
    for (int i = 0; i < axis.padded; ++i) {
      const double f = axis.frequency(axis.signed_index(i));
      turns[i] =
          static_cast<float>(reduced(shift * f - distance_m * wavelength_m * f * f / 2 + constant));
    }
    return turns;
  };
  Transfer t;
  t.phase_x = phases(x, right_m, distance_m / wavelength_m);
  t.phase_y = phases(y, down_m, 0);
  const auto bands_x = bands_across(y, x, wavelength_m, distance_m, down_m);
  auto bands_y = bands_across(x, y, wavelength_m, distance_m, right_m);

  // Frequencies that both keep: `rows` are as narrow as they can be.
  Band kept_by_columns;
  for (const auto& band : bands_x) kept_by_columns = kept_by_columns.joined(band);
  for (int i = 0; i < y.padded; ++i) {
    auto band = bands_y[i];
    const int k = y.signed_index(i);
    if (!kept_by_columns.contains(k)) band = {};
    const auto kept = [&](int u) { return bands_x[x.index(u)].contains(k); };
    while (!band.empty() && !kept(band.first)) ++band.first;
    while (!band.empty() && !kept(band.last)) --band.last;
    if (band.empty()) {
      band = {};
      continue;
    }
    t.rows = t.rows.joined({k, k});
    const double u = x.frequency(std::max(-band.first, band.last)), v = y.frequency(k);
    const double a = std::min(1.0, wavelength_m * wavelength_m * (u * u + v * v));
    const double sagitta = 1 - std::sqrt(1 - a);
    t.remainder_turns =
        std::max(t.remainder_turns, std::abs(distance_m) / (2 * wavelength_m) * sagitta * sagitta);
  }
  // Of other rows engines may hold nothing.
  for (int i = 0; i < y.padded; ++i)
    if (!t.rows.contains(y.signed_index(i))) bands_y[i] = {};
  std::tie(t.fades.left, t.fades.right) = fades_along(x, wavelength_m, distance_m, right_m);
  std::tie(t.fades.first, t.fades.last) = fades_along(y, wavelength_m, distance_m, down_m);
  t.band_x = firsts_then_lasts(bands_x);
  t.band_y = firsts_then_lasts(bands_y);
  const double depth_turns = distance_m / (2 * wavelength_m);
  t.depth_hi = static_cast<float>(depth_turns);
  t.depth_lo = low_part(depth_turns);
  t.two_floats = t.remainder_turns > float_remainder_turns;
  return t;
}

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
  if (spec.size.x < 1 || spec.size.y < 1)
    throw InputError("propagation: a plane needs at least 1 x 1 samples");
  if (!positive(spec.pitch_m.x) || !positive(spec.pitch_m.y))
    throw InputError("propagation: pitch must be > 0");
  if (!positive(spec.wavelength_m)) throw InputError("propagation: wavelength must be > 0");
  if (!(spec.padding >= 1 && spec.padding <= 64))
    throw InputError("propagation: padding must be 1 to 64");
}

}  // namespace

struct Propagator::State {
  State(const cl::Device& device, const PropagatorSpec& spec) {
    check(spec);
    const auto padded = raywave::padded_size(spec.size, spec.padding, spec.pitch_m,
                                             spec.wavelength_m, spec.distance_m);
    plan.spec = spec;
    plan.x = {padded.x, spec.pitch_m.x, spec.size.x};
    plan.y = {padded.y, spec.pitch_m.y, spec.size.y};
    plan.power_x = powers(plan.x, spec.wavelength_m);
    plan.power_y = powers(plan.y, spec.wavelength_m);
    plan.scale = 1 / (static_cast<double>(padded.x) * padded.y);
    engine = spec.backend == cl::FftBackend::host ? make_host_engine(plan)
                                                  : make_device_engine(device, plan);
  }

  /// Transfer functions are kept, since the same targets return in every frame.
  std::shared_ptr<const Transfer> transfer(const Target& target) {
    if (!std::isfinite(target.shift_m.x) || !std::isfinite(target.shift_m.y) ||
        !std::isfinite(target.distance_m))
      throw InputError("propagation: shift and distance must be finite");
    const auto known =
        std::ranges::find(transfers, target, [](auto& entry) { return entry.first; });
    if (known != transfers.end()) return known->second;
    if (transfers.size() == most_transfers) transfers.erase(transfers.begin());
    transfers.emplace_back(target, std::make_shared<Transfer>(transfer_of(
                                       plan.x, plan.y, plan.spec.wavelength_m, target)));
    return transfers.back().second;
  }

  double side_m() const {
    return std::min(plan.x.padded * plan.x.pitch_m, plan.y.padded * plan.y.pitch_m);
  }

  /// throws  InputError, as Propagator::add
  std::shared_ptr<const Transfer> checked_transfer(const Target& target) {
    const auto& [shift_m, distance_m] = target;
    const double wavelength_m = plan.spec.wavelength_m;
    const std::string too_far =
        "propagation over " + millimetres(distance_m, 4) + " is too far for its phase to be exact";
    if (std::isfinite(distance_m) && std::abs(distance_m) / wavelength_m > most_turns)
      throw InputError(too_far);
    auto result = transfer(target);
    if (result->rows.empty()) {
      const double x_m = largest_shift_m(plan.x, plan.y, -shift_m.y, wavelength_m, distance_m),
                   y_m = largest_shift_m(plan.y, plan.x, shift_m.x, wavelength_m, distance_m);
      const bool beyond = std::abs(shift_m.x) > x_m || std::abs(shift_m.y) > y_m;
      throw InputError("propagation over " + millimetres(distance_m, 4) +
                       ": no light arrives at a plane shifted by " + millimetres(shift_m.x, 4) +
                       ", " + millimetres(shift_m.y, 4) +
                       (beyond
                            ? "; the largest usable shift is " + millimetres(x_m, 4) + " in x, " +
                                  millimetres(y_m, 4) + " in y"
                            : "; a padded plane " + millimetres(side_m(), 4) +
                                  " wide samples too few directions to reach everywhere beyond " +
                                  millimetres(side_m() * side_m() / wavelength_m, 4) +
                                  ": give a shorter distance, a larger hologram or more padding"));
    }
    if (result->remainder_turns > most_remainder_turns) throw InputError(too_far);
    return result;
  }

  /// Checks for a stack of `frames` planes or more; a single plane must have exactly that size.
  void check_field(const cl::ComplexBuffer& field, int frames = 1) const {
    const auto plane = static_cast<std::size_t>(plan.spec.size.x) * plan.spec.size.y;
    if (frames < 1 || field.size() % plane != 0 ||
        field.size() / plane < static_cast<std::size_t>(frames))
      throw std::invalid_argument("Propagator: field of another size");
  }

  PropagationPlan plan;
  std::unique_ptr<PropagationEngine> engine;
  Band loaded_rows;
  bool is_loaded_once = false;
  std::vector<std::pair<Target, std::shared_ptr<const Transfer>>> transfers;  // oldest first
};

Propagator::Propagator(const cl::Device& device, const PropagatorSpec& spec)
    : state_(std::make_unique<State>(device, spec)) {}
Propagator::~Propagator() = default;
Propagator::Propagator(Propagator&&) noexcept = default;

glm::ivec2 Propagator::padded_size() const {
  return {state_->plan.x.padded, state_->plan.y.padded};
}

bool Propagator::reaches(const Target& target) const {
  return !state_->transfer(target)->rows.empty();
}

double Propagator::farthest_m() const {
  return state_->side_m() * state_->side_m() / state_->plan.spec.wavelength_m;
}

void Propagator::require_reach(const Target& target) const { state_->checked_transfer(target); }

void Propagator::load(const cl::ComplexBuffer& field, int frame, std::span<const Target> targets) {
  auto& s = *state_;
  s.check_field(field, frame + 1);
  s.loaded_rows = targets.empty() ? Band{s.plan.y.lowest(), s.plan.y.highest()} : Band{};
  for (const auto& target : targets) s.loaded_rows = s.loaded_rows.joined(s.transfer(target)->rows);
  s.is_loaded_once = targets.size() == 1;
  s.engine->load(field, frame, s.loaded_rows, s.is_loaded_once);
}

void Propagator::add(const Target& target) {
  auto& s = *state_;
  const auto transfer = s.checked_transfer(target);
  if (!s.loaded_rows.contains(transfer->rows))
    throw std::invalid_argument("Propagator: load was not told of this target");
  s.engine->add(transfer);
}

void Propagator::collect(cl::ComplexBuffer& field) {
  state_->check_field(field);
  state_->engine->collect(field);
  if (state_->is_loaded_once) state_->loaded_rows = {};
}

}  // namespace raywave
