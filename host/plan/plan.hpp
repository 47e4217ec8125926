// SPDX-License-Identifier: Apache-2.0
/// What will be computed: where the WRPs stand, which rays start on them, what it takes. Made by
/// host/planning/make_plan.hpp; everything after planning reads it.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "host/common/choices.hpp"
#include "host/scene/files.hpp"
#include "host/scene/scene.hpp"

namespace raywave {

// How much of a surface sample's wave the WRPs gather on its way to each part of the hologram:
// sampling.cone and sampling.apodization.

/// In half holograms, alike along both axes.
struct Cone {
  double half_width = 1.2;   // half width
  double apodization = 0.2;  // width of its soft edge, within the half width

  bool operator==(const Cone&) const = default;

  /// Share of the amplitude that arrives `at` so many half holograms from the middle; as
  /// kernels/gather/gather.cl has it.
  double passed(double at) const;

  /// Relative L2 error of the hologram's field against the whole wave, which is 1 everywhere.
  double field_error() const;
};

struct World;

/// Standard deviation of the Gaussian blur, over the detail that counts. It stands for a viewer who
/// resolves no more.
inline constexpr double blur_of_resolution = 0.6;

/// Cells along a sampling pitch in which a surface that is blended is there or not: the rays of a
/// sample meet different ones, and floats tell them apart.
inline constexpr double blend_cells_of_pitch = 32;

/// Pixels of a plane with so many columns and rows.
inline std::size_t area_of(glm::ivec2 size) {
  return static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y);
}

/// A window of the hologram that is computed on its own. All tiles have one size, and overlap where
/// that does not divide the hologram's.
struct Tile {
  glm::ivec2 first{0, 0};     // its top left pixel
  glm::dvec2 centre_m{0, 0};  // world
};

/// The hologram, and what its pixels can show.
struct HologramPlan {
  glm::ivec2 size{1, 1};  // pixels
  glm::dvec2 pitch_m{1, 1};
  double wavelength_m = 1;
  std::optional<ColourSpec> colour;  // of scenes in colour
  int frames = 1;                    // holograms with independent random phases
  std::uint32_t seed = 1;            // random phases of frame 0; frame i has seed + i
  // Sine of the steepest ray to the optical axis that the SLM's pixels can show, per axis
  glm::dvec2 largest_sine{1, 1};
  double band_filled = 0;  // share of the SLM's band that the scene's light needs, mean of the axes
};

struct Tiling {
  glm::ivec2 grid{1, 1};       // {1, 1}: the hologram is computed in one piece
  glm::ivec2 tile_size{1, 1};  // pixels of a tile and of every WRP
  std::vector<Tile> tiles{1};  // row by row from the top left
  std::string why;             // as many; empty: in one piece it fits
  // Plan::cone in half tiles: as far beyond a tile's borders, where the padded plane holds it
  glm::dvec2 cone{1, 1};
  glm::dvec2 apodization{0, 0};
};

/// Where the surfaces are.
struct SceneExtent {
  // Depths of the surfaces nearest to the eye and farthest from it, world z
  double near_m = 0, far_m = 0;
  double closest_m = 0;    // smallest distance of surfaces from the hologram's plane
  glm::dvec3 origin_m{0};  // of the scene frame, in world coordinates: middle of the scene

  /// Largest distance of surfaces from the hologram's plane.
  double farthest_m() const { return std::max(std::abs(near_m), std::abs(far_m)); }
};

/// One wavefront recording plane: parallel to the hologram, and as large as the tile that its light
/// goes to.
struct Wrp {
  glm::dvec3 centre_m{0};         // world
  std::vector<glm::dvec2> fan{};  // tangents (dx/dz, dy/dz) of the rays that start at its centre
  std::size_t layer = 0;          // of Plan::layers
  std::size_t tile = 0;           // of Tiling::tiles
};

/// The rays from the hologram's centre whose hits are the surface samples: ray (i, j) has the
/// tangents ((first + (i, j) + 1/2) step).
struct LatticePlan {
  double step = 1;  // tangent between neighbours
  // Distance from the hologram at which they are the sampling pitch apart: the scene's middle
  double full_z_m = 1;
  glm::ivec2 first{0, 0};
  glm::ivec2 size{1, 1};
  glm::dvec3 eye_m{0, 0, 0};  // where the rays start, world: the hologram's centre, or before it
};

/// A layer of depth, and the WRPs side by side at one distance that collect the light of its
/// surface samples. Each tile has WRPs of its own.
struct DepthLayer {
  // From the WRPs to the hologram along the light; negative where they lie before it, z < 0
  double distance_m = 0;
  // Depths of its samples, world z: begin <= z < end
  double begin_m = -std::numeric_limits<double>::infinity(),
         end_m = std::numeric_limits<double>::infinity();
  glm::dvec3 min_m{0}, max_m{0};  // box of the surfaces in it, world
  glm::ivec2 grid{1, 1};          // of a tile's WRPs, at most

  /// Smallest and largest distance of its surfaces from the hologram's plane; they lie on one side
  /// of it.
  double closest_m() const { return std::min(std::abs(min_m.z), std::abs(max_m.z)); }
  double farthest_m() const { return std::max(std::abs(min_m.z), std::abs(max_m.z)); }
};

/// Light from mirrors and glass as the hologram's centre sees it: where it seems to come from, by
/// rays through even steps of tangents (host/planning/images.hpp).
struct Images {
  struct Image {
    int ray = 0;         // that sees it, row by row
    glm::dvec3 at_m{0};  // virtual point, world
    double share = 1;    // of the light of its source that reaches the hologram
    int surfaces = 1;    // mirrors and glass on the way
  };
  std::vector<Image> all;  // by ray
  glm::dvec2 low{0};       // tangents of the corner of the first ray's cell
  double step = 0;         // tangent between neighbouring rays
  glm::ivec2 size{0, 0};   // rays
  double rays = 0;         // that meet mirrors or glass first
  double segments = 0;     // of all paths that start with these, which end at a surface
  double lost = 0;         // and those that end nowhere
  // Light of images that lie on the hologram's other side, or not within near_m to far_m, over that
  // of all
  double beyond = 0;
  // Depths within which the others lie, but for a few, and all surfaces; world z
  double near_m = 0, far_m = 0;
  // How far the radiance of what mirrors and glass show is off, as a share, root mean square: with
  // virtual points; with fitted paths; with these on virtual planes
  double points_error = 0, paths_error = 0, coupled_error = 0;
  // Share of that light which folds over the window, near caustics: no fitted path tells of it.
  // Instead, it shines from the depth folded_m
  double folded = 0, folded_m = 0;

  bool holds(const Image& image) const { return near_m <= image.at_m.z && image.at_m.z <= far_m; }
};

/// Light by way of mirrors and glass.
struct SpecularPlan {
  int bounces = 0;               // trace.depth where an object is one of them
  Bounces as = Bounces::points;  // never automatic
  Images images;                 // of samples that are seen in mirrors and through glass
};

/// What all carriers tell of the planes on which they gather: here, planes as large as tiles.
struct TilePlanes {
  static constexpr WrpPropagation setting = WrpPropagation::spectrum;  // wrp.propagation of it
  static constexpr const char* plane_name = "WRP";
  // Whether they have all light of their tile, wherever it crosses them
  static constexpr bool hold_all_light = false;
  glm::ivec2 gathered_size(glm::ivec2 tile_size) const { return tile_size; }
  int row_stride(glm::ivec2 tile_size) const { return tile_size.x; }
};

/// Samples are gathered at the hologram itself, and nothing is propagated.
struct AtHologram : TilePlanes {};

/// Light is gathered on WRPs, and propagated to the hologram by the shifted angular spectrum.
struct SpectrumWrps : TilePlanes {
  double padding = 2;       // side of the transformed plane over the side of a tile
  glm::ivec2 padded{1, 1};  // size that is transformed
};

/// Light travels by virtual planes, one of Plan::wrps for each tile and layer
/// (host/carriers/virtual_planes/planning/planes.hpp).
struct VirtualPlanes {
  static constexpr WrpPropagation setting = WrpPropagation::compact;
  static constexpr const char* plane_name = "virtual plane";
  static constexpr bool hold_all_light = true;
  glm::ivec2 size{64, 64};     // samples, multiples of 16: as many are transformed
  double window_strength = 9;  // strength of the window that is divided out at the hologram
  // Pixels of a footprint beyond its rays; `rough`: where something hides the sample, or its light
  // becomes too steep
  double margin_px = 4, rough_margin_px = 8;
  int lines = 4;  // scan lines of a sample without sharp highlights, at most
  // At least so many have samples whose highlights change over the hologram, and as much margin
  int highlight_lines = 1;
  double highlight_margin_px = 4;
  // A sample has fewer where its error of them stays below this, relative; 0: all have as many
  double lines_tolerance = 0;
  // Predicted relative L2 errors of the field (errors.cpp beside it)
  double window_error = 0, lines_error = 0;
  // Of light that is the scene's sharpest highlights alone, between the scan lines; no part of
  // error(), since most light is of other kinds
  double highlights_error = 0;

  double error() const { return std::hypot(window_error, lines_error); }
  /// Scan lines of any sample, at most.
  int most_lines() const { return std::max(lines, highlight_lines); }
  glm::ivec2 gathered_size(glm::ivec2) const { return size; }
  /// Samples in memory from a row to the next. Rows a multiple of 4 KiB apart begin at the same
  /// place of a cache's sets: columns would take a fifth longer to transform.
  int row_stride(glm::ivec2 = {}) const { return size.x % 512 == 0 ? size.x + 8 : size.x; }
};

/// How light travels from the surface samples, or along the rays of fans, to the hologram: a folder
/// of host/carriers each.
using CarrierPlan = std::variant<SpectrumWrps, VirtualPlanes, AtHologram>;

/// The surface samples, whose light is gathered.
struct SamplesPlan {
  bool aimed = true;   // rays are aimed at surface samples; else they form a fan
  double pitch_m = 1;  // on surfaces, at the lattice's depth full_z_m
  int antialias = 4;   // rays per side of a sample's cell; 0: one through its centre
  // Parts per side of the hologram's window in the visibility mask of a sample; 0: nothing hides
  // anything
  int visibility_parts = 8;
};

/// The lights and materials of the scene that a plan was made for.
struct Lighting {
  std::vector<Light> lights;
  std::vector<Material> materials;  // of the scene, then those that meshes bring (World::materials)
  std::vector<std::int32_t> material_of_object;  // index into `materials`
  bool shadows = false;                          // objects keep light from each other
  int shadow_rays = 16;                          // TraceSpec::shadow_rays
  int diffuse_rays = 0;                          // TraceSpec::diffuse_rays
  int gloss_rays = 0;                            // TraceSpec::gloss_rays, 0 without highlights
  std::int32_t first_of_meshes = 0;              // of `materials`
  std::vector<std::int32_t> used{};              // of `materials`, that some triangle has
  // TEXTURES_NONE, TEXTURES_PLAIN or TEXTURES_LOOKS of kernels/scene/options.h: what of the used
  // materials changes from place to place
  int textures = 0;
  bool normal_maps = false;
  // Whether the used materials are there everywhere; opaque is less than mask, and mask than blend
  AlphaMode alpha = AlphaMode::opaque;

  /// Index into `materials` of a triangle's material.
  ///
  /// object       the number of its object
  /// of_its_mesh  World::material_of the triangle
  std::int32_t material_of(std::size_t object, std::int32_t of_its_mesh) const {
    return of_its_mesh < 0 ? material_of_object[object] : first_of_meshes + of_its_mesh;
  }
  /// True when `test` holds for a material that some triangle has.
  template <class Test>
  bool any_material(const Test& test) const {
    return std::ranges::any_of(
        used, [&](std::int32_t i) { return test(materials[static_cast<std::size_t>(i)]); });
  }
};

/// The pictures of the lights, by light; null where a light has none.
std::vector<std::shared_ptr<const Image>> environments_of(const Textures& textures,
                                                          const Lighting& lighting);

/// Lights and materials of a scene whose objects are placed.
Lighting lighting_of(const Scene& scene, const World& world);

/// Everything that the stages after planning need to know of the scene, beside its World.
struct Plan {
  std::string scene_name;  // file of the scene, the start of messages
  HologramPlan hologram;
  Tiling tiling;
  SlmSpec slm;                           // refined phases are encoded as phases, whatever it says
  std::optional<RefineSettings> refine;  // with a blur
  Lighting lighting;
  SceneExtent extent;
  std::vector<DepthLayer> layers;  // front to back; every depth belongs to one of them
  int most_layers = 1;             // asked for, where no distance is given
  // Tile by tile, layer by layer, row by row from the top left; when rays are aimed, without those
  // that no light falls into
  std::vector<Wrp> wrps;
  glm::ivec2 grid{1, 1};  // holograms side by side that cover the WRPs of all layers
  CarrierPlan carrier;
  std::string why_carrier;  // where wrp.propagation is "auto"; empty: as the scene says
  SamplesPlan samples;
  LatticePlan lattice;
  SpecularPlan specular;
  Cone cone{1, 0};                  // that a pixel gathers, in half holograms
  bool beyond_diffraction = false;  // some light of the scene would be steeper than pixels show
  Precision precision = Precision::floats;

  Channels channels() const {
    return {channel_of(hologram.wavelength_m), hologram.colour.has_value()};
  }
  bool is_at_hologram() const { return std::holds_alternative<AtHologram>(carrier); }
  bool holds_all_light() const {
    return std::visit([](const auto& c) { return c.hold_all_light; }, carrier);
  }
  /// Null where light travels in another way.
  const VirtualPlanes* virtual_planes() const { return std::get_if<VirtualPlanes>(&carrier); }
  /// Light from mirrors and glass comes from samples; rays of fans follow it by themselves.
  bool has_specular_samples() const { return samples.aimed && specular.bounces > 0; }
  const DepthLayer& layer_of(const Wrp& wrp) const { return layers[wrp.layer]; }
  const Tile& tile_of(const Wrp& wrp) const { return tiling.tiles[wrp.tile]; }
  // Sides of the hologram
  glm::dvec2 window_m() const { return glm::dvec2(hologram.size) * hologram.pitch_m; }
  glm::dvec2 tile_window_m() const { return glm::dvec2(tiling.tile_size) * hologram.pitch_m; }
  /// WRPs of the tile that has most.
  std::size_t most_wrps_of_a_tile() const;
  /// Places in `wrps` of a tile's first WRP and of the one after its last.
  std::pair<std::size_t, std::size_t> wrps_of(std::size_t tile) const;
  /// The layer that a surface at this depth belongs to.
  const DepthLayer& layer_at(double z_m) const;
  /// Columns and rows of the fields that are gathered.
  glm::ivec2 gathered_size() const {
    return std::visit([&](const auto& c) { return c.gathered_size(tiling.tile_size); }, carrier);
  }
  /// Pixels in memory of a gathered field.
  std::size_t gathered_pixels() const;
};

/// Samples in mirrors and glass have polynomials of their paths.
inline bool has_fitted_paths(const Plan& plan) {
  return plan.has_specular_samples() && plan.specular.as == Bounces::paths;
}

/// Relative L2 error of the field by what the cone leaves out of each sample's wave;
/// 0 for fans and where every pixel receives every sample.
double cone_error_of(const Plan& plan);

/// True when the levels of a tile depend on the others: the encoding asks how bright the hologram
/// is as a whole, or limits its band.
bool encodes_whole(const Plan& plan);
/// True when levels are made of the transforms of virtual planes in one pass: nothing else adds to
/// the field of a tile, and nothing else needs it.
bool encodes_transforms(const Plan& plan, bool keep_field);

/// Borders of what the WRPs of a layer cover; `first` beyond `last` where it has none.
struct WrpsExtent {
  glm::dvec2 first, last;
};
WrpsExtent wrps_extent(const Plan& plan, const DepthLayer& layer);

/// Unit of the fields on devices, which add up waves sqrt(radiance) / r, one for each sample: times
/// this length, |u|^2 is the irradiance of the scene's radiance, whatever the sampling pitch
/// (docs/conventions.md#brightness).
inline double amplitude_unit_m(const Plan& plan) { return plan.samples.pitch_m; }

/// Depths of a layer's samples as devices compare them, scene frame.
std::pair<float, float> layer_bounds(const Plan& plan, const DepthLayer& layer);

}  // namespace raywave
