// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

namespace raywave::cli {

/// What bytes are sent to: a server, or a file that is open for writing.
class Connection {
public:
  /// server   "localhost:14158"
  /// kind     SOCK_STREAM or SOCK_DGRAM
  /// where    begins messages: the option that names the server
  /// advice   where nobody answers: "; start tev there"
  /// throws   InputError
  Connection(const std::string& server, int kind, std::string where, const char* advice = "");
  /// A file, pipe or serial port, which is told its name; "-": standard output.
  Connection(const std::string& file, std::string where);
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  ~Connection();

  /// Datagrams may get lost.
  ///
  /// throws  InputError when not all bytes can be sent
  void send(std::span<const char> bytes);

private:
  [[noreturn]] void fail(const std::string& what) const;

  std::string where_;
  int descriptor_ = -1;
  bool is_socket_ = true;
};

}  // namespace raywave::cli
