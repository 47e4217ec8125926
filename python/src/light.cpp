// SPDX-License-Identifier: Apache-2.0
// Fields and pictures: propagation, encoding, what a hologram shows and how well.
#include "convert.hpp"

namespace raywave_python {
namespace {

raywave::ViewOptions view_options(double z, std::optional<raywave::Vec2> window, raywave::Vec2 view,
                                  raywave::Vec2 aperture, std::optional<std::string> pupil,
                                  const std::string& device, const std::string& fft,
                                  const nb::object& progress, raywave::Vec2 centre = {0, 0}) {
  return {z,
          window,
          view,
          aperture,
          std::move(pupil),
          centre,
          device_options(device, fft),
          progress_of(progress)};
}

Array propagate(nb::handle u, raywave::Pixels pixels, double distance, raywave::Vec2 shift,
                double padding, std::optional<raywave::Vec2> out_pitch,
                std::optional<std::array<int, 2>> out_size, const std::string& device,
                const std::string& fft) {
  const auto array = plane_of(u, "u");
  const raywave::PropagateOptions options{shift, padding, out_pitch, out_size,
                                          device_options(device, fft)};
  auto result = nb::borrow<Array>(nb::none());
  const auto use = [&]<class Part>(const std::complex<Part>* data) {
    const raywave::BasicFieldView<Part> view{static_cast<int>(array.shape(1)),
                                             static_cast<int>(array.shape(0)), 1, data};
    result = field_array(
        without_gil([&] { return raywave::propagate(view, pixels, distance, options); }));
  };
  with_data<Complex, ComplexDouble>(array, "u", "complex64 or complex128", use);
  return result;
}

raywave::Levels levels_of(nb::handle object, const char* name) {
  const auto array = planes_of(object, name);
  const auto n = array.ndim();
  raywave::Levels levels;
  levels.nx = static_cast<int>(array.shape(n - 1));
  levels.ny = static_cast<int>(array.shape(n - 2));
  levels.frames = n == 3 ? static_cast<int>(array.shape(0)) : 1;
  const auto take = [&]<class Level>(const Level* data) {
    levels.bits = 8 * sizeof(Level);
    if constexpr (sizeof(Level) == 1)
      levels.values.assign(data, data + array.size());
    else
      levels.values16.assign(data, data + array.size());
  };
  with_data<std::uint8_t, std::uint16_t>(
      array, name, "uint8, or uint16 where levels have more than 8 bits", take);
  return levels;
}

/// As the package's PictureComparison takes them.
auto figures_of(const raywave::PictureComparison& c) {
  std::optional<std::tuple<double, double, double, double>> colours;
  if (c.colours)
    colours = {c.colours->mean, c.colours->median, c.colours->most_of_95, c.colours->most};
  return std::tuple(c.psnr_db, c.ssim, c.flip, c.scale, c.contrast_a, c.contrast_b, colours);
}

}  // namespace

void add_light(nb::module_& m) {
  m.def("propagate", &propagate, "u"_a.none(), "pixels"_a, "distance"_a, "shift"_a, "padding"_a,
        "out_pitch"_a.none(), "out_size"_a.none(), "device"_a, "fft"_a);
  m.def(
      "reconstruct",
      [](nb::handle field, raywave::Pixels pixels, double z, std::optional<raywave::Vec2> window,
         raywave::Vec2 view, raywave::Vec2 aperture, std::optional<std::string> pupil,
         const std::string& device, const std::string& fft, const nb::object& progress,
         raywave::Vec2 centre) {
        const auto array = in_single<Complex>(planes_of(field, "field"));
        const auto options = view_options(z, window, view, aperture, std::move(pupil), device, fft,
                                          progress, centre);
        const auto seen_from = field_view(array, "field");
        return picture_array(
            without_gil([&] { return raywave::reconstruct(seen_from, pixels, options); }));
      },
      "field"_a.none(), "pixels"_a, "z"_a, "window"_a.none(), "view"_a, "aperture"_a,
      "pupil"_a.none(), "device"_a, "fft"_a, "progress"_a.none(), "centre"_a);
  m.def(
      "reconstruct_hologram",
      [](const raywave::Hologram& hologram, double z, std::optional<raywave::Vec2> window,
         raywave::Vec2 view, raywave::Vec2 aperture, std::optional<std::string> pupil,
         const std::string& device, const std::string& fft, const nb::object& progress,
         raywave::Vec2 centre) {
        const auto options = view_options(z, window, view, aperture, std::move(pupil), device, fft,
                                          progress, centre);
        return picture_array(without_gil([&] { return raywave::reconstruct(hologram, options); }));
      },
      "hologram"_a, "z"_a, "window"_a.none(), "view"_a, "aperture"_a, "pupil"_a.none(), "device"_a,
      "fft"_a, "progress"_a.none(), "centre"_a);
  m.def(
      "lens",
      [](raywave::Scene scene, double z, std::optional<raywave::Vec2> window, raywave::Vec2 view,
         raywave::Vec2 aperture, std::optional<std::string> pupil, int points,
         const std::string& device, const nb::object& progress) {
        const auto options =
            view_options(z, window, view, aperture, std::move(pupil), device, "", progress);
        return picture_array(without_gil([&] { return raywave::lens(scene, options, points); }));
      },
      "scene"_a, "z"_a, "window"_a.none(), "view"_a, "aperture"_a, "pupil"_a.none(), "points"_a,
      "device"_a, "progress"_a.none());
  m.def(
      "preview",
      [](raywave::Scene scene, std::optional<double> z, std::optional<raywave::Vec2> window,
         raywave::Vec2 view, const std::string& device) {
        const raywave::PreviewOptions options{z, window, view, device_options(device, "")};
        return picture_array(without_gil([&] { return raywave::preview(scene, options); }));
      },
      "scene"_a, "z"_a.none(), "window"_a.none(), "view"_a, "device"_a);
  m.def(
      "encode",
      [](nb::handle field, const raywave::Slm& slm, raywave::Pixels pixels,
         const std::string& device) {
        const auto array = in_single<Complex>(planes_of(field, "field"));
        const auto from = field_view(array, "field");
        return levels_array(without_gil([&] {
          return raywave::encode(from, slm, pixels, {device, {}});
        }));
      },
      "field"_a.none(), "slm"_a, "pixels"_a, "device"_a);
  m.def(
      "shown",
      [](nb::handle levels, const raywave::Slm& slm, raywave::Pixels pixels) {
        const auto from = levels_of(levels, "levels");
        return field_array(without_gil([&] { return raywave::shown(from, slm, pixels); }));
      },
      "levels"_a.none(), "slm"_a, "pixels"_a);
  m.def(
      "compare_fields",
      [](nb::handle a, nb::handle b) {
        const auto first = in_single<Complex>(planes_of(a, "a")),
                   second = in_single<Complex>(planes_of(b, "b"));
        const auto view_a = field_view(first, "a"), view_b = field_view(second, "b");
        const nb::gil_scoped_release release;
        const auto c = raywave::compare(view_a, view_b);
        return std::tuple(c.correlation, c.error, c.error_scaled, c.energy_ratio);
      },
      "a"_a.none(), "b"_a.none());
  m.def(
      "compare_pictures",
      [](nb::handle a, nb::handle b, double blur, int border, const std::string& domain,
         std::optional<std::array<int, 4>> region) {
        const auto first = in_single<float>(picture_of(a, "a")),
                   second = in_single<float>(picture_of(b, "b"));
        const auto view_a = picture_view(first, "a"), view_b = picture_view(second, "b");
        const auto as = raywave::choice_of<raywave::Domain>(domain, "domain");
        const nb::gil_scoped_release release;
        return figures_of(raywave::compare(view_a, view_b, {blur, border, as, region}));
      },
      "a"_a.none(), "b"_a.none(), "blur"_a, "border"_a, "domain"_a, "region"_a.none());
  m.def(
      "pattern",
      [](const std::string& name, std::array<int, 2> resolution, raywave::Pixels pixels,
         const raywave::Slm& slm, double focal, double period, const std::string& to,
         const std::string& device) {
        const auto shape = raywave::choice_of<raywave::Pattern>(name, "pattern");
        const raywave::PatternOptions options{
            focal, period, raywave::choice_of<raywave::Side>(to, "to"), {device, {}}};
        return levels_array(
            without_gil([&] { return raywave::pattern(shape, resolution, pixels, slm, options); }));
      },
      "name"_a, "resolution"_a, "pixels"_a, "slm"_a, "focal"_a, "period"_a, "to"_a, "device"_a);
  m.def(
      "quality",
      [](const raywave::Hologram& hologram, std::vector<double> depths,
         std::optional<raywave::Vec2> window, std::optional<double> blur, bool views,
         std::vector<std::string> pupils, int lens_points, int border, const std::string& device,
         const std::string& fft, const nb::object& progress) {
        const raywave::QualityOptions options{
            std::move(depths),    window,      blur,   views,
            std::move(pupils),    lens_points, border, device_options(device, fft),
            progress_of(progress)};
        auto rows = without_gil([&] { return raywave::quality(hologram, options); });
        using Figures = decltype(figures_of({}));
        std::vector<std::tuple<double, std::string, Figures, Figures, double, std::optional<double>,
                               Array, Array, std::tuple<double, double, double>>>
            list;
        for (auto& row : rows)
          list.emplace_back(row.z_m, raywave::name_of(row.view), figures_of(row.levels),
                            figures_of(row.field), row.light_share, row.haze,
                            picture_array(std::move(row.lens)),
                            picture_array(std::move(row.hologram)),
                            std::tuple(row.pupil_m, row.pupil_place_m[0], row.pupil_place_m[1]));
        return list;
      },
      "hologram"_a, "depths"_a, "window"_a.none(), "blur"_a.none(), "views"_a, "pupils"_a,
      "lens_points"_a, "border"_a, "device"_a, "fft"_a, "progress"_a.none());
  m.def(
      "trade",
      [](raywave::Scene scene, bool quick, bool presets, bool exhaustive, int renders,
         std::vector<double> depths, std::optional<raywave::Vec2> window, bool views,
         int lens_points, int border, std::optional<bool> against_points, const std::string& folder,
         const std::string& device, const std::string& fft, const nb::object& progress) {
        const raywave::TradeOptions options{quick,
                                            presets,
                                            exhaustive,
                                            renders,
                                            std::move(depths),
                                            window,
                                            views,
                                            lens_points,
                                            border,
                                            against_points,
                                            folder,
                                            device_options(device, fft),
                                            progress_of(progress)};
        auto made = without_gil([&] { return raywave::trade(scene, options); });
        auto shape = shape_of(1, made.sheet.ny, made.sheet.nx);
        shape.push_back(static_cast<std::size_t>(made.sheet.channels));
        return std::make_tuple(made.text, made.json, made.csv,
                               as_numpy(std::move(made.sheet.values), shape));
      },
      "scene"_a, "quick"_a, "presets"_a, "exhaustive"_a, "renders"_a, "depths"_a, "window"_a.none(),
      "views"_a, "lens_points"_a, "border"_a, "against_points"_a.none(), "folder"_a, "device"_a,
      "fft"_a, "progress"_a.none());
}

}  // namespace raywave_python
