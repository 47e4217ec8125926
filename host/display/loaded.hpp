// SPDX-License-Identifier: Apache-2.0
/// Libraries that are loaded when a display is asked for: other commands do not wait for them.
#pragma once

#include <dlfcn.h>

#include <functional>
#include <string>

#include "host/common/error.hpp"

namespace raywave {

class LoadedLibrary {
public:
  /// file     as the loader finds it
  /// package  that has it
  /// throws   InputError that says what to install
  LoadedLibrary(const char* file, const char* package)
      : file_(file), package_(package), handle_(dlopen(file, RTLD_NOW)) {
    if (!handle_) fail("is missing");
  }
  // Never unloaded: it may have threads.

  template <class Result, class... Values>
  void find(const char* name, std::function<Result(Values...)>& function) const {
    void* const address = dlsym(handle_, name);
    if (!address) fail(std::string("has no ") + name);
    function = reinterpret_cast<Result (*)(Values...)>(address);
  }

private:
  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(std::string("displays need ") + file_ + ", which " + what + "; install " +
                     package_);
  }

  const char *file_, *package_;
  void* handle_;
};

}  // namespace raywave
