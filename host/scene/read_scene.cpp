// SPDX-License-Identifier: Apache-2.0
// load_scenes: the keys of a scene file.
#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numeric>
#include <sstream>

#include "host/common/cache.hpp"
#include "host/common/text.hpp"
#include "host/scene/document.hpp"
#include "host/scene/gltf_scene.hpp"
#include "host/scene/read_slm.hpp"
#include "host/scene/scene.hpp"
#include "host/scene/settings.hpp"
#include "host/scene/units.hpp"

namespace raywave {
namespace {

constexpr Range kAnyPosition = between(-1e4, 1e4);
constexpr int kMostLayers = 16;

/// One wavelength, or those of lasers, which differ.
std::vector<double> read_wavelengths(const Value& v) {
  const bool is_list = v.is_array() && v.node->as_array()->size() > 1;
  const auto range =
      is_list ? between(least_visible_m, largest_visible_m)
              : between(HologramSpec::least_wavelength_m, HologramSpec::largest_wavelength_m);
  return v.list_of_lengths_m(range, LaserSet::most, [](const Value& one, const auto& before) {
    constexpr double least_difference_m = 1e-9;
    for (std::size_t i = 0; i + 1 < before.size(); ++i)
      if (std::abs(before[i] - before.back()) < least_difference_m)
        one.fail("another colour than " + length_text(before[i]));
  });
}

/// `[x, y]`, or an array of such places.
std::vector<glm::dvec2> read_places_m(const Value& v) {
  constexpr std::size_t most = 100;
  const auto place = [](const Value& one) {
    return one.lengths_m<glm::dvec2>("two lengths [x, y]", between(-1, 1));
  };
  const auto* array = v.node->as_array();
  if (!array || array->empty() || !array->front().is_array()) return {place(v)};
  if (array->size() > most) v.fail("two lengths [x, y], or 1 to 100 such places");
  std::vector<glm::dvec2> places;
  for (std::size_t i = 0; i < array->size(); ++i) places.push_back(place(v.element(i)));
  return places;
}

/// The laser that colour.only names.
std::size_t laser_of(const Value& v, const std::vector<double>& wavelengths_m) {
  const double wanted_m = v.length_m(between(least_visible_m, largest_visible_m));
  std::string names;
  for (std::size_t i = 0; i < wavelengths_m.size(); ++i) {
    if (std::abs(wavelengths_m[i] - wanted_m) < 0.5e-9) return i;
    names += (i > 0 ? " or " : "") + in_quotes(length_text(wavelengths_m[i]));
  }
  v.fail(names + ", of hologram.wavelength");
}

/// laser  of the wavelengths, unless colour.only names one
std::optional<ColourSpec> read_colour(Section section, bool is_given, const Section& hologram,
                                      const std::vector<double>& wavelengths_m, std::size_t laser) {
  if (wavelengths_m.size() == 1) {
    if (is_given)
      section.fail(
          "is for several lasers: give hologram.wavelength = [\"638 nm\", \"520 nm\", \"450 "
          "nm\"]");
    return {};
  }
  ColourSpec spec;
  spec.laser = laser;
  try {
    spec.lasers = laser_set(wavelengths_m);
  } catch (const std::invalid_argument& error) {
    hologram.fail("wavelength: lasers must mix white, " + std::string(error.what()) +
                  "; give a red, a green and a blue one");
  }
  section.read("primaries", [&](const Value& v) { v.choice<int>({{"srgb", 0}}); });
  section.read("white", [&](const Value& v) { v.choice<int>({{"D65", 0}}); });
  section.read("only", [&](const Value& v) {
    if (v.is("all")) return;
    spec.laser = laser_of(v, wavelengths_m);
    spec.only = true;
  });
  const auto of_each = [&](const Value& v, const Range& range) {
    std::vector<double> numbers;
    const auto* array = v.node->as_array();
    if (!array || array->size() != wavelengths_m.size())
      v.fail("a number for each of " + std::to_string(wavelengths_m.size()) + " lasers");
    for (const auto& node : *array) numbers.push_back(v.part(node).number(range));
    return numbers;
  };
  auto& bench = spec.bench;
  section.read("power", [&](const Value& v) { bench.powers = of_each(v, between(1e-9, 1e9)); });
  section.read("efficiency",
               [&](const Value& v) { bench.efficiencies = of_each(v, between(1e-6, 1)); });
  section.read("duty", [&](const Value& v) {
    bench.duties = of_each(v, between(1e-6, 1));
    if (std::accumulate(bench.duties.begin(), bench.duties.end(), 0.0) > 1 + 1e-9)
      v.fail("shares of the time that add up to 1 or less: lasers shine in turn");
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

/// Two edges [[x, y, z], [x, y, z]] that span an area.
std::array<glm::dvec3, 2> edges_m_of(const Value& v) {
  const auto* array = v.node->as_array();
  const char* shape = "two edges [[x, y, z], [x, y, z]], lengths each";
  if (!array || array->size() != 2) v.fail(shape);
  const std::array edges_m{v.element(0).lengths_m(kAnyPosition),
                           v.element(1).lengths_m(kAnyPosition)};
  const double area = glm::length(glm::cross(edges_m[0], edges_m[1]));
  if (!(area > 1e-9 * glm::length(edges_m[0]) * glm::length(edges_m[1])))
    v.fail("two edges that span an area");
  return edges_m;
}

std::string digest_of(const toml::table& root) {
  auto text = text_stream();
  text << root;
  return hash_name(text.str());
}

/// A table of values by wavelength, such as {"450 nm" = 1.527, "650 nm" = 1.515}.
Spectrum read_table(const Value& v, const Range& range, double wavelength_m) {
  Spectrum spectrum;
  for (const auto& [key, node] : *v.node->as_table()) {
    const std::string name(key.str());
    const Value value{v.document, &node, v.path + "." + name, v.label + ": " + in_quotes(name)};
    spectrum.table.emplace_back(parse_length_m(name, value.where()), value.number(range));
  }
  std::sort(spectrum.table.begin(), spectrum.table.end());
  if (spectrum.table.empty() || !spectrum.holds(wavelength_m))
    v.fail("given on both sides of the wavelength, " + length_text(wavelength_m) +
           (spectrum.table.empty() ? ""
                                   : " (it has " + length_text(spectrum.table.front().first) +
                                         " to " + length_text(spectrum.table.back().first) + ")"));
  return spectrum;
}

/// A number, a colour, or a table by wavelength.
Spectrum read_spectrum(const Value& v, const Range& range, double wavelength_m) {
  if (v.node->is_table()) return read_table(v, range, wavelength_m);
  Spectrum spectrum;
  spectrum.channels = v.colour(range);
  return spectrum;
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

glm::dvec2 read_pitch(const Value& v) {
  const auto range = between(HologramSpec::least_pitch_m, HologramSpec::largest_pitch_m);
  return v.is_array() ? v.lengths_m<glm::dvec2>("a length or two [x, y]", range)
                      : glm::dvec2(v.length_m(range));
}

std::filesystem::path file_of(const Value& v) { return v.existing_file(); }

/// viewer  whose eyepiece shows depths in dioptres; null: z is a length
Setting position(glm::dvec3& position_m, const ViewerSpec* viewer = nullptr) {
  const auto coordinate = [viewer](const Value& v) {
    const auto* text = viewer && v.label.ends_with("[2]") ? v.node->as_string() : nullptr;
    const auto dioptres = text ? dioptres_in(text->get()) : std::nullopt;
    if (!dioptres) return v.length_m(kAnyPosition);
    try {
      return depth_of_dioptres(*viewer, *dioptres);
    } catch (const InputError& error) {
      v.refuse(in_quotes(text->get()) + ": " + error.what());
    }
  };
  auto made = setting("position", position_m, [coordinate](const Value& v) {
    return v.vector<glm::dvec3>("three lengths [x, y, z]", coordinate);
  });
  return made.as("position_m");
}

/// A length or several, ascending; none: the program chooses them.
Setting lengths(const char* key, std::vector<double>& lengths_m, const Range& range, int most) {
  auto made = setting(
      key, lengths_m, [=](const Value& v) { return v.ascending_lengths_m(range, most); },
      [](const auto& all) { return all.empty() ? Json() : Json(all); });
  made.told_as += "_m";
  return made.or_auto();
}

}  // namespace

void keys_of(HologramSpec& spec, const Keys& key) {
  key(setting("resolution", spec.resolution, [](const Value& v) { return v.integers(262144); }));
  key(setting("pitch", spec.pitch_m, read_pitch).as("pitch_m"));
  key(setting("wavelength", spec.wavelength_m, [](const Value& v) {
        return read_wavelengths(v).front();
      }).as("wavelength_m"));
  key(setting("tiles", spec.tiles, [](const Value& v) { return v.integers(64); }).or_auto());
}

void keys_of(WrpSpec& spec, const Keys& key) {
  key(choice("propagation", spec.propagation));
  key(setting("grid", spec.grid, [](const Value& v) { return v.integers(1024); }).or_auto());
  key(lengths("distance", spec.distances_m, kAnyPosition, kMostLayers)
          .and_then([&](const Value& v) {
            for (const double distance_m : spec.distances_m)
              if (std::abs(distance_m) < 1e-9)
                v.fail("lengths of 1 nm or more, or of -1 nm or less");
            spec.layers = static_cast<int>(spec.distances_m.size());
          }));
  key(whole("layers", spec.layers, 1, kMostLayers).or_auto().and_then([&](const Value& v) {
    if (const auto given = spec.distances_m.size();
        given > 0 && given != static_cast<std::size_t>(spec.layers))
      v.fail("the number of distances given, " + std::to_string(given));
  }));
  key(number("padding", spec.padding, between(1, 8)).or_auto());
  key(number("guard", spec.guard, between(1.02, 4)).or_auto());
  key(number("bell", spec.bell, between(1, 16)).or_auto());
  key(number("margin", spec.margin_px, between(0, 32)).or_auto());
  key(whole("lines", spec.lines, 1, 8).or_auto());
}

void keys_of(SamplingSpec& spec, const Keys& key) {
  key(choice("mode", spec.mode));
  key(length("pitch", spec.pitch_m, between(1e-9, 1)).or_auto());
  key(number("cone", spec.cone, between(0.01, 4)).or_auto());
  key(number("apodization", spec.apodization, between(0, 4))
          .or_auto()
          .and_then([&](const Value& v) {
            if (spec.apodization > spec.cone) v.fail("<= cone (" + number_text(spec.cone) + ")");
          }));
  key(whole("antialias", spec.antialias, 0, 4).and_then([&](const Value& v) {
    if (spec.antialias % 2 != 0) v.fail("0, 2 or 4");
  }));
  key(whole("visibility", spec.visibility, 0, 16).and_then([&](const Value& v) {
    if (spec.visibility % 4 != 0 || spec.visibility == 12) v.fail("0, 4, 8 or 16");
  }));
  key(whole("seed", spec.seed, std::uint32_t{0}, std::numeric_limits<std::uint32_t>::max()));
  key(whole("frames", spec.frames, 1, 4096).or_auto());
}

void keys_of(TraceSpec& spec, const Keys& key) {
  key(whole("depth", spec.depth, 0, TraceSpec::most_depth).or_auto());
  key(choice("bounces", spec.bounces));
  key(flag("shadows", spec.shadows));
  key(whole("shadow_rays", spec.shadow_rays, 1, 16).and_then([&](const Value& v) {
    if (!std::has_single_bit(static_cast<unsigned>(spec.shadow_rays))) v.fail("1, 2, 4, 8 or 16");
  }));
  key(whole("diffuse_rays", spec.diffuse_rays, 0, TraceSpec::most_looks));
  key(whole("gloss_rays", spec.gloss_rays, 0, TraceSpec::most_looks));
}

void keys_of(AccuracySpec& spec, const Keys& key) {
  key(choice(
      "precision", spec.precision,
      {{"auto", std::nullopt}, {"float", Precision::floats}, {"double", Precision::doubles}}));
  key(number("phase", spec.phase_turns, between(1e-9, 0.5)));
}

void keys_of(ViewerSpec& spec, const Keys& key) {
  key(length("distance", spec.distance_m, between(0, 1e4)));
  key(length("eyepiece", spec.eyepiece_m, between(1e-6, 1e4)).or_word("none").and_then([&](auto&) {
    spec.eyepiece_distance_m = spec.eye_relief_m = *spec.eyepiece_m;
  }));
  const auto of_eyepiece = [&](const char* name, double& distance_m) {
    key(length(name, distance_m, between(0, 1e4))
            .told_if(spec.eyepiece_m.has_value())
            .and_then([&](const Value& v) {
              if (!spec.eyepiece_m) v.fail("given with eyepiece");
            }));
  };
  of_eyepiece("eyepiece_distance", spec.eyepiece_distance_m);
  of_eyepiece("eye_relief", spec.eye_relief_m);
  key(length("resolution", spec.resolution_m, between(1e-9, 1)).or_auto());
  key(length("pupil", spec.pupil_m, between(1e-6, 1)));
  key(setting("pupil_position", spec.pupil_places_m, read_places_m, [](const auto& places_m) {
        auto all = Json::array();
        for (const auto& place_m : places_m) all.push_back(told(place_m));
        return places_m.empty() ? Json() : all;
      }).as("pupil_position_m"));
}

void keys_of(RefineSettings& spec, const Keys& key) {
  key(whole("iterations", spec.iterations, 0, RefineSettings::most_iterations).or_auto());
  key(whole("views", spec.views, 0, RefineSettings::most_views).or_auto());
  key(number("brightness", spec.brightness,
             between(RefineSettings::least_brightness, RefineSettings::largest_brightness)));
  key(lengths("depths", spec.depths_m, between(1e-9, 1e4), 100));
  key(length("blur", spec.blur_m, between(1e-9, 1)).or_auto());
  key(whole("lens_points", spec.lens_points, 2, RefineSettings::most_lens_points));
  key(choice("targets", spec.targets));
}

void keys_of(Light& light, const Keys& key) {
  key(choice("type", light.type).and_then([&](auto&) {
    light.highlights = light.type != LightType::environment;
    light.samples = light.type == LightType::environment ? 64
                    : light.type == LightType::area      ? 16
                                                         : 1;
  }));
  const bool is_spot = light.type == LightType::spot, is_area = light.type == LightType::area;
  key(number("intensity", light.intensity, at_least(0)));
  if (light.type != LightType::ambient) key(flag("highlights", light.highlights));
  if (is_area)
    key(length("radius", light.radius_m, between(1e-9, 1e4)).told_if(light.radius_m > 0));
  const bool is_disc = light.radius_m > 0;
  if (light.type == LightType::directional || is_spot || is_disc)
    key(setting("direction", light.direction, [](const Value& v) { return v.direction(); })
            .needing(is_disc ? "the way that the disc faces, for example [0, 0, 1]"
                             : "the way the light travels, for example [0, 0, 1]"));
  if (light.type == LightType::point || is_spot || is_area) {
    key(position(light.position_m)
            .needing("the light's place, for example [\"0 mm\", \"50 mm\", \"20 mm\"]"));
    key(choice("falloff", light.falls_off, {{"none", false}, {"square", true}}));
  }
  if (is_spot) {
    key(number("outer", light.outer_deg, between(least_spot_deg, 90)));
    key(number("inner", light.inner_deg, between(0, 90)).and_then([&](const Value& v) {
      if (!(light.inner_deg < light.outer_deg))
        v.fail("< outer (" + number_text(light.outer_deg) + ")");
    }));
  }
  if (is_area && !is_disc)
    key(setting("edges", light.edges_m, edges_m_of,
                [](const auto& edges_m) {
                  return Json{told(edges_m[0]), told(edges_m[1])};
                })
            .as("edges_m")
            .needing("the sides of a rectangle, for example [[\"20 mm\", 0, 0], [0, \"10 mm\", "
                     "0]], or the radius of a disc"));
  if (light.type == LightType::environment) {
    key(setting("picture", light.picture, file_of)
            .needing("an equirectangular picture, for example \"sky.exr\""));
    key(number("rotation", light.rotation_deg, between(-1e6, 1e6)));
  }
  if (has_size(light)) key(whole("samples", light.samples, 1, most_lights));
}

void keys_of(Material& material, const Keys& key, double wavelength_m) {
  const auto colour = [&](const char* name, glm::dvec3& of) {
    key(setting(name, of, [](const Value& v) { return v.colour(at_least(0)); }));
  };
  const auto spectrum = [&](const char* name, Spectrum& of, const Range& range) {
    return setting(
        name, of, [=](const Value& v) { return read_spectrum(v, range, wavelength_m); },
        [=](const Spectrum& told) { return told.at(wavelength_m); });
  };
  colour("ambient", material.ambient);
  colour("diffuse", material.diffuse);
  colour("specular", material.specular);
  key(number("shininess", material.shininess, at_least(0)));
  key(setting("texture", material.texture, file_of));
  key(spectrum("reflectivity", material.reflectivity, between(0, 1)));
  key(spectrum("transparency", material.transparency, between(0, 1)).and_then([&](const Value& v) {
    const double mirrored = material.reflectivity.at(wavelength_m);
    if (mirrored + material.transparency.at(wavelength_m) > 1 + 1e-9)
      v.fail("<= 1 - reflectivity (" + number_text(mirrored) + ")");
  }));
  key(spectrum("ior", material.ior, between(1, 100)));
  key(spectrum("attenuation", material.attenuation, between(1e-6, 1)));
  key(length("attenuation_distance", material.attenuation_distance_m, between(1e-9, 1e4)));
  colour("emission", material.emission);
}

void keys_of(Object& object, const Keys& key, const HologramSpec& hologram,
             const ViewerSpec& viewer, const std::vector<Material>& materials, bool needs_mesh) {
  // An object so many times as wide as its hologram has a width in millimetres, mostly
  constexpr double doubted_holograms = 100;
  const double doubted_m = doubted_holograms * hologram.resolution.x * hologram.pitch_m.x;
  key(setting("mesh", object.mesh, file_of)
          .needing(needs_mesh ? "the name of a mesh file" : nullptr));
  key(length("width", object.width_m, between(1e-9, 1e4), std::min(doubted_m, least_doubted_m)));
  key(position(object.position_m, &viewer));
  key(setting("rotation", object.rotation_deg, [](const Value& v) {
        return v.numbers(between(-1e6, 1e6));
      }).as("rotation_deg"));
  key(setting(
      "material", object.material, [&](const Value& v) { return find_material(v, materials); },
      [&](int material) { return materials[static_cast<std::size_t>(material)].name; }));
  key(length("unit", object.unit_m, between(1e-12, 1e4))
          .told_if(!object.width_m && object.unit_m != 1)
          .and_then([&](const Value& v) {
            if (object.width_m) v.fail("left out where width is given");
          }));
  key(choice("anchor", object.anchor));
  key(length("cut", object.cut_m, between(1e-9, 1e4)).told_if(object.cut_m > 0));
  key(choice("normals", object.normals));
}

namespace {

/// A light, material or object that messages find.
///
/// file  the key of the file that most of them are about
template <class Spec>
Spec placed(const Section& section, std::string_view file) {
  Spec spec;
  spec.where = section.where(file);
  return spec;
}

/// laser  of several wavelengths, unless colour.only names one
Scene parse_laser(const SceneText& text, const std::vector<std::string>& overrides,
                  std::size_t laser) {
  const Document document = parse_document(text, overrides);
  Section root(document, document.root, "", "");

  Scene scene;
  scene.file = text.file;
  auto hologram = root.section("hologram");
  scene.hologram = read_keys(hologram, HologramSpec{});
  std::vector<double> wavelengths_m{scene.hologram.wavelength_m};
  hologram.read("wavelength", [&](const Value& v) { wavelengths_m = read_wavelengths(v); });
  scene.colour = read_colour(root.section("colour"), document.root.contains("colour"), hologram,
                             wavelengths_m, laser);
  if (scene.colour) scene.hologram.wavelength_m = wavelengths_m[scene.colour->laser];
  scene.slm = read_slm(root.section("slm"), scene.hologram.wavelength_m);
  scene.slm.illumination = read_illumination(root.section("illumination"));
  scene.wrp = read_keys(root.section("wrp"), WrpSpec{});
  scene.sampling = read_keys(root.section("sampling"), SamplingSpec{});
  scene.trace = read_keys(root.section("trace"), TraceSpec{});
  scene.accuracy = read_keys(root.section("accuracy"), AccuracySpec{});
  scene.viewer = read_keys(root.section("viewer"), ViewerSpec{});
  const auto refine = read_keys(root.section("refine"), RefineSettings{});
  if (document.root.contains("refine") && refine.iterations != 0) scene.refine = refine;
  scene.given = given_keys(document.root);
  scene.digest = digest_of(document.root);
  for (Section& section : root.sections("light"))
    scene.lights.push_back(read_keys(section, placed<Light>(section, "picture")));
  scene.materials.emplace_back();
  for (auto& [name, section] : root.section("materials").named_sections("material")) {
    auto material = placed<Material>(section, "texture");
    material.name = name;
    scene.materials.push_back(read_keys(section, material, scene.hologram.wavelength_m));
  }
  for (Section& section : root.sections("object"))
    scene.objects.push_back(read_keys(section, placed<Object>(section, "mesh"), scene.hologram,
                                      scene.viewer, scene.materials, text.needs_meshes));
  Section of_gltf = root.section("scene");
  Section animation = root.section("animation");
  root.finish();
  scene.notes = document.notes;
  const auto gltf = read_gltf_scene(of_gltf, scene);
  if (document.root.contains("animation")) {
    std::optional<GltfMoves> moves;
    animation.read("gltf", [&](const Value& v) { moves = read_gltf_moves(v, gltf, scene); });
    scene.animation =
        read_animation(animation, scene.objects.size(), scene.lights, std::move(moves));
  }

  const std::string name = one_line(text.file.string());
  if (scene.objects.empty())
    throw InputError(name + ": there is no object: add [[object]] with mesh = \"FILE\"");
  if (const auto shining = std::accumulate(
          scene.lights.begin(), scene.lights.end(), std::int64_t{0},
          [](std::int64_t sum, const Light& light) { return sum + directions_of(light); });
      shining > most_lights)
    throw InputError(name + ": " + std::to_string(shining) +
                     " lights with a place or a direction, "
                     "at most " +
                     std::to_string(most_lights) +
                     " are allowed (an area light or an environment counts as its samples): each "
                     "is followed to every sample; leave out the weakest, give fewer samples, or "
                     "make an ambient light of them");
  if (scene.lights.empty())
    throw InputError(name + ": there is no light: add [[light]] with direction = [0, 0, 1]");
  return scene;
}

}  // namespace

std::vector<Scene> load_scenes(const std::filesystem::path& file,
                               const std::vector<std::string>& overrides) {
  return parse_scenes(read_scene_text(file), overrides);
}

std::vector<Scene> parse_scenes(const SceneText& text, const std::vector<std::string>& overrides) {
  std::vector<Scene> scenes{parse_laser(text, overrides, 0)};
  const auto& colour = scenes[0].colour;
  const std::size_t lasers = colour && !colour->only ? colour->lasers.count() : 1;
  while (scenes.size() < lasers) scenes.push_back(parse_laser(text, overrides, scenes.size()));
  auto& notes = scenes[0].notes;  // those of all, each once
  for (std::size_t i = 1; i < scenes.size(); ++i)
    for (const auto& note : scenes[i].notes)
      if (std::find(notes.begin(), notes.end(), note) == notes.end()) notes.push_back(note);
  return scenes;
}

}  // namespace raywave
