// SPDX-License-Identifier: Apache-2.0
#include "host/common/output.hpp"

#include <unistd.h>

#include <atomic>
#include <fstream>

#include "host/common/error.hpp"
#include "host/common/text.hpp"

namespace raywave {
namespace {

/// Removes the file unless it was renamed before.
struct Temporary {
  std::filesystem::path path;
  ~Temporary() {
    std::error_code ignored;
    if (!path.empty()) std::filesystem::remove(path, ignored);
  }
};

std::filesystem::path temporary_beside(const std::filesystem::path& file) {
  static std::atomic<unsigned> count{0};  // for several files at a time in one process
  std::string name = file.stem().string();
  name.append(".")
      .append(std::to_string(getpid()))
      .append("-")
      .append(std::to_string(count++))
      .append(".tmp");
  name.append(file.extension().string());
  return file.parent_path() / name;
}

}  // namespace

void write_whole(const std::filesystem::path& file,
                 const std::function<void(const std::filesystem::path& temporary)>& write) {
  std::error_code error;
  if (file.has_parent_path()) std::filesystem::create_directories(file.parent_path(), error);
  if (error)
    throw InputError(in_quotes(file.parent_path().string()) +
                     ": the folder cannot be made: " + error.message());

  Temporary temporary{temporary_beside(file)};
  write(temporary.path);
  std::filesystem::rename(temporary.path, file, error);
  if (error) throw InputError(in_quotes(file.string()) + ": cannot be written: " + error.message());
  temporary.path.clear();
}

void write_text(const std::filesystem::path& file, const std::string& text) {
  write_whole(file, [&](const std::filesystem::path& temporary) {
    std::ofstream stream(temporary, std::ios::binary);
    stream << text;
    stream.close();
    if (!stream) throw InputError(in_quotes(file.string()) + ": cannot be written");
  });
}

}  // namespace raywave
