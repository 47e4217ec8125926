// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host/common/text.hpp"
#include "host/evaluate/bench/bench.hpp"
#include "host/evaluate/report.hpp"
#include "host/render.hpp"
#include "raywave_version.hpp"

namespace raywave {
namespace {

/// Stages with a column of the main table. Other stages count as "rest" there; the JSON lists all
/// stages.
constexpr std::array stages{"meshes", "plan", "tree", "samples", "trace", "propagate", "encode"};

struct Column {
  const char* head;
  int width;  // negative: left-aligned
};

constexpr std::array<Column, 18> columns{{{"", -50},
                                          {"ms", 8},
                                          {"quartiles", 17},
                                          {"cpu ms", 8},
                                          {"per s", 7},
                                          {"wanted", 10},
                                          {"dB", 6},
                                          {"meshes", 7},
                                          {"plan", 7},
                                          {"tree", 7},
                                          {"samples", 8},
                                          {"trace", 8},
                                          {"propagate", 9},
                                          {"encode", 7},
                                          {"rest", 7},
                                          {"first ms", 8},
                                          {"MiB", 11},
                                          {"others", 6}}};

/// The value with three digits, with two when it is small; "-" when it is not finite.
std::string figure(double value) {
  if (!std::isfinite(value)) return "-";
  const double size = std::abs(value);
  return format(size >= 99.95                ? "%.0f"
                : size >= 9.995              ? "%.1f"
                : size >= 0.095 || size == 0 ? "%.2f"
                                             : "%.2g",
                value);
}

std::string milliseconds(double seconds) { return figure(1e3 * seconds); }
std::string mebibytes(std::uint64_t bytes) { return std::to_string(bytes >> 20); }
std::string percent(double share) { return format("%.0f %%", 100 * share); }

std::string joined(const std::vector<std::string>& cells, const std::vector<int>& widths,
                   BenchStyle style) {
  std::string line;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (style == BenchStyle::markdown) {
      line += "| " + cells[i] + " ";
    } else {
      line += (i > 0 ? "  " : "") + format("%*s", widths[i], cells[i].c_str());
    }
  }
  if (style == BenchStyle::markdown) return line + "|\n";
  line.erase(line.find_last_not_of(' ') + 1);
  return line + "\n";
}

/// The heads of a table and the line below them that Markdown needs.
std::string heads_of(const std::vector<std::string>& heads, const std::vector<int>& widths,
                     BenchStyle style) {
  std::string text = joined(heads, widths, style);
  if (style == BenchStyle::markdown) {
    text += "|---";
    for (std::size_t i = 1; i < heads.size(); ++i) text += "|---:";
    text += "|\n";
  }
  return text;
}

std::vector<int> main_widths() {
  std::vector<int> widths;
  for (const auto& c : columns) widths.push_back(c.width);
  return widths;
}

std::string targets_text(double required, double aim) {
  if (required == 0) return "";
  return number_text(required) + (aim > 0 ? " / " + number_text(aim) : "");
}

Json json_of(const Spread& spread) {
  return {{"median", spread.median}, {"low", spread.low}, {"high", spread.high}};
}

Json json_of(const BenchRow& row, const DeviceLimits& rates) {
  Json json{{"group", row.group}, {"name", row.name}, {"note", row.note}};
  if (!row.peer) {
    const auto& scene = row.scenes[0];
    json["scene"] = {{"file", scene.file.filename().string()},
                     {"method", name_of(row.method)},
                     {"mode", name_of(scene.sampling.mode)},
                     {"resolution", {scene.hologram.resolution.x, scene.hologram.resolution.y}},
                     {"grid", {row.grid.x, row.grid.y}},
                     {"padding", scene.wrp.padding},
                     {"padded", {row.padded.x, row.padded.y}},
                     {"sampling_pitch_m", scene.sampling.pitch_m},
                     {"holograms_per_frame", row.holograms()},
                     {"triangles", row.triangles},
                     {"samples", row.samples},
                     {"samples_partly_hidden", row.hidden_samples},
                     {"rays", row.rays}};
  }
  json["scaled_from_one_in"] = row.share;
  json["frames"] = row.frames.size();
  json["wall_s"] = json_of(row.wall_s());
  json["processor_s"] = json_of(row.processor_s());
  json["first_frame_s"] = row.first_frame_s;
  json["holograms_per_s"] = row.per_second();
  json["required_per_s"] = row.target.required_per_s;
  json["aim_per_s"] = row.target.aim_per_s;
  // Times of each stage; where the amount of work is known, also rates and shares of the limits
  std::map<std::string, bool> named;
  for (const auto& f : row.frames) {
    for (const auto& [stage, seconds] : f.stages_s) named[stage] = true;
  }
  json["stages"] = Json::object();
  for (const auto& [stage, is_there] : named) {
    json["stages"][stage] = {{"wall_s", json_of(row.stage_s(stage))},
                             {"processor_s", json_of(row.stage_processor_s(stage))},
                             {"part_s", row.part_s(stage)}};
    const auto found = row.work.find(stage);
    if (found == row.work.end()) continue;
    const auto& work = found->second;
    const double seconds = row.part_s(stage);
    auto& j = json["stages"][stage];
    if (work.bytes > 0)
      j.update({{"bytes", work.bytes},
                {"bytes_per_s", work.bytes / seconds},
                {"share_of_copy", work.bytes / seconds / rates.bytes_per_s}});
    if (work.operations > 0)
      j.update({{"operations", work.operations},
                {"operations_per_s", work.operations / seconds},
                {"share_of_multiply_add", work.operations / seconds / rates.operations_per_s}});
  }
  json["quality"] = row.quality ? Json{{"psnr_db", row.quality->psnr_db},
                                       {"ssim", row.quality->ssim},
                                       {"z_m", row.quality->z_m},
                                       {"blur_m", row.quality->blur_m}}
                                : Json();
  json["memory"] = {{"device_peak_bytes", row.device_peak_bytes},
                    {"resident_bytes", row.resident_bytes}};
  json["others_share_of_processors"] = row.others_share;
  return json;
}

}  // namespace

std::vector<BenchRatio> fill_ratios(const std::vector<BenchRatio>& ratios,
                                    const std::vector<BenchRow>& rows) {
  const auto find = [&](const std::string& name) -> const BenchRow* {
    for (const auto& row : rows) {
      if (row.name == name && !row.frames.empty()) return &row;
    }
    return nullptr;
  };
  std::vector<BenchRatio> filled;
  for (auto ratio : ratios) {
    const auto *row = find(ratio.row), *base = find(ratio.base);
    if (!row || !base) continue;
    ratio.wall = row->wall_s().median / base->wall_s().median;
    ratio.processor = row->processor_s().median / base->processor_s().median;
    if (row->quality && base->quality)
      ratio.psnr_gain_db = row->quality->psnr_db - base->quality->psnr_db;
    filled.push_back(std::move(ratio));
  }
  return filled;
}

std::string bench_header(const Bench& bench, const std::string& suite) {
  const auto& d = bench.device();
  const auto& waves = bench.options().waves;
  return std::string("raywave ") + version + ", " + suite + " bench, " + today() + "\ndevice   " +
         d.index + " " + d.name + ", " + std::to_string(d.compute_units) +
         " compute units\nplatform " + d.platform + "\nversion  " + d.version + ", driver " +
         d.driver + ", FFT " + std::string(cl::name_of(bench.options().fft)) +
         (waves ? "\nwaves on " + waves->index + " " + waves->name : "") + "\nrates    copy " +
         figure(bench.limits().bytes_per_s / 1e9) + " GB/s, multiply-add " +
         figure(bench.limits().operations_per_s / 1e9) + " Gflop/s\n";
}

std::string bench_heads(BenchStyle style) {
  std::vector<std::string> heads;
  for (const auto& c : columns) heads.emplace_back(c.head);
  return heads_of(heads, main_widths(), style);
}

std::string bench_line(const BenchRow& row, BenchStyle style) {
  const auto name =
      row.name + (row.share > 1 ? " (1/" + std::to_string(row.share) + ", scaled)" : "");
  if (row.frames.empty()) return joined({name, row.note}, {columns[0].width, 0}, style);
  const auto wall = row.wall_s();
  std::vector<std::string> cells{name,
                                 milliseconds(wall.median),
                                 milliseconds(wall.low) + " - " + milliseconds(wall.high),
                                 milliseconds(row.processor_s().median),
                                 figure(row.per_second()),
                                 targets_text(row.target.required_per_s, row.target.aim_per_s),
                                 row.quality ? format("%.1f", row.quality->psnr_db) : ""};
  // The rest is the wall time that no column of a stage shows.
  double rest = wall.median;
  for (const auto* stage : stages) {
    const double seconds = row.part_s(stage);
    cells.push_back(row.peer && seconds == 0 ? "" : milliseconds(seconds));
    rest -= seconds;
  }
  const bool has_stages = !row.frames[0].stages_s.empty();
  cells.push_back(has_stages ? milliseconds(rest) : "");
  cells.push_back(row.peer ? "" : milliseconds(row.first_frame_s));
  cells.push_back(
      row.peer ? "" : mebibytes(row.device_peak_bytes) + " / " + mebibytes(row.resident_bytes));
  cells.push_back(row.peer ? "" : percent(row.others_share));
  return joined(cells, main_widths(), style) + (row.note.empty() ? "" : "    " + row.note + "\n");
}

std::string bench_work_table(const Bench& bench, const std::vector<BenchRow>& rows,
                             BenchStyle style) {
  const std::vector<int> widths{columns[0].width, -9, 8, 8, 8, 9, 9, 9};
  std::string text;
  for (const auto& row : rows) {
    for (const auto* stage : stages) {
      const auto found = row.work.find(stage);
      const double seconds = row.part_s(stage);
      if (found == row.work.end() || !(seconds > 0)) continue;
      const auto& work = found->second;
      std::vector<std::string> cells{row.name, stage, milliseconds(seconds)};
      const auto add = [&](double amount, double most_per_s, double unit) {
        cells.push_back(amount > 0 ? figure(amount / unit) : "");
        if (unit == 1e6) cells.push_back(amount > 0 ? format("%.2f", amount / seconds / 1e9) : "");
        cells.push_back(amount > 0 ? percent(amount / seconds / most_per_s) : "");
      };
      add(work.bytes, bench.limits().bytes_per_s, 1e6);
      add(work.operations, bench.limits().operations_per_s, 1e9);
      text += joined(cells, widths, style);
    }
  }
  if (text.empty()) return text;
  return heads_of({"", "stage", "ms", "MB", "GB/s", "of copy", "Gflop", "of mad"}, widths, style) +
         text;
}

std::string bench_ratio_table(const std::vector<BenchRatio>& ratios, BenchStyle style) {
  if (ratios.empty()) return "";
  const std::vector<int> widths{-60, 9, 9, 15, 9};
  std::string text =
      heads_of({"time over", "wall", "cpu", "wanted at most", "dB more"}, widths, style);
  for (const auto& r : ratios) {
    text += joined({r.name, format("%.3g", r.wall), format("%.3g", r.processor),
                    targets_text(std::round(r.at_most * 1e3) / 1e3, std::round(r.aim * 1e3) / 1e3),
                    r.psnr_gain_db ? format("%+.1f", *r.psnr_gain_db) : ""},
                   widths, style);
  }
  return text;
}

std::string bench_json(const Bench& bench, const std::string& suite,
                       const std::vector<BenchRow>& rows, const std::vector<BenchRatio>& ratios) {
  Json json{{"raywave", version},
            {"date", today()},
            {"suite", suite},
            {"device", json_of(bench.device())}};
  json["device"]["compute_units"] = bench.device().compute_units;
  json["device"]["fft"] = cl::name_of(bench.options().fft);
  if (bench.options().waves) json["waves_on"] = json_of(*bench.options().waves);
  json["rates"] = {{"copy_bytes_per_s", bench.limits().bytes_per_s},
                   {"multiply_add_operations_per_s", bench.limits().operations_per_s}};
  json["rows"] = Json::array();
  for (const auto& row : rows) json["rows"].push_back(json_of(row, bench.limits()));
  json["ratios"] = Json::array();
  for (const auto& r : ratios) {
    json["ratios"].push_back({{"name", r.name},
                              {"row", r.row},
                              {"base", r.base},
                              {"wall", r.wall},
                              {"processor", r.processor},
                              {"required_at_most", r.at_most},
                              {"aim_at_most", r.aim},
                              {"psnr_gain_db", r.psnr_gain_db ? Json(*r.psnr_gain_db) : Json()}});
  }
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace raywave
