// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
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
#include "host/display/display.hpp"
#include "host/display/side_panel.hpp"
#include "host/display/viewer_window.hpp"
#include "host/forecast/presets.hpp"
#include "host/geometry/world.hpp"
#include "host/live/planning.hpp"
#include "host/live/saved_scene.hpp"
#include "host/live/steps.hpp"
#include "host/scene/image.hpp"
#include "host/view/colour_picture.hpp"

namespace raywave::cli {
namespace {

struct ViewArguments : SceneArguments {
  std::string record, out;
};

constexpr const char* keys =
    "drag: turn the object; with Shift or the right button: move it. Wheel: focus; with Shift:\n"
    "move the object in depth. Tab: the next object. Arrows: the eye, over the hologram. [ and ]:\n"
    "a smaller and a larger pupil. H: levels beside the picture. L: what a lens sees. P: the next\n"
    "preset. R: levels refined. - and =: exposure. 0: as the scene has it. S: save picture and\n"
    "scene. Q: end\n";

/// What the command was given.
struct Given {
  SceneText text;  // of files; what was piped is gone
  std::vector<std::string> set;
  Scene scene;
  Goal goal;
};

/// What keys, mouse and panel do.
class Hand {
public:
  Hand(const LiveScene& live, const Given& given)
      : viewing(live.start()),
        start_(viewing),
        depth_m_(live.depth_m()),
        height_m_(live.window_m().y),
        viewer_(given.scene.viewer),
        sides_m_(glm::dvec2(given.scene.hologram.resolution) * given.scene.hologram.pitch_m) {
    if (const auto& preset = given.goal.preset) presets_[0] += std::string(": ") + name_of(*preset);
    for (const auto& one : given.scene.objects)
      objects_.push_back(std::to_string(objects_.size()) + ": " +
                         one_line(one.mesh.filename().string()));
    for (const auto& light : given.scene.lights)
      lights_.push_back(std::to_string(lights_.size()) + ": " + name_of(light.type));
  }

  double pupil_m() const {
    return viewing.pupil_m.value_or(viewer_.eyepiece_m ? viewer_.pupil_m : largest_part_m());
  }

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

  /// The same by fields.
  bool fill(Fields& fields) {
    bool has_changed = false;
    const auto now = [&](bool is_changed) {
      has_changed |= is_changed;
      return is_changed;
    };
    auto& v = viewing;
    now(fields.check("hologram", v.hologram));
    fields.beside();
    now(fields.check("lens", v.lens));
    fields.beside();
    now(fields.check("refined", v.plans.are_refined));
    if (fields.button("save")) apply_key("s");
    fields.beside();
    now(fields.button("reset") && apply_key("0"));
    std::size_t preset = v.plans.preset ? 1 + static_cast<std::size_t>(*v.plans.preset) : 0;
    if (now(fields.choice("preset", preset, presets_)))
      v.plans.preset = preset > 0 ? std::optional(static_cast<Preset>(preset - 1)) : std::nullopt;

    fields.choice("object", object, objects_);
    auto& pose = v.poses[object];
    auto at_mm = 1e3 * pose.position_m;
    if (now(fields.numbers("position, mm", {&at_mm.x, 3}, 5 * depth_m_, "%.2f")))
      pose.position_m = 1e-3 * at_mm;
    now(fields.numbers("rotation, deg", {&pose.rotation_deg.x, 3}, 0.5, "%.1f"));

    auto focus_mm = 1e3 * v.focus_m;
    const auto range_mm = 1e3 * (start_.focus_m + depth_m_ * glm::dvec2(-2, 2));
    if (now(fields.slider("focus, mm", focus_mm, range_mm, "%.2f"))) v.focus_m = 1e-3 * focus_mm;
    if (viewer_.eyepiece_m) {
      auto dioptres = dioptres_of_depth(viewer_, v.focus_m);
      const double least = 1e-3 - 1 / *viewer_.eyepiece_m;  // below, it shows no plane
      if (now(fields.numbers("focus, D", {&dioptres, 1}, 0.01, "%.2f")))
        v.focus_m = depth_of_dioptres(viewer_, std::max(dioptres, least));
    } else {
      auto eye = in_frame(v.eye, Frame::eye) + 0.0;  // no "-0.00"
      if (now(fields.numbers("eye", {&eye.x, 2}, 0.01, "%.2f")))
        move_eye(in_frame(eye, Frame::eye));
    }
    auto pupil_mm = 1e3 * pupil_m();
    if (now(fields.slider("pupil, mm", pupil_mm, 1e3 * pupils_m(), "%.2f")))
      look_through(1e-3 * pupil_mm);
    now(fields.slider("exposure, stops", v.stops, {-8, 8}, "%+.1f"));

    fields.choice("light", light_, lights_);
    auto& light = v.lights[light_];
    const bool is_spot = light.type == LightType::spot;
    if (light.type == LightType::directional || is_spot) {
      auto from_deg = origin_deg(light.direction) + 0.0;
      if (now(fields.numbers("from right, up", {&from_deg.x, 2}, 0.5, "%.1f")))
        light.direction = direction_from({from_deg.x, std::clamp(from_deg.y, -90.0, 90.0)});
    }
    if (light.type == LightType::point || light.type == LightType::area || is_spot) {
      auto light_mm = 1e3 * light.position_m;
      if (now(fields.numbers("at, mm", {&light_mm.x, 3}, 5 * depth_m_, "%.2f")))
        light.position_m = 1e-3 * light_mm;
    }
    if (now(fields.numbers("intensity", {&light.intensity, 1}, 0.01, "%.2f")))
      light.intensity = std::max(0.0, light.intensity);
    return has_changed;
  }

  Viewing viewing;
  std::size_t object = 0;
  bool ends = false, saves = false, shows_panel = true;

private:
  double largest_part_m() const { return std::max(sides_m_.x, sides_m_.y); }
  /// The least and the largest.
  glm::dvec2 pupils_m() const {
    return viewer_.eyepiece_m ? glm::dvec2(0.5e-3, 1e-2) : largest_part_m() * glm::dvec2(0.05, 1);
  }

  void look_through(double pupil_m) {
    const auto range_m = pupils_m();
    viewing.pupil_m = std::clamp(pupil_m, range_m.x, range_m.y);
    const auto room = glm::max(1.0 - *viewing.pupil_m / sides_m_, 0.0);
    if (!viewer_.eyepiece_m) viewing.eye = glm::clamp(viewing.eye, -room, room);
  }

  /// An eye sees through half of the hologram at most.
  void move_eye(glm::dvec2 to) {
    if (viewer_.eyepiece_m) return;
    viewing.eye = to;
    look_through(std::min(pupil_m(), std::min(sides_m_.x, sides_m_.y) / 2));
  }

  bool apply_key(const std::string& key) {
    constexpr double step = 0.1;
    if (key == "q" || key == "escape")
      ends = true;
    else if (key == "s")
      saves = true;
    else if (key == "m")
      shows_panel = !shows_panel;
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
             way != glm::dvec2(0))
      move_eye(viewing.eye + step * way);
    else if (key == "[" || key == "]")
      look_through((key == "[" ? 0.8 : 1.25) * pupil_m());
    else if (key == "-" || key == "=")
      viewing.stops += key == "-" ? -0.5 : 0.5;
    else
      return false;
    return key != "tab" && key != "s" && key != "m";
  }

  /// Those that take a frame's time, and then as it was started.
  static std::optional<Preset> after(std::optional<Preset> preset) {
    if (preset == Preset::accurate) return {};
    return preset ? static_cast<Preset>(static_cast<int>(*preset) + 1) : Preset::draft;
  }

  Viewing start_;
  double depth_m_, height_m_;
  ViewerSpec viewer_;
  glm::dvec2 sides_m_;  // of the hologram
  std::vector<std::string> presets_{"as started", "draft", "balanced", "accurate"}, objects_,
      lights_;
  std::size_t light_ = 0;
};

/// What a window shows, and what is said of it.
struct Shown {
  LivePicture picture;
  Viewing viewing;
  std::vector<std::string> notes;
  std::string message{};  // on what was wanted or saved since
  double made_s = 0;      // when
  double after_s = 1e9;   // the picture before

  std::string times() const {
    return (picture.hologram_s > 0 ? format("hologram %.0f ms  ", 1e3 * picture.hologram_s) : "") +
           format("picture %.0f ms", 1e3 * picture.picture_s);
  }
  /// Of the last hologram.
  std::string stages() const {
    std::string text;
    for (const char* stage : {"meshes", "plan", "tree", "prepare", "kernels", "samples", "trace",
                              "propagate", "refine", "encode"})
      if (const auto found = picture.stages_s.find(stage);
          found != picture.stages_s.end() && found->second >= least_s)
        text += format("%s%s %.0f", text.empty() ? "" : ", ", stage, 1e3 * found->second);
    return text.empty() ? text : text + " ms";
  }
  static constexpr double least_s = 0.5e-3;
};

/// Without a panel it says all.
std::string title_of(const std::string& file, const Hand& hand, const Shown& shown) {
  if (hand.shows_panel) return file;
  if (!shown.message.empty()) return shown.message;
  const auto& v = hand.viewing;
  const auto eye = in_frame(v.eye, Frame::eye) + 0.0;
  return file + "  focus " + length_text(v.focus_m) + "  object " + std::to_string(hand.object) +
         (v.pupil_m ? format("  pupil %.1f mm at (%.1f, %.1f)", 1e3 * *v.pupil_m, eye.x, eye.y)
                    : "") +
         (v.stops != 0 ? format("  exposure %+.1f", v.stops) : "") +
         (v.plans.preset ? std::string("  ") + name_of(*v.plans.preset) : "") +
         (v.plans.are_refined ? "  refined  " : "  ") + shown.times() +
         (shown.notes.empty() ? "" : "  " + one_line(shown.notes.front()));
}

void save(const std::filesystem::path& file, const LivePicture& picture) {
  save_picture(file, picture.size_px.x, picture.size_px.y,
               std::span<const std::uint8_t>(picture.rgb));
}

/// Saves the scene as it stands. Returns what it has of other keys than the file.
std::vector<std::string> save(const std::filesystem::path& file, const LiveScene& live,
                              const Given& given) {
  if (given.text.toml.empty())
    throw InputError("only scenes of files can be saved, and " +
                     one_line(given.scene.file.string()) + " is none");
  const auto changes = overrides_between(given.scene, live.scene());
  auto all = given.set;
  all.insert(all.end(), changes.begin(), changes.end());
  save_scene(file, given.text, all);
  return changes;
}

/// The first of view_0, view_1 ... that neither a picture nor a scene has.
std::filesystem::path free_name(const std::filesystem::path& folder, const std::string& stem) {
  for (int i = 0;; ++i) {
    const auto name = folder / (stem + "_" + std::to_string(i));
    if (!std::filesystem::exists(name.string() + ".png") &&
        !std::filesystem::exists(name.string() + ".toml"))
      return name;
  }
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
  /// While it lives, the scene stands still, as it was seen last.
  std::unique_lock<std::mutex> pause() { return std::unique_lock(of_scene_); }
  /// Of the picture that was made last, once nothing else is wanted.
  std::optional<std::vector<std::string>> take_notes() {
    const std::lock_guard lock(mutex_);
    return std::exchange(notes_, {});
  }
  /// Passes on what went wrong beyond what a person can mend by another view.
  std::optional<Made> take() {
    const std::lock_guard lock(mutex_);
    if (failed_) std::rethrow_exception(failed_);
    return std::exchange(made_, std::nullopt);
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
      const std::lock_guard busy(of_scene_);
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
  std::mutex of_scene_, mutex_;  // the first one first
  std::condition_variable changed_;
  std::optional<Viewing> wanted_;
  std::optional<Made> made_;
  std::optional<std::vector<std::string>> notes_;
  std::exception_ptr failed_;
  bool ends_ = false;
  std::thread thread_;
};

void show_live(const ViewArguments& options, LiveScene& scene, const Given& given) {
  Hand hand(scene, given);
  Shown shown{scene.look(scene.start()), scene.start(), scene.notes()};
  bool has_changed = false;
  const auto window = viewer_window(shown.picture.size_px, [&](Fields& fields) {
    has_changed |= hand.fill(fields);
    fields.text(shown.times());
    fields.text(shown.stages());
    if (shown.after_s < 2) fields.text(format("%.1f pictures/s", 1 / shown.after_s));
    for (const auto* text : {&shown.message, &shown.picture.note})
      if (!text->empty()) fields.text(*text);
    for (const auto& note : shown.notes) fields.text(note);
  });
  const auto name = std::filesystem::path(options.scene.file).filename().string();
  const auto draw = [&] {
    window->draw(shown.picture.size_px, shown.picture.rgb, title_of(name, hand, shown));
  };
  bool has_panel = hand.shows_panel = window->show_panel(true);
  draw();
  for (const auto& note : shown.notes) options.report.note(note);
  if (options.report.prints_text()) {
    std::fputs(keys, stdout);
    if (has_panel) std::fputs("M: without the panel, and with it\n", stdout);
  }
  std::fflush(stdout);
  Worker worker(scene);
  while (!hand.ends) {
    for (const auto& action : window->wait(0.005)) has_changed |= hand.apply(action);
    if (std::exchange(has_changed, false)) {
      shown.message.clear();
      worker.want(hand.viewing);
    }
    if (hand.shows_panel != has_panel) {
      has_panel = hand.shows_panel = window->show_panel(hand.shows_panel);
      draw();
    }
    const auto still = hand.saves ? worker.pause() : std::unique_lock<std::mutex>();
    if (auto made = worker.take()) {
      if (made->error.empty()) {
        if (made->picture.hologram_s == 0) made->picture.hologram_s = shown.picture.hologram_s;
        shown.picture = std::move(made->picture);
        shown.viewing = std::move(made->viewing);
        const double time_s = now_s();
        shown.after_s = time_s - std::exchange(shown.made_s, time_s);
      } else {
        shown.message = one_line(made->error);
        hand.viewing = shown.viewing;
        worker.want(shown.viewing);
      }
      draw();
    } else if (auto newer = worker.take_notes(); newer && *newer != shown.notes) {
      shown.notes = std::move(*newer);
      draw();
    }
    if (!std::exchange(hand.saves, false)) continue;
    try {
      const auto to = free_name(options.out, "view").string();
      save(to + ".png", shown.picture);
      options.report.print(to + ".png\n");
      const auto changes = save(to + ".toml", scene, given);
      options.report.print(to + ".toml\n");
      for (const auto& change : changes) options.report.print("--set " + shell_word(change) + "\n");
      shown.message = "saved " + to + ".png and .toml";
    } catch (const InputError& error) {
      shown.message = one_line(error.what());
      options.report.note(shown.message);
    }
    draw();
  }
}

void record(const ViewArguments& options, LiveScene& scene, const Given& given) {
  const auto steps =
      read_steps(options.record, scene.start(), scene.scene().viewer.eyepiece_m.has_value());
  OutputSet out(options.out);
  auto pictures = Json::array();
  std::set<std::string> said;
  for (const auto& step : steps) {
    const auto picture = scene.look(step);
    const auto name = format("view_%05zu.png", pictures.size());
    save(out.folder() / name, picture);
    out.add(name);
    if (step.saves) {
      const auto of_scene = name.substr(0, name.find('.')) + ".toml";
      save(out.folder() / of_scene, scene, given);
      out.add(of_scene);
    }
    auto notes = scene.notes();
    if (!picture.note.empty()) notes.push_back(picture.note);
    for (const auto& note : notes) {
      auto words = note;  // numbers differ from picture to picture
      std::erase_if(words, [](char c) { return (c >= '0' && c <= '9') || c == '.'; });
      if (said.insert(words).second || pictures.empty()) options.report.note(name + ": " + note);
    }
    pictures.push_back({{"png", name},
                        {"focus_m", step.focus_m},
                        {"hologram_s", picture.hologram_s},
                        {"stages_s", picture.stages_s},
                        {"picture_s", picture.picture_s},
                        {"notes", std::move(notes)}});
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

void with_scene(const ViewArguments& options,
                const std::function<void(LiveScene&, const Given&)>& use) {
  auto scenes = options.scene.load_all(options.report);
  Given given{{}, options.scene.set, scenes[0], options.goal.goal()};
  if (std::filesystem::is_regular_file(options.scene.file))
    given.text = read_scene_text(options.scene.file);
  const cl::Device device(options.device.info());
  auto world = build_world(scenes[0]);
  LiveScene scene(device, options.device.backend(device.info()), std::move(world),
                  planning_of(std::move(scenes), given.goal, device.info()));
  use(scene, given);
}

void run_view(const ViewArguments& given) {
  auto options = given;
  if (options.scene.file.empty()) options.scene.file = demo_scene();
  if (!options.record.empty() && options.out.empty())
    throw InputError("--record needs -o, the folder of its pictures");
  const cl::CompileAhead ahead([&] {
    with_scene(options, [](LiveScene& scene, const Given&) { scene.look(scene.start()); });
  });
  with_scene(options, [&](LiveScene& scene, const Given& loaded) {
    if (options.record.empty())
      show_live(options, scene, loaded);
    else
      record(options, scene, loaded);
  });
}

}  // namespace

void add_view(CLI::App& app) {
  auto* command = add_command(app, section::look, "view",
                              "Turn a scene in a window, and see what its hologram shows",
                              "build/raywave view data/teapot.toml --preset draft");
  const auto options = arguments_of(*command, run_view);
  options->scene.add_to(*command, "Scene file (TOML); the teapot when not given");
  options->goal.add_to(*command);
  options->device.add_to(*command);
  option(*command, "--record", options->record, "FILE", group::pictures,
         "No window: make the pictures of a script of [[step]]s with object, turn, move, light, "
         "direction, position, intensity, focus, eye, part, pupil, hologram, lens, stops, preset, "
         "refined, save and repeat");
  add_output(*command, options->out, "saved pictures; the folder where it runs when not given");
  options->report.add_to(*command, "the pictures of --record");
}

}  // namespace raywave::cli
