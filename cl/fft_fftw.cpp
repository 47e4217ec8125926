// SPDX-License-Identifier: Apache-2.0
// FFTW on the mapped buffer. A 2-D transform is one pass over columns and one over rows; columns right of the live part are zero before
// `forward` and unwanted after `inverse`, so that pass leaves them out: 1.6 times faster than the whole plane at padding 2. (Columns
// copied in blocks to narrow scratch memory take 13 instead of 18 ms of a forward transform's 36; not yet worth own threading.)
#include <fftw3.h>

#include <algorithm>
#include <climits>
#include <fstream>
#include <mutex>
#include <thread>

#include "cl/cache.hpp"
#include "cl/fft.hpp"

namespace raywave::cl {
namespace {

constexpr double planning_seconds = 4;                     // at most, for each of the four plans of a shape
constexpr std::size_t small_plane = std::size_t{1} << 16;  // samples; below, measured plans and threads gain less than they cost

// FFTW's planner and its wisdom are one global state.
std::mutex& planner_mutex() {
  static std::mutex mutex;
  return mutex;
}

struct DestroyPlan {
  void operator()(fftwf_plan plan) const {
    const std::lock_guard lock(planner_mutex());
    fftwf_destroy_plan(plan);
  }
};
using Plan = std::unique_ptr<std::remove_pointer_t<fftwf_plan>, DestroyPlan>;

struct Free {
  void operator()(void* pointer) const { fftwf_free(pointer); }
};

int thread_count() { return static_cast<int>(std::max(1u, std::thread::hardware_concurrency())); }

/// Wisdom holds for one FFTW, CPU and number of threads.
std::string wisdom_file() {
  std::string cpu;
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; cpu.empty() && std::getline(in, line);) {
    if (line.starts_with("model name")) cpu = line;
  }
  return "fftw-" + hash_name(std::string(fftwf_version) + '\n' + cpu + '\n' + std::to_string(thread_count())) + ".wisdom";
}

std::string exported_wisdom() {
  const std::unique_ptr<char, Free> text(fftwf_export_wisdom_to_string());
  return text ? text.get() : "";
}

class FftwFft final : public Fft {
public:
  explicit FftwFft(const FftShape& shape) {
    const std::lock_guard lock(planner_mutex());
    static const bool threads_ready = fftwf_init_threads() != 0;
    const bool is_small = shape.nx * shape.ny < small_plane;
    const auto file = wisdom_file();
    std::string known;
    if (!is_small) {
      if (const auto stored = load_cached(file)) fftwf_import_wisdom_from_string(std::string(stored->begin(), stored->end()).c_str());
      known = exported_wisdom();
    }
    if (threads_ready) fftwf_plan_with_nthreads(is_small ? 1 : thread_count());
    fftwf_set_timelimit(planning_seconds);

    // Measuring overwrites its array; with wisdom the array is never touched.
    const std::unique_ptr<fftwf_complex, Free> scratch(fftwf_alloc_complex(shape.nx * shape.ny));
    if (!scratch)
      throw DeviceError("FFT: " + format_bytes(shape.nx * shape.ny * sizeof(fftwf_complex)) + " for planning: out of host memory");
    const auto nx = static_cast<int>(shape.nx), ny = static_cast<int>(shape.ny), live_nx = static_cast<int>(shape.live_nx);
    const unsigned flags = is_small ? FFTW_ESTIMATE : FFTW_MEASURE;
    const auto plan = [&](int n, int count, int stride, int distance, int sign) {
      Plan made(fftwf_plan_many_dft(1, &n, count, scratch.get(), nullptr, stride, distance, scratch.get(), nullptr, stride, distance, sign,
                                    flags));
      if (!made) throw DeviceError("FFTW has no plan for " + std::to_string(count) + " transforms of " + std::to_string(n) + " samples");
      return made;
    };
    forward_columns_ = plan(ny, live_nx, nx, 1, FFTW_FORWARD);
    forward_rows_ = plan(nx, ny, 1, nx, FFTW_FORWARD);
    inverse_rows_ = plan(nx, ny, 1, nx, FFTW_BACKWARD);
    inverse_columns_ = plan(ny, live_nx, nx, 1, FFTW_BACKWARD);

    if (is_small) return;
    if (const auto learnt = exported_wisdom(); learnt != known) store_cached(file, learnt.data(), learnt.size());
  }

  void forward(ComplexBuffer& plane) override { execute(plane, forward_columns_, forward_rows_); }
  void inverse(ComplexBuffer& plane) override { execute(plane, inverse_rows_, inverse_columns_); }

private:
  static void execute(ComplexBuffer& plane, const Plan& first, const Plan& second) {
    plane.on_host([&](std::span<std::complex<float>> samples) {
      auto* data = reinterpret_cast<fftwf_complex*>(samples.data());
      // Plans that serve any address are 10 % slower, and drivers align buffers to 128 bytes.
      if (fftwf_alignment_of(*data) != 0) throw DeviceError("FFTW: the device maps its memory to an address that SIMD cannot use");
      fftwf_execute_dft(first.get(), data, data);
      fftwf_execute_dft(second.get(), data, data);
    });
  }

  Plan forward_columns_, forward_rows_, inverse_rows_, inverse_columns_;
};

}  // namespace

std::unique_ptr<Fft> make_fftw(const Device&, const FftShape& shape) {
  if (shape.nx > INT_MAX || shape.ny > INT_MAX) throw DeviceError("FFTW transforms at most 2147483647 samples along an axis");
  return std::make_unique<FftwFft>(shape);
}

}  // namespace raywave::cl
