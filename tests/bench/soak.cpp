// SPDX-License-Identifier: Apache-2.0
// Renders a moving scene for long, and prints as a table in Markdown what memory the program holds
// at the start and at every tenth. Ends with 1 when it grows after the first tenth.
//
// usage: bench_soak FRAMES SCENE.toml [KEY=VALUE ...]   FRAMES is 1000 or more
#include "tests/support/soak.hpp"

#include <cstdio>
#include <cstdlib>
#include <exception>

#include "cl/device.hpp"
#include "host/scene/scene.hpp"
#include "tests/support/scenes.hpp"

namespace raywave {
namespace {

using test::SoakReading;

// The system counts pages, which the allocator and drivers keep or give back as they see fit.
constexpr std::uint64_t most_resident_growth = 4 << 20, most_heap_growth = 256 << 10;

double mebibytes(std::uint64_t bytes) { return static_cast<double>(bytes) / (1 << 20); }

bool is_flat(const SoakReading& early, const SoakReading& late) {
  return late.resident_bytes <= early.resident_bytes + most_resident_growth &&
         late.heap_bytes <= early.heap_bytes + most_heap_growth &&
         late.device_bytes <= early.device_bytes;
}

int run(int frames, const std::string& file, const std::vector<std::string>& set) {
  const cl::Device device(cl::find_device());
  std::printf("%d frames of %s on %s\n\n", frames, file.c_str(), device.info().name.c_str());
  std::printf("| frames | s | resident MiB | heap MiB | device MiB |\n|---|---|---|---|---|\n");
  std::vector<int> when{test::soak_period};
  for (int tenth = 1; tenth <= 10; ++tenth) when.push_back(frames / 10 * tenth);
  const auto readings = test::soak(device, load_scene(file, set), when, [](const auto& r) {
    std::printf("| %d | %.0f | %.2f | %.3f | %.3f |\n", r.frames, r.wall_s,
                mebibytes(r.resident_bytes), mebibytes(r.heap_bytes), mebibytes(r.device_bytes));
    std::fflush(stdout);
  });
  const bool flat = is_flat(readings[1], readings.back());
  std::printf("\nmemory is %s from a tenth of the frames to their end\n",
              flat ? "flat" : "NOT flat");
  return flat ? 0 : 1;
}

}  // namespace
}  // namespace raywave

int main(int count, char** words) {
  const int frames = count > 2 ? std::atoi(words[1]) : 0;
  if (frames < 1000) {
    std::fprintf(stderr, "usage: bench_soak FRAMES SCENE.toml [KEY=VALUE ...]\n");
    return 2;
  }
  try {
    return raywave::run(frames, words[2], {words + 3, words + count});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_soak: %s\n", error.what());
    return 2;
  }
}
