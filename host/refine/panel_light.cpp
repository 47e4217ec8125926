// SPDX-License-Identifier: Apache-2.0
#include "host/refine/panel_light.hpp"

#include <cmath>

#include "host/geometry/kernel_options.hpp"
#include "host/propagate/propagation.hpp"

namespace raywave::refinement {
namespace {

cl::Buffer<float> on_device(const cl::Device& device, const std::vector<double>& values,
                            const char* name) {
  const std::vector<float> floats(values.begin(), values.end());
  return {device, std::span<const float>(floats), name};
}

}  // namespace

PanelLight::PanelLight(const cl::Device& device, std::shared_ptr<const Panel> panel)
    : device_(device),
      panel_(panel),
      encoder_(device, panel),
      program_(device, "kernels/refine/panel_light.cl",
               {{option::lanes, std::to_string(device.info().float_lanes)}}),
      added_(device, std::max<std::size_t>(1, panel->added().size()), "added phases"),
      share_(static_cast<float>(std::sqrt(1 - panel->slm().undiffracted))),
      plain_(static_cast<float>(std::sqrt(panel->slm().undiffracted))),
      light_(device),
      modulated_(device) {
  require_level_bytes(panel->slm(), 1);
  const auto size = panel->size_px();
  const auto& crosstalk = panel->crosstalk();
  const bool has_crosstalk = !crosstalk.weights.empty();
  margin_ = has_crosstalk ? crosstalk.size / 2 : glm::ivec2(0);
  weights_ =
      on_device(device, has_crosstalk ? crosstalk.weights : std::vector<double>{1}, "crosstalk");
  constexpr int packet = PictureGrid::packet;
  told_pitch_ = (size.x + packet - 1) / packet * packet + 2 * margin_.x;
  const auto pixels =
      static_cast<std::size_t>(told_pitch_) * static_cast<std::size_t>(size.y + 2 * margin_.y);
  const auto& values = panel->values();
  turns_ = {on_device(device, values.shown, "phases of levels"),
            {device, pixels, "phases that pixels are told"}};
  if (!values.amplitudes.empty())
    amplitudes_ = {on_device(device, values.amplitudes, "amplitudes of levels"),
                   {device, pixels, "amplitudes that pixels are told"}};
  if (has_added()) added_.write(panel->added());
  light_.resize(size, 1);
  modulated_.resize(size, 1);
}

void PanelLight::tell(Told& told, const cl::Buffer<std::uint8_t>& levels) {
  const auto size = encoder_.panel().size_px();
  const int rows = size.y + 2 * margin_.y;
  run_rows(device_, program_.kernel("tell"), told_pitch_, rows, levels, size.x, rows, margin_.x,
           margin_.y, told.by_level, told.values, told_pitch_);
}

void PanelLight::show(PhaseStack& holograms, int frame) {
  const auto size = encoder_.panel().size_px();
  const auto& levels = encoder_.levels_of(holograms.frame(frame), {{0, 0}, size}, 1);
  const bool has_amplitudes = amplitudes_.values.size() > 0;
  tell(turns_, levels);
  if (has_amplitudes) tell(amplitudes_, levels);
  run_rows(device_, program_.kernel("show_told"), size.x, size.y, turns_.values,
           has_amplitudes ? amplitudes_.values : turns_.values,
           static_cast<std::int32_t>(has_amplitudes), told_pitch_, weights_, 2 * margin_.x + 1,
           2 * margin_.y + 1, added_, static_cast<std::int32_t>(has_added()), share_, plain_,
           modulated_.samples, light_.samples, light_.pitch(), size.x, size.y);
}

void PanelLight::turn(PhaseStack& holograms, int frame) {
  // Where a turn takes a pixel over the end of its levels, crosstalk changes its neighbours most:
  // at the pace of frames, a quarter of each turn leaves a teapot 3.5 dB more
  const std::int32_t halvings = encoder_.panel().crosstalk().weights.empty() ? 0 : 2;
  const auto size = encoder_.panel().size_px();
  run_rows(device_, program_.kernel("turn_phases"), size.x, size.y, holograms.samples,
           holograms.first(frame, {0, 0}), modulated_.samples, light_.samples, added_,
           static_cast<std::int32_t>(has_added()), plain_, halvings, light_.pitch(), size.x,
           size.y);
}

std::shared_ptr<const Panel> panel_to_know(const SlmSpec& slm, glm::ivec2 size, glm::dvec2 pitch_m,
                                           double wavelength_m) {
  if (!adds_to_phases(slm)) return nullptr;
  auto of_phases = slm;
  of_phases.encoding = Encoding::phase;
  return std::make_shared<const Panel>(of_phases, size, pitch_m, wavelength_m);
}

}  // namespace raywave::refinement
