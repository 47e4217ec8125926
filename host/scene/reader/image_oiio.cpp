// SPDX-License-Identifier: Apache-2.0
#include <OpenImageIO/imageio.h>
#include <fcntl.h>
#include <unistd.h>
#include <webp/decode.h>

#include <cstdint>
#include <fstream>
#include <iterator>
#include <memory>

#include "host/common/error.hpp"
#include "host/scene/reader/picture.hpp"

namespace raywave {
namespace {

/// A name under which OpenImageIO finds a file to read. It takes what stands behind a ? for options
/// of its own, so that such files go by their descriptors.
class OiioName {
public:
  explicit OiioName(const std::filesystem::path& file) : name_(file.string()) {
    if (name_.find('?') == std::string::npos) return;
    descriptor_ = open(file.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor_ >= 0) name_ = "/proc/self/fd/" + std::to_string(descriptor_);
  }
  ~OiioName() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  OiioName(const OiioName&) = delete;
  OiioName& operator=(const OiioName&) = delete;
  const std::string& text() const { return name_; }

private:
  std::string name_;
  int descriptor_ = -1;
};

/// Reads where OpenImageIO would multiply colours by alpha (WebP), by libwebp.
std::function<std::vector<float>(int)> webp_reader(const std::filesystem::path& file,
                                                   const OIIO::ImageSpec& spec) {
  return [file, width = spec.width, height = spec.height](int channel) {
    std::ifstream stream(file, std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(stream)), {});
    const auto pixels = std::size_t{1} * width * height;
    std::vector<std::uint8_t> rgba(4 * pixels);
    if (!WebPDecodeRGBAInto(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size(),
                            rgba.data(), rgba.size(), 4 * width))
      throw InputError("is a damaged WebP, or an animation");
    std::vector<float> numbers(pixels);
    for (std::size_t i = 0; i < pixels; ++i)
      numbers[i] = rgba[4 * i + static_cast<std::size_t>(channel)] / 255.0f;
    return numbers;
  };
}

}  // namespace

StoredPicture open_oiio(const std::filesystem::path& file) {
  // Threads count against the limits.
  OIIO::attribute("threads", 1);
  OIIO::attribute("exr_threads", -1);
  OIIO::ImageSpec as_stored;
  as_stored["oiio:UnassociatedAlpha"] = 1;  // colours not multiplied by alpha
  const OiioName name(file);
  const std::shared_ptr<OIIO::ImageInput> input = OIIO::ImageInput::open(name.text(), &as_stored);
  if (!input) {
    const auto reason = OIIO::geterror();
    if (!OIIO::ImageInput::create(name.text())) {
      OIIO::geterror();  // else it is printed at the end
      throw InputError("is no picture of a known format, such as PNG, JPEG, TIFF, TGA or EXR");
    }
    throw InputError(reason);
  }
  const OIIO::ImageSpec& spec = input->spec();
  StoredPicture picture{.width = spec.width,
                        .height = spec.depth > 1 ? 0 : spec.height,
                        .channels = spec.deep ? 0 : spec.nchannels,
                        .alpha_channel = spec.alpha_channel,
                        .kind = input->format_name(),
                        .type = spec.format.c_str(),
                        .is_float = spec.format.is_floating_point(),
                        .read = {}};
  if (picture.kind == "webp" && spec.nchannels == 4) {
    picture.read = webp_reader(file, spec);
    return picture;
  }
  picture.read = [input](int channel) {
    const OIIO::ImageSpec& of = input->spec();
    std::vector<float> numbers(std::size_t{1} * of.width * of.height);
    if (!input->read_image(0, 0, channel, channel + 1, OIIO::TypeFloat, numbers.data()))
      throw InputError(input->geterror());
    return numbers;
  };
  return picture;
}

}  // namespace raywave
