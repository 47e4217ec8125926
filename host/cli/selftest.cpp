// SPDX-License-Identifier: Apache-2.0
#include "host/evaluate/selftest/selftest.hpp"

#include "host/cli/commands.hpp"
#include "host/cli/help.hpp"
#include "host/cli/options.hpp"
#include "host/common/error.hpp"

namespace raywave::cli {

namespace {

struct SelftestArguments {
  DeviceOptions device;
  ReportOptions report;
  std::string only;
  bool full = false;
  double strict = 1;
};

void run_selftest(const SelftestArguments& options) {
  const cl::Device device(options.device.info());
  const auto& info = device.info();
  const auto size = options.full ? SelfTestSize::full : SelfTestSize::quick;
  auto checks = self_checks(info, size);
  std::erase_if(checks, [&](const SelfCheck& c) {
    return (c.part + " " + c.claim).find(options.only) == std::string::npos;
  });
  if (checks.empty())
    throw InputError("--only \"" + options.only +
                     "\": no row's name holds this; without --only all are shown");

  options.report.print(self_test_header(info, size) + "\n");
  std::vector<SelfTestRow> rows;
  std::size_t failed = 0;
  for (auto& check : checks) {
    check.bound /= options.strict;
    rows.push_back(raywave::run(check, device));
    failed += !rows.back().passed;
    options.report.print(self_test_line(rows.back()));
  }
  if (const auto extremes = extremes_text(rows); !extremes.empty())
    options.report.print("\n" + extremes);
  options.report.print("\n" + std::to_string(rows.size() - failed) + " of " +
                       std::to_string(rows.size()) + " passed\n");
  options.report.write(self_test_json(info, size, rows));
  if (!all_passed(rows)) throw CLI::RuntimeError(1);
}

}  // namespace

void add_selftest(CLI::App& app) {
  auto* command = add_command(app, section::devices, "selftest",
                              "Check a device and its driver against double precision",
                              "build/raywave selftest");
  const auto options = arguments_of(*command, run_selftest);
  flag(*command, "--full", options->full, group::measurement,
       "Minutes instead of seconds: every float, millions of rays, large planes");
  add_only(*command, options->only, "FFT");
  option(*command, "--strict", options->strict, "FACTOR", group::measurement,
         "Divide every bound by this")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  options->device.add_device_to(*command);
  options->report.add_to(*command, "the table");
}

}  // namespace raywave::cli
