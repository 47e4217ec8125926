// SPDX-License-Identifier: Apache-2.0
// Reader processes: a test program that misbehaves on demand (tests/support/bad_reader.cpp).
#include <csignal>
#include <thread>

#include "host/scene/mesh.hpp"
#include "host/scene/reader_process.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/environment.hpp"
#include "tests/support/files.hpp"
#include "tests/support/scenes.hpp"

namespace raywave {
namespace {

constexpr ReaderLimits little{1, std::uint64_t{1} << 28};

std::vector<int> numbers_of(const std::vector<std::string>& arguments,
                            const ReaderLimits& limits = little) {
  std::vector<int> result;
  run_reader(find_reader("raywave_bad_reader"), limits, arguments,
             [&](ReaderPipe& pipe) { pipe.read_vector(result, 1'000'000); });
  return result;
}

std::string failure_of(const std::vector<std::string>& arguments) {
  try {
    numbers_of(arguments);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("a reader hands over its result or the reason for having none") {
  CHECK(numbers_of({"numbers", "500000"}) == std::vector<int>(500'000, 7));
  CHECK(failure_of({"fail", "bad input"}) == "bad input");
  CHECK(failure_of({"fail", ""}) == "it cannot be read");
  CHECK(failure_of({"abort"}) == "its reader crashed");
  CHECK(failure_of({"segv"}) == "its reader crashed");
  CHECK(failure_of({"exit"}) == "its reader crashed");
  CHECK(failure_of({"spin"}) == "its reader took too long");
  CHECK(failure_of({"bad_alloc"}) == "it asks for too much memory");
  CHECK(failure_of({"fail", "std::bad_alloc"}) == "it asks for too much memory");
  CHECK(failure_of({"fail", "vector::_M_default_append"}) == "it asks for too much memory");
#ifndef __SANITIZE_ADDRESS__
  CHECK(failure_of({"numbers", std::to_string(1 << 27)}) == "it asks for too much memory");
#endif
  // More than agreed on
  CHECK(failure_of({"numbers", "2000000"}) == "its reader crashed");
  CHECK_SAYS(failure_of({"not started"}), "its reader does not start; run ", "raywave_bad_reader");
}

TEST_CASE("a reader that waits is ended by the clock", "[slow]") {
  CHECK(failure_of({"wait"}) == "its reader took too long");
}

TEST_CASE("signals that the host program blocks or ignores still end a reader") {
  const auto old = std::signal(SIGXCPU, SIG_IGN);
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_BLOCK, &all, &before);
  const auto failure = failure_of({"spin"});
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  std::signal(SIGXCPU, old);
  CHECK(failure == "its reader took too long");
}

TEST_CASE("several threads may start readers at the same time") {
  std::vector<std::thread> threads;
  std::vector<std::vector<int>> results(4);
  for (std::size_t i = 0; i < results.size(); ++i)
    threads.emplace_back([&, i] {
      results[i] = numbers_of({"numbers", std::to_string(100'000 + i)});
    });
  for (auto& thread : threads) thread.join();
  for (std::size_t i = 0; i < results.size(); ++i) CHECK(results[i].size() == 100'000 + i);
}

TEST_CASE("a reader program that is missing, or is none, is an error that says what to do") {
  const Folder folder;
  const auto mesh = folder.write("square.obj", test::square_obj());
  const auto refusal = [&] {
    return input_error_of([&] { load_mesh(mesh, Normals::file, "here"); });
  };
  const test::Environment nowhere("RAYWAVE_READER_DIR", (folder / "nowhere").string());
  CHECK_SAYS(refusal(),
             "there is no program raywave_mesh_reader in " + (folder / "nowhere").string(),
             "RAYWAVE_READER_DIR");
  CHECK_REFUSED(load_grey(mesh, ""), "there is no program raywave_image_reader");

  const test::Environment here("RAYWAVE_READER_DIR", (folder / "").string());
  const auto program = folder.write("raywave_mesh_reader", "#!/bin/sh\necho hello\n");
  CHECK_SAYS(refusal(), "there is no program");  // not executable
  std::filesystem::permissions(program, std::filesystem::perms::owner_all);
  CHECK_SAYS(refusal(), "its reader crashed");
  std::ofstream(program) << "no program\n";
  CHECK_SAYS(refusal(), "no process can be started");
}

TEST_CASE("a reader program called without arguments fails") {
  const auto program = find_reader("raywave_mesh_reader").string();
  CHECK(std::system((program + " 2>/dev/null").c_str()) != 0);
}

}  // namespace raywave
