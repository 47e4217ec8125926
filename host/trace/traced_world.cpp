// SPDX-License-Identifier: Apache-2.0
#include "host/trace/traced_world.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/common/error.hpp"
#include "host/common/text.hpp"

namespace raywave {
namespace {

/// throws  InputError when the paper's fan has no ray that the hologram's pixels can show
void require_rays(const Plan& plan) {
  const auto has_rays = [](const Wrp& wrp) { return !wrp.fan.empty(); };
  if (plan.samples.aimed || std::any_of(plan.wrps.begin(), plan.wrps.end(), has_rays)) return;
  const auto degrees = [](double sine) {
    return number_text(std::asin(sine) * 180 / std::numbers::pi) + " degrees";
  };
  throw InputError(
      plan.scene_name + ": no ray of the fan is as flat as the hologram's pixels can show, " +
      degrees(plan.hologram.largest_sine.x) + " x " + degrees(plan.hologram.largest_sine.y) +
      " off the axis; give a smaller sampling.pitch or hologram.pitch, or bring the scene to the "
      "axis");
}

}  // namespace

void TracedWorld::prepare(const World& world, const Plan& plan, bool has_stayed,
                          const std::function<void()>& release) {
  require_rays(plan);
  place(world, plan, has_stayed);
  const StageClock clock(times_, "samples");
  const TableKey key{plan.specular.as, sample_options(plan, *scene_)};
  if (!plan.samples.aimed) {
    table_ = nullptr;
  } else if (!table_ || key != built_for_) {
    release();
    table_ = nullptr;
    table_ = std::make_shared<SampleTable>(device_, plan, *scene_);
    built_for_ = key;
  } else if (has_stayed) {
    table_->show(plan, *scene_);
  } else {
    table_->find(plan, *scene_);
  }
}

/// The scene in device memory. The time for trees is reported as a stage of its own.
void TracedWorld::place(const World& world, const Plan& plan, bool has_stayed) {
  if (!scene_) {
    {
      const StageClock clock(times_, "prepare");
      scene_ = std::make_unique<DeviceScene>(device_, world, plan);
    }
    times_.wall_s["tree"] = scene_->tree_seconds;
    times_.wall_s["prepare"] -= scene_->tree_seconds;
  } else if (has_stayed) {
    const StageClock clock(times_, "prepare");
    scene_->show(plan);
  } else {
    const StageClock clock(times_, "tree");
    scene_->place(world, plan);
  }
}

}  // namespace raywave
