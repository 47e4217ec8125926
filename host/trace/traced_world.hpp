// SPDX-License-Identifier: Apache-2.0
/// The world in device memory with its surface samples, which the lasers of a scene share.
#pragma once

#include <functional>
#include <memory>
#include <utility>

#include "cl/program.hpp"
#include "host/common/stage_clock.hpp"
#include "host/geometry/world.hpp"
#include "host/plan/plan.hpp"
#include "host/trace/device_scene.hpp"
#include "host/trace/samples.hpp"

namespace raywave {

class TracedWorld {
public:
  TracedWorld(const cl::Device& device, StageTimes& times) : device_(device), times_(times) {}

  /// Uploads the world and finds its surface samples. Kernels, trees and memory of the previous
  /// plan are reused where they fit.
  ///
  /// has_stayed  the world, since the last call for another laser, whose plan differs in the laser
  ///             alone: trees and samples are kept
  /// release     called before samples are found with other kernels: frees what holds the table
  /// throws      InputError when the pixels can show no ray of a fan; DeviceError for the device
  void prepare(const World& world, const Plan& plan, bool has_stayed,
               const std::function<void()>& release);

  const DeviceScene& scene() const { return *scene_; }
  /// Null where fans of rays are traced.
  std::shared_ptr<const SampleTable> table() const { return table_; }

private:
  void place(const World& world, const Plan& plan, bool has_stayed);

  /// Plans with equal keys share the kernels that find samples.
  using TableKey = std::pair<Bounces, cl::Options>;

  cl::Device device_;
  StageTimes& times_;
  std::unique_ptr<DeviceScene> scene_;
  std::shared_ptr<SampleTable> table_;
  TableKey built_for_;
};

}  // namespace raywave
