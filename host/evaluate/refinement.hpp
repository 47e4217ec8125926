// SPDX-License-Identifier: Apache-2.0
/// What a refinement has gained: pictures of the field, of the levels that render makes of it and
/// of the refined levels, compared with what a lens sees.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "cl/fft.hpp"
#include "host/common/json.hpp"
#include "host/common/npy.hpp"
#include "host/refine/refine.hpp"
#include "host/scene/scene.hpp"

namespace raywave {

/// Holograms that are compared. They have equal sizes and frames.
struct JudgedHolograms {
  FieldStack field;      // as traced
  FieldStack unrefined;  // what an SLM shows of it
  FieldStack refined;    // what the SLM shows of the refined phases
};

/// One figure for each of the holograms.
struct Gain {
  double field = 0, unrefined = 0, refined = 0;
};

enum class KeyRole { optimised, held_out, unseen_view };

struct RefinementRow {
  KeyRole role = KeyRole::optimised;
  double z_m = 0;
  glm::dvec2 view{0, 0}, aperture{1, 1};
  std::optional<Pupil> pupil{};
  Gain psnr_db;
};

struct RefinementFigures {
  std::vector<RefinementRow> rows;
  // That all rows are judged in, around the axis, and how: standard deviation, pixels left out
  glm::dvec2 window_m{0, 0};
  double blur_m = 0;
  int border_px = 0;
  // Share of the hologram's light in the rectangle of the picture amid the scene, where that is
  // brighter than a hundredth of its peak
  Gain light;
  // Speckle contrast there, after the blur, where the lens sees even brightness; none: nowhere
  std::optional<Gain> contrast;
};

/// A picture that a lens sees, and what it has been to the refinement.
struct JudgedKey {
  KeyRole role = KeyRole::optimised;
  RefineKey key;
};

/// Reconstructs the holograms for every key, exactly (angular spectrum), and compares
/// them with its picture as `raywave quality` does.
///
/// middle_m  depth amid the scene: light and contrast are taken at the whole picture nearest to it
RefinementFigures judge_refinement(const cl::Device& device, cl::FftBackend backend,
                                   const HologramSpec& hologram, const JudgedHolograms& holograms,
                                   std::span<const JudgedKey> keys, double blur_m, int border_px,
                                   double middle_m,
                                   const std::function<void(double)>& progress = {});

/// The table that `raywave refine` prints, and the same as JSON.
std::string refinement_text(const RefinementFigures& figures, const RefineFigures& loop);
Json refinement_json(const RefinementFigures& figures, const RefineFigures& loop);

}  // namespace raywave
