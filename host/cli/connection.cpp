// SPDX-License-Identifier: Apache-2.0
#include "host/cli/connection.hpp"

#include <fcntl.h>
#include <netdb.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>
#include <utility>

#include "host/common/error.hpp"

namespace raywave::cli {
namespace {

constexpr time_t patience_s = 5;

}  // namespace

Connection::Connection(const std::string& server, int kind, std::string where, const char* advice)
    : where_(std::move(where)) {
  const auto colon = server.rfind(':');
  const auto host = server.substr(0, colon),
             port = server.substr(std::min(colon, server.size() - 1) + 1);
  if (colon == server.npos || host.empty() || port.empty() ||
      port.find_first_not_of("0123456789") != port.npos)
    fail("needs a host and a port, as in localhost:14158");
  addrinfo wanted{}, *all = nullptr;
  wanted.ai_socktype = kind;
  if (const int error = getaddrinfo(host.c_str(), port.c_str(), &wanted, &all); error != 0)
    fail(std::string("there is no such host: ") + gai_strerror(error));
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> addresses(all, freeaddrinfo);
  int error = 0;
  for (const auto* one = all; one && descriptor_ < 0; one = one->ai_next) {
    descriptor_ = socket(one->ai_family, one->ai_socktype | SOCK_CLOEXEC, one->ai_protocol);
    if (descriptor_ < 0) continue;
    const timeval patience{patience_s, 0};
    setsockopt(descriptor_, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
    if (connect(descriptor_, one->ai_addr, one->ai_addrlen) == 0) break;
    error = errno;
    close(descriptor_);
    descriptor_ = -1;
  }
  if (descriptor_ < 0) fail(std::string("nobody answers: ") + std::strerror(error) + advice);
}

Connection::Connection(const std::string& file, std::string where)
    : where_(std::move(where)), is_socket_(false) {
  descriptor_ = file == "-" ? dup(STDOUT_FILENO)
                            : open(file.c_str(), O_WRONLY | O_CREAT | O_NOCTTY | O_CLOEXEC, 0666);
  if (descriptor_ < 0) fail(std::string("cannot be written: ") + std::strerror(errno));
  termios line{};
  if (file == "-" || tcgetattr(descriptor_, &line) != 0) return;
  cfmakeraw(&line);  // a serial port, whose speed is as stty has set it
  tcsetattr(descriptor_, TCSANOW, &line);
}

Connection::~Connection() {
  if (descriptor_ >= 0) close(descriptor_);
}

void Connection::send(std::span<const char> bytes) {
  while (!bytes.empty()) {
    const auto sent = is_socket_ ? ::send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL)
                                 : write(descriptor_, bytes.data(), bytes.size());
    if (sent < 0 && errno == EINTR) continue;
    if (sent < 0 && errno == ECONNREFUSED) return;  // of a datagram before: nobody listens yet
    if (sent <= 0) fail(std::string("stops to listen: ") + std::strerror(errno));
    bytes = bytes.subspan(static_cast<std::size_t>(sent));
  }
}

void Connection::fail(const std::string& what) const { throw InputError(where_ + ": " + what); }

}  // namespace raywave::cli
