// SPDX-License-Identifier: Apache-2.0
// Propagation of 1 and 4 WRPs of 1920 x 1080 samples against plain two-dimensional FFTW: in place,
// measured plans, as many threads, padding 2, forward and back for each WRP (the transforms alone:
// no padding, no transfer function, no sum, no crop). Both take turns in one process. `raywave
// bench` runs it, too.
//
// usage: bench_propagation [--json] [--frames N]     --json: for run_peer
// (host/evaluate/bench/bench.hpp), in place of a table. RAYWAVE_DEVICE names the device, N is the
// number of turns.
#include <fftw3.h>

#include <cstdio>
#include <cstdlib>
#include <random>
#include <thread>

#include "host/common/text.hpp"
#include "host/evaluate/bench/bench.hpp"
#include "host/evaluate/stopwatch.hpp"
#include "host/propagate/propagator.hpp"

namespace raywave {
namespace {

constexpr glm::ivec2 size(1920, 1080);
constexpr double pitch_m = 3.74e-6, wavelength_m = 638e-9, distance_m = 95e-3;

struct Contender {
  BenchRow row;
  std::function<void()> run;
};

std::vector<std::complex<float>> noise(std::size_t count) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> value(-1, 1);
  std::vector<std::complex<float>> samples(count);
  for (auto& s : samples) s = {value(random), value(random)};
  return samples;
}

/// Plain FFTW over a padded plane.
class Plain {
public:
  explicit Plain(glm::ivec2 padded)
      : count_(static_cast<std::size_t>(padded.x) * padded.y), plane_(fftwf_alloc_complex(count_)) {
    fftwf_init_threads();
    fftwf_plan_with_nthreads(static_cast<int>(std::thread::hardware_concurrency()));
    fftwf_set_timelimit(FFTW_NO_TIMELIMIT);
    forward_ = fftwf_plan_dft_2d(padded.y, padded.x, plane_, plane_, FFTW_FORWARD, FFTW_MEASURE);
    inverse_ = fftwf_plan_dft_2d(padded.y, padded.x, plane_, plane_, FFTW_BACKWARD, FFTW_MEASURE);
    // Raywave's own plans come later, in the same process
    fftwf_plan_with_nthreads(1);
    // The field below would overflow, turn after turn
    std::fill_n(reinterpret_cast<std::complex<float>*>(plane_), count_, 0);
  }
  void forward() const { fftwf_execute(forward_); }
  void inverse() const { fftwf_execute(inverse_); }

private:
  std::size_t count_;
  fftwf_complex* plane_;
  fftwf_plan forward_, inverse_;
};

void run(int turns, bool json) {
  const cl::Device device(cl::find_device());
  const auto backend = cl::default_backend(device.info());
  const auto count = static_cast<std::size_t>(size.x) * size.y;
  const cl::ComplexBuffer source(device, noise(count), "field on a WRP");
  cl::ComplexBuffer field(device, count, "field at the hologram");

  std::vector<Contender> contenders;
  std::vector<std::unique_ptr<Propagator>> propagators;
  const Plain plain(padded_size(size, 2));
  const auto enter = [&](const std::string& name, std::function<void()> work) {
    contenders.push_back({{}, std::move(work)});
    contenders.back().row.name = name;
  };
  for (const int wrps : {1, 4}) {
    const auto planes = std::to_string(wrps) + (wrps > 1 ? " WRPs" : " WRP");
    enter("plain FFTW 2-D, " + planes, [&plain, wrps] {
      for (int i = 0; i < wrps; ++i) {
        plain.forward();
        plain.inverse();
      }
    });
    for (const double padding : {2.0, 1.5, 1.25, 1.125, 1.0}) {
      propagators.push_back(std::make_unique<Propagator>(
          device, PropagatorSpec{size, {pitch_m, pitch_m}, wavelength_m, padding, backend}));
      enter("propagation, " + planes + ", padding " + number_text(padding),
            [&, &propagator = *propagators.back(), wrps] {
              for (int i = 0; i < wrps; ++i) {
                const Target target{
                    wrps == 1 ? glm::dvec2(0)
                              : glm::dvec2(i % 2 ? 3.59e-3 : -3.59e-3, i / 2 ? 2.02e-3 : -2.02e-3),
                    distance_m};
                propagator.load(source, 0, {&target, 1});
                propagator.add(target);
              }
              propagator.collect(field);
              device.finish();
            });
    }
  }
  for (int turn = -2; turn < turns; ++turn) {
    for (auto& c : contenders) {
      const Stopwatch watch;
      c.run();
      const BenchFrame frame{watch.wall_s(), watch.processor_s(), {}};
      if (turn >= 0) c.row.frames.push_back(frame);
    }
  }

  std::vector<BenchRow> rows;
  std::vector<BenchRatio> ratios;
  std::string base;
  for (auto& c : contenders) {
    if (c.row.name.starts_with("plain")) base = c.row.name;
    ratios.push_back({c.row.name, c.row.name, base});
    rows.push_back(std::move(c.row));
  }
  if (json) {
    std::fputs(peer_json(rows).c_str(), stdout);
    return;
  }
  std::printf("%s, FFT %s, %u threads, medians of %d\n\n%s", device.info().name.c_str(),
              std::string(cl::name_of(backend)).c_str(), std::thread::hardware_concurrency(), turns,
              bench_heads(BenchStyle::aligned).c_str());
  for (auto& row : rows) {
    row.peer = true;
    std::fputs(bench_line(row, BenchStyle::aligned).c_str(), stdout);
  }
  std::printf("\n%s", bench_ratio_table(fill_ratios(ratios, rows), BenchStyle::aligned).c_str());
}

}  // namespace
}  // namespace raywave

int main(int argc, char** argv) {
  std::vector<std::string> words(argv + 1, argv + argc);
  const bool json = std::erase(words, "--json") > 0;
  raywave::run(words.size() == 2 && words[0] == "--frames" ? std::atoi(words[1].c_str()) : 41,
               json);
}
