// SPDX-License-Identifier: Apache-2.0
/// What `raywave --help` and `raywave COMMAND --help` print.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

namespace raywave::cli {

/// Headings of `raywave --help`.
namespace section {
constexpr const char* make = "Make a hologram";
constexpr const char* look = "Look at it";
constexpr const char* measure = "Measure";
constexpr const char* devices = "Devices";
constexpr const char* shell = "Shell";
}  // namespace section

/// Headings of a command's help. Output comes last: it holds --help, which every command has.
namespace group {
constexpr const char* scene = "Scene";
constexpr const char* plan = "Plan (values that the scene gives stay as they are)";
constexpr const char* method = "Method";
constexpr const char* refinement = "Refinement";
constexpr const char* pictures = "Pictures";
constexpr const char* measurement = "Measurement";
constexpr const char* device = "Device";
constexpr const char* output = "Output";
}  // namespace group

/// To be set before commands are added: they take it over.
std::shared_ptr<CLI::FormatterBase> help_formatter();

/// A command under a heading of `raywave --help`.
///
/// description  one line
/// example      lines that work from a clone where raywave is built
CLI::App* add_command(CLI::App& app, const char* section, const char* name, const char* description,
                      const std::string& example);

/// What a command is asked for; `run` is called with it once the command line is understood.
template <class Arguments>
std::shared_ptr<Arguments> arguments_of(CLI::App& command, void (*run)(const Arguments&)) {
  auto options = std::make_shared<Arguments>();
  command.callback([options, run] { run(*options); });
  return options;
}

/// An option under a heading of a command's help.
///
/// placeholder  of its value: "LENGTH"
template <class Value>
CLI::Option* option(CLI::App& command, const std::string& names, Value& value,
                    const std::string& placeholder, const char* group, const std::string& help) {
  return command.add_option(names, value, help)->type_name(placeholder)->group(group);
}

/// What stands in a command line without a name before it.
///
/// name  in the usage
template <class Value>
CLI::Option* argument(CLI::App& command, const std::string& name, Value& value,
                      const std::string& placeholder, const std::string& help) {
  return command.add_option(name, value, help)->type_name(placeholder);
}

template <class Value>
CLI::Option* flag(CLI::App& command, const std::string& names, Value& value, const char* group,
                  const std::string& help) {
  return command.add_flag(names, value, help)->group(group);
}

/// "LENGTH" of an option that takes a length: its placeholder, without the checks that CLI11 adds.
std::string placeholder_of(const CLI::Option& option);

}  // namespace raywave::cli
