// SPDX-License-Identifier: Apache-2.0
// Fields and pictures: propagation, encoding, what a hologram shows and how well.
#include "convert.hpp"

namespace raywave_python {
namespace {

raywave::ViewOptions view_options(double z, std::optional<raywave::Vec2> window, raywave::Vec2 view,
                                  raywave::Vec2 aperture, std::optional<std::string> pupil,
                                  const std::string& device, const std::string& fft) {
  raywave::ViewOptions options;
  options.z_m = z;
  options.window_m = window;
  options.view = view;
  options.aperture = aperture;
  options.pupil = std::move(pupil);
  options.on = device_options(device, fft);
  return options;
}

Array propagate(nb::handle u, raywave::Pixels pixels, double distance, raywave::Vec2 shift,
                double padding, std::optional<raywave::Vec2> out_pitch,
                std::optional<std::array<int, 2>> out_size, const std::string& device,
                const std::string& fft) {
  const auto array = plane_of(u, "u");
  raywave::PropagateOptions options;
  options.shift_m = shift;
  options.padding = padding;
  options.out_pitch_m = out_pitch;
  options.out_size = out_size;
  options.on = device_options(device, fft);
  const int nx = static_cast<int>(array.shape(1)), ny = static_cast<int>(array.shape(0));
  if (is_of<ComplexDouble>(array)) {
    const raywave::FieldDoubleView view{nx, ny, 1, static_cast<const ComplexDouble*>(array.data())};
    raywave::FieldDouble result;
    {
      const nb::gil_scoped_release release;
      result = raywave::propagate(view, pixels, distance, options);
    }
    return field_array(std::move(result));
  }
  if (!is_of<Complex>(array))
    refuse("u", "must be complex64 or complex128, got " + dtype_name(array.dtype()));
  raywave::Field result;
  {
    const nb::gil_scoped_release release;
    result = raywave::propagate(field_view(array, "u"), pixels, distance, options);
  }
  return field_array(std::move(result));
}

raywave::Levels levels_of(nb::handle object, const char* name) {
  const auto array = planes_of(object, name);
  const auto n = array.ndim();
  raywave::Levels levels{static_cast<int>(array.shape(n - 1)),
                         static_cast<int>(array.shape(n - 2)),
                         n == 3 ? static_cast<int>(array.shape(0)) : 1,
                         8,
                         {},
                         {}};
  if (is_of<std::uint8_t>(array)) {
    const auto* data = static_cast<const std::uint8_t*>(array.data());
    levels.values.assign(data, data + array.size());
  } else if (is_of<std::uint16_t>(array)) {
    const auto* data = static_cast<const std::uint16_t*>(array.data());
    levels.values16.assign(data, data + array.size());
    levels.bits = 16;
  } else {
    refuse(name, "must be uint8, or uint16 where levels have more than 8 bits, got " +
                     dtype_name(array.dtype()));
  }
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
        auto options = view_options(z, window, view, aperture, std::move(pupil), device, fft);
        options.centre_m = centre;
        options.progress = progress_of(progress);
        const auto seen_from = field_view(array, "field");
        raywave::Picture picture;
        {
          const nb::gil_scoped_release release;
          picture = raywave::reconstruct(seen_from, pixels, options);
        }
        return picture_array(std::move(picture));
      },
      "field"_a.none(), "pixels"_a, "z"_a, "window"_a.none(), "view"_a, "aperture"_a,
      "pupil"_a.none(), "device"_a, "fft"_a, "progress"_a.none(), "centre"_a);
  m.def(
      "reconstruct_hologram",
      [](const raywave::Hologram& hologram, double z, std::optional<raywave::Vec2> window,
         raywave::Vec2 view, raywave::Vec2 aperture, std::optional<std::string> pupil,
         const std::string& device, const std::string& fft, const nb::object& progress,
         raywave::Vec2 centre) {
        auto options = view_options(z, window, view, aperture, std::move(pupil), device, fft);
        options.centre_m = centre;
        options.progress = progress_of(progress);
        raywave::Picture picture;
        {
          const nb::gil_scoped_release release;
          picture = raywave::reconstruct(hologram, options);
        }
        return picture_array(std::move(picture));
      },
      "hologram"_a, "z"_a, "window"_a.none(), "view"_a, "aperture"_a, "pupil"_a.none(), "device"_a,
      "fft"_a, "progress"_a.none(), "centre"_a);
  m.def(
      "lens",
      [](raywave::Scene scene, double z, std::optional<raywave::Vec2> window, raywave::Vec2 view,
         raywave::Vec2 aperture, std::optional<std::string> pupil, int points,
         const std::string& device, const nb::object& progress) {
        auto options = view_options(z, window, view, aperture, std::move(pupil), device, "");
        options.progress = progress_of(progress);
        raywave::Picture picture;
        {
          const nb::gil_scoped_release release;
          picture = raywave::lens(scene, options, points);
        }
        return picture_array(std::move(picture));
      },
      "scene"_a, "z"_a, "window"_a.none(), "view"_a, "aperture"_a, "pupil"_a.none(), "points"_a,
      "device"_a, "progress"_a.none());
  m.def(
      "preview",
      [](raywave::Scene scene, std::optional<double> z, std::optional<raywave::Vec2> window,
         raywave::Vec2 view, const std::string& device) {
        const raywave::PreviewOptions options{z, window, view, device_options(device, "")};
        raywave::Picture picture;
        {
          const nb::gil_scoped_release release;
          picture = raywave::preview(scene, options);
        }
        return picture_array(std::move(picture));
      },
      "scene"_a, "z"_a.none(), "window"_a.none(), "view"_a, "device"_a);
  m.def(
      "encode",
      [](nb::handle field, const raywave::Slm& slm, raywave::Pixels pixels,
         const std::string& device) {
        const auto array = in_single<Complex>(planes_of(field, "field"));
        const auto from = field_view(array, "field");
        raywave::Levels levels;
        {
          const nb::gil_scoped_release release;
          levels = raywave::encode(from, slm, pixels, {device, {}});
        }
        return levels_array(std::move(levels));
      },
      "field"_a.none(), "slm"_a, "pixels"_a, "device"_a);
  m.def(
      "shown",
      [](nb::handle levels, const raywave::Slm& slm, raywave::Pixels pixels) {
        const auto from = levels_of(levels, "levels");
        raywave::Field field;
        {
          const nb::gil_scoped_release release;
          field = raywave::shown(from, slm, pixels);
        }
        return field_array(std::move(field));
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
        raywave::Levels levels;
        {
          const nb::gil_scoped_release release;
          levels = raywave::pattern(shape, resolution, pixels, slm, options);
        }
        return levels_array(std::move(levels));
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
        std::vector<raywave::QualityRow> rows;
        {
          const nb::gil_scoped_release release;
          rows = raywave::quality(hologram, options);
        }
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
        raywave::Trade made;
        {
          const nb::gil_scoped_release release;
          made = raywave::trade(scene, options);
        }
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
