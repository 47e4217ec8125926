// SPDX-License-Identifier: Apache-2.0
/// The stage "refine": from the traced fields to phases whose pictures are what a lens sees.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "host/common/stage_clock.hpp"
#include "host/plan/plan.hpp"
#include "host/propagate/tile_field.hpp"
#include "host/refine/light.hpp"
#include "host/refine/refine.hpp"
#include "host/refine/scene_keys.hpp"
#include "host/trace/device_scene.hpp"

namespace raywave {

/// Phases that are encoded instead of the traced fields, and how they came about.
struct Refined {
  FieldStack phases;             // samples of modulus 1, as many frames as were traced; if kept
  std::vector<KeyPlace> places;  // that the pictures were made for
  std::vector<RefineKey> keys;   // pictures that a lens sees there, or the samples' light
  RefineFigures figures;
  double brightness = 1;  // RefineResult::brightness
};

/// Settings of the iterations: Plan::refine's, with a number of iterations for these pictures.
///
/// size   of the hologram
/// panel  RefineSpec::panel of an earlier call, of the same SLM; null: there was none
RefineSpec refine_spec(const RefineSettings& settings, const SlmSpec& slm, glm::ivec2 size,
                       glm::dvec2 pitch_m, double wavelength_m, const std::vector<RefineKey>& keys,
                       std::shared_ptr<const Panel> panel = {});

/// How pictures are made by Plan::refine.
KeyPictures key_pictures(const RefineSettings& settings);

class RefineStage {
public:
  /// progress  called with the current step and the completed share, 0 to 1, when given
  RefineStage(const cl::Device& device, cl::FftBackend backend, StageTimes& times,
              std::function<void(const std::string&, double)> progress);

  /// plan    without Plan::refine, `take` and `run` do nothing; must outlive `run`
  /// start   the fields to begin with; null: those that `take` brings
  /// throws  InputError when it has another size or other frames than the plan
  void prepare(const Plan& plan, const FieldStack* start);

  /// Takes the phases of a tile of a frame, unless `prepare` was given them. Its brightness does
  /// not count.
  ///
  /// field    no transform
  /// returns  the same
  const TileField& take(const TileField& field, std::size_t tile, int frame);

  /// Makes the pictures, and refines the fields' phases towards them.
  ///
  /// table  of surface samples; null: there is none
  /// throws InputError when a lens sees nothing, DeviceError for the device
  void run(const DeviceScene& scene, const SampleTable* table);
  /// The result of a frame: rows without gaps, valid until the next call.
  const cl::ComplexBuffer& phases(int frame) { return refiner_->holograms().frame(frame); }

  /// The result, once.
  ///
  /// keep_phases  Refined::phases are wanted
  Refined finish(bool keep_phases);
  /// Frees the device's memory.
  void release() { refiner_.reset(); }

private:
  cl::Device device_;
  cl::FftBackend backend_;
  StageTimes& times_;
  std::function<void(const std::string&, double)> progress_;
  const Plan* plan_ = nullptr;
  bool has_start_ = false;
  std::shared_ptr<const Panel> panel_;  // from the first run on: the SLM stays
  std::optional<Refiner> refiner_;
  Refined refined_;
};

}  // namespace raywave
