// SPDX-License-Identifier: Apache-2.0
/// What planning chooses among: values of the settings that a scene leaves open, each with its
/// predicted time and PSNR. docs/planning.md explains what is tried.
#pragma once

#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "host/forecast/cost.hpp"
#include "host/forecast/picture_model.hpp"
#include "host/geometry/world.hpp"
#include "host/plan/front_view.hpp"
#include "host/plan/plan.hpp"
#include "host/scene/scene.hpp"

namespace raywave {

/// Values tried for sampling.frames and wrp.padding.
inline constexpr std::array frames_tried{1, 2, 3, 4, 6, 8, 12, 16};
inline constexpr std::array paddings_tried{1.0, 1.125, 1.25, 1.5, 2.0};

/// Values tried for sampling.cone and sampling.apodization: all of the wave, nearly all of it, and
/// a cone that lets go of the hologram's edge, whose pictures have the least speckle.
inline constexpr std::array cones_tried{Cone{1.2, 0.2}, Cone{1.2, 0.3}, Cone{1.1, 0.3}};

/// Iterations tried at the pace of frames, towards pictures made of samples, where the scene says
/// nothing of refinement.
inline constexpr std::array paced_tried{2, 4, 8};

/// Whether goals may refine where the scene does not: for phases, unless refine.iterations is 0.
bool may_refine(const Scene& scene);

/// A candidate: values for what the scene leaves open, and what is predicted of them.
struct Choice {
  double pitch_m = 0, padding = 0;
  int frames = 1;
  int layers = 1;                                         // wrp.layers
  WrpPropagation propagation = WrpPropagation::spectrum;  // by virtual planes: no padding, no cone
  Cone cone{};                                            // sampling.cone and sampling.apodization
  int iterations = 0;                                     // refine.iterations; 0: as the scene says
  double seconds = 0, psnr_db = 0;
  double sure_db = 0;  // that pictures have at least, in all likelihood
};

/// All candidates, the coarsest pitch first.
///
/// throws  InputError as make_plan, and when nothing can be predicted (sampling.mode "fan")
std::vector<Choice> choices(const Scene& scene, const World& world, const DeviceFigures& device);

/// The smallest detail of the picture that counts, in metres: the coarsest of what the viewer wants
/// or makes out (1 arc minute) and of what the hologram resolves (wavelength z / width), in the
/// scene's middle.
double wanted_resolution_m(const Scene& scene, const Plan& plan);

/// The detail that an eye at viewer.distance, or at the eyepiece, makes out in the scene's middle:
/// 1 arc minute.
double detail_for_eye_m(const Scene& scene, const Plan& plan);

/// Makes the candidates. Keeps what layers, cone, pitch, padding and frames do not change, so that
/// thousands of candidates take a second.
class Candidates {
public:
  /// The scene's own number of layers and cone.
  Candidates(const Scene& scene, const World& world, const DeviceFigures& device);

  const Plan& plan() const { return plan_; }  // of the scene as it is, in one piece unless it says
  double resolution_m() const { return resolution_m_; }
  const FrontView& view() const { return view_; }
  /// The pictures of a number of layers and a cone that `choices` has tried, or the scene's own;
  /// empty of fans, whose pictures cannot be predicted.
  const std::optional<PictureModel>& model_of(int layers, const Cone& cone) const;

  /// most_cone_error  of the cones that are tried, besides the scene's own
  /// throws           InputError when nothing can be predicted
  std::vector<Choice> choices(double most_cone_error);

private:
  /// A plan without pitch, padding and frames.
  struct Gathering {
    Plan plan;
    Footprints footprints;
  };

  /// A number of layers and a cone, and what is known of them whatever the pitch, the frames and
  /// the padding.
  struct Layout {
    int layers = 1;
    Gathering gathering;
    std::optional<PictureModel> model;                  // of aimed sampling
    std::vector<std::pair<double, double>> paddings{};  // what is tried, and its error
  };

  std::vector<double> pitches() const;
  Layout layout(int layers, const Plan& plan) const {
    return {layers, {plan, footprints_of(plan, view_)}, {}};
  }
  void add(Layout layout);
  void add_layers(double finest_pitch_m, const std::vector<int>& counts);
  void add_cones(double most_error);
  void predict_errors(Layout& layout) const;
  void add_choices(double pitch_m, const std::vector<int>& counts, std::vector<Choice>& all) const;
  void add_paddings(const Choice& without, const Layout& layout, const LatticePattern& pattern,
                    std::vector<Choice>& all) const;
  Work work_of(const Choice& c, const Plan& plan, const Gathering& gathering) const;
  double seconds_of(const Choice& c, const Gathering& gathering) const;

  const Scene& scene_;
  const World& world_;
  const DeviceFigures& device_;
  Plan plan_;
  double resolution_m_;
  FrontView view_;
  std::vector<Layout> layouts_;  // cone by cone, fewest layers first
};

}  // namespace raywave
