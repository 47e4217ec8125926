// SPDX-License-Identifier: Apache-2.0
/// Files for tests: temporary folders and damaged copies of files.
#pragma once

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <iterator>
#include <random>
#include <sstream>
#include <string>
#include <utility>

#include "host/common/error.hpp"

/// A new temporary folder, removed by the destructor.
class Folder {
public:
  Folder() {
    std::string name = (std::filesystem::temp_directory_path() / "raywave-test-XXXXXX").string();
    if (!mkdtemp(name.data())) throw std::runtime_error("no temporary folder");
    path_ = name;
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

  std::filesystem::path write(const std::string& name, const std::string& bytes) const {
    std::ofstream(path_ / name, std::ios::binary) << bytes;
    return path_ / name;
  }

  std::size_t count() const {
    return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(path_),
                                                  std::filesystem::directory_iterator()));
  }

private:
  std::filesystem::path path_;
};

inline std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream bytes;
  bytes << stream.rdbuf();
  return bytes.str();
}

/// The message of the InputError that `action` throws; "" when it throws nothing. Other exceptions
/// are passed on to the test.
template <class Action>
std::string input_error_of(Action action) {
  try {
    action();
  } catch (const raywave::InputError& error) {
    return error.what();
  }
  return "";
}

namespace raywave::test {

/// The message of the DeviceError that `action` throws.
template <class Action>
std::string device_error_of(Action action) {
  try {
    action();
  } catch (const DeviceError& error) {
    return error.what();
  }
  return "no DeviceError";
}

}  // namespace raywave::test

/// "" when a message contains all these texts, else the message and the first that it lacks.
inline std::string unsaid(const std::string& message, std::initializer_list<std::string> texts) {
  for (const auto& text : texts) {
    if (message.find(text) == std::string::npos) return message + " lacks: " + text;
  }
  return "";
}

#define CHECK_SAYS(message, ...) CHECK(unsaid(message, {__VA_ARGS__}) == "")
#define REQUIRE_SAYS(message, ...) REQUIRE(unsaid(message, {__VA_ARGS__}) == "")

/// Checks that an InputError is thrown whose message contains all these texts.
#define CHECK_REFUSED(expression, ...) \
  CHECK_SAYS(input_error_of([&] { static_cast<void>(expression); }), __VA_ARGS__)

/// Calls `use` with damaged copies of `whole`: `cuts` truncated copies, `cuts` copies with up to 64
/// zeroed bytes, `flips` copies with one to four flipped bits, and two with garbage at their ends.
/// The copies are equal in every run.
template <class Use>
void for_damaged(const std::string& whole, int cuts, int flips, Use use) {
  const auto step = std::max<std::size_t>(1, whole.size() / static_cast<std::size_t>(cuts));
  std::mt19937 random(1);
  for (std::size_t length = 0; length < whole.size(); length += step) {
    use(whole.substr(0, length));
    std::string zeroed = whole;
    zeroed.replace(length, std::min<std::size_t>(1 + random() % 64, whole.size() - length), "");
    zeroed.insert(length, whole.size() - zeroed.size(), '\0');
    use(zeroed);
  }
  for (int i = 0; i < flips && !whole.empty(); ++i) {
    std::string bytes = whole;
    for (int bits = 1 + i % 4; bits > 0; --bits) {
      char& byte = bytes[random() % bytes.size()];
      byte = static_cast<char>(byte ^ (1 << (random() % 8)));
    }
    use(bytes);
  }
  std::string garbage(100, ' ');
  for (char& c : garbage) c = static_cast<char>(random());
  for (const std::size_t more : {std::size_t{1}, garbage.size()})
    use(whole + garbage.substr(0, more));
}

/// Calls `read` with damaged copies of the file. Returns the number of copies read without an error
/// and the number with an InputError of one line; other exceptions are passed on to the test.
template <class Read>
std::pair<int, int> read_damaged(const Folder& folder, const std::filesystem::path& file, int cuts,
                                 int flips, Read read) {
  const std::string name = "damaged" + file.extension().string();
  std::pair<int, int> accepted_refused{0, 0};
  for_damaged(bytes_of(file), cuts, flips, [&](const std::string& bytes) {
    const auto damaged = folder.write(name, bytes);
    const std::string message = input_error_of([&] { read(damaged); });
    if (message.find('\n') != std::string::npos)
      throw std::runtime_error("a message of two lines: " + message);
    ++(message.empty() ? accepted_refused.first : accepted_refused.second);
  });
  return accepted_refused;
}
