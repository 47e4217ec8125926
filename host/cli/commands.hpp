// SPDX-License-Identifier: Apache-2.0
/// The commands of the program `raywave`. Each function adds one command to the parser, which runs
/// it once the command line is understood. Errors leave as exceptions; main.cpp maps them to exit
/// codes.
#pragma once

#include <CLI/CLI.hpp>

namespace raywave::cli {

void add_new(CLI::App& app);
void add_plan(CLI::App& app);
void add_render(CLI::App& app);
void add_encode(CLI::App& app);
void add_pattern(CLI::App& app);
void add_refine(CLI::App& app);
void add_animate(CLI::App& app);
void add_units(CLI::App& app);

void add_reconstruct(CLI::App& app);
void add_lens(CLI::App& app);
void add_preview(CLI::App& app);
void add_compare(CLI::App& app);
void add_quality(CLI::App& app);
void add_show(CLI::App& app);
void add_view(CLI::App& app);

void add_bench(CLI::App& app);
void add_trade(CLI::App& app);
void add_tune(CLI::App& app);

void add_devices(CLI::App& app);
void add_selftest(CLI::App& app);
void add_kernels(CLI::App& app);

void add_completion(CLI::App& app);

}  // namespace raywave::cli
