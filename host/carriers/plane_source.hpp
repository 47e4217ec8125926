// SPDX-License-Identifier: Apache-2.0
/// Light on planes in space: gathered from surface samples, or traced along the rays of fans.
#pragma once

#include <cstdint>
#include <optional>

#include "host/trace/fan_tracer.hpp"
#include "host/trace/gatherer.hpp"

namespace raywave {

class PlaneSource {
public:
  /// table  null: fans are traced; like plan and scene it outlives the source
  PlaneSource(const cl::Device& device, const Plan& plan, const DeviceScene& scene,
              const SampleTable* table, int frames) {
    if (table)
      gatherer_.emplace(device, plan, scene, *table, frames);
    else
      fans_.emplace(device, plan, scene);
  }

  void start(std::uint32_t seed) {
    seed_ = seed;
    if (gatherer_) gatherer_->draw_phases(seed);
  }
  void fill(const Wrp& wrp, cl::ComplexBuffer& stack) {
    if (gatherer_)
      gatherer_->gather(wrp, stack);
    else
      fans_->trace(wrp, seed_, stack);
  }

private:
  std::optional<Gatherer> gatherer_;
  std::optional<FanTracer> fans_;
  std::uint32_t seed_ = 0;
};

}  // namespace raywave
