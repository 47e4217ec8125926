// SPDX-License-Identifier: Apache-2.0
#include "host/scene/read_slm.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/exponential.hpp>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <map>
#include <memory>
#include <numbers>
#include <numeric>
#include <optional>

#include "host/scene/document.hpp"
#include "host/scene/settings.hpp"
#include "host/scene/units.hpp"

namespace raywave {
namespace {

// A turn of phase changes by about as large a share as the wavelength: 1 nm of visible light is a
// quarter of a percent, or half a level
constexpr double table_reach_m = 1e-9;

/// Replaces noise of a measurement, which may turn back a little, and says by how much.
///
/// throws  InputError where the LUT turns back by more, with the level that does most
void fit_monotone(Lut& lut, double most, const char* unit, const Value& v) {
  const auto measured = lut.values;
  const double change = make_monotone(lut.values);
  if (lut.values.front() == lut.values.back())
    v.refuse("shows " + number_text(lut.values[0]) + " at every level, or at most of them");
  if (change > most) {
    // The level that turns back by most
    const double sign = lut.values.back() > lut.values.front() ? 1 : -1;
    std::size_t i = 1;
    for (std::size_t k = 2; k < measured.size(); ++k)
      if (sign * (measured[k] - measured[k - 1]) < sign * (measured[i] - measured[i - 1])) i = k;
    const auto level = lut.levels.empty() ? i : static_cast<std::size_t>(lut.levels[i]);
    v.refuse("must rise or fall from level to level; level " + std::to_string(level) + " shows " +
             number_text(measured[i]) + " after " + number_text(measured[i - 1]) +
             ": phases that wrap need unwrapping");
  }
  if (change > 0)
    v.note("it turns back, by up to " + number_text(change) + unit +
           ", which is taken as noise: the nearest LUT that does not is used");
}

/// A file of voltages in place of phases would make every level the same, or any.
///
/// throws  InputError where the numbers are no phases in turns, or no amplitudes
void require_range(const std::vector<double>& lut, bool amplitude, const Value& v) {
  constexpr double most_turns = 4, beside = 0.1;  // measured amplitudes may lie beside 0 to 1
  const auto ends = std::minmax_element(lut.begin(), lut.end());
  const double low = *ends.first, high = *ends.second;
  if (amplitude && (low < -beside || high > 1 + beside))
    v.refuse("has amplitudes from " + number_text(low) + " to " + number_text(high) +
             "; 0 to 1 is expected, the brightest level has 1");
  if (!amplitude && high - low > most_turns)
    v.refuse("spans " + number_text(high - low) +
             " turns of phase, and a panel's levels span up to " + number_text(most_turns) +
             "; give phases, not voltages, and lut_unit = \"radians\" where they are such");
  constexpr double usual_turns = 1.75;
  if (!amplitude && high - low > usual_turns)
    v.note("it spans " + number_text(high - low) +
           " turns of phase, more than most panels: check that these are turns, not volts or units "
           "of pi (lut_unit = \"pi\")");
}

/// throws  InputError where amplitudes come with amplitudes, or are none
void require_states(const Lut& lut, bool amplitude, const Value& v) {
  if (lut.amplitudes.empty()) return;
  if (amplitude) v.refuse("has three columns, and this encoding shows amplitudes alone");
  require_range(lut.amplitudes, true, v);
  if (!(*std::max_element(lut.amplitudes.begin(), lut.amplitudes.end()) > 0))
    v.refuse("has no amplitude above 0");
}

/// The LUT of a value: a number for each level, rows of level, number and where it is one a complex
/// state its amplitude, or the name of a file that holds them.
Lut lut_of(const Value& v, int level_count) {
  const std::string shape = "2 to " + std::to_string(level_count) +
                            " numbers, pairs [level, number], rows [level, turns, amplitude], or "
                            "the name of a file";
  if (v.node->is_string()) return load_lut(v.existing_file(), level_count);
  if (!v.is_array()) v.fail(shape.c_str());
  const Range range = between(-1e6, 1e6);
  Lut lut;
  std::vector<std::vector<double>> rows;
  for (const auto& node : *v.node->as_array()) {
    const auto one = v.part(node);
    if (!one.is_array()) {
      lut.values.push_back(one.number(range));
      continue;
    }
    const auto& array = *node.as_array();
    if (array.size() < 2 || array.size() > 3 || (!rows.empty() && array.size() != rows[0].size()))
      one.fail("[level, number] in all rows, or [level, turns, amplitude] in all");
    auto& row = rows.emplace_back();
    for (const auto& number : array) row.push_back(v.part(number).number(range));
  }
  if (lut.values.empty() && !rows.empty()) return lut_of_table(rows, level_count, v.where());
  if (!rows.empty() || lut.values.size() < 2 ||
      lut.values.size() > static_cast<std::size_t>(level_count))
    v.fail(shape.c_str());
  return lut;
}

/// Of a table by wavelength the nearest value. The others are not read.
///
/// throws  InputError when a key is no wavelength, or none is near
Value nearest_of(const Value& v, double wavelength_m) {
  const auto where = v.where();
  std::map<double, std::string> names;  // by wavelength
  std::optional<Value> nearest;
  double nearest_m = 0;
  for (const auto& [key, node] : *v.node->as_table()) {
    const std::string name(key.str());
    const double length_m = parse_length_m(name, where + ": a key of a table by wavelength");
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
  if (nearest && std::abs(nearest_m - wavelength_m) <= table_reach_m * (1 + 1e-6)) return *nearest;
  std::string all;
  for (const auto& [length_m, name] : names) all += (all.empty() ? "" : ", ") + in_quotes(name);
  const auto wanted = length_text(wavelength_m);
  throw InputError(where + " has " +
                   (all.empty() ? "no wavelength" : all + ", none within 1 nm of " + wanted) +
                   "; add one of " + in_quotes(wanted));
}

/// One share for both axes, or `[x, y]`.
glm::dvec2 share_of(const Value& v) {
  const Range range = between(1e-3, 1);
  return v.is_array() ? v.numbers<glm::dvec2>("a number or two [x, y]", range)
                      : glm::dvec2(v.number(range));
}

std::vector<ZernikeTerm> zernike_of(const Value& v) {
  constexpr const char* shape =
      "an array of pairs [Noll index, turns], for example [[4, 0.1], [11, -0.05]]";
  if (!v.is_array()) v.fail(shape);
  std::vector<ZernikeTerm> terms;
  for (const auto& node : *v.node->as_array()) {
    const auto pair = v.part(node);
    const auto numbers = pair.numbers<glm::dvec2>(shape, between(-1e4, 1e4));
    if (numbers.x != std::round(numbers.x) || numbers.x < 1 || numbers.x > 105)
      pair.fail("[Noll index, turns] with an index of 1 to 105");
    terms.push_back({static_cast<int>(numbers.x), numbers.y});
  }
  return terms;
}

/// A length, or rows of a measured kernel.
Crosstalk crosstalk_of(const Value& v) {
  constexpr const char* shape =
      "a length, or a kernel: an odd number of rows, up to 15, of as many numbers each, whose sum "
      "is > 0";
  Crosstalk crosstalk;
  if (!v.is_array()) {
    crosstalk.sigma_m = v.length_m(between(0, 1e-3));
    return crosstalk;
  }
  const auto& rows = *v.node->as_array();
  const auto is_odd = [](std::size_t n) { return n % 2 == 1 && n <= 15; };
  for (const auto& node : rows) {
    const auto* row = node.as_array();
    if (!is_odd(rows.size()) || !row || !is_odd(row->size()) ||
        row->size() != rows.front().as_array()->size())
      v.fail(shape);
    crosstalk.size = {static_cast<int>(row->size()), static_cast<int>(rows.size())};
    for (const auto& number : *row)
      crosstalk.weights.push_back(v.part(number).number(between(-1e6, 1e6)));
  }
  const double sum = std::accumulate(crosstalk.weights.begin(), crosstalk.weights.end(), 0.0);
  if (!(sum > 1e-9)) v.fail(shape);
  for (double& w : crosstalk.weights) w /= sum;
  return crosstalk;
}

/// Lengths of a Gaussian, or the name of a picture.
BeamProfile profile_of(const Value& v) {
  const Range range = between(1e-6, 1e3);
  BeamProfile profile;
  profile.where = v.where();
  if (v.is_array()) {
    profile.diameter_m =
        v.lengths_m<glm::dvec2>("a length, two lengths [x, y], or the name of a picture", range);
  } else if (const auto* text = v.node->as_string(); text && !is_length(text->get())) {
    profile.file = v.existing_file();
    load_profile(profile);
  } else {
    profile.diameter_m = glm::dvec2(v.length_m(range));
  }
  return profile;
}

Json told_lut(const Lut& lut) {
  auto json = Json::array();
  for (std::size_t i = 0; i < lut.values.size(); ++i)
    if (!lut.amplitudes.empty())
      json.push_back({lut.levels[i], lut.values[i], lut.amplitudes[i]});
    else if (lut.levels.empty())
      json.push_back(lut.values[i]);
    else
      json.push_back({lut.levels[i], lut.values[i]});
  return json;
}

glm::dvec2 read_carrier(const Value& v) {
  return v.numbers<glm::dvec2>("two numbers [x, y] in cycles per pixel", between(-0.5, 0.5));
}

}  // namespace

/// Levels, and the phases that they show.
void keys_of_levels(SlmSpec& slm, const Keys& key, double wavelength_m, int most_bits) {
  key(choice("encoding", slm.encoding));
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
  key(whole("levels", slm.levels, 2, grey_levels_of(slm)).and_then([&](const Value& v) {
    if (slm.levels > 16 && !std::has_single_bit(static_cast<unsigned>(slm.levels)))
      v.note("so many different phases are shown; if a turn of phase takes " +
             std::to_string(slm.levels) + " grey levels, give levels_per_turn instead");
  }));
  const auto nearest = [wavelength_m](const Value& v) { return nearest_of(v, wavelength_m); };
  key(whole("levels_per_turn", slm.levels_per_turn, 2, 4 * grey_levels_of(slm))
          .or_table(nearest)
          .and_then([](const Value& v) {
            const auto* lasers = v.document->root.at_path("hologram.wavelength").as_array();
            if (lasers && lasers->size() > 1 && !v.node->is_table())
              v.note(
                  "each laser has it; where the panel's own curve serves all of them, a turn of "
                  "red takes more grey levels than one of blue: give a table by wavelength");
          }));
  key(flag("invert", slm.invert).and_then([&](const Value& v) {
    if (slm.invert && !slm.lut.values.empty())
      v.fail("false: the LUT says itself whether phase falls as grey rises");
  }));
  key(number("offset", slm.offset_turns, between(-1e3, 1e3)).as("offset_turns"));

  double turns_per_unit = 1;
  key(choice("lut_unit", turns_per_unit,
             {{"turns", 1}, {"radians", 1 / (2 * std::numbers::pi)}, {"pi", 0.5}})
          .told_if(false));
  key(setting(
          "lut", slm.lut,
          [&](const Value& v) {
            auto lut = lut_of(v, grey_levels_of(slm));
            const bool amplitude = shows_amplitude(slm.encoding);
            for (double& number : lut.values) number *= amplitude ? 1 : turns_per_unit;
            require_states(lut, amplitude, v);
            if (lut.amplitudes.empty()) fit_monotone(lut, 0.05, amplitude ? "" : " turns", v);
            require_range(lut.values, amplitude, v);
            if (lut.values.size() < static_cast<std::size_t>(grey_levels_of(slm)))
              v.note("it lists " + std::to_string(lut.values.size()) + " of " +
                     std::to_string(grey_levels_of(slm)) + " levels: the others are not used");
            return lut;
          },
          told_lut)
          .or_table(nearest)
          .and_then([&](const Value& v) {
            if (slm.invert)
              v.fail("given without invert: the LUT says itself whether phase falls as grey rises");
          }));
}

/// Phases that are added, and how the panel is mounted.
void keys_of_place(SlmSpec& slm, const Keys& key, double wavelength_m) {
  const auto nearest = [wavelength_m](const Value& v) { return nearest_of(v, wavelength_m); };
  key(setting("carrier", slm.carrier, read_carrier).or_table(nearest).and_then([&](const Value&) {
    slm.shift_m = glm::dvec2(0);
  }));
  key(setting("shift", slm.shift_m,
              [](const Value& v) {
                return v.lengths_m<glm::dvec2>("two lengths [x, y]", between(-1e4, 1e4));
              })
          .as("shift_m")
          .or_table(nearest)
          .and_then([&](const Value& v) {
            if (slm.carrier != glm::dvec2(0)) v.fail("given without carrier: both say the same");
          }));
  key(length("shift_distance", slm.shift_distance_m, between(-1e4, 1e4)).and_then([&](auto& v) {
    if (std::abs(slm.shift_distance_m) < 1e-9) v.fail("1 nm or more before or behind the SLM");
  }));
  key(length("lens", slm.lens_m, between(-1e4, 1e4)).and_then([&](const Value& v) {
    if (std::abs(*slm.lens_m) < 1e-9) v.fail("a focal length other than 0");
  }));
  key(setting("zernike", slm.zernike, zernike_of, [](const std::vector<ZernikeTerm>& terms) {
        auto json = Json::array();
        for (const auto& term : terms) json.push_back({term.noll, term.turns});
        return json;
      }).or_table(nearest));

  key(choice("flatness_unit", slm.flatness.in_nm, {{"levels", false}, {"nm", true}})
          .told_if(false));
  key(choice("flatness_fit", slm.flatness.centre, {{"exact", false}, {"centre", true}})
          .told_if(false));
  key(setting("flatness", slm.flatness.file, [](const Value& v) { return v.existing_file(); })
          .told_if(false)
          .and_then([&](const Value& v) {
            slm.flatness.where = v.where();
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
}

/// Optics behind it, and what is not ideal.
void keys_of_optics(SlmSpec& slm, const Keys& key) {
  key(setting(
          "stop", slm.stop,
          [](const Value& v) {
            return StopSpec{share_of(v), {0, 0}};
          },
          [](const std::optional<StopSpec>& stop) {
            return stop ? Json{{"size", told(stop->size)}, {"centre", told(stop->centre)}} : Json();
          })
          .or_word("none"));
  key(setting("fill", slm.fill, [](const Value& v) {
        // A share of the area, or of both sides
        return std::optional(v.is_array() ? share_of(v) : glm::sqrt(share_of(v)));
      }).or_word("none"));
  key(setting(
      "undiffracted", slm.undiffracted, [](const Value& v) { return v.number(between(0, 0.9)); },
      [](double share) { return share > 0 ? Json(share) : Json(); }));
  key(setting("crosstalk", slm.crosstalk, crosstalk_of, [](const Crosstalk& crosstalk) -> Json {
    if (crosstalk.weights.empty()) return crosstalk.sigma_m > 0 ? Json(crosstalk.sigma_m) : Json();
    auto rows = Json::array();
    for (int y = 0; y < crosstalk.size.y; ++y) {
      const auto row = crosstalk.weights.begin() + std::ptrdiff_t{y} * crosstalk.size.x;
      rows.push_back(std::vector<double>(row, row + crosstalk.size.x));
    }
    return rows;
  }));
  key(number("rate", slm.rate_per_s, between(0.01, 1e6)).as("rate_per_s"));
  key({"stop_centre", [&](const Value& v) {
         if (!slm.stop) v.fail("given with stop, the size of the aperture");
         slm.stop->centre = read_carrier(v);
       }});
}

void keys_of(SlmSpec& slm, const Keys& key, double wavelength_m, int most_bits) {
  keys_of_levels(slm, key, wavelength_m, most_bits);
  keys_of_place(slm, key, wavelength_m);
  keys_of_optics(slm, key);
}

SlmSpec read_slm(Section section, double wavelength_m, int most_bits, const SlmSpec& from) {
  auto slm = read_keys(section, from, wavelength_m, most_bits);
  const bool needs_carrier = slm.encoding == Encoding::off_axis || slm.encoding == Encoding::lee;
  if (needs_carrier && slm.carrier == glm::dvec2(0) && slm.shift_m == glm::dvec2(0))
    section.fail("encoding " + in_quotes(name_of(slm.encoding)) +
                 " needs slm.carrier, for example [0.25, 0]: the picture stands beside the zero "
                 "order");
  return slm;
}

Illumination read_illumination(Section section, Illumination light) {
  section.read("focus", [&](const Value& v) {
    if (v.is("parallel")) return;
    light.focus_m = v.length_m(between(-1e4, 1e4));
    if (std::abs(*light.focus_m) < 1e-6)
      v.fail("lengths of 1 um or more, or of -1 um or less, or \"parallel\"");
  });
  section.read("angle", [&](const Value& v) {
    const auto degrees = v.numbers<glm::dvec2>("two angles [x, y] in degrees", between(-80, 80));
    light.sine = glm::sin(glm::radians(degrees));
    if (glm::dot(light.sine, light.sine) > 0.98)
      v.fail("angles whose squared sines add up to 0.98 or less");
  });
  section.read("profile", [&](const Value& v) {
    light.profile = v.is("even") ? BeamProfile{} : profile_of(v);
  });
  section.read("source_size", [&](const Value& v) {
    if (!v.node->is_number())
      v.fail("a number of milliradians from 0 to 100, the source's width over its distance");
    light.source_size_rad = 1e-3 * v.number(between(0, 100));
  });
  section.read("bandwidth",
               [&](const Value& v) { light.bandwidth_m = v.length_m(between(0, 1e-7)); });
  section.finish();
  return light;
}

SlmSpec load_slm(const std::filesystem::path& file, double wavelength_m,
                 const std::vector<std::string>& overrides) {
  return parse_slm(read_scene_text(file), wavelength_m, overrides);
}

SlmSpec parse_slm(const SceneText& text, double wavelength_m,
                  const std::vector<std::string>& overrides, const SlmSpec& from) {
  const Document document = parse_document(text, overrides);
  Section root(document, document.root, "", "");
  auto slm = read_slm(root.section("slm"), wavelength_m, 10, from);
  slm.illumination = read_illumination(root.section("illumination"), from.illumination);
  // Or what scenes share: `raywave new --slm` takes it, too
  const bool is_scene = document.root.contains("object") || document.root.contains("scene") ||
                        document.root.contains("hologram");
  if (!is_scene) root.finish();
  slm.notes = document.notes;
  return slm;
}

void load_profile(BeamProfile& profile) {
  profile.picture = std::make_shared<Image>(load_grey(profile.file, profile.where));
  for (const float value : profile.picture->pixels)
    if (value < 0) throw InputError(profile.where + " has pixels below 0, and is an intensity");
}

void load_flatness(FlatnessSpec& flatness) {
  flatness.picture = flatness.in_nm ? load_numbers(flatness.file, flatness.where)
                                    : load_levels(flatness.file, flatness.where);
}

}  // namespace raywave
