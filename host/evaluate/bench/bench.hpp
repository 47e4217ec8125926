// SPDX-License-Identifier: Apache-2.0
/// The speed of a device at holograms of a moving scene, the time of each stage, and the quality of
/// the holograms (docs/performance.md).
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cl/fft.hpp"
#include "host/evaluate/quality.hpp"
#include "host/evaluate/stopwatch.hpp"
#include "host/geometry/world.hpp"
#include "host/plan/plan.hpp"

namespace raywave {

/// One frame: from the call that moves the object to the finished levels of all lasers in host
/// memory.
struct BenchFrame {
  double wall_s = 0;
  double processor_s = 0;  // of all threads of this process
  // Wall seconds; "rest" is what no stage claims, so that all add up to wall_s
  std::map<std::string, double> stages_s;
  std::map<std::string, double> stages_processor_s{};  // of the same stages but "rest"
};

/// Measured limits of a device: bytes read plus bytes written by copies between its buffers, and
/// floating-point operations of multiply-adds, per second.
struct DeviceLimits {
  double bytes_per_s = 0, operations_per_s = 0;
};

/// The work of a stage in a frame, where the host can count it; 0 where it cannot.
struct StageWork {
  double operations = 0;  // floating-point: 5 n log2 n for each transform of n samples that is done
  double bytes = 0;       // of fields and levels that it must read and write at least
};

/// Wanted frames per second of a case.
struct BenchTarget {
  double required_per_s = 0, aim_per_s = 0;  // 0: none
};

/// A case to be measured. Every object turns from frame to frame.
struct BenchCase {
  std::string group, name;
  std::vector<Scene> scenes;  // of all lasers
  Method method = Method::wrp;
  int rays_per_axis = 100;  // of Method::rays
  // Only one in so many of the hologram's rows is computed, a strip through its middle, and times
  // are scaled
  int share = 1;
  BenchTarget target = {};
  std::shared_ptr<const Meshes> meshes = {};  // in place of the files that the scene names
};

/// The quotient of two rows' times and what is wanted of it.
struct BenchRatio {
  std::string name, row, base;           // names of rows
  double at_most = 0, aim = 0;           // 0: nothing is wanted
  double wall = 0, processor = 0;        // quotients of medians
  std::optional<double> psnr_gain_db{};  // of row over base, where both are known
};

/// A program of tests/bench/ to be measured in the same run.
struct BenchPeer {
  std::string name, program;  // of its file
  std::vector<std::string> arguments;
  int frames = 1, quick_frames = 1;
  std::optional<Scene> scene{};  // that it renders, where it leaves a field to be judged
};

struct BenchSuite {
  std::string name;
  std::vector<BenchCase> cases;
  std::vector<BenchPeer> peers;
  std::vector<BenchRatio> ratios;  // to be filled by fill_ratios
};

/// "cpu": the teapot on 1 and 2 x 2 WRPs, coarse and fine samples, padding 2 and 1.25; "gpu": the
/// same with a GPU's targets; "paper": the paper's evaluation; "scaling": triangles, sample pitch,
/// hologram size, frames together.
///
/// data    the folder of the demo scenes
/// throws  InputError when there is no such suite, or no such folder
BenchSuite bench_suite(const std::string& name, const std::filesystem::path& data);

struct BenchOptions {
  cl::FftBackend fft = cl::FftBackend::host;
  std::optional<cl::DeviceInfo> waves{};  // RenderOptions::waves_device
  int frames = 0;       // measured per case; 0: 3 to 101, as many as fit into `seconds`
  double seconds = 5;   // for each case, when `frames` is 0
  bool quality = true;  // also compare a hologram with what a lens sees
  int lens_points = 8;  // per axis, of that lens
  bool quick = false;   // rates of the device less accurate
};

/// Quality of a hologram in the middle of the scene's depth, compared with a lens there
/// (host/evaluate/quality.hpp).
struct BenchQuality {
  double psnr_db = 0, ssim = 0, z_m = 0, blur_m = 0;
};

/// A case and its measurements; those of a peer have no scenes.
struct BenchRow : BenchCase {
  std::size_t triangles = 0;
  // Of all lasers together, like work; rays are the primary ones of a frame, counted for fans only
  int samples = 0, hidden_samples = 0;
  std::uint64_t rays = 0;
  glm::ivec2 grid{1, 1}, padded{1, 1};
  std::vector<BenchFrame> frames;         // empty when it could not be computed
  std::map<std::string, StageWork> work;  // by stage
  std::optional<BenchQuality> quality;
  std::uint64_t device_peak_bytes = 0, resident_bytes = 0;
  // With all that comes before it: meshes, plans, kernels from the cache or not
  double first_frame_s = 0;
  double others_share = 0;  // of the machine's processors that other programs used meanwhile
  std::string note;         // why it could not be computed
  bool peer = false;        // not raywave

  Spread wall_s() const;
  Spread processor_s() const;
  Spread stage_s(const std::string& stage) const;
  Spread stage_processor_s(const std::string& stage) const;
  /// Part of the median wall time that a stage takes: as in the frames between the quartiles. These
  /// parts add up, medians do not.
  double part_s(const std::string& stage) const;
  /// Holograms of a frame: sampling.frames of each laser.
  int holograms() const;
  /// Holograms by the median.
  double per_second() const;
};

/// Measures rows on one device.
class Bench {
public:
  Bench(const cl::DeviceInfo& device, BenchOptions options);

  const cl::DeviceInfo& device() const { return device_; }
  const BenchOptions& options() const { return options_; }
  const DeviceLimits& limits() const { return limits_; }

  /// Warms up, then measures. An error of the case goes into the row's note.
  BenchRow run(const BenchCase& what);

  /// Quality of holograms of the scene, with their fields. The lens's picture of a scene is
  /// computed once.
  BenchQuality quality_of(const std::vector<Scene>& scenes, const World& world, Rendered rendered);

private:
  void measure(BenchRow& row);

  cl::DeviceInfo device_;
  BenchOptions options_;
  DeviceLimits limits_;
  std::map<std::string, LensPictures> seen_by_lens_;
};

/// Runs a program of tests/bench/ and takes over the rows that it prints (peer_json).
///
/// throws  InputError when the program fails or prints something else
std::vector<BenchRow> run_peer(const std::filesystem::path& program,
                               const std::vector<std::string>& arguments);

/// Names and frames of rows, as run_peer reads them.
std::string peer_json(const std::vector<BenchRow>& rows);

/// The ratios whose two rows were both measured.
std::vector<BenchRatio> fill_ratios(const std::vector<BenchRatio>& ratios,
                                    const std::vector<BenchRow>& rows);

enum class BenchStyle { aligned, markdown };

/// "raywave 0.1.0, cpu bench, <date>", device and rates.
std::string bench_header(const Bench& bench, const std::string& suite);
/// Column heads and a row's line under them; the second table: bytes moved, operations, and shares
/// of what the device can do.
std::string bench_heads(BenchStyle style);
std::string bench_line(const BenchRow& row, BenchStyle style);
std::string bench_work_table(const Bench& bench, const std::vector<BenchRow>& rows,
                             BenchStyle style);
std::string bench_ratio_table(const std::vector<BenchRatio>& ratios, BenchStyle style);

/// Everything, for machines.
std::string bench_json(const Bench& bench, const std::string& suite,
                       const std::vector<BenchRow>& rows, const std::vector<BenchRatio>& ratios);

}  // namespace raywave
