// SPDX-License-Identifier: Apache-2.0
/// What stands behind the types of the installed headers. Rooms' own types are written with
/// raywave:: in front, the installed ones without.
#pragma once

#include <concepts>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <raywave/raywave.hpp>
#include <string>
#include <utility>
#include <vector>

#include "cl/device.hpp"
#include "cl/fft.hpp"
#include "host/common/error.hpp"
#include "host/forecast/presets.hpp"
#include "host/render.hpp"
#include "host/scene/files.hpp"
#include "host/scene/read_slm.hpp"
#include "host/scene/scene.hpp"
#include "host/view/colour_picture.hpp"

namespace raywave::v0 {

/// Object::mesh of one that no file holds.
constexpr const char* in_memory = "(mesh in memory)";

/// Meshes and textures, read when they are first asked for. Scenes that name the same share one.
struct Files {
  std::mutex mutex;
  std::optional<SceneFiles> loaded;
};

/// Where Scene::set_pose has put an object; empty: where the scene has it.
struct Pose {
  std::optional<glm::dvec3> position_m, rotation_deg;
};

/// A goal, and what was planned for it, by laser.
struct Promise {
  raywave::Goal goal;
  std::vector<Planned> planned;
};

struct Scene::State {
  SceneText text;
  std::vector<std::string> overrides;
  std::vector<raywave::Scene> scenes;               // of each laser; one of one wavelength
  std::vector<std::shared_ptr<const Mesh>> meshes;  // by object; null: its file's
  std::map<std::size_t, Pose> poses;                // by object
  bool is_planned = false;
  std::shared_ptr<const Promise> promise;  // of a plan with a goal
  std::shared_ptr<Files> files = std::make_shared<Files>();

  /// throws  InputError when a mesh or a texture is unusable
  const SceneFiles& read_files() const;
  /// All objects in the world.
  World world() const {
    const auto& read = read_files();
    return place_objects(scene(), read.meshes, read.textures);
  }
  /// The lasers' scenes differ in what depends on the wavelength alone.
  const raywave::Scene& scene() const { return scenes.front(); }
};

struct Slm::State {
  // Of a scene, or the default; else the text's. With several lasers, those of each wavelength
  std::vector<SlmSpec> specs;
  std::vector<double> wavelengths_m;  // of several lasers, as many
  SceneText text;
  std::vector<std::string> overrides;

  /// throws  InputError when the SLM is that of several lasers, and this is the wavelength of none
  SlmSpec at(double wavelength_m) const;
};

struct Plan::State {
  std::vector<raywave::Planned> planned;  // of each laser
  std::string text, json;
  std::vector<std::string> warnings;
  Scene scene;  // with the values chosen
};

struct Hologram::State {
  struct Laser {
    RenderResult result;  // whose levels and fields are below
    std::string report;
  };
  std::shared_ptr<const Scene::State> scene;  // with the values chosen
  std::vector<Laser> lasers;                  // one of one wavelength
  std::vector<std::uint8_t> levels;           // of all lasers and frames, and so on
  FieldStack field;                           // empty: none was kept
  std::optional<FieldStack> refined;
  std::optional<LaserSet> colour;
  std::vector<double> powers;
  std::string report;  // of all
  std::vector<std::string> notes;

  /// Samples of a laser.
  std::size_t size() const { return levels.size() / lasers.size(); }
};

/// A device opened for work, and its FFT.
struct Opened {
  cl::Device device;
  cl::FftBackend fft;
};

/// throws  InputError for an unknown FFT, DeviceError when there is no such device, or this process
///         was forked from one that has opened a device
Opened open(const DeviceOptions& on);
cl::DeviceInfo device_info(const std::string& device);

/// The holograms as they were rendered: a copy, without phases that were refined.
Rendered rendered_of(const Hologram& hologram);

raywave::Goal goal_of(const Goal& goal);
raywave::HologramSpec hologram_spec(const Pixels& pixels, glm::ivec2 size);

/// The callback as the rooms call it; empty where it is.
raywave::Progress progress_of(const Progress& progress);

/// name    of the argument, for messages
/// throws  InputError when a size is not possible, or a sample is not finite
void require_samples(const FieldView& field, const char* name);
void require_samples(const FieldDoubleView& field, const char* name);
/// A copy of the caller's samples, required as above.
FieldStack field_of(const FieldView& field, const char* name);
Image image_of(const PictureView& picture, const char* name);
/// Of three channels.
RgbPicture rgb_of(const PictureView& picture, const char* name);
Field as_field(FieldStack stack);

/// Refuses a number beyond those that there are, counted from 0.
///
/// what  "object"
void require_one_of(const char* what, std::integral auto number, std::integral auto count) {
  if (std::cmp_greater_equal(number, 0) && std::cmp_less(number, count)) return;
  throw InputError(std::string(what) + " " + std::to_string(number) + ": there are " +
                   std::to_string(count) + ", counted from 0");
}

/// throws  InputError when there is no such object, or a number is not finite or beyond what a
///         scene may have
void require_pose(std::size_t object, std::size_t objects, const Vec3& position_m,
                  const Vec3& rotation_deg);

inline glm::dvec2 vector_of(const Vec2& v) { return {v[0], v[1]}; }
inline glm::dvec3 vector_of(const Vec3& v) { return {v[0], v[1], v[2]}; }

}  // namespace raywave::v0
