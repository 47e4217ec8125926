// SPDX-License-Identifier: Apache-2.0
#include "host/api/state.hpp"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <optional>
#include <utility>

#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/forecast/tuning.hpp"

namespace raywave::v0 {
namespace {

constexpr int most_side = 1 << 20, most_frames = 1 << 20;
constexpr std::size_t most_samples = std::size_t{1} << 33;

void require_size(const void* data, int nx, int ny, int frames, const char* name) {
  if (nx < 1 || ny < 1 || frames < 1 || !data)
    throw InputError(std::string(name) + ": has no samples");
  if (nx > most_side || ny > most_side || frames > most_frames ||
      static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny) > most_samples / frames)
    throw InputError(std::string(name) + ": has more samples than raywave takes, " +
                     std::to_string(frames) + " x " + std::to_string(ny) + " x " +
                     std::to_string(nx));
}

bool is_finite(float value) { return std::isfinite(value); }
template <class T>
bool is_finite(const std::complex<T>& value) {
  return std::isfinite(value.real()) && std::isfinite(value.imag());
}

template <class T>
void require_finite(const T* first, std::size_t count, const char* name) {
  if (std::all_of(first, first + count, [](const T& value) { return is_finite(value); })) return;
  throw InputError(std::string(name) + ": holds NaN or infinity");
}

bool within(double value, double limit) { return std::abs(value) <= limit; }  // not for NaN

/// An OpenCL driver's threads do not follow into a forked process, which then waits for them.
void refuse_forks() {
  static const pid_t opened_by = getpid();
  if (getpid() != opened_by)
    throw DeviceError(
        "this process was forked from one that has used OpenCL, whose drivers do not survive a "
        "fork; start it as a program of its own (Python: multiprocessing's start method "
        "\"spawn\")");
}

}  // namespace

std::size_t place_of(std::string_view name, std::span<const char* const> names,
                     std::string_view what) {
  return raywave::place_of(name, names, what);
}

SlmSpec Slm::State::at(double wavelength_m) const {
  if (specs.empty()) return raywave::parse_slm(text, wavelength_m, overrides);
  if (wavelengths_m.empty()) return specs.front();
  constexpr double same_m = 1e-13;
  std::string names;
  for (std::size_t i = 0; i < specs.size(); ++i) {
    if (std::abs(wavelengths_m[i] - wavelength_m) < same_m) return specs[i];
    names += (i > 0 ? ", " : "") + length_text(wavelengths_m[i]);
  }
  throw InputError("wavelength: the SLM is that of a scene of several lasers, " + names + ", got " +
                   length_text(wavelength_m));
}

cl::DeviceInfo device_info(const std::string& device) {
  refuse_forks();
  return tuned(cl::find_device(device));
}

Opened open(const DeviceOptions& on) {
  const cl::Device device(device_info(on.device));
  {
    // The last device stays open, so that the next call finds its kernels loaded (0.15 s
    // of the teapot's). No destructor: drivers may be gone before statics are
    static std::mutex mutex;
    static auto* const last = new std::optional<cl::Device>;
    const std::lock_guard lock(mutex);
    last->emplace(device);
  }
  const auto fft = on.fft.value_or(cl::default_backend(device.info()));
  if (!cl::serves(fft, device.info()))
    throw DeviceError("fft " + std::string(name_of(fft)) + " does not serve " + device.info().name);
  return {device, fft};
}

raywave::Goal goal_of(const Goal& goal) {
  if (goal.budget_s && !(*goal.budget_s > 0 && within(*goal.budget_s, 1e9)))
    throw InputError("budget: must be > 0 seconds, got " + number_text(*goal.budget_s));
  if (goal.psnr_db && !(*goal.psnr_db >= 0 && *goal.psnr_db <= 200))
    throw InputError("psnr: must be 0 to 200 dB, got " + number_text(*goal.psnr_db));
  if (goal.rate_per_s && !(*goal.rate_per_s >= 0.001 && *goal.rate_per_s <= 1e6))
    throw InputError("rate: must be 0.001 to 1e+06 pictures a second, got " +
                     number_text(*goal.rate_per_s));
  const raywave::Goal result{goal.preset, goal.budget_s, goal.psnr_db, goal.rate_per_s};
  if (result.count() > 1)
    throw InputError("preset, budget, psnr and rate: at most 1 of them can be given");
  return result;
}

raywave::HologramSpec hologram_spec(const Pixels& pixels, glm::ivec2 size) {
  raywave::HologramSpec spec;
  for (const double pitch_m : pixels.pitch_m)
    if (!(pitch_m >= spec.least_pitch_m && pitch_m <= spec.largest_pitch_m))
      throw InputError("pitch: must be " + number_text(spec.least_pitch_m) + " to " +
                       number_text(spec.largest_pitch_m) + " m, got " + number_text(pitch_m));
  if (!(pixels.wavelength_m >= spec.least_wavelength_m &&
        pixels.wavelength_m <= spec.largest_wavelength_m))
    throw InputError("wavelength: must be " + number_text(spec.least_wavelength_m) + " to " +
                     number_text(spec.largest_wavelength_m) + " m, got " +
                     number_text(pixels.wavelength_m));
  spec.resolution = size;
  spec.pitch_m = vector_of(pixels.pitch_m);
  spec.wavelength_m = pixels.wavelength_m;
  return spec;
}

raywave::Progress progress_of(const Progress& progress) {
  if (!progress) return {};
  return [progress](const std::string& what, double share) {
    if (!progress(what, share)) throw Cancelled("stopped at: " + what);
  };
}

void require_samples(const FieldView& field, const char* name) {
  require_size(field.values, field.nx, field.ny, field.frames, name);
  require_finite(field.values, field.size(), name);
}

void require_samples(const FieldDoubleView& field, const char* name) {
  require_size(field.values, field.nx, field.ny, field.frames, name);
  require_finite(field.values, field.size(), name);
}

FieldStack field_of(const FieldView& field, const char* name) {
  require_samples(field, name);
  return {field.nx, field.ny, field.frames, {field.values, field.values + field.size()}};
}

Image image_of(const PictureView& picture, const char* name) {
  if (picture.channels != 1)
    throw InputError(std::string(name) + ": must be grey, with one channel, got " +
                     std::to_string(picture.channels));
  require_size(picture.values, picture.nx, picture.ny, 1, name);
  const auto count = static_cast<std::size_t>(picture.nx) * static_cast<std::size_t>(picture.ny);
  require_finite(picture.values, count, name);
  return {picture.nx, picture.ny, {picture.values, picture.values + count}};
}

RgbPicture rgb_of(const PictureView& picture, const char* name) {
  require_size(picture.values, picture.nx, picture.ny, 3, name);
  const auto count = static_cast<std::size_t>(picture.nx) * static_cast<std::size_t>(picture.ny);
  require_finite(picture.values, 3 * count, name);
  RgbPicture result;
  for (std::size_t c = 0; c < 3; ++c) {
    auto& channel = result.channels[c] = {picture.nx, picture.ny, std::vector<float>(count)};
    for (std::size_t i = 0; i < count; ++i) channel.pixels[i] = picture.values[3 * i + c];
  }
  return result;
}

Field as_field(FieldStack stack) {
  return {stack.nx, stack.ny, stack.frames, std::move(stack.samples)};
}

void require_pose(std::size_t object, std::size_t objects, const Vec3& position_m,
                  const Vec3& rotation_deg) {
  require_one_of("object", object, objects);
  for (const double x : position_m)
    if (!within(x, 1e4))
      throw InputError("position: must be -10000 to 10000 m, got " + number_text(x));
  for (const double angle : rotation_deg)
    if (!within(angle, 1e6))
      throw InputError("rotation: must be -1000000 to 1000000 degrees, got " + number_text(angle));
}

}  // namespace raywave::v0
