// SPDX-License-Identifier: Apache-2.0
// Section [slm]: what arrives, and what is refused.
#include "host/scene/slm.hpp"

#include "host/scene/read_slm.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/files.hpp"
#include "tests/support/scenes.hpp"

namespace raywave {
namespace {

using Catch::Approx;
using Catch::Matchers::ContainsSubstring;

/// One line per level.
std::string lut_text(const std::function<std::string(int)>& line) {
  std::string text = "# measured\n";
  for (int level = 0; level < 256; ++level) text += line(level) + "\n";
  return text;
}

struct Bench {
  Folder folder;
  Bench() {
    folder.write("rising.txt", lut_text([](int i) { return std::to_string(i / 255.0); }));
    folder.write("falling.csv", lut_text([](int i) {
                   return std::to_string(i) + ", " + std::to_string(1 - i / 2550.0);
                 }));
    folder.write("turns_back.txt", lut_text([](int i) { return std::to_string(i % 200); }));
    folder.write("flat.txt", lut_text([](int) { return "0.25"; }));
    folder.write("short.txt", "0.5");
    folder.write("words.txt", lut_text([](int i) { return i == 7 ? "about 3" : "1"; }));
    folder.write("nan.txt", lut_text([](int i) { return i == 7 ? "nan" : "1"; }));
    folder.write("shuffled.txt", lut_text([](int i) {
                   return std::to_string(i == 9 ? 10 : i) + " " + std::to_string(i);
                 }));
    folder.write("ragged.txt", lut_text([](int i) {
                   return std::to_string(i) + (i == 20 ? "" : " " + std::to_string(i));
                 }));
    folder.write("large.txt", std::string(2 << 20, '1'));
    folder.write("empty.txt", "");
    folder.write("none.png", "no picture");
    save_picture(folder / "flat.png", 3, 2, std::vector<std::uint8_t>{0, 1, 2, 3, 4, 255});
  }

  SlmSpec load(const std::string& keys, const std::vector<std::string>& set = {},
               double wavelength_m = 638e-9) const {
    return load_slm(folder.write("slm.toml", "[slm]\n" + keys + "\n"), wavelength_m, set);
  }

  /// The message of the InputError, without the folder's name.
  std::string refusal(const std::string& keys, const std::vector<std::string>& set = {}) const {
    auto message = input_error_of([&] { load(keys, set); });
    for (const std::string prefix = (folder / "").string();
         message.find(prefix) != std::string::npos;)
      message.erase(message.find(prefix), prefix.size());
    return message;
  }
};

TEST_CASE("every key of [slm] arrives at its place") {
  const Bench bench;
  const auto slm = bench.load(R"(encoding = "off-axis"
clip = 0.95
band = [0.5, 0.75]
levels = 16
levels_per_turn = 254
offset = -0.25
lut = "falling.csv"
carrier = [0.25, -0.1]
lens = "-30 cm"
zernike = [[4, 0.1], [11, -0.05]]
flatness = "flat.png"
flatness_unit = "nm"
flatness_fit = "centre"
flip = "xy"
rotate = 270
stop = [0.4, 0.3]
stop_centre = [0.05, -0.02]
fill = [0.95, 0.9]
undiffracted = 0.02
crosstalk = [[0, 1, 0], [1, 6, 2], [0, 0, 0]])");
  CHECK(slm.fill.value() == glm::dvec2(0.95, 0.9));
  CHECK(slm.undiffracted == 0.02);
  CHECK(slm.crosstalk.size == glm::ivec2(3, 3));
  CHECK(slm.crosstalk.weights[4] == Approx(0.6));
  CHECK(slm.encoding == Encoding::off_axis);
  CHECK(slm.clip == 0.95);
  CHECK(slm.band == glm::dvec2(0.5, 0.75));
  CHECK(slm.levels == 16);
  CHECK(slm.levels_per_turn == 254);
  CHECK(slm.offset_turns == -0.25);
  REQUIRE(slm.lut.values.size() == 256);
  CHECK(slm.lut.values[50] == Approx(1 - 50 / 2550.0));
  CHECK(slm.carrier == glm::dvec2(0.25, -0.1));
  CHECK(slm.lens_m.value() == Approx(-0.3));
  REQUIRE(slm.zernike.size() == 2);
  CHECK(slm.zernike[1].noll == 11);
  CHECK(slm.zernike[1].turns == -0.05);
  CHECK(slm.flatness.picture.width == 3);
  CHECK(slm.flatness.in_nm);
  CHECK(slm.flatness.centre);
  CHECK(slm.flip_x);
  CHECK(slm.flip_y);
  CHECK(slm.rotate_deg == 270);
  CHECK(slm.stop.value().size == glm::dvec2(0.4, 0.3));
  CHECK(slm.stop.value().centre == glm::dvec2(0.05, -0.02));
  CHECK(bench.load("invert = true").invert);

  const auto moved = bench.load("shift = [\"1 mm\", 0]\nshift_distance = \"20 cm\"");
  CHECK(moved.shift_m.x == Approx(1e-3));
  CHECK(moved.shift_distance_m == Approx(0.2));
}

TEST_CASE("10 bits have 1024 levels, in files of an SLM and not in scenes") {
  const Bench bench;
  CHECK(bench.load("").bits == 8);
  const auto plain = bench.load("bits = 10");
  CHECK(plain.bits == 10);
  CHECK(plain.levels == 1024);
  CHECK(plain.levels_per_turn == 1024);
  const auto given = bench.load("levels_per_turn = 4096\nlevels = 1000\nbits = 10");
  CHECK(given.levels == 1000);
  CHECK(given.levels_per_turn == 4096);
  std::string wide;
  for (int i = 0; i < 1024; ++i) wide += std::to_string(i / 1000.0) + "\n";
  bench.folder.write("wide.txt", wide);
  CHECK(bench.load("bits = 10\nlut = \"wide.txt\"").lut.values.size() == 1024);
  CHECK_SAYS(bench.refusal("lut = \"wide.txt\""), "got 1024 numbers");
  bench.folder.write("ball.obj", "");
  const auto scene = bench.folder.write(
      "scene.toml",
      "[slm]\nbits = 10\n[[light]]\ndirection = [0, 0, 1]\n[[object]]\nmesh = \"ball.obj\"\n");
  CHECK_REFUSED(load_scene(scene),
                "scene.toml:2: slm: bits must be 8 in a scene: its pictures have 8 "
                "bits; give 10 to raywave encode");
}

TEST_CASE(
    "a LUT may be one column or two, in turns, radians or units of pi, of a file or of the scene "
    "itself; a wide one is noted") {
  const Bench bench;
  CHECK(bench.load("lut = \"rising.txt\"").lut.values[255] == Approx(1));
  CHECK(bench.load("lut = \"falling.csv\"").lut.values[255] == Approx(0.9));
  CHECK(bench.load("lut = \"falling.csv\"\nlut_unit = \"radians\"").lut.values[255] ==
        Approx(0.9 / (2 * std::numbers::pi)));
  bench.folder.write("pi.txt", lut_text([](int i) { return std::to_string(i / 127.5); }));
  CHECK(bench.load("lut = \"pi.txt\"\nlut_unit = \"pi\"").lut.values[255] == Approx(1));
  const auto wide = bench.load("lut = \"pi.txt\"");
  REQUIRE(wide.notes.size() == 1);
  CHECK_SAYS(wide.notes[0], "not volts or units of pi (lut_unit = \"pi\")");
  std::string numbers;
  for (int i = 0; i < 256; ++i) numbers += std::to_string(i / 64.0) + (i % 8 == 7 ? ",\n" : ", ");
  const auto volts = bench.load("lut = [" + numbers + "]");
  CHECK(volts.lut.values[17] == Approx(17 / 64.0));
  REQUIRE(volts.notes.size() == 1);
  CHECK_SAYS(volts.notes[0], "spans 3.98438 turns of phase, more than most panels");
}

TEST_CASE("a LUT of fewer levels, a heading, decimal commas, NumPy's files and any order is read") {
  const Bench bench;
  const auto read = [&](const std::string& file) {
    return bench.load("lut = \"" + file + "\"").lut;
  };
  const std::vector<double> three{0, 0.25, 1};
  for (const char* text : {"0 0.25 1",
                           "\xef\xbb\xbf"
                           "0\r\n0.25\r\n1\r\n"}) {  // a byte order mark
    bench.folder.write("few.txt", text);
    CHECK(read("few.txt") == Lut{{}, three});
  }
  bench.folder.write("heading.csv", "Grey level,Phase (turns)\n200,1\n0,0\n100,0.25\n");
  CHECK(read("heading.csv") == Lut{{0, 100, 200}, three});
  bench.folder.write("german.csv", "Stufe;Phase\r\n0;0,0\r\n100;0,25\r\n200;1,0\r\n");
  CHECK(read("german.csv") == Lut{{0, 100, 200}, three});
  CHECK(bench.load("lut = [[0, 0], [100, 0.25], [200, 1]]").lut == Lut{{0, 100, 200}, three});

  bench.folder.write("complex.csv", "level,turns,amplitude\n2,0.5,0.75\n0,0,1\n1,0.75,0.5\n");
  const Lut states{{0, 1, 2}, {0, 0.75, 0.5}, {1, 0.5, 0.75}};
  CHECK(read("complex.csv") == states);
  CHECK(bench.load("lut = [[2, 0.5, 0.75], [0, 0, 1], [1, 0.75, 0.5]]").lut == states);

  // np.save of numbers[3], and of levels and numbers in columns that lie behind each other
  const auto npy = [&](const std::string& shape, const char* fortran, std::vector<double> numbers) {
    std::string header =
        std::string("{'descr': '<f8', 'fortran_order': ") + fortran + ", 'shape': " + shape + ", }";
    header.resize(117, ' ');
    header += '\n';
    std::string bytes =
        "\x93NUMPY\x01" + std::string(1, '\0') + "v" + std::string(1, '\0') + header;
    for (const double number : numbers)
      bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
    return bytes;
  };
  bench.folder.write("list.npy", npy("(3,)", "False", three));
  CHECK(read("list.npy") == Lut{{}, three});
  bench.folder.write("table.npy", npy("(3, 2)", "True", {0, 100, 200, 0, 0.25, 1}));
  CHECK(read("table.npy") == Lut{{0, 100, 200}, three});
  bench.folder.write("cut.npy", npy("(4,)", "False", three));
  CHECK_SAYS(bench.refusal("lut = \"cut.npy\""), "cut.npy: is cut short");
}

TEST_CASE("a LUT that turns back a little becomes the nearest that does not, and a note says so") {
  const Bench bench;
  // Least squares by hand: 0.3 and 0.26 become 0.28 twice; 0.4, 0.4 and 0.4 are a plateau
  const auto slm = bench.load("lut = [0, 0.3, 0.26, 0.4, 0.4, 0.4, 0.9]");
  const std::vector<double> wanted{0, 0.28, 0.28, 0.4, 0.4, 0.4, 0.9};
  REQUIRE(slm.lut.values.size() == wanted.size());
  for (std::size_t i = 0; i < wanted.size(); ++i) CHECK(slm.lut.values[i] == Approx(wanted[i]));
  REQUIRE(slm.notes.size() == 2);
  CHECK_SAYS(slm.notes[0], "lut: it turns back, by up to 0.02 turns");
  CHECK_SAYS(slm.notes[1], "it lists 7 of 256 levels");
  CHECK(bench.load("lut = [0, 0.3, 0.3, 0.9]").notes.size() == 1);
  CHECK(bench.load("lut = \"rising.txt\"").notes.empty());
}

TEST_CASE("what depends on the wavelength may be a table by wavelength, as a LUT") {
  const Bench bench;
  const std::string keys = R"(levels_per_turn = { "638 nm" = 216, "520 nm" = 170 }
carrier = { "638 nm" = [0.25, 0], "520 nm" = [0.2, 0.1] }
zernike = { "638 nm" = [[4, 0.1]], "520 nm" = [] })";
  const auto red = bench.load(keys), green = bench.load(keys, {}, 520e-9);
  CHECK(red.levels_per_turn == 216);
  CHECK(green.levels_per_turn == 170);
  CHECK(red.carrier == glm::dvec2(0.25, 0));
  CHECK(green.carrier == glm::dvec2(0.2, 0.1));
  CHECK(red.zernike.size() == 1);
  CHECK(green.zernike.empty());
  const std::string shift = R"(shift = { "638 nm" = ["1 mm", 0], "520 nm" = ["2 mm", 0] })";
  CHECK(bench.load(shift, {}, 520e-9).shift_m.x == Approx(2e-3));
  CHECK_SAYS(bench.refusal("levels_per_turn = { \"450 nm\" = 100 }"),
             "levels_per_turn has \"450 nm\", none within 1 nm of 638 nm");
}

TEST_CASE("a number of levels that looks like grey levels to a turn gets a note") {
  const Bench bench;
  REQUIRE(bench.load("levels = 217").notes.size() == 1);
  CHECK_SAYS(bench.load("levels = 217").notes[0], "give levels_per_turn");
  CHECK(bench.load("levels = 16\n").notes.empty());
  CHECK(bench.load("levels = 128\n").notes.empty());
}

TEST_CASE("of LUTs by wavelength, the nearest within 1 nm is taken, and no other is read") {
  const Bench bench;
  const std::string line =
      R"(lut = { "638 nm" = "rising.txt", "0.532 um" = "falling.csv", "450 nm" = "gone.txt" })";
  const std::string section =
      "[slm.lut]\n\"638 nm\" = \"rising.txt\"\n\"532 nm\" = \"falling.csv\"\n";
  for (const auto& keys : {line, section}) {
    for (const double near_m : {637e-9, 638e-9, 639e-9})
      CHECK(bench.load(keys, {}, near_m).lut.values[255] == Approx(1));
    CHECK(bench.load(keys, {}, 532.4e-9).lut.values[255] == Approx(0.9));
  }
  // Both are within 1 nm, and the nearer one is not the first.
  const std::string close = R"(lut = { "637.4 nm" = "rising.txt", "638.2 nm" = "falling.csv" })";
  CHECK(bench.load(close, {}, 637.7e-9).lut.values[255] == Approx(1));
  CHECK(bench.load(close, {}, 637.9e-9).lut.values[255] == Approx(0.9));
  CHECK(bench.load("lut_unit = \"radians\"\n" + line, {}, 532e-9).lut.values[255] ==
        Approx(0.9 / (2 * std::numbers::pi)));
  CHECK(bench.load(line, {"slm.lut.638 nm=\"falling.csv\""}).lut.values[255] == Approx(0.9));
  CHECK(bench.load(line, {"slm.lut=\"falling.csv\""}).lut.values[255] == Approx(0.9));
  // A scene takes its own wavelength.
  bench.folder.write("ball.obj", "");
  const auto scene = load_scene(bench.folder.write(
      "scene.toml", "[hologram]\nwavelength = \"532 nm\"\n[slm]\n" + line +
                        "\n[[light]]\ndirection = [0, 0, 1]\n[[object]]\nmesh = \"ball.obj\"\n"));
  CHECK(scene.slm.lut.values[255] == Approx(0.9));
}

TEST_CASE("a real image moves the same way as a virtual one as far behind the SLM") {
  const SlmSpec behind{.shift_m = {1e-3, -2e-3}, .shift_distance_m = 0.2};
  auto before = behind;
  before.shift_distance_m = -0.2;
  // Light that goes on to a real image is turned the other way than light that comes from z > 0
  const auto turned = carrier_of(behind, glm::dvec2(8e-6), 532e-9);
  CHECK(turned.x == Approx(-1e-3 / std::hypot(1e-3, 2e-3, 0.2) * 8e-6 / 532e-9));
  CHECK(carrier_of(before, glm::dvec2(8e-6), 532e-9) == -turned);
}

TEST_CASE("the share of light that grey levels put into the wanted wave is that of closed forms") {
  const auto sinc2 = [](double x) { return std::pow(std::sin(x) / x, 2); };
  CHECK(wanted_share_of_levels({}) == Approx(1).margin(1e-4));
  for (const int levels : {2, 3, 4, 8})
    CHECK(wanted_share_of_levels({.levels = levels}) ==
          Approx(sinc2(std::numbers::pi / levels)).epsilon(1e-3));
  // Half a turn: the other phases are shown as its nearer end, up to a quarter of a turn away
  CHECK(wanted_share_of_levels({.levels_per_turn = 512}) ==
        Approx(std::pow(0.5 + 1 / std::numbers::pi, 2)).epsilon(0.01));
  CHECK(wanted_share_of_levels({.encoding = Encoding::lee, .levels = 2}) == 1);
}

TEST_CASE("a wrong value in [slm] is refused with its line and what would be right") {
  struct Case {
    const char* keys;
    const char* message;  // how it begins
  };
  const std::vector<Case> cases{
      {"encoding = \"kinoform\"",
       "slm.toml:2: slm: encoding must be \"phase\" or \"double-phase\" or "
       "\"off-axis\" or "
       "\"burckhardt\" or \"lee\" or \"auto\", got \"kinoform\""},
      {"band = [1, 2]", "slm.toml:2: slm: band[1] must be 0.001 to 1, got 2"},
      {"bits = 9", "slm.toml:2: slm: bits must be 8 or 10, got 9"},
      {"bits = 10\nlevels = 1025", "slm.toml:3: slm: levels must be 2 to 1024, got 1025"},
      {"lut_unit = \"degrees\"",
       "slm.toml:2: slm: lut_unit must be \"turns\" or \"radians\" or \"pi\", got \"degrees\""},
      {"\nlut = \"turns_back.txt\"",
       "slm.toml:3: slm: lut must rise or fall from level to level; level 200 shows 0 after 199"
       ": phases that wrap need unwrapping"},
      {"lut = \"flat.txt\"", "slm.toml:2: slm: lut shows 0.25 at every level"},
      {"lut = \"short.txt\"",
       "short.txt: a LUT has a number for each level, 2 to 256 of them, or a line for each with "
       "level "
       "and number; got 1 numbers"},
      {"lut = \"empty.txt\"", "empty.txt: a LUT has a number for each level, 2 to 256 of them"},
      {"lut = \"words.txt\"", "words.txt:9: \"about\" is no number"},
      {"lut = \"nan.txt\"", "nan.txt:9: \"nan\" is no number"},
      {"lut = \"shuffled.txt\"", "shuffled.txt: level 10 is there twice"},
      {"lut = \"ragged.txt\"", "ragged.txt:22: two columns expected, level and phase, got 1"},
      {"lut = \"large.txt\"", "large.txt: too large for a LUT (at most 1 MiB)"},
      {"lut = \"none.txt\"", "slm.toml:2: slm: lut must be a file (there is none at \"none.txt\")"},
      {"lut = [0]",
       "slm.toml:2: slm: lut must be 2 to 256 numbers, pairs [level, number], rows [level, turns, "
       "amplitude], or the name of a file"},
      {"\nlut = { \"532 nm\" = \"rising.txt\", \"450 nm\" = \"rising.txt\" }",
       "slm.toml:3: slm: lut has \"450 nm\", \"532 nm\", none within 1 nm of 638 nm; add one of "
       "\"638 nm\""},
      {"lut = { \"636.9 nm\" = \"rising.txt\" }",
       "slm.toml:2: slm: lut has \"636.9 nm\", none within 1 nm of 638 nm"},
      {"lut = {}", "slm.toml:2: slm: lut has no wavelength; add one of \"638 nm\""},
      {"lut = { red = \"rising.txt\" }",
       "slm.toml:2: slm: lut: a key of a table by wavelength must be a length such as "},
      {"lut = { 638 = \"rising.txt\" }",
       "slm.toml:2: slm: lut: \"638\" is no wavelength of 1 nm to 10 mm; give keys with a unit, "
       "such "
       "as \"638 nm\""},
      {"lut = { \"638 nm\" = \"rising.txt\", \"0.638 um\" = \"rising.txt\" }",
       "slm.toml:2: slm: lut: \"0.638 um\" and \"638 nm\" are the same wavelength; keep one of "
       "them"},
      {"lut = { \"638 nm\" = \"none.txt\" }",
       "slm.toml:2: slm: lut.\"638 nm\" must be a file (there is none at \"none.txt\")"},
      {"lut = { \"638 nm\" = [0] }",
       "slm.toml:2: slm: lut.\"638 nm\" must be 2 to 256 numbers, pairs [level, number]"},
      {"lut = { \"638 nm\" = \"flat.txt\" }",
       "slm.toml:2: slm: lut.\"638 nm\" shows 0.25 at every level"},
      {"invert = true\nlut = \"rising.txt\"",
       "slm.toml:3: slm: lut must be given without invert: the LUT says itself whether phase falls "
       "as grey rises"},
      {"carrier = [0.6, 0]", "slm.toml:2: slm: carrier[0] must be -0.5 to 0.5, got 0.6"},
      {"carrier = 0.1",
       "slm.toml:2: slm: carrier must be two numbers [x, y] in cycles per pixel, got 0.1"},
      {"carrier = [0.1, 0]\nshift = [\"1 mm\", 0]",
       "slm.toml:3: slm: shift must be given without carrier: both say the same"},
      {"encoding = \"off-axis\"", "slm.toml:1: slm: encoding \"off-axis\" needs slm.carrier"},
      {"encoding = \"lee\"", "slm.toml:1: slm: encoding \"lee\" needs slm.carrier"},
      {"lens = 0", "slm.toml:2: slm: lens must be a focal length other than 0, got 0"},
      {"zernike = 4", "slm.toml:2: slm: zernike must be an array of pairs [Noll index, turns]"},
      {"zernike = [4, 0.1]", "slm.toml:2: slm: zernike must be an array of pairs"},
      {"zernike = [[0, 0.1]]",
       "slm.toml:2: slm: zernike must be [Noll index, turns] with an index of 1 to 105"},
      {"zernike = [[2.5, 0.1]]",
       "slm.toml:2: slm: zernike must be [Noll index, turns] with an index of 1 to 105"},
      {"flatness = \"none.png\"", "slm.toml:2: slm: flatness"},
      {"flatness = \"gone.png\"", "slm.toml:2: slm: flatness must be a file"},
      {"flatness_unit = \"um\"",
       "slm.toml:2: slm: flatness_unit must be \"levels\" or \"nm\", got \"um\""},
      {"flip = \"z\"", "slm.toml:2: slm: flip must be \"x\", \"y\", \"xy\" or \"\", got \"z\""},
      {"rotate = 45", "slm.toml:2: slm: rotate must be 0, 90, 180 or 270, got 45"},
      {"stop_centre = [0, 0]",
       "slm.toml:2: slm: stop_centre must be given with stop, the size of the aperture"},
      {"stop = \"none\"\nstop_centre = [0, 0]",
       "slm.toml:3: slm: stop_centre must be given with stop, the size of the aperture"},
      {"encodign = \"phase\"",
       "slm.toml:2: slm: unknown key \"encodign\"; did you mean \"encoding\"?"},
  };
  const Bench bench;
  for (const auto& [keys, message] : cases) {
    INFO(keys);
    const auto said = bench.refusal(keys);
    CHECK(said.substr(0, std::string(message).size()) == message);
    CHECK(said.find('\n') == std::string::npos);
  }
  CHECK_SAYS(bench.refusal("", {"slm.levels=1"}),
             "--set slm.levels=1: slm: levels must be 2 to 256, got 1");
}

TEST_CASE("[slm] is read from a file of its own, beside [hologram], and from a scene") {
  const Bench bench;
  CHECK(load_slm(bench.folder.write("whole.toml",
                                    "[slm]\nflip = \"y\"\n[hologram]\npitch = \"8 um\"\n"
                                    "[[object]]\nmesh = \"ball.obj\"\n"),
                 638e-9)
            .flip_y);
  CHECK(load_slm(
            bench.folder.write("bench.toml", "[hologram]\npitch = \"8 um\"\n[slm]\nflip = \"y\"\n"),
            638e-9)
            .flip_y);
  CHECK_SAYS(bench.refusal("[panel]\n"), "unknown key \"panel\"");
  bench.folder.write("ball.obj", "");
  const auto scene = load_scene(
      bench.folder.write("scene.toml",
                         "[slm]\nflip = \"x\"\n[[light]]\ndirection = [0, 0, 1]\n[[object]]\nmesh "
                         "= \"ball.obj\"\n"),
      {"slm.rotate=90"});
  CHECK(scene.slm.flip_x);
  CHECK(scene.slm.rotate_deg == 90);
}

TEST_CASE("a shift is a carrier against it, as far as the SLM's band goes") {
  SlmSpec slm;
  slm.shift_m = {3e-3, -4e-3};
  slm.shift_distance_m = 12e-3;
  const auto carrier = carrier_of(slm, {1e-6, 0.5e-6}, 800e-9);
  CHECK(carrier.x == Approx(-3.0 / 13 / 0.8));
  CHECK(carrier.y == Approx(4.0 / 13 * 0.5 / 0.8));
  CHECK_REFUSED(carrier_of(slm, {2e-6, 2e-6}, 800e-9),
                "slm.shift: 3 mm, -4 mm at 12 mm needs a carrier of ",
                "pixels of 2 um show at most 0.5; give a smaller shift, or hologram.pitch");
}

TEST_CASE("a LUT of voltages is refused with the range that phases have") {
  const Bench bench;
  std::string millivolts, volts;
  for (int i = 0; i < 256; ++i) {
    millivolts += std::to_string(20 * i) + "\n";
    volts += std::to_string(0.02 * i) + "\n";
  }
  bench.folder.write("mV.csv", millivolts);
  bench.folder.write("V.csv", volts);
  CHECK_SAYS(bench.refusal("lut = \"mV.csv\""),
             "slm.toml:2: slm: lut spans 5100 turns of phase, and a panel's "
             "levels span up to 4; give phases, not voltages");
  CHECK_SAYS(bench.refusal("lut = \"V.csv\""), "lut spans 5.1 turns");
  CHECK_SAYS(bench.refusal("encoding = \"off-axis\"\nlut = \"V.csv\""),
             "lut has amplitudes from 0 to 5.1; 0 to 1 is expected");
}

TEST_CASE("a flatness picture in nm counts its integers as nm, its floats as they are") {
  const Bench bench;
  const std::string keys = "flatness_unit = \"nm\"\nflatness = ";
  const std::array<std::uint8_t, 2> bytes{0, 160};
  const std::array<std::uint16_t, 2> words{0, 1276};
  const std::array<float, 2> floats{-0.5f, 79.75f};
  save_picture(bench.folder / "8.png", 2, 1, bytes);
  save_picture(bench.folder / "16.png", 2, 1, words);
  save_picture(bench.folder / "float.exr", 2, 1, floats);
  CHECK(bench.load(keys + "\"8.png\"").flatness.picture.pixels == std::vector{0.0f, 160.0f});
  CHECK(bench.load(keys + "\"16.png\"").flatness.picture.pixels == std::vector{0.0f, 1276.0f});
  CHECK(bench.load(keys + "\"float.exr\"").flatness.picture.pixels == std::vector{-0.5f, 79.75f});
}

TEST_CASE("equal pictures have equal files, OpenEXR too") {
  const Folder folder;
  const std::array<float, 2> pixels{0.25f, 4};
  save_picture(folder / "a.exr", 2, 1, pixels);
  CHECK_THAT(bytes_of(folder / "a.exr"), !ContainsSubstring("Date"));
}

}  // namespace
}  // namespace raywave
