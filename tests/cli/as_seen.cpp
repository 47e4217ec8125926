// SPDX-License-Identifier: Apache-2.0
// From where pictures show what they show: a letter, an eye of its own, and what each must read.
#include <algorithm>
#include <cmath>
#include <complex>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <nlohmann/json.hpp>
#include <numbers>

#include "host/common/npy.hpp"
#include "host/scene/image.hpp"
#include "host/view/colour_picture.hpp"
#include "tests/support/program.hpp"

namespace raywave {
namespace {

using namespace test;

constexpr double z_m = 10e-3, pitch_m = 4e-6, wavelength_m = 638e-9;
constexpr int side_px = 64;

/// Bars of an F, as people read it: x to the right, y up, the letter 0.7 wide and 1 high.
struct Bar {
  double left, right, bottom, top;
};
constexpr Bar letter[] = {{0, 0.2, 0, 1}, {0.2, 0.7, 0.8, 1}, {0.2, 0.5, 0.4, 0.6}};

/// The letter's front is where z grows, as in programs that show meshes.
std::string letter_obj() {
  std::string text;
  int first = 1;
  for (const auto& [left, right, bottom, top] : letter) {
    for (const auto& [x, y] : {std::pair(left, bottom), {right, bottom}, {right, top}, {left, top}})
      text += "v " + std::to_string(x) + " " + std::to_string(y) + " 0\n";
    text += "f";
    for (int i = 0; i < 4; ++i) text += " " + std::to_string(first++);
    text += "\n";
  }
  return text;
}

/// A desk with a scene of the letter, 0.14 mm wide, turned by so many degrees about y.
void put_letter(const Desk& desk, int turned) {
  desk.folder().write("f.obj", letter_obj());
  desk.folder().write(
      "f.toml",
      "[hologram]\nresolution = [64, 64]\npitch = \"4 um\"\n[sampling]\npitch = "
      "\"5 um\"\nframes = 2\n[[light]]\ntype = \"ambient\"\n[[object]]\nmesh = "
      "\"f.obj\"\nwidth = \"0.14 mm\"\nposition = [0, 0, \"10 mm\"]\nrotation = [0, " +
          std::to_string(turned) + ", 0]\n");
}

/// The letter drawn as it is read, in the pixels of a picture.
Image drawn_letter() {
  Image image{side_px, side_px, {}};
  for (int row = 0; row < side_px; ++row)
    for (int column = 0; column < side_px; ++column) {
      const double x = (column - (side_px - 1) / 2.0) * pitch_m / 0.2e-3 + 0.35,
                   y = ((side_px - 1) / 2.0 - row) * pitch_m / 0.2e-3 + 0.5;
      float shown = 0;
      for (const auto& bar : letter)
        if (x >= bar.left && x <= bar.right && y >= bar.bottom && y <= bar.top) shown = 1;
      image.pixels.push_back(shown);
    }
  return image;
}

/// What an eye perceives whose lens is the hologram's place, and whose retina stands behind it. Its
/// lens is a phase, light travels by Huygens' direct sum in double precision, and a place of the
/// retina is perceived in the direction from it through the middle of the lens.
Image perceived(const FieldStack& field) {
  using Complex = std::complex<double>;
  constexpr double k = 2 * std::numbers::pi / wavelength_m, behind_m = 5e-3;
  constexpr double inverse_focal = 1 / z_m + 1 / behind_m;
  const glm::dvec3 ahead(0, 0, 1), up(0, 1, 0), right = glm::cross(ahead, up);
  Image image{side_px, side_px, {}};
  for (int row = 0; row < side_px; ++row)
    for (int column = 0; column < side_px; ++column) {
      const auto direction = ahead * z_m + right * ((column - (side_px - 1) / 2.0) * pitch_m) +
                             up * (((side_px - 1) / 2.0 - row) * pitch_m);
      const auto retina = -direction * (behind_m / z_m);
      double light = 0;
      for (int frame = 0; frame < field.frames; ++frame) {
        Complex sum = 0;
        for (int j = 0; j < field.ny; ++j)
          for (int i = 0; i < field.nx; ++i) {
            const double x = (i - (field.nx - 1) / 2.0) * pitch_m,
                         y = ((field.ny - 1) / 2.0 - j) * pitch_m;
            const double way = glm::length(retina - glm::dvec3(x, y, 0));
            const auto sample =
                field.samples[static_cast<std::size_t>((frame * field.ny + j) * field.nx + i)];
            sum += Complex(sample) *
                   std::polar(1.0, k * (way - behind_m - (x * x + y * y) / 2 * inverse_focal));
          }
        light += std::norm(sum);
      }
      image.pixels.push_back(static_cast<float>(light));
    }
  return image;
}

/// Of two pictures less their means: 1 where they are alike.
double likeness(const Image& a, const Image& b) {
  REQUIRE(a.pixels.size() == b.pixels.size());
  double mean_a = 0, mean_b = 0, product = 0, square_a = 0, square_b = 0;
  const auto count = static_cast<double>(a.pixels.size());
  for (const float value : a.pixels) mean_a += value / count;
  for (const float value : b.pixels) mean_b += value / count;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    const double x = a.pixels[i] - mean_a, y = b.pixels[i] - mean_b;
    product += x * y;
    square_a += x * x;
    square_b += y * y;
  }
  return product / std::sqrt(square_a * square_b);
}

Image mirrored(const Image& image) {
  Image other = image;
  for (int row = 0; row < image.height; ++row)
    for (int column = 0; column < image.width; ++column)
      other.pixels[static_cast<std::size_t>(row * image.width + column)] =
          image.pixels[static_cast<std::size_t>((row + 1) * image.width - 1 - column)];
  return other;
}

TEST_CASE(
    "pictures show what an eye perceives: a letter whose front faces it is read, not mirrored") {
  const Desk desk;
  put_letter(desk, 180);
  const auto run = [&](std::vector<std::string> words) {
    words.push_back("--quiet");
    desk.succeed(words);
  };
  const auto picture = [&](const char* name) { return load_grey(desk.file(name), ""); };
  run({"render", desk.file("f.toml"), "-o", desk.file("out")});
  run({"reconstruct", desk.file("out/field.npy"), "-z", "10mm", "-o", desk.file("eye")});
  run({"lens", desk.file("f.toml"), "-z", "10mm", "-o", desk.file("eye"), "--lens-points", "2"});
  const auto read = drawn_letter();
  const auto eye = perceived(load_npy(desk.file("out/field.npy")));
  for (const auto& [shown, least] : {std::pair(picture("eye/reconstruction_10mm.exr"), 0.99),
                                     {picture("eye/lens_10mm.exr"), 0.6}}) {
    CHECK(likeness(eye, shown) > least);
    CHECK(likeness(read, shown) > likeness(mirrored(read), shown) + 0.3);
  }
  CHECK(likeness(read, picture("eye/lens_10mm.exr")) > 0.9);

  // Arrays have x to the right as the light sees them; a camera without its lens shows the half
  // turn that it is built to undo, of what it would show with one
  for (const char* frame : {"hologram", "sensor"})
    run({"reconstruct", desk.file("out/field.npy"), "-z", "10mm", "-o", desk.file(frame), "--frame",
         frame});
  const auto seen = picture("eye/reconstruction_10mm.exr");
  CHECK(picture("hologram/reconstruction_10mm.exr").pixels == mirrored(seen).pixels);
  auto turned = seen;
  std::reverse(turned.pixels.begin(), turned.pixels.end());
  CHECK(picture("sensor/reconstruction_10mm.exr").pixels == turned.pixels);
  check_refused(desk.run({"reconstruct", desk.file("out/field.npy"), "-z", "10mm", "-o",
                          desk.file("eye"), "--frame", "mirror"}),
                2, "--frame \"mirror\": unknown; there are eye, sensor and hologram");
}

TEST_CASE("--view counts in the frame of the picture: to the right is the viewer's right") {
  const Desk desk;
  put_letter(desk, 180);
  const auto look = [&](const char* view, const char* frame) {
    const auto outcome =
        desk.succeed({"lens", desk.file("f.toml"), "-z", "9mm", "-o", desk.file(frame),
                      "--lens-points", "2", "--view", view, "--frame", frame});
    CHECK_THAT(outcome.out, Catch::Matchers::ContainsSubstring(", seen "));
    return load_grey(desk.file(frame) + "/lens_9mm.exr", "");
  };
  CHECK(look("1,0", "eye").pixels == mirrored(look("-1,0", "hologram")).pixels);
  // Seen from the right, what lies behind the plane in focus moves to the right
  const auto middle = [](const Image& image) {
    double sum = 0, light = 0;
    for (int row = 0; row < image.height; ++row)
      for (int column = 0; column < image.width; ++column) {
        const double value = image.pixels[static_cast<std::size_t>(row * image.width + column)];
        sum += column * value;
        light += value;
      }
    return sum / light;
  };
  CHECK(middle(look("1,0", "eye")) > middle(look("-1,0", "eye")) + 1);
}

TEST_CASE(
    "plan says of an open surface that turns its back to the viewer that it does, of others not") {
  const Desk desk;
  const auto says = [&](const std::string& text) {
    return desk.run({"plan", desk.file("f.toml")}).out.find(text) != std::string::npos;
  };
  const auto move = [&](const char* z) {
    auto scene = bytes_of(desk.file("f.toml"));
    scene.replace(scene.find("\"10 mm\""), 7, z);
    desk.folder().write("f.toml", scene);
  };
  for (const auto& [turned, is_behind] :
       {std::pair(180, false), {0, true}, {89, true}, {91, false}})
    for (const char* z : {"\"10 mm\"", "\"-10 mm\""}) {
      INFO(turned << " degrees at " << z);
      put_letter(desk, turned);
      move(z);
      CHECK(says("open"));
      CHECK(says("open, seen from behind") == is_behind);
    }
}

/// Whether each pixel that one shows brighter than half of its brightest is near one that the other
/// does.
bool is_within_a_pixel(const Image& a, const Image& b) {
  REQUIRE(a.width == b.width);
  REQUIRE(a.height == b.height);
  const auto lit = [](const Image& image, int column, int row) {
    const float most = *std::max_element(image.pixels.begin(), image.pixels.end());
    return column >= 0 && row >= 0 && column < image.width && row < image.height &&
           image.pixels[static_cast<std::size_t>(row * image.width + column)] > most / 2;
  };
  for (int row = 0; row < a.height; ++row)
    for (int column = 0; column < a.width; ++column) {
      if (!lit(a, column, row)) continue;
      bool is_near = false;
      for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x) is_near = is_near || lit(b, column + x, row + y);
      if (!is_near) return false;
    }
  return true;
}

TEST_CASE("preview has the lens's outlines within a pixel, and by default shows all of the scene") {
  const Desk desk;
  put_letter(desk, 180);
  const auto run = [&](std::vector<std::string> words) {
    words.insert(words.begin() + 1, desk.file("f.toml"));
    words.insert(words.end(), {"-o", desk.file("seen"), "--json"});
    const auto outcome = desk.succeed(words);
    const auto json = nlohmann::json::parse(outcome.out);
    return load_grey(json.value("exr", desk.file("seen/lens_10mm.exr")), "");
  };
  const std::string window = "0.256mmx0.256mm";
  const auto preview = run({"preview", "-z", "10mm", "--window", window}),
             lens = run({"lens", "-z", "10mm", "--window", window, "--lens-points", "24"});
  CHECK(is_within_a_pixel(preview, lens));
  CHECK(is_within_a_pixel(lens, preview));
  CHECK_FALSE(is_within_a_pixel(preview, mirrored(lens)));

  // A letter wider than the hologram: all of its edges are dark
  for (const char* width : {"object.0.width=1 mm", "object.0.width=50 um"}) {
    const auto whole = run({"preview", "--set", width});
    float most = 0, at_edge = 0;
    for (int row = 0; row < whole.height; ++row)
      for (int column = 0; column < whole.width; ++column) {
        const float value = whole.pixels[static_cast<std::size_t>(row * whole.width + column)];
        most = std::max(most, value);
        if (column == 0 || row == 0 || column == whole.width - 1 || row == whole.height - 1)
          at_edge = std::max(at_edge, value);
      }
    CHECK(most > 0);
    CHECK(at_edge == 0);
    CHECK(whole.width > 10);
    CHECK(whole.width <= 320);
  }
  check_refused(
      desk.run({"preview", desk.file("f.toml"), "-z", "1mm", "-z", "2mm", "-o", desk.file("seen")}),
      2, "give one");
}

TEST_CASE("preview warns of what a viewer does not see, and says that it is black") {
  const Desk desk;
  const auto at = [&](const std::string& place, const char* exposure = "--percentile") {
    return desk
        .run({"preview", desk.file("scene.toml"), "-o", desk.file("seen"), "--set",
              "object.0.position=" + place, exposure, "99.5"})
        .err;
  };
  CHECK(at("[0, 0, '10 mm']").empty());
  for (const char* option : {"--percentile", "--white"})
    CHECK_SAYS(at("['50 mm', 0, '10 mm']", option), "the scene begins 49.9 mm beside",
               "nothing is seen in");
  CHECK_SAYS(at("[0, 0, '-500 mm']"), "behind the viewer's eye");
}

/// The share of the lit pixels of `a` that show no lit pixel of `b` in their place, or within one
/// pixel of the coarser picture beside it. `b` is moved by some of its pixels.
double share_apart(const Image& a, const Image& b, int moved = 0) {
  const auto value = [](const Image& image, int column, int row) {
    return column >= 0 && row >= 0 && column < image.width && row < image.height
               ? image.pixels[static_cast<std::size_t>(row * image.width + column)]
               : 0;
  };
  const double scale = double{1} * b.width / a.width;  // pixels of b in one of a
  const double reach = std::max(1.0, scale);
  int lit = 0, apart = 0;
  for (int row = 0; row < a.height; ++row)
    for (int column = 0; column < a.width; ++column) {
      if (!(value(a, column, row) > 0)) continue;
      ++lit;
      const double x = (column + 0.5) * scale - 0.5 + moved, y = (row + 0.5) * scale - 0.5;
      bool is_near = false;
      for (int i = static_cast<int>(std::floor(y - reach)); i <= y + reach + 1; ++i)
        for (int k = static_cast<int>(std::floor(x - reach)); k <= x + reach + 1; ++k)
          is_near = is_near || value(b, k, i) > 0;
      apart += is_near ? 0 : 1;
    }
  return lit > 0 ? double{1} * apart / lit : 1;
}

TEST_CASE("previews of whole scenes have the lens's outlines within a pixel", "[slow]") {
  const Desk desk;
  for (const auto& [name, window] : {std::pair("wire", "8mmx8mm"), {"still_life", "12mmx12mm"}}) {
    INFO(name);
    const auto picture = [&, name = name, window = window](const std::string& command,
                                                           std::vector<std::string> more) {
      std::vector<std::string> words{command};
      for (const auto& word :
           {RAYWAVE_DATA_DIR "/" + std::string(name) + ".toml", std::string("-z"),
            std::string("100mm"), std::string("--window"), std::string(window), std::string("-o"),
            desk.file("seen"), std::string("--set"), std::string("hologram.pitch=12 um")})
        words.push_back(word);
      desk.succeed(words, more);
      return load_grey(desk.file(command == "lens" ? "seen/lens_100mm.exr" : "seen/preview.exr"),
                       "");
    };
    const auto preview = picture("preview", {}),
               lens = picture("lens", {"--aperture", "0.01", "--lens-points", "1"});
    REQUIRE(lens.width >= 2 * preview.width);
    CHECK(share_apart(preview, lens) < 0.001);
    CHECK(share_apart(lens, preview) < 0.001);
    CHECK(share_apart(lens, preview, 4) > 0.005);
  }
}

TEST_CASE("PNGs of reconstruct are blurred by what an eye makes out, EXRs are not") {
  const Desk desk;
  put_letter(desk, 180);
  desk.succeed({"render", desk.file("f.toml"), "-o", desk.file("out"), "--quiet"});
  const auto look = [&](const std::vector<std::string>& more) {
    const auto told = desk.succeed({"reconstruct", desk.file("out/field.npy"), "-z", "10mm", "-o",
                                    desk.file("seen"), "--json"},
                                   more);
    return nlohmann::json::parse(told.out).at("pictures").at(0);
  };
  const auto exr = desk.file("seen/reconstruction_10mm.exr"),
             png = desk.file("seen/reconstruction_10mm.png");
  look({"--blur", "0px"});
  const auto sharp = load_grey(exr, ""), sharp_png = load_grey(png, "");
  // 0.6 of an arc minute from 250 mm before the hologram to 10 mm beyond it
  const auto by_eye = look({});
  CHECK(by_eye.at("png_blur_px").get<double>() ==
        Catch::Approx(0.6 * std::numbers::pi / 10800 * 0.26 / pitch_m));
  CHECK(load_grey(exr, "").pixels == sharp.pixels);
  CHECK(load_grey(png, "").pixels != sharp_png.pixels);
  CHECK(look({"--blur", "8um"}).at("png_blur_px").get<double>() == Catch::Approx(2));
}

}  // namespace
}  // namespace raywave
