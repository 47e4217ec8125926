// SPDX-License-Identifier: Apache-2.0
/// Section [animation]: what changes from picture to picture, as the user describes it
/// (docs/animation.md). host/animate/timeline.hpp computes the scene of a picture.
#pragma once

#include <cstddef>
#include <filesystem>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "host/scene/gltf_motion.hpp"
#include "host/scene/light.hpp"

namespace raywave {

class Section;

/// How a value gets from one key to the next: it stays and then jumps; in a straight line; along a
/// cubic Hermite curve whose slope at a key is that between the keys beside it (Catmull-Rom).
enum class Steps { hold, linear, cubic };

/// What a track changes. Values of one or two numbers leave the others of a key at 0.
enum class Animated {
  // Metres, of the object's anchor: the middle of the box that it has where the file puts it unless
  // the scene says otherwise
  object_position,
  object_rotation,  // degrees about x, then y, then z, as in [[object]]
  object_scale,     // times the size in the file, > 0
  object_mesh,      // Object::shape: the number of the key's mesh
  light_direction,
  light_position,
  light_intensity,
  camera_depth,  // metres, > 0
  camera_view,
  camera_aperture
};

/// Values of one thing over time. Before the first key and after the last one it stays.
struct Track {
  Animated what = Animated::object_position;
  std::size_t index = 0;  // of the object or light
  Steps steps = Steps::linear;
  // The last key comes before the first one again: cubic steps are smooth there, too
  bool closed = false;
  std::vector<double> at;  // pictures, ascending, 0 is the first; as long as `values`
  std::vector<glm::dvec3> values;
  std::vector<std::filesystem::path> meshes;  // of object_mesh, one for each key
  std::string where;  // "scene.toml:41: track 0", the start of messages about it
};

/// Through which part of the hologram a viewer looks, and where at (LensSpec, ReconstructSpec).
struct Camera {
  std::optional<double> depth_m;       // in focus; empty: the middle of the first picture's depth
  glm::dvec2 view{0, 0};               // half holograms
  glm::dvec2 aperture{1, 1};           // holograms
  std::optional<glm::dvec2> window_m;  // empty: all objects in all pictures
};

struct Animation {
  static constexpr int most_pictures = 1'000'000, most_subframes = 64;

  int pictures = 1;
  double rate_per_s = 24;  // of pictures
  // Of the SLM's holograms, >= rate_per_s; each shows the picture of its time, so that 60 for 24
  // shows pictures 3 and 2 times in turn. Empty: `subframes` times the rate
  std::optional<double> slm_rate_per_s;
  std::optional<int> subframes;  // holograms of each picture; empty: sampling.frames
  Camera camera;
  std::vector<Track> tracks;
  std::optional<GltfMoves> gltf;  // what the nodes of the scene's glTF file move
};

/// Reads and checks the section.
///
/// objects  that tracks may name, from 0
/// gltf     of the key "gltf", which has been read: what it moves has no tracks; without `frames`,
///          its last key is the end of the animation
/// throws   InputError with file and line
Animation read_animation(Section section, std::size_t objects, const std::vector<Light>& lights,
                         std::optional<GltfMoves> gltf);

}  // namespace raywave
