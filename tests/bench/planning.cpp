// SPDX-License-Identifier: Apache-2.0
// What docs/planning.md is fitted to: processor seconds and PSNR of scenes over sampling pitch, frames and padding. The lens's pictures are
// made once per depth; pictures are averaged over squares of pixels before the blur. One line of JSON per setting and blur.
//
// usage: bench_planning SCENE.toml "PITCHES_UM" "PADDINGS" "BLURS_UM" FRAMES SQUARE [--set ...]
#include <cstdio>
#include <nlohmann/json.hpp>
#include <sstream>

#include "host/compare.hpp"
#include "host/device_scene.hpp"
#include "host/lens.hpp"
#include "host/quality.hpp"
#include "host/reconstruct.hpp"

namespace raywave {
namespace {

std::vector<double> numbers(const char* text) {
  std::istringstream in(text);
  std::vector<double> all;
  for (double x; in >> x;) all.push_back(x);
  return all;
}

Image averaged(const Image& image, int side) {
  Image small{image.width / side, image.height / side, {}};
  for (int y = 0; y < small.height; ++y) {
    for (int x = 0; x < small.width; ++x) {
      double sum = 0;
      for (int j = 0; j < side; ++j) {
        for (int i = 0; i < side; ++i) sum += image.pixels[std::size_t{1} * (y * side + j) * image.width + x * side + i];
      }
      small.pixels.push_back(static_cast<float>(sum / (side * side)));
    }
  }
  return small;
}

void run(int argc, char** argv) {
  const auto pitches_um = numbers(argv[2]), paddings = numbers(argv[3]), blurs_um = numbers(argv[4]);
  const int frames = std::atoi(argv[5]), square = std::atoi(argv[6]);
  const std::vector<std::string> set(argv + 7, argv + argc);
  const cl::Device device(cl::find_device());
  auto scene = load_scene(argv[1], set);
  const auto world = build_world(scene);
  const auto first_plan = make_plan(scene, world, cl::FftBackend::host);
  const auto window_m = glm::dvec2(first_plan.size * first_plan.grid) * first_plan.pitch_m;
  const auto depths_m = quality_depths_m(first_plan);
  const double pixel_um = square * first_plan.pitch_m.x * 1e6;
  std::vector<Image> seen;
  {
    const DeviceScene arrays(device, scene, world, first_plan);
    for (const double z_m : depths_m)
      seen.push_back(averaged(lens_picture(device, first_plan, arrays, {z_m, window_m, {0, 0}, {1, 1}, 6}), square));
  }
  for (const double pitch_um : pitches_um) {
    for (const double padding : paddings) {
      scene.sampling.pitch_m = pitch_um * 1e-6;
      scene.wrp.padding = padding;
      scene.sampling.frames = frames;
      const auto result = render(device, scene, world);
      std::vector<std::vector<Image>> shown(depths_m.size());
      const auto pixels = std::ptrdiff_t{result.field.nx} * result.field.ny;
      for (std::size_t d = 0; d < depths_m.size(); ++d) {
        ReconstructSpec spec;
        spec.z_m = depths_m[d];
        spec.window_m = window_m;
        Image sum;
        for (int f = 0; f < frames; ++f) {
          const FieldStack one{result.field.nx,
                               result.field.ny,
                               1,
                               {result.field.samples.begin() + f * pixels, result.field.samples.begin() + (f + 1) * pixels}};
          const auto picture = averaged(reconstruct(device, cl::FftBackend::host, one, scene.hologram, spec), square);
          if (f == 0)
            sum = picture;
          else
            for (std::size_t i = 0; i < sum.pixels.size(); ++i) sum.pixels[i] += picture.pixels[i];
          if (f == 0 || f == 1 || f == 3 || f == 7 || f == 15) shown[d].push_back(sum);
        }
      }
      for (const double blur_um : blurs_um) {
        for (std::size_t n = 0; n < shown[0].size(); ++n) {
          nlohmann::ordered_json line{{"scene", scene.file.stem().string()},
                                      {"set", set},
                                      {"pitch_um", pitch_um},
                                      {"padding", padding},
                                      {"frames", 1 << n},
                                      {"blur_um", blur_um}};
          for (std::size_t d = 0; d < depths_m.size(); ++d) {
            const auto figures = compare_pictures(seen[d], shown[d][n], {blur_um / pixel_um, static_cast<int>(75 / pixel_um), {}});
            line["psnr_db"].push_back(figures.psnr_db);
            line["ssim"].push_back(figures.ssim);
          }
          line["rendered_frames"] = frames;
          line["samples"] = result.samples;
          line["hidden"] = result.hidden_samples;
          line["wrps"] = result.plan.wrps.size();
          line["processor_s"] = result.processor_seconds;
          line["seconds"] = result.seconds;
          std::printf("%s\n", line.dump().c_str());
          std::fflush(stdout);
        }
      }
    }
  }
}

}  // namespace
}  // namespace raywave

int main(int argc, char** argv) {
  if (argc < 7) return std::fprintf(stderr, "usage: bench_planning SCENE PITCHES_UM PADDINGS BLURS_UM FRAMES SQUARE [set ...]\n"), 2;
  raywave::run(argc, argv);
}
