// SPDX-License-Identifier: Apache-2.0
/// The command line before and after the parser: old names of options, and what to say when it was
/// not understood.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace raywave::cli {

struct Arguments {
  std::vector<std::string> words;  // without the program's name, in the parser's spelling
  std::vector<std::string> notes;  // one for each old name that was met; none with --quiet
};

/// Old names become today's, and --json gets its file: the next word where that ends in .json,
/// otherwise standard output ("-").
Arguments read_arguments(int count, const char* const* words);

/// One line: which word is unknown and which name is nearest, or what the parser says.
std::string refusal(const CLI::App& app, const CLI::ParseError& error);

}  // namespace raywave::cli
