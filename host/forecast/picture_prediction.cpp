// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "host/forecast/picture_model.hpp"

namespace raywave {
namespace {

using std::numbers::pi;

/// Fitted to the demo scenes (scripts/fit, docs/planning.md): what the formulas below leave out.
constexpr double speckle_factor = 0.9;
// Some waves are cut off hard whatever the cone: by the pixels' reach, by an occluder
constexpr double cut_factor = 0.28;
constexpr double edge_factor = 6.3e-4;
constexpr double spot_factor = 9e-3;
constexpr double cell_factor = 3.2e-4;  // 3.6e-4 fitted, before cells of fine meshes averaged them
constexpr double background = 0.3;

/// Error of refined pictures: of their light, of light that cannot be shown, and of what a cell's
/// one sample misses at edges; for 6 depths and 1 frame. Light, over powers of the spots that a
/// blur holds: where these are few, phases have too little freedom for all depths. Scenes on a
/// third of the hologram are within 2.5 dB; those of all of it have 2 dB less to 9 more.
constexpr double refined_light = 0.017, refined_missing = 0.04, refined_edges = 0.19;
/// What stays of the field's error at edges, at depths between those refined towards, however many
/// frames and iterations; between the teapot (0.15) and the study (0.05), in 4 and 16 frames.
constexpr double left_of_edges = 0.1;
/// What n iterations towards pictures made of samples leave of the error of phases: paced_rest +
/// paced_first / n^paced_power, more where parts and depths contradict each other, less where
/// frames mend what others leave. Fitted to six demo scenes on two panels at 1 to 16 frames. Where
/// a blur holds few spots, as behind an eyepiece, phases have little freedom, and depths beyond
/// those that hold each other meet elsewhere: fitted to seven scenes through pupils of 1.5 to 4 mm.
constexpr double paced_rest = 0.095, paced_first = 0.39, paced_power = 1.3;
constexpr double paced_parts = 0.09, paced_depth = 0.038, paced_frames = 0.37;
constexpr double paced_grain = 0.6, paced_by_grain = 0.75, paced_depths_meet = 4.5;
constexpr double refined_by_grain = 0.75, refined_crowded = 25, crowded_by_grain = 3.2,
                 refined_by_depths = 1.2, refined_by_frames = 1.0, refined_by_rounds = 0.5;

/// Light that a stop cuts off is missing unevenly: mean square over that of the picture, for each
/// share of light cut off. Fitted to two scenes behind three stops, within 3 dB.
constexpr double stop_factor = 0.14;

/// What an encoding adds to the light of the field: a haze about the picture, and grain where it
/// interferes with the picture. Mean squares over that of the picture, fitted like the others.
/// `copies` is the light of copies of the picture around the band's corners, over that of the
/// picture; fitted to eleven scenes on two panels, within 1.6 dB.
struct EncodingNoise {
  double haze = 0, grain = 0, copies = 0;
};

EncodingNoise noise_of(Encoding encoding, const PictureRow& row) {
  if (encoding == Encoding::phase) return {6.2e-3, 0.25};
  return {row.haze, 0.06, 1.1};
}

/// Mean square of the light that double phase throws aside, over that of white: dark pixels do most
/// of it. What a pupil of one band in radius would see of it anywhere: fitted to seven scenes
/// through pupils of 1.5 to 4 mm, levels within 2.2 dB. More comes from the band's corners: fitted,
/// with the reaches between which pupils come to see it, to a teapot through 1.6 to 3.2 mm.
constexpr double haze_of_radius = 0.004, haze_in_pupil = 0.003, haze_begins = 0.39,
                 haze_is_whole = 0.45;

/// The same of refined phases, for each band that a pupil reaches farther, and the share of the
/// SLM's light that one sees over the picture that reaches beyond the band's edges, but not its
/// corners. Fitted to a coin and a teapot through pupils of 1.2 to 3.8 mm, within 2.5 dB.
constexpr double refined_haze = 0.016, refined_haze_begins = 0.27, seen_beyond_edges = 0.23;

/// Share of the error of phases that refinement at the pace of frames leaves.
double left_by(const Pace& pace, int frames, double grain) {
  if (pace.iterations == 0) return 1;
  const double left = (paced_rest + paced_first / std::pow(pace.iterations, paced_power)) /
                          std::pow(frames, paced_frames) +
                      paced_grain * std::pow(grain, paced_by_grain),
               squared = pace.depth * pace.depth,
               contradicting =
                   paced_parts * pace.parts +
                   paced_depth * squared / (1 + squared / std::pow(paced_depths_meet, 2));
  return std::min(1.0, left * (1 + contradicting));
}

/// What holds for the pictures of all depths.
struct AllDepths {
  const PictureModel& model;
  const LatticePattern& pattern;
  int frames;
  double padding_error;

  bool is_whole = model.refined_depths > 0;  // phases are refined towards whole pictures
  bool is_refined = is_whole || model.pace.iterations > 0;
  Encoding encoding = model.pace.iterations > 0 ? Encoding::phase : model.encoding;
  double blur_m = blur_of_resolution * model.resolution_m;
  double spot_m2 = model.spot_m.x * model.spot_m.y;
  double grain = std::min(1.0, spot_m2 / (4 * pi * blur_m * blur_m));
  // Light that wraps around the padded plane: its own, spread over the picture, and where it
  // interferes with the picture.
  double wrapped = std::min(1.0, std::pow(padding_error, 2));
  // What few iterations leave of the errors that phases alone and the samples' interference make
  double left = left_by(model.pace, frames, grain);
  // Frames and iterations mend the light alone: what was not sampled, or is too steep, stays
  double by_depths = std::pow(model.refined_depths / 6.0, refined_by_depths);
  double by_rounds =
      std::pow(frames, refined_by_frames) * std::pow(model.refined_rounds, refined_by_rounds);
  double light_of_grain = refined_light * std::pow(grain, refined_by_grain) +
                          refined_crowded * std::pow(grain, crowded_by_grain);
  double haze_seen =
      is_refined ? refined_haze * std::clamp(model.pupil_reach - refined_haze_begins, 0.0, 0.5)
      : model.encoding == Encoding::double_phase
          ? haze_of_radius * model.pupil_radius +
                haze_in_pupil *
                    std::clamp((model.pupil_reach - haze_begins) / (haze_is_whole - haze_begins),
                               0.0, 1.0)
          : 0;
  // Refinement leaves light beyond a pupil, where there is such a place
  double in_pupil = !is_refined               ? 0
                    : model.sees_band         ? 1
                    : model.pupil_reach > 0.5 ? seen_beyond_edges
                                              : 0;
};

/// Share of a haze all over the picture that is an error: the rest is taken for the picture, whose
/// brightness is free.
double share_of_haze(const PictureRow& row) {
  return 1 - (row.light > 0 ? std::min(1.0, row.mean * row.mean / row.light) : 1);
}

/// Error that an encoding adds, where it is not refined towards whole pictures.
double encoding_error(const AllDepths& all, const PictureRow& row) {
  const auto& model = all.model;
  const auto noise = noise_of(all.encoding, row);
  // Copies make the picture brighter, which is free, and the rest of them is an error
  const double copies = noise.copies * model.copies,
               brighter = row.light + copies * row.copies_on_picture,
               squares = brighter + copies * (row.copies_on_picture + copies * row.copies),
               of_copies = row.light > 0 ? row.light - brighter * brighter / squares : 0;
  const bool is_unshown = model.is_even || (model.sees_band && !all.is_refined);
  return row.light * (std::max(noise.haze, is_unshown ? row.unshown : 0) * share_of_haze(row) +
                      noise.grain * all.grain / all.frames) +
         (all.encoding == Encoding::phase ? std::max(0.0, row.uneven - row.missing) : 0) +
         of_copies;
}

/// Adds a row's picture to the prediction: its PSNR, and its errors by their sources.
void add_row(const AllDepths& all, std::size_t i, PicturePrediction& prediction) {
  const auto& row = all.model.rows[i];
  const auto& pattern = all.pattern;
  const double blur_m = all.blur_m, p = pattern.pitch_m;
  const double dots = row.light * std::min(pattern.dots[i], 4.0);
  const double speckle =
      row.sharp * (speckle_factor * pattern.speckle[i] + cut_factor * pattern.cut[i]) / all.frames;
  const double cells_at_edges = row.edges_m * edge_factor * std::pow(p, 4) / std::pow(blur_m, 3);
  const double field_edges = cells_at_edges + row.edges_m * spot_factor * all.spot_m2 / blur_m +
                             cell_factor * row.light * p / blur_m;
  const double padding =
      row.light * all.wrapped * (background * all.wrapped + 2 * all.grain / all.frames);
  const double field = dots + speckle + field_edges + row.missing + padding;
  // Refined phases have errors of their own: of light, where light is missing, at edges
  const double of_phases =
      all.haze_seen + row.light * all.in_pupil * row.unshown * share_of_haze(row) +
      (all.is_whole ? all.by_depths / all.by_rounds * all.light_of_grain * row.light
                    : all.left * encoding_error(all, row));
  const double missing = row.missing * (all.is_whole ? all.by_depths * refined_missing : 1);
  const double edges =
      all.is_whole ? all.by_depths * refined_edges * cells_at_edges + left_of_edges * field_edges
                   : field_edges;
  const double of_samples = all.is_whole ? 0 : all.left * (dots + speckle) + padding;
  const double stop = stop_factor * row.light * all.model.stopped;
  // Refinement knows it, and mends half (tests/refine/showing.cpp)
  const double fallen = row.fallen * (all.is_refined ? 0.5 : 1);
  // Whatever resembles nothing is matched by a dark picture, for brightness is free
  const auto psnr_db = [&](double error) {
    const double matched = std::min(row.light > 0 ? row.light : 1.0, error);
    return matched > 0 ? -10 * std::log10(matched) : 200;
  };
  const auto rows = static_cast<double>(all.model.rows.size());
  prediction.field_psnr_db += psnr_db(field) / rows;
  prediction.psnr_db.push_back(psnr_db(of_phases + missing + edges + of_samples + stop + fallen));
  prediction.mean_psnr_db += prediction.psnr_db.back() / rows;
  prediction.encoding += of_phases;
  prediction.stop += stop;
  prediction.fall_off += fallen;
  prediction.edges += edges;
  prediction.missing += missing;
  if (all.is_whole) return;
  prediction.dots += all.left * dots;
  prediction.speckle += all.left * speckle;
  prediction.padding += padding;
}

}  // namespace

double PicturePrediction::sure_db() const {
  // Refined pictures go by the light that there is: what is missing counts for more. Through pupils
  // of 1.6 to 4 mm a coin has 7 dB more to 6 less than predicted
  const double margin_db = refined ? 2.5 * (1 + missing) + (through_pupil ? 3.5 : 0) : 1;
  return std::min(mean_psnr_db - margin_db,
                  -10 * std::log10(std::pow(10, -mean_psnr_db / 10) + left_out));
}

PicturePrediction predict_pictures(const PictureModel& model, const LatticePattern& pattern,
                                   int frames, double padding_error) {
  const AllDepths all{model, pattern, frames, padding_error};
  PicturePrediction prediction;
  prediction.window = model.window;
  prediction.refined = all.is_refined;
  prediction.through_pupil = model.pupil_reach > 0;
  // Pictures made by rays hold what samples miss. The light of a highlight narrower than a cell
  // shines from the cell's middle: by up to half a pitch aside, which counts as its square
  const double coarse = std::max(1.0, pattern.pitch_m / model.resolution_m);
  prediction.left_out = all.is_whole         ? 0
                        : model.has_detail   ? 2e-4 * coarse * coarse
                        : prediction.refined ? 0
                                             : 1e-4;
  prediction.dark = std::ranges::all_of(
      model.rows, [](const auto& row) { return row.light == 0 && row.missing == 0; });
  for (std::size_t i = 0; i < model.rows.size(); ++i) add_row(all, i, prediction);
  const std::array parts{&prediction.dots,    &prediction.speckle, &prediction.edges,
                         &prediction.missing, &prediction.padding, &prediction.encoding,
                         &prediction.stop,    &prediction.fall_off};
  double sum = 0;
  for (const double* part : parts) sum += *part;
  for (double* part : parts) *part /= std::max(sum, 1e-300);
  return prediction;
}

}  // namespace raywave
