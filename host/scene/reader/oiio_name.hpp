// SPDX-License-Identifier: Apache-2.0
/// Names of files for OpenImageIO.
#pragma once

#include <fcntl.h>
#include <unistd.h>

#include <filesystem>
#include <string>

namespace raywave {

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

}  // namespace raywave
