// SPDX-License-Identifier: Apache-2.0
/// What an animation shows when: values between keys, the scene of a picture, and which holograms
/// show it.
#pragma once

#include <glm/vec3.hpp>
#include <set>
#include <vector>

#include "host/scene/scene.hpp"

namespace raywave {

/// Value of a track at a time, in pictures. Between keys k and k + 1, with s from 0 to 1:
///
/// hold    that of k
/// linear  v_k + s (v_k+1 - v_k)
/// cubic   Hermite's curve through both, with the slope (v_k+1 - v_k-1) / (t_k+1 - t_k-1) at key k;
///         at the ends that of the line to the only neighbour. A closed track has neighbours there,
///         too: slope ((v_1 - v_0) + (v_n - v_n-1)) / ((t_1 - t_0) + (t_n - t_n-1)) at both ends
glm::dvec3 value_at(const Track& track, double time);

/// The scene with the meshes of its tracks as shapes of their objects.
Scene with_shapes(Scene scene);

/// The scene with everything where it is at a time. Objects that have a track move as solids
/// (Object::solid_scale) at all times.
///
/// scene   with an animation; of tracks of meshes, with_shapes has made it
/// throws  InputError when a light's direction or a scale that lies between keys is not possible,
///         or a node of a glTF file is stretched unevenly
Scene scene_at(const Scene& scene, double time);

/// What the viewer looks at, and through; depth_m stays empty where neither file nor track gives
/// it. View and aperture stay in their ranges, whatever cubic steps would make of them.
Camera camera_at(const Animation& animation, double time);

/// Objects and lights that have a track.
std::set<std::size_t> moving_objects(const Animation& animation);
std::set<std::size_t> moving_lights(const Animation& animation);

/// Which holograms show which picture. Holograms are numbered through the animation, and hologram j
/// has the random phases of seed + j.
class Schedule {
public:
  /// Pictures whose brightest sets the scale, or the exposure, of all.
  static constexpr int pictures_that_scale = 8;

  /// frames  of a picture, where the animation does not say: sampling.frames
  Schedule(const Animation& animation, int frames);

  /// So many pictures of as many holograms each.
  static Schedule even(int pictures, int each) { return {pictures, each}; }

  int pictures() const { return pictures_; }
  /// Number of the first hologram of a picture; of `pictures()`, the number of all holograms.
  int first_of(int picture) const;
  int count_of(int picture) const { return first_of(picture + 1) - first_of(picture); }
  int holograms() const { return first_of(pictures_); }
  /// The largest count_of.
  int most_of_a_picture() const;
  /// `most` pictures, or all where there are fewer, evenly spread from the first one on.
  std::vector<int> spread(int most) const;
  double slm_rate_per_s() const { return rate_per_s_ * each_; }

private:
  Schedule(int pictures, int each) : pictures_(pictures), rate_per_s_(1), each_(each) {}

  int pictures_;
  double rate_per_s_, each_;  // holograms per picture, on average
};

}  // namespace raywave
