// SPDX-License-Identifier: Apache-2.0
#include "tests/support/files.hpp"

#include <sys/resource.h>

#include <cmath>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <tuple>

#include "host/common/output.hpp"
#include "host/encode/pictures.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/forked_reader.hpp"

using namespace raywave;
using Catch::Matchers::StartsWith;

namespace {

using Complex = std::complex<float>;

/// A .npy file written from the format's description, independent of save_npy.
template <class Sample>
std::string npy(const std::string& dictionary, const std::vector<Sample>& samples, int major = 1) {
  std::string bytes = "\x93NUMPY";
  bytes += static_cast<char>(major);
  bytes += '\0';
  for (int shift = 0; shift < (major == 1 ? 16 : 32); shift += 8)
    bytes += static_cast<char>(dictionary.size() >> shift & 255);
  bytes += dictionary;
  return bytes.append(reinterpret_cast<const char*>(samples.data()),
                      samples.size() * sizeof(Sample));
}

/// A portable float map, the simplest float picture format. Rows go from the bottom up.
std::string pfm(int width, int height, const std::vector<float>& pixels) {
  std::string bytes = "Pf\n" + std::to_string(width) + " " + std::to_string(height) + "\n-1.0\n";
  return bytes.append(reinterpret_cast<const char*>(pixels.data()), pixels.size() * sizeof(float));
}

/// A portable grey map of 8 bits. Rows go from the top down.
std::string pgm(int width, int height, const std::string& samples) {
  return "P5\n" + std::to_string(width) + " " + std::to_string(height) + "\n255\n" + samples;
}

/// A little-endian TIFF of one row of 16-bit grey samples, uncompressed.
std::string tiff16(const std::vector<std::uint16_t>& samples) {
  std::string bytes = "II";
  const auto put = [&](auto value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  const auto count = static_cast<std::uint32_t>(samples.size());
  const std::vector<std::pair<int, std::uint32_t>> tags{
      {256, count}, {257, 1}, {258, 16},       {259, 1}, {262, 1}, {273, 8 + 2 + 9 * 12 + 4},
      {277, 1},     {278, 1}, {279, 2 * count}};
  put(std::uint16_t{42});
  put(std::uint32_t{8});
  put(static_cast<std::uint16_t>(tags.size()));
  for (const auto& [tag, value] : tags) {
    put(static_cast<std::uint16_t>(tag));
    put(std::uint16_t{4});  // a 32-bit number
    put(std::uint32_t{1});
    put(value);
  }
  put(std::uint32_t{0});
  for (const std::uint16_t sample : samples) put(sample);
  return bytes;
}

}  // namespace

TEST_CASE("a field is read back as it was saved") {
  const Folder folder;
  for (const auto& [nx, ny, frames] :
       std::vector<std::tuple<int, int, int>>{{1, 1, 1}, {3, 2, 1}, {5, 7, 3}, {1000, 1, 1}}) {
    std::vector<Complex> samples(static_cast<std::size_t>(nx) * ny * frames);
    for (std::size_t i = 0; i < samples.size(); ++i)
      samples[i] = {static_cast<float>(i) + 0.25f, -static_cast<float>(i)};
    save_npy(folder / "field.npy", nx, ny, frames, samples);
    const FieldStack field = load_npy(folder / "field.npy");
    CHECK(field.nx == nx);
    CHECK(field.ny == ny);
    CHECK(field.frames == frames);
    CHECK(field.samples == samples);
  }
  CHECK(folder.count() == 1);
}

TEST_CASE("a saved field matches the format description byte by byte") {
  const Folder folder;
  const std::vector<Complex> samples{{1, 2}, {3, 4}};
  save_npy(folder / "field.npy", 2, 1, 1, samples);
  const std::string dictionary = "{'descr': '<c8', 'fortran_order': False, 'shape': (1, 2), }";
  CHECK(bytes_of(folder / "field.npy") ==
        npy(dictionary + std::string(128 - 10 - 1 - dictionary.size(), ' ') + "\n", samples));
  save_npy(folder / "frames.npy", 1, 1, 2, samples);
  CHECK_SAYS(bytes_of(folder / "frames.npy"), "'shape': (2, 1, 1), }");
}

TEST_CASE(
    "every version of the format is read, with keys in any order, and doubles become floats") {
  const Folder folder;
  const std::vector<std::complex<double>> doubles{{1, 2}, {3, 0.1}, {5, 6}};
  for (const int major : {1, 2, 3}) {
    const auto file = folder.write(
        "a.npy", npy("{\"shape\":(3,1),'fortran_order':False , 'descr':'<c16'}\n", doubles, major));
    const FieldStack field = load_npy(file);
    CHECK(field.nx == 1);
    CHECK(field.ny == 3);
    CHECK(field.samples == std::vector<Complex>{{1, 2}, {3, 0.1f}, {5, 6}});
  }
}

TEST_CASE("unusable fields are refused with the reason") {
  const Folder folder;
  const std::vector<Complex> two{{1, 2}, {3, 4}};
  const auto refusal = [&](const std::string& dictionary, const std::vector<Complex>& samples) {
    return input_error_of([&] { load_npy(folder.write("a.npy", npy(dictionary, samples))); });
  };
  const std::string good = "{'descr': '<c8', 'fortran_order': False, 'shape': (1, 2), }\n";
  CHECK(refusal(good, two) == "");
  CHECK_SAYS(refusal(good, {{1, 2}}), "its shape asks for 16 bytes of samples, and the file has 8");
  CHECK_SAYS(refusal(good, {{1, 2}, {3, 4}, {5, 6}}), "and the file has 24");
  CHECK_SAYS(refusal(good, {{1, 2}, {std::nanf(""), 4}}), "sample 1 is NaN or beyond float");
  CHECK_SAYS(refusal(good, {{INFINITY, 2}, {3, 4}}), "sample 0 is NaN or beyond float");
  CHECK_SAYS(refusal("{'descr': '<f8', 'fortran_order': False, 'shape': (1, 2), }", two),
             "its type is \"<f8\"");
  CHECK_SAYS(refusal("{'descr': '>c8', 'fortran_order': False, 'shape': (1, 2), }", two),
             "its type is \">c8\"");
  CHECK_SAYS(refusal("{'descr': '<c8', 'fortran_order': True, 'shape': (1, 2), }", two),
             "in Fortran order");
  CHECK_SAYS(refusal("{'descr': '<c8', 'fortran_order': False, 'shape': (2,), }", two),
             "has 1 dimensions");
  CHECK_SAYS(refusal("{'descr': '<c8', 'fortran_order': False, 'shape': (), }", two),
             "has 0 dimensions");
  CHECK_SAYS(refusal("{'descr': '<c8', 'fortran_order': False, 'shape': (0, 2), }", {}),
             "every side must be 1 to");
  for (const char* shape : {"65536, 1048576, 1048576", "4294967296, 4294967296",
                            "9223372036854775807, 9223372036854775807, 4"})
    CHECK(
        refusal("{'descr': '<c8', 'fortran_order': False, 'shape': (" + std::string(shape) + "), }",
                two) != "");
  for (const char* dictionary :
       {"", "{", "{}", "{'descr': '<c8', 'fortran_order': False}",
        "{'descr': '<c8', 'descr': '<c8', 'fortran_order': False, 'shape': (1, 2)}",
        "{'descr': '<c8', 'fortran_order': False, 'shape': (-1, 2)}",
        "{'descr': '<c8', 'fortran_order': False, 'shape': (1, 2)} x",
        "{'descr': '<c8', 'fortran_order': 0, 'shape': (1, 2)}",
        "{'descr': [('a', '<c8')], 'fortran_order': False, 'shape': (1, 2)}",
        "{'descr': '<c8', 'fortran_order': False, 'shape': (1 2)}",
        "{'descr': '<c8', 'fortran_order': False, 'shape': (99999999999999999999, 2)}"})
    CHECK_SAYS(refusal(dictionary, two), "is no .npy file");
  CHECK_REFUSED(load_npy(folder.write("a.npy", npy(good, two, 4))), "is no .npy file");
  CHECK_REFUSED(load_npy(folder / "none.npy"), "there is no such file");
  CHECK_REFUSED(load_npy(folder / ""), "there is no such file");

  const std::vector<std::complex<double>> large{{1e39, 0}, {0, 0}};
  CHECK_REFUSED(
      load_npy(folder.write(
          "a.npy", npy("{'descr': '<c16', 'fortran_order': False, 'shape': (1, 2)}", large))),
      "sample 0 is NaN or beyond float");
}

TEST_CASE("damaged fields load or are refused in one line") {
  const Folder folder;
  save_npy(folder / "field.npy", 4, 3, 1, std::vector<Complex>(12, {1, -1}));
  const auto [accepted, refused] = read_damaged(folder, folder / "field.npy", 200, 1000,
                                                [](const auto& damaged) { load_npy(damaged); });
  CHECK(accepted > 100);
  CHECK(refused > 500);
}

TEST_CASE("levels come back from a PNG exactly, row 0 first") {
  const Folder folder;
  std::vector<std::uint8_t> levels(256 * 3);
  for (std::size_t i = 0; i < levels.size(); ++i)
    levels[i] = static_cast<std::uint8_t>(i + i / 256);
  save_picture(folder / "levels.png", 256, 3, levels);
  const Image image = load_levels(folder / "levels.png", "here");
  REQUIRE(image.width == 256);
  REQUIRE(image.height == 3);
  for (std::size_t i = 0; i < levels.size(); ++i)
    CHECK(std::lround(image.pixels[i] * 255) == levels[i]);
  CHECK(folder.count() == 1);
}

TEST_CASE("levels of 16 bits keep their steps") {
  const Folder folder;
  const Image image = load_levels(folder.write("a.tif", tiff16({0, 1, 32768, 65535})), "");
  CHECK(image.pixels == std::vector<float>{0, 1 / 65535.0f, 32768 / 65535.0f, 1});
}

TEST_CASE("integer textures are decoded from sRGB, channel by channel") {
  const Folder folder;
  const std::vector<std::uint8_t> pixels{0, 128, 255, 188, 10, 11};
  save_picture(folder / "a.png", 2, 1, pixels);
  for (int channel = 0; channel < 3; ++channel) {
    const Image image = load_texture(folder / "a.png", channel, "");
    REQUIRE(image.pixels.size() == 2);
    for (int x = 0; x < 2; ++x) {
      const double stored = pixels[3 * x + channel] / 255.0;
      // IEC 61966-2-1
      const double linear =
          stored <= 0.04045 ? stored / 12.92 : std::pow((stored + 0.055) / 1.055, 2.4);
      CHECK_THAT(image.pixels[x], Catch::Matchers::WithinAbs(linear, 1e-6));
    }
  }
}

TEST_CASE("a grey texture serves every channel") {
  const Folder folder;
  save_picture(folder / "a.png", 2, 2, std::vector<std::uint8_t>{0, 255, 128, 64});
  CHECK(load_texture(folder / "a.png", 2, "").pixels ==
        load_texture(folder / "a.png", 0, "").pixels);
}

TEST_CASE("float pictures are linear and come back exactly") {
  const Folder folder;
  const std::vector<float> pixels{0, 1e-8f, 0.5f, 1, 1000, -1};
  save_picture(folder / "a.exr", 3, 2, pixels);
  CHECK(load_texture(folder / "a.exr", 1, "").pixels == pixels);
}

TEST_CASE("unusable pictures are refused with the reason, before memory is taken") {
  const Folder folder;
  const auto refusal = [&](const std::filesystem::path& file) {
    return input_error_of([&] { load_texture(file, 0, "here"); });
  };
  CHECK(refusal(folder / "none.png") ==
        "here: picture \"" + (folder / "none.png").string() + "\": there is no such file");
  CHECK_SAYS(refusal(folder / ""), "is a folder, no file");
  for (const char* name : {"empty.png", "empty.exr", "empty.jpg", "empty", "empty.xyz"})
    CHECK_THAT(refusal(folder.write(name, "")), StartsWith("here: picture \""));
  CHECK_SAYS(refusal(folder.write("a.pgm", pgm(16385, 1, std::string(16385, 'x')))),
             "its size is 16385 x 1, and each side must be 1 to 16384");
  CHECK_THAT(refusal(folder.write("b.pgm", pgm(2000000000, 2000000000, "x"))),
             StartsWith("here: picture \""));
  save_picture(folder / "whole.png", 100, 100, std::vector<std::uint8_t>(10000, 9));
  const std::string whole = bytes_of(folder / "whole.png");
  CHECK_THAT(refusal(folder.write("cut.png", whole.substr(0, whole.size() / 2))),
             StartsWith("here: picture \""));
  CHECK_SAYS(refusal(folder.write("nan.pfm", pfm(2, 1, {0, std::nanf("")}))),
             "holds NaN or infinity");
  save_picture(folder / "inf.exr", 2, 1, std::vector<float>{0, INFINITY});
  CHECK_SAYS(refusal(folder / "inf.exr"), "holds NaN or infinity");
  save_picture(folder / "rgb.png", 1, 1, std::vector<std::uint8_t>{1, 2, 3});
  CHECK_REFUSED(load_levels(folder / "rgb.png", ""),
                "must be grey of 8 or 16 bits; it has 3 channels of type uint8");
  save_picture(folder / "grey.exr", 1, 1, std::vector<float>{1});
  CHECK_REFUSED(load_levels(folder / "grey.exr", ""),
                "is a picture of kind openexr, which may lose levels");
}

TEST_CASE("damaged pictures load or are refused in one line", "[slow]") {
  const Folder folder;
  save_picture(folder / "a.png", 16, 16, std::vector<std::uint8_t>(256, 100));
  save_picture(folder / "a.exr", 16, 16, std::vector<float>(256, 0.5f));
  for (const char* name : {"a.png", "a.exr"}) {
    INFO(name);
    bool all_finite = true;
    const auto [accepted, refused] =
        read_damaged(folder, folder / name, 100, 300, [&](const auto& damaged) {
          for (const float v : test::load_texture_in_fork(damaged, 0).pixels)
            all_finite = all_finite && std::isfinite(v);
        });
    CHECK(all_finite);
    CHECK(refused > 0);
    CHECK(accepted + refused > 300);
  }
}

TEST_CASE("a file appears whole or not at all") {
  const Folder folder;
  const auto file = folder / "deep/er/a.txt";
  write_text(file, "first");
  CHECK(bytes_of(file) == "first");
  write_text(file, "second");
  CHECK(bytes_of(file) == "second");

  std::filesystem::path seen;
  CHECK_THROWS_AS(write_whole_by_name(file,
                                      [&](const auto& temporary) {
                                        seen = temporary;
                                        std::ofstream(temporary) << "half";
                                        throw std::runtime_error("disk full");
                                      }),
                  std::runtime_error);
  CHECK(bytes_of(file) == "second");
  CHECK_FALSE(std::filesystem::exists(seen));
  CHECK(seen.parent_path() == file.parent_path());
  CHECK(seen.extension() == ".txt");
  CHECK(seen != file);
}

namespace {
/// Files of this process cannot grow beyond some bytes while it lives, as on a full disk.
class FullDisk {
public:
  explicit FullDisk(rlim_t bytes) {
    signal_ = std::signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;
  ~FullDisk() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, signal_);
  }

private:
  rlimit before_{};
  void (*signal_)(int) = SIG_DFL;
};
}  // namespace

TEST_CASE("on a full disk every format is an error, the old file stays, and nothing else is left") {
  constexpr int nx = 120, ny = 90;
  constexpr std::size_t pixels = 120 * 90;
  std::mt19937 random(1);  // so that nothing compresses
  std::vector<std::uint8_t> bytes(3 * pixels);
  std::vector<std::uint16_t> words(pixels);
  std::vector<float> values(pixels);
  std::vector<Complex> field(pixels);
  for (auto& v : bytes) v = static_cast<std::uint8_t>(random());
  for (auto& v : words) v = static_cast<std::uint16_t>(random());
  for (auto& v : values) v = static_cast<float>(random());
  for (auto& v : field) v = {static_cast<float>(random()), static_cast<float>(random())};
  const std::span<const std::uint8_t> grey(bytes.data(), pixels);
  using Save = std::function<void(const std::filesystem::path&)>;
  const std::vector<std::pair<std::string, Save>> formats{
      {"a.png", [&](const auto& file) { save_picture(file, nx, ny, grey); }},
      {"rgb.png", [&](const auto& file) { save_picture(file, nx, ny, bytes); }},
      {"b.png", [&](const auto& file) { save_picture(file, nx, ny, words); }},
      {"a.bmp", [&](const auto& file) { save_picture(file, nx, ny, grey); }},
      {"a.tif", [&](const auto& file) { save_picture(file, nx, ny, grey); }},
      {"a.exr", [&](const auto& file) { save_picture(file, nx, ny, values); }},
      {"b.exr", [&](const auto& file) { save_picture(file, nx, ny, field); }},
      {"a.npy", [&](const auto& file) { save_npy(file, nx, ny, 1, grey); }},
      {"a.txt", [&](const auto& file) { write_text(file, std::string(pixels, 'x')); }},
      {"a.mat", [&](const auto& file) { save_mat(file, nx, ny, field); }},
  };
  const Folder folder;
  for (const auto& [name, save] : formats) {
    INFO(name);
    const auto file = folder / name;
    try {
      save(file);
    } catch (const InputError& error) {
      REQUIRE_SAYS(error.what(), "without libmatio");
      continue;
    }
    const auto whole = bytes_of(file);
    REQUIRE(whole.size() >= pixels);
    // Room for nothing, for some of it, and for all but the last byte
    for (const std::size_t room : {std::size_t{0}, whole.size() / 2, whole.size() - 1}) {
      INFO(room << " of " << whole.size() << " bytes");
      const FullDisk full(room);
      CHECK_THAT(input_error_of([&, &save = save] { save(file); }),
                 StartsWith("\"" + file.string() + "\": cannot be written"));
    }
    const bool is_same = bytes_of(file) == whole;
    CHECK(is_same);
    CHECK(folder.count() == 1);
    std::filesystem::remove(file);
  }
}

TEST_CASE("paths that cannot be written are refused, and no file is left behind") {
  const Folder folder;
  folder.write("file", "");
  CHECK_REFUSED(write_text(folder / "file/a.txt", "x"), "the folder cannot be made");
  std::filesystem::create_directories(folder / "folder/full");
  CHECK_REFUSED(write_text(folder / "folder", "x"), "cannot be written");
  CHECK_REFUSED(save_picture(folder / "folder", 1, 1, std::vector<std::uint8_t>{1}),
                "cannot be written");
  CHECK_REFUSED(save_picture(folder / "a.no-such-format", 1, 1, std::vector<float>{1}),
                "cannot be written");
  CHECK(folder.count() == 2);
}
