// SPDX-License-Identifier: Apache-2.0
#include "host/cli/arguments.hpp"

#include <algorithm>
#include <regex>
#include <utility>

#include "host/common/text.hpp"

namespace raywave::cli {
namespace {

/// ", did you mean NAME?" with the nearest name, or nothing where none is near.
std::string suggestion(const std::string& word, const std::vector<std::string>& names) {
  std::size_t least = std::max<std::size_t>(2, word.size() / 3) + 1;
  const std::string* nearest = nullptr;
  for (const auto& name : names) {
    // A beginning counts as near: --lens for --lens-points.
    const bool begins = word.size() >= 4 && name.starts_with(word);
    const std::size_t distance = begins ? 1 : edit_distance(word, name);
    if (distance < least) {
      least = distance;
      nearest = &name;
    }
  }
  return nearest ? "; did you mean " + *nearest + "?" : "";
}

std::vector<std::string> option_names(const CLI::App& command) {
  std::vector<std::string> names;
  for (const auto* option : command.get_options()) {
    for (const auto& name : option->get_lnames()) names.push_back("--" + name);
  }
  return names;
}

/// What the parser says, in the words of our other refusals.
std::string reworded(std::string text) {
  const std::pair<const char*, const char*> phrases[] = {
      {"^(\\S+): At Most 1 required but received (\\d+)$", "$1 can be given once, not $2 times"},
      {"^(\\S+): At Most (\\d+) required but received (\\d+)$",
       "$1 takes at most $2 values, got $3"},
      {"^(\\S+): At least (\\d+) required but received (\\d+)$", "$1 takes $2 values, got $3"},
      {"^(\\S+): 1 required (\\S+) missing$", "$1 needs a value: $2"},
      {"^Could not convert: (\\S+) = ([^]*)$", "$1 must be a number, got \"$2\""},
      {"^(\\S+): Value ([^]*) not in range (\\d+(?:\\.\\d*[1-9])?)\\.?0* to "
       "(\\d+(?:\\.\\d*[1-9])?)\\.?0*$",
       "$1 must be $3 to $4, got \"$2\""}};
  for (const auto& [theirs, ours] : phrases)
    text = std::regex_replace(text, std::regex(theirs), ours);
  return text;
}

}  // namespace

std::vector<std::string> read_arguments(int count, const char* const* given) {
  std::vector<std::string> words(given + std::min(count, 1), given + count);
  for (std::size_t i = 0; i < words.size() && words[i] != "--"; ++i) {
    if (words[i] != "--json") continue;
    const bool has_file = i + 1 < words.size() && !words[i + 1].starts_with("--") &&
                          (words[i + 1].ends_with(".json") || words[i + 1] == "-");
    words[i] += has_file ? "=" + words[i + 1] : "=-";
    if (has_file) words.erase(words.begin() + static_cast<std::ptrdiff_t>(i + 1));
  }
  return words;
}

std::string refusal(const CLI::App& app, const CLI::ParseError& error) {
  const auto commands = app.get_subcommands();  // those that were met: one at most
  const auto unknown = app.remaining(true);
  if (commands.empty()) {
    const std::string help = " (raywave --help lists all commands)";
    if (unknown.empty()) return "a command is needed, such as plan or render" + help;
    if (unknown.front().starts_with('-'))
      return "unknown option " + in_quotes(unknown.front()) + " before a command" + help;
    std::vector<std::string> names;
    for (const auto* command : app.get_subcommands({})) names.push_back(command->get_name());
    return "unknown command " + in_quotes(unknown.front()) + suggestion(unknown.front(), names) +
           help;
  }
  const auto& command = *commands.front();
  const auto help = " (raywave " + command.get_name() + " --help lists all options)";
  const auto option = std::find_if(unknown.begin(), unknown.end(),
                                   [](const std::string& word) { return word.starts_with('-'); });
  if (option != unknown.end()) {
    const auto name = option->substr(0, option->find('='));
    return command.get_name() + ": unknown option " + in_quotes(name) +
           suggestion(name, option_names(command)) + help;
  }
  if (!unknown.empty())
    return command.get_name() + ": unexpected argument " + in_quotes(unknown.front()) + help;
  return command.get_name() + ": " + reworded(one_line(error.what())) + help;
}

}  // namespace raywave::cli
