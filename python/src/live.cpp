// SPDX-License-Identifier: Apache-2.0
#include "convert.hpp"

namespace raywave_python {

void add_live(nb::module_& m) {
  using Lights = std::vector<std::tuple<std::size_t, std::vector<std::string>>>;
  using Poses = std::vector<std::tuple<raywave::Vec3, raywave::Vec3>>;
  m.def(
      "turned",
      [](const raywave::Vec3& rotation, const raywave::Vec3& by) {
        raywave::Viewing::Pose pose{.rotation_deg = rotation};
        pose.turn(by);
        return pose.rotation_deg;
      },
      "rotation"_a, "by"_a);

  nb::class_<raywave::LiveView>(m, "LiveView")
      .def(
          "__init__",
          [](raywave::LiveView* self, raywave::Scene scene, const raywave::Goal& goal,
             const std::string& device, const std::string& fft, int longest) {
            const nb::gil_scoped_release release;
            new (self) raywave::LiveView(scene, {device_options(device, fft), goal, longest});
          },
          "scene"_a, "goal"_a, "device"_a, "fft"_a, "longest"_a)
      .def("start",
           [](const raywave::LiveView& live) {
             const auto start = live.start();
             Poses poses;
             for (const auto& pose : start.poses)
               poses.emplace_back(pose.position_m, pose.rotation_deg);
             return std::tuple(start.focus_m, poses);
           })
      .def_prop_ro("window", &raywave::LiveView::window_m)
      .def("depth", &raywave::LiveView::depth_m, nb::call_guard<nb::gil_scoped_release>())
      .def("notes", &raywave::LiveView::notes, nb::call_guard<nb::gil_scoped_release>())
      .def(
          "look",
          [](raywave::LiveView& live, const Poses& poses, const Lights& lights, double focus,
             raywave::Vec2 view, double aperture, std::optional<double> pupil, bool levels,
             bool lens, double stops, const std::string& preset, bool refined) {
            raywave::Viewing viewing{.focus_m = focus,
                                     .view = view,
                                     .aperture = aperture,
                                     .pupil_m = pupil,
                                     .has_levels = levels,
                                     .has_lens = lens,
                                     .stops = stops,
                                     .preset = optional_choice<raywave::Preset>(preset, "preset"),
                                     .is_refined = refined};
            for (const auto& [position, rotation] : poses)
              viewing.poses.push_back({position, rotation});
            for (const auto& [light, values] : lights) viewing.lights[light] = values;
            auto picture = without_gil([&] { return live.look(viewing); });
            auto shape = shape_of(1, picture.ny, picture.nx);
            shape.push_back(3);
            return std::tuple(as_numpy(std::move(picture.rgb), shape), picture.hologram_s,
                              picture.picture_s, picture.note);
          },
          "poses"_a, "lights"_a, "focus"_a, "view"_a, "aperture"_a, "pupil"_a.none(), "levels"_a,
          "lens"_a, "stops"_a, "preset"_a, "refined"_a);
}

}  // namespace raywave_python
