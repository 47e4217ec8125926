// SPDX-License-Identifier: Apache-2.0
// load_scene: the keys of a scene file.
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numeric>
#include <sstream>

#include "host/common/digest.hpp"
#include "host/scene/document.hpp"
#include "host/scene/gltf_scene.hpp"
#include "host/scene/read_slm.hpp"
#include "host/scene/scene.hpp"

namespace raywave {
namespace {

constexpr Range kAnyPosition = between(-1e4, 1e4);
constexpr int kMostLayers = 16;

/// One wavelength, or those of three lasers, which differ.
std::vector<double> read_wavelengths(const Value& v) {
  if (!v.is_array())
    return {
        v.length_m(between(HologramSpec::least_wavelength_m, HologramSpec::largest_wavelength_m))};
  constexpr double least_difference_m = 1e-9;
  const auto three = v.vector<glm::dvec3>(
      "one wavelength, or a list of three, such as [\"638 nm\", \"520 nm\", \"450 nm\"]",
      [](const Value& one) { return one.length_m(between(least_visible_m, largest_visible_m)); });
  for (int i = 0; i < 3; ++i) {
    if (const int next = (i + 1) % 3; std::abs(three[i] - three[next]) < least_difference_m)
      v.fail("three lasers of different colours (" + length_text(three[i]) + " and " +
             length_text(three[next]) + " are the same)");
  }
  return {three.x, three.y, three.z};
}

/// wavelengths_m  receives one, or three
HologramSpec read_hologram(Section section, std::vector<double>& wavelengths_m) {
  HologramSpec spec;
  wavelengths_m = {spec.wavelength_m};
  section.read("resolution", [&](const Value& v) { spec.resolution = v.integers(65536); });
  section.read("pitch", [&](const Value& v) {
    const auto length = [](const Value& one) {
      return one.length_m(between(HologramSpec::least_pitch_m, HologramSpec::largest_pitch_m));
    };
    spec.pitch_m = v.is_array() ? v.vector<glm::dvec2>("a length or two [x, y]", length)
                                : glm::dvec2(length(v));
  });
  section.read("wavelength", [&](const Value& v) {
    wavelengths_m = read_wavelengths(v);
    spec.wavelength_m = wavelengths_m.front();
  });
  section.read("tiles", [&](const Value& v) {
    if (!v.is_auto()) spec.tiles = v.integers(64);
  });
  section.finish();
  return spec;
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

/// laser  of the wavelengths; none: the one that colour.only names
std::optional<ColourSpec> read_colour(Section section, bool is_given, const Section& hologram,
                                      const std::vector<double>& wavelengths_m,
                                      std::optional<std::size_t> laser) {
  std::optional<ColourSpec> spec;
  if (wavelengths_m.size() == 1) {
    if (is_given)
      section.fail(
          "is for three lasers: give hologram.wavelength = [\"638 nm\", \"520 nm\", \"450 nm\"]");
    return spec;
  }
  spec.emplace();
  try {
    spec->lasers = laser_set({wavelengths_m[0], wavelengths_m[1], wavelengths_m[2]});
  } catch (const std::invalid_argument& error) {
    hologram.fail("wavelength: three lasers must mix white, " + std::string(error.what()) +
                  "; give a red, a green and a blue one");
  }
  section.read("primaries", [&](const Value& v) { v.choice<int>({{"srgb", 0}}); });
  section.read("white", [&](const Value& v) { v.choice<int>({{"D65", 0}}); });
  section.read("only", [&](const Value& v) {
    if (v.is("all")) return;
    spec->laser = laser_of(v, wavelengths_m);
    spec->only = true;
  });
  section.finish();
  if (laser) {
    spec->laser = *laser;
  } else if (!spec->only) {
    hologram.fail(
        "wavelength: one wavelength only: this works on the hologram of one laser; give "
        "colour.only = " +
        in_quotes(length_text(wavelengths_m[0])) + ", or one wavelength");
  }
  return spec;
}

WrpSpec read_wrp(Section section) {
  WrpSpec spec;
  section.read("propagation", [&](const Value& v) {
    spec.propagation = v.choice<WrpPropagation>({{"auto", WrpPropagation::automatic},
                                                 {"spectrum", WrpPropagation::spectrum},
                                                 {"compact", WrpPropagation::compact}});
  });
  section.read("grid", [&](const Value& v) {
    if (!v.is_auto()) spec.grid = v.integers(1024);
  });
  section.read("distance", [&](const Value& v) {
    if (!v.is_auto()) spec.distances_m = v.ascending_lengths_m(between(-1e4, 1e4), kMostLayers);
    for (const double distance_m : spec.distances_m)
      if (std::abs(distance_m) < 1e-9) v.fail("lengths of 1 nm or more, or of -1 nm or less");
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
  section.read("guard", [&](const Value& v) {
    if (!v.is_auto()) spec.guard = v.number(between(1.02, 4));
  });
  section.read("bell", [&](const Value& v) {
    if (!v.is_auto()) spec.bell = v.number(between(1, 16));
  });
  section.read("margin", [&](const Value& v) {
    if (!v.is_auto()) spec.margin_px = v.number(between(0, 32));
  });
  section.read("lines", [&](const Value& v) {
    if (!v.is_auto()) spec.lines = v.integer(1, 8);
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
  section.read("depth", [&](const Value& v) {
    if (!v.is_auto()) spec.depth = v.integer(0, TraceSpec::most_depth);
  });
  section.read("bounces", [&](const Value& v) {
    spec.bounces = v.choice<Bounces>(
        {{"auto", Bounces::automatic}, {"points", Bounces::points}, {"paths", Bounces::paths}});
  });
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
  section.read("eyepiece", [&](const Value& v) {
    if (!v.is("none")) spec.eyepiece_m = v.length_m(between(1e-6, 1e4));
  });
  spec.eyepiece_distance_m = spec.eyepiece_m.value_or(0);
  section.read("eyepiece_distance", [&](const Value& v) {
    if (!spec.eyepiece_m) v.fail("given with eyepiece");
    spec.eyepiece_distance_m = v.length_m(between(0, 1e4));
  });
  section.read("resolution", [&](const Value& v) {
    if (!v.is_auto()) spec.resolution_m = v.length_m(between(1e-9, 1));
  });
  section.finish();
  return spec;
}

/// Empty without the section, and with iterations = 0.
std::optional<RefineSettings> read_refine(Section section, bool is_given) {
  RefineSettings spec;
  bool any = is_given;
  section.read("iterations", [&](const Value& v) {
    if (v.is_auto()) return;
    spec.iterations = v.integer(0, 1000000);
    any = *spec.iterations > 0;
  });
  section.read("views", [&](const Value& v) { spec.views = v.integer(0, 1000); });
  section.read("brightness",
               [&](const Value& v) { spec.brightness = v.number(between(0.01, 100)); });
  section.read("depths", [&](const Value& v) {
    if (!v.is_auto()) spec.depths_m = v.ascending_lengths_m(between(1e-9, 1e4), 100);
  });
  section.read("blur", [&](const Value& v) {
    if (!v.is_auto()) spec.blur_m = v.length_m(between(1e-9, 1));
  });
  section.read("lens_points", [&](const Value& v) { spec.lens_points = v.integer(2, 100); });
  section.finish();
  if (!any) return std::nullopt;
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
  std::array<glm::dvec3, 2> edges_m;
  for (std::size_t i = 0; i < 2; ++i)
    edges_m[i] =
        Value{v.document, array->get(i), v.path, v.label + "[" + std::to_string(i) + "]"}.lengths_m(
            kAnyPosition);
  const double area = glm::length(glm::cross(edges_m[0], edges_m[1]));
  if (!(area > 1e-9 * glm::length(edges_m[0]) * glm::length(edges_m[1])))
    v.fail("two edges that span an area");
  return edges_m;
}

/// Keys of lights that have a size.
void read_samples(Section& section, int otherwise, Light& light) {
  light.samples = otherwise;
  section.read("samples", [&](const Value& v) { light.samples = v.integer(1, most_lights); });
}

std::string digest_of(const toml::table& root) {
  std::ostringstream text;
  text << root;
  return hash_name(text.str());
}

Light read_light(Section section) {
  Light light;
  light.where = section.where();
  section.read("type", [&](const Value& v) {
    light.type = v.choice<LightType>({{"ambient", LightType::ambient},
                                      {"directional", LightType::directional},
                                      {"point", LightType::point},
                                      {"spot", LightType::spot},
                                      {"area", LightType::area},
                                      {"environment", LightType::environment}});
  });
  section.read("intensity", [&](const Value& v) { light.intensity = v.number(at_least(0)); });
  light.highlights = light.type != LightType::environment;
  if (light.type != LightType::ambient)
    section.read("highlights", [&](const Value& v) { light.highlights = v.boolean(); });
  const bool is_area = light.type == LightType::area;
  if (is_area)
    section.read("radius",
                 [&](const Value& v) { light.radius_m = v.length_m(between(1e-9, 1e4)); });
  if (light.type == LightType::directional || light.type == LightType::spot || light.radius_m > 0)
    section.require("direction",
                    light.radius_m > 0 ? "the way that the disc faces, for example [0, 0, 1]"
                                       : "the way the light travels, for example [0, 0, 1]",
                    [&](const Value& v) {
                      light.direction = v.numbers(between(-1e6, 1e6));
                      if (glm::length(light.direction) < 1e-9) v.fail("longer than 0");
                    });
  if (light.type == LightType::point || light.type == LightType::spot || is_area) {
    section.require("position", "the light's place, for example [\"0 mm\", \"50 mm\", \"20 mm\"]",
                    [&](const Value& v) { light.position_m = v.lengths_m(kAnyPosition); });
    section.read("falloff", [&](const Value& v) {
      light.falls_off = v.choice<bool>({{"none", false}, {"square", true}});
    });
  }
  if (light.type == LightType::spot) {
    section.read("outer",
                 [&](const Value& v) { light.outer_deg = v.number(between(least_spot_deg, 90)); });
    section.read("inner", [&](const Value& v) {
      light.inner_deg = v.number(between(0, 90));
      if (!(light.inner_deg < light.outer_deg))
        v.fail("< outer (" + number_text(light.outer_deg) + ")");
    });
  }
  if (is_area && light.radius_m == 0)
    section.require("edges",
                    "the sides of a rectangle, for example [[\"20 mm\", 0, 0], [0, \"10 mm\", 0]], "
                    "or the radius of a disc",
                    [&](const Value& v) { light.edges_m = edges_m_of(v); });
  if (is_area) read_samples(section, 16, light);
  if (light.type == LightType::environment) {
    section.require("picture", "an equirectangular picture, for example \"sky.exr\"",
                    [&](const Value& v) { light.picture = v.existing_file(); });
    section.read("rotation",
                 [&](const Value& v) { light.rotation_deg = v.number(between(-1e6, 1e6)); });
    read_samples(section, 64, light);
  }
  section.finish();
  return light;
}

/// A table of values by wavelength, such as {"450 nm" = 1.527, "650 nm" = 1.515}.
Spectrum read_table(const Value& v, const Range& range, double wavelength_m) {
  Spectrum spectrum;
  for (const auto& [key, node] : *v.node->as_table()) {
    const std::string name(key.str());
    const Value value{v.document, &node, v.path + "." + name, v.label + ": " + in_quotes(name)};
    spectrum.table.emplace_back(
        parse_length_m(name, v.document->where(node, value.path) + ": " + value.label),
        value.number(range));
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

Material read_material(const std::string& name, Section section, double wavelength_m) {
  Material material;
  material.name = name;
  material.where = section.where();
  section.read("ambient", [&](const Value& v) { material.ambient = v.colour(at_least(0)); });
  section.read("diffuse", [&](const Value& v) { material.diffuse = v.colour(at_least(0)); });
  section.read("specular", [&](const Value& v) { material.specular = v.colour(at_least(0)); });
  section.read("shininess", [&](const Value& v) { material.shininess = v.number(at_least(0)); });
  section.read("texture", [&](const Value& v) { material.texture = v.existing_file(); });
  const auto spectrum = [&](Spectrum& of, const Range& range) {
    return
        [&of, range, wavelength_m](const Value& v) { of = read_spectrum(v, range, wavelength_m); };
  };
  section.read("reflectivity", spectrum(material.reflectivity, between(0, 1)));
  section.read("transparency", [&](const Value& v) {
    material.transparency = read_spectrum(v, between(0, 1), wavelength_m);
    const double mirrored = material.reflectivity.at(wavelength_m);
    if (mirrored + material.transparency.at(wavelength_m) > 1 + 1e-9)
      v.fail("<= 1 - reflectivity (" + number_text(mirrored) + ")");
  });
  section.read("ior", spectrum(material.ior, between(1, 100)));
  section.read("attenuation", spectrum(material.attenuation, between(1e-6, 1)));
  section.read("attenuation_distance", [&](const Value& v) {
    material.attenuation_distance_m = v.length_m(between(1e-9, 1e4));
  });
  section.read("emission", [&](const Value& v) { material.emission = v.colour(at_least(0)); });
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

/// An object so many times as wide as its hologram has a width in millimetres, mostly.
constexpr double doubted_holograms = 100;

Object read_object(Section section, const HologramSpec& hologram,
                   const std::vector<Material>& materials, bool needs_mesh) {
  Object object;
  object.where = section.where();
  const bool has_mesh =
      section.read("mesh", [&](const Value& v) { object.mesh = v.existing_file(); });
  if (needs_mesh && !has_mesh) section.fail("mesh is missing: give the name of a mesh file");
  const double doubted_m = doubted_holograms * hologram.resolution.x * hologram.pitch_m.x;
  section.read("width", [&](const Value& v) {
    object.width_m = v.length_m(between(1e-9, 1e4), std::min(doubted_m, least_doubted_m));
  });
  section.read("position", [&](const Value& v) { object.position_m = v.lengths_m(kAnyPosition); });
  section.read("rotation",
               [&](const Value& v) { object.rotation_deg = v.numbers(between(-1e6, 1e6)); });
  section.read("material", [&](const Value& v) { object.material = find_material(v, materials); });
  section.read("unit", [&](const Value& v) {
    object.unit_m = v.length_m(between(1e-12, 1e4));
    if (object.width_m) v.fail("left out where width is given");
  });
  section.read("anchor", [&](const Value& v) {
    object.anchor = v.choice<Anchor>({{"centre", Anchor::centre}, {"origin", Anchor::origin}});
  });
  section.read("cut", [&](const Value& v) { object.cut_m = v.length_m(between(1e-9, 1e4)); });
  section.read("normals", [&](const Value& v) {
    object.normals = v.choice<Normals>(
        {{"file", Normals::file}, {"smooth", Normals::smooth}, {"flat", Normals::flat}});
  });
  section.finish();
  return object;
}

Scene parse_laser(const SceneText& text, const std::vector<std::string>& overrides,
                  std::optional<std::size_t> laser);

}  // namespace

Scene load_scene(const std::filesystem::path& file, const std::vector<std::string>& overrides) {
  return parse_scene(read_scene_text(file), overrides);
}

std::vector<Scene> load_colours(const std::filesystem::path& file,
                                const std::vector<std::string>& overrides) {
  return parse_colours(read_scene_text(file), overrides);
}

std::vector<Scene> parse_colours(const SceneText& text, const std::vector<std::string>& overrides) {
  std::vector<Scene> scenes{parse_laser(text, overrides, std::size_t{0})};
  if (!scenes[0].colour) return scenes;
  if (scenes[0].colour->only) return {parse_laser(text, overrides, {})};
  for (std::size_t laser = 1; laser < scenes[0].colour->lasers.wavelengths_m.size(); ++laser)
    scenes.push_back(parse_laser(text, overrides, laser));
  return scenes;
}

Scene parse_scene(const SceneText& text, const std::vector<std::string>& overrides) {
  return parse_laser(text, overrides, {});
}

namespace {

/// laser  of several wavelengths; none: there is one, or colour.only names one
Scene parse_laser(const SceneText& text, const std::vector<std::string>& overrides,
                  std::optional<std::size_t> laser) {
  const Document document = parse_document(text, overrides);
  Section root(document, document.root, "", "");

  Scene scene;
  scene.file = text.file;
  std::vector<double> wavelengths_m;
  const auto hologram = root.section("hologram");
  scene.hologram = read_hologram(hologram, wavelengths_m);
  scene.colour = read_colour(root.section("colour"), document.root.contains("colour"), hologram,
                             wavelengths_m, laser);
  if (scene.colour) scene.hologram.wavelength_m = wavelengths_m[scene.colour->laser];
  scene.slm = read_slm(root.section("slm"), scene.hologram.wavelength_m);
  scene.slm.illumination = read_illumination(root.section("illumination"));
  scene.wrp = read_wrp(root.section("wrp"));
  scene.sampling = read_sampling(root.section("sampling"));
  scene.trace = read_trace(root.section("trace"));
  scene.accuracy = read_accuracy(root.section("accuracy"));
  scene.viewer = read_viewer(root.section("viewer"));
  scene.refine = read_refine(root.section("refine"), document.root.contains("refine"));
  scene.given = given_keys(document.root);
  scene.digest = digest_of(document.root);
  for (Section& section : root.sections("light")) scene.lights.push_back(read_light(section));
  scene.materials.emplace_back();
  for (auto& [name, section] : root.section("materials").named_sections("material"))
    scene.materials.push_back(read_material(name, section, scene.hologram.wavelength_m));
  for (Section& section : root.sections("object"))
    scene.objects.push_back(
        read_object(section, scene.hologram, scene.materials, text.needs_meshes));
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
}  // namespace raywave
