// SPDX-License-Identifier: Apache-2.0
/// The command line before the parser, and what to say when it was not understood.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace raywave::cli {

/// The words without the program's name, in the parser's spelling: --json gets its file, the next
/// word where that ends in .json, otherwise standard output ("-").
std::vector<std::string> read_arguments(int count, const char* const* given);

/// One line: which word is unknown and which name is nearest, or what the parser says.
std::string refusal(const CLI::App& app, const CLI::ParseError& error);

}  // namespace raywave::cli
