// SPDX-License-Identifier: Apache-2.0
/// A way for light to travel from the surface samples, or along the rays of fans, to the hologram.
/// Each has a folder of its own beside this file; host/render.cpp chooses by the plan.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "cl/fft.hpp"
#include "host/common/stage_clock.hpp"
#include "host/plan/plan.hpp"
#include "host/propagate/tile_field.hpp"
#include "host/trace/samples.hpp"

namespace raywave {

struct CarrierOptions {
  cl::FftBackend fft = cl::FftBackend::host;
  bool keep_field = true;  // samples are wanted of `carry`, always
  // Called before a plane of the plan (its number in Plan::wrps) is filled in a frame
  std::function<void(std::size_t wrp, int frame)> filling;
  // Called with what a plane holds then: plane number `plane` of the stack; all of it is filled
  std::function<void(std::size_t wrp, const cl::ComplexBuffer& stack, int plane)> filled;
};

/// The verbs in their order: `fit`, `prepare`, `carry` tile by tile and frame by frame.
class Carrier {
public:
  virtual ~Carrier() = default;

  /// Makes the propagation fit a plan, before its samples are found: refuses at once what cannot
  /// be done.
  ///
  /// plan    of the same hologram; must outlive what is carried
  /// throws  InputError when no light of some WRP arrives at the hologram
  virtual void fit(const Plan& plan) = 0;

  /// Makes kernels fit the plan, the scene in device memory and its samples. What served the plan
  /// before is kept where it still does.
  ///
  /// scene  outlives what is carried
  /// table  null: rays of fans need none
  virtual void prepare(const DeviceScene& scene, std::shared_ptr<const SampleTable> table) = 0;

  /// Frees what holds the samples; `prepare` comes next.
  virtual void release() = 0;

  /// The light of a tile at the hologram in one frame, valid until the next call. The frames of a
  /// tile come in order.
  virtual TileField carry(std::size_t tile, int frame) = 0;

  /// Adds lines about light that is lost on its way.
  virtual void add_notes(std::vector<std::string>& notes) const = 0;
};

}  // namespace raywave
