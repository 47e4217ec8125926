// SPDX-License-Identifier: Apache-2.0
#include "host/scene/scene.hpp"

#include <toml++/toml.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <glm/geometric.hpp>
#include <initializer_list>
#include <iterator>
#include <limits>
#include <map>
#include <numeric>
#include <span>
#include <utility>

#include "host/common/error.hpp"
#include "host/common/text.hpp"

namespace raywave {
namespace {

constexpr std::uintmax_t kMaxSceneBytes = 1 << 20;
// Each dot of a dotted key nests a table, and the parser frees tables by recursion
constexpr int kMaxDotsPerLine = 32;

/// Allowed range of a number.
struct Range {
  double min, max;
  bool one_sided = false;  // max is only the limit of float, which messages omit
};
constexpr double kLargest = 1e30;  // leaves room to multiply in float
constexpr Range between(double min, double max) { return {min, max}; }
constexpr Range at_least(double min) { return {min, kLargest, true}; }

/// Keys that have another name now; the old one works until the next version.
struct RenamedKey {
  std::string_view section, old_name, name;
  std::string old_path() const { return std::string(section) + "." + std::string(old_name); }
  std::string path() const { return std::string(section) + "." + std::string(name); }
};
constexpr RenamedKey kRenamedKeys[] = {
    {"sampling", "fan", "cone"}, {"sampling", "edge", "apodization"}, {"wrp", "slabs", "layers"}};

constexpr Range kAnyPosition = between(-1e4, 1e4);
constexpr int kMostLayers = 16;

bool contains(const Range& range, double value) {
  return value >= range.min && value <= range.max;  // false for NaN
}

/// "1 to 8", ">= 0"; for a one-sided range only the bound that the value violates.
std::string text(const Range& range, double value, std::string (*format)(double)) {
  if (!range.one_sided) return format(range.min) + " to " + format(range.max);
  if (value > range.max) return "<= " + format(range.max);
  return ">= " + format(range.min);
}

std::string describe(const toml::node& node) {
  if (const auto* text = node.as_string()) return in_quotes(text->get());
  if (const auto* integer = node.as_integer()) return std::to_string(integer->get());
  if (const auto* number = node.as_floating_point()) return number_text(number->get());
  if (const auto* boolean = node.as_boolean()) return boolean->get() ? "true" : "false";
  if (const auto* array = node.as_array()) return "an array of " + std::to_string(array->size());
  return node.is_table() ? "a table" : "a date or time";
}

/// The parsed file with the overrides in place. Paths name a node as --set does: "wrp.padding",
/// "object.0.width".
struct Document {
  std::filesystem::path file;
  toml::table root;
  std::map<std::string, std::string, std::less<>> overrides;  // path -> the override as given
  std::map<std::string, std::string, std::less<>> old_names;  // path -> the key's old name, if used
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

/// One value of the scene: converts itself, or says where it is and what it must be.
struct Value {
  const Document* document;
  const toml::node* node;
  std::string path;   // "materials.gold.shininess"
  std::string label;  // "material "gold": shininess"

  [[noreturn]] void fail(const std::string& must_be) const {
    throw InputError(document->where(*node, path) + ": " + label + " must be " + must_be +
                     ", got " + describe(*node));
  }

  /// Leaves a note that starts with the value's place.
  void note(const std::string& what) const {
    document->notes.push_back(document->where(*node, path) + ": " + label + ": " + what);
  }

  double number(const Range& range) const {
    const auto value = node->value<double>();
    if (!node->is_number() || !value) fail("a number");
    return checked(*value, range, number_text);
  }

  double length_m(const Range& range) const {
    if (const auto* text = node->as_string())
      return checked(parse_length_m(text->get(), document->where(*node, path) + ": " + label),
                     range, length_text);
    const auto value = node->value<double>();
    if (!node->is_number() || !value)
      fail("a length: a number in metres, or a string such as \"3.74 um\"");
    return checked(*value, range, length_text);
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
  Enum choice(std::initializer_list<std::pair<const char*, Enum>> choices) const {
    std::string names;
    for (const auto& [name, value] : choices) {
      if (node->is_string() && node->as_string()->get() == name) return value;
      names += (names.empty() ? "" : " or ") + in_quotes(name);
    }
    fail(names);
  }

  /// A file named relative to the scene file. That it can be opened is for its reader to find out.
  std::filesystem::path existing_file() const {
    const std::string& name = string("the name of a file");
    if (name.empty() || name.find('\0') != std::string::npos) fail("the name of a file");
    const std::filesystem::path file = document->file.parent_path() / name;
    std::error_code error;
    if (!std::filesystem::is_regular_file(file, error))
      fail("a file (there is none at " + in_quotes(file.string()) + ")");
    return file;
  }

  bool is(std::string_view text) const {
    return node->is_string() && node->as_string()->get() == text;
  }
  bool is_auto() const { return is("auto"); }
  bool is_array() const { return node->is_array(); }

  /// `[a, b]` or `[a, b, c]`, each element converted; `shape` is what the message asks for.
  template <class Vector, class Convert>
  Vector vector(const char* shape, Convert convert) const {
    const auto* array = node->as_array();
    if (!array || array->size() != static_cast<std::size_t>(Vector::length())) fail(shape);
    Vector result;
    for (int i = 0; i < Vector::length(); ++i)
      result[i] = convert(Value{document, array->get(static_cast<std::size_t>(i)), path,
                                label + "[" + std::to_string(i) + "]"});
    return result;
  }

  glm::dvec3 numbers(const Range& range) const {
    return vector<glm::dvec3>("three numbers [x, y, z]",
                              [&](const Value& v) { return v.number(range); });
  }
  glm::dvec3 lengths_m(const Range& range) const {
    return vector<glm::dvec3>("three lengths [x, y, z]",
                              [&](const Value& v) { return v.length_m(range); });
  }
  /// A length, or an array of them.
  std::vector<double> ascending_lengths_m(const Range& range, int most) const {
    if (!is_array()) return {length_m(range)};
    const auto& array = *node->as_array();
    std::vector<double> lengths;
    for (std::size_t i = 0; i < array.size(); ++i) {
      const Value one{document, array.get(i), path, label + "[" + std::to_string(i) + "]"};
      lengths.push_back(one.length_m(range));
      if (i > 0 && !(lengths[i] > lengths[i - 1]))
        one.fail("more than the one before, " + length_text(lengths[i - 1]));
    }
    if (lengths.empty() || lengths.size() > static_cast<std::size_t>(most))
      fail("a length, or 1 to " + std::to_string(most) + " of them");
    return lengths;
  }
  glm::dvec3 colour(const Range& range) const {
    if (node->is_number()) return glm::dvec3(number(range));
    return vector<glm::dvec3>("a number or [red, green, blue]",
                              [&](const Value& v) { return v.number(range); });
  }
  glm::ivec2 integers(int max) const {
    return vector<glm::ivec2>("two whole numbers [x, y]",
                              [&](const Value& v) { return v.integer(1, max); });
  }

private:
  double checked(double value, const Range& range, std::string (*format)(double)) const {
    if (!contains(range, value)) fail(text(range, value, format));
    return value;
  }
};

/// Edit distance, to suggest the key that was meant.
std::size_t distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < b.size(); ++j)
      diagonal = std::exchange(row[j + 1],
                               std::min({diagonal + (a[i] != b[j]), row[j] + 1, row[j + 1] + 1}));
  }
  return row.back();
}

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

  /// "scene.toml:41: object 0"
  std::string where() const {
    return document_.where(table_, path_) + (label_.empty() ? "" : ": " + label_);
  }

  /// The table `key`, or an empty one.
  Section section(std::string_view key) {
    static const toml::table none;
    const toml::table* table = &none;
    read(key, [&](const Value& v) {
      if (!v.node->is_table()) v.fail("a table, [" + std::string(key) + "]");
      table = v.node->as_table();
    });
    return {document_, *table, std::string(key), std::string(key)};
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
        return distance(a, name) < distance(b, name);
      });
      std::string keys;
      for (const std::string_view known : known_)
        keys += (keys.empty() ? "" : ", ") + std::string(known);
      throw InputError(
          document_.where(node, join(name)) + ": " + (label_.empty() ? "" : label_ + ": ") +
          "unknown key " + in_quotes(name) +
          (distance(*nearest, name) <= 2 ? "; did you mean " + in_quotes(*nearest) + "?" : "") +
          " (keys here: " + keys + ")");
    }
  }

private:
  std::string join(std::string_view key) const {
    return path_.empty() ? std::string(key) : path_ + "." + std::string(key);
  }
  Value value(std::string_view key, const toml::node& node) const {
    std::string name = one_line(key);
    if (const auto old = document_.old_names.find(join(key)); old != document_.old_names.end())
      name += " (old name: " + old->second + ")";
    return {&document_, &node, join(key), label_.empty() ? name : label_ + ": " + name};
  }

  const Document& document_;
  const toml::table& table_;
  std::string path_, label_;
  std::vector<std::string_view> known_;
};

HologramSpec read_hologram(Section section) {
  HologramSpec spec;
  section.read("resolution", [&](const Value& v) { spec.resolution = v.integers(65536); });
  section.read("pitch", [&](const Value& v) {
    const auto length = [](const Value& one) { return one.length_m(between(1e-10, 1)); };
    spec.pitch_m = v.is_array() ? v.vector<glm::dvec2>("a length or two [x, y]", length)
                                : glm::dvec2(length(v));
  });
  section.read("wavelength",
               [&](const Value& v) { spec.wavelength_m = v.length_m(between(1e-9, 1e-2)); });
  section.read("tiles", [&](const Value& v) {
    if (!v.is_auto()) spec.tiles = v.integers(64);
  });
  section.finish();
  return spec;
}

WrpSpec read_wrp(Section section) {
  WrpSpec spec;
  section.read("grid", [&](const Value& v) {
    if (!v.is_auto()) spec.grid = v.integers(1024);
  });
  section.read("distance", [&](const Value& v) {
    if (!v.is_auto()) spec.distances_m = v.ascending_lengths_m(between(1e-9, 1e4), kMostLayers);
    spec.layers = std::max(1, static_cast<int>(spec.distances_m.size()));
  });
  section.read("layers", [&](const Value& v) {
    if (v.is_auto()) return;
    const int layers = v.integer(1, kMostLayers);
    if (!spec.distances_m.empty() && layers != spec.layers)
      v.fail("the number of distances given, " + std::to_string(spec.layers));
    spec.layers = layers;
  });
  section.read("padding", [&](const Value& v) {
    if (!v.is_auto()) spec.padding = v.number(between(1, 8));
  });
  section.read("oversampling", [&](const Value& v) {
    if (!v.is_auto() && !v.is("full")) spec.oversampling = v.number(between(1.1, 100));
  });
  section.finish();
  return spec;
}

SamplingSpec read_sampling(Section section) {
  SamplingSpec spec;
  section.read("mode", [&](const Value& v) {
    spec.mode =
        v.choice<SamplingMode>({{"aimed", SamplingMode::aimed}, {"fan", SamplingMode::fan}});
  });
  section.read("pitch", [&](const Value& v) {
    if (!v.is_auto()) spec.pitch_m = v.length_m(between(1e-9, 1));
  });
  section.read("cone", [&](const Value& v) {
    if (!v.is_auto()) spec.cone = v.number(between(0.01, 4));
  });
  section.read("apodization", [&](const Value& v) {
    if (v.is_auto()) return;
    spec.apodization = v.number(between(0, 4));
    if (spec.apodization > spec.cone) v.fail("<= cone (" + number_text(spec.cone) + ")");
  });
  section.read("antialias", [&](const Value& v) {
    spec.antialias = v.integer(0, 4);
    if (spec.antialias % 2 != 0) v.fail("0, 2 or 4");
  });
  section.read("visibility", [&](const Value& v) {
    spec.visibility = v.integer(0, 16);
    if (spec.visibility != 0 && spec.visibility != 4 && spec.visibility != 8 &&
        spec.visibility != 16)
      v.fail("0, 4, 8 or 16");
  });
  section.read("source", [&](const Value& v) {
    spec.source = v.choice<FanSource>({{"hit", FanSource::hit}, {"surface", FanSource::surface}});
  });
  section.read("shape", [&](const Value& v) {
    spec.shape = v.choice<FanShape>(
        {{"orthographic", FanShape::orthographic}, {"perspective", FanShape::perspective}});
  });
  section.read("seed", [&](const Value& v) {
    spec.seed = v.integer<std::uint32_t>(0, std::numeric_limits<std::uint32_t>::max());
  });
  section.read("frames", [&](const Value& v) {
    if (!v.is_auto()) spec.frames = v.integer(1, 4096);
  });
  section.finish();
  return spec;
}

TraceSpec read_trace(Section section) {
  TraceSpec spec;
  section.read("depth", [&](const Value& v) { spec.depth = v.integer(0, 16); });
  section.read("shadows", [&](const Value& v) { spec.shadows = v.boolean(); });
  section.finish();
  return spec;
}

AccuracySpec read_accuracy(Section section) {
  AccuracySpec spec;
  section.read("precision", [&](const Value& v) {
    if (v.is("extended")) {  // a choice of raywave 0.1, never much more accurate than "float"
      v.note("\"extended\" is no longer a choice; \"float\" takes its place");
      spec.precision = Precision::floats;
      return;
    }
    spec.precision = v.choice<std::optional<Precision>>(
        {{"auto", std::nullopt}, {"float", Precision::floats}, {"double", Precision::doubles}});
  });
  section.read("phase", [&](const Value& v) { spec.phase_turns = v.number(between(1e-9, 0.5)); });
  section.finish();
  return spec;
}

ViewerSpec read_viewer(Section section) {
  ViewerSpec spec;
  section.read("distance", [&](const Value& v) { spec.distance_m = v.length_m(between(0, 1e4)); });
  section.read("resolution", [&](const Value& v) {
    if (!v.is_auto()) spec.resolution_m = v.length_m(between(1e-9, 1));
  });
  section.finish();
  return spec;
}

/// Keys that have a value other than "auto": "sampling.pitch" ...
std::set<std::string, std::less<>> given_keys(const toml::table& root) {
  std::set<std::string, std::less<>> keys;
  for (const auto& [section, node] : root) {
    if (!node.is_table()) continue;
    for (const auto& [key, value] : *node.as_table()) {
      const auto* text = value.as_string();
      if (!text || text->get() != "auto")
        keys.insert(std::string(section.str()) + "." + std::string(key.str()));
    }
  }
  return keys;
}

Light read_light(Section section) {
  Light light;
  section.read("type", [&](const Value& v) {
    light.type = v.choice<LightType>({{"ambient", LightType::ambient},
                                      {"directional", LightType::directional},
                                      {"point", LightType::point}});
  });
  section.read("intensity", [&](const Value& v) { light.intensity = v.number(at_least(0)); });
  if (light.type == LightType::directional)
    section.require("direction", "the way the light travels, for example [0, 0, 1]",
                    [&](const Value& v) {
                      light.direction = v.numbers(between(-1e6, 1e6));
                      if (glm::length(light.direction) < 1e-9) v.fail("longer than 0");
                    });
  if (light.type == LightType::point)
    section.require("position", "the light's place, for example [\"0 mm\", \"50 mm\", \"20 mm\"]",
                    [&](const Value& v) { light.position_m = v.lengths_m(kAnyPosition); });
  section.finish();
  return light;
}

Material read_material(const std::string& name, Section section) {
  Material material;
  material.name = name;
  material.where = section.where();
  section.read("ambient", [&](const Value& v) { material.ambient = v.colour(at_least(0)); });
  section.read("diffuse", [&](const Value& v) { material.diffuse = v.colour(at_least(0)); });
  section.read("specular", [&](const Value& v) { material.specular = v.colour(at_least(0)); });
  section.read("shininess", [&](const Value& v) { material.shininess = v.number(at_least(0)); });
  section.read("texture", [&](const Value& v) { material.texture = v.existing_file(); });
  section.read("reflectivity",
               [&](const Value& v) { material.reflectivity = v.number(between(0, 1)); });
  section.read("transparency", [&](const Value& v) {
    material.transparency = v.number(between(0, 1));
    if (material.reflectivity + material.transparency > 1 + 1e-9)
      v.fail("<= 1 - reflectivity (" + number_text(material.reflectivity) + ")");
  });
  section.read("ior", [&](const Value& v) { material.ior = v.number(between(1, 100)); });
  section.finish();
  return material;
}

int find_material(const Value& v, const std::vector<Material>& materials) {
  const std::string& name = v.string("the name of a material");
  std::string names;
  for (std::size_t i = 1; i < materials.size(); ++i) {  // [0] is the nameless default
    if (materials[i].name == name) return static_cast<int>(i);
    names += (names.empty() ? "" : ", ") + materials[i].name;
  }
  v.fail(names.empty() ? "one of [materials.NAME], of which there is none"
                       : "one of " + one_line(names));
}

Object read_object(Section section, const std::vector<Material>& materials) {
  Object object;
  object.where = section.where();
  section.require("mesh", "the name of a mesh file",
                  [&](const Value& v) { object.mesh = v.existing_file(); });
  section.read("width", [&](const Value& v) { object.width_m = v.length_m(between(1e-9, 1e4)); });
  section.read("position", [&](const Value& v) { object.position_m = v.lengths_m(kAnyPosition); });
  section.read("rotation",
               [&](const Value& v) { object.rotation_deg = v.numbers(between(-1e6, 1e6)); });
  section.read("material", [&](const Value& v) { object.material = find_material(v, materials); });
  section.read("normals", [&](const Value& v) {
    object.normals = v.choice<Normals>(
        {{"file", Normals::file}, {"smooth", Normals::smooth}, {"flat", Normals::flat}});
  });
  section.finish();
  return object;
}

std::string read_text(const std::filesystem::path& file) {
  const std::string name = one_line(file.string());
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error))
    throw InputError(name + ": there is no such file");
  if (std::filesystem::file_size(file, error) > kMaxSceneBytes || error)
    throw InputError(name + ": too large for a scene file (at most 1 MiB)");
  std::ifstream stream(file, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(stream), {}};
  if (!stream) throw InputError(name + ": cannot be read");
  return text;
}

/// Refuses `a.a.a.a. ... = 1`, whose tables would nest deeper than the parser's recursion can free.
void refuse_deep_keys(std::string_view text, const std::string& name) {
  for (int line = 1; !text.empty(); ++line) {
    const std::string_view rest = text.substr(0, text.find('\n'));
    const auto first = rest.find_first_not_of(" \t");
    const bool is_comment = first != std::string_view::npos && rest[first] == '#';
    if (!is_comment && std::count(rest.begin(), rest.end(), '.') > kMaxDotsPerLine)
      throw InputError(name + ":" + std::to_string(line) + ": more than " +
                       std::to_string(kMaxDotsPerLine) + " dots in one line");
    text.remove_prefix(std::min(text.size(), rest.size() + 1));
  }
}

/// Parses the value as TOML; a text that is not TOML, such as `auto` or `8 um`, becomes a string.
void assign(toml::table& table, std::string_view key, const std::string& text) {
  toml::table parsed;
  try {
    if (std::count(text.begin(), text.end(), '.') <= kMaxDotsPerLine)
      parsed = toml::parse("value = " + text);
  } catch (const toml::parse_error&) {
    parsed.clear();
  }
  if (parsed.size() != 1 || !parsed.contains("value")) parsed.insert_or_assign("value", text);
  parsed.get("value")->visit([&](auto& value) { table.insert_or_assign(key, std::move(value)); });
}

std::string renamed_note(const std::string& where, const RenamedKey& key) {
  return where + ": " + key.old_path() + " is now called " + key.path() +
         "; the old name works until the next version";
}

/// Gives the file's keys their names of today.
///
/// throws  InputError when a key is there under both names
void rename_old_keys(Document& document) {
  for (const RenamedKey& key : kRenamedKeys) {
    toml::node* const node = document.root.get(key.section);
    toml::table* const section = node ? node->as_table() : nullptr;
    toml::node* const old = section ? section->get(key.old_name) : nullptr;
    if (!old) continue;
    const std::string where = document.where(*old, key.old_path());
    if (const toml::node* both = section->get(key.name))
      throw InputError(where + ": " + key.old_path() + " is the old name of " + key.path() +
                       ", which is given, too (" + document.where(*both, key.path()) +
                       "); keep one of them");
    document.notes.push_back(renamed_note(where, key));
    document.old_names[key.path()] = key.old_name;
    old->visit([&](auto& value) { section->insert_or_assign(key.name, std::move(value)); });
    section->erase(key.old_name);
  }
}

/// "sampling.cone=1" of "sampling.fan=1", with a note; any other override as it is.
std::string with_new_name(Document& document, const std::string& text) {
  for (const RenamedKey& key : kRenamedKeys) {
    const std::string old_start = key.old_path() + "=";
    if (text.starts_with(key.path() + "=")) document.old_names.erase(key.path());
    if (!text.starts_with(old_start)) continue;
    document.notes.push_back(renamed_note("--set " + one_line(text), key));
    document.old_names[key.path()] = key.old_name;
    return key.path() + "=" + text.substr(old_start.size());
  }
  return text;
}

/// text  as the user gave it
void apply_override(Document& document, const std::string& text) {
  const std::string renamed = with_new_name(document, text);
  const auto fail = [&](const std::string& what) {
    throw InputError("--set " + one_line(text) + ": " + what);
  };
  const auto equals = renamed.find('=');
  if (equals == std::string::npos || equals == 0)
    fail("must be section.key=value, for example wrp.padding=1.25");
  const std::string path = renamed.substr(0, equals);
  if (std::count(path.begin(), path.end(), '.') > 3) fail("names no key of a scene");

  toml::node* node = &document.root;
  for (std::string_view rest = path;;) {
    const auto dot = rest.find('.');
    const std::string_view key = rest.substr(0, dot);
    const bool is_last = dot == std::string_view::npos;
    if (key.empty()) fail("must be section.key=value, for example wrp.padding=1.25");

    if (toml::table* table = node->as_table()) {
      if (is_last) {
        assign(*table, key, renamed.substr(equals + 1));
        break;
      }
      node = table->get(key);
      if (!node && table == &document.root) node = &table->insert(key, toml::table{}).first->second;
      if (!node)
        fail("the scene has no " +
             in_quotes(path.substr(0, path.size() - rest.size() + key.size())));
    } else if (toml::array* array = node->as_array(); array && !is_last) {
      std::size_t index = array->size();
      const auto [end, error] = std::from_chars(key.data(), key.data() + key.size(), index);
      if (error != std::errc() || end != key.data() + key.size() || index >= array->size())
        fail("there are " + std::to_string(array->size()) + ", counted from 0, so " +
             in_quotes(key) + " is none of them");
      node = array->get(index);
    } else {
      fail("names no key of a scene");
    }
    rest.remove_prefix(dot + 1);
  }
  document.overrides[path] = text;
}

Document read_document(const std::filesystem::path& file,
                       const std::vector<std::string>& overrides) {
  Document document;
  document.file = file;
  const std::string name = one_line(file.string());
  const std::string text = read_text(file);
  refuse_deep_keys(text, name);
  try {
    document.root = toml::parse(text);
  } catch (const toml::parse_error& error) {
    throw InputError(name + ":" + std::to_string(error.source().begin.line) + ": " +
                     one_line(error.description()));
  }
  rename_old_keys(document);
  for (const std::string& one : overrides) apply_override(document, one);
  rename_old_keys(document);  // of sections that an override gives whole
  return document;
}

struct Unit {
  std::string_view name;
  double in_base;
};

/// "3.74 um" as 3.74e-6; empty when the unit is not among `units`.
std::optional<double> in_base_unit(std::string_view text, std::span<const Unit> units) {
  const auto trim = [](std::string_view s) {
    const auto first = s.find_first_not_of(' ');
    return first == std::string_view::npos ? std::string_view{}
                                           : s.substr(first, s.find_last_not_of(' ') - first + 1);
  };
  const std::string_view trimmed = trim(text);
  double number = 0;
  const auto [end, error] =
      std::from_chars(trimmed.data(), trimmed.data() + trimmed.size(), number);
  if (error != std::errc() || !std::isfinite(number)) return {};
  const std::string_view unit =
      trim(trimmed.substr(static_cast<std::size_t>(end - trimmed.data())));
  for (const auto& one : units)
    if (one.name == unit) return number * one.in_base;
  return {};
}

}  // namespace

Scene load_scene(const std::filesystem::path& file, const std::vector<std::string>& overrides) {
  const Document document = read_document(file, overrides);
  Section root(document, document.root, "", "");

  Scene scene;
  scene.file = file;
  scene.hologram = read_hologram(root.section("hologram"));
  scene.wrp = read_wrp(root.section("wrp"));
  scene.sampling = read_sampling(root.section("sampling"));
  scene.trace = read_trace(root.section("trace"));
  scene.accuracy = read_accuracy(root.section("accuracy"));
  scene.viewer = read_viewer(root.section("viewer"));
  scene.given = given_keys(document.root);
  for (Section& section : root.sections("light")) scene.lights.push_back(read_light(section));
  scene.materials.emplace_back();
  for (auto& [name, section] : root.section("materials").named_sections("material"))
    scene.materials.push_back(read_material(name, section));
  for (Section& section : root.sections("object"))
    scene.objects.push_back(read_object(section, scene.materials));
  root.finish();
  scene.notes = document.notes;

  const std::string name = one_line(file.string());
  if (scene.objects.empty())
    throw InputError(name + ": there is no object: add [[object]] with mesh = \"FILE\"");
  if (scene.lights.empty())
    throw InputError(name + ": there is no light: add [[light]] with direction = [0, 0, 1]");
  return scene;
}

double parse_length_m(std::string_view text, std::string_view what) {
  constexpr Unit units[] = {{"", 1},      {"m", 1},     {"cm", 1e-2},
                            {"mm", 1e-3}, {"um", 1e-6}, {"nm", 1e-9}};
  if (const auto length = in_base_unit(text, units)) return *length;
  throw InputError(
      std::string(what) +
      " must be a length such as \"3.74 um\" (units: nm, um, mm, cm, m; none for metres), got " +
      in_quotes(text));
}

double parse_seconds(std::string_view text, std::string_view what) {
  constexpr Unit units[] = {{"", 1}, {"s", 1}, {"ms", 1e-3}, {"us", 1e-6}};
  if (const auto time = in_base_unit(text, units); time && *time > 0) return *time;
  throw InputError(std::string(what) +
                   " must be a time such as \"30 ms\" (units: us, ms, s; none for seconds), got " +
                   in_quotes(text));
}

int channel_of(double wavelength_m) {
  if (wavelength_m >= 580e-9) return 0;
  return wavelength_m >= 490e-9 ? 1 : 2;
}

}  // namespace raywave
