// SPDX-License-Identifier: Apache-2.0
#include "host/animate/hologram_tiles.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "host/carriers/planning/facts.hpp"
#include "host/common/cache.hpp"
#include "host/common/error.hpp"
#include "host/common/json.hpp"
#include "host/common/output.hpp"
#include "host/common/text.hpp"
#include "host/planning/make_plan.hpp"
#include "host/trace/work_shape.hpp"

namespace raywave {
namespace {

/// Tiles whose brightest sets the scale of all, evenly spread over both sides of the hologram.
constexpr int tiles_that_scale = 8;

Plan plan_of(const cl::Device& device, const Scene& scene, const World& world, cl::FftBackend fft) {
  constexpr bool keep_field = false, by_tile = true;
  auto plan =
      fitting_plan(scene, world, limits_of(device.info()), {Method::wrp, fft, keep_field, by_tile},
                   RenderOptions{}.rays_per_axis, device.info().fp64);
  require_tiles(plan);
  return plan;
}

}  // namespace

void require_tiles(const Plan& plan) {
  const auto file = one_line(plan.scene_name);
  if (plan.tiling.tiles.size() < 2)
    throw InputError(file +
                     ": the hologram is one piece, not tiles; give hologram.tiles, such as " +
                     "--set hologram.tiles=[4,4]");
  for (const auto& [is_given, key] :
       {std::pair(plan.refine.has_value(), "[refine] (of the scene, or a goal's)"),
        std::pair(plan.slm.band != glm::dvec2(1), "slm.band")})
    if (is_given)
      throw InputError(file + ": " + key +
                       " is for the whole hologram, and tiles are made one by one; leave it out");
  if (plan.slm.flip_x || plan.slm.flip_y || plan.slm.rotate_deg != 0)
    throw InputError(file +
                     ": slm.flip and slm.rotate turn the picture of a whole SLM; leave "
                     "them out");
}

HologramTiles::HologramTiles(const cl::Device& device, Scene scene, cl::FftBackend fft,
                             std::filesystem::path folder)
    : device_(device),
      scene_(std::move(scene)),
      fft_(fft),
      folder_(std::move(folder)),
      world_(build_world(scene_)),
      plan_(plan_of(device_, scene_, world_, fft_)),
      schedule_(
          Schedule::even(static_cast<int>(plan_.tiling.tiles.size()), plan_.hologram.frames)) {}

std::vector<std::string> HologramTiles::notes(const PlanNotes& of_plan) const {
  return of_plan(scene_, world_, plan_);
}

std::string HologramTiles::run_name(FrameStorage) const {
  const auto& tiling = plan_.tiling;
  return hash_name(given_of(device_, fft_, {&scene_}, world_) + "tiles\n" +
                   std::to_string(tiling.grid.x) + " x " + std::to_string(tiling.grid.y) + '\n' +
                   std::to_string(plan_.most_layers) + '\n' + name_of(propagation_of(plan_)) +
                   '\n');
}

/// RenderResult::clip of all tiles, 0 where phases alone are shown; parts find it in the folder.
double HologramTiles::brightest(Renderer& renderer, bool is_part) const {
  if (plan_.slm.encoding == Encoding::phase) return 0;
  const auto file = folder_ / FrameFiles::shared_name;
  const auto run = run_name(FrameStorage::tiles);
  std::ifstream stream(file);
  const auto known = Json::parse(stream, nullptr, false);
  if (known.is_object() && known.value("by", Json()) == run && known.contains("clip") &&
      known["clip"].is_number())
    return known["clip"].get<double>();
  double clip = 0;
  // The golden ratio's multiples are even along rows and along columns
  constexpr double golden = 0.6180339887498949;
  const auto tiles = plan_.tiling.tiles.size();
  for (int i = 0; i < tiles_that_scale; ++i) {
    const double place = 0.5 + i * golden;
    renderer.set_tile(
        static_cast<std::size_t>((place - std::floor(place)) * static_cast<double>(tiles)));
    clip = std::max(clip, renderer.render().clip);
  }
  if (is_part && !folder_.empty())
    write_text(file, Json{{"by", run}, {"clip", clip}}.dump() + "\n");
  return clip;
}

AnimateResult HologramTiles::make_frames(FrameFiles& files, const Progress& progress) const {
  const auto begin = [&]() -> std::function<AnimatedPicture(int)> {
    RenderOptions how;
    how.fft = fft_;
    how.keep_field = false;
    how.tile = 0;
    const auto renderer = std::make_shared<Renderer>(device_, scene_, world_, how);
    if (const double clip = brightest(*renderer, files.is_part()); clip > 0)
      renderer->set_clip(clip);
    return [this, renderer](int tile) {
      renderer->set_tile(static_cast<std::size_t>(tile));
      auto result = renderer->render();
      const auto first = plan_.tiling.tiles[static_cast<std::size_t>(tile)].first;
      AnimatedPicture made;
      made.levels = std::move(result.levels);
      made.line = {{"tile", tile}, {"first_px", {first.x, first.y}}};
      made.notes = std::move(result.notes);
      if (!made.notes.empty()) made.line["notes"] = made.notes;
      made.processor_seconds = std::move(result.processor_seconds);
      return made;
    };
  };
  return make_missing(
      files, begin, [](auto&) {}, progress);
}

}  // namespace raywave
