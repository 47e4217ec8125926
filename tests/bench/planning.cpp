// SPDX-License-Identifier: Apache-2.0
// Predictions against measurements, for docs/planning.md: renders a scene as planned, looks at it as `raywave quality` does, and prints a
// line of JSON for every setting. The lens's pictures are made once per depth; pictures are averaged over squares of pixels before the
// blur.
//
// usage: bench_planning SCENE.toml "SETTING ..." [SECTION.KEY=VALUE ...]
//        SETTING is a quality (draft), or PITCH_UM:PADDING:FRAMES
#include <cstdio>
#include <nlohmann/json.hpp>
#include <sstream>

#include "host/compare.hpp"
#include "host/device_scene.hpp"
#include "host/lens.hpp"
#include "host/planning/planner.hpp"
#include "host/quality.hpp"
#include "host/reconstruct.hpp"

namespace raywave {
namespace {

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

Planned planned_as(const Scene& scene, const World& world, const DeviceFigures& figures, const std::string& setting) {
  double pitch_um = 0, padding = 0;
  int frames = 0;
  if (std::sscanf(setting.c_str(), "%lf:%lf:%d", &pitch_um, &padding, &frames) != 3)
    return plan_scene(scene, world, figures, {quality_of(setting), {}, {}});
  auto fixed = scene;
  fixed.sampling.pitch_m = pitch_um * 1e-6;
  fixed.wrp.padding = padding;
  fixed.sampling.frames = frames;
  return plan_scene(fixed, world, figures);
}

void run(int argc, char** argv) {
  const cl::Device device(cl::find_device());
  const auto figures = figures_of(device.info());
  const auto scene = load_scene(argv[1], {argv + 3, argv + argc});
  const auto world = build_world(scene);
  const auto first_plan = make_plan(scene, world);
  const auto window_m = glm::dvec2(first_plan.size * first_plan.grid) * first_plan.pitch_m;
  const int square = first_plan.size.x < 1000 ? 2 : 4;
  const double pixel_m = square * first_plan.pitch_m.x;
  std::vector<Image> seen;
  {
    const DeviceScene arrays(device, scene, world, first_plan);
    for (const double z_m : quality_depths_m(first_plan))
      seen.push_back(averaged(lens_picture(device, first_plan, arrays, {z_m, window_m, {0, 0}, {1, 1}, 6}), square));
  }
  std::istringstream settings(argv[2]);
  for (std::string setting; settings >> setting;) {
    const auto planned = planned_as(scene, world, figures, setting);
    render(device, planned.scene, world);  // kernels are compiled, tables grown
    const auto result = render(device, planned.scene, world);
    const auto& prediction = planned.prediction;
    nlohmann::ordered_json line{{"scene", scene.file.stem().string()},
                                {"setting", setting},
                                {"pitch_um", planned.scene.sampling.pitch_m * 1e6},
                                {"padding", planned.scene.wrp.padding},
                                {"frames", planned.scene.sampling.frames},
                                {"resolution_um", prediction.resolution_m * 1e6},
                                {"wrps", result.plan.wrps.size()},
                                {"samples", result.samples},
                                {"device_bytes", result.device_peak_bytes},
                                {"predicted_device_bytes", prediction.device_bytes}};
    double mean = 0;
    const auto depths_m = quality_depths_m(planned.plan);
    for (std::size_t d = 0; d < depths_m.size(); ++d) {
      ReconstructSpec spec;
      spec.z_m = depths_m[d];
      spec.window_m = window_m;
      const auto shown = averaged(reconstruct(device, cl::FftBackend::host, result.field, scene.hologram, spec), square);
      const auto blur = blur_of_resolution * prediction.resolution_m / pixel_m;
      const auto figures_of_row = compare_pictures(seen[d], shown, {blur, QualitySpec{}.border_px / square, {}});
      line["psnr_db"].push_back(figures_of_row.psnr_db);
      line["ssim"].push_back(figures_of_row.ssim);
      mean += figures_of_row.psnr_db / static_cast<double>(depths_m.size());
    }
    line["mean_psnr_db"] = mean;
    line["predicted_psnr_db"] = prediction.pictures->psnr_db;
    line["predicted_mean_psnr_db"] = prediction.pictures->mean_psnr_db;
    line["padding_error"] = planned.plan.padding_error;
    const auto& t = prediction.times;
    line["predicted_s"] = {{"samples", t.samples_s}, {"trace", t.trace_s}, {"propagate", t.propagate_s}, {"encode", t.encode_s}};
    double total = 0;
    for (const char* stage : {"samples", "trace", "propagate", "encode"}) {
      const double seconds = result.processor_seconds.at(stage) / std::max(1u, device.info().compute_units);
      line["processor_s"][stage] = seconds;
      total += seconds;
    }
    line["total_s"] = total;
    line["predicted_total_s"] = t.total_s();
    std::printf("%s\n", line.dump().c_str());
    std::fflush(stdout);
  }
}

}  // namespace
}  // namespace raywave

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: bench_planning SCENE.toml \"draft balanced 100:1.25:2 ...\" [SECTION.KEY=VALUE ...]\n");
    return 2;
  }
  raywave::run(argc, argv);
}
