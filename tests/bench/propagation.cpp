// SPDX-License-Identifier: Apache-2.0
// Propagation of 1 and 4 WRPs of 1920 x 1080 samples against plain two-dimensional FFTW: in place, measured plans, as many threads, padding
// 2, forward and back for each WRP (the transforms alone: no padding, no transfer function, no sum, no crop). Both take turns in one
// process. Wall times: medians, least, and the ratios of both.
//
// usage: bench_propagation [device] [turns]
#include <fftw3.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <random>
#include <thread>

#include "host/propagator.hpp"

namespace raywave {
namespace {

constexpr glm::ivec2 size(1920, 1080);
constexpr double pitch_m = 3.74e-6, wavelength_m = 638e-9, distance_m = 95e-3;

struct Contender {
  std::string name;
  std::function<void()> run;
  std::vector<double> wall_ms, processor_ms;
};

double least(const std::vector<double>& times) { return *std::min_element(times.begin(), times.end()); }

double median(std::vector<double> times) {
  std::nth_element(times.begin(), times.begin() + std::ssize(times) / 2, times.end());
  return times[times.size() / 2];
}

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
  explicit Plain(glm::ivec2 padded) : count_(static_cast<std::size_t>(padded.x) * padded.y), plane_(fftwf_alloc_complex(count_)) {
    fftwf_init_threads();
    fftwf_plan_with_nthreads(static_cast<int>(std::thread::hardware_concurrency()));
    fftwf_set_timelimit(FFTW_NO_TIMELIMIT);
    forward_ = fftwf_plan_dft_2d(padded.y, padded.x, plane_, plane_, FFTW_FORWARD, FFTW_MEASURE);
    inverse_ = fftwf_plan_dft_2d(padded.y, padded.x, plane_, plane_, FFTW_BACKWARD, FFTW_MEASURE);
    fftwf_plan_with_nthreads(1);                                             // raywave's own plans come later, in the same process
    std::fill_n(reinterpret_cast<std::complex<float>*>(plane_), count_, 0);  // the field below would overflow, turn after turn
  }
  void forward() const { fftwf_execute(forward_); }
  void inverse() const { fftwf_execute(inverse_); }

private:
  std::size_t count_;
  fftwf_complex* plane_;
  fftwf_plan forward_, inverse_;
};

void run(const char* device_name, int turns) {
  const cl::Device device(cl::find_device(device_name));
  const auto backend = cl::default_backend(device.info());
  const auto count = static_cast<std::size_t>(size.x) * size.y;
  const cl::ComplexBuffer source(device, noise(count), "field on a WRP");
  cl::ComplexBuffer field(device, count, "field at the hologram");

  std::vector<Contender> contenders;
  std::vector<std::unique_ptr<Propagator>> propagators;
  const Plain plain(padded_size(size, 2));
  for (const int wrps : {1, 4}) {
    contenders.push_back({"plain FFTW, padding 2, " + std::to_string(wrps) + " WRP",
                          [&plain, wrps] {
                            for (int i = 0; i < wrps; ++i) {
                              plain.forward();
                              plain.inverse();
                            }
                          },
                          {},
                          {}});
    for (const double padding : {2.0, 1.5, 1.25, 1.125, 1.0}) {
      propagators.push_back(std::make_unique<Propagator>(device, PropagatorSpec{size, {pitch_m, pitch_m}, wavelength_m, padding, backend}));
      char name[64];
      std::snprintf(name, sizeof name, "raywave, padding %.3g, %d WRP", padding, wrps);
      contenders.push_back({name,
                            [&, &propagator = *propagators.back(), wrps] {
                              for (int i = 0; i < wrps; ++i) {
                                const Target target{
                                    wrps == 1 ? glm::dvec2(0) : glm::dvec2(i % 2 ? 3.59e-3 : -3.59e-3, i / 2 ? 2.02e-3 : -2.02e-3),
                                    distance_m};
                                propagator.load(source, 0, {&target, 1});
                                propagator.add(target);
                              }
                              propagator.collect(field);
                              device.finish();
                            },
                            {},
                            {}});
    }
  }
  for (int turn = -2; turn < turns; ++turn) {
    for (auto& c : contenders) {
      const auto start = std::chrono::steady_clock::now();
      const auto processor_start = std::clock();
      c.run();
      const std::chrono::duration<double, std::milli> wall = std::chrono::steady_clock::now() - start;
      const double processor_ms = 1e3 * static_cast<double>(std::clock() - processor_start) / CLOCKS_PER_SEC;
      if (turn < 0) continue;
      c.wall_ms.push_back(wall.count());
      c.processor_ms.push_back(processor_ms);
    }
  }
  std::printf("%s, FFT %s, %u threads, medians and least of %d\n", device.info().name.c_str(), std::string(cl::name_of(backend)).c_str(),
              std::thread::hardware_concurrency(), turns);
  const Contender* base = nullptr;
  for (const auto& c : contenders) {
    if (c.name.starts_with("plain")) base = &c;
    std::printf("%-36s", c.name.c_str());
    for (const auto times : {&Contender::wall_ms, &Contender::processor_ms})
      std::printf("  %s %7.2f, %7.2f ms, ratio %.3f, %.3f", times == &Contender::wall_ms ? "wall" : "processor", median(c.*times),
                  least(c.*times), median(c.*times) / median(base->*times), least(c.*times) / least(base->*times));
    std::printf("\n");
  }
}

}  // namespace
}  // namespace raywave

int main(int argc, char** argv) { raywave::run(argc > 1 ? argv[1] : "", argc > 2 ? std::atoi(argv[2]) : 41); }
