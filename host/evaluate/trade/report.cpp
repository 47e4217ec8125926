// SPDX-License-Identifier: Apache-2.0
#include "host/evaluate/report.hpp"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "host/common/text.hpp"
#include "host/evaluate/trade/knobs.hpp"
#include "raywave_version.hpp"

namespace raywave {
namespace {

/// Stages shown in the CSV and the text; the JSON has more stages.
constexpr std::array stages{"samples", "trace", "propagate", "refine", "encode"};

/// The reasons why a row was measured: "draft", "wrp.padding = 2", "together"; and "frontier" when
/// it lies there.
std::vector<std::string> roles_of(const Trade& trade, std::size_t row,
                                  const std::vector<std::size_t>& frontier) {
  std::vector<std::string> roles;
  for (const auto& preset : trade.presets) {
    if (preset.row == row) roles.emplace_back(name_of(preset.preset));
  }
  for (const auto& step : trade.steps) {
    if (step.row == row) roles.push_back(step.knob + " = " + step.value);
  }
  const auto is_in = [&](const std::vector<std::size_t>& rows) {
    return std::ranges::find(rows, row) != rows.end();
  };
  if (is_in(trade.together)) roles.emplace_back("together");
  if (is_in(frontier)) roles.emplace_back("frontier");
  return roles;
}

std::string joined(const std::vector<std::string>& texts, const char* between) {
  std::string all;
  for (const auto& text : texts) all += (all.empty() ? "" : between) + text;
  return all;
}

std::string quoted(std::string text) {
  for (std::size_t at = 0; (at = text.find('"', at)) != std::string::npos; at += 2)
    text.insert(at, 1, '"');
  return '"' + text + '"';
}

/// The time in milliseconds as text without a unit: "12.3".
std::string milliseconds(double seconds) {
  return format(seconds < 0.1 ? "%.2f" : seconds < 1 ? "%.1f" : "%.0f", 1e3 * seconds);
}

Json json_of_step(const Trade& trade, const TradeStep& step) {
  Json json{{"knob", step.knob}, {"value", step.value}, {"row", step.row}};
  const auto &base = trade.rows[trade.base], &row = trade.rows[step.row];
  if (base.renders == 0 || row.renders == 0) return json;
  json["times"] = row.time_s / base.time_s;
  json["gain_db"] = row.psnr_db() - base.psnr_db();
  return json;
}

}  // namespace

Json json_of(const TradeRow& row) {
  Json json{{"knobs", json_of(row.knobs)}, {"thorough", row.thorough}, {"renders", row.renders}};
  if (!row.note.empty()) json["note"] = row.note;
  if (row.renders == 0) return json;
  json.update({{"time_s", row.time_s},
               {"psnr_db", row.psnr_db()},
               {"ssim", row.mean(&TradePicture::ssim)},
               {"flip", row.mean(&TradePicture::flip)},
               {"speckle_contrast",
                {{"lens", row.mean(&TradePicture::contrast_lens)},
                 {"hologram", row.mean(&TradePicture::contrast_hologram)}}},
               {"samples", row.samples},
               {"device_bytes", row.device_bytes},
               {"predicted", row.predicted}});
  for (const auto& [stage, time] : row.stages)
    json["stages"][stage] = {{"wall_s", time.wall_s}, {"processor_s", time.processor_s}};
  for (const auto& p : row.pictures) {
    json["pictures"].push_back(
        {{"view", p.view},
         {"z_m", p.z_m},
         {"psnr_db", p.psnr_db},
         {"ssim", p.ssim},
         {"flip", p.flip},
         {"speckle_contrast", {{"lens", p.contrast_lens}, {"hologram", p.contrast_hologram}}}});
  }
  if (row.correlation)
    json["against_points"] = {{"correlation", *row.correlation},
                              {"relative_error", *row.field_error}};
  return json;
}

TradeRow row_of(const Json& json) {
  TradeRow row;
  row.knobs = knobs_of(json.at("knobs"));
  row.thorough = json.at("thorough");
  row.renders = json.at("renders");
  row.note = json.value("note", "");
  if (row.renders == 0) return row;
  row.time_s = json.at("time_s");
  row.samples = json.at("samples");
  row.device_bytes = json.at("device_bytes");
  row.predicted = json.at("predicted");
  for (const auto& [stage, time] : json.at("stages").items())
    row.stages[stage] = {time.at("wall_s"), time.at("processor_s")};
  for (const auto& p : json.at("pictures")) {
    const auto& contrast = p.at("speckle_contrast");
    row.pictures.push_back({p.at("view"), p.at("z_m"), p.at("psnr_db"), p.at("ssim"), p.at("flip"),
                            contrast.at("lens"), contrast.at("hologram")});
  }
  if (json.contains("against_points")) {
    row.correlation = json["against_points"].at("correlation");
    row.field_error = json["against_points"].at("relative_error");
  }
  return row;
}

std::string trade_label(const TradeKnobs& knobs, const TradeKnobs& base) {
  std::string label = length_text(knobs.pitch_m) + ", " + std::to_string(knobs.frames) +
                      (knobs.frames == 1 ? " frame" : " frames") + ", padding " +
                      number_text(knobs.padding);
  for (const auto& knob : trade_knobs()) {
    const auto value = knob.get(knobs);
    const auto& key = knob.key;
    if (value == knob.get(base) || key == "sampling.pitch" || key == "sampling.frames" ||
        key == "wrp.padding")
      continue;
    label += ", " + key.substr(key.find('.') + 1) + " " +
             (value.is_string() ? value.get<std::string>() : number_text(value));
  }
  return label;
}

std::string trade_json(const Trade& trade) {
  const auto& p = trade.pictures;
  Json json{{"raywave", version},
            {"date", today()},
            {"of", trade.of},
            {"scene", trade.scenes[0].file.filename().string()},
            {"resolution",
             {trade.scenes[0].hologram.resolution.x, trade.scenes[0].hologram.resolution.y}},
            {"grid", {trade.grid.x, trade.grid.y}},
            {"device", json_of(trade.device)},
            {"pictures",
             {{"resolution_m", trade.resolution_m},
              {"blur_m", *p.blur_m},
              {"depths_m", p.depths_m},
              {"window_m", json_of(*p.window)},
              {"square_px", p.square_px},
              {"border_px", p.border_px},
              {"lens_points_per_axis", p.lens_points}}},
            {"base", trade.base}};
  json["device"]["compute_units"] = trade.device.compute_units;
  for (const auto& preset : trade.presets) {
    Json one{{"preset", name_of(preset.preset)}, {"row", preset.row}};
    const auto& row = trade.rows[preset.row];
    if (row.renders > 0) {
      const auto fastest = fastest_as_accurate(trade.rows, preset.row);
      one["fastest_as_accurate"] = {{"row", fastest},
                                    {"times", row.time_s / trade.rows[fastest].time_s}};
    }
    json["presets"].push_back(one);
  }
  json["steps"] = Json::array();
  for (const auto& step : trade.steps) json["steps"].push_back(json_of_step(trade, step));
  json["together"] = trade.together;
  json["frontier"] = trade_frontier(trade.rows);
  json["sheet"] = sheet_rows(trade);
  for (const auto& row : trade.rows) json["rows"].push_back(json_of(row));
  return json.dump(1) + "\n";
}

std::string trade_csv(const Trade& trade) {
  std::string csv = "row,roles";
  for (const auto& knob : trade_knobs()) csv += "," + knob.key;
  csv += ",renders,time_s";
  for (const char* stage : stages) csv += format(",%s_wall_s,%s_processor_s", stage, stage);
  csv +=
      ",psnr_db,ssim,flip,sides_psnr_db,speckle_lens,speckle_hologram,points_correlation,points_"
      "relative_error,samples,device_bytes,note\n";
  const auto frontier = trade_frontier(trade.rows);
  const auto add = [&](double value) { csv += "," + Json(value).dump(); };
  const auto add_if = [&](bool is_there, double value) {
    is_there ? add(value) : void(csv += ",");
  };
  for (std::size_t i = 0; i < trade.rows.size(); ++i) {
    const auto& row = trade.rows[i];
    const bool measured = row.renders > 0;
    csv += std::to_string(i) + "," + quoted(joined(roles_of(trade, i, frontier), "; "));
    for (const auto& knob : trade_knobs()) {
      const auto value = knob.get(row.knobs);
      csv += "," + (value.is_string() ? value.get<std::string>() : value.dump());
    }
    csv += "," + std::to_string(row.renders);
    add_if(measured, row.time_s);
    for (const char* stage : stages) {
      const auto found = row.stages.find(stage);
      const auto time = found == row.stages.end() ? TradeTime{} : found->second;
      add_if(measured, time.wall_s);
      add_if(measured, time.processor_s);
    }
    add_if(measured, row.psnr_db());
    add_if(measured, row.mean(&TradePicture::ssim));
    add_if(measured, row.mean(&TradePicture::flip));
    add_if(measured && row.psnr_db(true) != 0, row.psnr_db(true));
    add_if(measured, row.mean(&TradePicture::contrast_lens));
    add_if(measured, row.mean(&TradePicture::contrast_hologram));
    add_if(row.correlation.has_value(), row.correlation.value_or(0));
    add_if(row.field_error.has_value(), row.field_error.value_or(0));
    csv += "," + (measured ? std::to_string(row.samples) : "");
    csv += "," + (measured ? std::to_string(row.device_bytes) : "") + "," + quoted(row.note) + "\n";
  }
  return csv;
}

std::string trade_text(const Trade& trade) {
  const auto& base = trade.rows[trade.base];
  std::string text = format(
      "%s on %s; PSNR and SSIM at %s, mean of %zu depths; times of samples, trace, propagate, "
      "refine and encode\n\n",
      trade.scenes[0].file.filename().c_str(), trade.device.name.c_str(),
      length_text(trade.resolution_m).c_str(), trade.pictures.depths_m.size());
  // A line for a row: its figures, or why it has none
  const auto add = [&](const std::string& name, const TradeRow& row) {
    if (row.renders == 0) {
      text += format("%-10s  %s: %s\n", name.c_str(), trade_label(row.knobs, base.knobs).c_str(),
                     row.note.c_str());
    } else {
      text += format("%-10s  %8s ms  %6.2f dB  %6.4f  %s\n", name.c_str(),
                     milliseconds(row.time_s).c_str(), row.psnr_db(), row.mean(&TradePicture::ssim),
                     trade_label(row.knobs, base.knobs).c_str());
    }
  };
  // Presets: measured, predicted, and the fastest row that is as accurate
  for (const auto& preset : trade.presets) {
    const auto& row = trade.rows[preset.row];
    add(name_of(preset.preset), row);
    if (row.renders == 0) continue;
    text += format("%-10s  %8s     %6.2f     predicted\n", "",
                   milliseconds(row.predicted_s()).c_str(), row.predicted_psnr_db());
    const auto fastest = fastest_as_accurate(trade.rows, preset.row);
    if (fastest == preset.row) continue;
    text += format("%-10s  %.2f times the time of the fastest that is as accurate:\n", "",
                   row.time_s / trade.rows[fastest].time_s);
    add("", trade.rows[fastest]);
  }
  text += "\nfrontier\n";
  for (const auto i : trade_frontier(trade.rows)) add("", trade.rows[i]);
  // Rows that differ from the base in one knob
  if (!trade.steps.empty())
    text += format("\n%-20s  %-28s  %6s  %7s   alone, against balanced\n", "knob", "value",
                   "time x", "dB");
  for (const auto& step : trade.steps) {
    const auto& row = trade.rows[step.row];
    text += format("%-20s  %-28s  ", step.knob.c_str(), step.value.c_str());
    if (row.renders > 0 && base.renders > 0)
      text += format("%6.2f  %+7.2f\n", row.time_s / base.time_s, row.psnr_db() - base.psnr_db());
    else
      text += row.note + "\n";
  }
  return text;
}

}  // namespace raywave
