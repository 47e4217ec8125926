// SPDX-License-Identifier: Apache-2.0
/// A scene under the hand: its objects are turned, an eye looks at it, and pictures follow.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cl/device.hpp"
#include "cl/fft.hpp"
#include "host/common/choices.hpp"
#include "host/geometry/world.hpp"
#include "host/refine/light.hpp"
#include "host/render.hpp"
#include "host/scene/scene.hpp"

namespace raywave {

/// What a person sees of a scene.
struct Viewing {
  struct Pose {
    glm::dvec3 position_m{0}, rotation_deg{0};
    bool operator==(const Pose&) const = default;
    /// Turns it further, about the hologram's x, then y, then z.
    void turn(glm::dvec3 by_deg);
  };
  std::vector<Pose> poses;    // of the objects
  std::vector<Light> lights;  // as the scene has them; none: they stay as they are
  double focus_m = 0.1;       // depth that is sharp
  // The part of the hologram that is looked through: its middle in half holograms, its size in
  // holograms. Not before an eyepiece, through which the viewer's first pupil looks
  glm::dvec2 eye{0, 0};
  double part = 1;
  // Of the eye, across: the part is a square of this side; behind an eyepiece in place of the
  // viewer's own
  std::optional<double> pupil_m{};
  bool hologram = false, lens = false;  // also show levels, and what an ideal lens sees
  double stops = 0;  // exposure, over that at which 99.5 % of the pixels are below white
  struct Plans {
    std::optional<Preset> preset{};  // empty: as it was started
    bool are_refined = false;        // levels, at the pace of frames
    bool operator==(const Plans&) const = default;
  };
  Plans plans{};
};

/// From where light that travels so comes to a viewer: degrees to the right of behind him, and up.
glm::dvec2 origin_deg(glm::dvec3 direction);
/// The other way round.
glm::dvec3 direction_from(glm::dvec2 origin_deg);

/// What a LiveScene is told by those who plan.
struct LivePlanning {
  /// Scenes of load_scenes, which share the world, with what these plans choose.
  std::function<std::vector<Scene>(const Viewing::Plans&, const World&)> scenes_for;
  PlanNotes notes_of;  // what is to be said of a plan
  // What a hologram of the moved world takes, where its light travels otherwise than in a plan
  std::function<double(const Scene&, const World&, const Plan&)> added_s;
};

/// Pictures of one size side by side: levels; as an eye sees them, what they show, and a lens.
struct LivePicture {
  glm::ivec2 size_px{0, 0};
  std::vector<std::uint8_t> rgb;  // sRGB, rows from the top
  double hologram_s = 0;          // 0: nothing had moved
  double picture_s = 0;
  std::map<std::string, double> stages_s;  // of the hologram (RenderResult::seconds), all lasers
  std::string note;                        // on this picture; empty: none
};

class LiveScene {
public:
  /// longest  pixels of the longer side of a picture
  /// throws   InputError for the scene, DeviceError for the device
  LiveScene(const cl::Device& device, cl::FftBackend fft, World world, LivePlanning planning,
            int longest = 640);

  /// As the scene file has it, focused on its middle, or its end where that is the hologram.
  Viewing start() const;

  /// What the plans have to say where objects are now. It takes longer than a hologram.
  const std::vector<std::string>& notes();
  /// Sides of pictures, in every plane.
  glm::dvec2 window_m() const { return window_m_; }
  /// Of the scene as it stands, at least a tenth of its distance.
  double depth_m() const;
  /// The scene of the first laser as it stands, with what its plan chose, as files describe it:
  /// objects that have been moved keep their sizes by their widths.
  Scene scene() const;

  /// What the hologram of the scene in these poses shows, behind an eyepiece through the viewer's
  /// pupil: by the propagation of refined pictures, exact but for what blurs them
  /// (docs/refine.md#propagation), and blurred as the viewer sees it.
  ///
  /// throws  InputError where an object, a light, the focus or plans cannot be so; all stays as it
  ///         was
  LivePicture look(const Viewing& viewing);

private:
  void plan_anew(const Viewing::Plans& plans);
  void move(const Viewing& to);
  void place(const Viewing& to);
  glm::dvec2 part_of(const Viewing& viewing) const;
  Pupil pupil_of(const Viewing& viewing) const;
  std::string note_of(const Viewing& viewing) const;
  void require_time(const std::vector<Scene>& scenes) const;
  void require_focus(const Viewing& viewing) const;
  /// Light in the plane in focus, in pixels of the picture.
  Image picture_of(std::size_t number, const Viewing& viewing);
  std::vector<Image> seen_by_lens(const Viewing& viewing);
  std::vector<Image> in_colours(std::vector<Image> light) const;

  cl::Device device_;
  cl::FftBackend fft_;
  LivePlanning planning_;
  World world_;
  std::optional<Renderer> renderer_;
  std::size_t lasers_ = 1;
  Viewing start_, now_;  // their poses, lights and plans: of the file, and of the renderer
  Rendered shown_;
  std::optional<std::vector<std::string>> notes_;
  FieldStack field_;  // that levels show, the last
  refinement::PhaseStack levels_;
  std::unique_ptr<refinement::Light> light_;
  glm::ivec2 size_px_{1, 1};
  glm::dvec2 window_m_{1, 1};
  double middle_m_ = 0.1;
};

}  // namespace raywave
