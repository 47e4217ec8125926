// SPDX-License-Identifier: Apache-2.0
#include "host/scene/image.hpp"

#include <string_view>

#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/scene/reader_process.hpp"
#include "host/scene/reader_reply.hpp"

namespace raywave {
namespace {

/// arguments  of raywave_image_reader: the kind, the file, and what the kind needs besides
Image load_safely(const std::filesystem::path& file, const std::string& where,
                  const std::vector<std::string>& arguments) {
  const auto fail = [&](std::string_view what) {
    throw InputError((where.empty() ? "" : where + ": ") + "picture " + in_quotes(file.string()) +
                     ": " + one_line(what));
  };
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) fail("there is no such file");
  const auto program = find_reader("raywave_image_reader");
  Image image;
  try {
    run_reader(program, {30, std::uint64_t{6} << 30}, arguments,
               [&](ReaderPipe& pipe) { image = receive_image(pipe); });
  } catch (const std::exception& failure) {
    fail(failure.what());
  }
  return image;
}

}  // namespace

Image load_texture(const std::filesystem::path& file, int channel, const std::string& where) {
  return load_safely(file, where, {"texture", file.string(), std::to_string(channel)});
}

Image load_grey(const std::filesystem::path& file, const std::string& where) {
  return load_safely(file, where, {"grey", file.string()});
}

Image load_levels(const std::filesystem::path& file, const std::string& where) {
  return load_safely(file, where, {"levels", file.string()});
}

}  // namespace raywave
