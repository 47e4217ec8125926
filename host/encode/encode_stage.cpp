// SPDX-License-Identifier: Apache-2.0
#include "host/encode/encode_stage.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <utility>

#include "host/common/error.hpp"
#include "host/common/threads.hpp"

namespace raywave {

void brighten(std::span<std::complex<float>> field, double radiance_unit, const Plan& plan) {
  const double factor = std::sqrt(radiance_unit) * amplitude_unit_m(plan);
  std::atomic<bool> finite = true;
  cl::Threads::shared().for_ranges(field.size(), [&](std::size_t, std::size_t i, std::size_t end) {
    bool all = true;
    for (; i < end; ++i) {
      auto& sample = field[i];
      sample = {static_cast<float>(sample.real() * factor),
                static_cast<float>(sample.imag() * factor)};
      all &= std::isfinite(sample.real()) && std::isfinite(sample.imag());
    }
    if (!all) finite = false;
  });
  if (!finite)
    throw InputError(plan.scene_name +
                     ": the hologram's field is brighter than a float holds; give a smaller "
                     "light.intensity");
}

EncodeStage::EncodeStage(const cl::Device& device, Options options, StageTimes& times)
    : device_(device), options_(options), times_(times) {}

void EncodeStage::prepare(const Plan& plan, std::optional<double> clip,
                          std::optional<std::size_t> tile) {
  plan_ = &plan;
  tile_ = tile;
  for (auto& copy : copies_) copy = {};  // a picture that failed may have left some under way
  encoded_ = 0;
  has_light_ = false;
  const auto size = tile ? plan.tiling.tile_size : plan.hologram.size;
  if (!encoder_ || tile) {
    std::optional<PanelPart> part;
    if (tile) part = {plan.hologram.size, plan.tiling.tiles[*tile].first};
    panel_ = std::make_shared<Panel>(plan.slm, size, plan.hologram.pitch_m,
                                     plan.hologram.wavelength_m, part);
    encoder_ ? encoder_->set_part(panel_) : (void)encoder_.emplace(device_, panel_);
  }
  encoder_->show_up_to(clip);
  const auto frames = static_cast<std::size_t>(plan.hologram.frames);
  levels.assign(frames, std::vector<std::uint8_t>(encodes_at_end() ? 0 : area_of(size)));
  light.assign(options_.count_light ? frames : 0, {});
  last_.reset();
  is_bright_ = false;
  field = {};
  const bool is_one_piece = frames == 1 && (tile || plan.tiling.tiles.size() == 1);
  needs_field_ = options_.keep_field || encodes_at_end() ||
                 (options_.share_clip && !clip && encoder_->needs_clip() && !plan.refine &&
                  !(options_.field_stays && is_one_piece));
  if (needs_field_)
    field = {size.x, size.y, plan.hologram.frames,
             std::vector<std::complex<float>>(frames * area_of(size))};
}

template <class T>
cl::Copy EncodeStage::start_reading(const cl::Buffer<T>& from, const PixelWindow& window,
                                    std::span<T> hologram) const {
  const auto width = static_cast<std::size_t>(panel_->size_px().x);
  const auto at =
      static_cast<std::size_t>(window.first.y) * width + static_cast<std::size_t>(window.first.x);
  return from.start_reading_rows(hologram.data() + at, static_cast<std::size_t>(window.size.x),
                                 width);
}

void EncodeStage::encode_window(const TileField& of_window, const PixelWindow& window,
                                std::size_t frame) {
  const StageClock clock(times_, "encode");
  const auto buffer = encoded_++ % copies_.size();
  copies_[buffer].wait();
  const double clip = encoder_->clip_of(of_window);
  has_light_ = has_light_ || clip != 1;  // 1 of all numbers: where there is none
  copies_[buffer] = start_reading(encoder_->levels_of(of_window, window, clip, buffer), window,
                                  std::span(levels[frame]));
  if (!plan_->refine) count_light(of_window, window, frame, clip);
  device_.finish();
}

void EncodeStage::count_light(const TileField& of_window, const PixelWindow& window,
                              std::size_t frame, double clip) {
  if (options_.count_light) light[frame] += encoder_->light_of(of_window, window, clip);
}

PixelWindow EncodeStage::window_of(std::size_t tile) const {
  return {plan_->tiling.tiles[tile].first - panel_->first_px(), plan_->tiling.tile_size};
}

void EncodeStage::run(const TileField& at_hologram, std::size_t tile, int frame) {
  const auto number = static_cast<std::size_t>(frame);
  if (!encodes_whole(*plan_) || tile_)
    encode_window(at_hologram, window_of(tile), number);
  else if (plan_->refine)
    count_light(at_hologram, window_of(tile), number, 1);
  if (!needs_field_) {
    last_ = at_hologram;
    return;
  }
  const auto pixels = area_of(panel_->size_px());
  start_reading(*at_hologram.samples, window_of(tile),
                std::span(field.samples).subspan(number * pixels, pixels))
      .wait();
}

void EncodeStage::run_whole(const cl::ComplexBuffer& hologram, int frame) {
  const auto number = static_cast<std::size_t>(frame);
  if (plan_->slm.band == glm::dvec2(1))
    return encode_window(hologram, {{0, 0}, plan_->hologram.size}, number);
  const StageClock clock(times_, "encode");
  levels[number] =
      std::move(encode(device_, *encoder_,
                       {plan_->hologram.size.x, plan_->hologram.size.y, 1, hologram.read()})
                    .front());
}

void EncodeStage::run_waiting() {
  if (encodes_at_end()) encode_field();
}

void EncodeStage::show_up_to(double clip, double radiance_unit) {
  if (!encoder_->needs_clip() || plan_->refine) return;
  light.assign(light.size(), {});
  if (last_) {
    encoder_->show_up_to(clip / std::sqrt(radiance_unit));
    return encode_window(*last_, {{0, 0}, panel_->size_px()}, 0);
  }
  // As `raywave encode` takes it
  brighten_field(radiance_unit);
  encoder_->show_up_to(clip * amplitude_unit_m(*plan_));
  encode_field();
}

void EncodeStage::brighten_field(double radiance_unit) {
  if (!std::exchange(is_bright_, true)) brighten(field.samples, radiance_unit, *plan_);
}

void EncodeStage::encode_field() {
  const StageClock clock(times_, "encode");
  for (auto& copy : copies_) copy.wait();
  light.clear();
  levels = encode(device_, *encoder_, field, options_.count_light ? &light : nullptr);
}

void EncodeStage::release() {
  for (auto& copy : copies_) copy.wait();
  encoder_->release();
}

void EncodeStage::finish(double radiance_unit) {
  {
    const StageClock clock(times_, "encode");
    for (auto& copy : copies_) copy.wait();
  }
  is_dark_ = looks_dark();
  const double unit = radiance_unit * std::pow(amplitude_unit_m(*plan_), 2);
  for (auto& frame : light)
    if (!is_bright_) frame = {unit * frame.all, unit * frame.shown};
  if (options_.keep_field)
    brighten_field(radiance_unit);
  else
    field = {};
}

bool EncodeStage::looks_dark() const {
  if (options_.count_light)
    return std::ranges::all_of(light, [](const ShownLight& frame) { return frame.all == 0; });
  if (needs_field_)
    return std::ranges::all_of(field.samples,
                               [](const auto& sample) { return sample == std::complex<float>(); });
  if (encoder_->needs_clip()) return !has_light_;
  // Darkness has one phase, but for what the SLM adds to it
  return std::ranges::all_of(levels, [](const auto& frame) {
    return std::ranges::adjacent_find(frame, std::not_equal_to<>()) == frame.end();
  });
}

}  // namespace raywave
