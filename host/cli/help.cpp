// SPDX-License-Identifier: Apache-2.0
#include "host/cli/help.hpp"

#include <algorithm>
#include <sstream>
#include <vector>

namespace raywave::cli {
namespace {

constexpr std::size_t page_width = 100, text_column = 28;

/// A name, and a text beside it that is wrapped where the page ends.
std::string entry(const std::string& name, const std::string& text) {
  std::string all = "  " + name;
  std::size_t column = all.size();
  const auto break_line = [&] {
    all += "\n" + std::string(text_column, ' ');
    column = text_column;
  };
  if (column + 2 > text_column)
    break_line();
  else
    all += std::string(text_column - column, ' ');
  column = text_column;

  std::istringstream words(text);
  for (std::string word; words >> word;) {
    if (column > text_column && column + 1 + word.size() > page_width) break_line();
    if (column > text_column) all += ' ', ++column;
    all += word;
    column += word.size();
  }
  return all + "\n";
}

/// "-o, --output FOLDER", "--views, --no-views", "--json [FILE]"
std::string heading_of(const CLI::Option& option) {
  std::string heading;
  for (const auto& name : option.get_snames()) heading += (heading.empty() ? "-" : ", -") + name;
  for (const auto& name : option.get_lnames()) heading += (heading.empty() ? "--" : ", --") + name;
  const auto placeholder = placeholder_of(option);
  return placeholder.empty() ? heading : heading + " " + placeholder;
}

std::string text_of(const CLI::Option& option) {
  auto text = option.get_description();
  if (!option.get_default_str().empty()) text += " (default " + option.get_default_str() + ")";
  if (option.get_required() && !option.get_positional()) text += " (required)";
  return text;
}

std::vector<const CLI::Option*> positionals_of(const CLI::App& app) {
  return app.get_options([](const CLI::Option* option) { return option->get_positional(); });
}

/// Groups in the order in which their options were added, but for the one of --help: it is last.
std::vector<std::string> groups_of(const CLI::App& app) {
  auto groups = app.get_groups();
  const auto last = app.get_help_ptr()->get_group();
  std::erase_if(groups, [&](const std::string& name) { return name.empty() || name == last; });
  groups.push_back(last);
  return groups;
}

std::string options_text(const CLI::App& app) {
  std::string all;
  for (const auto& name : groups_of(app)) {
    auto options = app.get_options([&](const CLI::Option* option) {
      return option->nonpositional() && option->get_group() == name;
    });
    if (options.empty()) continue;
    std::stable_partition(options.begin(), options.end(), [&](const CLI::Option* option) {
      return option != app.get_help_ptr();  // which the parser puts first
    });
    all += "\n" + name + ":\n";
    for (const auto* option : options) all += entry(heading_of(*option), text_of(*option));
  }
  return all;
}

/// Commands under their sections, in the order in which they were added.
std::string commands_text(const CLI::App& app) {
  std::string all, section;
  for (const auto* command : app.get_subcommands({})) {
    if (command->get_group() != section) {
      section = command->get_group();
      all += "\n" + section + ":\n";
    }
    all += "  " + command->get_name() + std::string(13 - command->get_name().size(), ' ') +
           command->get_description() + "\n";
  }
  return all;
}

class Help : public CLI::FormatterBase {
public:
  std::string make_help(const CLI::App* app, std::string, CLI::AppFormatMode) const override {
    const bool whole_program = app->get_parent() == nullptr;
    std::string usage = "Usage: raywave ", arguments;
    usage += whole_program ? "COMMAND" : app->get_name();
    for (const auto* positional : positionals_of(*app)) {
      auto name = positional->get_name(true);
      if (positional->get_expected_max() > 1) name += "...";
      usage += positional->get_required() ? " " + name : " [" + name + "]";
      arguments += entry(name, text_of(*positional));
    }
    for (const auto* option : app->get_options()) {
      if (option->get_required() && option->nonpositional()) usage += " " + short_form(*option);
    }
    return app->get_description() + "\n\n" + usage + " [OPTIONS]\n" +
           (arguments.empty() ? "" : "\n" + arguments) + commands_text(*app) + options_text(*app) +
           "\n" + app->get_footer() + "\n";
  }

private:
  static std::string short_form(const CLI::Option& option) {
    const auto& names = option.get_snames();
    return (names.empty() ? "--" + option.get_lnames().front() : "-" + names.front()) + " " +
           placeholder_of(option);
  }
};

}  // namespace

std::shared_ptr<CLI::FormatterBase> help_formatter() { return std::make_shared<Help>(); }

CLI::App* add_command(CLI::App& app, const char* section, const char* name, const char* description,
                      const std::string& example) {
  auto* command = app.add_subcommand(name, description);
  command->group(section);
  command->get_help_ptr()->group(group::output);
  std::string footer = "Example:";
  std::istringstream lines(example);
  for (std::string line; std::getline(lines, line);) footer += "\n  " + line;
  command->footer(footer);
  return command;
}

std::string placeholder_of(const CLI::Option& option) {
  if (option.get_expected_max() == 0 || option.get_type_size() == 0) return "";  // a flag
  const auto name = option.get_type_name();
  return name.substr(0, name.find(':'));
}

}  // namespace raywave::cli
