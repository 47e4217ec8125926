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
#include "host/forecast/cost.hpp"
#include "host/forecast/presets.hpp"
#include "host/forecast/tuning.hpp"
#include "host/geometry/world.hpp"
#include "host/live/live_scene.hpp"
#include "host/live/steps.hpp"
#include "host/planning/make_plan.hpp"
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
    "a smaller and a larger part of the hologram. H: levels beside the picture. L: what a lens\n"
    "sees. P: the next preset. R: levels refined. - and =: exposure. 0: as the scene has it.\n"
    "S: save the picture. Q: end\n";

/// What keys, mouse and panel do.
class Hand {
public:
  Hand(const LiveScene& live, const Scene& scene)
      : viewing(live.start()),
        start_(viewing),
        depth_m_(live.depth_m()),
        height_m_(live.window_m().y),
        viewer_(scene.viewer) {
    for (std::size_t i = 0; i < scene.objects.size(); ++i)
      names_.push_back(std::to_string(i) + ": " +
                       one_line(scene.objects[i].mesh.filename().string()));
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
    static const std::vector<std::string> presets{"as started", "draft", "balanced", "accurate"};
    std::size_t preset = v.plans.preset ? 1 + static_cast<std::size_t>(*v.plans.preset) : 0;
    if (now(fields.choice("preset", preset, presets)))
      v.plans.preset = preset > 0 ? std::optional(static_cast<Preset>(preset - 1)) : std::nullopt;

    fields.choice("object", object, names_);
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
        look_from(in_frame(eye, Frame::eye));
      if (now(fields.slider("part", v.part, {least_part, 1}, "%.2f"))) look_from(v.eye, 1);
    }
    now(fields.slider("exposure, stops", v.stops, {-8, 8}, "%+.1f"));
    return has_changed;
  }

  Viewing viewing;
  std::size_t object = 0;
  bool ends = false, saves = false, shows_panel = true;

private:
  static constexpr double least_part = 0.05;

  /// Through a part of the hologram that stays open; an eye does not see through all of it.
  void look_from(glm::dvec2 eye, double largest_part = 0.5) {
    auto& part = viewing.part;
    part = std::clamp(part, least_part, largest_part);
    viewing.eye = glm::clamp(eye, glm::dvec2(part - 1), glm::dvec2(1 - part));
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
      look_from(viewing.eye + step * way);
    else if (key == "[" || key == "]") {
      viewing.part *= key == "[" ? 0.8 : 1.25;
      look_from(viewing.eye, 1);
    } else if (key == "-" || key == "=")
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
  std::vector<std::string> names_;  // of the objects
};

/// What a window shows, and what is said of it.
struct Shown {
  LivePicture picture;
  Viewing viewing;
  std::vector<std::string> notes;
  std::string error{};   // of what was wanted since
  double made_s = 0;     // when
  double after_s = 1e9;  // the picture before

  std::string times() const {
    return (picture.hologram_s > 0 ? format("hologram %.0f ms  ", 1e3 * picture.hologram_s) : "") +
           format("picture %.0f ms", 1e3 * picture.picture_s);
  }
};

/// Without a panel it says all.
std::string title_of(const std::string& file, const Hand& hand, const Shown& shown) {
  if (hand.shows_panel) return file;
  if (!shown.error.empty()) return shown.error;
  const auto& v = hand.viewing;
  const auto eye = in_frame(v.eye, Frame::eye);
  return file + "  focus " + length_text(v.focus_m) + "  object " + std::to_string(hand.object) +
         (v.part < 1 ? format("  part %.2g at (%.1f, %.1f)", v.part, eye.x, eye.y) : "") +
         (v.stops != 0 ? format("  exposure %+.1f", v.stops) : "") +
         (v.plans.preset ? std::string("  ") + name_of(*v.plans.preset) : "") +
         (v.plans.are_refined ? "  refined  " : "  ") + shown.times() +
         (shown.notes.empty() ? "" : "  " + one_line(shown.notes.front()));
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

void show_live(const ViewArguments& options, LiveScene& scene, const Scene& file) {
  Hand hand(scene, file);
  Shown shown{scene.look(scene.start()), scene.start(), scene.notes()};
  bool has_changed = false;
  const auto window = viewer_window(shown.picture.size_px, [&](Fields& fields) {
    has_changed |= hand.fill(fields);
    fields.text(shown.times());
    if (shown.after_s < 2) fields.text(format("%.1f pictures/s", 1 / shown.after_s));
    if (!shown.error.empty()) fields.text(shown.error);
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
  int saved = 0;
  while (!hand.ends) {
    for (const auto& action : window->wait(0.005)) has_changed |= hand.apply(action);
    if (std::exchange(has_changed, false)) {
      shown.error.clear();
      worker.want(hand.viewing);
    }
    if (hand.shows_panel != has_panel) {
      has_panel = hand.shows_panel = window->show_panel(hand.shows_panel);
      draw();
    }
    if (auto made = worker.take()) {
      if (made->error.empty()) {
        if (made->picture.hologram_s == 0) made->picture.hologram_s = shown.picture.hologram_s;
        shown.picture = std::move(made->picture);
        shown.viewing = std::move(made->viewing);
        const double time_s = now_s();
        shown.after_s = time_s - std::exchange(shown.made_s, time_s);
      } else {
        shown.error = one_line(made->error);
        hand.viewing = shown.viewing;
        worker.want(shown.viewing);
      }
      draw();
    } else if (auto newer = worker.take_notes(); newer && *newer != shown.notes) {
      shown.notes = std::move(*newer);
      draw();
    }
    if (!std::exchange(hand.saves, false)) continue;
    const auto to =
        std::filesystem::path(options.out) / ("view_" + std::to_string(saved++) + ".png");
    save(to, shown.picture);
    if (!options.report.prints_text()) continue;
    std::printf("%s\n", to.string().c_str());
    print_poses(hand.viewing);
    for (std::size_t i = 0; i < file.objects.size(); ++i)
      if (file.objects[i].width_m &&
          hand.viewing.poses[i].rotation_deg != file.objects[i].rotation_deg)
        options.report.note("object " + std::to_string(i) +
                            ": its width scales the turned mesh; a unit in its place keeps the "
                            "size that is seen here");
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

void with_scene(const ViewArguments& options,
                const std::function<void(LiveScene&, const Scene&)>& use) {
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
                  {scenes_for,
                   [](const Scene& of, const World& where, const Plan& plan) {
                     return render_warnings({}, of, where, plan);
                   },
                   [info = device.info(), rates = figures_of(device.info()).rates](
                       const Scene& of, const World& where, const Plan& before) {
                     const auto plan = make_plan(of, where, Method::wrp, 100, info.fp64, &before);
                     return plan.carrier.index() == before.carrier.index()
                                ? 0
                                : predicted_s(of, where, plan, rates);
                   }});
  use(scene, scenes[0]);
}

void run_view(const ViewArguments& given) {
  auto options = given;
  if (options.scene.file.empty()) options.scene.file = demo_scene();
  if (!options.record.empty() && options.out.empty())
    throw InputError("--record needs -o, the folder of its pictures");
  const cl::CompileAhead ahead([&] {
    with_scene(options, [](LiveScene& scene, const Scene&) { scene.look(scene.start()); });
  });
  with_scene(options, [&](LiveScene& scene, const Scene& file) {
    if (options.record.empty())
      show_live(options, scene, file);
    else
      record(options, scene);
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
         "No window: make the pictures of a script of [[step]]s with object, turn, move, focus, "
         "eye, part, hologram, lens, stops, preset, refined and repeat");
  add_output(*command, options->out, "saved pictures; the folder where it runs when not given");
  options->report.add_to(*command, "the pictures of --record");
}

}  // namespace raywave::cli
