// SPDX-License-Identifier: Apache-2.0
/// What stands behind the types of the installed headers. Rooms' own types are written with
/// raywave:: in front, the installed ones without.
#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <raywave/raywave.hpp>
#include <string>
#include <vector>

#include "cl/device.hpp"
#include "cl/fft.hpp"
#include "host/plan/predict/presets.hpp"
#include "host/render.hpp"
#include "host/scene/files.hpp"
#include "host/scene/read_slm.hpp"
#include "host/scene/scene.hpp"

namespace raywave::v0 {

/// Meshes and textures, read when they are first asked for. Scenes that name the same share one.
struct Files {
  std::mutex mutex;
  std::optional<SceneFiles> loaded;
};

/// Where Scene::set_pose has put an object; empty: where the scene has it.
struct Pose {
  std::optional<glm::dvec3> position_m, rotation_deg;
};

struct Scene::State {
  SceneText text;
  std::vector<std::string> overrides;
  raywave::Scene scene;
  std::vector<std::shared_ptr<const Mesh>> meshes;  // by object; null: its file's
  std::map<std::size_t, Pose> poses;                // by object
  bool is_planned = false;
  std::shared_ptr<Files> files = std::make_shared<Files>();

  /// throws  InputError when a mesh or a texture is unusable
  const SceneFiles& read_files() const;
  /// All objects in the world.
  World world() const {
    const auto& read = read_files();
    return place_objects(scene, read.meshes, read.textures);
  }
};

struct Slm::State {
  std::optional<SlmSpec> spec;  // of a scene, or the default; else the text's
  SceneText text;
  std::vector<std::string> overrides;

  SlmSpec at(double wavelength_m) const {
    return spec ? *spec : raywave::parse_slm(text, wavelength_m, overrides);
  }
};

struct Plan::State {
  raywave::Planned planned;
  std::string text, json;
  Scene scene;  // with the values chosen
};

struct Hologram::State {
  raywave::Scene scene;
  RenderResult result;               // without levels
  std::vector<std::uint8_t> levels;  // of all frames
  std::string report;
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

raywave::Goal goal_of(const Goal& goal);
raywave::HologramSpec hologram_spec(const Pixels& pixels, glm::ivec2 size);

/// The callback as the rooms call it; empty where it is.
raywave::Progress progress_of(const Progress& progress);

/// A copy of the caller's samples.
///
/// name    of the argument, for messages
/// throws  InputError when a size is not possible, or a sample is not finite
FieldStack field_of(const FieldView& field, const char* name);
void require_samples(const FieldDoubleView& field, const char* name);
Image image_of(const PictureView& picture, const char* name);
Field as_field(FieldStack stack);
FieldView view_of(const FieldStack& stack);

/// throws  InputError when a number is not finite, or beyond what a scene may have
void require_pose(std::size_t object, std::size_t objects, const Vec3& position_m,
                  const Vec3& rotation_deg);

inline glm::dvec2 vector_of(const Vec2& v) { return {v[0], v[1]}; }
inline glm::dvec3 vector_of(const Vec3& v) { return {v[0], v[1], v[2]}; }

}  // namespace raywave::v0
