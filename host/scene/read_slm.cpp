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
#include "host/scene/settings.hpp"
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
    if (constexpr std::string_view mark = "\xef\xbb\xbf";
        line_number == 1 && line.starts_with(mark))
      line.erase(0, mark.size());  // of UTF-8, which spreadsheets write
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

/// A file of voltages in place of phases would make every level the same, or any.
///
/// throws  InputError where the numbers are no phases in turns, or no amplitudes
void require_range(const std::vector<double>& lut, bool amplitude, const Value& v) {
  constexpr double most_turns = 4, beside = 0.1;  // measured amplitudes may lie beside 0 to 1
  const auto [low, high] = std::minmax(lut.front(), lut.back());
  const auto where = v.document->where(*v.node, v.path) + ": " + v.label;
  if (amplitude && (low < -beside || high > 1 + beside))
    throw InputError(where + " has amplitudes from " + number_text(low) + " to " +
                     number_text(high) + "; 0 to 1 is expected, the brightest level has 1");
  if (!amplitude && high - low > most_turns)
    throw InputError(where + " spans " + number_text(high - low) +
                     " turns of phase, and a panel's levels span up to " + number_text(most_turns) +
                     "; give phases, not voltages, and lut_unit = \"radians\" where they are such");
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

glm::dvec2 read_carrier(const Value& v) {
  return pair_of(v, "two numbers [x, y] in cycles per pixel", between(-0.5, 0.5));
}

}  // namespace

void keys_of(SlmSpec& slm, const Keys& key, double wavelength_m, int most_bits) {
  key(choice("encoding", slm.encoding, Names<Encoding>(encodings.begin(), encodings.end())));
  key(number("clip", slm.clip, between(0.01, 1)));
  key(setting("band", slm.band, share_of));
  key(whole("bits", slm.bits, 1, 64).and_then([&](const Value& v) {
    if (slm.bits != 8 && slm.bits != 10) v.fail("8 or 10");
    if (slm.bits > most_bits)
      v.fail(
          "8 in a scene: its pictures have 8 bits; give 10 to raywave encode, in a file of "
          "--slm");
    slm.levels = slm.levels_per_turn = grey_levels_of(slm);
  }));
  key(whole("levels", slm.levels, 2, grey_levels_of(slm)));
  key(whole("levels_per_turn", slm.levels_per_turn, 2, 4 * grey_levels_of(slm)));
  key(flag("invert", slm.invert));
  key(number("offset", slm.offset_turns, between(-1e3, 1e3)).as("offset_turns"));

  double turns_per_unit = 1;
  key(choice("lut_unit", turns_per_unit, {{"turns", 1}, {"radians", 1 / (2 * std::numbers::pi)}})
          .told_if(false));
  key(setting("lut", slm.lut, [&](const Value& v) {
        auto lut = lut_of(v.node->is_table() ? nearest_lut(v, wavelength_m) : v,
                          static_cast<std::size_t>(grey_levels_of(slm)));
        const bool amplitude = shows_amplitude(slm.encoding);
        for (double& number : lut) number *= amplitude ? 1 : turns_per_unit;
        require_range(lut, amplitude, v);
        return lut;
      }).and_then([&](const Value& v) {
    if (slm.invert)
      v.fail("given without invert: the LUT says itself whether phase falls as grey rises");
  }));

  key(setting("carrier", slm.carrier, read_carrier));
  key(setting("shift", slm.shift_m,
              [](const Value& v) {
                return v.vector<glm::dvec2>("two lengths [x, y]", [](const Value& one) {
                  return one.length_m(between(-1e4, 1e4));
                });
              })
          .as("shift_m")
          .and_then([&](const Value& v) {
            if (slm.carrier != glm::dvec2(0)) v.fail("given without carrier: both say the same");
          }));
  key(length("shift_distance", slm.shift_distance_m, between(1e-9, 1e4)));
  key(length("lens", slm.lens_m, between(-1e4, 1e4)).and_then([&](const Value& v) {
    if (std::abs(*slm.lens_m) < 1e-9) v.fail("a focal length other than 0");
  }));
  key(setting("zernike", slm.zernike, zernike_of, [](const std::vector<ZernikeTerm>& terms) {
    auto json = nlohmann::ordered_json::array();
    for (const auto& term : terms) json.push_back({term.noll, term.turns});
    return json;
  }));

  key(choice("flatness_unit", slm.flatness.in_nm, {{"levels", false}, {"nm", true}})
          .told_if(false));
  key(choice("flatness_fit", slm.flatness.centre, {{"exact", false}, {"centre", true}})
          .told_if(false));
  key(setting("flatness", slm.flatness.file, [](const Value& v) { return v.existing_file(); })
          .told_if(false)
          .and_then([&](const Value& v) {
            slm.flatness.where = v.document->where(*v.node, v.path) + ": " + v.label;
            load_flatness(slm.flatness);
          }));
  key({"flip",
       [&](const Value& v) {
         constexpr const char* axes = "\"x\", \"y\", \"xy\" or \"\"";
         const auto& flip = v.string(axes);
         if (flip != "x" && flip != "y" && flip != "xy" && !flip.empty()) v.fail(axes);
         slm.flip_x = flip.starts_with('x');
         slm.flip_y = flip.ends_with('y');
       },
       [&] { return std::string(slm.flip_x ? "x" : "") + (slm.flip_y ? "y" : ""); }, "flip"});
  key(whole("rotate", slm.rotate_deg, 0, 270).as("rotate_deg").and_then([&](const Value& v) {
    if (slm.rotate_deg % 90 != 0) v.fail("0, 90, 180 or 270");
  }));
  key(setting(
          "stop", slm.stop,
          [](const Value& v) {
            return StopSpec{share_of(v), {0, 0}};
          },
          [](const std::optional<StopSpec>& stop) {
            return stop ? nlohmann::ordered_json{{"size", told(stop->size)},
                                                 {"centre", told(stop->centre)}}
                        : nlohmann::ordered_json();
          })
          .or_word("none"));
  key({"stop_centre", [&](const Value& v) {
         if (!slm.stop) v.fail("given with stop, the size of the aperture");
         slm.stop->centre = read_carrier(v);
       }});
}

SlmSpec read_slm(Section section, double wavelength_m, int most_bits) {
  auto slm = read_keys(section, SlmSpec{}, wavelength_m, most_bits);
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
  flatness.picture = flatness.in_nm ? load_numbers(flatness.file, flatness.where)
                                    : load_levels(flatness.file, flatness.where);
}

}  // namespace raywave
