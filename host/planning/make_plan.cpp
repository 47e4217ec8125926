// SPDX-License-Identifier: Apache-2.0
#include "host/planning/make_plan.hpp"

#include <algorithm>
#include <utility>

#include "host/carriers/planning/facts.hpp"
#include "host/carriers/virtual_planes/planning/planes.hpp"
#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/plan/lattice.hpp"
#include "host/planning/assess.hpp"
#include "host/planning/memory_needs.hpp"
#include "host/planning/tiles.hpp"

namespace raywave {
namespace {

/// Layers and tiles that "auto" tries, where the scene leaves them open; more tiles, where they
/// stay so large.
constexpr int most_layers_tried = 8, most_tiles_tried = 4, large_tile = 2048;

/// Error of light over WRPs from which on it is gathered at the hologram, where that can be.
constexpr double most_wrp_error = 0.3;

/// The next division where virtual planes do not serve, without those whose tiles are still wider
/// than the light of their pixels; the same where there is none.
glm::ivec2 tiles_to_try(const Plan& plan) {
  auto tiles = plan.tiling.grid, finer = with_more_tiles(plan.hologram.size, tiles);
  const auto is_tried = [&](glm::ivec2 grid) {
    const auto size = tile_size_of(plan.hologram.size, grid);
    return std::max(grid.x, grid.y) <= most_tiles_tried || std::min(size.x, size.y) >= large_tile;
  };
  while (finer != tiles && is_tried(finer)) {
    tiles = std::exchange(finer, with_more_tiles(plan.hologram.size, finer));
    if (!is_wider_than_light(plan, tile_size_of(plan.hologram.size, tiles))) return tiles;
  }
  return plan.tiling.grid;
}

/// Why a plan has no virtual planes.
std::string why_no_virtual_planes(const Plan& plan) {
  const auto& plane = *plan.virtual_planes();
  return plane.error() > most_virtual_plane_error
             ? "virtual planes would bring an error of " + percent_text(plane.error())
             : "the hologram is wider than the light of its pixels at the scene's distance";
}

/// The next division whose tiles fit into one buffer, or as far as it goes; the same where there is
/// none.
glm::ivec2 tiles_for_memory(const Plan& plan, std::uint64_t largest_buffer_bytes) {
  auto tiles = plan.tiling.grid, finer = with_more_tiles(plan.hologram.size, tiles);
  while (finer != tiles) {
    tiles = std::exchange(finer, with_more_tiles(plan.hologram.size, finer));
    // However light is gathered, a tile's field lies in one buffer
    const auto size = tile_size_of(plan.hologram.size, tiles);
    if (8 * area_of(size) <= largest_buffer_bytes) break;
  }
  return tiles;
}

/// What the search varies; the rest is as the scene says.
struct Choice {
  Method method = Method::wrp;  // points where light is gathered at the hologram
  bool is_near = false;         // surfaces are sampled from before the hologram
  WrpPropagation propagation = WrpPropagation::automatic;
  int layers = 1;
  std::optional<glm::ivec2> tiles;  // empty: one piece
  bool goes_on = false;             // with what Search::moved_from_ found
  std::string why_carrier, why_tiles;
};

/// The one place that decides how light travels, and in how many layers and tiles: choices are
/// assessed one after another until one serves.
class Search {
public:
  Search(const Scene& scene, const World& world, const MemoryUse& use, const MemoryLimits& limits,
         int rays_per_axis, bool has_doubles, const Plan* moved_from)
      : scene_(scene),
        world_(world),
        use_(use),
        limits_(limits),
        rays_per_axis_(rays_per_axis),
        has_doubles_(has_doubles),
        moved_from_(moved_from),
        leaves_layers_(scene.wrp.distances_m.empty() && !scene.given.contains("wrp.layers")) {
    share_lattice(scene.hologram.tiles);
  }

  Plan run() {
    auto choice = first(scene_.hologram.tiles);
    for (;;) {
      auto plan = assessed(choice);
      auto next = after(choice, plan);
      if (!next) return plan;
      choice = std::move(*next);
    }
  }

private:
  /// Lasers share the lattice of the longest wavelength, whose light spreads farthest.
  void share_lattice(std::optional<glm::ivec2> tiles) {
    if (!scene_.colour || scene_.hologram.wavelength_m == scene_.colour->longest_m()) return;
    auto widest = scene_;
    widest.hologram.wavelength_m = scene_.colour->longest_m();
    widest.hologram.tiles = tiles;
    samples_ =
        make_plan(widest, world_, use_.method, rays_per_axis_, has_doubles_, moved_from_).lattice;
  }

  Plan assessed(const Choice& choice) {
    auto scene = scene_;
    scene.wrp.propagation = choice.propagation;
    scene.wrp.layers = choice.layers;
    scene.hologram.tiles = choice.tiles;
    auto plan = assess(scene, world_, choice.method, choice.is_near, rays_per_axis_, has_doubles_,
                       choice.goes_on ? moved_from_ : nullptr, samples_, images_);
    plan.why_carrier = choice.why_carrier;
    if (!choice.why_tiles.empty()) plan.tiling.why = choice.why_tiles;
    if (scene_.hologram.tiles) plan.tiling.why = "given";
    return plan;
  }

  /// tiles  as many, if any are wanted
  Choice first(std::optional<glm::ivec2> tiles) const {
    Choice choice;
    choice.method = use_.method;
    choice.is_near = use_.method != Method::wrp && meets_hologram(scene_, world_) &&
                     (use_.method == Method::points || crosses_hologram(world_));
    choice.propagation = scene_.wrp.propagation;
    choice.layers = scene_.wrp.layers;
    choice.tiles = tiles;
    choice.goes_on = moved_from_ != nullptr;
    if (use_.method != Method::wrp) return choice;
    const bool asks_planes =
        scene_.wrp.propagation != WrpPropagation::automatic || !scene_.wrp.distances_m.empty();
    if (scene_.sampling.mode == SamplingMode::aimed && meets_hologram(scene_, world_) &&
        (crosses_hologram(world_) ||
         (!asks_planes && !scene_.wrp.grid && key_of_wrps(scene_).empty()))) {
      if (asks_planes)
        throw InputError(one_line(scene_.file.string()) +
                         ": surfaces in the hologram's plane, or near it, are gathered at the "
                         "hologram; leave out wrp.propagation and wrp.distance");
      return at_hologram(choice, "surfaces in or near the hologram's plane are gathered there");
    }
    if (scene_.wrp.propagation != WrpPropagation::automatic) return choice;
    if (samples_ && samples_->eye_m.z != 0)
      return at_hologram(choice, "light of the longest wavelength is gathered there");
    if (!moved_from_) return virtual_planes(choice);
    // What served before the objects moved
    if (is_near_hologram(*moved_from_)) return anew(choice);
    choice.propagation = propagation_of(*moved_from_);
    if (leaves_layers_) choice.layers = moved_from_->most_layers;
    choice.why_carrier = moved_from_->why_carrier;
    return choice;
  }

  static Choice at_hologram(Choice choice, std::string why) {
    choice.method = Method::points;
    choice.is_near = true;
    choice.why_carrier = std::move(why);
    return choice;
  }

  /// The choice with virtual planes, or without where the scene is not for them.
  Choice virtual_planes(Choice choice) const {
    auto why_not = why_not_virtual_planes(scene_);
    if (const auto key = key_of_wrps(scene_); why_not.empty() && !key.empty())
      why_not = scene_.given.contains(key) ? key + " is for WRPs"
                                           : "the goal has chosen " + key + ", which is for WRPs";
    if (!why_not.empty()) return wrps(choice, why_not);
    choice.propagation = WrpPropagation::compact;
    return choice;
  }

  Choice wrps(Choice choice, std::string why) const {
    choice.propagation = WrpPropagation::spectrum;
    choice.layers = scene_.wrp.layers;
    if (!has_own_tiles_)
      choice.tiles = moved_from_ ? moved_from_->tiling.grid : scene_.hologram.tiles;
    choice.why_carrier = std::move(why);
    if (!has_own_tiles_) choice.why_tiles.clear();
    return choice;
  }

  /// The choice in the tiles of the plan before objects moved, and as if they had not.
  Choice anew(Choice choice) const {
    choice.goes_on = false;
    choice.tiles = moved_from_->tiling.grid;
    return virtual_planes(std::move(choice));
  }

  /// What to try in place of a choice that does not serve; nothing: it serves, or nothing else does
  /// better.
  std::optional<Choice> after(const Choice& choice, Plan& plan) {
    if (plan.virtual_planes() && scene_.wrp.propagation == WrpPropagation::automatic &&
        !is_settled_) {
      const auto shortfall = shortfall_of(plan);
      if (shortfall != Shortfall::none) return instead(choice, plan, shortfall);
      if (!choice.goes_on)
        plan.why_carrier = "its error of " + percent_text(plan.virtual_planes()->error()) +
                           " is within " + percent_text(most_virtual_plane_error);
    }
    const bool may_leave_wrps = choice.propagation == WrpPropagation::spectrum &&
                                choice.method == Method::wrp &&
                                scene_.wrp.propagation == WrpPropagation::automatic && !samples_ &&
                                serves_at_hologram(scene_, plan);
    // The error over WRPs takes longer than a picture of a GPU
    if (may_leave_wrps || (scene_.refine && choice.method == Method::wrp)) {
      const double error = propagation_error_of(plan);
      if (may_leave_wrps && error > most_wrp_error)
        return at_hologram(choice, choice.why_carrier + ", WRPs one of " + percent_text(error));
      if (scene_.refine && error > hopeless_error)
        throw InputError(
            one_line(scene_.file.string()) + ": refine: the field has an error of " +
            percent_text(error) +
            ", from which no refinement finds the pictures; leave out [refine], without which "
            "light near the hologram is gathered there, or move the scene so that all of it is " +
            millimetres(near_distance_m(plan)) + " from the hologram or more");
    }
    return with_more_memory(choice, plan);
  }

  /// Where virtual planes fall short: more layers, more tiles, or WRPs.
  Choice instead(Choice choice, const Plan& plan, Shortfall shortfall) const {
    if (choice.goes_on) return anew(choice);
    const auto more_tiles = tiles_to_try(plan);
    if (shortfall == Shortfall::depth && leaves_layers_ && choice.layers < most_layers_tried) {
      ++choice.layers;
    } else if (!scene_.hologram.tiles && !moved_from_ && !has_own_tiles_ &&
               more_tiles != plan.tiling.grid) {
      choice.tiles = more_tiles;
      choice.why_tiles = "virtual planes of one piece would not serve";
    } else {
      return wrps(choice, why_no_virtual_planes(plan));
    }
    return choice;
  }

  /// More tiles, where the plan does not fit into memory and they help.
  std::optional<Choice> with_more_memory(const Choice& choice, const Plan& plan) {
    if (scene_.hologram.tiles) return {};
    const auto lacking = shortage_of_division(world_, plan, use_, limits_);
    const auto tiles =
        lacking.empty() ? plan.tiling.grid : tiles_for_memory(plan, limits_.largest_buffer_bytes);
    if (tiles == plan.tiling.grid) return {};
    const auto why = !plan.tiling.why.empty() ? plan.tiling.why : "in one piece " + lacking;
    has_own_tiles_ = true;
    share_lattice(tiles);
    Choice next;
    if (moved_from_) {  // as it goes on, in more tiles
      is_settled_ = true;
      next = choice;
      next.goes_on = false;
      next.propagation = propagation_of(plan);
      next.layers = plan.most_layers;
      next.why_carrier = plan.why_carrier;
      next.tiles = tiles;
    } else {
      next = first(tiles);
    }
    next.why_tiles = why;
    return next;
  }

  const Scene& scene_;
  const World& world_;
  const MemoryUse& use_;
  const MemoryLimits& limits_;
  int rays_per_axis_;
  bool has_doubles_;
  const Plan* moved_from_;
  bool leaves_layers_;
  bool has_own_tiles_ = false;  // as memory needs, whatever propagation would
  bool is_settled_ = false;     // propagation and layers
  std::optional<LatticePlan> samples_;
  std::optional<Images> images_;  // the same for all that is tried
};

}  // namespace

Plan make_plan(const Scene& scene, const World& world, Method method, int rays_per_axis,
               bool has_doubles, const Plan* moved_from) {
  return Search(scene, world, {method}, {}, rays_per_axis, has_doubles, moved_from).run();
}

Plan lens_plan(const Scene& scene, const World& world) {
  return make_plan(scene, world, shows_lens_alone(scene, world) ? Method::rays : Method::wrp);
}

Plan fitting_plan(const Scene& scene, const World& world, const MemoryLimits& limits,
                  const MemoryUse& use, int rays_per_axis, bool has_doubles) {
  return Search(scene, world, use, limits, rays_per_axis, has_doubles, nullptr).run();
}

Plan fitting_plan_of_poses(Scene& scene, World& world, std::vector<int>& poses,
                           const std::function<void(int pose)>& move_to, const MemoryLimits& limits,
                           const MemoryUse& use, int rays_per_axis, bool has_doubles) {
  // Layers and tiles only grow, and light that has gone over to WRPs stays there; what is gathered
  // at the hologram is so beside either
  constexpr int most_rounds = 16;
  const auto is_alike = [](const Plan& here, const Plan& all) {
    return here.tiling.grid == all.tiling.grid &&
           (is_near_hologram(here) ||
            (here.most_layers == all.most_layers && propagation_of(here) == propagation_of(all)));
  };
  std::vector<int> needed{poses.at(0)};
  move_to(needed[0]);
  auto plan = fitting_plan(scene, world, limits, use, rays_per_axis, has_doubles);
  for (int round = 0; round < most_rounds; ++round) {
    bool serves_all = true;
    for (const int pose : poses) {
      move_to(pose);
      auto here = Search(scene, world, use, limits, rays_per_axis, has_doubles, &plan).run();
      if (is_alike(here, plan)) continue;  // what it still lacks, the renderer says
      plan = std::move(here);
      serves_all = false;
      needed.push_back(pose);
    }
    if (!serves_all) continue;
    poses = std::move(needed);
    return plan;
  }
  throw InputError(one_line(scene.file.string()) + ": no plan serves all " +
                   std::to_string(poses.size()) + " pictures: that of picture " +
                   std::to_string(needed.back()) +
                   " has other tiles, depth layers or propagation than the others; give "
                   "hologram.tiles, wrp.layers and wrp.propagation");
}

}  // namespace raywave
