// SPDX-License-Identifier: Apache-2.0
/// The field that aimed gathering puts on a plane, and the hologram made of such planes, in double
/// precision from the sample table as the device has it: the same samples, phases, footprints,
/// apodization, visibility, padding and band. The oracle of kernels/gather/gather.cl and of the
/// whole pipeline.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "host/geometry/shared_types.hpp"
#include "host/plan/placed_lights.hpp"
#include "host/plan/plan.hpp"
#include "host/reference/propagation.hpp"
#include "host/scene/scene.hpp"

namespace raywave::reference {

/// The input of the device's gathering, by reference.
struct Gathering {
  const Plan& plan;
  std::vector<PlacedLight> lights;  // lights of the scene, without ambient ones
  std::span<const device::Sample> samples;
  std::span<const std::uint32_t> lit;               // light_words per sample
  std::size_t light_words = 1;                      // DeviceScene::light_words
  double plane_wave_spots = 0;                      // as Gatherer has it
  std::span<const std::uint32_t> visibility_masks;  // masks of the samples, as SampleTable has them
  int visibility_parts = 8;
};

/// exp(2 pi i turns)
std::complex<double> turned(double turns);
double cubic_spline(double x);
/// Whether part (i, j) of the window sees a sample; beyond it, as the outermost part.
bool is_seen(const Gathering& what, std::size_t sample, int i, int j);

/// The random phase as a factor of the wave of a sample: exp(i phase), and its conjugate for
/// samples before the hologram (docs/conventions.md#both-sides-of-the-hologram).
std::complex<double> phasor_of(const Gathering& what, std::size_t sample, std::uint32_t seed);

/// Amplitude of a sample's light in a direction (z = -1, of any length), at unit distance.
double amplitude_towards(const Gathering& what, std::size_t sample, glm::dvec3 towards);

/// Share of a partly hidden sample's light that reaches a place of the hologram: its visibility
/// mask, smoothed by cubic B-splines. Parts beyond the window see what the outermost see.
///
/// place_m  world, z = 0
double smooth_share(const Gathering& what, std::size_t sample, glm::dvec2 place_m);

/// One sample's light at one pixel of a plane, cut geometrically, without the random phase. Hidden
/// parts are smooth in plans at the hologram, else as the visibility mask has them.
/// pixel_m: world.
struct AimedRay {
  std::complex<double> wave = 0;
  bool unsure = false;  // an edge passes closer than floats tell
};
AimedRay aimed_ray(const Gathering& what, std::size_t sample, glm::dvec3 pixel_m);

struct GatheredField {
  Field field;  // light of the samples of the WRP's layer, as Gatherer::gather fills it
  // Pixels at which floats may decide otherwise whether some sample is seen or gathered, and how
  std::vector<bool> unsure;
};
GatheredField gather(const Gathering& what, const Wrp& wrp, std::uint32_t seed);

/// Centre of pixel `index` of a plane of the hologram's size.
glm::dvec3 pixel_m(const Plan& plan, glm::dvec3 centre_m, std::size_t index);

/// The fields of plan.wrps carried to the hologram and added up.
Field hologram(const Plan& plan, std::span<const Field> wrps);

}  // namespace raywave::reference
