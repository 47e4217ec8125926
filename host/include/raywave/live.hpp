// SPDX-License-Identifier: Apache-2.0
/// A scene under the hand: it is turned and looked at, as in `raywave view` (docs/view.md).
#pragma once

#include <raywave/render.hpp>

namespace RAYWAVE_NAMESPACE {

/// What a person sees of a scene.
struct Viewing {
  struct Pose {
    Vec3 position_m{0, 0, 0}, rotation_deg{0, 0, 0};
    /// Turns it further, about the hologram's x, then y, then z.
    RAYWAVE_API void turn(const Vec3& by_deg);
  };
  std::vector<Pose> poses{};  // of all objects: solids, as Renderer::set_pose has them
  // Keys of lights, as Renderer::set_light takes them; all others are the scene's
  std::map<std::size_t, std::vector<std::string>> lights{};
  double focus_m = 0.1;  // depth that is sharp
  // Part of the hologram that is looked through: ViewOptions' view, -1 to 1, and aperture, 0.01 to
  // 1. Not behind an eyepiece, where the viewer's first pupil looks
  Vec2 view{0, 0};
  double aperture = 1;
  // Of the eye, across, 1e-6 to 1: the part is a square of this side; behind an eyepiece in place
  // of the viewer's own
  std::optional<double> pupil_m{};
  bool has_levels = false, has_lens = false;  // beside the picture: levels left, a lens's right
  double stops = 0;                           // exposure, -20 to 20
  std::optional<Preset> preset{};             // empty: LiveOptions::goal
  bool is_refined = false;                    // levels, in 4 iterations
};

/// Pictures side by side.
struct LivePicture {
  int nx = 0, ny = 0;
  std::vector<std::uint8_t> rgb{};  // sRGB, 3 nx ny, as an eye sees it
  double hologram_s = 0;            // 0: nothing had moved
  double picture_s = 0;
  std::string note{};  // on this picture; empty: none
};

struct LiveOptions {
  DeviceOptions on{};
  Goal goal{};
  int longest = 640;  // pixels of the longer side of a picture
};

/// What the hologram of a scene shows while the scene is turned: the pictures of `raywave view`,
/// the same bits for the same pictures in turn. Meshes, kernels, plans and memory are kept. Calls
/// of one from several threads take turns.
class RAYWAVE_API LiveView {
public:
  /// throws  InputError for the scene, DeviceError for the device
  explicit LiveView(const Scene& scene, const LiveOptions& options = {});
  ~LiveView();
  LiveView(LiveView&&) noexcept;
  LiveView& operator=(LiveView&&) noexcept;

  /// As the scene has it, focused on its middle, or its end where that is the hologram.
  Viewing start() const;
  Vec2 window_m() const;   // sides of a picture, around the axis
  double depth_m() const;  // of the scene as it stands, at least a tenth of its distance
  /// What the plans have to say of the last hologram. It takes longer than a hologram.
  std::vector<std::string> notes() const;

  /// throws  InputError for what cannot be seen: the next look is as if nobody had asked
  LivePicture look(const Viewing& viewing);

private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace RAYWAVE_NAMESPACE
