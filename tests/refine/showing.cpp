// SPDX-License-Identifier: Apache-2.0
// Refinement that knows how the SLM shows its phases: the beam, the pixels' fill, the source.
#include "host/encode/encode.hpp"
#include "host/encode/shown.hpp"
#include "host/refine/refine.hpp"
#include "host/refine/refine_stage.hpp"
#include "host/view/compare.hpp"
#include "host/view/reconstruct.hpp"
#include "tests/support/devices.hpp"
#include "tests/support/render.hpp"

namespace raywave {
namespace {

using namespace test;
constexpr auto host = cl::FftBackend::host;
constexpr glm::ivec2 size(160, 128);
constexpr double pitch_m = 4e-6, wavelength_m = 638e-9, z_m = 8e-3, blur_m = 10e-6;

/// Bars of several widths and brightnesses, up to the edges of what the pixels show.
RefineKey bars() {
  RefineKey key{z_m, {0, 0}, {1, 1}, {208, 168, {}}, glm::dvec2(2e-6)};
  for (int y = 0; y < 168; ++y)
    for (int x = 0; x < 208; ++x) {
      const bool inside = x > 12 && x < 196 && y > 12 && y < 156;
      key.picture.pixels.push_back(!inside           ? 0.0f
                                   : x / 24 % 2 == 0 ? 1.0f
                                   : y / 36 % 2 == 0 ? 0.5f
                                                     : 0.15f);
    }
  return key;
}

/// PSNR of what an SLM shows of phases that were refined for an SLM.
double psnr_db(const cl::Device& device, const SlmSpec& shown_by, const SlmSpec& refined_for) {
  const auto key = bars();
  RefineSettings settings;
  settings.blur_m = blur_m;
  settings.iterations = 40;
  auto spec = refine_spec(settings, refined_for, size, glm::dvec2(pitch_m), wavelength_m, {key});
  const auto refined = refine(device, host, random_phases(size, 2, 1), {&key, 1}, spec);
  auto slm = shown_by;
  slm.encoding = Encoding::phase;
  const auto panel = std::make_shared<const Panel>(slm, size, glm::dvec2(pitch_m), wavelength_m);
  Encoder encoder(device, panel);
  const auto shown = shown_field(*panel, encode(device, encoder, refined.field));
  const HologramSpec hologram{size, glm::dvec2(pitch_m), wavelength_m};
  const auto picture = blurred(reconstruct(device, host, shown, hologram,
                                           {.z_m = z_m, .window_m = glm::dvec2(400e-6, 320e-6)}),
                               blur_m / pitch_m);
  const auto wanted = refinement::blurred_picture(key, blur_m, {picture.width, picture.height},
                                                  glm::dvec2(pitch_m));
  return compare_pictures(wanted, picture, {0, 4, {}, Domain::intensity, false}).psnr_db;
}

void check_better(const cl::Device& device, const char* name, const SlmSpec& slm,
                  double at_least_db) {
  const double ideal = psnr_db(device, {}, {}), unknown = psnr_db(device, slm, {}),
               known = psnr_db(device, slm, slm);
  INFO(name << ": " << ideal << " dB ideal, " << unknown << " where refinement does not know it, "
            << known << " where it does");
  CHECK(unknown < ideal);
  CHECK(known > unknown + at_least_db);
}

DEVICE_TEST("refinement that knows the beam, the fill or the source is better where they are so") {
  SlmSpec slm;
  slm.illumination.profile.diameter_m = {500e-6, 500e-6};
  check_better(device, "beam", slm, 20);
  slm = {};
  slm.fill = glm::dvec2(0.95);
  check_better(device, "fill", slm, 2);
  slm = {};
  slm.illumination.source_size_rad = 4e-3;
  check_better(device, "source size", slm, 8);
  slm = {};
  slm.illumination.bandwidth_m = 40e-9;
  check_better(device, "bandwidth", slm, 3);
}

DEVICE_TEST("refinement that knows the panel's pixels is better where they are so") {
  SlmSpec slm;
  slm.crosstalk.sigma_m = 2e-6;
  check_better(device, "crosstalk", slm, 15);
  slm = {};
  slm.undiffracted = 0.05;
  check_better(device, "undiffracted light", slm, 22);
  slm = {};
  for (int level = 0; level < 256; ++level) {
    slm.lut.values.push_back(level / 256.0);
    slm.lut.amplitudes.push_back(1 - 0.4 * level / 255.0);
  }
  check_better(device, "amplitudes that come with phases", slm, 14);
}

DEVICE_TEST("an even beam of numbers gives the phases that no beam gives") {
  const auto key = bars();
  RefineSpec spec{.pitch_m = glm::dvec2(pitch_m),
                  .wavelength_m = wavelength_m,
                  .blur_m = blur_m,
                  .iterations = 3};
  const auto start = random_phases(size, 1, 1);
  const auto plain = refine(device, host, start, {&key, 1}, spec).field.samples;
  spec.showing.beam = std::make_shared<const std::vector<float>>(size.x * size.y, 1.0f);
  CHECK(relative_l2(refine(device, host, start, {&key, 1}, spec).field.samples, plain) < 1e-6);
}

}  // namespace
}  // namespace raywave
