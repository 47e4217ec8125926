// SPDX-License-Identifier: Apache-2.0
/// The holograms of a scene that moves (docs/animation.md).
#pragma once

#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cl/device.hpp"
#include "cl/fft.hpp"
#include "host/animate/frame_files.hpp"
#include "host/animate/timeline.hpp"
#include "host/common/json.hpp"
#include "host/geometry/world.hpp"
#include "host/plan/plan.hpp"
#include "host/render.hpp"
#include "host/scene/scene.hpp"

namespace raywave {

/// How far a run came.
struct AnimateResult {
  int pictures = 0, holograms = 0;  // made by this run
  double seconds = 0;               // of all but the first picture, until the last is written
  int timed_holograms = 0;          // of these pictures
  // RenderResult's, of all but each device's first picture: with what was written meanwhile, of
  // pictures before them
  std::map<std::string, double> processor_seconds;
  std::vector<std::string> notes;        // of all pictures, each once
  std::map<std::string, int> by_device;  // pictures, of several devices
};

/// A picture of an animation.
struct AnimatedPicture {
  // Of its holograms; the lasers of one lie side by side
  std::vector<std::vector<std::uint8_t>> levels;
  std::vector<double> powers;   // radiant, of several lasers; those of white have the sum 1
  nlohmann::ordered_json line;  // of report.jsonl
  std::vector<std::string> notes;
  std::map<std::string, double> processor_seconds;  // RenderResult's, of all lasers
};

/// An animation that is planned. A picture depends on nothing but the scene and its number: a run
/// that goes on where another one was stopped makes the same files.
class Animator {
public:
  /// Reads meshes and textures, and plans over all pictures.
  ///
  /// scene   with an animation
  /// throws  InputError for the scene, naming the picture where it lies in one
  Animator(const cl::Device& device, Scene scene, cl::FftBackend fft);
  /// The same in colour: a hologram of each laser wherever there is one of one wavelength.
  ///
  /// scenes  of load_scenes
  /// folder  of programs that each make a part, and there find and leave what all of them need
  ///         (FrameFiles::shared_name); empty: none
  /// waves   RenderOptions::waves_device
  Animator(const cl::Device& device, std::vector<Scene> scenes, cl::FftBackend fft,
           std::filesystem::path folder = {}, const std::optional<cl::DeviceInfo>& waves = {});

  /// Of the first picture.
  const Plan& plan(std::size_t laser = 0) const { return *lasers_.at(laser).plan; }
  std::size_t lasers() const { return lasers_.size(); }
  /// In the names of their files; empty of one wavelength.
  std::vector<std::string> laser_names() const;
  /// Their colours; empty of one wavelength.
  std::optional<LaserSet> colours() const;
  /// What `of_plan` says of the first picture, of all lasers.
  std::vector<std::string> notes(const PlanNotes& of_plan) const;
  /// The first of the pictures that come nearest to the eye, and how near.
  std::pair<int, double> nearest() const { return nearest_; }
  const Schedule& schedule() const { return schedule_; }
  /// Of a picture, depth and window filled in.
  Camera camera(int picture) const;
  /// That preview.mp4 looks through, behind an eyepiece.
  std::optional<Pupil> pupil() const;
  const ViewerSpec& viewer() const { return scene().viewer; }
  /// Of a hologram as it is stored: turned as the SLM wants it.
  glm::ivec2 stored_size() const;
  /// Holograms of a picture turned so.
  void turn(std::vector<std::vector<std::uint8_t>>& levels) const;
  /// What holograms depend on, in 32 digits: scene, contents of its files, the plan over all
  /// pictures, device, version, storage.
  std::string run_name(FrameStorage storage) const;

  /// Makes the pictures that `files` lacks. While one is computed, those before it are written.
  ///
  /// progress  called for each picture
  /// throws    InputError when a file cannot be written, DeviceError for the device
  AnimateResult make_frames(FrameFiles& files, const Progress& progress) const;

  /// Computes the first picture, for what that compiles.
  void make_first() const { renderer({}).render_lasers(); }

  class Pictures;

private:
  /// Of the brightest of Schedule::pictures_that_scale; 0: not needed.
  struct Scale {
    double clip = 0;   // RenderResult::clip
    double power = 0;  // of all lasers, where phases alone leave the brightness to them
  };
  /// What each program that makes a part would else compute.
  struct Shared {
    std::vector<std::vector<int>> poses;
    glm::dvec2 reach_m;
    Scale scale;
  };

  struct Laser {
    Scene scene;  // at rest, with frames for the picture that has most holograms
    std::shared_ptr<const Plan> base, plan;  // of all pictures; of the first one
  };
  /// Of the first laser, from which the others differ in the laser alone.
  const Scene& scene() const { return lasers_.front().scene; }
  /// poses  that the plan has to serve; receives those that it needs
  void plan_laser(Laser& laser, std::vector<int>& poses);
  /// Digest of what plans and brightness depend on.
  std::string shared_by() const;
  /// What shared.json holds, where it is of the same animation.
  std::optional<Shared> read_shared() const;
  void share(const Scale& scale) const;
  /// Where the lasers have to show how bright a picture is.
  bool lasers_dim(const Laser& laser) const;
  /// Of both devices where there are two.
  MemoryLimits limits() const;
  /// Of all lasers.
  Renderer renderer(const Progress& progress) const;
  /// Moves a renderer to a picture, which `scene` describes.
  void show(const Scene& scene, int picture, Renderer& renderer) const;
  Scale brightest(Renderer& renderer) const;
  /// Radiant power of a laser that a picture needs; those of white have the sum 1.
  double power_of(const Laser& laser, const RenderResult& result, int picture) const;
  Json line_of(int picture, const Scene& scene, const RenderResult& result) const;

  cl::Device device_;
  std::optional<cl::Device> waves_;
  std::vector<Laser> lasers_;  // one of one wavelength
  cl::FftBackend fft_;
  Schedule schedule_;
  std::filesystem::path folder_;
  std::string depends_on_;  // what holograms depend on, but for the plan and how they are stored
  std::optional<Shared> shared_;
  std::vector<std::vector<int>> poses_;  // that each laser's plan needs
  glm::dvec2 reach_m_{0};  // largest distances of all objects, in all pictures, from the axis
  std::pair<int, double> nearest_{0, INFINITY};
  World world_;  // with all objects where the first picture has them
};

/// Makes the pictures that `files` lacks. While one is computed, those before it are written.
///
/// begin  called where one is missing; returns what makes a picture
/// turn   brings its holograms to how they are stored
AnimateResult make_missing(FrameFiles& files,
                           const std::function<std::function<AnimatedPicture(int)>()>& begin,
                           const std::function<void(std::vector<std::vector<std::uint8_t>>&)>& turn,
                           const Progress& progress);

/// What every hologram of some scenes depends on, but for their plans.
std::string given_of(const cl::Device& device, cl::FftBackend fft,
                     const std::vector<const Scene*>& scenes, const World& world);

/// Digest of all that a scene's files have given: meshes with their materials and pictures, lights,
/// textures, the SLM's LUT and flatness. Names of files are no part of it.
///
/// world  of the scene, wherever its objects have moved
std::string digest_of_contents(const Scene& scene, const World& world);

/// Makes the pictures of an animation, in any order.
class Animator::Pictures {
public:
  /// Renders the pictures that set the brightness of all.
  ///
  /// animator  that outlives it
  /// progress  called at every step of a picture
  explicit Pictures(const Animator& animator, const Progress& progress = {});
  AnimatedPicture make(int picture);
  const Scale& scale() const { return scale_; }

private:
  const Animator& of_;
  Renderer renderer_;
  Scale scale_;
};

}  // namespace raywave
