// SPDX-License-Identifier: Apache-2.0
/// The stage "trace": from the world to the field on each WRP.
#pragma once

#include <cstdint>
#include <memory>
#include <tuple>
#include <vector>

#include "cl/program.hpp"
#include "host/common/npy.hpp"
#include "host/common/plane_fft.hpp"
#include "host/common/stage_clock.hpp"
#include "host/geometry/world.hpp"
#include "host/plan/plan.hpp"

namespace raywave {

class DeviceScene;
class FieldSource;
class SampleTable;

/// A field on a WRP: plane number `plane` of a stack in device memory. It has Plan::tile_size
/// samples, on a virtual plane as many as Plan::compact says.
struct WrpField {
  cl::ComplexBuffer& stack;
  int plane = 0;
  PlanePart lit{};  // of a virtual plane; only this part is filled, unless all was asked for
};

/// The properties of a plan that kernels are built for: see table_key and kernel_key in
/// trace_stage.cpp.
using TableKey = std::tuple<bool, Bounces, int, int, cl::Options>;
using KernelKey = std::tuple<TableKey, bool, bool, int, bool, Precision, int>;

/// The scene in device memory with its surface samples, which the lasers of a scene share.
struct TracedWorld {
  std::unique_ptr<DeviceScene> scene;
  std::shared_ptr<SampleTable> table;  // null: fans of rays are traced without
  TableKey built_for;                  // the table's kernels
};

/// Traces rays, finds surface samples and gathers, for successive plans of a scene that may move.
class TraceStage {
public:
  /// shared  by the stages of several lasers: that which was prepared last is the one to `run`
  TraceStage(const cl::Device& device, StageTimes& times, std::shared_ptr<TracedWorld> shared);
  ~TraceStage();

  /// Uploads the world and finds its surface samples. Kernels, trees and memory of the previous
  /// plan are reused where they fit.
  ///
  /// plan        must outlive the stage, which reads it again in `run`
  /// has_stayed  the world, since the stage of another laser was prepared, whose plan differs in
  ///             the laser alone: trees and samples are kept
  /// throws      InputError when the pixels can show no ray of a fan; DeviceError for the device
  void prepare(const World& world, const Plan& plan, bool has_stayed);

  /// Returns the field of one frame on plan.wrps[wrp], valid until the next call. Callers request
  /// the WRPs of a tile in order, once for every frame, and the frames in order.
  ///
  /// is_whole  virtual planes are filled beyond their lit part, too
  WrpField run(std::size_t wrp, int frame, bool is_whole);

  /// Number of surface samples of the plan, and how many of them need visibility rays.
  int samples() const;
  int hidden_samples() const;

  /// The world on the device, as the last plan has it.
  const DeviceScene& scene() const { return *shared_->scene; }

  /// Fields on the device times the square root of this are in the scene's brightness.
  double radiance_unit() const;

private:
  void place(const World& world, bool has_stayed);
  void find_samples(bool has_stayed);
  void make_stacks();

  cl::Device device_;
  StageTimes& times_;
  std::shared_ptr<TracedWorld> shared_;
  const Plan* plan_ = nullptr;
  std::unique_ptr<FieldSource> source_;  // refers to the plan and to what is shared
  int frames_together_ = 1;              // frames that one gathering fills
  std::vector<cl::ComplexBuffer> stacks_;
  std::vector<PlanePart> lit_;  // as many
  KernelKey built_for_;         // the kernels of source_
};

}  // namespace raywave
