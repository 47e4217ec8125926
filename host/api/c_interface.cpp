// SPDX-License-Identifier: Apache-2.0
#include <raywave/raywave.h>

#include <array>
#include <complex>
#include <cstdint>
#include <map>
#include <mutex>
#include <new>
#include <optional>
#include <raywave/raywave.hpp>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "host/common/error.hpp"

using raywave::InputError;

/// The renderer is made by the first render, and made anew after a mesh has changed.
struct raywave_renderer {
  raywave_renderer(raywave::v0::Scene opened, std::string on)
      : scene(std::move(opened)), device(std::move(on)) {}

  raywave::v0::Scene scene;
  std::string device;
  raywave_progress callback = nullptr;
  void* context = nullptr;
  std::optional<std::uint32_t> seed;
  std::optional<raywave::v0::Renderer> renderer;
  std::vector<double> powers;  // of the last picture
  std::string notes;           // the same
  // Poses that the renderer has been given, and the scene has not
  std::map<std::size_t, std::pair<raywave::v0::Vec3, raywave::v0::Vec3>> poses;
  mutable std::recursive_mutex mutex;
  bool is_busy = false;
};

namespace {

std::string& last_error() {
  thread_local std::string text;
  return text;
}

int failed(int status, const char* text) {
  try {
    last_error() = text;
  } catch (...) {
    last_error().clear();
  }
  return status;
}

/// Runs `f` and turns what it throws into a status.
template <class F>
int guarded(F&& f) {
  try {
    f();
    return RAYWAVE_OK;
  } catch (const InputError& error) {
    return failed(RAYWAVE_INPUT_ERROR, error.what());
  } catch (const raywave::DeviceError& error) {
    return failed(RAYWAVE_DEVICE_ERROR, error.what());
  } catch (const raywave::Cancelled& error) {
    return failed(RAYWAVE_CANCELLED, error.what());
  } catch (const std::bad_alloc&) {
    return failed(RAYWAVE_DEVICE_ERROR, "out of host memory");
  } catch (const std::exception& error) {
    return failed(RAYWAVE_BUG, error.what());
  } catch (...) {
    return failed(RAYWAVE_BUG, "an unknown error");
  }
}

std::string text_of(const char* text) { return text ? text : ""; }

const char* required(const char* text, const char* name) {
  if (!text) throw InputError(std::string(name) + ": is NULL");
  return text;
}

std::vector<std::string> lines_of(const char* text) {
  std::vector<std::string> lines;
  std::istringstream in(text_of(text));
  for (std::string line; std::getline(in, line);) {
    if (!line.empty()) lines.push_back(line);
  }
  return lines;
}

/// Runs `f` on a renderer, one call at a time.
template <class Renderer, class F>
int with(Renderer* renderer, F&& f) {
  return guarded([&] {
    if (!renderer) throw InputError("renderer: is NULL");
    const std::lock_guard lock(renderer->mutex);
    if (renderer->is_busy)
      throw InputError("the renderer is at work: its progress callback must not call it");
    f(*renderer);
  });
}

template <class Make>
int opened(raywave_renderer** renderer, const char* device, Make make) {
  if (renderer) *renderer = nullptr;
  return guarded([&] {
    if (!renderer) throw InputError("renderer: is NULL");
    *renderer = new raywave_renderer(make(), text_of(device));
  });
}

std::size_t object_of(const raywave_renderer& renderer, int object) {
  const auto objects = renderer.scene.objects();
  if (object < 0 || static_cast<std::size_t>(object) >= objects)
    throw InputError("object " + std::to_string(object) + ": there are " + std::to_string(objects) +
                     ", counted from 0");
  return static_cast<std::size_t>(object);
}

void render(raywave_renderer& renderer, std::uint8_t* levels, std::size_t bytes, float* field,
            std::size_t floats) {
  const auto [nx, ny] = renderer.scene.resolution();
  const auto samples = static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny) *
                       static_cast<std::size_t>(renderer.scene.frames()) *
                       renderer.scene.wavelengths_m().size();
  if (levels && bytes < samples)
    throw InputError("levels: " + std::to_string(samples) + " bytes are needed, got " +
                     std::to_string(bytes));
  if (field && floats < 2 * samples)
    throw InputError("field: " + std::to_string(2 * samples) + " floats are needed, got " +
                     std::to_string(floats));
  struct Busy {
    explicit Busy(bool& is_busy) : flag(is_busy) { flag = true; }
    ~Busy() { flag = false; }
    bool& flag;
  } const busy(renderer.is_busy);
  if (!renderer.renderer) {
    raywave::v0::RenderOptions options;
    options.on.device = renderer.device;
    options.progress = [&renderer](const std::string& what, double share) {
      return !renderer.callback || renderer.callback(what.c_str(), share, renderer.context) != 0;
    };
    renderer.renderer.emplace(renderer.scene, options);
    if (renderer.seed) renderer.renderer->set_seed(*renderer.seed);
  }
  renderer.notes.clear();
  // std::complex<float> is laid out as two floats
  renderer.powers =
      renderer.renderer->render({levels, reinterpret_cast<std::complex<float>*>(field)});
  for (const auto& note : renderer.renderer->notes()) renderer.notes += note + '\n';
}

}  // namespace

extern "C" {

const char* raywave_version(void) { return RAYWAVE_VERSION; }

const char* raywave_error(void) { return last_error().c_str(); }

int raywave_open(const char* file, const char* overrides, const char* device,
                 raywave_renderer** renderer) {
  return opened(renderer, device, [&] {
    return raywave::v0::load_scene(required(file, "file"), lines_of(overrides));
  });
}

int raywave_open_text(const char* toml, const char* folder, const char* overrides,
                      const char* device, raywave_renderer** renderer) {
  return opened(renderer, device, [&] {
    return raywave::v0::parse_scene(required(toml, "toml"), folder ? folder : ".",
                                    lines_of(overrides));
  });
}

void raywave_close(raywave_renderer* renderer) { delete renderer; }

int raywave_size(const raywave_renderer* renderer, int* nx, int* ny, int* frames, int* objects) {
  return guarded([&] {
    if (!renderer) throw InputError("renderer: is NULL");
    const std::lock_guard lock(renderer->mutex);
    const auto resolution = renderer->scene.resolution();
    if (nx) *nx = resolution[0];
    if (ny) *ny = resolution[1];
    if (frames) *frames = renderer->scene.frames();
    if (objects) *objects = static_cast<int>(renderer->scene.objects());
  });
}

int raywave_lasers(const raywave_renderer* renderer, int* lasers, double* wavelengths_m,
                   double* powers) {
  return guarded([&] {
    if (!renderer) throw InputError("renderer: is NULL");
    const std::lock_guard lock(renderer->mutex);
    const auto all = renderer->scene.wavelengths_m();
    if (lasers) *lasers = static_cast<int>(all.size());
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (wavelengths_m) wavelengths_m[i] = all[i];
      if (powers) powers[i] = renderer->powers.empty() ? 0 : renderer->powers[i];
    }
  });
}

int raywave_set_pose(raywave_renderer* renderer, int object, const double* position_m,
                     const double* rotation_deg) {
  return with(renderer, [&](raywave_renderer& r) {
    if (!position_m) throw InputError("position_m: is NULL");
    if (!rotation_deg) throw InputError("rotation_deg: is NULL");
    const raywave::v0::Vec3 position{position_m[0], position_m[1], position_m[2]},
        rotation{rotation_deg[0], rotation_deg[1], rotation_deg[2]};
    const auto number = object_of(r, object);
    if (!r.renderer) return r.scene.set_pose(number, position, rotation);
    r.renderer->set_pose(number, position, rotation);
    r.poses[number] = {position, rotation};
  });
}

int raywave_set_mesh(raywave_renderer* renderer, int object, const double* vertices,
                     size_t vertex_count, const uint32_t* faces, size_t face_count) {
  return with(renderer, [&](raywave_renderer& r) {
    if (!vertices) throw InputError("vertices: is NULL");
    if (!faces) throw InputError("faces: is NULL");
    std::vector<raywave::v0::Vec3> points;
    for (std::size_t i = 0; i < vertex_count; ++i)
      points.push_back({vertices[3 * i], vertices[3 * i + 1], vertices[3 * i + 2]});
    std::vector<std::array<std::uint32_t, 3>> corners;
    for (std::size_t i = 0; i < face_count; ++i)
      corners.push_back({faces[3 * i], faces[3 * i + 1], faces[3 * i + 2]});
    r.scene.set_mesh(object_of(r, object), {points, corners});
    for (const auto& [number, pose] : r.poses) r.scene.set_pose(number, pose.first, pose.second);
    r.poses.clear();
    r.renderer.reset();
  });
}

int raywave_set_seed(raywave_renderer* renderer, uint32_t seed) {
  return with(renderer, [&](raywave_renderer& r) {
    r.seed = seed;
    if (r.renderer) r.renderer->set_seed(seed);
  });
}

int raywave_set_progress(raywave_renderer* renderer, raywave_progress callback, void* context) {
  return with(renderer, [&](raywave_renderer& r) {
    r.callback = callback;
    r.context = context;
  });
}

int raywave_render(raywave_renderer* renderer, uint8_t* levels, size_t bytes) {
  return raywave_render_field(renderer, levels, bytes, nullptr, 0);
}

int raywave_render_field(raywave_renderer* renderer, uint8_t* levels, size_t bytes, float* field,
                         size_t floats) {
  return with(renderer, [&](raywave_renderer& r) { render(r, levels, bytes, field, floats); });
}

const char* raywave_notes(const raywave_renderer* renderer) {
  return renderer ? renderer->notes.c_str() : "";
}

}  // extern "C"
