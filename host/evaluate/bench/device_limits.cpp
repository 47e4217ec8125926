// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <limits>

#include "host/evaluate/bench/bench.hpp"
#include "host/evaluate/stopwatch.hpp"
#include "host/geometry/kernel_options.hpp"
#include "host/trace/device_scene.hpp"

namespace raywave {
namespace {

/// The least seconds of `work` in several turns, including the wait for the device: launches return
/// early, and other processes may use the machine.
template <class F>
double least_seconds(const cl::Device& device, int turns, F&& work) {
  double least = std::numeric_limits<double>::infinity();
  for (int turn = 0; turn < turns; ++turn) {
    const Stopwatch watch;
    work();
    device.finish();
    least = std::min(least, watch.wall_s());
  }
  return least;
}

}  // namespace

DeviceLimits device_limits(const cl::Device& device, bool quick) {
  const int turns = quick ? 2 : 8;
  DeviceLimits rates;
  const auto bytes =
      std::min<std::uint64_t>(quick ? 16 << 20 : 256 << 20, device.info().largest_buffer_bytes / 4);
  {
    cl::Buffer<std::uint8_t> from(device, bytes, "copy bandwidth"),
        to(device, bytes, "copy bandwidth");
    from.fill_zero();
    to.fill_zero();
    rates.bytes_per_s = 2.0 * static_cast<double>(bytes) /
                        least_seconds(device, turns, [&] { to.copy_from(from, 0); });
  }

  const int lanes = lanes_for(device.info());
  const cl::Program program(device, "kernels/instruments/device_limits.cl",
                            {{option::lanes, std::to_string(lanes)}});
  auto multiply_add = program.kernel("multiply_add");
  // GPUs need many work-items; on CPUs, where a work-item holds several lanes, a few per core are
  // enough.
  const std::size_t items = lanes == 1 ? std::size_t{2048} * device.info().compute_units
                                       : std::size_t{16} * device.info().compute_units;
  cl::Buffer<float> sums(device, items * static_cast<std::size_t>(lanes), "sums");
  const auto run = [&](int rounds) {
    multiply_add.run({items}, {lanes == 1 ? std::size_t{64} : std::size_t{1}}, sums, rounds,
                     static_cast<std::int32_t>(items));
  };
  // The number of rounds is doubled until a launch takes 10 ms (1 ms when quick).
  int rounds = 1 << 10;
  while (rounds < 1 << 20 && least_seconds(device, 2, [&] { run(rounds); }) < (quick ? 1e-3 : 1e-2))
    rounds *= 2;
  const double operations = 16.0 * rounds * lanes * static_cast<double>(items);
  rates.operations_per_s = operations / least_seconds(device, turns, [&] { run(rounds); });
  return rates;
}

}  // namespace raywave
