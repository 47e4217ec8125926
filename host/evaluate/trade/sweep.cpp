// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "host/common/cache.hpp"
#include "host/common/error.hpp"
#include "host/common/output.hpp"
#include "host/evaluate/report.hpp"
#include "host/evaluate/stopwatch.hpp"
#include "host/evaluate/trade/knobs.hpp"
#include "host/forecast/tuning.hpp"
#include "host/planning/make_plan.hpp"
#include "host/scene/image.hpp"
#include "host/scene/scene_json.hpp"
#include "raywave_version.hpp"

namespace raywave {
namespace {

constexpr int fewest_renders = 3, most_renders = 15;
constexpr double enough_s = 1, long_s = 4;

/// Width of the blur in squares of averaged pixels: squares a third as wide as the blur add 1 % to
/// its variance.
constexpr double squares_in_blur = 3;

template <class T>
void append_bytes(std::string& text, const std::vector<T>& values) {
  text.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}

/// Hash of all data that the figures of a configuration depend on, except the configuration itself.
std::string digits_of(const Trade& trade, const World& world) {
  std::string all;
  for (const auto& laser : with_knobs(trade.scenes, {})) {
    auto scene = json_of(laser);
    scene.erase("file");
    scene.erase("digest");
    all += scene.dump();
  }
  const auto& p = trade.pictures;
  const Json pictures{p.depths_m,  json_of(*p.window), *p.blur_m, p.square_px,
                      p.border_px, p.lens_points,      p.views,   p.against_points};
  const auto& d = trade.device;
  all += pictures.dump() + d.platform + '\n' + d.name + '\n' + d.driver + '\n' + version;
  append_bytes(all, world.positions);
  append_bytes(all, world.normals);
  append_bytes(all, world.uvs);
  append_bytes(all, world.triangles);
  for (const auto& texture : world.textures) {
    if (texture) append_bytes(all, texture->pixels);
  }
  // What meshes bring along
  append_bytes(all, world.colours);
  append_bytes(all, world.triangle_material);
  for (const auto& found : world.found)
    for (const auto& material : found.materials) all += material.name + material.description;
  for (const auto& maps : world.maps) {
    for (const auto* map : maps.all())
      if (*map) append_bytes(all, map->image->pixels);
  }
  return hash_name(all);
}

/// Seconds of samples, trace, propagate, refine and encode together: the stages that knobs change
/// and plans predict. On CPUs, processor seconds divided by the compute units, so that other
/// programs hardly count; on other devices, wall-clock seconds.
double trade_time_s(const TradeRow& row, const cl::DeviceInfo& device) {
  double sum = 0;
  for (const char* stage : {"samples", "trace", "propagate", "refine", "encode"}) {
    const auto found = row.stages.find(stage);
    if (found == row.stages.end()) continue;
    sum += device.kind == cl::DeviceKind::cpu
               ? found->second.processor_s / std::max(1u, device.compute_units)
               : found->second.wall_s;
  }
  return sum;
}

}  // namespace

double TradeRow::mean(double TradePicture::*figure, bool sides) const {
  double sum = 0;
  int count = 0;
  for (const auto& p : pictures) {
    if ((p.view != "whole") != sides) continue;
    sum += p.*figure;
    ++count;
  }
  return count > 0 ? sum / count : 0;
}

double TradeRow::predicted_s() const {
  double sum = 0;
  for (const auto& laser : predicted) sum += laser.at("seconds").at("total").get<double>();
  return sum;
}
double TradeRow::predicted_psnr_db() const {
  double sum = 0;
  for (const auto& laser : predicted)
    sum += laser.value(Json::json_pointer("/pictures/mean_psnr_db"), 0.0);
  return predicted.empty() ? 0 : sum / static_cast<double>(predicted.size());
}

TradeBench::TradeBench(const cl::Device& device, std::vector<Scene> scenes, const TradeSpec& spec)
    : TradeBench(device, scenes, build_world(scenes.at(0)), spec) {}

TradeBench::TradeBench(const cl::Device& device, std::vector<Scene> scenes, World world,
                       const TradeSpec& spec)
    : device_(device), spec_(spec), world_(std::move(world)) {
  trade_.scenes = std::move(scenes);
  trade_.device = device.info();
  for (const auto& scene : trade_.scenes) {
    const auto plan = make_plan(scene, world_);
    trade_.resolution_m = std::max(trade_.resolution_m, wanted_resolution_m(scene, plan));
  }
  const auto plan = make_plan(trade_.scenes[0], world_);
  trade_.grid = plan.grid;
  auto& pictures = trade_.pictures;
  pictures = spec.pictures;
  pictures.field = false;
  if (pictures.depths_m.empty()) pictures.depths_m = quality_depths_m(plan);
  pictures.blur_m = blur_of_resolution * trade_.resolution_m;
  if (!pictures.window)
    pictures.window =
        quality_window(plan, front_view(trade_.scenes[0], world_, plan), *pictures.blur_m);
  pictures.square_px =
      std::max(1, static_cast<int>(*pictures.blur_m / plan.hologram.pitch_m.x / squares_in_blur));
  trade_.of = digits_of(trade_, world_);
  plan_rows(trade_, world_, spec_);
}

std::optional<int> TradeBench::resume(const std::string& text) {
  std::vector<TradeRow> known;
  try {
    const auto json = Json::parse(text);
    if (json.at("of") != trade_.of) return {};
    for (const auto& row : json.at("rows")) known.push_back(row_of(row));
  } catch (const Json::exception&) {
    return {};
  } catch (const InputError&) {
    return {};
  }
  int count = 0;
  for (auto& row : known) {
    if (row.renders == 0) continue;  // failed rows are tried again
    const auto mine = std::ranges::find(trade_.rows, row.knobs, &TradeRow::knobs);
    if (mine == trade_.rows.end()) {
      trade_.rows.push_back(std::move(row));
    } else if (row.thorough || !mine->thorough) {
      *mine = std::move(row);
    } else {
      continue;
    }
    ++count;
  }
  return count;
}

void TradeBench::measure(const std::function<void()>& after_some, const Progress& progress) {
  auto& rows = trade_.rows;
  for (std::size_t first = 0; first < rows.size(); ++first) {
    if (rows[first].is_done()) continue;
    if (progress) {
      const auto done = std::ranges::count_if(rows, &TradeRow::is_done);
      progress(std::to_string(done) + " of " + std::to_string(rows.size()) + ": " +
                   trade_label(rows[first].knobs, rows[trade_.base].knobs),
               static_cast<double>(done) / static_cast<double>(rows.size()));
    }
    const auto some = same_but_frames(first);
    try {
      measure_together(some);
    } catch (const InputError& error) {
      for (const auto i : some) rows[i].note = error.what();
    } catch (const cl::DeviceError& error) {
      for (const auto i : some) rows[i].note = error.what();
    }
    after_some();
  }
}

/// Unmeasured rows that differ from row `first` only in the number of frames, sorted by it, and
/// that one rendering serves.
std::vector<std::size_t> TradeBench::same_but_frames(std::size_t first) const {
  // Frames are refined as a set: some of them show less than as many on their own
  if (trade_.rows[first].knobs.iterations > 0) return {first};
  std::vector<std::size_t> some;
  for (std::size_t i = first; i < trade_.rows.size(); ++i) {
    const auto& row = trade_.rows[i];
    auto knobs = row.knobs;
    knobs.frames = trade_.rows[first].knobs.frames;
    if (!row.is_done() && row.thorough == trade_.rows[first].thorough &&
        knobs == trade_.rows[first].knobs)
      some.push_back(i);
  }
  std::ranges::sort(some, {}, [&](auto i) { return trade_.rows[i].knobs.frames; });
  return some;
}

void TradeBench::measure_together(const std::vector<std::size_t>& some) {
  std::vector<TradeRow> rows;  // stored in trade_ when all are measured
  std::vector<int> frames;
  for (const auto i : some) {
    rows.push_back(trade_.rows[i]);
    frames.push_back(rows.back().knobs.frames);
  }
  RenderOptions how;
  how.fft = rows.back().knobs.fft;
  const auto scenes = with_knobs(trade_.scenes, rows.back().knobs);
  // Pictures and figures of all rows come from the rendering with the most frames.
  {
    // Each row has its own cl::Device, whose memory peak is that of the row.
    const cl::Device device(device_.info());
    Renderer renderer(device, scenes, world_, how);
    const auto rendered = renderer.render_lasers();
    auto pictures = trade_.pictures;
    pictures.views &= rows.back().thorough;
    const auto looks =
        assess_frames(device_, scenes, world_, rendered, frames, how, pictures, seen_by_lens_);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      for (const auto& look : looks[i].rows) {
        const auto& f = look.figures.luminance;
        rows[i].pictures.push_back(
            {look.view, look.z_m, f.psnr_db, f.ssim, f.flip, f.contrast_a, f.contrast_b});
      }
    }
    if (pictures.against_points && rows.back().thorough) {
      const auto figures = compare_with_points(device_, scenes, world_, rendered, how);
      for (auto& row : rows) {
        row.correlation = figures.correlation;
        row.field_error = figures.error;
      }
    }
    time(rows.back(), renderer, how);
  }
  // The other rows are only timed.
  how.keep_field = false;
  for (std::size_t i = 0; i + 1 < rows.size(); ++i) {
    Renderer renderer(cl::Device(device_.info()), with_knobs(trade_.scenes, rows[i].knobs), world_,
                      how);
    renderer.render_lasers();  // warms up
    time(rows[i], renderer, how);
  }
  for (std::size_t i = 0; i < rows.size(); ++i) trade_.rows[some[i]] = std::move(rows[i]);
}

void TradeBench::time(TradeRow& row, Renderer& renderer, const RenderOptions& how) const {
  std::map<std::string, std::vector<double>> wall_s, processor_s;
  const Stopwatch watch;
  const auto is_enough = [&](int renders) {
    if (spec_.renders > 0) return renders >= spec_.renders;
    if (watch.wall_s() > long_s) return true;
    return renders >= most_renders || (renders >= fewest_renders && watch.wall_s() > enough_s);
  };
  for (const auto& laser : plan_scenes(with_knobs(trade_.scenes, row.knobs), world_,
                                       figures_of(trade_.device), {}, {.field = how.keep_field})) {
    row.predicted.push_back(json_of(laser.prediction));
    row.predicted.back()["encoding"] = name_of(laser.plan.slm.encoding);
  }
  do {
    const auto& objects = trade_.scenes[0].objects;
    for (std::size_t i = 0; i < objects.size(); ++i)
      renderer.set_pose(i, objects[i].position_m, objects[i].rotation_deg);
    const auto lasers = renderer.render_lasers().lasers;
    for (const auto& [stage, seconds] : sum_of_stages(lasers, &RenderResult::seconds))
      wall_s[stage].push_back(seconds);
    for (const auto& [stage, seconds] : sum_of_stages(lasers, &RenderResult::processor_seconds))
      processor_s[stage].push_back(seconds);
    row.samples = 0;
    for (const auto& laser : lasers) row.samples += laser.samples;
    row.device_bytes = lasers.back().device_peak_bytes;
    ++row.renders;
  } while (!is_enough(row.renders));
  for (const auto& [stage, seconds] : wall_s)
    row.stages[stage] = {spread_of(seconds).median, spread_of(processor_s[stage]).median};
  row.time_s = trade_time_s(row, trade_.device);
}

Sheet TradeBench::sheet(const Progress& progress) {
  const auto columns = sheet_rows(trade_);
  const auto depths = trade_.pictures.depths_m.size();
  auto what = trade_.pictures;
  what.views = false;
  std::vector<std::vector<std::vector<Image>>> cells(
      depths);  // one row per depth: lens, then configurations
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const auto& knobs = trade_.rows[columns[i]].knobs;
    if (progress)
      progress("pictures of " + trade_label(knobs, trade_.rows[trade_.base].knobs),
               static_cast<double>(i) / static_cast<double>(columns.size()));
    RenderOptions how;
    how.fft = knobs.fft;
    const auto scenes = with_knobs(trade_.scenes, knobs);
    const auto look = assess_frames(device_, scenes, world_, render(device_, scenes, world_, how),
                                    {knobs.frames}, how, what, seen_by_lens_)
                          .front();
    for (std::size_t row = 0; row < depths; ++row) {
      if (i == 0) cells[row].push_back(look.rows[row].lens);
      cells[row].push_back(look.rows[row].hologram);
    }
  }
  return picture_sheet(cells, Frame::eye, trade_sheet_cell_px);
}

std::vector<std::size_t> trade_frontier(const std::vector<TradeRow>& rows) {
  std::vector<std::size_t> order, best;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (rows[i].renders > 0) order.push_back(i);
  }
  std::ranges::stable_sort(order, [&](auto a, auto b) {
    return rows[a].time_s < rows[b].time_s ||
           (rows[a].time_s == rows[b].time_s && rows[a].psnr_db() > rows[b].psnr_db());
  });
  for (const auto i : order) {
    if (best.empty() || rows[i].psnr_db() > rows[best.back()].psnr_db()) best.push_back(i);
  }
  return best;
}

std::size_t fastest_as_accurate(const std::vector<TradeRow>& rows, std::size_t row) {
  for (const auto i : trade_frontier(rows)) {
    if (rows[i].psnr_db() >= rows[row].psnr_db() && rows[i].time_s < rows[row].time_s) return i;
  }
  return row;
}

std::vector<std::size_t> sheet_rows(const Trade& trade) {
  return thinned(trade_frontier(trade.rows), 7);
}

Sheet measure_in(TradeBench& bench, const std::filesystem::path& folder,
                 const std::function<void(const std::string&)>& note, const Progress& progress) {
  const auto file = folder / "trade.json";
  if (std::filesystem::exists(file)) {
    std::ifstream stream(file, std::ios::binary);
    const auto known = bench.resume({std::istreambuf_iterator<char>(stream), {}});
    note(file.string() +
         (known ? ": " + std::to_string(*known) + " rows taken over"
                : ": of another scene, device, version or way of looking; starting anew"));
  }
  bench.measure([&] { write_text(file, trade_json(bench.trade())); }, progress);
  auto sheet = bench.sheet(progress);
  write_text(file, trade_json(bench.trade()));
  write_text(folder / "trade.csv", trade_csv(bench.trade()));
  save_picture(folder / "trade.png", sheet.width, sheet.height, sheet.rgb);
  return sheet;
}

bool has_few_pixels(const Scene& scene) {
  constexpr double few = 512.0 * 512;
  const auto size = scene.hologram.resolution;
  return static_cast<double>(size.x) * size.y <= few;
}

}  // namespace raywave
