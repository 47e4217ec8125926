// SPDX-License-Identifier: Apache-2.0
// Shell completion, printed from the parser's own commands and options, so that it knows what the
// program knows.
#include <algorithm>
#include <cstdio>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "host/cli/commands.hpp"
#include "host/cli/help.hpp"
#include "host/common/error.hpp"
#include "host/common/text.hpp"

namespace raywave::cli {
namespace {

/// What the word after an option may be, and the calls that offer it.
struct Value {
  std::string placeholder;  // empty: there is no word
  std::string bash, zsh;

  bool is_json() const { return placeholder == "[FILE]"; }
};

/// "hologram|part|SIZE" -> "hologram part": words in capitals stand for something.
std::string choices_of(std::string placeholder) {
  std::string all;
  std::ranges::replace(placeholder, '|', ' ');
  std::istringstream words(placeholder);
  for (std::string word; words >> word;)
    if (word[0] < 'A' || word[0] > 'Z') all += (all.empty() ? "" : " ") + word;
  return all;
}

Value value_of(const CLI::Option& option) {
  static const Value known[] = {{"SCENE", "_raywave_files toml", "_files -g \"*.toml(-.)\""},
                                {"FILE", "_raywave_files", "_files"},
                                {"FOLDER", "_raywave_folders", "_files -/"},
                                {"DEVICE", "_raywave_devices", "_raywave_devices"},
                                {"[FILE]", "_raywave_files json", "_files -g \"*.json(-.)\""}};
  const auto name = placeholder_of(option);
  for (const auto& value : known)
    if (value.placeholder == name) return value;
  if (name.find('|') == std::string::npos) return {name, ":", " "};
  const auto choices = choices_of(name);
  return {name, "_raywave_words " + choices, "(" + choices + ")"};
}

std::vector<std::string> names_of(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const auto& name : option.get_snames()) names.push_back("-" + name);
  for (const auto& name : option.get_lnames()) names.push_back("--" + name);
  return names;
}

std::string joined(const std::vector<std::string>& words, const std::string& separator) {
  std::string all;
  for (const auto& word : words) all += (all.empty() ? "" : separator) + word;
  return all;
}

std::vector<const CLI::Option*> options_of(const CLI::App& app, bool positional) {
  return app.get_options(
      [&](const CLI::Option* option) { return option->get_positional() == positional; });
}

// ---------------------------------------------------------------------------------------- bash

constexpr const char* bash_helpers =
    R"sh(# bash completion for raywave, printed by: raywave completion bash
# To use it: source <(raywave completion bash)

# These offer words that begin with $value and put $prefix (--option= or nothing) before them.
_raywave_words() {
  local word
  for word in "$@"; do
    if [[ $word == "$value"* ]]; then COMPREPLY+=("$prefix$word"); fi
  done
}
_raywave_folders() {
  local word
  compopt -o filenames 2>/dev/null
  while IFS= read -r word; do COMPREPLY+=("$prefix$word"); done < <(compgen -d -- "$value")
}
_raywave_files() { # [EXTENSION]
  local word
  _raywave_folders
  while IFS= read -r word; do
    if [[ ! -d $word ]]; then COMPREPLY+=("$prefix$word"); fi
  done < <(compgen -f ${1:+-X "!*.$1"} -- "$value")
}
_raywave_devices() {
  local list
  list=$("${words[0]}" devices 2>/dev/null | sed -n 's/^\([0-9]*:[0-9]*\)  .*/\1/p')
  # shellcheck disable=SC2086 # one index a word
  _raywave_words $list
}
)sh";

constexpr const char* bash_main = R"sh(
_raywave() {
  local line=${COMP_LINE:0:COMP_POINT} command='' word value option='' prefix='' head
  local -a words
  COMPREPLY=()
  read -ra words <<<"$line"
  if [[ $line == *[[:space:]] ]]; then words+=(''); fi
  value=${words[${#words[@]} - 1]}
  for word in "${words[@]:1:${#words[@]}-2}"; do
    if [[ $word != -* ]]; then
      command=$word
      break
    fi
  done
  if [[ $value == --*=* ]]; then
    option=${value%%=*} prefix=${value%%=*}= value=${value#*=}
  elif [[ $value != -* && ${#words[@]} -gt 2 ]]; then
    option=${words[${#words[@]} - 2]}
  fi

  # A value of the option before it; otherwise an option or an argument.
  if [[ -z $command || $option != -* ]] || ! _raywave_value "$command" "$option"; then
    if [[ $value == -* ]]; then
      # shellcheck disable=SC2046 # one name a word
      _raywave_words $(_raywave_options "$command")
    else
      _raywave_argument "$command"
    fi
  fi

  # Readline replaces no more than what follows the last of these signs.
  local signs=''
  if [[ $COMP_WORDBREAKS == *=* ]]; then signs+='='; fi
  if [[ $COMP_WORDBREAKS == *:* ]]; then signs+=':'; fi
  if [[ -n $signs && $prefix$value == *[$signs]* ]]; then
    word=$prefix$value head=${word%"${word##*["$signs"]}"}
    COMPREPLY=("${COMPREPLY[@]#"$head"}")
  fi
}
complete -F _raywave raywave
)sh";

std::string bash_completion(const CLI::App& app) {
  std::string options, values, arguments;
  std::vector<std::string> commands;
  const auto add = [&](const CLI::App& command, const std::string& name) {
    std::vector<std::string> names;
    for (const auto* option : options_of(command, false)) {
      const auto own = names_of(*option);
      names.insert(names.end(), own.begin(), own.end());
      const auto value = value_of(*option);
      if (value.placeholder.empty()) continue;
      std::string patterns;
      for (const auto& one : own)
        patterns.append(patterns.empty() ? "'" : " | '").append(name + " " + one + "'");
      // A file after --json is optional: an argument may follow instead.
      values += "    " + patterns + ") " + value.bash +
                (value.is_json() ? "; [[ -n $prefix ]]" : "") + " ;;\n";
    }
    options += "    '" + name + "') echo " + joined(names, " ") + " ;;\n";
  };
  add(app, "");
  for (const auto* command : app.get_subcommands({})) {
    add(*command, command->get_name());
    commands.push_back(command->get_name());
    for (const auto* positional : options_of(*command, true)) {
      arguments += "    '" + command->get_name() + "') " + value_of(*positional).bash + " ;;\n";
      break;  // those after it are of the same kind
    }
  }
  return bash_helpers + ("\n_raywave_options() { # COMMAND\n  case $1 in\n" + options) +
         "  esac\n}\n\n# Fails when the option takes no value.\n"
         "_raywave_value() { # COMMAND OPTION\n  case \"$1 $2\" in\n" +
         values +
         "    *) return 1 ;;\n  esac\n}\n\n_raywave_argument() { # COMMAND\n  case $1 in\n" +
         "    '') _raywave_words " + joined(commands, " ") + " ;;\n" + arguments + "  esac\n}\n" +
         bash_main;
}

// ----------------------------------------------------------------------------------------- zsh

/// The text between single quotes, with what _arguments reads otherwise escaped.
std::string zsh_text(const std::string& text) {
  std::string all;
  for (const char c : text) {
    if (c == '\'')
      all += "'\\''";
    else if (c == '[' || c == ']' || c == ':' || c == '\\')
      all += std::string("\\") + c;
    else
      all += c;
  }
  return all;
}

/// ":placeholder:action"
std::string zsh_action(const Value& value) {
  return ":" + zsh_text(value.placeholder) + ":" + value.zsh;
}

std::string zsh_options(const CLI::App& command, const std::string& indent) {
  std::string all;
  for (const auto* option : options_of(command, false)) {
    const auto value = value_of(*option);
    const auto names = names_of(*option);
    const bool many = option->get_expected_max() > 1 && option->get_delimiter() == '\0';
    for (const auto& name : names) {
      const bool is_long = name.starts_with("--");
      const std::string joint = value.placeholder.empty() || !is_long ? ""
                                : value.is_json()                     ? "=-"
                                                                      : "=";
      all += indent + "'" + (many ? "*" : "(" + joined(names, " ") + ")") + name + joint + "[" +
             zsh_text(option->get_description()) + "]" +
             (value.placeholder.empty() ? ""
              : value.is_json()         ? ":" + zsh_action(value)
                                        : zsh_action(value)) +
             "' \\\n";
    }
  }
  return all;
}

constexpr const char* zsh_helpers = R"sh(#compdef raywave
# zsh completion for raywave, printed by: raywave completion zsh
# To use it, once compinit has run: source <(raywave completion zsh)
# or write it to a file _raywave in a folder of $fpath.

_raywave_devices() {
  local list
  local -a indices
  list=$($program devices 2>/dev/null | sed -n 's/^\([0-9]*\):\([0-9]*\)  /\1\\:\2:/p')
  indices=(${(f)list})
  _describe 'device' indices
}
)sh";

std::string zsh_completion(const CLI::App& app) {
  std::string all = zsh_helpers;
  all +=
      "\n_raywave() {\n  local curcontext=$curcontext program=$words[1] state line\n"
      "  local -a commands\n"
      "  commands=(\n";
  for (const auto* command : app.get_subcommands({}))
    all += "    '" + command->get_name() + ":" + zsh_text(command->get_description()) + "'\n";
  all += "  )\n  _arguments -C \\\n" + zsh_options(app, "    ") +
         "    '1:command:->command' \\\n    '*::argument:->argument' && return\n"
         "  case $state in\n    command) _describe 'command' commands ;;\n"
         "    argument)\n      curcontext=${curcontext%:*}-$words[1]:\n      case $words[1] in\n";
  for (const auto* command : app.get_subcommands({})) {
    all += "        " + command->get_name() + ")\n          _arguments \\\n" +
           zsh_options(*command, "            ");
    int number = 0;
    for (const auto* positional : options_of(*command, true))
      all += "            '" +
             (positional->get_expected_max() > 1 ? "*" : std::to_string(++number)) +
             zsh_action(value_of(*positional)) + "' \\\n";
    all.erase(all.size() - 3);  // the last " \" and line end
    all += "\n          ;;\n";
  }
  return all +
         "      esac\n      ;;\n  esac\n}\n\n"
         "# Sourced or autoloaded?\n"
         "if [[ $funcstack[1] == _raywave ]]; then _raywave \"$@\"; else compdef _raywave "
         "raywave; fi\n";
}

}  // namespace

void add_completion(CLI::App& app) {
  auto* command = add_command(app, section::shell, "completion",
                              "Print the completion of commands, options and values for a shell",
                              "source <(build/raywave completion bash)");
  auto shell = std::make_shared<std::string>();
  argument(*command, "SHELL", *shell, "bash|zsh", "bash or zsh")->required();
  command->callback([&app, shell] {
    if (*shell != "bash" && *shell != "zsh")
      throw InputError("completion " + in_quotes(*shell) +
                       ": unknown shell; there are bash and zsh");
    std::fputs((*shell == "bash" ? bash_completion(app) : zsh_completion(app)).c_str(), stdout);
  });
}

}  // namespace raywave::cli
