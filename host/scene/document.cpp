// SPDX-License-Identifier: Apache-2.0
#include "host/scene/document.hpp"

#include <cctype>
#include <charconv>
#include <fstream>
#include <regex>

namespace raywave {
namespace {

constexpr std::size_t kMaxSceneBytes = 1 << 20;
// Each dot of a dotted key nests a table, and the parser frees tables by recursion
constexpr int kMaxDotsPerLine = 32;

}  // namespace

std::string range_text(const Range& range, double value, std::string (*format)(double)) {
  if (!range.one_sided) return format(range.min) + " to " + format(range.max);
  if (value > range.max) return "<= " + format(range.max);
  return ">= " + format(range.min);
}

std::string describe(const toml::node& node) {
  if (const auto* text = node.as_string()) return in_quotes(text->get());
  if (const auto* integer = node.as_integer()) return std::to_string(integer->get());
  if (const auto* number = node.as_floating_point()) {
    const auto text = number_text(number->get());
    const bool is_whole = text.find_first_not_of("-0123456789") == std::string::npos;
    return is_whole ? text + ".0" : text;  // as TOML tells it from an integer
  }
  if (const auto* boolean = node.as_boolean()) return boolean->get() ? "true" : "false";
  if (const auto* array = node.as_array()) {
    constexpr std::size_t most_told = 4;
    const auto is_value = [](const toml::node& one) { return one.is_value(); };
    if (array->empty() || array->size() > most_told ||
        !std::all_of(array->begin(), array->end(), is_value))
      return "an array of " + std::to_string(array->size());
    std::string text;
    for (const auto& one : *array) text += (text.empty() ? "[" : ", ") + describe(one);
    return text + "]";
  }
  return node.is_table() ? "a table" : "a date or time";
}

namespace {

/// The text of a file, or of a pipe such as /dev/stdin.
std::string read_text(const std::filesystem::path& file) {
  const std::string name = one_line(file.string());
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  if (!std::filesystem::exists(status)) throw InputError(name + ": there is no such file");
  if (std::filesystem::is_directory(status)) throw InputError(name + ": is a folder, no file");
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw InputError(name + ": cannot be read");
  // The size of a pipe is known at its end only
  std::string text(kMaxSceneBytes + 1, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (stream.bad()) throw InputError(name + ": cannot be read");
  text.resize(static_cast<std::size_t>(stream.gcount()));
  if (text.size() > kMaxSceneBytes)
    throw InputError(name + ": too large for a scene file (at most 1 MiB)");
  return text;
}

/// The most dots that one key of a line can have: without quotes, none reaches over a comma.
std::ptrdiff_t dots_of_keys(std::string_view line) {
  if (line.find_first_of("\"'") != line.npos) return std::count(line.begin(), line.end(), '.');
  std::ptrdiff_t most = 0;
  for (;;) {
    const auto piece = line.substr(0, line.find(','));
    most = std::max(most, std::count(piece.begin(), piece.end(), '.'));
    if (piece.size() == line.size()) return most;
    line.remove_prefix(piece.size() + 1);
  }
}

/// The first line with `a.a.a.a. ... = 1`, whose tables would nest deeper than the parser's
/// recursion can free; 0: there is none.
int deep_line(std::string_view text) {
  for (int line = 1; !text.empty(); ++line) {
    const std::string_view rest = text.substr(0, text.find('\n'));
    const auto first = rest.find_first_not_of(" \t");
    const bool is_comment = first != std::string_view::npos && rest[first] == '#';
    if (!is_comment && dots_of_keys(rest) > kMaxDotsPerLine) return line;
    text.remove_prefix(std::min(text.size(), rest.size() + 1));
  }
  return 0;
}

std::string_view line_of(std::string_view text, std::size_t number) {
  for (; number > 1 && !text.empty(); --number)
    text.remove_prefix(std::min(text.size(), text.find('\n') + 1));
  return text.substr(0, text.find('\n'));
}

constexpr const char* bare_unit =
    "a value with a unit needs quotes, also within brackets: \"100 mm\", [0, 0, \"100 mm\"]";

/// Whether a number with a unit stands outside of quotes.
bool has_bare_unit(std::string_view line) {
  static const std::regex quoted("\"[^\"]*\"|'[^']*'|#.*"),
      unit("[0-9.] *(nm|um|\u00b5m|\u03bcm|mm|cm|m|km|us|ms|s|min|h)\\s*(,|\\]|#|$)");
  constexpr std::size_t most = 400;  // regular expressions take stack for each letter
  const std::string read(line.substr(0, most));
  return std::regex_search(std::regex_replace(read, quoted, ""), unit);
}

/// Parses the value as TOML; a text that is not TOML, such as `auto` or `8 um`, becomes a string.
void assign(toml::table& table, std::string_view key, const std::string& text) {
  toml::table parsed;
  try {
    if (deep_line(text) == 0) parsed = toml::parse("value = " + text);
  } catch (const toml::parse_error&) {
    parsed.clear();
  }
  if (parsed.size() != 1 || !parsed.contains("value")) parsed.insert_or_assign("value", text);
  parsed.get("value")->visit([&](auto& value) { table.insert_or_assign(key, std::move(value)); });
}

void apply_override(Document& document, const std::string& text) {
  const auto fail = [&](const std::string& what) {
    throw InputError("--set " + one_line(text) + ": " + what);
  };
  const auto of_gltf = [&](std::string_view path) {
    return path.starts_with("object.") && document.root.at_path("scene.gltf")
               ? "; the object of [scene] belongs to the glTF file, and has no keys"
               : "";
  };
  const auto equals = text.find('=');
  if (equals == std::string::npos || equals == 0)
    fail("must be section.key=value, for example wrp.padding=1.25");
  const std::string path = text.substr(0, equals);
  if (std::count(path.begin(), path.end(), '.') > 3) fail("names no key of a scene");

  toml::node* node = &document.root;
  for (std::string_view rest = path;;) {
    const auto dot = rest.find('.');
    const std::string_view key = rest.substr(0, dot);
    const bool is_last = dot == std::string_view::npos;
    if (key.empty()) fail("must be section.key=value, for example wrp.padding=1.25");

    if (toml::table* table = node->as_table()) {
      if (is_last) {
        if (text[equals + 1] == '[' && has_bare_unit(text.substr(equals + 1))) fail(bare_unit);
        assign(*table, key, text.substr(equals + 1));
        break;
      }
      node = table->get(key);
      if (!node && table == &document.root) node = &table->insert(key, toml::table{}).first->second;
      if (!node)
        fail("the scene has no " +
             in_quotes(path.substr(0, path.size() - rest.size() + key.size())) + of_gltf(path));
    } else if (toml::array* array = node->as_array(); array && !is_last) {
      std::size_t index = array->size();
      const auto [end, error] = std::from_chars(key.data(), key.data() + key.size(), index);
      if (error != std::errc() || end != key.data() + key.size() || index >= array->size())
        fail((array->size() == 1 ? "there is " : "there are ") + std::to_string(array->size()) +
             " of " + in_quotes(std::string_view(path).substr(0, path.size() - rest.size() - 1)) +
             ", counted from 0, so " + in_quotes(key) + " is none of them" + of_gltf(path));
      node = array->get(index);
    } else {
      const auto list = path.substr(0, path.size() - rest.size());  // with its dot
      const bool names_none =
          node->is_array_of_tables() && !std::isdigit(static_cast<unsigned char>(key.front()));
      fail("names no key of a scene" +
           (names_none ? "; " + one_line(list + "0." + std::string(key)) + " is that of the first"
                       : ""));
    }
    rest.remove_prefix(dot + 1);
  }
  document.overrides[path] = text;
}

}  // namespace

SceneText read_scene_text(const std::filesystem::path& file) {
  const auto type = extension_of(file);
  for (const char* of_mesh :
       {".obj", ".ply", ".stl", ".off", ".gltf", ".glb", ".fbx", ".dae", ".3ds"})
    if (type == of_mesh)
      throw InputError(
          one_line(file.string()) + ": is a mesh, and a scene is needed: raywave new " +
          shell_word(one_line(file.string())) + " -o scene.toml writes one that shows it");
  for (const char* of_result : {".json", ".npy", ".png", ".bmp", ".tif", ".tiff", ".exr", ".jpg"})
    if (type == of_result)
      throw InputError(one_line(file.string()) + ": is a " +
                       (type == ".json"  ? "report"
                        : type == ".npy" ? "field"
                                         : "picture") +
                       ", and a scene is needed; raywave quality and raywave reconstruct take the "
                       "report.json of a finished hologram");
  SceneText text{read_text(file), file, {}};
  // /dev/stdin and /dev/fd/63 are what somebody pipes
  if (!file.string().starts_with("/dev/")) text.folder = file.parent_path();
  return text;
}

Document parse_document(const SceneText& text, const std::vector<std::string>& overrides) {
  Document document;
  document.file = text.file;
  document.folder = text.folder;
  const std::string name = one_line(text.file.string());
  if (text.toml.size() > kMaxSceneBytes)
    throw InputError(name + ": too large for a scene file (at most 1 MiB)");
  if (const int line = deep_line(text.toml))
    throw InputError(name + ":" + std::to_string(line) + ": more than " +
                     std::to_string(kMaxDotsPerLine) + " dots in one line");
  try {
    document.root = toml::parse(text.toml);
  } catch (const toml::parse_error& error) {
    const auto line = error.source().begin.line;
    throw InputError(
        name + ":" + std::to_string(line) + ": " +
        (has_bare_unit(line_of(text.toml, line)) ? bare_unit : one_line(error.description())));
  }
  for (const std::string& one : overrides) apply_override(document, one);
  return document;
}

}  // namespace raywave
