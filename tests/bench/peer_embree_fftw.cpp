// SPDX-License-Identifier: Apache-2.0
// The paper's method as one would write it for a CPU today, to be compared with raywave by `raywave
// bench`: every WRP pixel sends the same fan of rays (host/plan/plan.cpp, paper Eq. 4-7), in
// coherent packets of 16 neighbours, through Embree; what a ray hits is a source of light, Phong's
// radiance, a random phase that belongs to the cell it lies in; each WRP is padded to twice its
// size and carried to the hologram by one forward and one inverse transform of FFTW, planned by
// measuring, with a transfer function made beforehand. Objects turn, and Embree's tree is built
// anew, in every frame. Textures, shadows, bounces and point lights are not there.
//
// usage: peer_embree_fftw SCENE [--set KEY=VALUE]... [--frames N] [--name TEXT] [--field FILE.npy]
// Prints the frames as JSON for run_peer (host/evaluate/bench/bench.hpp). FILE.npy: the hologram's
// field in the scene's own pose.
#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif
#include <fftw3.h>

#include <cstdio>
#include <cstring>
#include <numbers>

#include "host/common/error.hpp"
#include "host/common/npy.hpp"
#include "host/common/threads.hpp"
#include "host/evaluate/bench/bench.hpp"
#include "host/evaluate/stopwatch.hpp"
#include "host/planning/make_plan.hpp"
#include "tests/support/scenes.hpp"

namespace raywave {
namespace {

constexpr int packet = 16;
using Complex = std::complex<float>;

/// Calls work(i) for i = 0, ..., count - 1 on all threads.
template <class F>
void in_parallel(std::size_t count, std::size_t grain, const F& work) {
  auto& threads = cl::Threads::shared();
  threads.for_each(threads.count(), count, grain, [&](std::size_t, std::size_t i) { work(i); });
}

/// Triangles in Embree, relative to an origin, and their corners' normals.
class Surfaces {
public:
  Surfaces()
      : device_(rtcNewDevice(("threads=" + std::to_string(cl::Threads::shared().count())).c_str())),
        scene_(rtcNewScene(device_)) {}
  ~Surfaces() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  Surfaces(const Surfaces&) = delete;
  Surfaces& operator=(const Surfaces&) = delete;

  void place(const World& world, glm::dvec3 origin_m) {
    if (!geometry_) make_room(world);
    const auto positions_m = positions_now(world);
    for (std::size_t i = 0; i < positions_m.size(); ++i) {
      const glm::vec3 p(positions_m[i] - origin_m);
      for (int axis = 0; axis < 3; ++axis) vertices_[3 * i + axis] = p[axis];
    }
    rtcUpdateGeometryBuffer(geometry_, RTC_BUFFER_TYPE_VERTEX, 0);
    rtcCommitGeometry(geometry_);
    rtcCommitScene(scene_);
  }

  void intersect(const int* active, RTCRayHit16& rays) const {
#if RTC_VERSION_MAJOR >= 4
    RTCIntersectArguments arguments;
    rtcInitIntersectArguments(&arguments);
    arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
    rtcIntersect16(active, scene_, &rays, &arguments);
#else
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    rtcIntersect16(active, scene_, &context, &rays);
#endif
  }

private:
  void make_room(const World& world) {
    geometry_ = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    vertices_ = static_cast<float*>(rtcSetNewGeometryBuffer(geometry_, RTC_BUFFER_TYPE_VERTEX, 0,
                                                            RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                                                            world.positions.size()));
    void* indices = rtcSetNewGeometryBuffer(geometry_, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                            3 * sizeof(unsigned), world.triangles.size());
    std::memcpy(indices, world.triangles.data(),
                world.triangles.size() * sizeof world.triangles[0]);
    rtcAttachGeometry(scene_, geometry_);
    rtcReleaseGeometry(geometry_);  // the scene keeps it
  }

  RTCDevice device_;
  RTCScene scene_;
  RTCGeometry geometry_ = nullptr;
  float* vertices_ = nullptr;
};

/// Phong's numbers for the light of one wavelength.
struct Phong {
  float ambient, diffuse, specular, shininess;
};

struct Sun {
  glm::vec3 towards;
  float intensity;
};

class Peer {
public:
  explicit Peer(Scene scene) : scene_(std::move(scene)), world_(build_world(scene_)) {
    scene_.sampling.mode = SamplingMode::fan;
    plan_ = make_plan(scene_, world_);
    padded_ = 2 * plan_.hologram.size;
    const int channel = channel_of(plan_.hologram.wavelength_m);
    double ambient = 0;
    bool has_ambient = false;
    for (const auto& l : scene_.lights) {
      if (l.type == LightType::point) throw InputError("point lights are not there");
      if (l.type == LightType::directional)
        suns_.push_back({glm::vec3(-glm::normalize(l.direction)), static_cast<float>(l.intensity)});
      else
        has_ambient = true, ambient += l.intensity;
    }
    for (const auto& m : scene_.materials) {
      if (m.texture) throw InputError("textures are not there");
      phongs_.push_back({static_cast<float>(m.ambient[channel] * (has_ambient ? ambient : 1)),
                         static_cast<float>(m.diffuse[channel]),
                         static_cast<float>(m.specular[channel]), static_cast<float>(m.shininess)});
    }
    plan_transforms();
    for (const auto& wrp : plan_.wrps)
      transfers_.push_back(transfer({-wrp.centre_m.x, wrp.centre_m.y}, wrp.centre_m.z));
    hologram_.resize(pixels());
    levels_.resize(pixels());
  }
  ~Peer() {
    fftwf_destroy_plan(forward_);
    fftwf_destroy_plan(inverse_);
    fftwf_free(plane_);
    fftwf_free(spectrum_);
  }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  BenchFrame frame(double turn_deg) {
    BenchFrame result;
    const Stopwatch watch;
    double before = 0;
    const auto stage = [&](const char* name) {
      const double now = watch.wall_s();
      result.stages_s[name] += now - before;
      before = now;
    };
    auto turned = scene_;
    for (auto& object : turned.objects) object.rotation_deg.y += turn_deg;
    move_objects(turned, world_);
    normals_ = normals_now(world_);
    stage("meshes");
    surfaces_.place(world_, plan_.wrps[0].centre_m);
    stage("tree");
    std::fill(hologram_.begin(), hologram_.end(), Complex());
    for (std::size_t i = 0; i < plan_.wrps.size(); ++i) {
      in_parallel(plan_.hologram.size.y, 4,
                  [&](std::size_t row) { trace_row(plan_.wrps[i], static_cast<int>(row)); });
      stage("trace");
      propagate(transfers_[i]);
      stage("propagate");
    }
    encode();
    stage("encode");
    result.wall_s = watch.wall_s();
    result.processor_s = watch.processor_s();
    return result;
  }

  void save(const std::string& file) const {
    save_npy(file, plan_.hologram.size.x, plan_.hologram.size.y, 1, hologram_);
  }

private:
  std::size_t pixels() const {
    return static_cast<std::size_t>(plan_.hologram.size.x) * plan_.hologram.size.y;
  }
  std::size_t padded_pixels() const { return static_cast<std::size_t>(padded_.x) * padded_.y; }

  void plan_transforms() {
    fftwf_init_threads();
    fftwf_plan_with_nthreads(static_cast<int>(cl::Threads::shared().count()));
    plane_ = fftwf_alloc_complex(padded_pixels());
    spectrum_ = fftwf_alloc_complex(padded_pixels());
    forward_ =
        fftwf_plan_dft_2d(padded_.y, padded_.x, plane_, spectrum_, FFTW_FORWARD, FFTW_MEASURE);
    inverse_ =
        fftwf_plan_dft_2d(padded_.y, padded_.x, spectrum_, spectrum_, FFTW_BACKWARD, FFTW_MEASURE);
    // What lies beyond the WRP stays zero
    std::memset(plane_, 0, padded_pixels() * sizeof *plane_);
  }

  /// Band-limited shifted angular spectrum (Matsushima 2010), and FFTW's 1/n. Shift x right, y
  /// down.
  std::vector<Complex> transfer(glm::dvec2 shift_m, double distance_m) const {
    std::vector<Complex> values(padded_pixels());
    const glm::dvec2 half_m = glm::dvec2(padded_) * plan_.hologram.pitch_m / 2.0;
    in_parallel(padded_.y, 16, [&](std::size_t row) {
      const auto frequency = [](int i, int n, double pitch) {
        return (i < (n + 1) / 2 ? i : i - n) / (n * pitch);
      };
      const double v = frequency(static_cast<int>(row), padded_.y, plan_.hologram.pitch_m.y);
      for (int x = 0; x < padded_.x; ++x) {
        const double u = frequency(x, padded_.x, plan_.hologram.pitch_m.x);
        const double w2 =
            1 / (plan_.hologram.wavelength_m * plan_.hologram.wavelength_m) - u * u - v * v;
        if (w2 <= 0) continue;
        const double w = std::sqrt(w2);
        if (std::abs(shift_m.x - distance_m * u / w) > half_m.x ||
            std::abs(shift_m.y - distance_m * v / w) > half_m.y)
          continue;
        const double turns = shift_m.x * u + shift_m.y * v + distance_m * w;
        values[row * padded_.x + x] = Complex(
            std::polar(1.0 / static_cast<double>(padded_pixels()), 2 * std::numbers::pi * turns));
      }
    });
    return values;
  }

  void propagate(const std::vector<Complex>& transfer) {
    fftwf_execute(forward_);
    auto* spectrum = reinterpret_cast<Complex*>(spectrum_);
    const auto width = static_cast<std::size_t>(padded_.x);
    in_parallel(padded_.y, 16, [&](std::size_t row) {
      for (std::size_t i = row * width; i < (row + 1) * width; ++i) spectrum[i] *= transfer[i];
    });
    fftwf_execute(inverse_);
    in_parallel(plan_.hologram.size.y, 16, [&](std::size_t row) {
      for (int x = 0; x < plan_.hologram.size.x; ++x)
        hologram_[row * plan_.hologram.size.x + x] += spectrum[row * width + x];
    });
  }

  void encode() {
    in_parallel(plan_.hologram.size.y, 16, [&](std::size_t row) {
      const Complex* field = &hologram_[row * plan_.hologram.size.x];
      std::uint8_t* levels = &levels_[row * plan_.hologram.size.x];
#pragma omp simd
      for (int x = 0; x < plan_.hologram.size.x; ++x) {
        const float turns = std::atan2(field[x].imag(), field[x].real()) *
                            static_cast<float>(0.5 / std::numbers::pi);
        levels[x] =
            static_cast<std::uint8_t>(static_cast<int>(std::floor(256 * turns + 0.5f)) & 255);
      }
    });
  }

  void trace_row(const Wrp& wrp, int row) {
    const glm::dvec3 first = wrp.centre_m - plan_.wrps[0].centre_m;
    auto* line = reinterpret_cast<Complex*>(plane_) + static_cast<std::size_t>(row) * padded_.x;
    const auto y = static_cast<float>(first.y + ((plan_.hologram.size.y - 1) / 2.0 - row) *
                                                    plan_.hologram.pitch_m.y);
    for (int x = 0; x < plan_.hologram.size.x; x += packet) {
      alignas(64) float re[packet] = {}, im[packet] = {}, place_x[packet];
      alignas(64) int active[packet];
      for (int lane = 0; lane < packet; ++lane) {
        place_x[lane] = static_cast<float>(
            first.x + (x + lane - (plan_.hologram.size.x - 1) / 2.0) * plan_.hologram.pitch_m.x);
        active[lane] = x + lane < plan_.hologram.size.x ? -1 : 0;
      }
      for (const auto& tangent : wrp.fan) add_rays(tangent, place_x, y, active, re, im);
      for (int lane = 0; lane < packet && active[lane]; ++lane)
        line[x + lane] = {re[lane], im[lane]};
    }
  }

  /// What 16 parallel rays bring.
  void add_rays(glm::dvec2 tangent, const float* place_x, float y, const int* active, float* re,
                float* im) const {
    const glm::vec3 way(glm::normalize(glm::dvec3(tangent, 1)));
    RTCRayHit16 rays;
    for (int lane = 0; lane < packet; ++lane) {
      rays.ray.org_x[lane] = place_x[lane];
      rays.ray.org_y[lane] = y;
      rays.ray.org_z[lane] = 0;
      rays.ray.dir_x[lane] = way.x;
      rays.ray.dir_y[lane] = way.y;
      rays.ray.dir_z[lane] = way.z;
      rays.ray.tnear[lane] = 0;
      rays.ray.tfar[lane] = INFINITY;
      rays.ray.time[lane] = 0;
      rays.ray.mask[lane] = ~0u;
      rays.ray.flags[lane] = 0;
      rays.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
      rays.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
    }
    surfaces_.intersect(active, rays);

    // Normals and materials, lane by lane; the rest side by side.
    alignas(64) float nx[packet], ny[packet], nz[packet], met[packet];
    alignas(64) float ambient[packet] = {}, diffuse[packet] = {}, specular[packet] = {},
                      shininess[packet] = {};
    int hits = 0;
    for (int lane = 0; lane < packet; ++lane) {
      const bool is_hit = active[lane] && rays.hit.geomID[lane] != RTC_INVALID_GEOMETRY_ID;
      met[lane] = is_hit ? 1.0f : 0.0f;
      nx[lane] = ny[lane] = 0;
      nz[lane] = -1;
      if (!is_hit) continue;
      ++hits;
      const auto triangle = rays.hit.primID[lane];
      const auto& corners = world_.triangles[triangle];
      const float u = rays.hit.u[lane], v = rays.hit.v[lane];
      const auto normal =
          (1 - u - v) * normals_[corners.x] + u * normals_[corners.y] + v * normals_[corners.z];
      // The side that the ray comes from, as the triangle says.
      const auto face = glm::vec3(rays.hit.Ng_x[lane], rays.hit.Ng_y[lane], rays.hit.Ng_z[lane]);
      const float sign = (glm::dot(face, way) > 0) == (glm::dot(face, normal) > 0) ? -1.0f : 1.0f;
      nx[lane] = sign * normal.x;
      ny[lane] = sign * normal.y;
      nz[lane] = sign * normal.z;
      const auto& phong = phongs_[scene_.objects[world_.triangle_object[triangle]].material];
      ambient[lane] = phong.ambient;
      diffuse[lane] = phong.diffuse;
      specular[lane] = phong.specular;
      shininess[lane] = phong.shininess;
    }
    if (hits == 0) return;

    alignas(64) float radiance[packet];
#pragma omp simd
    for (int lane = 0; lane < packet; ++lane) {
      const float inverse =
          1 / std::sqrt(nx[lane] * nx[lane] + ny[lane] * ny[lane] + nz[lane] * nz[lane]);
      nx[lane] *= inverse;
      ny[lane] *= inverse;
      nz[lane] *= inverse;
      radiance[lane] = ambient[lane];
    }
    for (const auto& sun : suns_) {
      alignas(64) float facing[packet], highlight[packet];
#pragma omp simd
      for (int lane = 0; lane < packet; ++lane) {
        facing[lane] =
            nx[lane] * sun.towards.x + ny[lane] * sun.towards.y + nz[lane] * sun.towards.z;
        // Mirrored light along the way back to the pixel.
        const float mx = 2 * facing[lane] * nx[lane] - sun.towards.x,
                    my = 2 * facing[lane] * ny[lane] - sun.towards.y,
                    mz = 2 * facing[lane] * nz[lane] - sun.towards.z;
        highlight[lane] = std::max(-(mx * way.x + my * way.y + mz * way.z), 1e-3f);
      }
#pragma omp simd
      for (int lane = 0; lane < packet; ++lane)
        highlight[lane] = std::max(shininess[lane] * std::log(highlight[lane]), -80.0f);
#pragma omp simd
      // Pow would be slow where it is tiny
      for (int lane = 0; lane < packet; ++lane) highlight[lane] = std::exp(highlight[lane]);
#pragma omp simd
      for (int lane = 0; lane < packet; ++lane) {
        const float lit = facing[lane] > 0 ? sun.intensity : 0.0f;
        radiance[lane] += lit * (diffuse[lane] * facing[lane] + specular[lane] * highlight[lane]);
      }
    }
    const auto wave_number = static_cast<float>(1 / plan_.hologram.wavelength_m),
               cells = static_cast<float>(1 / scene_.sampling.pitch_m);
#pragma omp simd
    for (int lane = 0; lane < packet; ++lane) {
      const float r = met[lane] > 0 ? rays.ray.tfar[lane] : 1.0f;
      const auto i = static_cast<int>(std::floor((place_x[lane] + r * way.x) * cells));
      const auto j = static_cast<int>(std::floor((y + r * way.y) * cells));
      const auto k = static_cast<int>(std::floor(r * way.z * cells));
      auto h = static_cast<std::uint32_t>(i) * 0x9e3779b1u ^
               (static_cast<std::uint32_t>(j) * 0x85ebca77u + 0x165667b1u);
      h = (h ^ (h >> 15)) * 0x2c1b3c6du;
      h ^= static_cast<std::uint32_t>(k) * 0xc2b2ae3du;
      h = (h ^ (h >> 16)) * 0x7feb352du;
      h ^= h >> 15;
      const float turns = r * wave_number + static_cast<float>(static_cast<int>(h >> 8)) * 0x1p-24f;
      const auto quarter = static_cast<float>(std::numbers::pi / 2);
      const float angle = (turns - std::floor(turns)) * 4 * quarter;
      const float amplitude = met[lane] * std::sqrt(radiance[lane]) / r;
      re[lane] += amplitude * std::cos(angle);
      // Sine and cosine together are no call for vectors
      im[lane] += amplitude * std::cos(angle - quarter);
    }
  }

  Scene scene_;
  World world_;
  std::vector<glm::vec3> normals_;  // as they point now
  Plan plan_;
  Surfaces surfaces_;
  std::vector<Sun> suns_;
  std::vector<Phong> phongs_;
  glm::ivec2 padded_{1, 1};
  fftwf_complex *plane_ = nullptr, *spectrum_ = nullptr;
  fftwf_plan forward_ = nullptr, inverse_ = nullptr;
  std::vector<std::vector<Complex>> transfers_;
  std::vector<Complex> hologram_;
  std::vector<std::uint8_t> levels_;
};

void run(const std::vector<std::string>& words) {
  std::vector<std::string> set;
  std::string file, name = "Embree + FFTW", field;
  int frames = 3;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const bool has_value = i + 1 < words.size();
    if (words[i] == "--set" && has_value) {
      set.push_back(words[++i]);
    } else if (words[i] == "--frames" && has_value) {
      frames = std::stoi(words[++i]);
    } else if (words[i] == "--name" && has_value) {
      name = words[++i];
    } else if (words[i] == "--field" && has_value) {
      field = words[++i];
    } else {
      file = words[i];
    }
  }
  Peer peer(load_scene(file, set));
  peer.frame(0);
  BenchRow row;
  row.name = name;
  for (int i = 0; i < frames; ++i) row.frames.push_back(peer.frame(0.25 * (1 + i % 16)));
  if (!field.empty()) {
    peer.frame(0);
    peer.save(field);
  }
  std::fputs(peer_json({row}).c_str(), stdout);
}

}  // namespace
}  // namespace raywave

int main(int argc, char** argv) {
  try {
    raywave::run({argv + 1, argv + argc});
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "peer_embree_fftw: %s\n", error.what());
    return 1;
  }
}
