// SPDX-License-Identifier: Apache-2.0
/// The image readers in a forked process: raywave_oiio_reader takes 0.2 s to start, too long for
/// thousands of damaged pictures.
#pragma once

#include <sys/wait.h>
#include <unistd.h>

#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/scene/reader/picture.hpp"
#include "host/scene/reader/serve.hpp"
#include "host/scene/reader_reply.hpp"

namespace raywave::test {

/// Whether what a reader sends is taken, by one of the functions receive_....
template <class Sent, class Receive>
bool is_received(const Sent& sent, Receive receive) {
  int ends[2];
  if (pipe(ends) != 0) throw std::runtime_error("no pipe");
  ReaderPipe in(ends[0]), out(ends[1]);
  send(out, sent);
  close(ends[1]);
  bool received = true;
  try {
    receive(in);
  } catch (const std::runtime_error&) {
    received = false;
  }
  close(ends[0]);
  return received;
}

/// Does what load_texture does. Every failure of the reader becomes an InputError.
inline Image load_texture_in_fork(const std::filesystem::path& file, int channel) {
  int ends[2];
  if (pipe(ends) != 0) throw std::runtime_error("no pipe");
  const pid_t reader = fork();
  if (reader == 0) {
    close(ends[0]);
    dup2(ends[1], STDOUT_FILENO);
    close(ends[1]);
    std::string words[] = {"reader", "30", std::to_string(std::uint64_t{6} << 30)};
    char* arguments[] = {words[0].data(), words[1].data(), words[2].data()};
    std::vector<Image> channels;
    serve(
        3, arguments,
        [&](const auto&) {
          channels = read_image(is_png(file) ? open_png : open_oiio,
                                {"texture", file.string(), std::to_string(channel)});
        },
        [&](ReaderPipe& out) { send(out, channels); });
  }
  close(ends[1]);
  Image image;
  std::string failure;
  ReaderPipe in(ends[0]);
  try {
    Verdict verdict{};
    in.read(std::as_writable_bytes(std::span(&verdict, 1)));
    if (verdict == Verdict::done)
      image = receive_channels(in).at(0);
    else
      failure = "refused";
  } catch (const std::runtime_error& error) {
    failure = error.what();
  }
  close(ends[0]);
  waitpid(reader, nullptr, 0);
  if (!failure.empty()) throw InputError(one_line(failure));
  return image;
}

}  // namespace raywave::test
