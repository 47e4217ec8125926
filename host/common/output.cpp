// SPDX-License-Identifier: Apache-2.0
#include "host/common/output.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <system_error>
#include <utility>

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

OutputFile::OutputFile(const std::filesystem::path& place, const std::filesystem::path& name)
    : name_(name.string()),
      descriptor_(::open(place.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666)) {
  require(descriptor_ >= 0);
}

OutputFile::~OutputFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void OutputFile::require(bool done) const {
  if (!done)
    throw InputError(in_quotes(name_) +
                     ": cannot be written: " + std::generic_category().message(errno));
}

void OutputFile::write(const void* data, std::size_t bytes) {
  const auto* from = static_cast<const char*>(data);
  while (bytes > 0) {
    const auto written = ::write(descriptor_, from, bytes);
    if (written < 0 && errno == EINTR) continue;
    require(written > 0);
    from += written;
    bytes -= static_cast<std::size_t>(written);
  }
}

void OutputFile::close() {
  // Pipes and some file systems cannot wait for a disk.
  require(::fsync(descriptor_) == 0 || errno == EINVAL || errno == EROFS || errno == ENOTSUP);
  require(::close(std::exchange(descriptor_, -1)) == 0);
}

void write_whole(const std::filesystem::path& file, const std::function<void(OutputFile&)>& write) {
  write_whole_by_name(file, [&](const std::filesystem::path& temporary) {
    OutputFile output(temporary, file);
    write(output);
    output.close();
  });
}

void write_whole_by_name(const std::filesystem::path& file,
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
  write_whole(file, [&](OutputFile& output) { output.write(text); });
}

}  // namespace raywave
