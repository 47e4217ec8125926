// SPDX-License-Identifier: Apache-2.0
#include "host/forecast/panel_rate.hpp"

#include <cmath>
#include <limits>

#include "host/common/text.hpp"

namespace raywave {
namespace {

constexpr double pictures_of_eye_per_s = 30;

double lasers_of(const Scene& scene) { return static_cast<double>(wavelengths_m_of(scene).size()); }

/// Of each laser, on average.
double frames_of_picture(const Scene& scene) {
  if (scene.animation && scene.animation->slm_rate_per_s)
    return *scene.animation->slm_rate_per_s / scene.animation->rate_per_s;
  if (scene.animation && scene.animation->subframes) return *scene.animation->subframes;
  return scene.sampling.frames;
}

std::string count_text(double count, const char* what) {
  return number_text(count) + " " + what + (count == 1 ? "" : "s");
}

std::string of_lasers(const Scene& scene) {
  const double lasers = lasers_of(scene);
  return lasers > 1 ? " of each of " + count_text(lasers, "laser") : "";
}

}  // namespace

std::vector<double> wavelengths_m_of(const Scene& scene) {
  if (scene.colour && !scene.colour->only) return scene.colour->lasers.wavelengths_m;
  return {scene.hologram.wavelength_m};
}

double pictures_per_s(const Scene& scene) {
  return scene.animation ? scene.animation->rate_per_s : pictures_of_eye_per_s;
}

double frames_shown(const Scene& scene, double pictures_per_s) {
  if (!scene.slm.rate_per_s) return std::numeric_limits<double>::infinity();
  return std::floor(*scene.slm.rate_per_s / (pictures_per_s * lasers_of(scene)) + 1e-6);
}

std::string why_frames_shown(const Scene& scene, double pictures_per_s) {
  if (!scene.slm.rate_per_s) return "";
  return "slm.rate " + number_text(*scene.slm.rate_per_s) + "/s: the panel shows " +
         count_text(frames_shown(scene, pictures_per_s), "frame") + of_lasers(scene) +
         " in a picture, of " + number_text(pictures_per_s) + " a second";
}

std::string panel_warning(const Scene& scene, double pictures_per_s) {
  const double frames = frames_of_picture(scene);
  if (!scene.slm.rate_per_s ||
      frames * lasers_of(scene) * pictures_per_s <= *scene.slm.rate_per_s * (1 + 1e-6))
    return "";
  const double most = frames_shown(scene, pictures_per_s);
  return count_text(frames, "frame") + of_lasers(scene) + (frames == 1 ? " takes " : " take ") +
         duration_text(frames * lasers_of(scene) / *scene.slm.rate_per_s) + " on a panel of " +
         number_text(*scene.slm.rate_per_s) + " frames/s (slm.rate), a picture of " +
         number_text(pictures_per_s) + " a second has " + duration_text(1 / pictures_per_s) +
         (most >= 1
              ? ": give " + number_text(most) + " at most, or it flickers"
              : std::string(": it flickers, ") + (lasers_of(scene) > 1 ? "fewer lasers or " : "") +
                    "a faster panel would not");
}

}  // namespace raywave
