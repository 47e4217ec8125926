// SPDX-License-Identifier: Apache-2.0
#include "host/live/live_scene.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <complex>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <numeric>
#include <span>
#include <utility>

#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/common/threads.hpp"
#include "host/encode/shown.hpp"
#include "host/trace/device_scene.hpp"
#include "host/view/colour_picture.hpp"
#include "host/view/compare.hpp"
#include "host/view/lens.hpp"
#include "host/view/preview.hpp"
#include "host/view/reconstruct.hpp"

namespace raywave {
namespace {

/// Samples of a plane.
struct Grid {
  glm::ivec2 size;
  glm::dvec2 pixel_m, middle_m{0, 0};  // right of the axis and above it
};

double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Objects that turn leave the box that they had.
constexpr double room = 1.2;

RenderOptions options_of(cl::FftBackend fft) {
  RenderOptions options;
  options.fft = fft;
  options.keep_field = false;
  return options;
}

/// Columns, or rows, of a plane that lie in each pixel of a picture around the axis; at least one.
///
/// place  of the plane's first, in pixels of the picture from its first edge
/// step   from one of the plane to the next
std::vector<std::pair<int, int>> within(int pixels, double place, double step, int count) {
  std::vector<std::pair<int, int>> all;
  for (int i = 0; i < pixels; ++i) {
    const int first = static_cast<int>(std::ceil((i - place) / step)),
              end = static_cast<int>(std::ceil((i + 1 - place) / step));
    if (first < end)
      all.push_back({std::clamp(first, 0, count), std::clamp(end, 0, count)});
    else if (first > 0 && first <= count)
      all.push_back({first - 1, first});
    else
      all.push_back({0, 0});
  }
  return all;
}

/// Calls work(0), ..., work(rows - 1), on all threads.
template <class Work>
void for_rows(int rows, const Work& work) {
  auto& threads = cl::Threads::shared();
  threads.for_each(threads.count(), static_cast<std::size_t>(rows), 16,
                   [&](std::size_t, std::size_t row) { work(static_cast<int>(row)); });
}

/// Adds the mean of a plane's brightness over each pixel of a picture around the axis.
///
/// add  adds the brightness of a row's samples, from one column to before another
void add_mean(const Grid& grid, glm::dvec2 window_m, Image& picture,
              const std::function<void(int row, int from, int to, float* sums)>& add) {
  const auto pixel_m = window_m / glm::dvec2(picture.width, picture.height);
  const auto first_m = glm::dvec2(grid.size - 1) / 2.0 * grid.pixel_m;
  const auto columns =
      within(picture.width, (window_m.x / 2 + grid.middle_m.x - first_m.x) / pixel_m.x,
             grid.pixel_m.x / pixel_m.x, grid.size.x);
  const auto rows =
      within(picture.height, (window_m.y / 2 - grid.middle_m.y - first_m.y) / pixel_m.y,
             grid.pixel_m.y / pixel_m.y, grid.size.y);
  int from = grid.size.x, to = 0;
  for (const auto& [left, right] : columns) {
    if (left == right) continue;
    from = std::min(from, left);
    to = std::max(to, right);
  }
  for_rows(picture.height, [&](int y) {
    const auto [top, bottom] = rows[static_cast<std::size_t>(y)];
    std::vector<float> sums(static_cast<std::size_t>(grid.size.x));
    for (int j = top; j < bottom; ++j) add(j, from, to, sums.data());
    for (int x = 0; x < picture.width; ++x) {
      const auto [left, right] = columns[static_cast<std::size_t>(x)];
      const int count = (bottom - top) * (right - left);
      if (count > 0)
        picture.pixels[static_cast<std::size_t>(y) * picture.width + x] +=
            std::accumulate(sums.begin() + left, sums.begin() + right, 0.0f) /
            static_cast<float>(count);
    }
  });
}

/// Pixels of pictures of these sides, the nearest of the original.
Image nearest_of(std::span<const std::uint8_t> levels, glm::ivec2 from, glm::ivec2 to) {
  Image image{to.x, to.y, std::vector<float>(static_cast<std::size_t>(to.x) * to.y)};
  for (int y = 0; y < to.y; ++y)
    for (int x = 0; x < to.x; ++x)
      image.pixels[static_cast<std::size_t>(y) * to.x + x] =
          levels[static_cast<std::size_t>(y * from.y / to.y) * from.x + x * from.x / to.x] / 255.0F;
  return image;
}

}  // namespace

void Viewing::Pose::turn(glm::dvec3 by_deg) {
  const auto r = rotation_xyz(by_deg) * rotation_xyz(rotation_deg);  // columns first
  rotation_deg = glm::degrees(glm::dvec3(std::atan2(r[1][2], r[2][2]),
                                         -std::asin(std::clamp(r[0][2], -1.0, 1.0)),
                                         std::atan2(r[0][1], r[0][0])));
}

glm::dvec2 origin_deg(glm::dvec3 direction) {
  const auto way = glm::normalize(direction);  // to the right, as a viewer sees it, is -x
  return glm::degrees(
      glm::dvec2(std::atan2(way.x, way.z), -std::asin(std::clamp(way.y, -1.0, 1.0))));
}

glm::dvec3 direction_from(glm::dvec2 origin_deg) {
  const auto to = glm::radians(origin_deg);
  return {std::cos(to.y) * std::sin(to.x), -std::sin(to.y), std::cos(to.y) * std::cos(to.x)};
}

LiveScene::LiveScene(const cl::Device& device, cl::FftBackend fft, World world,
                     LivePlanning planning, int longest)
    : device_(device),
      fft_(fft),
      planning_(std::move(planning)),
      world_(std::move(world)),
      levels_(device),
      light_(refinement::Light::make(device, fft)) {
  const auto scenes = planning_.scenes_for({}, world_);
  lasers_ = scenes.size();
  renderer_.emplace(device_, scenes, world_, options_of(fft));
  for (const auto& object : scenes[0].objects)
    start_.poses.push_back({object.position_m, object.rotation_deg});
  start_.lights = scenes[0].lights;
  now_ = start_;
  shown_ = renderer_->render_lasers();
  const auto& plan = shown_.lasers[0].plan;
  const auto& extent = plan.extent;
  // The hologram's own plane has no picture
  std::optional<double> focus_m;
  if (std::abs(extent.near_m + extent.far_m) < 1e-2 * (extent.far_m - extent.near_m))
    focus_m = extent.far_m;
  const auto spec =
      preview_spec(positions_now(world_), plan, focus_m, {}, {0, 0}, scenes[0].viewer);
  middle_m_ = spec.z_m;
  window_m_ = room * spec.window_m.value();
  size_px_ = glm::max(glm::ivec2(glm::round(static_cast<double>(longest) * window_m_ /
                                            std::max(window_m_.x, window_m_.y))),
                      1);
}

const std::vector<std::string>& LiveScene::notes() {
  for (std::size_t i = 0; !notes_ && i < lasers_; ++i)
    for (auto& text : planning_.notes_of(renderer_->scene(i), world_, shown_.lasers[i].plan))
      shown_.lasers[i].notes.push_back(std::move(text));
  if (!notes_) notes_ = notes_of(shown_.lasers);
  return *notes_;
}

Viewing LiveScene::start() const {
  auto viewing = now_;
  viewing.plans = {};
  viewing.focus_m = middle_m_;
  return viewing;
}

double LiveScene::depth_m() const {
  const auto& extent = shown_.lasers[0].plan.extent;
  return std::max(extent.far_m - extent.near_m, std::abs(middle_m_) / 10);
}

Scene LiveScene::scene() const {
  auto scene = renderer_->scene();
  const auto positions_m = positions_now(world_);
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    auto& object = scene.objects[i];
    object.solid_scale.reset();
    if (now_.poses[i] == start_.poses[i]) continue;
    Box box;
    for (const auto& place_m : world_.placed[i].own(positions_m)) box.add(place_m);
    if (object.anchor == Anchor::centre) object.position_m = box.centre_m();
    if (object.width_m) object.width_m = box.size_m().x;
  }
  return scene;
}

void LiveScene::plan_anew(const Viewing::Plans& plans) {
  const auto before = now_;
  move(start_);  // plans are made for the world as it was placed
  try {
    const auto scenes = planning_.scenes_for(plans, world_);
    Renderer planned(device_, scenes, world_, options_of(fft_));
    shown_ = planned.render_lasers();
    renderer_.emplace(std::move(planned));
    now_.plans = plans;
    notes_.reset();
  } catch (...) {
    move(before);
    throw;
  }
}

/// Tells the renderer what differs.
void LiveScene::place(const Viewing& to) {
  for (std::size_t i = 0; i < to.poses.size(); ++i) {
    if (to.poses[i] == now_.poses[i]) continue;
    renderer_->set_solid_pose(i, to.poses[i].position_m, to.poses[i].rotation_deg);
    now_.poses[i] = to.poses[i];
  }
  for (std::size_t i = 0; i < to.lights.size(); ++i) {
    if (to.lights[i] == now_.lights[i]) continue;
    renderer_->set_light(i, to.lights[i]);
    now_.lights[i] = to.lights[i];
  }
}

void LiveScene::move(const Viewing& to) {
  const auto before = now_;
  try {
    place(to);
    if (now_.poses == before.poses && now_.lights == before.lights) return;
    std::vector<Scene> scenes;
    for (std::size_t i = 0; i < lasers_; ++i) scenes.push_back(renderer_->scene(i));
    move_objects(scenes[0], world_);
    require_time(scenes);
    shown_ = renderer_->render_lasers();
    notes_.reset();
  } catch (...) {
    place(before);
    move_objects(renderer_->scene(), world_);
    throw;
  }
}

/// Refuses what nobody waits for.
void LiveScene::require_time(const std::vector<Scene>& scenes) const {
  constexpr double most_s = 10;
  double seconds = 0;
  for (std::size_t i = 0; i < scenes.size(); ++i)
    seconds += planning_.added_s(scenes[i], world_, shown_.lasers[i].plan);
  if (seconds > most_s)
    throw InputError(
        format("not moved: so near the hologram, a picture takes about %.0f s in raywave render",
               seconds));
}

/// Of the hologram, in holograms.
glm::dvec2 LiveScene::part_of(const Viewing& viewing) const {
  const auto& hologram = renderer_->scene().hologram;
  const auto sides_m = glm::dvec2(hologram.resolution) * hologram.pitch_m;
  return glm::min(viewing.pupil_m ? *viewing.pupil_m / sides_m : glm::dvec2(viewing.part), 1.0);
}

Pupil LiveScene::pupil_of(const Viewing& viewing) const {
  auto pupil = pupils_of(renderer_->scene().viewer).front();
  pupil.diameter_m = viewing.pupil_m.value_or(pupil.diameter_m);
  return pupil;
}

/// Light in the plane in focus, by the propagation of refined pictures.
Image LiveScene::picture_of(std::size_t number, const Viewing& viewing) {
  const auto& laser = shown_.lasers[number];
  const auto& hologram = laser.plan.hologram;
  const auto& viewer = renderer_->scene().viewer;
  const auto pixel_m = window_m_ / glm::dvec2(size_px_);
  const double blur_m = eye_blur_m(viewer, viewing.focus_m);
  field_ = shown_field(*laser.panel, laser.levels, std::move(field_));
  levels_.resize({field_.nx, field_.ny}, field_.frames);
  levels_.samples.on_host([&](std::span<std::complex<float>> rows) {
    for_rows(field_.ny * field_.frames, [&](int row) {
      std::copy_n(field_.samples.begin() + std::ptrdiff_t{row} * field_.nx, field_.nx,
                  rows.begin() + std::ptrdiff_t{row} * levels_.pitch());
    });
  });

  refinement::Key key{
      .z_m = viewing.focus_m, .picture = Image{size_px_.x, size_px_.y, {}}, .pixel_m = pixel_m};
  if (viewer.eyepiece_m) {
    key.pupil = pupil_of(viewing);
    key.is_disc = true;
    const auto eyebox_m =
        key.pupil->eyebox_m({hologram.size, hologram.pitch_m, hologram.wavelength_m});
    key.view = 2.0 * key.pupil->centre_m / eyebox_m;
    key.aperture = glm::min(key.pupil->diameter_m / eyebox_m, 1.0);
  } else {
    key.view = viewing.eye;
    key.aperture = part_of(viewing);
  }
  // As many samples of a part's light as of the whole hologram's: fewer would beat with the pixels
  const double part = std::min(key.aperture.x, key.aperture.y);
  refinement::Optics optics{.size = hologram.size,
                            .pitch_m = hologram.pitch_m,
                            .wavelength_m = hologram.wavelength_m,
                            .blur_m = blur_m,
                            .padding = std::min(refine_padding / part, 8.0)};
  if (key.pupil) {
    // Room for light that the pupil's edge spreads, as reconstruct has it; then no blur, for which
    // fewer samples would do
    constexpr double widths = 4;
    optics.blur_m = std::max(
        blur_m, widths * hologram.wavelength_m * std::abs(key.pupil->b_m) / key.pupil->diameter_m);
    optics.pupil_plane = refinement::pupil_plane_size(optics, {&key, 1});
    optics.blur_m = 0;
  }
  const auto propagation = key.pupil
                               ? KeyPropagation::fresnel
                               : key_propagation(optics.size, optics.pitch_m, optics.wavelength_m,
                                                 blur_m, key.z_m, window_m_);
  light_->fit(optics, {refinement::picture_grid(optics, key, propagation)});
  // Intensity over that on the hologram, mean of the frames, as reconstruct has it
  const auto& of = light_->grid(0);
  const auto areas = optics.pitch_m / of.pixel_m;
  const auto unit =
      static_cast<float>(std::pow(light_->unitary(0), 2) * areas.x * areas.y / field_.frames);
  const Grid grid{of.size, of.pixel_m, of.middle_m};
  Image picture{size_px_.x, size_px_.y,
                std::vector<float>(static_cast<std::size_t>(size_px_.x) * size_px_.y)};
  for (int frame = 0; frame < field_.frames; ++frame) {
    light_->enter_pupil(levels_, frame);
    light_->show(levels_, frame, 0);
    light_->plane(0).on_host([&](std::span<const std::complex<float>> plane) {
      add_mean(grid, window_m_, picture, [&](int row, int from, int to, float* sums) {
        const auto* samples = plane.data() + std::ptrdiff_t{row} * grid.size.x;
        for (int i = from; i < to; ++i) {
          const float re = samples[i].real(), im = samples[i].imag();
          sums[i] += unit * (re * re + im * im);
        }
      });
    });
  }
  return blurred(picture, std::min(blur_m / pixel_m.x, most_blur_px));
}

std::vector<Image> LiveScene::seen_by_lens(const Viewing& viewing) {
  const auto& plan = shown_.lasers[0].plan;
  DeviceScene arrays(device_, world_, plan, false);
  LensSpec what{.z_m = viewing.focus_m,
                .window_m = window_m_,
                .view = viewing.eye,
                .aperture = part_of(viewing),
                .points = 8,
                .pixel_m = window_m_ / glm::dvec2(size_px_)};
  if (renderer_->scene().viewer.eyepiece_m) {
    what.pupil = pupil_of(viewing);
    what.view = {0, 0};
    what.aperture = {1, 1};
  }
  std::vector<Image> light;
  for (const auto& laser : shown_.lasers) {
    if (lasers_ > 1) arrays.show(laser.plan);
    light.push_back(lens_picture(device_, laser.plan, arrays, what));
  }
  return in_colours(std::move(light));
}

std::vector<Image> LiveScene::in_colours(std::vector<Image> light) const {
  if (lasers_ == 1) return light;
  const auto colours = picture_of_lasers(renderer_->scene().colour->lasers, light).channels;
  return {colours.begin(), colours.end()};
}

/// Phases alone are even light until it has come farther aside than what is made out.
std::string LiveScene::note_of(const Viewing& viewing) const {
  const auto& hologram = renderer_->scene().hologram;
  const auto& viewer = renderer_->scene().viewer;
  const double detail_m = viewer.resolution_m.value_or(detail_for_eye_m(viewer, viewing.focus_m)),
               steepest =
                   hologram.wavelength_m / (2 * std::min(hologram.pitch_m.x, hologram.pitch_m.y));
  if (shows_amplitude(shown_.lasers[0].plan.slm.encoding) ||
      std::abs(viewing.focus_m) * steepest >= detail_m)
    return {};
  return "focus " + millimetres(viewing.focus_m, 2) + ": nothing is in focus within " +
         millimetres(detail_m / steepest, 2) + " of the hologram, where its light has not met yet";
}

/// Refuses what can only be a slip, as millimetres that are taken for metres.
void LiveScene::require_focus(const Viewing& viewing) const {
  double farthest_m = std::abs(middle_m_) + depth_m();
  for (const auto& pose : viewing.poses)
    farthest_m = std::max(farthest_m, std::abs(pose.position_m.z));
  const double most_m = two_digits(10 * farthest_m);
  if (viewing.focus_m == 0)
    throw InputError("focus 0: the SLM's own plane has no picture; focus before or beyond it");
  if (!(std::abs(viewing.focus_m) <= most_m))
    throw InputError("focus: must be a depth in metres, up to " + number_text(most_m) +
                     ", ten times as far as the scene, whose middle is at " +
                     number_text(middle_m_) + ", got " + number_text(viewing.focus_m));
}

LivePicture LiveScene::look(const Viewing& viewing) {
  LivePicture result;
  require_focus(viewing);
  double start_s = now_s();
  if (viewing.plans != now_.plans || viewing.poses != now_.poses ||
      !(viewing.lights.empty() || viewing.lights == now_.lights)) {
    const auto before = now_;
    if (viewing.plans != now_.plans) plan_anew(viewing.plans);
    try {
      move(viewing);
    } catch (...) {
      if (now_.plans != before.plans) plan_anew(before.plans);
      move(before);
      throw;
    }
    result.hologram_s = now_s() - start_s;
  }
  for (const auto& laser : shown_.lasers)
    for (const auto& [stage, seconds] : laser.seconds) result.stages_s[stage] += seconds;
  result.note = note_of(viewing);
  start_s = now_s();
  std::vector<std::vector<Image>> pictures;
  if (viewing.hologram) {
    const auto& first = shown_.lasers[0];
    pictures.push_back({nearest_of(first.levels[0], first.plan.hologram.size, size_px_)});
  }
  std::vector<Image> light;
  for (std::size_t i = 0; i < lasers_; ++i) {
    light.push_back(picture_of(i, viewing));
    if (lasers_ > 1) {
      const auto& white = renderer_->scene().colour->lasers.white_powers;
      for (auto& pixel : light[i].pixels)
        pixel = static_cast<float>(double{pixel} * shown_.powers[i] / white[i]);
    }
  }
  pictures.push_back(in_colours(std::move(light)));
  if (viewing.lens) pictures.push_back(seen_by_lens(viewing));

  const auto count = static_cast<int>(pictures.size());
  result.size_px = {count * size_px_.x, size_px_.y};
  result.rgb.resize(3 * static_cast<std::size_t>(result.size_px.x) * result.size_px.y);
  for (int number = 0; number < count; ++number) {
    auto& channels = pictures[static_cast<std::size_t>(number)];
    const bool is_levels = viewing.hologram && number == 0;
    if (!is_levels)
      for (auto& one : channels) one = in_frame(std::move(one), Frame::eye);
    const auto bytes =
        expose_to(channels, is_levels ? 1 : white_of(channels, 99.5) * std::exp2(-viewing.stops));
    const std::size_t each = channels.size();
    for_rows(size_px_.y, [&](int y) {
      for (int x = 0; x < size_px_.x; ++x)
        for (std::size_t c = 0; c < 3; ++c)
          result
              .rgb[3 * (static_cast<std::size_t>(y) * result.size_px.x + number * size_px_.x + x) +
                   c] =
              bytes[each * (static_cast<std::size_t>(y) * size_px_.x + x) + (each == 3 ? c : 0)];
    });
  }
  result.picture_s = now_s() - start_s;
  return result;
}

}  // namespace raywave
