// SPDX-License-Identifier: Apache-2.0
#include "host/evaluate/selftest/selftest.hpp"

#include <cstdio>
#include <memory>

#include "host/cli/commands.hpp"
#include "host/common/error.hpp"
#include "host/common/output.hpp"

namespace raywave::cli {

namespace {

struct Options {
  DeviceOptions device;
  std::string json, only;
  bool full = false;
  double strict = 1;
};

void run(const Options& options) {
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

  std::fputs((self_test_header(info, size) + "\n").c_str(), stdout);
  std::vector<SelfTestRow> rows;
  std::size_t failed = 0;
  for (auto& check : checks) {
    check.bound /= options.strict;
    rows.push_back(raywave::run(check, device));
    failed += !rows.back().passed;
    std::fputs(self_test_line(rows.back()).c_str(), stdout);
    std::fflush(stdout);
  }
  std::printf("\n%zu of %zu passed\n", rows.size() - failed, rows.size());
  if (!options.json.empty()) write_text(options.json, self_test_json(info, size, rows));
  if (!all_passed(rows)) throw CLI::RuntimeError(1);
}

}  // namespace

void add_selftest(CLI::App& app) {
  auto* command = app.add_subcommand(
      "selftest",
      "Check a device and its driver against double precision; exit code 1 when a row fails");
  auto options = std::make_shared<Options>();
  options->device.add_device_to(*command);
  command->add_flag("--full", options->full,
                    "Minutes in place of seconds: every float, millions of rays, large planes");
  command->add_option("--json", options->json, "Also write the table to this file");
  command->add_option("--only", options->only,
                      "Only rows whose part and name hold this text, e.g. FFT");
  command->add_option("--strict", options->strict, "Divide every bound by this (1)")
      ->check(CLI::PositiveNumber);
  command->callback([options] { run(*options); });
}

}  // namespace raywave::cli
