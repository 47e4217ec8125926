// SPDX-License-Identifier: Apache-2.0
// The module raywave._core: the installed headers for Python. The package around it (raywave/) has
// the names, defaults and texts that users see.
#include "convert.hpp"

namespace raywave_python {
namespace {

/// Rows of two or three numbers as doubles, from float32 or float64.
template <std::size_t n>
std::vector<std::array<double, n>> vectors_of(nb::handle object, const char* name) {
  std::vector<std::array<double, n>> vectors;
  if (object.is_none()) return vectors;
  const auto shape = "(n, " + std::to_string(n) + ")";
  const auto array = array_of(object, name, 2, 2, shape.c_str());
  if (array.shape(1) != n)
    refuse(name, "must have the shape " + shape + ", got " + shape_text(array));
  vectors.resize(array.shape(0));
  const auto fill = [&](const auto* data) {
    for (std::size_t i = 0; i < vectors.size(); ++i)
      for (std::size_t k = 0; k < n; ++k) vectors[i][k] = static_cast<double>(data[n * i + k]);
  };
  with_data<float, double>(array, name, "float32 or float64", fill);
  return vectors;
}

std::vector<std::array<std::uint32_t, 3>> faces_of(nb::handle object, const char* name) {
  const auto array = array_of(object, name, 2, 2, "(n, 3)");
  if (array.shape(1) != 3) refuse(name, "must have the shape (n, 3), got " + shape_text(array));
  std::vector<std::array<std::uint32_t, 3>> faces(array.shape(0));
  const auto fill = [&](const auto* data) {
    for (std::size_t i = 0; i < 3 * faces.size(); ++i) {
      const auto corner = static_cast<std::int64_t>(data[i]);
      if (corner < 0 || corner > INT32_MAX)
        refuse(name, "face " + std::to_string(i / 3) + " names vertex " + std::to_string(corner));
      faces[i / 3][i % 3] = static_cast<std::uint32_t>(corner);
    }
  };
  with_data<std::int32_t, std::uint32_t, std::int64_t, std::uint64_t>(
      array, name, "integers of 32 or 64 bits", fill);
  return faces;
}

/// A mesh's arrays, copied.
struct MeshArrays {
  MeshArrays(nb::handle vertices, nb::handle faces, nb::handle uv, nb::handle normals,
             nb::handle colours, nb::bytes texture, nb::handle radii) {
    if (vertices.is_none()) refuse("vertices", "must be an array of the shape (n, 3), got None");
    if (faces.is_none() && radii.is_none())
      refuse("faces", "must be an array of the shape (n, 3), got None");
    points = vectors_of<3>(vertices, "vertices");
    if (!faces.is_none()) corners = faces_of(faces, "faces");
    for (const auto& [radius] : vectors_of<1>(radii, "radii")) sizes.push_back(radius);
    uvs = vectors_of<2>(uv, "uv");
    directions = vectors_of<3>(normals, "normals");
    for (const auto& c : vectors_of<4>(colours, "colours"))
      shades.push_back({static_cast<float>(c[0]), static_cast<float>(c[1]),
                        static_cast<float>(c[2]), static_cast<float>(c[3])});
    const auto* bytes = static_cast<const std::uint8_t*>(texture.data());
    picture.assign(bytes, bytes + texture.size());
  }
  raywave::MeshView view() const {
    return {points, corners, uvs, directions, shades, picture, sizes};
  }

  std::vector<raywave::Vec3> points, directions;
  std::vector<std::array<std::uint32_t, 3>> corners;
  std::vector<raywave::Vec2> uvs;
  std::vector<std::array<float, 4>> shades;
  std::vector<std::uint8_t> picture;
  std::vector<double> sizes;
};

/// The callback of the call at work: it runs on the thread that calls.
raywave::Progress** current() {
  thread_local raywave::Progress* progress = nullptr;
  return &progress;
}

/// Makes a callback the current one of this thread.
struct Called {
  explicit Called(const nb::object& callback)
      : progress(progress_of(callback)), before(std::exchange(*current(), &progress)) {}
  ~Called() { *current() = before; }
  raywave::Progress progress;
  raywave::Progress* before;
};

/// A renderer or an animation whose callback is the current one.
template <class Made>
Made make_calling(raywave::Scene scene, raywave::RenderOptions options,
                  const nb::object& progress) {
  options.progress = [](const std::string& what, double share) {
    return !*current() || (**current())(what, share);
  };
  const Called called(progress);
  const nb::gil_scoped_release release;
  return Made(scene, options);
}

struct Animation : raywave::Animation {
  Animation(const raywave::Scene& scene, const raywave::RenderOptions& options,
            const nb::object& progress)
      : raywave::Animation(make_calling<raywave::Animation>(scene, options, progress)) {}

  auto render(int number, const nb::object& progress) {
    const Called called(progress);
    auto picture = without_gil([&] { return raywave::Animation::render(number); });
    auto& levels = picture.levels;
    const auto lasers = static_cast<int>(wavelengths_m().size());
    const auto shape = shape_of(lasers, picture.holograms, levels.ny, levels.nx);
    return std::make_tuple(picture.time_s, as_numpy(std::move(levels.values), shape),
                           picture.powers, picture.notes);
  }
};

struct Renderer : raywave::Renderer {
  Renderer(const raywave::Scene& scene, const raywave::RenderOptions& options,
           const nb::object& progress)
      : raywave::Renderer(make_calling<raywave::Renderer>(scene, options, progress)) {}

  raywave::Hologram render(const nb::object& progress) {
    const Called called(progress);
    const nb::gil_scoped_release release;
    return raywave::Renderer::render();
  }

  std::vector<double> render_into(nb::handle out, nb::handle field, const nb::object& progress) {
    nb::ndarray<> levels_array, field_array;
    raywave::RenderTarget target;
    const auto lasers = static_cast<int>(wavelengths_m().size());
    const auto shape = shape_of(lasers, frames(), ny(), nx());
    if (!out.is_none()) target.levels = out_data<std::uint8_t>(out, "out", shape, levels_array);
    if (!field.is_none()) target.field = out_data<Complex>(field, "field", shape, field_array);
    const Called called(progress);
    const nb::gil_scoped_release release;
    return raywave::Renderer::render(target);
  }
};

/// Of calls while which other threads of Python's may run.
constexpr nb::call_guard<nb::gil_scoped_release> released;

/// All frames of a hologram, on its memory; None where there are none.
Array hologram_view(const raywave::Hologram& hologram, const auto* data) {
  if (!data) return nb::borrow<Array>(nb::none());
  return numpy_view(
      data, shape_of(hologram.lasers(), hologram.frames(), hologram.ny(), hologram.nx()), hologram);
}

}  // namespace

NB_MODULE(_core, m) {
  nb::exception<InputError>(m, "InputError", PyExc_ValueError);
  nb::exception<raywave::DeviceError>(m, "DeviceError", PyExc_RuntimeError);
  nb::exception<raywave::Cancelled>(m, "Cancelled", PyExc_Exception);
  m.attr("version") = RAYWAVE_VERSION;

  nb::class_<raywave::Pixels>(m, "Pixels")
      .def(nb::init<raywave::Vec2, double>(), "pitch_m"_a, "wavelength_m"_a)
      .def_ro("pitch_m", &raywave::Pixels::pitch_m)
      .def_ro("wavelength_m", &raywave::Pixels::wavelength_m);

  nb::class_<raywave::Device>(m, "Device", "An OpenCL device.")
      .def_ro("index", &raywave::Device::index)
      .def_ro("platform", &raywave::Device::platform)
      .def_ro("name", &raywave::Device::name)
      .def_ro("driver", &raywave::Device::driver)
      .def_prop_ro("kind", [](const raywave::Device& d) { return raywave::name_of(d.kind); })
      .def_ro("memory_bytes", &raywave::Device::memory_bytes)
      .def_ro("has_doubles", &raywave::Device::has_doubles)
      .def("__repr__", [](const raywave::Device& d) {
        return "<raywave.Device " + d.index + " " + d.name + " (" + raywave::name_of(d.kind) + ")>";
      });
  m.def("devices", &raywave::list_devices);

  nb::class_<MeshArrays>(m, "MeshArrays")
      .def(nb::init<nb::handle, nb::handle, nb::handle, nb::handle, nb::handle, nb::bytes,
                    nb::handle>(),
           "vertices"_a.none(), "faces"_a.none(), "uv"_a.none(), "normals"_a.none(),
           "colours"_a.none(), "texture"_a, "radii"_a.none() = nb::none());

  nb::class_<raywave::Scene>(m, "Scene")
      .def_prop_ro("resolution", &raywave::Scene::resolution)
      .def_prop_ro("pixels", &raywave::Scene::pixels)
      .def_prop_ro("wavelengths", &raywave::Scene::wavelengths_m)
      .def_prop_ro("frames", &raywave::Scene::frames)
      .def_prop_ro("objects", &raywave::Scene::objects)
      .def_prop_ro("notes", &raywave::Scene::notes)
      .def_prop_ro("is_planned", &raywave::Scene::is_planned)
      .def("source",
           [](const raywave::Scene& scene) {
             return std::tuple(scene.toml(), scene.folder().string(), scene.overrides(),
                               scene.name());
           })
      .def("json", &raywave::Scene::json)
      .def("set", &raywave::Scene::set, "overrides"_a)
      .def(
          "set_mesh",
          [](raywave::Scene& scene, std::size_t object, const MeshArrays& mesh) {
            auto changed = scene;  // other threads may use the scene meanwhile
            without_gil([&] { changed.set_mesh(object, mesh.view()); });
            scene = changed;
          },
          "object"_a, "mesh"_a)
      .def("position", &raywave::Scene::position_m, "object"_a)
      .def("rotation", &raywave::Scene::rotation_deg, "object"_a)
      .def("set_pose", &raywave::Scene::set_pose, "object"_a, "position"_a, "rotation"_a)
      .def("copy", [](const raywave::Scene& scene) { return scene; });
  m.def(
      "load_scene",
      [](const std::string& file, const std::vector<std::string>& overrides) {
        return raywave::load_scene(file, overrides);
      },
      "file"_a, "overrides"_a);
  m.def(
      "parse_scene",
      [](const std::string& toml, const std::string& folder,
         const std::vector<std::string>& overrides,
         const std::string& name) { return raywave::parse_scene(toml, folder, overrides, name); },
      "toml"_a, "folder"_a, "overrides"_a, "name"_a);

  nb::class_<raywave::Slm>(m, "Slm")
      .def(nb::init<>())
      .def(nb::init<const raywave::Scene&>(), "scene"_a)
      .def("notes", &raywave::Slm::notes, "wavelength"_a);
  m.def(
      "load_slm",
      [](const std::string& file, const std::vector<std::string>& overrides) {
        return raywave::load_slm(file, overrides);
      },
      "file"_a, "overrides"_a);
  m.def(
      "parse_slm",
      [](const std::string& toml, const std::string& folder) {
        return raywave::parse_slm(toml, folder);
      },
      "toml"_a, "folder"_a);

  nb::class_<raywave::Goal>(m, "Goal").def(
      "__init__",
      [](raywave::Goal* goal, const std::string& preset, std::optional<double> budget,
         std::optional<double> psnr, std::optional<double> rate) {
        new (goal)
            raywave::Goal{optional_choice<raywave::Preset>(preset, "preset"), budget, psnr, rate};
      },
      "preset"_a, "budget"_a.none(), "psnr"_a.none(), "rate"_a.none());

  nb::class_<raywave::Plan>(m, "Plan")
      .def_prop_ro("text", &raywave::Plan::text)
      .def("json", &raywave::Plan::json)
      .def_prop_ro("warnings", &raywave::Plan::warnings)
      .def_prop_ro("seconds", &raywave::Plan::seconds)
      .def_prop_ro("psnr_db", &raywave::Plan::psnr_db)
      .def_prop_ro("device_bytes", &raywave::Plan::device_bytes)
      .def_prop_ro("scene", &raywave::Plan::scene);
  // Scenes come by value: other threads may change theirs while the GIL is released.
  m.def(
      "plan",
      [](raywave::Scene scene, const raywave::Goal& goal, const std::string& device) {
        const nb::gil_scoped_release release;
        return raywave::plan(scene, goal, device);
      },
      "scene"_a, "goal"_a, "device"_a);

  nb::class_<raywave::RenderOptions>(m, "RenderOptions")
      .def(
          "__init__",
          [](raywave::RenderOptions* self, const std::string& device, const std::string& fft,
             const raywave::Goal& goal, const std::string& method, int rays, bool keep_field) {
            new (self) raywave::RenderOptions{device_options(device, fft),
                                              goal,
                                              raywave::choice_of<raywave::Method>(method, "method"),
                                              rays,
                                              keep_field,
                                              {}};
          },
          "device"_a, "fft"_a, "goal"_a, "method"_a, "rays"_a, "keep_field"_a);

  nb::class_<raywave::Hologram>(m, "Hologram")
      .def_prop_ro("frames", &raywave::Hologram::frames)
      .def_prop_ro("pixels", &raywave::Hologram::pixels)
      .def_prop_ro("wavelengths", &raywave::Hologram::wavelengths_m)
      .def_prop_ro("powers", &raywave::Hologram::powers)
      .def("laser", &raywave::Hologram::laser, "number"_a)
      .def("levels", [](const raywave::Hologram& h) { return hologram_view(h, h.levels().data()); })
      .def("field", [](const raywave::Hologram& h) { return hologram_view(h, h.field().values); })
      .def("refined",
           [](const raywave::Hologram& h) {
             return hologram_view(h, h.refined().value_or(raywave::FieldView{}).values);
           })
      .def("shown",
           [](const raywave::Hologram& h) {
             auto field = without_gil([&] { return h.shown(); });
             const auto shape = shape_of(h.lasers(), h.frames(), h.ny(), h.nx());
             return as_numpy(std::move(field.values), shape);
           })
      .def(
          "for_slm",
          [](const raywave::Hologram& h, int frame) { return levels_array(h.for_slm(frame)); },
          "frame"_a)
      .def(
          "save",
          [](const raywave::Hologram& h, const std::string& path, std::optional<int> frame,
             bool rgb) { h.save(path, frame, rgb); },
          "path"_a, "frame"_a.none(), "rgb"_a, released)
      .def("report", &raywave::Hologram::report)
      .def_prop_ro("notes", &raywave::Hologram::notes);

  m.def(
      "render",
      [](raywave::Scene scene, raywave::RenderOptions options, const nb::object& progress) {
        options.progress = progress_of(progress);
        const nb::gil_scoped_release release;
        return raywave::render(scene, options);
      },
      "scene"_a, "options"_a, "progress"_a.none());

  nb::class_<Renderer>(m, "Renderer")
      .def(nb::init<const raywave::Scene&, const raywave::RenderOptions&, const nb::object&>(),
           "scene"_a, "options"_a, "progress"_a.none())
      .def_prop_ro("nx", &Renderer::nx)
      .def_prop_ro("ny", &Renderer::ny)
      .def_prop_ro("frames", &Renderer::frames)
      .def_prop_ro("wavelengths", &Renderer::wavelengths_m)
      .def_prop_ro("objects", &Renderer::objects)
      .def_prop_ro("notes", &Renderer::notes)
      .def("set_pose", &Renderer::set_pose, "object"_a, "position"_a, "rotation"_a, "solid"_a,
           released)
      .def(
          "set_mesh",
          [](Renderer& r, std::size_t object, const MeshArrays& mesh) {
            r.set_mesh(object, mesh.view());
          },
          "object"_a, "mesh"_a, released)
      .def("set_light", &Renderer::set_light, "light"_a, "values"_a, released)
      .def("set_seed", &Renderer::set_seed, "seed"_a, released)
      .def("render", &Renderer::render, "progress"_a.none())
      .def("render_into", &Renderer::render_into, "out"_a.none(), "field"_a.none(),
           "progress"_a.none());

  nb::class_<Animation>(m, "Animation")
      .def(nb::init<const raywave::Scene&, const raywave::RenderOptions&, const nb::object&>(),
           "scene"_a, "options"_a, "progress"_a.none())
      .def_prop_ro("pictures", &Animation::pictures)
      .def_prop_ro("rate", &Animation::rate_per_s)
      .def_prop_ro("slm_rate", &Animation::slm_rate_per_s)
      .def_prop_ro("wavelengths", &Animation::wavelengths_m)
      .def_prop_ro("notes", &Animation::notes)
      .def("render", &Animation::render, "number"_a, "progress"_a.none());

  nb::class_<raywave::RefineOptions>(m, "RefineOptions")
      .def(
          "__init__",
          [](raywave::RefineOptions* self, std::optional<int> iterations, std::optional<int> views,
             std::optional<int> lens_points, std::optional<double> brightness,
             std::optional<double> blur, std::optional<double> budget, std::vector<double> depths) {
            new (self) raywave::RefineOptions{{},         iterations, views,  lens_points,
                                              brightness, blur,       budget, std::move(depths)};
          },
          "iterations"_a.none(), "views"_a.none(), "lens_points"_a.none(), "brightness"_a.none(),
          "blur"_a.none(), "budget"_a.none(), "depths"_a);
  m.def(
      "refine_scene",
      [](raywave::Scene scene, raywave::RefineOptions options, const raywave::RenderOptions& render,
         const nb::object& progress) {
        options.render = render;
        options.render.progress = progress_of(progress);
        const nb::gil_scoped_release release;
        return raywave::refine(scene, options);
      },
      "scene"_a, "options"_a, "render"_a, "progress"_a.none());
  m.def(
      "refine_field",
      [](nb::handle field, raywave::Pixels pixels,
         const std::vector<std::tuple<double, nb::object, raywave::Vec2, raywave::Vec2>>& targets,
         raywave::RefineOptions options, const std::string& device, const std::string& fft,
         const nb::object& progress) {
        const auto array = in_single<Complex>(planes_of(field, "field"));
        std::vector<AnyArray> pictures;
        std::vector<raywave::Target> wanted;
        for (const auto& [z, picture, view, aperture] : targets) {
          pictures.push_back(in_single<float>(plane_of(picture, "targets")));
          wanted.push_back({z, picture_view(pictures.back(), "targets"), view, aperture});
        }
        options.render.on = device_options(device, fft);
        options.render.progress = progress_of(progress);
        const auto start = field_view(array, "field");
        return field_array(
            without_gil([&] { return raywave::refine(start, pixels, wanted, options); }));
      },
      "field"_a.none(), "pixels"_a, "targets"_a, "options"_a, "device"_a, "fft"_a,
      "progress"_a.none());
  add_light(m);
  add_display(m);
  add_live(m);
}

}  // namespace raywave_python
