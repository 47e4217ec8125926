// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "cl/device.hpp"
#include "cl/fft.hpp"
#include "host/cli/commands.hpp"
#include "host/cli/help.hpp"
#include "host/cli/options.hpp"

namespace raywave::cli {

namespace {

std::vector<std::string> backends_of(const cl::DeviceInfo& device) {
  std::vector<std::string> names;
  for (const auto backend : cl::all_backends) {
    if (cl::serves(backend, device)) names.emplace_back(cl::name_of(backend));
  }
  return names;
}

Json json_of(const cl::DeviceInfo& d, bool is_default) {
  return {{"index", d.index},
          {"name", d.name},
          {"platform", d.platform},
          {"kind", name_of(d.kind)},
          {"vendor", d.vendor},
          {"version", d.version},
          {"driver", d.driver},
          {"compute_units", d.compute_units},
          {"memory_bytes", d.memory_bytes},
          {"largest_buffer_bytes", d.largest_buffer_bytes},
          {"local_bytes", d.local_bytes},
          {"fp64", d.fp64},
          {"online_compiler", d.online_compiler},
          {"float_lanes", d.float_lanes},
          {"fft", backends_of(d)},
          {"default", is_default}};
}

void print(const cl::DeviceInfo& d, bool is_default) {
  std::string fft;
  for (const auto& name : backends_of(d)) fft += (fft.empty() ? "" : ", ") + name;
  std::printf("%s  %s%s\n", d.index.c_str(), d.name.c_str(), is_default ? "  (default)" : "");
  std::printf("     platform         %s\n", d.platform.c_str());
  std::printf("     kind             %s, %u compute units\n", name_of(d.kind), d.compute_units);
  std::printf("     version, driver  %s, %s\n", d.version.c_str(), d.driver.c_str());
  std::printf("     memory           %s, largest buffer %s, local %s\n",
              cl::format_bytes(d.memory_bytes).c_str(),
              cl::format_bytes(d.largest_buffer_bytes).c_str(),
              cl::format_bytes(d.local_bytes).c_str());
  std::printf("     fp64             %s\n", d.fp64 ? "yes" : "no");
  std::printf("     online compiler  %s\n", d.online_compiler ? "yes" : "no");
  std::printf("     FFT              %s\n", fft.c_str());
}

void run_devices(const DeviceOptions& wanted, const ReportOptions& report) {
  const auto chosen = cl::find_device().index;  // where there is none, the error says what to do
  const auto devices = wanted.device.empty() ? cl::list_devices() : std::vector{wanted.found()};
  auto list = Json::array();
  for (const auto& device : devices) {
    const bool is_default = device.index == chosen;
    if (report.prints_text()) print(device, is_default);
    list.push_back(json_of(device, is_default));
  }
  report.write(list);
}

}  // namespace

void add_devices(CLI::App& app) {
  auto* command = add_command(app, section::devices, "devices",
                              "List OpenCL devices and what each can do", "build/raywave devices");
  auto wanted = std::make_shared<DeviceOptions>();
  wanted->add_device_to(*command);
  auto report = std::make_shared<ReportOptions>();
  report->add_to(*command, "the list");
  command->callback([wanted, report] { run_devices(*wanted, *report); });
}

}  // namespace raywave::cli
