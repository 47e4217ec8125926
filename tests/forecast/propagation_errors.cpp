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
            Catch::Approx(
                predicted_padding_errors(plan, {std::get<SpectrumWrps>(plan.carrier).padded})[0])
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

}  // namespace raywave
