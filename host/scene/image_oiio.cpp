// SPDX-License-Identifier: Apache-2.0
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <cstring>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "host/common/error.hpp"
#include "host/common/output.hpp"
#include "host/common/text.hpp"
#include "host/scene/image.hpp"
#include "host/scene/oiio_name.hpp"

namespace raywave {
namespace {

/// Holograms are small for OpenImageIO: its threads take longer to end than they save.
void stay_in_one_thread() {
  [[maybe_unused]] static const bool once =
      OIIO::attribute("threads", 1) && OIIO::attribute("exr_threads", -1);
}

/// True when a picture file holds these pixels.
bool holds(const std::filesystem::path& file, const OIIO::ImageSpec& spec, const void* pixels) {
  const OiioName name(file);
  const auto input = OIIO::ImageInput::open(name.text());
  if (!input || input->spec().width != spec.width || input->spec().height != spec.height ||
      input->spec().nchannels != spec.nchannels)
    return false;
  std::vector<unsigned char> read(spec.image_bytes());
  return input->read_image(0, 0, 0, spec.nchannels, spec.format, read.data()) &&
         std::memcmp(read.data(), pixels, read.size()) == 0;
}

/// Writes a picture in the format that the file's name tells.
class Writer {
public:
  Writer(std::filesystem::path file, OIIO::ImageSpec spec, const void* pixels)
      : file_(std::move(file)), spec_(std::move(spec)), pixels_(pixels) {
    stay_in_one_thread();
    output_ = OIIO::ImageOutput::create(file_.string());
    check(output_ != nullptr);
  }

  bool reaches_memory() const { return output_->supports("ioproxy"); }

  void write_to_memory(std::vector<std::uint8_t>& bytes) {
    bytes.clear();
    bytes.reserve(spec_.image_bytes());
    OIIO::Filesystem::IOVecOutput memory(bytes);
    check(output_->set_ioproxy(&memory));
    write_to(file_);
  }

  void write_to(const std::filesystem::path& file) {
    check(output_->open(file.string(), spec_));
    check(output_->write_image(spec_.format, pixels_));
    check(output_->close());
  }

private:
  void check(bool done) const {
    if (!done)
      throw InputError(in_quotes(file_.string()) + ": cannot be written: " +
                       one_line(output_ ? output_->geterror() : OIIO::geterror()));
  }

  std::filesystem::path file_;
  OIIO::ImageSpec spec_;
  const void* pixels_;
  std::unique_ptr<OIIO::ImageOutput> output_;
};

/// A picture of as many channels as its numbers fill.
OIIO::ImageSpec spec_of(int width, int height, std::size_t numbers, OIIO::TypeDesc format) {
  const auto pixels = width < 1 || height < 1 ? 0 : std::size_t{1} * width * height;
  if (pixels == 0 || numbers < pixels || numbers > 3 * pixels || numbers % pixels != 0)
    throw std::invalid_argument("save_picture: the pixels do not fill width * height");
  OIIO::ImageSpec spec(width, height, static_cast<int>(numbers / pixels), format);
  // OpenEXR files would hold today's, and equal runs differ
  if (format == OIIO::TypeFloat) spec.attribute("DateTime", "1970:01:01 00:00:00");
  return spec;
}

/// OpenImageIO's writers do not say when a disk is full. So they write to memory; where a format
/// cannot, the file is read again.
void save(const std::filesystem::path& file, const OIIO::ImageSpec& spec, const void* pixels) {
  Writer writer(file, spec, pixels);
  if (writer.reaches_memory()) {
    std::vector<std::uint8_t> bytes;
    writer.write_to_memory(bytes);
    write_whole(file, [&](OutputFile& to) { to.write(bytes.data(), bytes.size()); });
  } else {
    write_whole_by_name(file, [&](const std::filesystem::path& temporary) {
      writer.write_to(temporary);
      if (!holds(temporary, spec, pixels))
        throw InputError(in_quotes(file.string()) +
                         ": cannot be written: what lies there is another picture; is the disk "
                         "full?");
    });
  }
}

}  // namespace

void save_picture(const std::filesystem::path& file, int width, int height,
                  std::span<const std::uint8_t> pixels) {
  save(file, spec_of(width, height, pixels.size(), OIIO::TypeUInt8), pixels.data());
}

void save_picture(const std::filesystem::path& file, int width, int height,
                  std::span<const std::uint16_t> pixels) {
  save(file, spec_of(width, height, pixels.size(), OIIO::TypeUInt16), pixels.data());
}

void save_picture(const std::filesystem::path& file, int width, int height,
                  std::span<const float> pixels) {
  save(file, spec_of(width, height, pixels.size(), OIIO::TypeFloat), pixels.data());
}

void save_picture(const std::filesystem::path& file, int width, int height,
                  std::span<const std::complex<float>> pixels) {
  save(file, spec_of(width, height, 2 * pixels.size(), OIIO::TypeFloat), pixels.data());
}

void uncompressed_png(int width, int height, std::span<const std::uint8_t> levels,
                      std::vector<std::uint8_t>& png) {
  auto spec = spec_of(width, height, levels.size(), OIIO::TypeUInt8);
  spec.attribute("png:compressionLevel", 0);
  spec.attribute("png:filter", 8);  // none
  Writer("levels.png", spec, levels.data()).write_to_memory(png);
}

}  // namespace raywave
