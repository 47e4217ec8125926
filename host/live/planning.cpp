// SPDX-License-Identifier: Apache-2.0
#include "host/live/planning.hpp"

#include <utility>

#include "host/forecast/cost.hpp"
#include "host/forecast/tuning.hpp"
#include "host/planning/make_plan.hpp"

namespace raywave {

LivePlanning planning_of(std::vector<Scene> scenes, Goal started, const cl::DeviceInfo& device) {
  LivePlanning planning;
  planning.scenes_for = [scenes = std::move(scenes), started, device](const Viewing::Plans& plans,
                                                                      const World& placed) {
    auto chosen = scenes;
    constexpr int at_pace_of_frames = 4;
    for (auto& one : chosen)
      if (plans.are_refined) one.refine.emplace().iterations = at_pace_of_frames;
    const auto goal = plans.preset ? Goal{plans.preset, {}, {}} : started;
    if (!goal.any()) return chosen;
    const auto planned = plan_scenes(chosen, placed, figures_of(device), goal, {.field = false});
    for (std::size_t i = 0; i < chosen.size(); ++i) chosen[i] = planned[i].scene;
    return chosen;
  };
  planning.notes_of = [](const Scene& of, const World& where, const Plan& plan) {
    return render_warnings({}, of, where, plan);
  };
  planning.added_s = [fp64 = device.fp64, rates = figures_of(device).rates](
                         const Scene& of, const World& where, const Plan& before) {
    const auto plan =
        make_plan(of, where, Method::wrp, RenderOptions{}.rays_per_axis, fp64, &before);
    return plan.carrier.index() == before.carrier.index() ? 0 : predicted_s(of, where, plan, rates);
  };
  return planning;
}

}  // namespace raywave
