// SPDX-License-Identifier: Apache-2.0
/// Plans, renders and holograms.
#pragma once

#include <map>
#include <optional>
#include <raywave/scene.hpp>
#include <utility>

namespace RAYWAVE_NAMESPACE {

/// An OpenCL device.
struct Device {
  std::string index{};  // "0:1": platform and device within it
  std::string platform{}, name{}, driver{};
  DeviceKind kind = DeviceKind::other;
  std::uint64_t memory_bytes = 0;
  bool has_doubles = false;
};

/// Every OpenCL device; empty when there is none.
RAYWAVE_API std::vector<Device> list_devices();

/// Where something is computed.
struct DeviceOptions {
  // Index ("0:1"), kind ("gpu", "cpu") or part of a name; empty: the environment's RAYWAVE_DEVICE,
  // else the fastest GPU, else an accelerator, else a CPU
  std::string device{};
  std::optional<FftBackend> fft{};  // empty: the device's own choice
};

/// What a plan aims at. At most one; none: whatever the scene leaves open keeps its default.
struct Goal {
  std::optional<Preset> preset{};
  std::optional<double> budget_s{};  // the most accurate plan that keeps this time
  std::optional<double> psnr_db{};   // the fastest plan whose pictures reach this
  // Pictures a second: the most accurate plan that the device computes, and slm.rate shows, so fast
  std::optional<double> rate_per_s{};
};

/// What would be computed, and what to expect of it.
class RAYWAVE_API Plan {
public:
  struct State;
  explicit Plan(std::shared_ptr<const State> state);

  /// The table that `raywave plan` prints.
  std::string text() const;
  /// All of it as JSON, as `raywave plan --json` prints it.
  std::string json() const;
  /// One line each: what a user may not want, and what would change it.
  std::vector<std::string> warnings() const;
  double seconds() const;                 // predicted for a picture
  std::optional<double> psnr_db() const;  // predicted mean of its pictures, where it can be
  std::uint64_t device_bytes() const;
  /// The scene with the values that were chosen; render() follows it.
  Scene scene() const;

private:
  std::shared_ptr<const State> state_;
};

/// Chooses what the scene leaves open, as the goal says, and predicts what to expect. Needs no
/// device; where there is one, its measured rates count.
///
/// throws  InputError for the scene and the goal, DeviceError when `device` names none
RAYWAVE_API Plan plan(const Scene& scene, const Goal& goal = {}, const std::string& device = {});

struct RenderOptions {
  DeviceOptions on{};
  Goal goal{};
  Method method = Method::wrp;  // the others are references
  int rays_per_axis = 100;      // of Method::rays
  bool keep_field = true;       // also return the field at the hologram, beside the levels
  Progress progress{};
};

/// A finished hologram. Copies share the pixels; spans and views last as long as any copy.
class RAYWAVE_API Hologram {
public:
  struct State;
  explicit Hologram(std::shared_ptr<const State> state);

  int nx() const;
  int ny() const;
  int frames() const;  // of each laser
  // Of several lasers, wavelength_m is 0, which no function takes: ask the hologram of one
  Pixels pixels() const;

  /// Holograms of a scene in colour, to be shown in turn; 1 of one wavelength. Levels and fields of
  /// all lie one after another, in the order of hologram.wavelength; `lasers() * frames()` of them.
  int lasers() const;
  std::vector<double> wavelengths_m() const;  // as many
  /// Radiant powers that the lasers need on the SLM for the colours to be right, for equal times;
  /// their sum is 1.
  std::vector<double> powers() const;
  /// The hologram of one laser alone; it shares the pixels.
  Hologram laser(int number) const;

  /// The SLM's grey levels of all frames, frame by frame, in the hologram's frame: slm.rotate and
  /// slm.flip are not applied.
  std::span<const std::uint8_t> levels() const;

  /// One frame as the SLM is sent it: turned by slm.rotate, then flipped.
  ///
  /// throws  InputError when there is no such frame, or of several lasers: ask the hologram of one
  Levels for_slm(int frame = 0) const;

  /// Writes each frame, as the SLM is sent it, as a grey 8-bit PNG, named as `raywave render` does:
  /// "holo.png", the others holo_2.png, holo_3.png ... Of several lasers "holo.png" writes
  /// holo_638nm.png and the like; with `rgb`, of three, holo.png alone: the channel of the longest
  /// wavelength is red, of the shortest blue.
  ///
  /// frame   counted from 0: writes this one alone, under the name that is given
  /// throws  InputError for a name that does not end in .png, for `rgb` of other than three lasers,
  ///         for a frame that there is not, and where a file cannot be written
  void save(const std::filesystem::path& file, std::optional<int> frame = {},
            bool rgb = false) const;

  /// Field at the hologram, before it is encoded; without samples when it was not kept. |u|^2 is
  /// the irradiance of what the scene shows (docs/conventions.md).
  FieldView field() const;

  /// Phases that are encoded instead of the field's, of modulus 1, where they were refined.
  std::optional<FieldView> refined() const;

  /// The light that leaves the SLM with these levels, behind the stop of its optics.
  Field shown() const;

  /// The scene that it shows, with the values that were chosen, as a plan's.
  Scene scene() const;

  /// The report that `raywave render` writes: effective scene, plan, device, seconds, memory.
  std::string report() const;
  std::vector<std::string> notes() const;  // for the user, one line each

  const State& state() const { return *state_; }
  std::size_t first_laser() const { return first_; }  // of the state's

private:
  Hologram(std::shared_ptr<const State> state, std::size_t first, std::size_t lasers);

  std::shared_ptr<const State> state_;
  std::size_t first_ = 0, lasers_ = 1;  // of all that the state holds
};

/// Computes the holograms of a scene, as `raywave render` does: the same bits for equal scene, seed
/// and device.
///
/// throws  InputError for the scene, DeviceError for the device, Cancelled
RAYWAVE_API Hologram render(const Scene& scene, const RenderOptions& options = {});

/// The caller's memory for results; null: not wanted.
struct RenderTarget {
  std::uint8_t* levels = nullptr;  // nx ny frames lasers, as Hologram::levels
  std::complex<float>* field = nullptr;
};

/// Renders a scene that moves. Meshes, kernels, plans and memory are kept from one picture to the
/// next. Fields differ from those of render() by 1e-4 (relative L2) after objects have moved. In
/// colour, the lasers share the world and its samples.
///
/// Calls of one renderer from several threads take turns; several renderers work at the same time.
class RAYWAVE_API Renderer {
public:
  /// throws  InputError for the scene, DeviceError for the device, Cancelled
  explicit Renderer(const Scene& scene, const RenderOptions& options = {});
  ~Renderer();
  Renderer(Renderer&&) noexcept;
  Renderer& operator=(Renderer&&) noexcept;

  int nx() const;
  int ny() const;
  int frames() const;                         // of each laser
  std::vector<double> wavelengths_m() const;  // of the lasers; one of one wavelength
  std::size_t objects() const;
  std::vector<std::string> notes() const;  // Hologram::notes of the last picture

  /// Sets the place of an object's anchor (the centre of its bounding box unless the scene says
  /// otherwise) and its rotation about x, then y, then z. A solid keeps its size, whatever its
  /// `width` would make of the turned mesh, as objects of `[animation]` do; it turns about the
  /// middle of the box that it was placed with.
  ///
  /// throws  InputError when there is no such object, a number is not finite, or the object would
  ///         lie nearer than its cut, or move though a part of it is cut away: the object
  ///         stays
  void set_pose(std::size_t object, const Vec3& position_m, const Vec3& rotation_deg,
                bool is_solid = false);

  /// Gives an object another mesh, as Scene::set_mesh does; poses, lights and what was planned
  /// stay. Trees are built anew: the teapot's next picture takes three to four times as long.
  ///
  /// throws  as Scene::set_mesh, and for a scene that cannot be computed; the renderer then stays
  void set_mesh(std::size_t object, const MeshView& mesh);

  /// Changes keys of a light, each as "direction=[0, 0, 1]" or "intensity=0.5". Its type, falloff,
  /// highlights, samples and picture stay as they are.
  ///
  /// throws  InputError when there is no such light, or a key or value is not possible: it stays
  void set_light(std::size_t light, const std::vector<std::string>& values);

  /// Sets the seed of the random phases of the next pictures.
  void set_seed(std::uint32_t seed);

  /// throws  InputError when the scene cannot be computed; Cancelled; the renderer stays usable
  Hologram render();

  /// The same into memory of the caller's. The field needs RenderOptions::keep_field. Returns
  /// Hologram::powers.
  std::vector<double> render(const RenderTarget& target);

private:
  struct State;
  std::unique_ptr<State> state_;
};

/// A picture of an animation.
struct AnimationPicture {
  double time_s = 0;
  int holograms = 1;  // of each laser: slm_rate_per_s() / rate_per_s(), on average
  // As the SLM is sent them, laser by laser as Hologram::levels
  Levels levels{};
  std::vector<double> powers{};  // of the lasers; those of white have the sum 1
  std::vector<std::string> notes{};
};

/// The holograms of a scene with [animation] (docs/animation.md), with the bits of
/// `raywave animate`. Pictures may be asked for in any order. Calls from several threads take
/// turns.
class RAYWAVE_API Animation {
public:
  /// options  method, rays_per_axis and keep_field do not count
  /// throws   InputError for the scene: nothing moves, or a mesh lies in memory; DeviceError for
  ///          the device, Cancelled
  explicit Animation(const Scene& scene, const RenderOptions& options = {});
  ~Animation();
  Animation(Animation&&) noexcept;
  Animation& operator=(Animation&&) noexcept;

  int pictures() const;
  double rate_per_s() const;      // of pictures
  double slm_rate_per_s() const;  // of the holograms of each laser
  std::vector<double> wavelengths_m() const;
  std::vector<std::string> notes() const;  // for the user, one line each

  /// throws  InputError when there is no such picture, or it cannot be computed; Cancelled
  AnimationPicture render(int picture);

private:
  struct State;
  std::unique_ptr<State> state_;
};

struct RefineOptions {
  RenderOptions render{};
  // What is not given comes from the scene's section [refine], or its defaults (docs/refine.md)
  std::optional<int> iterations{};   // per frame
  std::optional<int> views{};        // pictures through quarters of the hologram
  std::optional<int> lens_points{};  // per axis
  std::optional<double> brightness{};
  std::optional<double> blur_m{};
  std::optional<double> budget_s{};  // seconds for the iterations; decides their number
  std::vector<double> depths_m{};    // of the pictures, ascending
};

/// Renders a scene and changes the phases until its pictures are what a lens sees, as
/// `raywave refine` does.
///
/// throws  InputError for the scene and its SLM, DeviceError for the device, Cancelled
RAYWAVE_API Hologram refine(const Scene& scene, const RefineOptions& options = {});

}  // namespace RAYWAVE_NAMESPACE
