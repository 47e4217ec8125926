// SPDX-License-Identifier: Apache-2.0
#include "host/forecast/eye.hpp"

#include "tests/forecast/data_scenes.hpp"
#include "tests/support/catch.hpp"

namespace raywave {
namespace {

using namespace test;
using Catch::Approx;

EyeView eye_of(const Scene& scene) {
  const auto world = build_world(scene);
  const auto plan = make_plan(scene, world);
  return eye_view(scene, plan, front_view(scene, world, plan));
}

TEST_CASE("eyebox, its lit part, acuity and depth of field of a pupil are their closed forms") {
  for (const double pupil_mm : {2.0, 3.0, 6.0}) {
    const auto eye =
        eye_of(data_scene("near_eye.toml", {"viewer.pupil=" + std::to_string(pupil_mm * mm)}));
    const double lambda = 520e-9, pupil_m = pupil_mm * mm, arc_minute = 2.908882e-4;
    CHECK(eye.eyebox_m.x == Approx(lambda * 50e-3 / 3.74e-6).epsilon(1e-6));  // 6.95 mm
    // What pupils 0.6 mm aside reach, and no more of the band than the encoding keeps apart
    CHECK(eye.lit_m.x == Approx(std::min(2 * 0.6 * mm + pupil_m, 0.48 * eye.eyebox_m.x)));
    CHECK(eye.lit_m.y == Approx(std::min(pupil_m, 0.48 * eye.eyebox_m.y)));
    CHECK(eye.acuity == Approx(std::max(arc_minute, 1.22 * lambda / pupil_m)).epsilon(1e-4));
    CHECK(eye.sharp_by_acuity == Approx(eye.acuity / pupil_m).epsilon(1e-6));
    CHECK(eye.sharp_by_wave == Approx(2 * lambda / (pupil_m * pupil_m)).epsilon(1e-6));
    // Seen as from the eyepiece, 50 mm before the hologram, at the scene's middle
    CHECK(eye.detail_m == Approx(eye.acuity * (50e-3 - 3.916e-3)).epsilon(1e-3));
  }
}

TEST_CASE("a pupil that is half beyond the eyebox is half filled, and one beyond it sees nothing") {
  // 1.2 mm across, around places of an eyebox of 6.952 mm
  const auto eye = eye_of(data_scene(
      "near_eye.toml",
      {"viewer.pupil=1.2 mm",
       "viewer.pupil_position=[[0, 0], ['3.476 mm', 0], [0, '-3.476 mm'], ['4.1 mm', 0]]",
       "object.1.width=1 mm", "object.0.width=1 mm", "slm.encoding=phase"}));
  REQUIRE(eye.places.size() == 4);
  CHECK(eye.places[0].light == Approx(1));
  CHECK(eye.places[1].light == Approx(0.5).margin(0.02));
  CHECK(eye.places[2].light == Approx(0.5).margin(0.02));
  CHECK(eye.places[3].light == 0);
  CHECK(eye.places[3].cut == Approx(1));
  CHECK(eye.places[0].cut == 0);
}

TEST_CASE("near-eye scenes are judged by the pupil: no steep light, no replicas, and infinity") {
  const auto world = build_world(data_scene("near_eye.toml"));
  const auto p = planned(data_scene("near_eye.toml"));
  CHECK_FALSE(warns(p, "steeper than the pixels"));
  CHECK_FALSE(warns(p, "replicas"));
  CHECK_FALSE(warns(p, "beyond infinity"));
  CHECK(p.prediction.eye);
  const auto far = planned(data_scene("near_eye.toml", {"object.1.position=[0, 0, '-0.5 D']"}));
  CHECK(warns(far, "beyond infinity: no eye sees this sharp"));
  const auto wide = planned(data_scene("near_eye.toml", {"viewer.pupil=6 mm"}));
  CHECK(warns(wide, "replicas"));
  // The corners of the eyebox lie on a circle of 9.832 mm
  CHECK_FALSE(warns(
      planned(data_scene("near_eye.toml", {"viewer.pupil=9.7 mm", "viewer.pupil_position=[0, 0]"})),
      "evenly bright"));
  CHECK(warns(
      planned(data_scene("near_eye.toml", {"viewer.pupil=9.9 mm", "viewer.pupil_position=[0, 0]"})),
      "evenly bright"));
  CHECK_FALSE(warns(
      planned(data_scene("near_eye.toml",
                         {"viewer.pupil=9.9 mm", "viewer.pupil_position=[0, 0]", "slm.stop=0.5"})),
      "evenly bright"));
  // 0.46 of the eyebox
  CHECK_FALSE(warns(p, "as haze"));
  const auto hazy = planned(data_scene("near_eye.toml", {"viewer.pupil=6.4 mm"}));
  CHECK(warns(hazy, "as haze over the picture"));
  CHECK(warns(hazy, "slm.stop = 0.5"));
  CHECK_FALSE(warns(planned(data_scene("near_eye.toml", {"viewer.pupil=6.4 mm", "slm.stop=0.5"})),
                    "as haze"));
  CHECK_FALSE(warns(p, "nearer than eyes focus"));
  CHECK(warns(planned(data_scene("near_eye.toml", {"object.0.position=[0, 0, '12 D']"})),
              "nearer than eyes focus"));
  const auto dots = planned(data_scene("near_eye.toml", {"sampling.pitch=60 um"}));
  CHECK(warns(dots, "shows single dots"));
  CHECK_FALSE(planned(data_scene("teapot.toml")).prediction.eye);
}

}  // namespace
}  // namespace raywave
