// SPDX-License-Identifier: Apache-2.0
/// X servers without hardware, and what is on their screens: read from the server, not from who
/// drew it.
#pragma once

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <initializer_list>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/catch.hpp"
#include "tests/support/environment.hpp"
#include "tests/support/files.hpp"

namespace raywave::test {

/// A program in the background. `first_line` gets what it prints first on descriptor 3.
inline pid_t started(std::vector<std::string> words, std::string* first_line = nullptr) {
  int ends[2] = {-1, -1};
  REQUIRE(pipe(ends) == 0);
  std::vector<char*> pointers;
  for (auto& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  const pid_t program = fork();
  REQUIRE(program >= 0);
  if (program == 0) {
    prctl(PR_SET_PDEATHSIG, SIGTERM);  // whatever ends the tests
    dup2(ends[1], 3);
    const int nothing = open("/dev/null", O_RDWR);
    for (const int stream : {0, 1, 2}) dup2(nothing, stream);
    execvp(pointers[0], pointers.data());
    _exit(127);
  }
  close(ends[1]);
  char c = 0;
  while (first_line && read(ends[0], &c, 1) == 1 && c != '\n') *first_line += c;
  close(ends[0]);
  return program;
}

inline bool has_program(const std::string& name) {
  for (const char* folder : {"/usr/bin/", "/usr/local/bin/", "/usr/lib/xorg/", "/usr/libexec/"})
    if (access((folder + name).c_str(), X_OK) == 0) return true;
  return false;
}

/// Says aloud that something was not tested. Where it must be, in CI, that fails.
inline void skip(const std::string& what, const char* package, bool must) {
  std::printf("skipped: %s: no %s\n", what.c_str(), package);
  if (must && std::getenv("CI")) FAIL("CI must have " << package);
}

/// A picture in X's own format (XWD), 24 or 32 bits for each pixel.
struct Screenshot {
  int width = 0, height = 0;
  std::vector<std::uint32_t> pixels;  // 0x00RRGGBB

  explicit Screenshot(const std::string& xwd) {
    const auto number = [&](std::size_t at) {
      std::uint32_t value = 0;
      for (std::size_t i = 0; i < 4; ++i)
        value = value << 8 | static_cast<unsigned char>(xwd.at(4 * at + i));
      return value;
    };
    REQUIRE(xwd.size() > 100);
    const std::size_t bytes = number(11) / 8;  // of a pixel
    REQUIRE((bytes == 3 || bytes == 4));
    REQUIRE(number(7) == 0);  // the least of them first
    width = static_cast<int>(number(4));
    height = static_cast<int>(number(5));
    const std::size_t begin = number(0) + 12 * number(19), row = number(12);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const auto at =
            begin + static_cast<std::size_t>(y) * row + bytes * static_cast<std::size_t>(x);
        std::uint32_t pixel = 0;
        for (const std::size_t c : {2, 1, 0})
          pixel = pixel << 8 | static_cast<unsigned char>(xwd.at(at + c));
        pixels.push_back(pixel);
      }
  }
  std::uint32_t at(int x, int y) const {
    return pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(x)];
  }
};

/// One output, Xvfb; or two side by side, Xorg with the dummy driver: DUMMY0 of 640 x 480 and
/// DUMMY1 of 800 x 600 at 60 Hz. Programs of this process find it.
class XServer {
public:
  static bool has_one() { return has_program("Xvfb"); }
  static bool has_two() {
    return has_program("Xorg") && has_program("xwd") && has_program("xrandr") &&
           std::filesystem::exists("/usr/lib/xorg/modules/drivers/dummy_drv.so");
  }

  /// One that does not begin anew when its last window closes: its screen is what that has left.
  XServer(int width, int height) {
    start({"Xvfb", "-displayfd", "3", "-nolisten", "tcp", "-noreset", "-nocursor", "-screen", "0",
           std::to_string(width) + "x" + std::to_string(height) + "x24", "-fbdir",
           (folder_ / "").string()});
  }
  XServer() {
    const auto file = folder_.write(
        "xorg.conf",
        "Section \"Device\"\nIdentifier \"d\"\nDriver \"dummy\"\nVideoRam 64000\nEndSection\n"
        "Section \"Screen\"\nIdentifier \"s\"\nDevice \"d\"\nDefaultDepth 24\n"
        "SubSection \"Display\"\nDepth 24\nVirtual 2048 1024\nEndSubSection\nEndSection\n");
    start({"/usr/lib/xorg/Xorg", "-displayfd", "3", "-config", file.string(), "-noreset",
           "-nolisten", "tcp", "-novtswitch", "-sharevts", "-logfile", (folder_ / "log").string()});
    if (!is_there()) return;
    run("xrandr --addmode DUMMY1 800x600");
    run("xrandr --output DUMMY0 --mode 640x480 --pos 0x0 --output DUMMY1 --mode 800x600 --pos "
        "640x0");
    run("xrandr");  // which makes the server look at its outputs
    is_two_ = true;
  }
  ~XServer() {
    kill(program_, SIGTERM);
    waitpid(program_, nullptr, 0);
  }
  XServer(const XServer&) = delete;
  XServer& operator=(const XServer&) = delete;

  bool is_there() const { return display_.has_value(); }
  void run(const std::string& command) const {
    REQUIRE(std::system((command + " >/dev/null 2>&1").c_str()) == 0);
  }
  Screenshot screenshot() const {
    if (is_two_) run("xwd -root -silent -out '" + (folder_ / "shot").string() + "'");
    return Screenshot(bytes_of(folder_ / (is_two_ ? "shot" : "Xvfb_screen0")));
  }
  /// Whether the screen is as wanted now, or soon: servers draw when they like.
  template <class Wanted>
  bool shows(Wanted wanted) const {
    for (int i = 0; i < 200; ++i) {
      if (wanted(screenshot())) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    return false;
  }

private:
  void start(const std::vector<std::string>& words) {
    std::string number;
    program_ = started(words, &number);
    if (!number.empty()) display_.emplace("DISPLAY", ":" + number);
  }

  Folder folder_;
  pid_t program_ = -1;
  std::optional<Environment> display_;
  bool is_two_ = false;
};

}  // namespace raywave::test
