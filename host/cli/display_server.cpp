// SPDX-License-Identifier: Apache-2.0
#include "host/cli/display_server.hpp"

#include <sys/socket.h>

#include <algorithm>
#include <bit>
#include <concepts>
#include <vector>

#include "host/cli/connection.hpp"
#include "host/common/text.hpp"

namespace raywave::cli {
namespace {

// Numbers of tev's packets, and what one may hold
constexpr std::uint8_t create_image = 4, update_image = 6;
constexpr std::size_t most_pixels_of_strip = std::size_t{1} << 18;

/// Length, kind and what belongs to it, little-endian.
class Packet {
public:
  explicit Packet(std::uint8_t kind) : bytes_(4) { add(kind); }

  template <std::integral T>
  void add(T value) {
    for (std::size_t i = 0; i < sizeof(T); ++i)
      bytes_.push_back(static_cast<char>(static_cast<std::uint64_t>(value) >> (8 * i)));
  }
  void add(float value) { add(std::bit_cast<std::uint32_t>(value)); }
  void add(const std::string& text) {
    bytes_.insert(bytes_.end(), text.c_str(), text.c_str() + text.size() + 1);
  }
  void add_names(std::size_t channels) {
    add(static_cast<std::int32_t>(channels));
    for (std::size_t i = 0; i < channels; ++i)
      add(channels == 1 ? std::string("L") : std::string(1, "RGB"[i]));
  }

  std::span<const char> finished() {
    for (std::size_t i = 0; i < 4; ++i) bytes_[i] = static_cast<char>(bytes_.size() >> (8 * i));
    return bytes_;
  }

private:
  std::vector<char> bytes_;
};

}  // namespace

void display(const std::string& server, const std::string& name, std::span<const Image> channels) {
  const int width = channels[0].width, height = channels[0].height;
  Connection tev(server, SOCK_STREAM, "--display-server " + in_quotes(server), "; start tev there");
  Packet made(create_image);
  made.add(std::uint8_t{1});  // comes to the front
  made.add(name);
  made.add(std::int32_t{width});
  made.add(std::int32_t{height});
  made.add_names(channels.size());
  tev.send(made.finished());
  const auto row = static_cast<std::size_t>(width);
  const int most_rows = static_cast<int>(std::max<std::size_t>(most_pixels_of_strip / row, 1));
  for (int top = 0; top < height; top += most_rows) {
    const int rows = std::min(most_rows, height - top);
    const auto pixels = row * static_cast<std::size_t>(rows);
    Packet strip(update_image);
    strip.add(std::uint8_t{0});
    strip.add(name);
    strip.add_names(channels.size());
    for (const std::int32_t side : {0, top, width, rows}) strip.add(side);
    for (std::size_t i = 0; i < channels.size(); ++i)
      strip.add(static_cast<std::int64_t>(i * pixels));  // where the channel begins
    for (std::size_t i = 0; i < channels.size(); ++i) strip.add(std::int64_t{1});  // and its step
    for (const auto& channel : channels)
      for (std::size_t i = 0; i < pixels; ++i)
        strip.add(channel.pixels[row * static_cast<std::size_t>(top) + i]);
    tev.send(strip.finished());
  }
}

}  // namespace raywave::cli
