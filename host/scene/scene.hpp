// SPDX-License-Identifier: Apache-2.0
/// A scene as the user describes it: plain values in metres, nothing derived. The first step of
/// scene -> plan -> trace -> propagate -> encode.
///
/// Frame (docs/conventions.md): right-handed, hologram plane z = 0 centred on the z axis, objects
/// on both sides, light travels towards -z.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "host/common/choices.hpp"
#include "host/common/colour.hpp"
#include "host/scene/animation.hpp"
#include "host/scene/light.hpp"
#include "host/scene/read_data.hpp"
#include "host/scene/scene_text.hpp"
#include "host/scene/slm.hpp"

namespace raywave {

// Properties of materials that depend on the wavelength.

/// 0 red (>= 580 nm), 1 green, 2 blue (< 490 nm): the channel of colours and textures that light of
/// this wavelength sees.
int channel_of(double wavelength_m);

/// The channels of colours and textures that a hologram sees: that of its wavelength, or, in
/// colour, all three.
struct Channels {
  int first = 0;  // what a scene of one wavelength sees; in colour, the nearest to the laser's
  bool all = false;

  int count() const { return all ? 3 : 1; }
  /// Number i of `count`.
  int operator[](int i) const { return all ? i : first; }
  template <class Test>
  bool any(const Test& test) const {
    return all ? test(0) || test(1) || test(2) : test(first);
  }
  bool operator==(const Channels&) const = default;
};

/// A number for each wavelength: one for all, one for each channel of a colour, or a table.
struct Spectrum {
  glm::dvec3 channels{0};                        // red, green, blue; unless there is a table
  std::vector<std::pair<double, double>> table;  // wavelengths (m, ascending) and values

  Spectrum() = default;
  Spectrum(double value) : channels(value) {}  // NOLINT: a number is a spectrum

  /// Between the wavelengths of a table, values lie on a straight line over 1 / wavelength^2, as
  /// Cauchy's formula has it for indices of refraction. Beyond them, the nearest one's is taken.
  double at(double wavelength_m) const;
  /// False beyond the wavelengths of a table.
  bool holds(double wavelength_m) const;
  /// True where the value is above zero for some wavelength.
  bool is_positive() const;

  bool operator==(const Spectrum&) const = default;
};

struct HologramSpec {
  static constexpr double least_pitch_m = 1e-10, largest_pitch_m = 1;
  static constexpr double least_wavelength_m = 1e-9, largest_wavelength_m = 1e-2;

  glm::ivec2 resolution{1920, 1080};  // pixels, x and y, >= 1
  glm::dvec2 pitch_m{3.74e-6, 3.74e-6};
  double wavelength_m = 638e-9;
  // Number of windows in x and y, computed one after another; empty: as few as memory holds
  std::optional<glm::ivec2> tiles{};
};

/// How light travels from the samples to the hologram: over WRPs and by the shifted angular
/// spectrum, or over virtual planes one Fourier transform away; `automatic`: planning chooses.
enum class WrpPropagation { automatic, spectrum, compact };
constexpr auto names_of(WrpPropagation) { return std::array{"auto", "spectrum", "compact"}; }

struct WrpSpec {
  WrpPropagation propagation = WrpPropagation::automatic;
  std::optional<glm::ivec2> grid;  // WRPs side by side; empty: as many as the scene projects to
  // WRP to hologram, > 0, ascending; empty: one per depth layer, amid its surfaces
  std::vector<double> distances_m;
  int layers = 1;  // largest number of depth layers where no distance is given, >= 1
  // Side of the transformed plane over the side of the hologram, 1 to 8
  double padding = 2.0;
  // Of virtual planes (VirtualPlanes in host/plan/plan.hpp); empty: the planner's choice
  std::optional<double> guard, bell, margin_px;
  std::optional<int> lines;
};

/// How a WRP pixel gathers light: rays aimed at the surface samples, or the paper's fan of rays.
enum class SamplingMode { aimed, fan };
constexpr auto names_of(SamplingMode) { return std::array{"aimed", "fan"}; }

struct SamplingSpec {
  SamplingMode mode = SamplingMode::aimed;
  double pitch_m = 1e-4;  // sampling interval p on the object, at the scene's middle depth
  // Half width of the cone that a pixel gathers, in half holograms; 1 just fills the hologram
  double cone = 1.2;
  double apodization = 0.2;  // width of the cone's soft edge, in half holograms
  // Rays per side of a sample's cell, 2 or 4: they give the covered part, and textures and shadows
  // are averaged over them; 0: one ray through the centre
  int antialias = 4;
  // Parts per side of the hologram's window in the visibility mask of a sample: 4, 8 or 16; 0:
  // without occlusion
  int visibility = 8;
  std::uint32_t seed = 1;  // of the random phases
  int frames = 1;          // holograms with independent random phases, >= 1
};

/// How light that comes over mirrors and through glass is computed: every source seen there is a
/// sample at a virtual point, as the hologram's centre sees it (`points`), or a sample whose path
/// is followed all over the hologram (`paths`). `automatic`: presets choose, else `points`.
enum class Bounces { automatic, points, paths };
constexpr auto names_of(Bounces) { return std::array{"auto", "points", "paths"}; }

struct TraceSpec {
  static constexpr int most_depth = 16, usual_depth = 8;

  // Mirror and refraction bounces, up to most_depth; empty: usual_depth
  std::optional<int> depth;
  Bounces bounces = Bounces::automatic;
  bool shadows = false;
  // Of the sixteen rays of a cell, how many ask for each direction of a light that has a size where
  // shadows change: 1, 2, 4, 8 or 16; 16: everywhere
  int shadow_rays = 2;
  // From the end of each ray, to surfaces whose light falls there, or that a highlight would show:
  // one bounce of their light
  static constexpr int most_looks = 64;
  int diffuse_rays = 0, gloss_rays = 0;
};

/// How phases are computed: in floats (differences within a tile of pixels; optical paths in pairs
/// of floats), or in doubles.
enum class Precision { floats, doubles };
constexpr auto names_of(Precision) { return std::array{"float", "double"}; }

struct AccuracySpec {
  // Empty: the cheapest whose predicted phase error stays below phase_turns
  std::optional<Precision> precision;
  double phase_turns = 0.01;
};

struct ViewerSpec {
  // Distance of the eye from the hologram, on the side away from the scene
  double distance_m = 0.25;
  // Focal length of a thin lens that the eye looks through, and its distance from the hologram on
  // the eye's side; empty: there is none
  std::optional<double> eyepiece_m;
  double eyepiece_distance_m = 0;
  double pupil_m = 4e-3;  // of the eye, across
  // Of the pupil's middle, from the axis, one for each picture; empty: on the axis
  std::vector<glm::dvec2> pupil_places_m{};
  double eye_relief_m = 0;  // of the pupil from the eyepiece
  // Smallest wanted detail of the picture; empty: what an eye at that distance resolves
  std::optional<double> resolution_m;
};

/// What refined pictures are compared with: what a lens sees by rays, or the light of the samples.
enum class RefineTargets { automatic, samples, lens };
constexpr auto names_of(RefineTargets) { return std::array{"auto", "samples", "lens"}; }

/// Section [refine]: phases are refined after propagation (docs/refine.md).
struct RefineSettings {
  static constexpr int most_iterations = 1'000'000, most_views = 1000, most_lens_points = 100;
  static constexpr double least_brightness = 0.01, largest_brightness = 100;

  std::optional<int> iterations;  // per frame, >= 1; empty: as many as the pictures need
  // Pictures through quarters of the hologram; empty: as many as bring views near the
  // field's and above, where neither iterations, time nor depths are given
  std::optional<int> views;
  double brightness = 1;         // light wanted in the pictures, over the traced field's there
  std::vector<double> depths_m;  // of whole pictures; empty: through the scene and beyond
  std::optional<double> blur_m;  // of the pictures; empty: 0.6 sampling.pitch
  std::optional<glm::dvec2> window_m;  // of the pictures; empty: what the WRPs cover
  int lens_points = 8;                 // per axis of the lens
  RefineTargets targets = RefineTargets::automatic;
  ViewerSpec viewer{};  // Scene::viewer, through whose pupil pictures are seen
  // Time for the iterations of all frames, which decides their number; commands alone set it
  std::optional<double> budget_s;
};

/// Where a mesh's metallic-roughness maps or colours decide, place by place, diffuse, specular and
/// shininess follow from these (docs/materials.md); those of the material are their means.
struct MetallicRoughness {
  glm::dvec3 base{1};
  double metallic = 0, roughness = 1;  // 0 to 1
  double reflectance = 0.04;           // of what is no metal, at normal incidence
  double ambient_share = 1;            // of the base colour
  double sharpest = 0;                 // largest exponent of its highlights; 0: it has none
};

/// Phong material. Triples are red, green, blue; a hologram of one wavelength uses the channel that
/// its colour falls into (`channel_of`).
struct Material {
  std::string name;
  glm::dvec3 ambient{0.1};
  glm::dvec3 diffuse{0.8};
  glm::dvec3 specular{0.0};
  double shininess = 10;  // Phong exponent m, >= 0
  // Absolute or relative to the working directory; multiplies ambient and diffuse
  std::optional<std::filesystem::path> texture;
  // Share of the light that is mirrored as metals do, the same in all directions, 0 to 1
  Spectrum reflectivity = 0.0;
  // Share that meets a clear surface, 0 to 1: Fresnel's formulas divide it into a mirrored and a
  // refracted part. reflectivity + transparency <= 1; the rest is the surface's own Phong light
  Spectrum transparency = 0.0;
  Spectrum ior = 1.5;  // index of refraction inside, >= 1
  // Share of the light that is left after attenuation_distance_m within the glass, above 0 to 1
  Spectrum attenuation = 1.0;
  double attenuation_distance_m = 1e-3;
  glm::dvec3 emission{0};  // radiance that needs no light
  // What only meshes bring (docs/materials.md)
  bool vertex_colours = false;  // they multiply ambient and diffuse
  bool unlit = false;           // texture and colours of vertices multiply the emission, too
  std::optional<MetallicRoughness> metallic_roughness;
  double normal_scale = 1;  // of the normal map's slopes
  AlphaMode alpha_mode = AlphaMode::opaque;
  double alpha = 1, alpha_cutoff = 0.5;
  // "scene.toml:20: material "gold"", the start of messages about its texture
  std::string where;

  /// True for mirrors and glass.
  bool is_specular() const { return reflectivity.is_positive() || transparency.is_positive(); }
};

/// True where light of some channel makes highlights on a material.
inline bool has_highlights(const Material& material, Channels channels) {
  if (material.metallic_roughness) return material.metallic_roughness->sharpest > 0;
  return channels.any([&](int channel) { return material.specular[channel] > 0; });
}

/// The largest exponent of a material's highlights.
inline double sharpest_shininess(const Material& material) {
  return material.metallic_roughness ? material.metallic_roughness->sharpest : material.shininess;
}

enum class Normals { file, smooth, flat };  // file: as in the mesh file, flat where it has none
constexpr auto names_of(Normals) { return std::array{"file", "smooth", "flat"}; }

/// The point of an object that lies at its position: the centre of its bounding box after rotation
/// and scaling, or the origin of its mesh's coordinates.
enum class Anchor { centre, origin };
constexpr auto names_of(Anchor) { return std::array{"centre", "origin"}; }

struct Object {
  std::filesystem::path mesh;     // absolute or relative to the working directory
  std::optional<double> width_m;  // largest x extent after rotation; empty: mesh units are unit_m
  glm::dvec3 position_m{0};       // of the anchor
  glm::dvec3 rotation_deg{0};     // about x, then y, then z (fixed axes), right-handed
  // Empty in scenes of files: position, rotation and width describe the object as it stands. Else
  // it moves as a solid: it keeps the size it was placed in, times this, and turns about its anchor
  // of there (the centre of the box that it had unless the scene says otherwise), whose place is
  // position_m
  std::optional<double> solid_scale{};
  int material = 0;  // index into Scene::materials
  Normals normals = Normals::file;
  std::string where;  // "scene.toml:41: object 0", the start of messages about this object
  double unit_m = 1;  // length of a mesh unit, without width_m
  Anchor anchor = Anchor::centre;
  // Surfaces with a smaller z than this, as those of a room that reaches behind the hologram, are
  // cut away; 0: nothing is
  double cut_m = 0;
  // Numbers of the nodes of a glTF file whose meshes it is made of; empty: of all
  std::vector<std::int32_t> nodes{};
  // Meshes with the same triangles that it can become, and where among them it is: 1.25 is a
  // quarter of the way from [1] to [2]; empty: as its own mesh
  std::vector<std::filesystem::path> shapes{};
  std::optional<double> shape{};
  // Skins and morph targets of a glTF file move its vertices: `shape` is the time in seconds
  bool deforms = false;
};

/// Of a scene in colour: its lasers, and the one whose hologram this scene makes. Materials and
/// textures keep red, green and blue, and their light becomes that of the laser (docs/colour.md).
struct ColourSpec {
  LaserSet lasers;
  std::size_t laser = 0;  // HologramSpec::wavelength_m is that of this one
  bool only = false;      // colour.only asks for it alone
  LaserBench bench;

  /// Its light shows the largest field: all lasers share samples of this field.
  double longest_m() const {
    return *std::max_element(lasers.wavelengths_m.begin(), lasers.wavelengths_m.end());
  }
  double shortest_m() const {
    return *std::min_element(lasers.wavelengths_m.begin(), lasers.wavelengths_m.end());
  }
  /// Light of the laser for a linear sRGB radiance: >= 0, less is none.
  double light_of(glm::dvec3 rgb) const {
    return std::max(0.0, glm::dot(lasers.from_rgb[laser], rgb));
  }
};

struct Scene {
  std::filesystem::path file;
  HologramSpec hologram;
  std::optional<ColourSpec> colour;  // empty: one wavelength, which sees one channel of colours
  SlmSpec slm;
  WrpSpec wrp;
  SamplingSpec sampling;
  TraceSpec trace;
  AccuracySpec accuracy;
  ViewerSpec viewer;
  std::optional<RefineSettings> refine;  // empty: the traced field is encoded
  std::optional<Animation> animation;    // empty: nothing moves
  // Of the file's text with the overrides in place: scenes that differ have others
  std::string digest;
  // Keys that the file or an override sets, such as "sampling.pitch"; without those set to "auto"
  std::set<std::string, std::less<>> given;
  // Notes for the user, a line each: lengths without a unit ... The first laser has those of all
  std::vector<std::string> notes;
  std::vector<Light> lights;
  std::vector<Material> materials;  // [0] is the default of an object that names none
  std::vector<Object> objects;

  Channels channels() const { return {channel_of(hologram.wavelength_m), colour.has_value()}; }
};

/// Reads and checks a scene file (docs/scene.md lists every key): the scenes of all lasers, in the
/// order of hologram.wavelength; one where it is one wavelength or colour.only names one. They
/// differ in what depends on the wavelength alone.
///
/// overrides  "section.key=value" each, the value as TOML or a bare string ("wrp.padding=1.25",
///            "hologram.pitch=8 um", "object.0.width=9 mm", "materials.gold.shininess=40"); applied
///            before checks
/// throws     InputError: one line with file, line and what would be right
std::vector<Scene> load_scenes(const std::filesystem::path& file,
                               const std::vector<std::string>& overrides = {});
std::vector<Scene> parse_scenes(const SceneText& text,
                                const std::vector<std::string>& overrides = {});

// What the eye sees through an eyepiece: a thin lens before the hologram ([viewer] eyepiece). It
// shows the plane z at another distance, given in dioptres: one over the distance, in metres, from
// the eyepiece to where the eye sees it. 0 D is infinitely far away; below 0 D no eye can focus.

/// The plane that is seen at so many dioptres. With the lens at z = -e, of focal length f,
///   1 / (z + e) = 1 / f + dioptres.
///
/// throws  InputError without an eyepiece, and where there is no such plane
double depth_of_dioptres(const ViewerSpec& viewer, double dioptres);

/// What an eye makes out of the plane z_m: 1 arc minute. Behind a thin lens it sees what is beyond
/// the lens under the angle that it has there, in focus however near it is.
double detail_for_eye_m(const ViewerSpec& viewer, double z_m);

/// The dioptres at which the plane z_m is seen; it must lie beyond the eyepiece, z_m > -e.
double dioptres_of_depth(const ViewerSpec& viewer, double z_m);

/// A pupil that a hologram is looked at through: a disc in a plane on the eye's side. Light that
/// leaves the hologram's place h with the slope s, over the distance travelled, meets that plane at
/// a h + b s: before a bare SLM a is 1 and b the distance; behind an eyepiece, in its focal plane,
/// a is 0 and b the focal length.
struct Pupil {
  double diameter_m = 4e-3;
  glm::dvec2 centre_m{0, 0};
  double a = 1, b_m = 0.25;

  /// Where light from the picture's place x_m in the plane z_m to the pupil's place at_m passes the
  /// hologram, along one axis.
  double through_m(double x_m, double z_m, double at_m) const {
    return (b_m * x_m + z_m * at_m) / (a * z_m + b_m);
  }
  /// Distance between the places of the pupil's plane where the SLM's orders meet it: the eyebox.
  glm::dvec2 eyebox_m(const HologramSpec& hologram) const {
    return hologram.wavelength_m * std::abs(b_m) / hologram.pitch_m;
  }
};

/// The pupil of a viewer at a place.
///
/// throws  InputError where the eye would stand in the hologram or in an image of it
Pupil pupil_at(const ViewerSpec& viewer, glm::dvec2 place_m);
/// At each of the viewer's places.
std::vector<Pupil> pupils_of(const ViewerSpec& viewer);

}  // namespace raywave
