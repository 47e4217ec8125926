// SPDX-License-Identifier: Apache-2.0
#include "host/display/show.hpp"

#include <sys/socket.h>

#include <array>
#include <atomic>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "host/cli/commands.hpp"
#include "host/cli/connection.hpp"
#include "host/cli/frame_sources.hpp"
#include "host/cli/help.hpp"
#include "host/cli/options.hpp"
#include "host/common/error.hpp"
#include "host/common/text.hpp"

namespace raywave::cli {
namespace {

struct ShowArguments {
  std::vector<std::string> what, set;
  DeviceOptions device;
  std::string output, backend, size, events;
  double rate_hz = 0;
  std::uint64_t loops = 0;
  bool list = false, read_back = false;
  ReportOptions report;
};

/// Set by SIGINT and the like while it lives: the screen is left as it was. The next one ends the
/// program.
class StopAtSignals {
public:
  StopAtSignals() {
    struct sigaction stop {};
    stop.sa_handler = [](int) { is_set = true; };
    stop.sa_flags = static_cast<int>(SA_RESETHAND);
    for (std::size_t i = 0; i < signals.size(); ++i) sigaction(signals[i], &stop, &before_[i]);
    struct sigaction ignore {};
    ignore.sa_handler = SIG_IGN;
    sigaction(SIGPIPE, &ignore, &pipe_before_);
  }
  ~StopAtSignals() {
    for (std::size_t i = 0; i < signals.size(); ++i) sigaction(signals[i], &before_[i], nullptr);
    sigaction(SIGPIPE, &pipe_before_, nullptr);
  }
  StopAtSignals(const StopAtSignals&) = delete;
  StopAtSignals& operator=(const StopAtSignals&) = delete;

  static inline std::atomic<bool> is_set{false};

private:
  static constexpr std::array<int, 3> signals{SIGINT, SIGTERM, SIGHUP};
  std::array<struct sigaction, 3> before_{};
  struct sigaction pipe_before_ {};
};

glm::ivec2 size_of(const std::string& text) {
  if (text.empty()) return glm::ivec2(0);
  glm::ivec2 size(0);
  const auto [columns, rows] = two_parts(text, 'x', "--size");
  for (const auto& [part, side] : {std::pair(&columns, &size.x), {&rows, &size.y}}) {
    const auto [end, error] = std::from_chars(part->data(), part->data() + part->size(), *side);
    if (error != std::errc() || end != part->data() + part->size() || *side < 1 || *side > 65536)
      throw InputError("--size " + in_quotes(text) + ": must be pixels, as in 1920x1080");
  }
  return size;
}

/// Where a line for each flip goes; none: nowhere.
std::unique_ptr<Connection> events_of(const std::string& to) {
  if (to.empty()) return {};
  const auto where = "--events " + in_quotes(to);
  if (to.starts_with("udp:")) return std::make_unique<Connection>(to.substr(4), SOCK_DGRAM, where);
  return std::make_unique<Connection>(to, where);
}

void list_outputs(const ShowArguments& options) {
  auto json = Json::array();
  const auto outputs = display_by(options.backend)->list();
  if (outputs.empty()) options.report.note("no output is connected");
  for (const auto& output : outputs) {
    if (options.report.prints_text()) std::printf("%s\n", text_of(output).c_str());
    json.push_back({{"name", output.name},
                    {"place", {output.place_px.x, output.place_px.y}},
                    {"size", {output.size_px.x, output.size_px.y}},
                    {"rate_hz", output.rate_hz},
                    {"edid", output.edid ? Json(output.edid->id()) : Json()}});
  }
  options.report.write(json);
}

/// What is known of the frames' arrival, in words.
std::string proof_text(const Json& proof) {
  const auto count = [&](const char* key) { return proof.value(key, std::uint64_t{0}); };
  std::string text;
  const auto add = [&](std::uint64_t number, const char* what) {
    if (number > 0) text += (text.empty() ? "" : ", ") + std::to_string(number) + " " + what;
  };
  add(count("flip_events"), "flips told by the kernel, with time and number");
  add(count("counted_by_time"), "of them without a number");
  add(count("stray_events"), "events of no flip");
  add(count("swaps_returned"), "swaps returned (not: seen on the output)");
  add(count("read_back"), "drawn frames read back as they were sent");
  return text;
}

Json report_of(const ShownFrames& shown, double rate_hz, Json display) {
  Json latencies;
  for (const auto& [name, share] :
       {std::pair("median", 0.5), {"p95", 0.95}, {"p99", 0.99}, {"longest", 1.0}})
    latencies[name] = shown.latency_s(share);
  return {{"display", std::move(display)}, {"rate_hz", rate_hz},
          {"shown", shown.count.shown},    {"repeated", shown.count.repeated},
          {"missed", shown.count.missed},  {"refreshes", shown.count.refreshes},
          {"seconds", shown.seconds},      {"latency_s", std::move(latencies)}};
}

void print(const Json& report) {
  const auto& display = report.at("display");
  const auto count = [&](const char* key) {
    return std::to_string(report.at(key).get<std::uint64_t>());
  };
  std::printf("%s on %s: %s frames in %s\n", display.at("backend").get<std::string>().c_str(),
              one_line(display.at("output").get<std::string>()).c_str(), count("shown").c_str(),
              duration_text(report.at("seconds").get<double>()).c_str());
  std::printf("refreshes  %s: %s new, %s repeated as the rate wants, %s missed\n",
              count("refreshes").c_str(), count("shown").c_str(), count("repeated").c_str(),
              count("missed").c_str());
  std::string latencies;
  for (const auto& [name, seconds] : report.at("latency_s").items())
    latencies +=
        (latencies.empty() ? "" : ", ") + name + " " + duration_text(seconds.get<double>());
  std::printf("latency    %s\n", latencies.c_str());
  std::printf("proof      %s\n", proof_text(display.at("proof")).c_str());
}

FrameSource source_of(const ShowArguments& options) {
  const auto& file = options.what[0];
  const bool is_scene = options.what.size() == 1 && extension_of(file) == ".toml";
  if (!is_scene && !options.set.empty())
    throw InputError("--set changes keys of a scene, and there is none");
  if (!is_scene) return {options.what, size_of(options.size), StopAtSignals::is_set};
  const auto scenes = load_all(file, options.set, false, options.report);
  if (!scenes[0].animation)
    throw InputError(in_quotes(file) + ": nothing moves: render it, and show what was rendered");
  return {scenes, cl::Device(options.device.info())};
}

/// The start of a line: "hologram_rgb.png, ".
std::string what_is_shown(const FrameSource& source) {
  if (source.first.empty()) return "";
  return one_line(source.first) +
         (source.frames > 1 ? " and " + std::to_string(source.frames - 1) + " more, " : ", ");
}

void run_show(const ShowArguments& options) {
  if (options.list) return list_outputs(options);
  if (options.what.empty()) throw InputError("show: give what is to be shown, or --list");
  if (options.events == "-" && options.report.json == "-")
    throw InputError("--events - and --json both take standard output; give --json FILE");
  const StopAtSignals signals;
  const auto& stop = StopAtSignals::is_set;
  const auto source = source_of(options);
  if (stop) return;
  const auto events = events_of(options.events);
  const auto display = display_by(options.backend);
  const auto output =
      display->open({options.output, source.size_px, source.panel_hz, options.read_back});
  // A picture alone is handed over once a second, so that what is known of it stays new
  const double rate_hz = options.rate_hz > 0  ? options.rate_hz
                         : source.rate_hz > 0 ? source.rate_hz
                         : source.frames == 1 ? std::min(1.0, output.rate_hz)
                                              : output.rate_hz;
  if (options.report.prints_text() && options.events != "-")
    std::printf("%s: %s%.4g frames a second%s\n", text_of(output).c_str(),
                what_is_shown(source).c_str(), rate_hz,
                options.loops == 0 && source.frames > 0 ? ", until Ctrl-C" : "");
  std::fflush(stdout);
  const auto frames = options.loops * source.frames;
  const auto next = [&, count = std::uint64_t{0}]() mutable {
    return frames > 0 && count++ == frames ? nullptr : source.next();
  };
  std::uint64_t number = 0;
  const auto shown =
      show_frames(*display, output.rate_hz, rate_hz, next, stop,
                  [&](const LevelFrame& frame, const Flip& flip, std::uint64_t missed) {
                    if (!events) return;
                    Json line{{"flip", number++}, {"frame", frame.name}};
                    if (!frame.laser.empty()) line["laser"] = frame.laser;
                    line.update(Json{{"refresh", flip.refresh},
                                     {"time_s", flip.time_s},
                                     {"latency_s", flip.time_s - flip.asked_s},
                                     {"missed", missed}});
                    events->send(line.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n");
                  });
  display->close();
  const auto report = report_of(shown, rate_hz, display->describe());
  if (!report.at("display").value("knows_gamma", true))
    options.report.note(
        "the driver does not tell its gamma table: whether it passes levels as "
        "they are is not known");
  if (options.report.prints_text() && options.events != "-") print(report);
  options.report.write(report);
}

}  // namespace

void add_show(CLI::App& app) {
  auto* command = add_command(app, section::look, "show",
                              "Show holograms on an SLM that is an output of this computer",
                              "build/raywave show --list\n"
                              "build/raywave show out --output HDMI-1");
  const auto options = arguments_of(*command, run_show);
  argument(*command, "WHAT", options->what, "FILE",
           "Pictures, a folder, report.json, frames.raw, - for raw levels from standard input, "
           "or a scene that moves, which is computed meanwhile");
  option(*command, "--output", options->output, "NAME", group::pictures,
         "Output by its name, or by maker, product and serial of its EDID, as --list prints them");
  option(*command, "--backend", options->backend, "window|kms", group::pictures,
         "A window over the output, or the kernel's outputs without a desktop; window where there "
         "is a desktop when not given");
  option(*command, "--rate", options->rate_hz, "PER_SECOND", group::pictures,
         "Frames a second; the animation's, else the output's, or 1 of a picture alone, when "
         "not given")
      ->check(CLI::Range(0.01, 1e6));
  option(*command, "--loops", options->loops, "N", group::pictures,
         "Times that all is shown; until Ctrl-C when not given")
      ->check(CLI::Range(1, 1000000000));
  option(*command, "--size", options->size, "NXxNY", group::pictures,
         "Pixels of raw levels, a byte each, e.g. 1920x1080");
  add_set(*command, options->set);
  options->device.add_device_to(*command);
  flag(*command, "--list", options->list, group::pictures, "List outputs, and show nothing");
  flag(*command, "--read-back", options->read_back, group::pictures,
       "Read each frame back as it was drawn; a window's first one always is");
  option(*command, "--events", options->events, "WHERE", group::output,
         "Where a line of JSON for each flip goes: - for standard output, udp:HOST:PORT, or a file "
         "or serial port");
  options->report.add_to(*command, "the report");
}

}  // namespace raywave::cli
