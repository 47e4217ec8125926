// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "cl/compile_ahead.hpp"
#include "host/cli/commands.hpp"
#include "host/cli/help.hpp"
#include "host/cli/options.hpp"
#include "host/cli/output_set.hpp"
#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/display/viewer_window.hpp"
#include "host/forecast/presets.hpp"
#include "host/forecast/tuning.hpp"
#include "host/geometry/world.hpp"
#include "host/live/live_scene.hpp"
#include "host/live/steps.hpp"
#include "host/scene/image.hpp"
#include "host/view/colour_picture.hpp"

namespace raywave::cli {
namespace {

struct ViewArguments {
  SceneOptions scene;
  GoalOptions goal;
  DeviceOptions device;
  ReportOptions report;
  std::string record, out;
};

constexpr const char* keys =
    "drag: turn the object; with Shift or the right button: move it. Wheel: focus; with Shift:\n"
    "move the object in depth. Tab: the next object. Arrows: the eye, over the hologram. [ and ]:\n"
    "a smaller and a larger part of the hologram. H: levels beside the picture. L: what a lens\n"
    "sees. P: the next preset. R: levels refined. - and =: exposure. 0: as the scene has it.\n"
    "S: save the picture. Q: end\n";

/// What keys and mouse do.
class Hand {
public:
  Hand(Viewing start, double depth_m, double height_m)
      : viewing(start), start_(std::move(start)), depth_m_(depth_m), height_m_(height_m) {}

  /// Returns whether anything is seen of it.
  bool apply(const UserAction& action) {
    auto& pose = viewing.poses[object];
    if (action.kind == UserAction::Kind::close) {
      ends = true;
    } else if (action.kind == UserAction::Kind::drag && action.is_second) {
      // To the right, as an eye sees it, is -x
      pose.position_m += height_m_ * glm::dvec3(-action.by.x, action.by.y, 0);
    } else if (action.kind == UserAction::Kind::drag) {
      pose.turn(180.0 * glm::dvec3(action.by.y, action.by.x, 0));
    } else if (action.kind == UserAction::Kind::wheel) {
      (action.is_second ? pose.position_m.z : viewing.focus_m) += action.by.y * depth_m_ / 20;
    } else {
      return apply_key(action.key);
    }
    return true;
  }

  Viewing viewing;
  std::size_t object = 0;
  bool ends = false, saves = false;

private:
  bool apply_key(const std::string& key) {
    constexpr double step = 0.1;
    auto& eye = viewing.eye;
    if (key == "q" || key == "escape")
      ends = true;
    else if (key == "s")
      saves = true;
    else if (key == "tab")
      object = (object + 1) % viewing.poses.size();
    else if (key == "h")
      viewing.hologram = !viewing.hologram;
    else if (key == "l")
      viewing.lens = !viewing.lens;
    else if (key == "r")
      viewing.plans.are_refined = !viewing.plans.are_refined;
    else if (key == "p")
      viewing.plans.preset = after(viewing.plans.preset);
    else if (key == "0")
      viewing = start_;
    else if (const glm::dvec2 way((key == "left") - (key == "right"),
                                  (key == "up") - (key == "down"));
             way != glm::dvec2(0)) {
      viewing.part = std::min(viewing.part, 0.5);  // an eye does not see through all of it
      eye += step * way;
    } else if (key == "[" || key == "]")
      viewing.part = std::clamp(viewing.part * (key == "[" ? 0.8 : 1.25), 0.05, 1.0);
    else if (key == "-" || key == "=")
      viewing.stops += key == "-" ? -0.5 : 0.5;
    else
      return false;
    // A part of the hologram stays open
    eye = glm::clamp(eye, glm::dvec2(viewing.part - 1), glm::dvec2(1 - viewing.part));
    return key != "tab" && key != "s";
  }

  /// Those that take a frame's time, and then as it was started.
  static std::optional<Preset> after(std::optional<Preset> preset) {
    if (preset == Preset::accurate) return {};
    return preset ? static_cast<Preset>(static_cast<int>(*preset) + 1) : Preset::draft;
  }

  Viewing start_;
  double depth_m_, height_m_;
};

std::string title_of(const std::string& file, const Hand& hand, const LivePicture& picture,
                     const std::vector<std::string>& notes) {
  const auto& v = hand.viewing;
  const auto eye = in_frame(v.eye, Frame::eye);
  return file + "  focus " + length_text(v.focus_m) + "  object " + std::to_string(hand.object) +
         (v.part < 1 ? format("  part %.2g at (%.1f, %.1f)", v.part, eye.x, eye.y) : "") +
         (v.stops != 0 ? format("  exposure %+.1f", v.stops) : "") +
         (v.plans.preset ? std::string("  ") + name_of(*v.plans.preset) : "") +
         (v.plans.are_refined ? "  refined" : "") +
         (picture.hologram_s > 0 ? format("  hologram %.0f ms", 1e3 * picture.hologram_s) : "") +
         format("  picture %.0f ms", 1e3 * picture.picture_s) +
         (notes.empty() ? "" : "  " + one_line(notes.front()));
}

/// The keys of a scene that put its objects where they were turned to.
void print_poses(const Viewing& viewing) {
  for (std::size_t i = 0; i < viewing.poses.size(); ++i) {
    const auto &at = viewing.poses[i].position_m, &turn = viewing.poses[i].rotation_deg;
    std::printf(
        "--set 'object.%zu.position=[%.9g, %.9g, %.9g]' "
        "--set 'object.%zu.rotation=[%.6g, %.6g, %.6g]'\n",
        i, at.x, at.y, at.z, i, turn.x, turn.y, turn.z);
  }
  std::fflush(stdout);
}

void save(const std::filesystem::path& file, const LivePicture& picture) {
  save_picture(file, picture.size_px.x, picture.size_px.y,
               std::span<const std::uint8_t>(picture.rgb));
}

/// Makes pictures while the window listens: always of what is wanted last.
class Worker {
public:
  explicit Worker(LiveScene& scene) : scene_(scene), thread_([this] { run(); }) {}
  ~Worker() {
    {
      const std::lock_guard lock(mutex_);
      ends_ = true;
    }
    changed_.notify_one();
    thread_.join();
  }

  void want(const Viewing& viewing) {
    {
      const std::lock_guard lock(mutex_);
      wanted_ = viewing;
    }
    changed_.notify_one();
  }
  struct Made {
    Viewing viewing;
    LivePicture picture;
    std::string error;  // in place of a picture
  };
  /// Of the picture that was made last, once nothing else is wanted.
  std::optional<std::vector<std::string>> take_notes() {
    const std::lock_guard lock(mutex_);
    return std::exchange(notes_, {});
  }
  /// Passes on what went wrong beyond what a person can mend by another view.
  std::optional<Made> take() {
    const std::lock_guard lock(mutex_);
    if (failed_) std::rethrow_exception(failed_);
    return std::exchange(made_, {});
  }

private:
  void run() try {
    for (;;) {
      Made made;
      {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] { return ends_ || wanted_; });
        if (ends_) return;
        made.viewing = *std::exchange(wanted_, {});
      }
      try {
        made.picture = scene_.look(made.viewing);
      } catch (const InputError& error) {
        made.error = error.what();
      }
      {
        const std::lock_guard lock(mutex_);
        made_ = std::move(made);
        if (wanted_) continue;
      }
      auto notes = scene_.notes();
      const std::lock_guard lock(mutex_);
      notes_ = std::move(notes);
    }
  } catch (...) {
    const std::lock_guard lock(mutex_);
    failed_ = std::current_exception();
  }

  LiveScene& scene_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<Viewing> wanted_;
  std::optional<Made> made_;
  std::optional<std::vector<std::string>> notes_;
  std::exception_ptr failed_;
  bool ends_ = false;
  std::thread thread_;
};

void show_live(const ViewArguments& options, LiveScene& scene) {
  auto picture = scene.look(scene.start());
  const auto window = viewer_window(picture.size_px);
  Hand hand(scene.start(), scene.depth_m(), scene.window_m().y);
  auto seen = hand.viewing;  // of the last picture
  const auto file = std::filesystem::path(options.scene.file).filename().string();
  auto notes = scene.notes();
  window->draw(picture.size_px, picture.rgb, title_of(file, hand, picture, notes));
  for (const auto& note : notes) options.report.note(note);
  if (options.report.prints_text()) std::fputs(keys, stdout);
  std::fflush(stdout);
  Worker worker(scene);
  int saved = 0;
  while (!hand.ends) {
    bool has_changed = false;
    for (const auto& action : window->wait(0.005)) has_changed |= hand.apply(action);
    if (has_changed) worker.want(hand.viewing);
    if (auto made = worker.take()) {
      if (made->error.empty()) {
        picture = std::move(made->picture);
        seen = std::move(made->viewing);
      } else {
        hand.viewing = seen;
        worker.want(seen);
      }
      window->draw(
          picture.size_px, picture.rgb,
          made->error.empty() ? title_of(file, hand, picture, notes) : one_line(made->error));
    } else if (auto newer = worker.take_notes(); newer && *newer != notes) {
      notes = std::move(*newer);
      window->draw(picture.size_px, picture.rgb, title_of(file, hand, picture, notes));
    }
    if (!std::exchange(hand.saves, false)) continue;
    const auto name =
        std::filesystem::path(options.out) / ("view_" + std::to_string(saved++) + ".png");
    save(name, picture);
    if (!options.report.prints_text()) continue;
    std::printf("%s\n", name.string().c_str());
    print_poses(hand.viewing);
  }
}

void record(const ViewArguments& options, LiveScene& scene) {
  const auto steps = read_steps(options.record, scene.start());
  OutputSet out(options.out);
  auto pictures = Json::array();
  std::set<std::string> said;
  for (const auto& viewing : steps) {
    const auto picture = scene.look(viewing);
    const auto name = format("view_%05zu.png", pictures.size());
    save(out.folder() / name, picture);
    out.add(name);
    for (const auto& note : scene.notes()) {
      auto words = note;  // numbers differ from picture to picture
      std::erase_if(words, [](char c) { return (c >= '0' && c <= '9') || c == '.'; });
      if (said.insert(words).second || pictures.empty()) options.report.note(name + ": " + note);
    }
    pictures.push_back({{"png", name},
                        {"focus_m", viewing.focus_m},
                        {"hologram_s", picture.hologram_s},
                        {"picture_s", picture.picture_s},
                        {"notes", scene.notes()}});
  }
  const auto text = out.finish(Json{{"pictures", std::move(pictures)}}, options.report);
  if (options.report.prints_text()) out.print();
  options.report.write(text);
}

/// The teapot, beside the build or here.
std::string demo_scene() {
  for (const auto& folder : {program_folder() / ".." / "data", std::filesystem::path("data")})
    if (const auto file = folder / "teapot.toml"; std::filesystem::exists(file))
      return file.lexically_normal().string();
  throw InputError("view: give a scene; the demo scene data/teapot.toml is not here");
}

void with_scene(const ViewArguments& options, const std::function<void(LiveScene&)>& use) {
  auto scenes = options.scene.load_all(options.report);
  const cl::Device device(options.device.info());
  auto world = build_world(scenes[0]);
  const auto started = options.goal.goal();
  const auto scenes_for = [&](const Viewing::Plans& plans, const World& placed) {
    auto chosen = scenes;
    constexpr int at_pace_of_frames = 4;
    for (auto& one : chosen)
      if (plans.are_refined) one.refine.emplace().iterations = at_pace_of_frames;
    auto goal = started;
    if (plans.preset) goal = {plans.preset, {}, {}};
    if (!goal.any()) return chosen;
    const auto planned =
        plan_scenes(chosen, placed, figures_of(device.info()), goal, {.field = false});
    for (std::size_t i = 0; i < chosen.size(); ++i) chosen[i] = planned[i].scene;
    return chosen;
  };
  LiveScene scene(device, options.device.backend(device.info()), std::move(world),
                  {scenes_for, [](const Scene& of, const World& where, const Plan& plan) {
                     return render_warnings({}, of, where, plan);
                   }});
  use(scene);
}

void run_view(ViewArguments options) {
  if (options.scene.file.empty()) options.scene.file = demo_scene();
  if (!options.record.empty() && options.out.empty())
    throw InputError("--record needs -o, the folder of its pictures");
  const cl::CompileAhead ahead(
      [&] { with_scene(options, [](LiveScene& scene) { scene.look(scene.start()); }); });
  with_scene(options, [&](LiveScene& scene) {
    if (options.record.empty())
      show_live(options, scene);
    else
      record(options, scene);
  });
}

}  // namespace

void add_view(CLI::App& app) {
  auto* command = add_command(app, section::look, "view",
                              "Turn a scene in a window, and see what its hologram shows",
                              "build/raywave view data/teapot.toml --preset draft");
  auto options = std::make_shared<ViewArguments>();
  options->scene.add_to(*command, "Scene file (TOML); the teapot when not given");
  options->goal.add_to(*command);
  options->device.add_to(*command);
  option(*command, "--record", options->record, "FILE", group::pictures,
         "No window: make the pictures of a script of [[step]]s with object, turn, move, focus, "
         "eye, part, hologram, lens, stops, preset, refined and repeat");
  add_output(*command, options->out, "saved pictures; the folder where it runs when not given");
  options->report.add_to(*command, "the pictures of --record");
  command->callback([options] { run_view(*options); });
}

}  // namespace raywave::cli
