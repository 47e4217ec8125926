// SPDX-License-Identifier: Apache-2.0
#include "host/evaluate/refinement.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <nlohmann/json.hpp>

#include "host/common/text.hpp"
#include "host/forecast/judged_pictures.hpp"
#include "host/render.hpp"
#include "host/view/compare.hpp"
#include "host/view/reconstruct.hpp"

namespace raywave {
namespace {

/// Pixels whose surroundings, 9 x 9 pixels, are bright and even to 3 % of the peak.
std::vector<bool> even_part(const Image& picture) {
  constexpr int reach = 4;
  const int nx = picture.width, ny = picture.height;
  const float peak = *std::ranges::max_element(picture.pixels);
  // Minima and maxima along rows, then along columns
  const auto extremes = [&](const std::vector<float>& from, int step, int count, int place,
                            std::size_t at, bool largest) {
    float value = from[at];
    for (int k = -std::min(reach, place); k <= std::min(reach, count - 1 - place); ++k) {
      const float other = from[at + std::ptrdiff_t{k} * step];
      value = largest ? std::max(value, other) : std::min(value, other);
    }
    return value;
  };
  std::vector<float> low(picture.pixels.size()), high(picture.pixels.size());
  for (std::size_t at = 0; at < low.size(); ++at) {
    const int x = static_cast<int>(at) % nx;
    low[at] = extremes(picture.pixels, 1, nx, x, at, false);
    high[at] = extremes(picture.pixels, 1, nx, x, at, true);
  }
  std::vector<bool> even(picture.pixels.size());
  for (std::size_t at = 0; at < even.size(); ++at) {
    const int y = static_cast<int>(at) / nx;
    even[at] =
        picture.pixels[at] > 0.3f * peak &&
        extremes(high, nx, ny, y, at, true) - extremes(low, nx, ny, y, at, false) < 0.03f * peak;
  }
  return even;
}

/// Standard deviation over mean of shown over seen.
double contrast(const Image& shown, const Image& seen, const std::vector<bool>& where) {
  double count = 0, sum = 0, squares = 0;
  for (std::size_t i = 0; i < where.size(); ++i) {
    if (!where[i]) continue;
    const double ratio = static_cast<double>(shown.pixels[i]) / static_cast<double>(seen.pixels[i]);
    count += 1;
    sum += ratio;
    squares += ratio * ratio;
  }
  const double mean = sum / count;
  return std::sqrt(std::max(squares / count - mean * mean, 0.0)) / mean;
}

const char* text_of(KeyRole role) {
  return role == KeyRole::optimised ? "optimised" : role == KeyRole::held_out ? "held out" : "view";
}

}  // namespace

RefinementFigures judge_refinement(const cl::Device& device, cl::FftBackend backend,
                                   const HologramSpec& hologram, const JudgedHolograms& holograms,
                                   std::span<const JudgedKey> keys, double blur_m, int border_px,
                                   double middle_m, const std::function<void(double)>& progress) {
  RefinementFigures figures;
  figures.blur_m = blur_m;
  figures.border_px = border_px;
  // Squares of a quarter of the blur lose nothing, and save most of the time.
  const int square_px = std::max(1, static_cast<int>(blur_m / hologram.pitch_m.x / 4));
  const double blur_px = blur_m / hologram.pitch_m.x / square_px;
  const RefineKey* amid = nullptr;
  for (const auto& judged : keys) {
    if (judged.key.aperture == glm::dvec2(1, 1) &&
        (!amid || std::abs(judged.key.z_m - middle_m) < std::abs(amid->z_m - middle_m)))
      amid = &judged.key;
  }
  double done = 0;
  for (const auto& judged : keys) {
    const auto& key = judged.key;
    ReconstructSpec spec;
    spec.z_m = key.z_m;
    spec.window_m = key.window_m();
    spec.view = key.view;
    spec.aperture = key.aperture;
    spec.pupil = key.pupil;
    const auto size = picture_size(spec.window_m, hologram.resolution, hologram.pitch_m);
    figures.window_m = glm::max(figures.window_m, glm::dvec2(size) * hologram.pitch_m);
    const auto seen =
        averaged(refinement::blurred_picture(key, blur_m, size, hologram.pitch_m), square_px);
    const auto even = even_part(seen);
    const bool any_even = std::ranges::find(even, true) != even.end();
    RefinementRow row{judged.role, key.z_m, key.view, key.aperture, key.pupil, {}};
    Gain light, speckle;
    const auto look = [&](FieldStack JudgedHolograms::*which, double& psnr_db, double& share,
                          double& c) {
      const auto sharp =
          averaged(reconstruct(device, backend, holograms.*which, hologram, spec), square_px);
      const auto shown = blurred(sharp, blur_px);
      psnr_db =
          compare_pictures(seen, shown, {0, border_px / square_px, {}, Domain::intensity, false})
              .psnr_db;
      if (&key == amid) {
        const auto& field = holograms.*which;
        share = light_in_picture(seen, sharp) * square_px * square_px /
                (mean_light_of(field) * field.nx * field.ny);
        if (any_even) c = contrast(shown, seen, even);
      }
      if (progress) progress((done += 1.0 / 3) / static_cast<double>(keys.size()));
    };
    look(&JudgedHolograms::field, row.psnr_db.field, light.field, speckle.field);
    look(&JudgedHolograms::unrefined, row.psnr_db.unrefined, light.unrefined, speckle.unrefined);
    look(&JudgedHolograms::refined, row.psnr_db.refined, light.refined, speckle.refined);
    figures.rows.push_back(row);
    if (&key == amid) {
      figures.light = light;
      if (any_even) figures.contrast = speckle;
    }
  }
  return figures;
}

std::string refinement_text(const RefinementFigures& figures, const RefineFigures& loop) {
  std::string text;
  const auto add = [&](const char* what, const std::string& where, const char* how,
                       const Gain& gain) {
    text += format("%-10s  %-38s", what, where.c_str());
    for (const double value : {gain.field, gain.unrefined, gain.refined})
      text += format(how, value);
    text += "\n";
  };
  if (!figures.rows.empty())
    text +=
        "window " + PictureWindow::around_axis(figures.window_m).text() + ", blur " +
        length_text(std::round(figures.blur_m * 1e7) / 1e7) + ", border " +
        std::to_string(figures.border_px) + " px\n" +
        format("%-10s  %-38s%10s%10s%10s\n", "PSNR, dB", "depth", "field", "unrefined", "refined");
  for (const auto& row : figures.rows) {
    std::string where = length_text(row.z_m);
    if (row.aperture != glm::dvec2(1, 1))
      where += format(", from %g,%g", std::round(row.view.x * 100) / 100,
                      std::round(row.view.y * 100) / 100);
    if (row.pupil)
      where += format(", from %.3g,%.3g mm", -1e3 * row.pupil->centre_m.x + 0.0,
                      1e3 * row.pupil->centre_m.y);
    add(text_of(row.role), where, "%10.1f", row.psnr_db);
  }
  if (!figures.rows.empty()) add("light", "in the picture", "%10.2f", figures.light);
  if (figures.contrast) add("speckle", "contrast after the blur", "%10.3f", *figures.contrast);
  const auto exact = loop.exact_keys
                         ? ", " + std::to_string(loop.exact_keys) + " pictures by exact propagation"
                         : "";
  return text +
         format("%d iterations and %.0f transforms a frame in %.2f s, prepared in %.2f s%s\n",
                loop.iterations, loop.transforms, loop.loop_s, loop.prepare_s, exact.c_str());
}

Json refinement_json(const RefinementFigures& figures, const RefineFigures& loop) {
  const auto gain_json = [](const Gain& gain) {
    return Json{{"field", gain.field}, {"unrefined", gain.unrefined}, {"refined", gain.refined}};
  };
  Json json;
  for (const auto& row : figures.rows) {
    json["rows"].push_back({{"role", text_of(row.role)},
                            {"z_m", row.z_m},
                            {"view", {row.view.x, row.view.y}},
                            {"aperture", {row.aperture.x, row.aperture.y}},
                            {"psnr_db", gain_json(row.psnr_db)}});
    if (row.pupil)
      json["rows"].back()["pupil"] = {
          {"diameter_m", row.pupil->diameter_m},
          {"position_m", {row.pupil->centre_m.x, row.pupil->centre_m.y}}};
  }
  if (!figures.rows.empty()) {
    json["window_m"] = {figures.window_m.x, figures.window_m.y};
    json["blur_m"] = figures.blur_m;
    json["border_px"] = figures.border_px;
    json["light"] = gain_json(figures.light);
  }
  if (figures.contrast) json["speckle_contrast"] = gain_json(*figures.contrast);
  json["iterations"] = loop.iterations;
  json["transforms_per_frame"] = loop.transforms;
  json["exact_keys"] = loop.exact_keys;
  json["seconds"] = {{"prepare", loop.prepare_s}, {"iterations", loop.loop_s}};
  return json;
}

}  // namespace raywave
