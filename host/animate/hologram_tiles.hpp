// SPDX-License-Identifier: Apache-2.0
/// A hologram that is made tile by tile, for prints that no memory and no picture holds as a whole
/// (docs/devices.md#tiles).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "cl/device.hpp"
#include "cl/fft.hpp"
#include "host/animate/animate.hpp"
#include "host/animate/frame_files.hpp"
#include "host/animate/timeline.hpp"
#include "host/geometry/world.hpp"
#include "host/plan/plan.hpp"
#include "host/render.hpp"
#include "host/scene/scene.hpp"

namespace raywave {

/// throws  InputError where a hologram has one tile, or a setting is for the whole
void require_tiles(const Plan& plan);

/// A hologram that is planned as a whole. Its tiles, the pictures of FrameFiles, are made in any
/// order, by one program or several; their bits are the same. Levels of phases are those of
/// render(); amplitudes share a scale that not all of them are looked at for.
class HologramTiles {
public:
  /// folder  as Animator's
  /// throws  InputError for the scene, and as require_tiles
  HologramTiles(const cl::Device& device, Scene scene, cl::FftBackend fft,
                std::filesystem::path folder = {});

  const Scene& scene() const { return scene_; }
  const Plan& plan() const { return plan_; }
  const Schedule& schedule() const { return schedule_; }
  glm::ivec2 stored_size() const { return plan_.tiling.tile_size; }
  std::vector<std::string> laser_names() const { return {}; }
  std::vector<std::string> notes(const PlanNotes& of_plan) const;
  /// As Animator's.
  std::string run_name(FrameStorage storage) const;
  AnimateResult make_frames(FrameFiles& files, const Progress& progress) const;

private:
  double brightest(Renderer& renderer, bool is_part) const;

  cl::Device device_;
  Scene scene_;
  cl::FftBackend fft_;
  std::filesystem::path folder_;
  World world_;
  Plan plan_;
  Schedule schedule_;
};

}  // namespace raywave
