// SPDX-License-Identifier: Apache-2.0
#include "host/scene/read_slm.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <map>
#include <numbers>
#include <optional>

#include "host/scene/document.hpp"
#include "host/scene/units.hpp"

namespace raywave {
namespace {

constexpr std::uintmax_t most_lut_bytes = 1 << 20;
// A turn of phase changes by about as large a share as the wavelength: 1 nm of visible light is a
// quarter of a percent, or half a level
constexpr double lut_reach_m = 1e-9;

/// Numbers of a line, between spaces, commas, semicolons or tabs.
///
/// throws  InputError starting with `where`
std::vector<double> numbers_of(std::string_view line, const std::string& where) {
  constexpr std::string_view separators = " \t,;\r";
  std::vector<double> numbers;
  for (line = line.substr(0, line.find('#'));;) {
    const auto first = line.find_first_not_of(separators);
    if (first == std::string_view::npos) return numbers;
    line.remove_prefix(first);
    const auto word = line.substr(0, line.find_first_of(separators));
    double number = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(number))
      throw InputError(where + ": " + in_quotes(word) + " is no number");
    numbers.push_back(number);
    line.remove_prefix(word.size());
  }
}

/// A file of a number for each level, or of a line for each with level and number.
std::vector<double> load_lut(const std::filesystem::path& file, std::size_t levels) {
  const std::string name = one_line(file.string());
  std::error_code error;
  if (std::filesystem::file_size(file, error) > most_lut_bytes || error)
    throw InputError(name + ": too large for a LUT (at most 1 MiB)");
  std::ifstream stream(file);
  std::vector<double> lut;
  bool two_columns = false;
  int line_number = 0;
  for (std::string line; std::getline(stream, line);) {
    const std::string where = name + ":" + std::to_string(++line_number);
    const auto numbers = numbers_of(line, where);
    if (numbers.empty()) continue;
    if (lut.empty()) two_columns = numbers.size() == 2;
    if (!two_columns) {
      lut.insert(lut.end(), numbers.begin(), numbers.end());
      continue;
    }
    if (numbers.size() != 2)
      throw InputError(where + ": two columns expected, level and phase, got " +
                       std::to_string(numbers.size()));
    if (numbers[0] != static_cast<double>(lut.size()))
      throw InputError(where + ": level " + std::to_string(lut.size()) + " expected, got " +
                       number_text(numbers[0]));
    lut.push_back(numbers[1]);
  }
  if (lut.size() != levels)
    throw InputError(name + ": a LUT has a number for each of " + std::to_string(levels) +
                     " levels, got " + std::to_string(lut.size()));
  return lut;
}

/// throws  InputError at the first level where the LUT turns back
void require_monotone(const std::vector<double>& lut, const Value& v) {
  const bool rises = lut[1] > lut[0];
  for (std::size_t i = 1; i < lut.size(); ++i) {
    if (lut[i] == lut[i - 1] || (lut[i] > lut[i - 1]) != rises)
      throw InputError(v.document->where(*v.node, v.path) + ": " + v.label +
                       " must rise or fall from level to level; level " + std::to_string(i) +
                       " shows " + number_text(lut[i]) + " after " + number_text(lut[i - 1]));
  }
}

/// The LUT of a value: a number for each level, or the name of a file that holds them.
std::vector<double> lut_of(const Value& v, std::size_t levels) {
  std::vector<double> lut;
  if (v.is_array()) {
    for (const auto& node : *v.node->as_array())
      lut.push_back(Value{v.document, &node, v.path, v.label}.number(between(-1e6, 1e6)));
    if (lut.size() != levels) v.fail(std::to_string(levels) + " numbers, or the name of a file");
  } else {
    lut = load_lut(v.existing_file(), levels);
  }
  require_monotone(lut, v);
  return lut;
}

/// Of a table of LUTs by wavelength the one that is nearest. The others are not read.
///
/// throws  InputError when a key is no wavelength, or none is near
Value nearest_lut(const Value& v, double wavelength_m) {
  const auto where = v.document->where(*v.node, v.path) + ": " + v.label;
  std::map<double, std::string> names;  // by wavelength
  std::optional<Value> nearest;
  double nearest_m = 0;
  for (const auto& [key, node] : *v.node->as_table()) {
    const std::string name(key.str());
    const double length_m = parse_length_m(name, where + ": a key of a table of LUTs");
    if (!(length_m >= 1e-9 && length_m <= 1e-2))
      throw InputError(where + ": " + in_quotes(name) +
                       " is no wavelength of 1 nm to 10 mm; give keys with a unit, such as "
                       "\"638 nm\"");
    // A picometre is what rounding of units stays below.
    const auto twin = names.lower_bound(length_m - 1e-12);
    if (twin != names.end() && twin->first <= length_m + 1e-12)
      throw InputError(where + ": " + in_quotes(twin->second) + " and " + in_quotes(name) +
                       " are the same wavelength; keep one of them");
    names.emplace(length_m, name);
    if (nearest && std::abs(length_m - wavelength_m) >= std::abs(nearest_m - wavelength_m))
      continue;
    nearest = Value{v.document, &node, v.path + "." + name, v.label + "." + in_quotes(name)};
    nearest_m = length_m;
  }
  if (nearest && std::abs(nearest_m - wavelength_m) <= lut_reach_m * (1 + 1e-6)) return *nearest;
  std::string all;
  for (const auto& [length_m, name] : names) all += (all.empty() ? "" : ", ") + in_quotes(name);
  const auto wanted = length_text(wavelength_m);
  throw InputError(where + " has " +
                   (all.empty() ? "no wavelength" : all + ", none within 1 nm of " + wanted) +
                   "; add " + in_quotes(wanted) + " = \"FILE\"");
}

glm::dvec2 pair_of(const Value& v, const char* shape, const Range& range) {
  return v.vector<glm::dvec2>(shape, [&](const Value& one) { return one.number(range); });
}

/// One share for both axes, or `[x, y]`.
glm::dvec2 share_of(const Value& v) {
  const Range range = between(1e-3, 1);
  return v.is_array() ? pair_of(v, "a number or two [x, y]", range) : glm::dvec2(v.number(range));
}

std::vector<ZernikeTerm> zernike_of(const Value& v) {
  constexpr const char* shape =
      "an array of pairs [Noll index, turns], for example [[4, 0.1], [11, -0.05]]";
  if (!v.is_array()) v.fail(shape);
  std::vector<ZernikeTerm> terms;
  for (const auto& node : *v.node->as_array()) {
    const Value pair{v.document, &node, v.path, v.label};
    const auto numbers = pair_of(pair, shape, between(-1e4, 1e4));
    if (numbers.x != std::round(numbers.x) || numbers.x < 1 || numbers.x > 105)
      pair.fail("[Noll index, turns] with an index of 1 to 105");
    terms.push_back({static_cast<int>(numbers.x), numbers.y});
  }
  return terms;
}

}  // namespace

SlmSpec read_slm(Section section, double wavelength_m, int most_bits) {
  SlmSpec slm;
  section.read("encoding", [&](const Value& v) {
    try {
      slm.encoding = encoding_of(v.string("the name of an encoding"));
    } catch (const InputError& error) {
      v.fail(error.what());
    }
  });
  const bool amplitude = shows_amplitude(slm.encoding);
  section.read("clip", [&](const Value& v) { slm.clip = v.number(between(0.01, 1)); });
  section.read("band", [&](const Value& v) { slm.band = share_of(v); });
  section.read("bits", [&](const Value& v) {
    slm.bits = v.integer(1, 64);
    if (slm.bits != 8 && slm.bits != 10) v.fail("8 or 10");
    if (slm.bits > most_bits)
      v.fail(
          "8 in a scene: its pictures have 8 bits; give 10 to raywave encode, in a file of "
          "--slm");
  });
  const int grey_levels = slm.levels = slm.levels_per_turn = grey_levels_of(slm);
  section.read("levels", [&](const Value& v) { slm.levels = v.integer(2, grey_levels); });
  section.read("levels_per_turn",
               [&](const Value& v) { slm.levels_per_turn = v.integer(2, 4 * grey_levels); });
  section.read("invert", [&](const Value& v) { slm.invert = v.boolean(); });
  section.read("offset", [&](const Value& v) { slm.offset_turns = v.number(between(-1e3, 1e3)); });

  double turns_per_unit = 1;
  section.read("lut_unit", [&](const Value& v) {
    turns_per_unit = v.choice<double>({{"turns", 1}, {"radians", 1 / (2 * std::numbers::pi)}});
  });
  section.read("lut", [&](const Value& v) {
    slm.lut = lut_of(v.node->is_table() ? nearest_lut(v, wavelength_m) : v,
                     static_cast<std::size_t>(grey_levels_of(slm)));
    for (double& number : slm.lut) number *= amplitude ? 1 : turns_per_unit;
    if (slm.invert)
      v.fail("given without invert: the LUT says itself whether phase falls as grey rises");
  });

  section.read("carrier", [&](const Value& v) {
    slm.carrier = pair_of(v, "two numbers [x, y] in cycles per pixel", between(-0.5, 0.5));
  });
  section.read("shift", [&](const Value& v) {
    slm.shift_m = v.vector<glm::dvec2>(
        "two lengths [x, y]", [](const Value& one) { return one.length_m(between(-1e4, 1e4)); });
    if (slm.carrier != glm::dvec2(0)) v.fail("given without carrier: both say the same");
  });
  section.read("shift_distance",
               [&](const Value& v) { slm.shift_distance_m = v.length_m(between(1e-9, 1e4)); });
  section.read("lens", [&](const Value& v) {
    slm.lens_m = v.length_m(between(-1e4, 1e4));
    if (std::abs(*slm.lens_m) < 1e-9) v.fail("a focal length other than 0");
  });
  section.read("zernike", [&](const Value& v) { slm.zernike = zernike_of(v); });

  section.read("flatness_unit", [&](const Value& v) {
    slm.flatness.in_nm = v.choice<bool>({{"levels", false}, {"nm", true}});
  });
  section.read("flatness_fit", [&](const Value& v) {
    slm.flatness.centre = v.choice<bool>({{"exact", false}, {"centre", true}});
  });
  section.read("flatness", [&](const Value& v) {
    slm.flatness.where = v.document->where(*v.node, v.path) + ": " + v.label;
    slm.flatness.file = v.existing_file();
    load_flatness(slm.flatness);
  });
  section.read("flip", [&](const Value& v) {
    const auto& axes = v.string("\"x\", \"y\", \"xy\" or \"\"");
    if (axes != "x" && axes != "y" && axes != "xy" && !axes.empty())
      v.fail("\"x\", \"y\", \"xy\" or \"\"");
    slm.flip_x = axes.starts_with('x');
    slm.flip_y = axes.ends_with('y');
  });
  section.read("rotate", [&](const Value& v) {
    slm.rotate_deg = v.integer(0, 270);
    if (slm.rotate_deg % 90 != 0) v.fail("0, 90, 180 or 270");
  });
  section.read("stop", [&](const Value& v) {
    if (!v.is("none")) slm.stop = {share_of(v), {0, 0}};
  });
  section.read("stop_centre", [&](const Value& v) {
    if (!slm.stop) v.fail("given with stop, the size of the aperture");
    slm.stop->centre = pair_of(v, "two numbers [x, y] in cycles per pixel", between(-0.5, 0.5));
  });
  section.finish();

  const bool needs_carrier = slm.encoding == Encoding::off_axis || slm.encoding == Encoding::lee;
  if (needs_carrier && slm.carrier == glm::dvec2(0) && slm.shift_m == glm::dvec2(0))
    section.fail("encoding " + in_quotes(name_of(slm.encoding)) +
                 " needs slm.carrier, for example [0.25, 0]: the picture stands beside the zero "
                 "order");
  return slm;
}

Illumination read_illumination(Section section) {
  Illumination light;
  section.read("focus", [&](const Value& v) {
    if (v.is("parallel")) return;
    light.focus_m = v.length_m(between(-1e4, 1e4));
    if (std::abs(*light.focus_m) < 1e-6)
      v.fail("lengths of 1 um or more, or of -1 um or less, or \"parallel\"");
  });
  section.read("angle", [&](const Value& v) {
    const auto degrees = pair_of(v, "two angles [x, y] in degrees", between(-80, 80));
    light.sine = glm::sin(glm::radians(degrees));
    if (glm::dot(light.sine, light.sine) > 0.98)
      v.fail("angles whose squared sines add up to 0.98 or less");
  });
  section.finish();
  return light;
}

SlmSpec load_slm(const std::filesystem::path& file, double wavelength_m,
                 const std::vector<std::string>& overrides) {
  return parse_slm(read_scene_text(file), wavelength_m, overrides);
}

SlmSpec parse_slm(const SceneText& text, double wavelength_m,
                  const std::vector<std::string>& overrides) {
  const Document document = parse_document(text, overrides);
  Section root(document, document.root, "", "");
  auto slm = read_slm(root.section("slm"), wavelength_m, 10);
  slm.illumination = read_illumination(root.section("illumination"));
  root.finish();
  return slm;
}

void load_flatness(FlatnessSpec& flatness) {
  flatness.picture = flatness.in_nm ? load_grey(flatness.file, flatness.where)
                                    : load_levels(flatness.file, flatness.where);
}

}  // namespace raywave
