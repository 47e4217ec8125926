// SPDX-License-Identifier: Apache-2.0
#include "host/forecast/first_call.hpp"

#include <array>
#include <charconv>
#include <string>
#include <system_error>

#include "cl/program.hpp"
#include "host/common/cache.hpp"
#include "host/geometry/kernel_options.hpp"
#include "host/trace/device_scene.hpp"
#include "raywave_version.hpp"

namespace raywave {
namespace {

/// Of an EPYC's core, processor time of kernels with PoCL 3.1, caches empty: teapot 4.3 s, still
/// life (bounces) 6.2; a second process takes four tenths of it (cl/compile_ahead.hpp). Beside a
/// teapot of 7.9, where PoCL was asked for binaries, room took 8.4, study 7.3, around the SLM 8.5,
/// a texture 8.8, WRPs 6.4, a fan 2.0.
constexpr double compile_on_processor_s = 3, with_bounces = 1.45, of_fans = 0.25;
/// FFTW's plans of a new size, and the rest of a program that starts without any cache.
constexpr double plans_s = 0.7;
/// Launches of kernels that are there take some milliseconds.
constexpr double least_compile_s = 0.5;

std::string name_of_device(const DeviceFigures& device) {
  return "first-" + hash_name(std::string(version) + "\n" + device.key);
}

/// Changes with any kernel.
const std::string& kernels_digest() {
  static const std::string digest = [] {
    std::string text;
    for (const auto& [file, content] : cl::kernel_files()) text += content;
    return hash_name(text);
  }();
  return digest;
}

/// Kernels are compiled for their options, and not all carriers have the same.
std::string name_of_kernels(const Plan& plan, const DeviceFigures& device) {
  std::string text = kernels_digest() + "\n" + device.key + "\n" +
                     std::to_string(plan.carrier.index()) + std::string(name_of(device.fft));
  for (const auto& [option, value] : kernel_options(plan))
    text += "\n" + std::string(option.name) + "=" + value;
  if (plan.refine) text += "\nrefine";
  return "first-" + hash_name(text);
}

/// Time of a plan's kernels over that of the usual ones.
double share_of_compiling(const Plan& plan) {
  return plan.samples.aimed ? plan.specular.bounces > 0 ? with_bounces : 1 : of_fans;
}

std::optional<double> number_in_cache(const std::string& name) {
  const auto bytes = load_cached(name);
  if (!bytes) return {};
  const std::string text(bytes->begin(), bytes->end());
  double value = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
  return read.ec == std::errc() && value >= 0 ? std::optional(value) : std::nullopt;
}

void keep_in_cache(const std::string& name, double value) {
  std::array<char, 32> text{};  // whatever the locale's decimal point is
  const auto written = std::to_chars(text.data(), text.data() + text.size(), value);
  store_cached(name, text.data(), static_cast<std::size_t>(written.ptr - text.data()));
}

}  // namespace

double meshes_and_trees_s(const World& world) {
  return 0.03 + 5e-6 * static_cast<double>(world.triangles.size());
}

std::optional<double> kernels_s(const Plan& plan, const DeviceFigures& device) {
  if (device.key.empty()) return {};
  if (number_in_cache(name_of_kernels(plan, device))) return 0;
  const double share = share_of_compiling(plan);
  if (const auto before = number_in_cache(name_of_device(device))) return *before * share;
  return device.is_processor ? std::optional(compile_on_processor_s * share + plans_s)
                             : std::nullopt;
}

void remember_kernels(const Plan& plan, const DeviceFigures& device,
                      const std::map<std::string, double>& wall_s,
                      const std::map<std::string, double>& processor_s) {
  const auto of_kernels = [](const std::map<std::string, double>& seconds) {
    const auto took = seconds.find("kernels");
    return took == seconds.end() ? 0 : took->second;
  };
  const double compile_s = device.is_processor ? of_kernels(processor_s) : of_kernels(wall_s);
  if (number_in_cache(name_of_kernels(plan, device)) && compile_s < least_compile_s) return;
  keep_in_cache(name_of_kernels(plan, device), compile_s);
  // A scene that shares kernels with one before it tells too little of the next
  const double whole_s = compile_s / share_of_compiling(plan);
  if (compile_s >= least_compile_s && whole_s > number_in_cache(name_of_device(device)).value_or(0))
    keep_in_cache(name_of_device(device), whole_s);
}

}  // namespace raywave
