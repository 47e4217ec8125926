// SPDX-License-Identifier: Apache-2.0
// --display-server, against a server that reads tev's packets as its IPC documents them.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <cstring>
#include <thread>

#include "host/scene/image.hpp"
#include "tests/support/program.hpp"

namespace raywave {
namespace {

using namespace test;

/// What a tev would show.
struct Shown {
  std::string name;
  std::int32_t width = 0, height = 0;
  std::vector<std::string> channels;
  std::vector<std::vector<float>> pixels;
  int updates = 0;
};

/// Reads from one client, until that leaves.
class Server {
public:
  Server() : listening_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    auto* const generic = reinterpret_cast<sockaddr*>(&address);
    REQUIRE(bind(listening_, generic, size) == 0);
    REQUIRE(listen(listening_, 4) == 0);
    REQUIRE(getsockname(listening_, generic, &size) == 0);
    port_ = ntohs(address.sin_port);
  }
  ~Server() { close(listening_); }
  void stop() const { shutdown(listening_, SHUT_RDWR); }
  std::string name() const { return "127.0.0.1:" + std::to_string(port_); }

  std::vector<Shown> serve(int clients) {
    std::vector<Shown> all;
    for (int i = 0; i < clients; ++i) {
      const int client = accept(listening_, nullptr, nullptr);
      if (client < 0) break;
      std::string bytes(4, '\0');
      while (recv(client, bytes.data(), 4, MSG_WAITALL) == 4) {
        std::uint32_t length = 0;
        std::memcpy(&length, bytes.data(), 4);
        bytes.resize(length - 4);
        if (recv(client, bytes.data(), bytes.size(), MSG_WAITALL) !=
            static_cast<ssize_t>(bytes.size()))
          break;
        at_ = 0;
        bytes_ = bytes;
        take(all);
        bytes.resize(4);
      }
      close(client);
    }
    return all;
  }

private:
  template <class T>
  T next() {
    T value{};
    std::memcpy(&value, bytes_.data() + at_, sizeof value);
    at_ += sizeof value;
    return value;
  }
  std::string text() {
    const std::string one = bytes_.c_str() + at_;
    at_ += one.size() + 1;
    return one;
  }
  std::vector<std::string> names() {
    std::vector<std::string> all(static_cast<std::size_t>(next<std::int32_t>()));
    for (auto& one : all) one = text();
    return all;
  }

  void take(std::vector<Shown>& all) {
    const auto kind = next<char>();
    next<char>();  // whether it comes to the front
    const auto name = text();
    if (kind == 4) {
      Shown made{name, next<std::int32_t>(), 0, {}, {}, 0};
      made.height = next<std::int32_t>();
      made.channels = names();
      made.pixels.assign(made.channels.size(),
                         std::vector<float>(std::size_t(made.width) * made.height, -1));
      all.push_back(made);
      return;
    }
    auto& shown = all.back();
    if (kind != 6 || name != shown.name || names() != shown.channels) return;
    ++shown.updates;
    const auto left = next<std::int32_t>(), top = next<std::int32_t>(), wide = next<std::int32_t>(),
               high = next<std::int32_t>();
    std::vector<std::int64_t> begins, steps;
    for (std::size_t i = 0; i < shown.channels.size(); ++i) begins.push_back(next<std::int64_t>());
    for (std::size_t i = 0; i < shown.channels.size(); ++i) steps.push_back(next<std::int64_t>());
    for (std::size_t c = 0; c < shown.channels.size(); ++c)
      for (int i = 0; i < wide * high; ++i)
        std::memcpy(&shown.pixels[c][std::size_t(top + i / wide) * shown.width + left + i % wide],
                    bytes_.data() + at_ + sizeof(float) * std::size_t(begins[c] + i * steps[c]),
                    sizeof(float));
  }

  int listening_ = -1, port_ = 0;
  std::string bytes_;
  std::size_t at_ = 0;
};

/// What a run of the program sends, in so many connections.
std::vector<Shown> shown_by(const Desk& desk, std::vector<std::string> words, int connections) {
  Server server;
  std::vector<Shown> shown;
  std::thread tev([&] { shown = server.serve(connections); });
  words.insert(words.end(), {"-o", desk.file("out"), "--display-server", server.name()});
  const auto told = desk.run(words);
  if (told.code != 0) server.stop();
  tev.join();
  INFO(told.err);
  REQUIRE(told.code == 0);
  return shown;
}

TEST_CASE("pictures come to tev as their EXRs hold them, of every depth") {
  const Desk desk;
  // Large enough for several strips
  const auto shown = shown_by(desk,
                              {"lens", desk.file("scene.toml"), "-z", "9mm", "-z", "10mm",
                               "--lens-points", "1", "--window", "2.8mmx2.4mm"},
                              2);
  REQUIRE(shown.size() == 2);
  CHECK(shown[0].updates > 1);
  for (const auto& [one, file] : {std::pair(shown[0], "lens_9mm"), {shown[1], "lens_10mm"}}) {
    const auto expected = load_grey(desk.file(std::string("out/") + file + ".exr"), "");
    CHECK(one.name == desk.file(std::string("out/") + file));
    CHECK(one.channels == std::vector<std::string>{"L"});
    CHECK(one.width == expected.width);
    CHECK(one.pixels.at(0) == expected.pixels);
  }
}

TEST_CASE("pictures in colour come to tev as red, green and blue") {
  const Desk desk;
  const auto shown = shown_by(desk,
                              {"preview", desk.file("scene.toml"), "--set",
                               "hologram.wavelength=['638 nm', '520 nm', '450 nm']"},
                              1);
  REQUIRE(shown.size() == 1);
  CHECK(shown[0].channels == std::vector<std::string>{"R", "G", "B"});
  CHECK(*std::max_element(shown[0].pixels[1].begin(), shown[0].pixels[1].end()) > 0);
}

TEST_CASE("a display server that is not there, or no name of one, is said") {
  const Desk desk;
  const auto said = [&](const std::string& server) {
    const auto told = desk.run(
        {"preview", desk.file("scene.toml"), "-o", desk.file("out"), "--display-server", server});
    CHECK(told.code == 2);
    return told.err;
  };
  CHECK(said("tev").find("needs a host and a port, as in localhost:14158") != std::string::npos);
  CHECK(said("localhost:").find("needs a host and a port") != std::string::npos);
  CHECK(said(":14158").find("needs a host and a port") != std::string::npos);
  std::string left;
  {
    const Server gone;
    left = gone.name();
  }
  CHECK(said(left).find("nobody answers: Connection refused; start tev there") !=
        std::string::npos);
}

}  // namespace
}  // namespace raywave
