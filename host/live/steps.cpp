// SPDX-License-Identifier: Apache-2.0
#include "host/live/steps.hpp"

#include <cstddef>
#include <string_view>

#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/scene/document.hpp"
#include "host/scene/settings.hpp"
#include "host/view/colour_picture.hpp"

namespace raywave {

std::vector<Step> read_steps(const std::filesystem::path& file, const Viewing& start,
                             bool has_eyepiece) {
  const auto document = parse_document(read_scene_text(file), {});
  Section root(document, document.root, "", "");
  auto viewing = start;
  std::vector<Step> steps;
  const auto last = [](const auto& all) { return static_cast<int>(all.size()) - 1; };
  for (auto& section : root.sections("step")) {
    int object = 0, light = 0, repeat = 1;
    bool saves = false;
    glm::dvec3 turn(0), move(0);
    section.read("object", [&](const Value& v) { object = v.integer(0, last(viewing.poses)); });
    section.read("turn", [&](const Value& v) { turn = v.numbers(between(-1e6, 1e6)); });
    section.read("move", [&](const Value& v) { move = v.lengths_m(between(-1e4, 1e4)); });
    section.read("light", [&](const Value& v) { light = v.integer(0, last(viewing.lights)); });
    keys_of(viewing.lights.at(static_cast<std::size_t>(light)), [&](const Setting& setting) {
      const std::string_view key(setting.key);
      if (key == "direction" || key == "position" || key == "intensity")
        section.read(key, [&](const Value& v) { setting.read(v); });
    });
    section.read("focus", [&](const Value& v) {
      viewing.focus_m = v.length_m(between(-1e4, 1e4));
      if (viewing.focus_m == 0) v.refuse("0 is the SLM's own plane, which has no picture");
    });
    const auto require_bare = [&](const Value& v) {
      if (has_eyepiece)
        v.refuse(
            "says nothing behind an eyepiece, where the viewer's first pupil is looked through");
    };
    section.read("eye", [&](const Value& v) {
      require_bare(v);
      viewing.eye = in_frame(
          v.vector<glm::dvec2>("two numbers [x, y]",
                               [](const Value& one) { return one.number(between(-1, 1)); }),
          Frame::eye);
    });
    bool has_part = false;
    section.read("part", [&](const Value& v) {
      require_bare(v);
      viewing.part = v.number(between(0.01, 1));
      viewing.pupil_m.reset();
      has_part = true;
    });
    section.read("pupil", [&](const Value& v) {
      if (has_part) v.refuse("takes the place of part; give one of them");
      viewing.pupil_m = v.length_m(between(1e-6, 1));
    });
    section.read("hologram", [&](const Value& v) { viewing.hologram = v.boolean(); });
    section.read("lens", [&](const Value& v) { viewing.lens = v.boolean(); });
    section.read("stops", [&](const Value& v) { viewing.stops = v.number(between(-20, 20)); });
    section.read("preset", [&](const Value& v) {
      viewing.plans.preset = v.choice<Preset>({{"draft", Preset::draft},
                                               {"balanced", Preset::balanced},
                                               {"accurate", Preset::accurate},
                                               {"reference", Preset::reference}});
    });
    section.read("refined", [&](const Value& v) { viewing.plans.are_refined = v.boolean(); });
    section.read("save", [&](const Value& v) { saves = v.boolean(); });
    section.read("repeat", [&](const Value& v) { repeat = v.integer(1, 100000); });
    section.finish();
    for (int i = 0; i < repeat; ++i) {
      auto& pose = viewing.poses[static_cast<std::size_t>(object)];
      if (turn != glm::dvec3(0)) pose.turn(turn);  // or it would move by a rounding
      pose.position_m += move;
      steps.push_back({viewing});
    }
    steps.back().saves = saves;
  }
  root.finish();
  if (steps.empty()) throw InputError(one_line(file.string()) + ": has no [[step]]");
  return steps;
}

}  // namespace raywave
