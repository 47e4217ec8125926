// SPDX-License-Identifier: Apache-2.0
#include "host/forecast/tuning.hpp"

#include <fstream>
#include <nlohmann/json.hpp>

#include "cl/device.hpp"
#include "cl/fft.hpp"
#include "host/common/cache.hpp"
#include "host/common/error.hpp"
#include "host/common/json.hpp"
#include "host/common/output.hpp"
#include "host/common/text.hpp"
#include "host/trace/work_shape.hpp"

namespace raywave {
namespace {

constexpr int layout = 3;

struct RateKey {
  const char* name;
  double DeviceRates::*value;
};
constexpr RateKey rate_keys[] = {
    {"ray_s", &DeviceRates::ray_s},     {"shadow_ray_s", &DeviceRates::shadow_ray_s},
    {"node_s", &DeviceRates::node_s},   {"pair_s", &DeviceRates::pair_s},
    {"pixel_s", &DeviceRates::pixel_s}, {"butterfly_s", &DeviceRates::butterfly_s},
    {"level_s", &DeviceRates::level_s}};

/// Rates of a device that nobody has tuned: those of a processor or of a GPU, by compute units.
DeviceRates untuned_rates(const cl::DeviceInfo& device) {
  const bool is_gpu = device.kind == cl::DeviceKind::gpu;
  if (device.compute_units == 0 || !(is_gpu || device.kind == cl::DeviceKind::cpu))
    return default_rates();
  constexpr double units_of_gpu = 132, cores = 2;
  auto rates = is_gpu ? gpu_rates() : default_rates();
  for (const auto& key : rate_keys)
    rates.*key.value *= (is_gpu ? units_of_gpu : cores) / device.compute_units;
  if (is_gpu || device.compute_units != cores)
    rates.device += ", for " + std::to_string(device.compute_units) + " compute units";
  return rates;
}

}  // namespace

std::filesystem::path tuning_file(const cl::DeviceInfo& device) {
  return cache_folder() /
         ("rates_" + hash_name(device.platform + "\n" + device.name + "\n" + device.driver) +
          ".json");
}

std::optional<Tuning> load_tuning(const cl::DeviceInfo& device) {
  const auto file = tuning_file(device);
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) return {};  // to open a pipe may never end
  std::ifstream in(file);
  if (!in) return {};
  const auto refuse = [&](const std::string& what) {
    throw InputError(file.string() + ": " + what +
                     "; raywave tune writes it anew, without it defaults hold");
  };
  Tuning tuning{{device.name, true}, {}};
  try {
    const auto j = nlohmann::json::parse(in);
    if (j.value("layout", 0) != layout) return {};
    const auto& rates = j.at("rates");
    for (const auto& key : rate_keys) {
      const double rate = tuning.rates.*key.value = rates.at(key.name);
      if (!(rate > 0 && rate < 1))
        refuse(std::string("rates.") + key.name + ": must be seconds, above 0 and below 1, got " +
               number_text(rate));
    }
    const auto& work = j.at("work");
    for (const auto& knob : work_knobs) tuning.work.*knob.value = work.at(knob.name);
  } catch (const nlohmann::json::exception& error) {
    refuse(json_reason(error));
  }
  if (const auto why = why_unfit(tuning.work, device); !why.empty()) refuse("work." + why);
  return tuning;
}

void store_tuning(const cl::DeviceInfo& device, const Tuning& tuning) {
  Json j{{"layout", layout}, {"device", device.name}, {"driver", device.driver}};
  for (const auto& key : rate_keys) j["rates"][key.name] = tuning.rates.*key.value;
  for (const auto& knob : work_knobs) j["work"][knob.name] = tuning.work.*knob.value;
  write_text(tuning_file(device), j.dump(2) + "\n");
}

cl::DeviceInfo tuned(cl::DeviceInfo device) {
  if (const auto tuning = load_tuning(device)) device.work = tuning->work;
  return device;
}

DeviceFigures figures_of(const cl::DeviceInfo& device) {
  DeviceFigures figures{device.name,
                        device.fp64,
                        limits_of(device),
                        cl::default_backend(device),
                        untuned_rates(device),
                        device.platform + "\n" + device.name + "\n" + device.driver,
                        device.kind == cl::DeviceKind::cpu};
  if (const auto tuning = load_tuning(device)) figures.rates = tuning->rates;
  if (device.kind == cl::DeviceKind::cpu)
    figures.rates.host_butterfly_s = figures.rates.butterfly_s;
  return figures;
}

}  // namespace raywave
