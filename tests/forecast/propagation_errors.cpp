// SPDX-License-Identifier: Apache-2.0
#include "host/carriers/planning/facts.hpp"
#include "host/carriers/wrps/planning/padding_errors.hpp"
#include "host/plan/padded_plane.hpp"
#include "host/propagate/propagator.hpp"
#include "host/reference/propagation.hpp"
#include "host/render.hpp"
#include "tests/support/devices.hpp"
#include "tests/support/scenes.hpp"

namespace raywave {
namespace {

using namespace test;

/// The field at the hologram from the WRPs, with the padding given.
std::vector<std::complex<float>> at_hologram(const cl::Device& device, const RenderResult& result,
                                             double padding) {
  const auto& plan = result.plan;
  Propagator propagator(
      device, {plan.hologram.size, plan.hologram.pitch_m, plan.hologram.wavelength_m, padding});
  cl::ComplexBuffer field(device, result.field.samples.size(), "field");
  for (std::size_t i = 0; i < plan.wrps.size(); ++i) {
    const auto& centre = plan.wrps[i].centre_m;
    field.write(result.wrps[i].samples);
    propagator.load(field);
    propagator.add({{-centre.x, -centre.y}, centre.z});
  }
  propagator.collect(field);
  return field.read();
}

}  // namespace

TEST_CASE("the error of every padding is predicted within a factor of 1.6") {
  struct Case {
    const char* name;
    std::vector<std::string> set;
  };
  const std::vector<Case> cases{
      {"1 mm before the sphere", {}},
      {"3 mm, apodized cone",
       {"wrp.distance=15.55 mm", "sampling.cone=1.1", "sampling.apodization=0.2"}},
      {"1 mm, cone without apodization", {"sampling.cone=1", "sampling.apodization=0"}},
      {"narrow hologram, 2 x 2 WRPs", {"hologram.resolution=[240, 192]", "wrp.grid=[2, 2]"}},
      {"two layers", {"wrp.distance=['18.3 mm', '19.2 mm']"}},
  };
  const auto found = all_devices();
  for (const auto& c : cases) {
    auto set = c.set;
    set.insert(set.end(), {"sampling.frames=1", "wrp.propagation=spectrum"});
    const auto scene = load_scene(RAYWAVE_DATA_DIR "/study.toml", set);
    const auto world = build_world(scene);
    for (const auto& device : found) {
      const auto result = render(device, scene, RenderOptions{.keep_wrps = true});
      const auto& plan = result.plan;
      INFO(c.name);
      // FFTW may have learnt another way to transform since.
      CHECK(propagation_error_of(plan) ==
            Catch::Approx(predicted_wave_error(plan, std::get<SpectrumWrps>(plan.carrier).padded))
                .epsilon(1e-4));
      const auto exact = reference::to_double(at_hologram(device, result, 6));
      for (const double padding : {1.0, 1.125, 1.25, 1.5, 2.0}) {
        const double measured = reference::relative_error(
            reference::to_double(at_hologram(device, result, padding)), exact);
        const double predicted =
            predicted_padding_errors(plan, {padded_size(plan.hologram.size, padding)})[0];
        CAPTURE(device.info().name, c.name, padding, measured, predicted);
        CHECK(predicted <= std::max(1.5 * measured, 0.003));
        CHECK(predicted >= measured / 1.6);
      }
    }
  }
}

DEVICE_TEST("the error that is stated over WRPs holds against all points within a factor of 1.6") {
  struct Case {
    const char* name;
    std::vector<std::string> set;
  };
  const auto at = [](const char* z, const char* width) {
    return std::vector<std::string>{std::string("object.0.position=['0 mm', '0 mm', '") + z + "']",
                                    std::string("object.0.width=") + width,
                                    "object.0.rotation=[0, 0, 0]"};
  };
  const std::vector<std::pair<Case, std::vector<std::string>>> cases{
      {{"100 mm", at("100 mm", "3 mm")}, {"sampling.pitch=100 um"}},
      {{"300 mm", at("300 mm", "9 mm")}, {"sampling.pitch=300 um"}},
      {{"1 m", at("1000 mm", "30 mm")}, {"sampling.pitch=1 mm"}},
      {{"12 mm at 1 um", at("12 mm", "1.2 mm")}, {"sampling.pitch=40 um", "hologram.pitch=1 um"}},
      {{"100 mm in tiles", at("100 mm", "3 mm")},
       {"sampling.pitch=100 um", "hologram.tiles=[2, 2]"}},
      {{"a wide cone", at("100 mm", "3 mm")},
       {"sampling.pitch=100 um", "sampling.cone=2", "sampling.apodization=0.8", "wrp.padding=3"}},
      {{"a padding too small for it", at("100 mm", "3 mm")},
       {"sampling.pitch=100 um", "sampling.cone=1.6", "sampling.apodization=0.4",
        "wrp.padding=1.5"}},
  };
  for (const auto& [c, more] : cases) {
    auto set = c.set;
    set.insert(set.end(), more.begin(), more.end());
    set.insert(set.end(), {"hologram.resolution=[480, 270]", "sampling.frames=1",
                           "wrp.propagation=spectrum", "wrp.grid=auto"});
    const auto scene = load_scene(RAYWAVE_DATA_DIR "/teapot.toml", set);
    const auto points = render(device, scene, RenderOptions{.method = Method::points});
    const auto wrps = render(device, scene, RenderOptions{});
    const double measured = reference::relative_error(reference::to_double(wrps.field.samples),
                                                      reference::to_double(points.field.samples));
    const double stated = std::hypot(propagation_error_of(wrps.plan), cone_error_of(wrps.plan));
    CAPTURE(device.info().name, c.name, measured, stated);
    CHECK(stated >= measured / 1.6);
    CHECK(stated <= 1.6 * measured);
  }
}

}  // namespace raywave
