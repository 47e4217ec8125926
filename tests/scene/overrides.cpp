// SPDX-License-Identifier: Apache-2.0
/// What command lines give: values of scenes, lengths, times.
#include "host/common/text.hpp"
#include "host/scene/units.hpp"
#include "tests/scene/workshop.hpp"

using namespace raywave;
using namespace raywave::test;
using Catch::Matchers::StartsWith;
using Catch::Matchers::WithinRel;

namespace {

/// Overrides of kScene, and what is said of them after "--set OVERRIDE: ".
void check_overrides(std::initializer_list<std::pair<std::string, std::string>> overrides) {
  const Workshop workshop;
  for (const auto& [text, message] : overrides)
    CHECK(workshop.refusal(kScene, {text}) == "--set " + one_line(text) + ": " + message);
}

}  // namespace

TEST_CASE("WRPs have as many distances as the file gives, or as many layers as it asks for") {
  const Workshop workshop;
  const auto both = workshop.load(kScene, {"wrp.distance=['75 mm', 0.125]"});
  REQUIRE(both.wrp.distances_m.size() == 2);
  CHECK_THAT(both.wrp.distances_m[0], WithinRel(0.075, 1e-15));
  CHECK(both.wrp.distances_m[1] == 0.125);
  CHECK(both.wrp.layers == 2);
  CHECK(workshop.load(kScene, {"wrp.distance=['75 mm', 0.125]", "wrp.layers=2"}).wrp.layers == 2);
  const auto planned = workshop.load(kScene, {"wrp.distance=auto", "wrp.layers=3"});
  CHECK(planned.wrp.distances_m.empty());
  CHECK(planned.wrp.layers == 3);
  CHECK(planned.given.contains("wrp.layers"));
  CHECK_FALSE(workshop.load(kScene, {"wrp.layers=auto"}).given.contains("wrp.layers"));
  CHECK_THROWS_WITH(
      workshop.load(kScene, {"wrp.distance=['75 mm', 0.125]", "wrp.layers=3"}),
      "--set wrp.layers=3: wrp: layers must be the number of distances given, 2, got 3");
}

TEST_CASE("overrides take TOML values and bare strings, and the last one wins") {
  const Workshop workshop;
  const Scene scene = workshop.load(
      kScene,
      {"wrp.padding=1.25", "hologram.pitch=8 um", "hologram.resolution=[64, 32]", "wrp.grid=auto",
       "wrp.distance=\"20 cm\"", "sampling.frames=2", "sampling.frames=3", "trace.shadows=false",
       "materials.gold.shininess=40", "materials.china.diffuse=[1, 0, 0]", "object.1.width=9 mm",
       "object.1.material=gold", "light.0.direction=[0, 0, 2]"});
  CHECK(scene.wrp.padding == 1.25);
  CHECK_THAT(scene.hologram.pitch_m.y, WithinRel(8e-6, 1e-15));
  CHECK(scene.hologram.resolution == glm::ivec2(64, 32));
  CHECK_FALSE(scene.wrp.grid.has_value());
  REQUIRE(scene.wrp.distances_m.size() == 1);
  CHECK_THAT(scene.wrp.distances_m[0], WithinRel(0.2, 1e-15));
  CHECK(scene.sampling.frames == 3);
  CHECK_FALSE(scene.trace.shadows);
  CHECK(scene.materials[2].shininess == 40);
  CHECK(scene.materials[1].diffuse == glm::dvec3(1, 0, 0));
  CHECK_THAT(scene.objects[1].width_m.value(), WithinRel(0.009, 1e-15));
  CHECK(scene.objects[1].material == 2);
  CHECK_THAT(scene.objects[0].width_m.value(), WithinRel(0.0125, 1e-15));
  CHECK(scene.lights[0].direction == glm::dvec3(0, 0, 2));
}

TEST_CASE("an override reaches a section that the file lacks") {
  const Workshop workshop;
  CHECK(workshop
            .load("light = [{type = \"ambient\"}]\nobject = [{mesh = \"teapot.ply\"}]\n",
                  {"trace.depth=5"})
            .trace.depth == 5);
}

TEST_CASE(
    "precision is chosen by itself unless it is named, and phase errors are fractions of a turn") {
  const Workshop workshop;
  const auto accuracy = [&](std::vector<std::string> settings) {
    return workshop.load(kScene, std::move(settings)).accuracy;
  };
  CHECK_FALSE(accuracy({}).precision.has_value());
  CHECK(accuracy({}).phase_turns == 0.01);
  CHECK_FALSE(accuracy({"accuracy.precision=auto"}).precision.has_value());
  CHECK(accuracy({"accuracy.precision=float"}).precision == Precision::floats);
  CHECK(accuracy({"accuracy.precision=double", "accuracy.phase=1e-4"}).precision ==
        Precision::doubles);
  CHECK(accuracy({"accuracy.phase=1e-4"}).phase_turns == 1e-4);
  check_overrides({
      {"accuracy.precision=half",
       "accuracy: precision must be \"auto\" or \"float\" or \"double\", got \"half\""},
      {"accuracy.phase=0", "accuracy: phase must be 1e-09 to 0.5, got 0"},
      {"accuracy.phase=nan", "accuracy: phase must be 1e-09 to 0.5, got nan"},
      {"accuracy.phases=1",
       "accuracy: unknown key \"phases\"; did you mean \"phase\"? (keys here: precision, phase)"},
  });
}

TEST_CASE("bare numbers that are absurd as metres get a note, others none") {
  const Workshop workshop;
  const auto notes_of = [&](const std::vector<std::string>& set) {
    return workshop.load(kScene, set).notes;
  };
  CHECK(notes_of({"object.0.position=[0, 0, 100]"}) ==
        std::vector<std::string>{
            "--set object.0.position=[0, 0, 100]: object 0: position[2]: lengths without a unit "
            "are metres; give \"100 mm\" if 100 m is not meant"});
  // A hundred times the hologram's 10.24 mm
  CHECK(notes_of({"object.0.width=1.24"}) ==
        std::vector<std::string>{"--set object.0.width=1.24: object 0: width: lengths without a "
                                 "unit are metres; give \"1.24 mm\" if 1.24 m is not meant"});
  CHECK_SAYS(notes_of({"object.0.position=[0, 0, \"400\"]"}).at(0), "give \"400 mm\" if 400 m");
  CHECK_SAYS(workshop.refusal(kScene, {"hologram.wavelength=\"532\""}),
             "must be 1 nm to 10 mm (numbers are metres; \"532 nm\" has a unit of its own)");
  CHECK_SAYS(workshop.refusal(kScene, {"hologram.pitch=8"}), "metres; \"8 um\" has");
  for (const char* sensible :
       {"object.0.width=1.0", "object.0.width=1.24 m", "object.0.position=[0, 0, 1.9]",
        "object.0.position=[0, 0, \"100 m\"]"})
    CHECK(notes_of({sensible}).empty());
}

TEST_CASE("what is wrong within a mesh or texture names the override that gave the file") {
  const Workshop workshop;
  const auto scene = workshop.load(kScene, {"object.0.mesh=teapot.ply"});
  CHECK(scene.objects[0].where == "--set object.0.mesh=teapot.ply: object 0");
  CHECK(workshop.load(kScene, {}).objects[0].where.find("--set") == std::string::npos);
}

TEST_CASE("a wrong override is named in place of the line") {
  const Workshop workshop;
  const auto refusal = [&](const std::string& text) { return workshop.refusal(kScene, {text}); };
  CHECK_THAT(refusal("wpr.padding=1"),
             StartsWith("--set wpr.padding=1: unknown key \"wpr\"; did you mean \"wrp\"?"));
  for (const std::string text : {"wrp.padding", "=3", "wrp.=1", ".padding=1", ""})
    CHECK(refusal(text) ==
          "--set " + text + ": must be section.key=value, for example wrp.padding=1.25");
  check_overrides({
      {"wrp.padding=9", "wrp: padding must be 1 to 8, got 9"},
      {"hologram.pitch=8 parsec",
       "hologram: pitch must be a length such as \"3.74 um\" (units: nm, um, mm, cm, m, km; none "
       "for metres), got \"8 parsec\""},
      {"light.0.direction=[0, 0, x]",
       "light 0: direction must be three numbers [x, y, z], got \"[0, 0, x]\""},
      {"light.0.direction=[0, 0, true]", "light 0: direction[2] must be a number, got true"},
      {"wrp.pading=1",
       "wrp: unknown key \"pading\"; did you mean \"padding\"? (keys here: propagation, grid, "
       "distance, layers, padding, guard, bell, margin, lines)"},
      {"materials.iron.ior=2", "the scene has no \"materials.iron\""},
      {"object.2.width=1", "there are 2 of \"object\", counted from 0, so \"2\" is none of them"},
      {"object.-1.width=1", "there are 2 of \"object\", counted from 0, so \"-1\" is none of them"},
      {"object.0=1", "names no key of a scene"},
      {"object.position=[0, 0, 1]",
       "names no key of a scene; object.0.position is that of the first"},
      {"object.\nwidth=1", "names no key of a scene; object.0.?width is that of the first"},
      {"wrp.padding.x=1", "names no key of a scene"},
      {"a.b.c.d.e.f=1", "names no key of a scene"},
      {"wrp.padding=", "wrp: padding must be a number, got \"\""},
      {"wrp.padding=1\n[trace]", "wrp: padding must be a number, got \"1?[trace]\""},
  });
}

TEST_CASE("parse_length_m accepts its units and nothing else") {
  CHECK_THAT(parse_length_m("3.74 um", "x"), WithinRel(3.74e-6, 1e-15));
  CHECK_THAT(parse_length_m("95mm", "x"), WithinRel(0.095, 1e-15));
  CHECK_THAT(parse_length_m(" 2 cm ", "x"), WithinRel(0.02, 1e-15));
  CHECK_THAT(parse_length_m("638nm", "x"), WithinRel(638e-9, 1e-15));
  for (const char* text : {"40\u00a0um", "40\u202fum", "40\u2009um\u00a0"})  // as pasted
    CHECK_THAT(parse_length_m(text, "x"), WithinRel(40e-6, 1e-15));
  CHECK(parse_length_m("10 km", "x") == 1e4);
  CHECK(parse_length_m("0.1", "x") == 0.1);
  CHECK(parse_length_m("-1e-3 m", "x") == -1e-3);
  for (const char* text :
       {"", " ", "mm", "1 Mm", "1 mm mm", "nan", "inf m", "1e999", "0x10", "1,5 mm", "--1", "1 MM"})
    CHECK_THAT(input_error_of([&] { parse_length_m(text, "-z"); }),
               StartsWith("-z must be a length such as \"3.74 um\""));
}

TEST_CASE("what is typed on the command line has a unit, and the line that asks for one says so") {
  CHECK(given_length_m("95mm", "-z") == parse_length_m("95mm", "-z"));
  CHECK(given_length_m("0", "-z") == 0);
  for (const char* text : {"8um", "8 \u00b5m", "8 \u03bcm"})
    CHECK(given_length_m(text, "-z") == given_length_m("8 um", "-z"));
  CHECK(given_duration_s("30 ms", "--budget") == 0.03);
  CHECK(given_duration_s("3min", "--budget") == 180);
  CHECK(given_moment_s("0 s", "at") == 0);
  CHECK(input_error_of([] { given_length_m("95", "-z"); }) ==
        "-z \"95\": a unit is needed, as in 95mm");
  CHECK(input_error_of([] { given_duration_s("50", "--budget"); }) ==
        "--budget \"50\": a unit is needed, as in 50ms");
  CHECK(input_error_of([] { given_length_m("far", "-z"); }) ==
        "-z must be a length such as \"3.74 um\" (units: nm, um, mm, cm, m, km), got \"far\"");
  for (const char* text : {"", "soon", "nan", "-1 s", "0 s", "1 m"})
    CHECK(input_error_of([&] { given_duration_s(text, "--budget"); }) ==
          "--budget must be a time such as \"30 ms\" (units: us, ms, s, min, h), got \"" +
              std::string(text) + "\"");
}

TEST_CASE("a length is printed in the unit that suits it") {
  CHECK(length_text(3.74e-6) == "3.74 um");
  CHECK(length_text(-0.0125) == "-12.5 mm");
  CHECK(length_text(0) == "0 m");
  CHECK(length_text(1e-10) == "0.1 nm");
  CHECK(length_text(20) == "20 m");
}

TEST_CASE("wavelengths fall into the channel of their colour") {
  CHECK(channel_of(638e-9) == 0);
  CHECK(channel_of(580e-9) == 0);
  CHECK(channel_of(579.9e-9) == 1);
  CHECK(channel_of(532e-9) == 1);
  CHECK(channel_of(490e-9) == 1);
  CHECK(channel_of(489.9e-9) == 2);
  CHECK(channel_of(10e-9) == 2);
}
