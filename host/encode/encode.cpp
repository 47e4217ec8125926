// SPDX-License-Identifier: Apache-2.0
#include "host/encode/encode.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/common/error.hpp"
#include "host/encode/shown.hpp"
#include "host/geometry/kernel_options.hpp"
#include "host/plan/message_text.hpp"

namespace raywave {
namespace {

// Enough for a quantile to 0.5 % of its amplitude (root mean square, of speckle)
constexpr std::size_t most_samples = 16384;

/// Distance of the samples that a quantile is taken from: odd, so that no column is preferred.
std::size_t stride_of(std::size_t size) { return (size / most_samples) | 1; }

cl::Options options_of(const cl::Device& device, const Panel& panel) {
  const auto& slm = panel.slm();
  const bool has_table = !panel.level_table().empty();
  return {{option::lanes, std::to_string(device.info().float_lanes)},
          {option::encoding, std::to_string(static_cast<int>(slm.encoding))},
          {option::added_turns, panel.added().empty() ? "0" : "1"},
          {option::beam, panel.beam().empty() || slm.encoding == Encoding::phase ? "0" : "1"},
          {option::level_table, has_table ? "1" : "0"},
          {option::grey_levels, std::to_string(grey_levels_of(slm))}};
}

static_assert(Panel::table_size == LEVEL_TABLE_SIZE);
static_assert(static_cast<int>(Encoding::phase) == ENCODING_PHASE &&
              static_cast<int>(Encoding::double_phase) == ENCODING_DOUBLE_PHASE &&
              static_cast<int>(Encoding::off_axis) == ENCODING_OFF_AXIS &&
              static_cast<int>(Encoding::burckhardt) == ENCODING_BURCKHARDT &&
              static_cast<int>(Encoding::lee) == ENCODING_LEE);

}  // namespace

Encoder::Encoder(const cl::Device& device, std::shared_ptr<const Panel> panel)
    : device_(device),
      panel_(std::move(panel)),
      added_(device, 1, "added phases"),
      beam_(device, 1, "light on pixels") {
  const auto fill = [&]<class Level>(LevelBuffers<Level>& to) {
    const auto& levels = panel_->level_table();
    to.table = {device, std::max<std::size_t>(1, levels.size()), "levels by phase"};
    if (!levels.empty()) to.table.write(std::vector<Level>(levels.begin(), levels.end()));
  };
  auto& [bytes, words] = level_buffers_;
  panel_->slm().bits > 8 ? fill(words) : fill(bytes);
}

void Encoder::set_part(std::shared_ptr<const Panel> part) {
  panel_ = std::move(part);
  window_ = {{0, 0}, {0, 0}};
}

void Encoder::show_up_to(std::optional<double> clip) {
  clip_of_all_ = clip;
  own_clip_ = 0;
}

double Encoder::clip_of_amplitudes(std::vector<float> amplitudes) {
  std::erase_if(amplitudes, [](float a) { return !std::isfinite(a); });
  if (amplitudes.empty()) return 1;
  // Where much of the hologram is dark, as of a picture near it, lit pixels count alone
  constexpr float least_lit = 0.02f;
  constexpr double much = 0.2;
  const float dark = least_lit * *std::ranges::max_element(amplitudes);
  const auto is_dark = [dark](float a) { return a <= dark; };
  const auto share_of = [&](auto count) {
    return static_cast<double>(count) / static_cast<double>(amplitudes.size());
  };
  const double dark_share = share_of(std::ranges::count_if(amplitudes, is_dark));
  // Around a picture that is gathered at the hologram, where most pixels get no light at all
  constexpr double none = 0.05;
  constexpr float least_phase = 0.06f;
  least_lit_ = share_of(std::ranges::count(amplitudes, 0.0f)) > none ? least_phase : 0;
  const auto first = dark_share > much && dark_share < 1
                         ? std::partition(amplitudes.begin(), amplitudes.end(), is_dark)
                         : amplitudes.begin();
  const auto last = static_cast<double>(amplitudes.end() - first - 1);
  const auto nth = first + std::lround(panel_->slm().clip * last);
  std::nth_element(first, nth, amplitudes.end());
  const double clip = *nth;
  if (!(clip > 0)) return 1;
  own_clip_ = std::max(own_clip_, clip);
  return clip_of_all_.value_or(clip);
}

cl::Program& Encoder::program_of(const TileField& field) {
  const bool transformed = field.transformed != nullptr,
             two_floats = transformed && field.transformed->two_floats;
  auto& program = programs_[transformed + two_floats];
  if (!program)
    program.emplace(
        device_, "kernels/encode/encode.cl",
        cl::with(options_of(device_, *panel_), {{option::transformed, transformed ? "1" : "0"},
                                                {option::two_floats, two_floats ? "1" : "0"}}));
  return *program;
}

/// Of every so many, over the beam's; those that are numbers.
std::vector<float> Encoder::amplitudes_of(const TileField& field) {
  const auto& plane = field.transformed;
  const auto pixels = plane ? area_of(plane->size) : field.samples->size();
  const auto stride = stride_of(pixels), count = (pixels + stride - 1) / stride;
  if (amplitudes_.size() != count) amplitudes_ = {device_, count, "amplitudes"};
  if (knows_beam()) upload({{0, 0}, panel_->size_px()});
  auto kernel = program_of(field).kernel("sample_amplitudes");
  const auto run = [&](const auto& source, int width) {
    kernel.run({count}, {64}, source, width, beam_, amplitudes_, static_cast<std::uint32_t>(stride),
               static_cast<std::uint32_t>(count));
  };
  plane ? run(plane->arguments(), plane->size.x) : run(*field.samples, 1);
  auto amplitudes = amplitudes_.read();
  std::erase_if(amplitudes, [](float a) { return !std::isfinite(a); });
  return amplitudes;
}

double Encoder::clip_of(const TileField& field) {
  return needs_clip() ? clip_of_amplitudes(amplitudes_of(field)) : 1;
}

double Encoder::clip_of(std::span<const std::complex<float>> field) {
  if (!needs_clip()) return 1;
  std::vector<float> amplitudes;
  for (std::size_t i = 0; i < field.size(); i += stride_of(field.size()))
    amplitudes.push_back(std::abs(field[i]) / (knows_beam() ? panel_->beam()[i] : 1.0f));
  return clip_of_amplitudes(std::move(amplitudes));
}

void Encoder::upload(const PixelWindow& window) {
  if (window == window_) return;
  const auto take = [&]<class T>(const std::vector<T>& all, cl::Buffer<T>& to, const char* name,
                                 const auto& change) {
    const auto width = static_cast<std::size_t>(window.size.x);
    std::vector<T> part(width * static_cast<std::size_t>(window.size.y));
    for (std::size_t y = 0; y < static_cast<std::size_t>(window.size.y); ++y) {
      const auto from = (static_cast<std::size_t>(window.first.y) + y) *
                            static_cast<std::size_t>(panel_->size_px().x) +
                        static_cast<std::size_t>(window.first.x);
      std::transform(all.begin() + static_cast<std::ptrdiff_t>(from),
                     all.begin() + static_cast<std::ptrdiff_t>(from + width),
                     part.begin() + static_cast<std::ptrdiff_t>(y * width), change);
    }
    if (to.size() != part.size()) to = {device_, part.size(), name};
    to.write(part);
  };
  if (!panel_->added().empty())
    take(panel_->added(), added_, "added phases", [](std::uint16_t turns) { return turns; });
  if (knows_beam())
    take(panel_->beam(), beam_, "light on pixels",
         [](float beam) { return 1 / std::max(beam, 1e-6f); });
  window_ = window;
}

ShownLight Encoder::light_of(const TileField& field, const PixelWindow& window, double clip) {
  // As many work-items of a row as read together on a GPU
  const std::size_t columns = device_.info().kind == cl::DeviceKind::gpu ? 64 : 1;
  const auto rows = static_cast<std::size_t>(window.size.y);
  if (sums_.size() != columns * rows) sums_ = {device_, columns * rows, "light of rows"};
  // Squares of scaled amplitudes stay floats, however bright or faint the field is
  double unit = clip;
  if (!needs_clip()) {
    const auto amplitudes = amplitudes_of(field);
    unit = amplitudes.empty() ? 0 : *std::ranges::max_element(amplitudes);
  }
  if (!(unit > 0)) unit = 1;
  if (knows_beam()) upload(window);
  auto kernel = program_of(field).kernel("sum_light");
  const auto run = [&](const auto& source) {
    kernel.run({columns, rows}, {columns, 1}, source, beam_, window.size.x, window.size.y,
               static_cast<float>(std::min<double>(1 / unit, std::numeric_limits<float>::max())),
               sums_);
  };
  field.transformed ? run(field.transformed->arguments()) : run(*field.samples);
  ShownLight light;
  for (const auto& sum : sums_.read())
    light += {unit * unit * double{sum.real()}, unit * unit * double{sum.imag()}};
  return light;
}

void Encoder::release() {
  const auto free = [](auto& kept) { kept.levels = {}; };
  std::apply([&](auto&... kept) { (free(kept), ...); }, level_buffers_);
  added_ = {device_, 1, "added phases"};
  beam_ = {device_, 1, "light on pixels"};
  amplitudes_ = {};
  sums_ = {};
  window_ = {{0, 0}, {0, 0}};
}

template <class Level>
const cl::Buffer<Level>& Encoder::levels_of(const TileField& field, const PixelWindow& window,
                                            double clip, std::size_t buffer) {
  require_level_bytes(panel_->slm(), sizeof(Level));
  upload(window);
  auto& kept = std::get<LevelBuffers<Level>>(level_buffers_);
  auto& levels = kept.levels.at(buffer);
  const auto pixels = area_of(window.size);
  if (levels.size() != pixels) levels = {device_, pixels, "hologram levels"};
  const bool cpu = device_.info().kind == cl::DeviceKind::cpu;
  const auto lanes = static_cast<std::size_t>(device_.info().float_lanes);
  const std::size_t columns =
      cpu ? 1 : (static_cast<std::size_t>(window.size.x) + lanes - 1) / lanes;
  // Beyond float's range the quotient would be infinite, and dark pixels no number.
  const auto inverse_clip =
      static_cast<float>(std::min<double>(1 / clip, std::numeric_limits<float>::max()));
  auto kernel = program_of(field).kernel("encode");
  const auto& slm = panel_->slm();
  const auto first = panel_->first_px() + window.first;
  const auto run = [&](const auto& source) {
    kernel.run({columns, static_cast<std::size_t>(window.size.y)}, {cpu ? 1u : 64u, 1}, source,
               added_, beam_, kept.table, levels, window.size.x, window.size.y, first.x, first.y,
               inverse_clip, least_lit_, slm.invert ? -slm.levels_per_turn : slm.levels_per_turn);
  };
  field.transformed ? run(field.transformed->arguments()) : run(*field.samples);
  return levels;
}

template const cl::Buffer<std::uint8_t>& Encoder::levels_of(const TileField&, const PixelWindow&,
                                                            double, std::size_t);
template const cl::Buffer<std::uint16_t>& Encoder::levels_of(const TileField&, const PixelWindow&,
                                                             double, std::size_t);

template <class Level>
std::vector<std::vector<Level>> encode(const cl::Device& device, Encoder& encoder,
                                       const FieldStack& field, std::vector<ShownLight>* light) {
  const auto size = encoder.panel().size_px();
  if (field.nx != size.x || field.ny != size.y)
    throw InputError("encode: the field has " + extent_text({field.nx, field.ny}) +
                     " samples, the SLM " + extent_text(size) + " pixels");
  // In strips of rows, so that memory for one is enough
  constexpr std::size_t most_pixels = std::size_t{1} << 18;
  const auto strip_pixels = std::min<std::size_t>(
      most_pixels, device.info().largest_buffer_bytes / sizeof(std::complex<float>));
  const auto nx = static_cast<std::size_t>(size.x), ny = static_cast<std::size_t>(size.y);
  const auto rows = std::clamp<std::size_t>(strip_pixels / nx, 1, ny);
  const auto band = encoder.panel().slm().band;
  std::vector<std::vector<Level>> levels;
  std::vector<std::complex<float>> limited;
  for (std::size_t frame = 0; frame < static_cast<std::size_t>(field.frames); ++frame) {
    auto samples = std::span(field.samples).subspan(frame * nx * ny, nx * ny);
    if (band != glm::dvec2(1)) {
      limited.assign(samples.begin(), samples.end());
      keep_band(limited, size, band, {0, 0});
      samples = limited;
    }
    const double clip = encoder.clip_of(samples);
    auto& picture = levels.emplace_back(nx * ny);
    ShownLight of_frame;
    for (std::size_t y = 0; y < ny; y += rows) {
      const auto strip = std::min(rows, ny - y);
      const cl::ComplexBuffer on_device(device, samples.subspan(y * nx, strip * nx),
                                        "hologram field");
      const PixelWindow window{{0, static_cast<int>(y)}, {size.x, static_cast<int>(strip)}};
      encoder.template levels_of<Level>(on_device, window, clip)
          .read(std::span(picture).subspan(y * nx, strip * nx));
      if (light) of_frame += encoder.light_of(on_device, window, clip);
    }
    if (light) light->push_back(of_frame);
  }
  return levels;
}

template std::vector<std::vector<std::uint8_t>> encode(const cl::Device&, Encoder&,
                                                       const FieldStack&, std::vector<ShownLight>*);
template std::vector<std::vector<std::uint16_t>> encode(const cl::Device&, Encoder&,
                                                        const FieldStack&,
                                                        std::vector<ShownLight>*);

}  // namespace raywave
