// SPDX-License-Identifier: Apache-2.0
#include "host/view/lens.hpp"

#include <algorithm>
#include <cfloat>
#include <chrono>
#include <cmath>
#include <glm/common.hpp>
#include <glm/exponential.hpp>
#include <numeric>

#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/plan/lattice.hpp"
#include "host/view/reconstruct.hpp"

namespace raywave {
namespace {

constexpr int most_points = 4096;

/// Duration of a launch: short enough to show progress and to stay below a driver's watchdog.
constexpr double launch_seconds = 0.2;

void check(const LensSpec& what) {
  const auto positive = [](double value) { return std::isfinite(value) && value > 0; };
  constexpr double closest_m = 1e-6;
  if (!std::isfinite(what.z_m) || what.z_m == 0 || (!what.pupil && std::abs(what.z_m) < closest_m))
    throw InputError(
        "z: must not be 0, where a lens in the hologram's plane cannot focus: > 0 is beyond the "
        "hologram, < 0 on the eye's side");
  if (!std::isfinite(what.view.x) || !std::isfinite(what.view.y))
    throw InputError("view: must be two finite numbers");
  if (!positive(what.aperture.x) || !positive(what.aperture.y))
    throw InputError("aperture: must be > 0");
  if (what.pixel_m && !(positive(what.pixel_m->x) && positive(what.pixel_m->y)))
    throw InputError("lens: pixels must be > 0");
  if (const auto& pupil = what.pupil; pupil && !(1 + pupil->a * what.z_m / pupil->b_m > 1e-6))
    throw InputError("z: " + length_text(what.z_m) +
                     " is where the eye's pupil is, or behind it; look at a plane before it");
  if (what.points < 1 || what.points > most_points)
    throw InputError("points: must be 1 to " + std::to_string(most_points) + ", got " +
                     std::to_string(what.points));
}

/// Near the golden section of n, without a common divisor: multiples of it, modulo n, meet every
/// number once and lie far from their neighbours.
int scatter_of(int n) {
  int scatter = std::max(1, static_cast<int>(std::lround(0.618 * n)));
  while (std::gcd(scatter, n) != 1) ++scatter;
  return scatter;
}

/// Puts the points of the lens where rays to a pupil pass the hologram, which is open from low_m to
/// high_m.
void look_through(const Pupil& pupil, const Plan& plan, const LensSpec& what, glm::dvec2 low_m,
                  glm::dvec2 high_m, device::LensPlane& lens) {
  const glm::dvec2 origin_m(plan.extent.origin_m);
  const double moved = pupil.through_m(0, what.z_m, 1), follow = pupil.through_m(1, what.z_m, 0);
  const bool is_round = !(what.pupil_part_m.x > 0);
  const auto size_m = is_round ? glm::dvec2(pupil.diameter_m) : what.pupil_part_m;
  const auto step_m = size_m / static_cast<double>(what.points), first_m = (size_m - step_m) / 2.0;
  const auto origin_here_m = (follow - 1) * origin_m;
  lens.follow = static_cast<float>(follow);
  lens.lens_left = static_cast<float>(moved * (pupil.centre_m.x - first_m.x) + origin_here_m.x);
  lens.lens_top = static_cast<float>(moved * (pupil.centre_m.y + first_m.y) + origin_here_m.y);
  lens.lens_pitch_x = static_cast<float>(moved * step_m.x);
  lens.lens_pitch_y = static_cast<float>(moved * step_m.y);
  lens.reach_x = lens.reach_y = 0;
  lens.is_round = is_round;
  int rays = 0;
  for (int j = 0; j < what.points; ++j)
    for (int i = 0; i < what.points; ++i) {
      const int x = 2 * i + 1 - what.points, y = 2 * j + 1 - what.points;
      if (!is_round || x * x + y * y <= what.points * what.points) ++rays;
    }
  lens.rays = static_cast<float>(rays);
  lens.window_left = static_cast<float>(low_m.x - origin_m.x);
  lens.window_right = static_cast<float>(high_m.x - origin_m.x);
  lens.window_bottom = static_cast<float>(low_m.y - origin_m.y);
  lens.window_top = static_cast<float>(high_m.y - origin_m.y);
  const auto tangent = tangents_of_sines(plan.hologram.largest_sine);
  lens.steepest_x = static_cast<float>(tangent.x);
  lens.steepest_y = static_cast<float>(tangent.y);
}

device::LensPlane lens_plane(const Plan& plan, const DeviceScene& scene, const LensSpec& what,
                             glm::ivec2 size, glm::dvec2 pixel_m) {
  // The part of the hologram that is open, in half holograms.
  const glm::dvec2 low = glm::max(what.view - what.aperture, -1.0),
                   high = glm::min(what.view + what.aperture, 1.0);
  if (!(low.x < high.x && low.y < high.y))
    throw InputError("lens: view and aperture leave no part of the hologram open");
  const glm::dvec2 half_m = glm::dvec2(plan.hologram.size) * plan.hologram.pitch_m / 2.0;
  const glm::dvec2 step_m = (high - low) * half_m / static_cast<double>(what.points);
  const glm::dvec2 origin_m(plan.extent.origin_m);
  // Rays start just before the scene, on the eye's side: from the hologram, rounding would grow
  // with its distance.
  const double before_m = plan.extent.near_m - 0x1p-10 * static_cast<double>(scene.diameter_m),
               start_m = plan.extent.near_m > 0 ? std::max(0.0, before_m) : before_m;

  device::LensPlane lens{};
  lens.nx = size.x;
  lens.ny = size.y;
  lens.left = static_cast<float>(-(size.x - 1) / 2.0 * pixel_m.x - origin_m.x);
  lens.top = static_cast<float>((size.y - 1) / 2.0 * pixel_m.y - origin_m.y);
  lens.pitch_x = static_cast<float>(pixel_m.x);
  lens.pitch_y = static_cast<float>(pixel_m.y);
  lens.inverse_focus = static_cast<float>(1 / what.z_m);
  lens.points = what.points;
  lens.lens_left = static_cast<float>(low.x * half_m.x + step_m.x / 2 - origin_m.x);
  lens.lens_top = static_cast<float>(high.y * half_m.y - step_m.y / 2 - origin_m.y);
  lens.lens_pitch_x = static_cast<float>(step_m.x);
  lens.lens_pitch_y = static_cast<float>(step_m.y);
  // Near the hologram, most of such a lens would see light that is too steep for the pixels
  if (is_near_hologram(plan)) {
    const auto reach_m =
        std::abs(what.z_m) * plan.hologram.largest_sine /
        glm::sqrt(glm::max(glm::dvec2(0.01),
                           1.0 - plan.hologram.largest_sine * plan.hologram.largest_sine));
    lens.reach_x = static_cast<float>(reach_m.x);
    lens.reach_y = static_cast<float>(reach_m.y);
  }
  lens.start = static_cast<float>(start_m);
  lens.start_z = static_cast<float>(start_m - plan.extent.origin_m.z);
  lens.bias = scene.bias_m;
  lens.reach = 4 * (scene.diameter_m + static_cast<float>(plan.extent.farthest_m()));
  lens.spread_x = what.area ? lens.pitch_x : 0;
  lens.spread_y = what.area ? lens.pitch_y : 0;
  lens.scatter = scatter_of(what.points);
  lens.rays = static_cast<float>(what.points * what.points);
  lens.window_right = lens.window_top = lens.steepest_x = lens.steepest_y = FLT_MAX;
  lens.window_left = lens.window_bottom = -FLT_MAX;
  if (what.pupil) look_through(*what.pupil, plan, what, low * half_m, high * half_m, lens);
  return lens;
}

cl::Kernel lens_kernel(const cl::Device& device, const cl::Options& options) {
  return cl::Program(device, "kernels/view/lens.cl", options).kernel("see");
}

}  // namespace

void load_lens(const cl::Device& device, const Plan& plan) {
  lens_kernel(device, kernel_options(plan, device.info()));
}

Image lens_picture(const cl::Device& device, const Plan& plan, const DeviceScene& scene,
                   const LensSpec& what, const std::function<void(double)>& progress) {
  check(what);
  const auto pixel_m = what.pixel_m.value_or(plan.hologram.pitch_m);
  const auto size =
      picture_size(what.window_m.value_or(plan.window_m()), plan.hologram.size, pixel_m);
  const auto lens = lens_plane(plan, scene, what, size, pixel_m);
  cl::Buffer<float> picture(device, area_of(size), "picture");
  auto see = lens_kernel(device, scene.options);

  const int lanes = lanes_for(device.info());
  const std::int64_t packets = static_cast<std::int64_t>((size.x + lanes - 1) / lanes) * size.y;
  const std::size_t local = lanes == 1 ? 64 : 1;
  std::int64_t count = 1024 / lanes;
  for (std::int64_t done = 0; done < packets;) {
    count = std::min(count, packets - done);
    const auto start = std::chrono::steady_clock::now();
    see.run({static_cast<std::size_t>(count)}, {local}, scene.arguments(), lens,
            static_cast<std::int32_t>(done), static_cast<std::int32_t>(count), picture);
    device.finish();
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    done += count;
    const double growth = std::clamp(launch_seconds / std::max(seconds, 1e-6), 1.0 / 16, 4.0);
    count = std::max<std::int64_t>(1, std::llround(static_cast<double>(count) * growth));
    if (progress) progress(static_cast<double>(done) / static_cast<double>(packets));
  }
  Image image{size.x, size.y, picture.read()};
  for (float& radiance : image.pixels) {
    radiance = static_cast<float>(radiance * scene.radiance_unit);
    if (!std::isfinite(radiance))
      throw InputError(
          "lens: the picture is brighter than a float holds; give a smaller light.intensity");
  }
  return image;
}

}  // namespace raywave
