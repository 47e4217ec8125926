// SPDX-License-Identifier: Apache-2.0
// Test patterns, and the pictures that SLMs are sent.
#include "host/encode/pattern.hpp"

#include <cctype>

#include "host/encode/encode.hpp"
#include "host/encode/nrsh.hpp"
#include "host/encode/pictures.hpp"
#include "host/encode/shown.hpp"
#include "host/reference/propagation.hpp"
#include "tests/support/devices.hpp"
#include "tests/support/render.hpp"

namespace raywave {
namespace {

using namespace test;
using Catch::Approx;
using Pictures = std::vector<std::vector<std::uint8_t>>;

HologramSpec small_slm() {
  return HologramSpec{.resolution = {256, 192}, .pitch_m = {4e-6, 4e-6}, .wavelength_m = 532e-9};
}

/// The field of a pattern on the SLM when its levels are as `described`, and its glass as
/// `true_slm`.
FieldStack shown(const cl::Device& device, const PatternSpec& spec, const SlmSpec& described,
                 const SlmSpec& true_slm) {
  const auto hologram = small_slm();
  const auto panel_of = [&](const SlmSpec& slm) {
    return std::make_shared<const Panel>(slm, hologram.resolution, hologram.pitch_m,
                                         hologram.wavelength_m);
  };
  Encoder encoder(device, panel_of(described));
  const auto levels = encode(device, encoder, pattern_field(spec, hologram));
  return shown_field(*panel_of(true_slm), levels);
}

/// The brightest place in the plane at this distance after the SLM, along the light. A conjugate
/// field shows there what reconstruct looks for on the other side.
Peak spot_behind(const cl::Device& device, FieldStack field, double distance_m) {
  for (auto& sample : field.samples) sample = std::conj(sample);
  const auto picture =
      reconstruct(device, cl::FftBackend::host, field, small_slm(), {.z_m = distance_m});
  return peak_of(picture, glm::dvec2(4e-6));
}

DEVICE_TEST("the lens focuses at its focal length after the SLM, and not where phase is inverted") {
  PatternSpec lens{.focal_m = 20e-3};
  auto inverted = by_phase();
  inverted.invert = true;
  const auto right = spot_behind(device, shown(device, lens, by_phase(), by_phase()), 20e-3);
  CHECK(std::abs(right.x_m) <= 4e-6);
  CHECK(std::abs(right.y_m) <= 4e-6);
  // (pixels of the lens times pitch^2 / (wavelength f))^2, half a pixel beside the middle
  const auto beside = [](int pixels) {
    const double t = std::numbers::pi * 0.5 * pixels * 16e-12 / (532e-9 * 20e-3);
    return std::sin(t) / t;
  };
  const double expected =
      std::pow(256 * 192 * 16e-12 / (532e-9 * 20e-3) * beside(256) * beside(192), 2);
  CHECK(right.intensity == Approx(expected).epsilon(0.05));
  for (const double distance_m : {15e-3, 26e-3})
    CHECK(spot_behind(device, shown(device, lens, by_phase(), by_phase()), distance_m).intensity <
          right.intensity / 4);
  const auto wrong = spot_behind(device, shown(device, lens, by_phase(), inverted), 20e-3);
  CHECK(wrong.intensity < right.intensity / 100);
  // Told of the sign, the levels are right again.
  const auto mended = spot_behind(device, shown(device, lens, inverted, inverted), 20e-3);
  CHECK(mended.intensity == Approx(right.intensity).epsilon(0.01));
  // A diverging lens seems to shine from before the SLM.
  lens.focal_m = -20e-3;
  auto seen = shown(device, lens, by_phase(), by_phase());
  for (auto& sample : seen.samples) sample = std::conj(sample);
  CHECK(spot_behind(device, seen, 20e-3).intensity == Approx(expected).epsilon(0.05));
}

DEVICE_TEST("the blaze moves the spot of a lens by what it says, to every side") {
  const auto hologram = small_slm();
  for (const auto side : {Side::right, Side::left, Side::up, Side::down}) {
    PatternSpec blaze;
    blaze.pattern = Pattern::blaze;
    blaze.period_px = 20;
    blaze.side = side;
    auto field = shown(device, blaze, by_phase(), by_phase());
    const auto focusing = pattern_field(PatternSpec{.focal_m = 20e-3}, hologram);
    for (std::size_t i = 0; i < field.samples.size(); ++i) field.samples[i] *= focusing.samples[i];
    const auto spot = spot_behind(device, field, 20e-3);
    const double moved = blaze_slope(blaze, hologram) * 20e-3;
    CHECK(moved == Approx(20e-3 * 532e-9 / 80e-6).epsilon(1e-4));
    const double right = side == Side::right  ? moved
                         : side == Side::left ? -moved
                                              : 0,
                 up = side == Side::up     ? moved
                      : side == Side::down ? -moved
                                           : 0;
    INFO(name_of(side));
    CHECK(spot.x_m == Approx(right).margin(4.1e-6));
    CHECK(spot.y_m == Approx(up).margin(4.1e-6));
  }
}

DEVICE_TEST("the checker sends no light along the axis, and a wrong turn sends some") {
  PatternSpec checker;
  checker.pattern = Pattern::checker;
  auto weak = by_phase();
  weak.levels_per_turn = 320;  // its glass turns less than told
  const auto on_axis = [&](const SlmSpec& glass) {
    std::complex<double> sum = 0;
    const auto field = shown(device, checker, by_phase(), glass);
    for (const auto& sample : field.samples) sum += std::complex<double>(sample);
    return std::norm(sum / static_cast<double>(field.samples.size()));
  };
  CHECK(on_axis(by_phase()) < 1e-10);
  CHECK(on_axis(weak) == Approx(std::pow(std::cos(std::numbers::pi * 128 / 320), 2)));
}

DEVICE_TEST("the ramp rises from left to right below a plain quarter") {
  PatternSpec ramp;
  ramp.pattern = Pattern::ramp;
  const auto hologram = small_slm();
  Encoder encoder(device, std::make_shared<const Panel>(by_phase(), hologram.resolution,
                                                        hologram.pitch_m, hologram.wavelength_m));
  const auto levels = encode(device, encoder, pattern_field(ramp, hologram)).front();
  for (int row = 0; row < 192; ++row)
    for (int column = 0; column < 256; ++column)
      REQUIRE(levels[row * 256 + column] == (row < 48 ? 0 : column));
}

TEST_CASE("patterns that pixels cannot show are refused with what they can") {
  const auto refusal = [](const PatternSpec& spec) {
    return input_error_of([&] { pattern_field(spec, small_slm()); });
  };
  PatternSpec spec;
  spec.focal_m = 5e-3;  // 512 um / (532 nm / 8 um) = 7.7 mm
  CHECK_SAYS(refusal(spec), "focal 5 mm: too strong a lens", "give 8 mm or more");
  spec.focal_m = 8e-3;
  CHECK(refusal(spec).empty());
  spec.focal_m = 0;
  CHECK_SAYS(refusal(spec), "too strong");
  for (const auto pattern : {Pattern::blaze, Pattern::checker}) {
    spec.pattern = pattern;
    spec.period_px = 1.5;
    CHECK_SAYS(refusal(spec), "pixels show periods of 2 and more");
  }
  CHECK_REFUSED(choice_of<Pattern>("grid", "pattern"), "there are lens, blaze, checker and ramp");
  CHECK_REFUSED(choice_of<Side>("east", "to"), "there are right, left, up and down");
}

TEST_CASE("pictures are turned counterclockwise, then flipped, and come back from every way") {
  // 0 1 2
  // 3 4 5
  const LevelPicture picture{{3, 2}, {0, 1, 2, 3, 4, 5}};
  const auto levels = [&](int rotate, bool x, bool y) {
    SlmSpec slm{.flip_x = x, .flip_y = y, .rotate_deg = rotate};
    const auto turned = for_slm(picture, slm);
    CHECK(turned.size_px == (rotate % 180 == 0 ? glm::ivec2(3, 2) : glm::ivec2(2, 3)));
    const auto back = from_slm(turned, slm);
    CHECK(back.size_px == picture.size_px);
    CHECK(back.levels == picture.levels);
    return turned.levels;
  };
  using Levels = std::vector<std::uint8_t>;
  CHECK(levels(0, false, false) == Levels{0, 1, 2, 3, 4, 5});
  CHECK(levels(0, true, false) == Levels{2, 1, 0, 5, 4, 3});
  CHECK(levels(0, false, true) == Levels{3, 4, 5, 0, 1, 2});
  CHECK(levels(0, true, true) == Levels{5, 4, 3, 2, 1, 0});
  CHECK(levels(90, false, false) == Levels{2, 5, 1, 4, 0, 3});
  CHECK(levels(180, false, false) == Levels{5, 4, 3, 2, 1, 0});
  CHECK(levels(270, false, false) == Levels{3, 0, 4, 1, 5, 2});
  CHECK(levels(90, true, false) == Levels{5, 2, 4, 1, 3, 0});
  for (const int rotate : {90, 180, 270})
    for (const bool x : {false, true})
      for (const bool y : {false, true}) levels(rotate, x, y);
}

TEST_CASE("the keys that docs/slm.md gives take a bench's turns and flips back") {
  struct Way {
    int rotate;
    bool x, y;
  };
  const auto turned = [](const LevelPicture& picture, const Way& way) {
    return for_slm(picture, SlmSpec{.flip_x = way.x, .flip_y = way.y, .rotate_deg = way.rotate});
  };
  struct Case {
    Way bench, keys;
  };
  for (const auto& [bench, keys] : {Case{{0, false, false}, {0, false, false}},
                                    {{0, true, false}, {0, true, false}},
                                    {{0, false, true}, {0, false, true}},
                                    {{180, false, false}, {180, false, false}},
                                    {{90, false, false}, {270, false, false}},
                                    {{270, false, false}, {90, false, false}},
                                    {{90, true, false}, {90, true, false}},
                                    {{90, false, true}, {90, false, true}}}) {
    const LevelPicture picture{{3, 2}, {0, 1, 2, 3, 4, 5}};
    CHECK(turned(turned(picture, keys), bench).levels == picture.levels);
  }
}

// ------------------------------------------------------------------------------------- formats

struct Written {
  Folder folder;
  Panel panel;
  Pictures levels;
  FieldStack field;
  std::vector<std::string> names;

  Written(const SlmSpec& slm, PictureFormat format, const Pictures& frames,
          glm::ivec2 size = {3, 2})
      : panel(slm, size, glm::dvec2(4e-6), 532e-9), levels(frames) {
    field = {size.x, size.y, static_cast<int>(frames.size()), {}};
    for (std::size_t i = 0; i < frames.size() * frames[0].size(); ++i)
      field.samples.emplace_back(static_cast<float>(i) + 0.5f, -static_cast<float>(i));
    names = save_pictures(folder / "", "hologram", format, panel, levels, field);
  }
};

const Pictures two_frames{{0, 1, 2, 3, 128, 255}, {255, 7, 6, 5, 4, 0}};

TEST_CASE("8-bit and 16-bit pictures hold the levels, turned and flipped, and are read again") {
  struct Case {
    PictureFormat format;
    const char* extension;
  };
  for (const auto& [format, extension] : {Case{PictureFormat::png, ".png"},
                                          {PictureFormat::png16, ".png"},
                                          {PictureFormat::bmp, ".bmp"},
                                          {PictureFormat::tiff, ".tif"}}) {
    auto slm = by_phase();
    slm.rotate_deg = 90;
    const Written written(slm, format, two_frames);
    INFO(name_of(format));
    CHECK(is_read_again(format));
    CHECK(written.names == std::vector<std::string>{std::string("hologram") + extension,
                                                    std::string("hologram_2") + extension});
    for (std::size_t frame = 0; frame < 2; ++frame) {
      const auto image = load_levels(written.folder / written.names[frame], "");
      REQUIRE(image.width == 2);
      REQUIRE(image.height == 3);
      LevelPicture picture{{2, 3}, {}};
      for (const float v : image.pixels)
        picture.levels.push_back(static_cast<std::uint8_t>(std::lround(v * 255)));
      CHECK(from_slm(picture, slm).levels == two_frames[frame]);
    }
  }
}

TEST_CASE("an array holds the levels of all frames as bytes") {
  const Written written(by_phase(), PictureFormat::npy, two_frames);
  CHECK(written.names == std::vector<std::string>{"hologram.npy"});
  const auto bytes = bytes_of(written.folder / "hologram.npy");
  CHECK_SAYS(bytes, "{'descr': '|u1', 'fortran_order': False, 'shape': (2, 2, 3), }");
  REQUIRE(bytes.size() % 64 == 12);
  for (std::size_t i = 0; i < 12; ++i)
    CHECK(static_cast<std::uint8_t>(bytes[bytes.size() - 12 + i]) == two_frames[i / 6][i % 6]);
}

TEST_CASE("EXR holds the field as it was given, neither turned nor encoded") {
  auto slm = by_phase();
  slm.flip_x = true;
  const Written written(slm, PictureFormat::exr, two_frames);
  REQUIRE(written.names == std::vector<std::string>{"hologram.exr", "hologram_2.exr"});
  for (std::size_t frame = 0; frame < 2; ++frame) {
    const auto re = load_texture(written.folder / written.names[frame], 0, "");
    CHECK(re.width == 3);
    for (std::size_t i = 0; i < 6; ++i)
      CHECK(re.pixels[i] == written.field.samples[6 * frame + i].real());
  }
}

TEST_CASE("a MATLAB file holds the field as matrix dh, by columns, or is refused with what to do") {
  const auto said = input_error_of([] { Written(by_phase(), PictureFormat::mat, two_frames); });
  if (!said.empty()) {  // built without libmatio
    CHECK_SAYS(said, "install libmatio-dev and build again");
    return;
  }
  const Written written(by_phase(), PictureFormat::mat, two_frames);
  REQUIRE(written.names == std::vector<std::string>{"hologram.mat", "hologram_2.mat"});
  const auto bytes = bytes_of(written.folder / "hologram_2.mat");
  CHECK(bytes.starts_with("MATLAB 5.0 MAT-file"));
  CHECK_SAYS(bytes, "dh");
  // Samples 6 to 11 of the stack, as floats, one column after the other
  std::string re, im;
  for (const std::size_t i : {6, 9, 7, 10, 8, 11}) {
    const auto sample = written.field.samples[i];
    for (auto* part : {&re, &im}) {
      const float value = part == &re ? sample.real() : sample.imag();
      part->append(reinterpret_cast<const char*>(&value), sizeof value);
    }
  }
  CHECK(bytes.find(re) != std::string::npos);
  CHECK(bytes.find(im) != std::string::npos);
}

/// Keys and values as NRSH reads them: lines are freed of spaces and split at colons, those with #
/// in front are skipped, keys are lower case (core/read_render_cfg.m).
std::map<std::string, std::string> read_by_nrsh(const std::string& text) {
  std::map<std::string, std::string> values;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::erase_if(line, [](unsigned char c) { return std::isspace(c) != 0; });
    if (line.empty() || line[0] == '#') continue;
    const auto colon = line.find(':');
    REQUIRE(colon != std::string::npos);
    values[line.substr(0, colon)] = line.substr(colon + 1);
  }
  return values;
}

TEST_CASE("NRSH finds the keys of JPEG Pleno's configurations, the hologram's numbers in them") {
  HologramSpec hologram{
      .resolution = {1920, 1080}, .pitch_m = {3.74e-6, 3.74e-6}, .wavelength_m = 632.8e-9};
  auto values = read_by_nrsh(nrsh_configuration(hologram, "hologram_nrsh.txt"));
  std::vector<std::string> keys;
  for (const auto& [key, value] : values) keys.push_back(key);
  CHECK(keys == std::vector<std::string>{"apod", "bit_depth", "hist_stretch", "method", "perc_clip",
                                         "perc_value", "pixel_pitch", "save_as_image",
                                         "save_as_mat", "save_intensity", "show", "wlen",
                                         "zero_pad"});
  CHECK(std::stod(values["wlen"]) == 632.8e-9);
  CHECK(std::stod(values["pixel_pitch"]) == 3.74e-6);
  CHECK(values["method"] == "ASM");
  CHECK(values["zero_pad"] == "1");
  CHECK(values["apod"] == "0");
  // NRSH cannot pad odd sizes.
  hologram.resolution = {1920, 1081};
  CHECK(read_by_nrsh(nrsh_configuration(hologram, ""))["zero_pad"] == "0");
}

TEST_CASE("NRSH's angular spectrum focuses a point at its depth by the configuration's numbers") {
  using Complex = std::complex<double>;
  constexpr int n = 64;
  const double z_m = 5e-3;
  HologramSpec hologram{.resolution = {n, n}, .pitch_m = {4e-6, 6e-6}, .wavelength_m = 532e-9};
  auto values = read_by_nrsh(nrsh_configuration(hologram, ""));
  const auto comma = values["pixel_pitch"].find(',');
  REQUIRE(comma != std::string::npos);
  // rec_asm.m: the first pitch is that of columns; light of a distance d is taken back by
  // exp(-2 pi i d sqrt(1 / wlen^2 - fx^2 - fy^2)).
  const double pitch_x = std::stod(values["pixel_pitch"]),
               pitch_y = std::stod(values["pixel_pitch"].substr(comma + 1)),
               wavelength_m = std::stod(values["wlen"]);
  // Light of a point behind the middle of column 40 and row 20 (docs/conventions.md)
  std::vector<Complex> field;
  for (int row = 0; row < n; ++row)
    for (int column = 0; column < n; ++column)
      field.push_back(std::polar(1.0, 2 * std::numbers::pi / hologram.wavelength_m *
                                          std::hypot((column - 40) * hologram.pitch_m.x,
                                                     (row - 20) * hologram.pitch_m.y, z_m)));
  const auto seen_at = [&](double depth_m) {
    auto spectrum = reference::direct_transform(field, {n, n}, -1);
    for (int v = 0; v < n; ++v) {
      for (int u = 0; u < n; ++u) {
        const double fx = (u < n / 2 ? u : u - n) / (n * pitch_x),
                     fy = (v < n / 2 ? v : v - n) / (n * pitch_y);
        const double w = std::sqrt(1 / (wavelength_m * wavelength_m) - fx * fx - fy * fy);
        spectrum[v * n + u] *= std::polar(1.0, -2 * std::numbers::pi * w * depth_m);
      }
    }
    return reference::direct_transform(spectrum, {n, n}, 1);
  };
  const auto brightest = [](const std::vector<Complex>& plane) {
    return std::max_element(plane.begin(), plane.end(),
                            [](Complex a, Complex b) { return std::norm(a) < std::norm(b); });
  };
  const auto in_focus = seen_at(z_m);
  const auto spot = brightest(in_focus);
  CHECK(spot - in_focus.begin() == 20 * n + 40);
  for (const double other_m : {-z_m, 0.5 * z_m, 1.5 * z_m}) {
    const auto plane = seen_at(other_m);
    CHECK(std::norm(*brightest(plane)) < 0.5 * std::norm(*spot));
  }
}

/// The three bytes of each pixel.
std::vector<std::array<int, 3>> colours(const Folder& folder, const std::string& name) {
  std::vector<std::array<int, 3>> pixels;
  for (std::size_t channel = 0; channel < 3; ++channel) {
    const auto picture = load_texture(folder / name, static_cast<int>(channel), "");
    pixels.resize(picture.pixels.size());
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const double linear = picture.pixels[i];
      const double srgb =
          linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
      pixels[i][channel] = static_cast<int>(std::lround(255 * srgb));
    }
  }
  return pixels;
}

TEST_CASE("10-bit levels are written exactly as words, as grey of 16 bits and over red and blue") {
  auto slm = by_phase();
  slm.bits = 10;
  slm.levels = slm.levels_per_turn = 1024;
  slm.flip_x = true;
  const Panel panel(slm, {1024, 1}, glm::dvec2(4e-6), 532e-9);
  std::vector<std::uint16_t> falling(1024), rising(1024);
  for (std::size_t i = 0; i < 1024; ++i) {
    rising[i] = static_cast<std::uint16_t>(i);
    falling[i] = static_cast<std::uint16_t>(1023 - i);
  }
  // Flipped, the falling levels rise in the files.
  const std::vector<std::vector<std::uint16_t>> levels{falling};
  const FieldStack field{1024, 1, 1, std::vector<std::complex<float>>(1024, 1)};
  const Folder folder;
  const auto saved = [&](PictureFormat format) {
    const auto names = save_pictures(folder / "", "hologram", format, panel, levels, field);
    REQUIRE(names.size() == 1);
    return folder / names[0];
  };
  const auto array = bytes_of(saved(PictureFormat::npy));
  CHECK_SAYS(array, "{'descr': '<u2', 'fortran_order': False, 'shape': (1, 1, 1024), }");
  const auto* words = array.data() + array.size() - 2048;
  const auto grey = load_levels(saved(PictureFormat::png16), "");
  const auto pixels = colours(folder, saved(PictureFormat::red_blue).filename());
  for (std::size_t i = 0; i < 1024; ++i) {
    CHECK(static_cast<std::uint8_t>(words[2 * i]) +
              256 * static_cast<std::uint8_t>(words[2 * i + 1]) ==
          rising[i]);
    CHECK(std::lround(grey.pixels[i] * 1023) == rising[i]);
    CHECK(pixels[i] == std::array<int, 3>{rising[i] / 4, 0, rising[i] % 4});
  }
  CHECK(grey.pixels.front() == 0);
  CHECK(grey.pixels.back() == 1);
  for (const auto format :
       {PictureFormat::png, PictureFormat::bmp, PictureFormat::tiff, PictureFormat::rgb_24x1})
    CHECK_REFUSED(saved(format), "takes levels of 8 bits, and slm.bits is 10; give --format png16");
  CHECK_REFUSED(Written(by_phase(), PictureFormat::red_blue, two_frames),
                "takes levels of 10 bits, and slm.bits is 8; give slm.bits = 10");
}

TEST_CASE("frames of few levels share the 24 bits of a colour, the first in red's lowest") {
  struct Case {
    PictureFormat format;
    int levels, bits;
  };
  for (const auto& [format, count, bits] : {Case{PictureFormat::rgb_24x1, 2, 1},
                                            {PictureFormat::rgb_12x2, 4, 2},
                                            {PictureFormat::rgb_8x3, 8, 3},
                                            {PictureFormat::rgb_6x4, 16, 4}}) {
    auto slm = by_phase();
    slm.levels = count;
    const int frames = 24 / bits;
    std::mt19937 random(1);
    Pictures levels(static_cast<std::size_t>(frames + 1));
    std::vector<std::uint32_t> expected(7);
    for (std::size_t k = 0; k < levels.size(); ++k) {
      for (std::size_t i = 0; i < 7; ++i) {
        const auto digit = static_cast<std::uint32_t>(random()) % static_cast<std::uint32_t>(count);
        levels[k].push_back(
            static_cast<std::uint8_t>(digit * 256 / static_cast<std::uint32_t>(count)));
        if (k + 1 < levels.size()) expected[i] |= digit << (static_cast<std::size_t>(bits) * k);
      }
    }
    const Written written(slm, format, levels, {7, 1});
    INFO(name_of(format));
    REQUIRE(written.names == std::vector<std::string>{"hologram.png", "hologram_2.png"});
    const auto first = colours(written.folder, "hologram.png");
    const auto second = colours(written.folder, "hologram_2.png");
    for (std::size_t i = 0; i < 7; ++i) {
      const auto [r, g, b] = first.at(i);
      CHECK(static_cast<std::uint32_t>(r | g << 8 | b << 16) == expected[i]);
      // The frame that is too many begins the next picture.
      const auto [next, zero_g, zero_b] = second.at(i);
      CHECK(next == levels.back()[i] * count / 256);
      CHECK((zero_g == 0 && zero_b == 0));
    }
  }
}

TEST_CASE("a DMD's dark and bright pixels are the bits 0 and 1") {
  SlmSpec slm{.encoding = Encoding::lee, .carrier = {0.2, 0}};
  const Written written(slm, PictureFormat::rgb_24x1, {{0, 255, 255, 0, 0, 255}});
  const auto pixels = colours(written.folder, "hologram.png");
  CHECK(pixels.at(0) == std::array{0, 0, 0});
  CHECK(pixels.at(1) == std::array{1, 0, 0});
}

TEST_CASE("formats that cannot hold the levels are refused with what can be done") {
  CHECK_REFUSED(Written(by_phase(), PictureFormat::rgb_24x1, two_frames),
                "--format rgb-24x1 takes pictures of at most 2 levels, and "
                "slm.levels is 256; give slm.levels = 2");
  auto slm = by_phase();
  slm.levels = 32;
  CHECK_REFUSED(Written(slm, PictureFormat::rgb_6x4, two_frames), "give slm.levels = 16");
  CHECK_REFUSED(picture_format_of("rgb-8x4"),
                "32 bits, and a RGB picture has 24; there are rgb-6x4 and rgb-8x3");
  CHECK_REFUSED(picture_format_of("gif"), "--format gif: unknown; there are png, png16, bmp");
}

}  // namespace
}  // namespace raywave
