// SPDX-License-Identifier: Apache-2.0
// FFTW, one line at a time. Transforms from one line into another are up to a quarter faster than
// in place (1440 samples: 1.2 us against 1.6), and lines side by side, one sample of each next to
// the other, half as slow again. Threads are the caller's: plans are then quick to measure, and
// neither they nor a single bit of a result depends on the number of threads.
#include "host/common/line_fft.hpp"

#include <fftw3.h>

#include <algorithm>
#include <climits>
#include <fstream>
#include <mutex>

#include "host/common/cache.hpp"
#include "host/common/error.hpp"
#include "host/common/memory_need.hpp"

namespace raywave {
namespace {

using Sample = std::complex<float>;

constexpr double planning_seconds = 5;   // at most, for each of the two plans of a size
constexpr std::size_t small_line = 512;  // samples; below, measuring costs more than it gains

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

fftwf_complex* fftw(const Sample* samples) {
  return reinterpret_cast<fftwf_complex*>(const_cast<Sample*>(samples));
}

/// Wisdom holds for one FFTW and CPU.
std::string wisdom_file() {
  std::string cpu;
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; cpu.empty() && std::getline(in, line);) {
    if (line.starts_with("model name")) cpu = line;
  }
  return "fftw-" + hash_name(fftwf_version + ('\n' + cpu)) + ".wisdom";
}

std::string exported_wisdom() {
  const std::unique_ptr<char, Free> text(fftwf_export_wisdom_to_string());
  return text ? text.get() : "";
}

}  // namespace

Lines make_lines(std::size_t samples, const std::string& name) {
  const std::size_t bytes =
      (samples * sizeof(std::complex<float>) / LineFft::alignment + 1) * LineFft::alignment;
  Lines lines(static_cast<std::complex<float>*>(std::aligned_alloc(LineFft::alignment, bytes)));
  if (!lines)
    throw DeviceError(
        name + ": " + format_bytes(bytes) +
        " asked, out of host memory; a smaller hologram.resolution or wrp.padding needs less");
  return lines;
}

Lines make_zero_lines(std::size_t samples, const std::string& name) {
  auto lines = make_lines(samples, name);
  std::fill_n(lines.get(), samples, std::complex<float>{});
  return lines;
}

struct LineFft::Plans {
  Plan forward, inverse;
};

LineFft::LineFft(std::size_t size, bool is_fast) : size_(size), plans_(std::make_unique<Plans>()) {
  if (size < 1 || size > INT_MAX)
    throw DeviceError("FFTW transforms 1 to 2147483647 samples, not " + std::to_string(size));
  const auto in = make_lines(size, "line of an FFT"), out = make_lines(size, "line of an FFT");
  const bool is_measured = is_fast && size >= small_line;

  std::string known;
  const auto file = wisdom_file();
  {
    const std::lock_guard lock(planner_mutex());
    if (is_measured) {
      if (const auto stored = load_cached(file))
        fftwf_import_wisdom_from_string(std::string(stored->begin(), stored->end()).c_str());
      known = exported_wisdom();
    }
    fftwf_set_timelimit(planning_seconds);
    const auto plan = [&](int sign) {
      return fftwf_plan_dft_1d(static_cast<int>(size), fftw(in.get()), fftw(out.get()), sign,
                               (is_measured ? FFTW_MEASURE : FFTW_ESTIMATE) | FFTW_PRESERVE_INPUT);
    };
    plans_->forward.reset(plan(FFTW_FORWARD));
    plans_->inverse.reset(plan(FFTW_BACKWARD));
    if (is_measured) {
      if (const auto learnt = exported_wisdom(); learnt != known)
        store_cached(file, learnt.data(), learnt.size());
    }
  }
  if (!plans_->forward || !plans_->inverse)
    throw DeviceError("FFTW has no plan for " + std::to_string(size) + " samples");
}

LineFft::~LineFft() = default;
LineFft::LineFft(LineFft&&) noexcept = default;

void LineFft::forward(const Sample* in, Sample* out) const {
  fftwf_execute_dft(plans_->forward.get(), fftw(in), fftw(out));
}

void LineFft::inverse(const Sample* in, Sample* out) const {
  fftwf_execute_dft(plans_->inverse.get(), fftw(in), fftw(out));
}

}  // namespace raywave
