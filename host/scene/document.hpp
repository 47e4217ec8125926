// SPDX-License-Identifier: Apache-2.0
/// A TOML file of the user's, read value by value. Every value knows its place, so that a message
/// says file and line; overrides of the command line are in place before anything is read.
#pragma once

#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/scene/scene_text.hpp"
#include "host/scene/units.hpp"

namespace raywave {

/// Allowed range of a number.
struct Range {
  double min, max;
  bool one_sided = false;  // max is only the limit of float, which messages omit
};
constexpr double kLargest = 1e30;  // leaves room to multiply in float
constexpr Range between(double min, double max) { return {min, max}; }
constexpr Range at_least(double min) { return {min, kLargest, true}; }

/// "1 to 8", ">= 0"; for a one-sided range only the bound that the value violates.
std::string range_text(const Range& range, double value, std::string (*format)(double));

/// A value as messages quote it.
std::string describe(const toml::node& node);

/// The parsed file with the overrides in place. Paths name a node as --set does: "wrp.padding",
/// "object.0.width".
struct Document {
  std::filesystem::path file;
  std::filesystem::path folder;  // of the files that it names
  toml::table root;
  std::map<std::string, std::string, std::less<>> overrides;  // path -> the override as given
  mutable std::vector<std::string> notes;                     // whoever reads a value may leave one

  /// "--set wrp.padding=9" for what an override gave, else "scene.toml:12".
  std::string where(const toml::node& node, std::string_view path) const {
    for (std::string_view parent = path;; parent = parent.substr(0, parent.rfind('.'))) {
      if (const auto found = overrides.find(parent); found != overrides.end())
        return "--set " + one_line(found->second);
      if (parent.find('.') == std::string_view::npos) break;
    }
    if (const auto line = node.source().begin.line; line > 0)
      return one_line(file.string()) + ":" + std::to_string(line);
    // A section that only overrides made has no line.
    const auto child = overrides.lower_bound(std::string(path) + ".");
    return child != overrides.end() && child->first.starts_with(path)
               ? "--set " + one_line(child->second)
               : one_line(file.string());
  }
};

/// Few holograms show what is as large or far.
inline constexpr double least_doubted_m = 2;

/// One value of the scene: converts itself, or says where it is and what it must be.
struct Value {
  const Document* document;
  const toml::node* node;
  std::string path;   // "materials.gold.shininess"
  std::string label;  // "material "gold": shininess"

  /// "scene.toml:3: slm: lut"
  std::string where() const { return document->where(*node, path) + ": " + label; }

  [[noreturn]] void fail(const std::string& must_be) const {
    throw InputError(where() + " must be " + must_be + ", got " + describe(*node));
  }

  /// The same in words of the caller's: "scene.toml:3: slm: lut turns back".
  [[noreturn]] void refuse(const std::string& what) const {
    throw InputError(where() + " " + what);
  }

  /// Leaves a note that starts with the value's place.
  void note(const std::string& what) const { document->notes.push_back(where() + ": " + what); }

  double number(const Range& range) const {
    const auto value = node->value<double>();
    if (!node->is_number() || !value) fail("a number");
    return checked(*value, range, number_text);
  }

  /// A bare number of `doubted_m` metres and more gets a note.
  double length_m(const Range& range, double doubted_m = least_doubted_m) const {
    auto value = node->is_number() ? node->value<double>() : std::nullopt;
    if (const auto* text = node->as_string()) {
      const double length_m = parse_length_m(text->get(), where());
      value = bare_number(text->get());
      if (!value) return checked(length_m, range, length_text);
    }
    if (!value) fail("a length: a number in metres, or a string such as \"3.74 um\"");
    const auto with_unit = in_quotes(number_text(*value) + " " + usual_unit(label));
    if (*value > range.max && std::isfinite(*value))
      fail(range_text(range, *value, length_text) + " (numbers are metres; " + with_unit +
           " has a unit of its own)");
    if (std::abs(checked(*value, range, length_text)) >= doubted_m)
      note("lengths without a unit are metres; give " + with_unit + " if " + length_text(*value) +
           " is not meant");
    return *value;
  }

  template <class Integer = int>
  Integer integer(Integer min, Integer max) const {
    const auto* value = node->as_integer();
    const std::string range = std::to_string(min) + " to " + std::to_string(max);
    if (!value) fail("a whole number, " + range);
    if (value->get() < std::int64_t{min} || value->get() > std::int64_t{max}) fail(range);
    return static_cast<Integer>(value->get());
  }

  bool boolean() const {
    if (!node->is_boolean()) fail("true or false");
    return node->as_boolean()->get();
  }

  const std::string& string(const char* must_be) const {
    if (!node->is_string()) fail(must_be);
    return node->as_string()->get();
  }

  template <class Enum>
  Enum choice(const std::vector<std::pair<const char*, Enum>>& choices) const {
    std::string names;
    for (const auto& [name, value] : choices) {
      if (node->is_string() && node->as_string()->get() == name) return value;
      names += (names.empty() ? "" : " or ") + in_quotes(name);
    }
    fail(names);
  }

  /// A file named relative to the scene file, or to the current folder where the scene is piped.
  /// That it can be opened is for its reader to find out.
  std::filesystem::path existing_file() const {
    const std::string& name = string("the name of a file");
    if (name.empty() || name.find('\0') != std::string::npos) fail("the name of a file");
    const std::filesystem::path file = document->folder / name;
    std::error_code error;
    if (!std::filesystem::is_regular_file(file, error))
      fail("a file (there is none at " + in_quotes(file.string()) + ")");
    return file;
  }

  bool is(std::string_view text) const {
    return node->is_string() && node->as_string()->get() == text;
  }
  bool is_array() const { return node->is_array(); }

  /// A node in this one, of which messages speak as of this one.
  Value part(const toml::node& inner) const { return {document, &inner, path, label}; }

  /// An element of an array: "slm: lut[3]".
  Value element(std::size_t i) const {
    return {document, node->as_array()->get(i), path, label + "[" + std::to_string(i) + "]"};
  }

  /// `[a, b]` or `[a, b, c]`, each element converted; `shape` is what the message asks for.
  template <class Vector, class Convert>
  Vector vector(const char* shape, Convert convert) const {
    const auto* array = node->as_array();
    if (!array || array->size() != static_cast<std::size_t>(Vector::length())) fail(shape);
    Vector result;
    for (int i = 0; i < Vector::length(); ++i) result[i] = convert(element(std::size_t(i)));
    return result;
  }

  template <class Vector>
  Vector numbers(const char* shape, const Range& range) const {
    return vector<Vector>(shape, [&](const Value& v) { return v.number(range); });
  }
  template <class Vector>
  Vector lengths_m(const char* shape, const Range& range) const {
    return vector<Vector>(shape, [&](const Value& v) { return v.length_m(range); });
  }
  glm::dvec3 numbers(const Range& range) const {
    return numbers<glm::dvec3>("three numbers [x, y, z]", range);
  }
  glm::dvec3 lengths_m(const Range& range) const {
    return lengths_m<glm::dvec3>("three lengths [x, y, z]", range);
  }
  glm::dvec3 direction() const {
    const auto v = numbers(between(-1e6, 1e6));
    if (glm::length(v) < 1e-9) fail("longer than 0");
    return v;
  }
  /// A length, or an array of them.
  ///
  /// check  is passed the value of each, and the lengths up to it
  template <class Check>
  std::vector<double> list_of_lengths_m(const Range& range, int most, Check check) const {
    if (!is_array()) return {length_m(range)};
    std::vector<double> lengths;
    for (std::size_t i = 0; i < node->as_array()->size(); ++i) {
      const Value one = element(i);
      lengths.push_back(one.length_m(range));
      check(one, lengths);
    }
    if (lengths.empty() || lengths.size() > static_cast<std::size_t>(most))
      fail("a length, or 1 to " + std::to_string(most) + " of them");
    return lengths;
  }
  std::vector<double> ascending_lengths_m(const Range& range, int most) const {
    return list_of_lengths_m(range, most, [](const Value& one, const auto& lengths) {
      if (const auto i = lengths.size() - 1; i > 0 && !(lengths[i] > lengths[i - 1]))
        one.fail("more than the one before, " + length_text(lengths[i - 1]));
    });
  }
  glm::dvec3 colour(const Range& range) const {
    if (node->is_number()) return glm::dvec3(number(range));
    return numbers<glm::dvec3>("a number or [red, green, blue]", range);
  }
  glm::ivec2 integers(int max) const {
    return vector<glm::ivec2>("two whole numbers [x, y]",
                              [&](const Value& v) { return v.integer(1, max); });
  }

private:
  double checked(double value, const Range& range, std::string (*format)(double)) const {
    if (!(value >= range.min && value <= range.max))  // NaN too
      fail(range_text(range, value, format));
    return value;
  }
};

/// One table of the scene. Each `read` names a key that the table may have; `finish` refuses all
/// others.
class Section {
public:
  Section(const Document& document, const toml::table& table, std::string path, std::string label)
      : document_(document), table_(table), path_(std::move(path)), label_(std::move(label)) {}

  /// Passes the value of `key` to `use`; without the key, nothing happens and the default stands.
  template <class Use>
  bool read(std::string_view key, Use use) {
    known_.push_back(key);
    const toml::node* node = table_.get(key);
    if (node) use(value(key, *node));
    return node != nullptr;
  }

  template <class Use>
  void require(std::string_view key, const char* what, Use use) {
    if (!read(key, use)) fail(std::string(key) + " is missing: give " + what);
  }

  /// Throws an InputError about the table as a whole.
  [[noreturn]] void fail(const std::string& what) const { throw InputError(where() + ": " + what); }

  /// "scene.toml:41: object 0"; "--set object.0.mesh=pot.ply: object 0" where that gave `key`.
  std::string where(std::string_view key = "") const {
    const bool is_given = document_.overrides.contains(join(key));
    return document_.where(table_, is_given ? join(key) : path_) +
           (label_.empty() ? "" : ": " + label_);
  }

  /// The table `key`, or an empty one.
  Section section(std::string_view key) {
    static const toml::table none;
    const toml::table* table = &none;
    read(key, [&](const Value& v) {
      if (!v.node->is_table()) v.fail("a table, [" + std::string(key) + "]");
      table = v.node->as_table();
    });
    return {document_, *table, join(key), (label_.empty() ? "" : label_ + ": ") + std::string(key)};
  }

  /// The tables of `[[key]]`, labelled "key 0", "key 1" ...
  std::vector<Section> sections(std::string_view key) {
    std::vector<Section> all;
    read(key, [&](const Value& v) {
      if (!v.node->is_array_of_tables() && !(v.is_array() && v.node->as_array()->empty()))
        v.fail("an array of tables, each headed [[" + std::string(key) + "]]");
      for (const toml::node& node : *v.node->as_array()) {
        const std::string index = std::to_string(all.size());
        all.emplace_back(document_, *node.as_table(), v.path + "." + index,
                         std::string(key) + " " + index);
      }
    });
    return all;
  }

  /// The tables inside this one, by name: [materials.gold].
  std::vector<std::pair<std::string, Section>> named_sections(const std::string& label) const {
    std::vector<std::pair<std::string, Section>> all;
    for (const auto& [key, node] : table_) {
      const std::string name(key.str());
      if (!node.is_table()) value(name, node).fail("a table, [" + path_ + ".NAME]");
      all.emplace_back(name, Section(document_, *node.as_table(), path_ + "." + name,
                                     label + " " + in_quotes(name)));
    }
    return all;
  }

  void finish() const {
    for (const auto& [key, node] : table_) {
      const std::string_view name = key.str();
      if (std::find(known_.begin(), known_.end(), name) != known_.end()) continue;
      const auto nearest = std::min_element(known_.begin(), known_.end(), [&](auto a, auto b) {
        return edit_distance(a, name) < edit_distance(b, name);
      });
      std::string keys;
      for (const std::string_view known : known_)
        keys += (keys.empty() ? "" : ", ") + std::string(known);
      throw InputError(document_.where(node, join(name)) + ": " +
                       (label_.empty() ? "" : label_ + ": ") + "unknown key " + in_quotes(name) +
                       (edit_distance(*nearest, name) <= 2
                            ? "; did you mean " + in_quotes(*nearest) + "?"
                            : "") +
                       " (keys here: " + keys + ")");
    }
  }

private:
  std::string join(std::string_view key) const {
    return path_.empty() ? std::string(key) : path_ + "." + std::string(key);
  }
  Value value(std::string_view key, const toml::node& node) const {
    std::string name = one_line(key);
    return {&document_, &node, join(key), label_.empty() ? name : label_ + ": " + name};
  }

  const Document& document_;
  const toml::table& table_;
  std::string path_, label_;
  std::vector<std::string_view> known_;
};

/// Parses a text and applies the overrides (load_scenes).
///
/// throws  InputError: one line with file and line
Document parse_document(const SceneText& text, const std::vector<std::string>& overrides);

}  // namespace raywave
