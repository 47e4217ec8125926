// SPDX-License-Identifier: Apache-2.0
/// The cost of a scene's settings in time and their gain in accuracy: configurations at, around and
/// between the planner's choices are rendered, timed and judged (docs/planning.md).
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "host/common/json.hpp"
#include "host/evaluate/quality.hpp"
#include "host/forecast/presets.hpp"
#include "host/render.hpp"

namespace raywave {

constexpr int trade_sheet_cell_px = 320;  // widest cell of the sheet

/// The settings that trade time for accuracy; named as in the scene file.
struct TradeKnobs {
  double pitch_m = 1e-4;
  int frames = 1;
  WrpPropagation propagation = WrpPropagation::spectrum;
  double padding = 2;
  int layers = 1;
  int antialias = 4, visibility = 8;
  SamplingMode mode = SamplingMode::aimed;
  double cone = 1.2, apodization = 0.2;
  Precision precision = Precision::floats;
  cl::FftBackend fft = cl::FftBackend::host;
  int iterations = 0;  // refine.iterations; 0: the levels are the field's own
  double blur_m = 0;   // refine.blur
  Encoding encoding = Encoding::automatic;
  Bounces bounces = Bounces::automatic;
  int lines = 0;             // wrp.lines; 0: auto
  double margin_px = -1;     // wrp.margin; < 0: auto
  double light_samples = 1;  // over those that area lights and environments have in the scene

  bool operator==(const TradeKnobs&) const = default;
};

std::vector<Scene> with_knobs(std::vector<Scene> scenes, const TradeKnobs& knobs);

/// Medians over the renders of a row, in seconds of all lasers together.
struct TradeTime {
  double wall_s = 0;
  double processor_s = 0;  // of all threads of this process
};

/// One depth and view, as in QualityRow.
struct TradePicture {
  std::string view;
  double z_m = 0, psnr_db = 0, ssim = 0, flip = 0;
  double contrast_lens = 0, contrast_hologram = 0;  // of speckle
};

/// A configuration and its measurements.
struct TradeRow {
  TradeKnobs knobs;
  // Also looked at from the sides and, where asked for, compared with the sum of all points
  bool thorough = false;
  int renders = 0;                          // timed; 0: not yet measured, or impossible
  std::map<std::string, TradeTime> stages;  // of a further picture of a moving scene
  // By which configurations are compared: that of the stages that knobs change, together
  double time_s = 0;
  std::vector<TradePicture> pictures;  // whole views by depth, then sides
  // Of the first frame's field, complex and relative L2, with the sum of all points
  std::optional<double> correlation, field_error;
  int samples = 0;
  std::uint64_t device_bytes = 0;  // peak
  // What was predicted of each laser's hologram, as `raywave plan --json` has it
  Json predicted = Json::array();
  std::string note;  // why it cannot be computed

  bool is_done() const { return renders > 0 || !note.empty(); }
  /// Means over the depths seen through the whole hologram, or (`sides`) over the views through its
  /// parts; 0 where there are none.
  double mean(double TradePicture::*figure, bool sides = false) const;
  double psnr_db(bool sides = false) const { return mean(&TradePicture::psnr_db, sides); }
  /// Of all lasers together, and the mean of what each one's picture has.
  double predicted_s() const;
  double predicted_psnr_db() const;
};

struct TradePreset {
  Preset preset = Preset::balanced;
  std::size_t row = 0;
};

/// One knob at a value other than the base's. sampling.mode, source and shape count as one knob.
struct TradeStep {
  std::string knob, value;
  std::size_t row = 0;
};

/// The configurations to measure, and the measurements so far.
struct Trade {
  std::vector<Scene> scenes;  // of all lasers
  cl::DeviceInfo device;
  QualitySpec pictures;  // how all rows are looked at: same depths, window and blur
  double resolution_m = 0;
  glm::ivec2 grid{1, 1};
  // Hash of scene, meshes, textures, device and pictures: only rows of the same hash are comparable
  std::string of;
  std::size_t base = 0;  // "balanced"
  // No configuration twice, in an order that depends on scene, device and spec alone
  std::vector<TradeRow> rows;
  std::vector<TradePreset> presets;
  std::vector<TradeStep> steps;
  std::vector<std::size_t> together;  // rows that change several knobs at once
};

struct TradeSpec {
  bool quick = false;    // fewer values of every knob
  bool presets = false;  // nothing but the presets
  // All configurations that presets choose among, except those predicted to be far from the
  // frontier, each with several values of antialias and visibility; quick: some of those that take
  // about as long as "balanced" or less
  bool exhaustive = false;
  QualitySpec pictures;  // blur_m and square_px do not count; against_points: of thorough rows
  std::optional<cl::FftBackend> fft;  // empty: the device's default, and the others as a knob
  // Timed per row; 0: 3 to 15, as many as a second holds, 1 of what takes 4 seconds
  int renders = 0;
};

/// Measures a trade, row by row. Knobs that the scene gives stay as they are.
class TradeBench {
public:
  /// throws  InputError for the scene, or one that gives sampling.mode "fan", of which nothing can
  ///         be predicted
  TradeBench(const cl::Device& device, std::vector<Scene> scenes, const TradeSpec& spec);
  /// The same of a world that is already in memory.
  TradeBench(const cl::Device& device, std::vector<Scene> scenes, World world,
             const TradeSpec& spec);

  const Trade& trade() const { return trade_; }

  /// Takes over rows that trade_json has written.
  ///
  /// returns  how many; empty when the text is of another scene, device, version or way of looking,
  ///          or is none
  std::optional<int> resume(const std::string& json);

  /// Measures what is not done yet. Quality is bit-identical for the same device; times are not.
  ///
  /// after_some  called after every few rows, when the trade has grown
  void measure(const std::function<void()>& after_some, const Progress& progress = {});

  /// Pictures along the frontier: columns are the lens and sheet_rows, rows the depths, with one
  /// exposure. Renders them again.
  Sheet sheet(const Progress& progress = {});

private:
  std::vector<std::size_t> same_but_frames(std::size_t first) const;
  void measure_together(const std::vector<std::size_t>& rows);
  void time(TradeRow& row, Renderer& renderer, const RenderOptions& how) const;

  cl::Device device_;
  TradeSpec spec_;
  World world_;
  Trade trade_;
  LensPictures seen_by_lens_;  // as rows look: depths, then sides
};

/// Measures what is not done yet, and keeps trade.json in a folder up to date: goes on where an
/// earlier run there stopped, and writes trade.csv and trade.png in the end.
///
/// note     called with a line on what is there
/// returns  TradeBench::sheet
Sheet measure_in(TradeBench& bench, const std::filesystem::path& folder,
                 const std::function<void(const std::string&)>& note, const Progress& progress);

/// Whether a hologram is so small that rows are compared with the sum of all points unasked.
bool has_few_pixels(const Scene& scene);

/// The Pareto frontier: rows that no other row beats in time without a lower PSNR, or in PSNR
/// without a longer time; the fastest first.
std::vector<std::size_t> trade_frontier(const std::vector<TradeRow>& rows);

/// The fastest row whose PSNR is at least that of this one; the row itself when none is faster.
std::size_t fastest_as_accurate(const std::vector<TradeRow>& rows, std::size_t row);

/// Rows of the frontier that the sheet shows: seven at most, evenly along it.
std::vector<std::size_t> sheet_rows(const Trade& trade);

/// "0.071 mm, 3 frames, padding 1.125", and whatever differs from the base's other knobs.
std::string trade_label(const TradeKnobs& knobs, const TradeKnobs& base);

/// Everything, for machines (docs/planning.md); one line per row.
std::string trade_json(const Trade& trade);
std::string trade_csv(const Trade& trade);
/// For people: presets, frontier, and the cost and gain of each knob.
std::string trade_text(const Trade& trade);

}  // namespace raywave
