// SPDX-License-Identifier: Apache-2.0
#include "host/scene/image.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <stdexcept>
#include <string_view>

#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/scene/reader_process.hpp"
#include "host/scene/reader_reply.hpp"

namespace raywave {
namespace {

[[noreturn]] void fail(const std::string& where, const std::string& name, std::string_view what) {
  throw InputError((where.empty() ? "" : where + ": ") + "picture " + in_quotes(name) + ": " +
                   one_line(what));
}

/// arguments  of raywave_image_reader: the kind, the file, and what the kind needs besides
/// input      what the reader has as its input; -1: nothing
std::vector<Image> load_safely(const std::string& name, const std::string& where,
                               const std::vector<std::string>& arguments, int input = -1) {
  const auto program = find_reader("raywave_image_reader");
  std::vector<Image> channels;
  try {
    run_reader(
        program, {30, std::uint64_t{6} << 30}, arguments,
        [&](ReaderPipe& pipe) {
          channels = receive_channels(pipe);
          if (channels.empty()) throw std::runtime_error("its reader returned nonsense");
        },
        input);
  } catch (const std::exception& failure) {
    fail(where, name, failure.what());
  }
  return channels;
}

std::vector<Image> load_file(const std::filesystem::path& file, const std::string& where,
                             const std::vector<std::string>& arguments) {
  std::error_code error;
  if (std::filesystem::is_directory(file, error))
    fail(where, file.string(),
         std::filesystem::exists(file / "report.json", error)
             ? "is a folder; give its report.json, " + (file / "report.json").string()
             : "is a folder, no file");
  if (!std::filesystem::is_regular_file(file, error))
    fail(where, file.string(), "there is no such file");
  return load_safely(file.string(), where, arguments);
}

/// A file in memory.
class MemoryFile {
public:
  explicit MemoryFile(std::span<const char> bytes) {
    // Not one of the standard streams, which may be closed here and are set in the reader
    const int first = memfd_create("picture", MFD_CLOEXEC);
    descriptor_ = fcntl(first, F_DUPFD_CLOEXEC, 3);
    close(first);
    if (descriptor_ < 0) throw std::runtime_error("there is no memory for it");
    while (!bytes.empty()) {
      const ssize_t done = write(descriptor_, bytes.data(), bytes.size());
      if (done < 0 && errno != EINTR) {
        close(descriptor_);
        throw std::runtime_error("there is no memory for it");
      }
      bytes = bytes.subspan(static_cast<std::size_t>(std::max<ssize_t>(done, 0)));
    }
  }
  ~MemoryFile() { close(descriptor_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  int descriptor() const { return descriptor_; }

private:
  int descriptor_ = -1;
};

}  // namespace

Image load_texture(const std::filesystem::path& file, int channel, const std::string& where) {
  return load_file(file, where, {"texture", file.string(), std::to_string(channel)})[0];
}

Image stacked(std::span<const Image> channels) {
  Image all = channels[0];
  all.channels = 3;
  for (const auto& channel : channels.subspan(1, 2))
    all.pixels.insert(all.pixels.end(), channel.pixels.begin(), channel.pixels.end());
  return all;
}

std::vector<Image> load_channels(const std::filesystem::path& file, const std::string& letters,
                                 const std::string& where) {
  return load_file(file, where, {"channels", file.string(), letters});
}

std::vector<Image> load_channels(std::span<const char> bytes, const std::string& name,
                                 const std::string& letters, const std::string& where) {
  try {
    const MemoryFile picture(bytes);
    return load_safely(name, where, {"channels", "/proc/self/fd/0", letters}, picture.descriptor());
  } catch (const InputError&) {
    throw;
  } catch (const std::runtime_error& failure) {
    fail(where, name, failure.what());
  }
}

void limit_texels(Image& image, const std::string& name, const std::string& where) {
  constexpr float most = 1e30f;  // as all numbers of a scene
  for (float& texel : image.pixels) texel = std::max(texel, 0.0f);
  if (const float brightest = *std::max_element(image.pixels.begin(), image.pixels.end());
      brightest > most)
    fail(where, name, "holds " + number_text(brightest) + ", more than 1e+30");
}

Image load_grey(const std::filesystem::path& file, const std::string& where) {
  return load_file(file, where, {"grey", file.string()})[0];
}

Image load_numbers(const std::filesystem::path& file, const std::string& where) {
  return load_file(file, where, {"numbers", file.string()})[0];
}

Image load_levels(const std::filesystem::path& file, const std::string& where) {
  return load_file(file, where, {"levels", file.string()})[0];
}

}  // namespace raywave
