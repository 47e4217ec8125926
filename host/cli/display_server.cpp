// SPDX-License-Identifier: Apache-2.0
#include "host/cli/display_server.hpp"

#include <netdb.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <concepts>
#include <cstring>
#include <memory>
#include <vector>

#include "host/common/error.hpp"
#include "host/common/text.hpp"

namespace raywave::cli {
namespace {

// Numbers of tev's packets, and what one may hold
constexpr std::uint8_t create_image = 4, update_image = 6;
constexpr std::size_t most_pixels_of_strip = std::size_t{1} << 18;
constexpr time_t patience_s = 5;

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

class Connection {
public:
  explicit Connection(const std::string& server) : server_(server) {
    const auto colon = server.rfind(':');
    const auto host = server.substr(0, colon),
               port = server.substr(std::min(colon, server.size() - 1) + 1);
    if (colon == server.npos || host.empty() || port.empty() ||
        port.find_first_not_of("0123456789") != port.npos)
      fail("needs a host and a port, as in localhost:14158");
    addrinfo wanted{}, *all = nullptr;
    wanted.ai_socktype = SOCK_STREAM;
    if (const int error = getaddrinfo(host.c_str(), port.c_str(), &wanted, &all); error != 0)
      fail(std::string("there is no such host: ") + gai_strerror(error));
    const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> addresses(all, freeaddrinfo);
    int error = 0;
    for (const auto* one = all; one && socket_ < 0; one = one->ai_next) {
      socket_ = socket(one->ai_family, one->ai_socktype | SOCK_CLOEXEC, one->ai_protocol);
      if (socket_ < 0) continue;
      const timeval patience{patience_s, 0};
      setsockopt(socket_, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
      if (connect(socket_, one->ai_addr, one->ai_addrlen) == 0) break;
      error = errno;
      close(socket_);
      socket_ = -1;
    }
    if (socket_ < 0)
      fail(std::string("nobody answers: ") + std::strerror(error) + "; start tev there");
  }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  ~Connection() {
    if (socket_ >= 0) close(socket_);
  }

  void send(Packet packet) {
    for (auto left = packet.finished(); !left.empty();) {
      const auto sent = ::send(socket_, left.data(), left.size(), MSG_NOSIGNAL);
      if (sent < 0 && errno == EINTR) continue;
      if (sent <= 0) fail(std::string("stops to listen: ") + std::strerror(errno));
      left = left.subspan(static_cast<std::size_t>(sent));
    }
  }

private:
  [[noreturn]] void fail(const std::string& what) const {
    throw InputError("--display-server " + in_quotes(server_) + ": " + what);
  }

  std::string server_;
  int socket_ = -1;
};

}  // namespace

void display(const std::string& server, const std::string& name, std::span<const Image> channels) {
  const int width = channels[0].width, height = channels[0].height;
  Connection tev(server);
  Packet made(create_image);
  made.add(std::uint8_t{1});  // comes to the front
  made.add(name);
  made.add(std::int32_t{width});
  made.add(std::int32_t{height});
  made.add_names(channels.size());
  tev.send(made);
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
    tev.send(strip);
  }
}

}  // namespace raywave::cli
