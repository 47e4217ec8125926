// SPDX-License-Identifier: Apache-2.0
#include "cl/device.hpp"

#include <cctype>
#include <climits>
#include <cmath>
#include <functional>

#include "host/common/cache.hpp"
#include "host/evaluate/selftest/selfcheck.hpp"
#include "host/geometry/kernel_options.hpp"
#include "host/geometry/shared_types.hpp"
#include "kernels/common/shared_layout.h"
#include "tests/support/devices.hpp"
#include "tests/support/environment.hpp"

namespace raywave {
namespace fs = std::filesystem;
using test::Environment;

namespace {

/// An empty cache folder of this process's own until the end of the scope.
struct FreshCache {
  fs::path folder = fs::temp_directory_path() / ("raywave-test-device-" + std::to_string(getpid()));
  Environment variable{"RAYWAVE_CACHE_DIR", folder.string()};
  FreshCache() { fs::remove_all(folder); }
  ~FreshCache() { fs::remove_all(folder); }
};

/// Opened as in a process of its own, without programs.
cl::Device opened_anew(const cl::DeviceInfo& info) {
  test::kept_devices().clear();
  return cl::Device(info);
}

cl::Program selfcheck(const cl::Device& device, int lanes = 1) {
  return cl::Program(device, "kernels/instruments/selfcheck.cl",
                     {{option::lanes, std::to_string(lanes)}});
}

}  // namespace

TEST_CASE("errors of OpenCL are said in words") {
  for (const auto& [code, name] :
       {std::pair(CL_DEVICE_NOT_FOUND, "CL_DEVICE_NOT_FOUND (-1): "),
        {CL_BUILD_PROGRAM_FAILURE, "CL_BUILD_PROGRAM_FAILURE (-11): "},
        {CL_KERNEL_ARG_INFO_NOT_AVAILABLE, "CL_KERNEL_ARG_INFO_NOT_AVAILABLE (-19): "},
        {CL_INVALID_VALUE, "CL_INVALID_VALUE (-30): "},
        {CL_INVALID_KERNEL_NAME, "CL_INVALID_KERNEL_NAME (-46): "},
        {CL_INVALID_WORK_GROUP_SIZE, "CL_INVALID_WORK_GROUP_SIZE (-54): the work-group"},
        {CL_INVALID_BUFFER_SIZE, "CL_INVALID_BUFFER_SIZE (-61): "},
        {CL_INVALID_DEVICE_PARTITION_COUNT,
         "CL_INVALID_DEVICE_PARTITION_COUNT (-68): another driver"}})
    CHECK(cl::error_text(code).starts_with(name));
  for (const int code : {0, 7, -25, -69, -1001, INT_MIN, INT_MAX})
    CHECK(cl::error_text(code).starts_with("error (" + std::to_string(code) + "): another driver"));
}

TEST_CASE("a device is found by its index, and by part of its name in letters of either case") {
  const auto devices = cl::list_devices();
  std::map<std::string, int> names;
  for (const auto& device : devices) ++names[device.platform + device.name];
  for (const auto& device : devices) {
    CHECK(cl::find_device(device.index).index == device.index);
    if (names[device.platform + device.name] > 1) continue;
    auto part = device.name.substr(device.name.size() / 3);
    for (auto& c : part) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    int fitting = 0;
    for (const auto& other : devices)
      fitting += other.name.find(device.name.substr(device.name.size() / 3)) != std::string::npos;
    if (fitting == 1) CHECK(cl::find_device(part).index == device.index);
  }
}

TEST_CASE("kinds choose devices, of several GPUs the fastest with memory of its own") {
  using cl::DeviceKind;
  const auto offer = [](const char* index, DeviceKind kind, const char* name,
                        std::uint64_t units_mhz, bool own_memory) {
    return cl::Offer{index, "P", name, "1.2 Maker", kind, own_memory, units_mhz};
  };
  std::vector offers{offer("0:0", DeviceKind::cpu, "cpu-a", 1, false),
                     offer("1:0", DeviceKind::gpu, "shared", 124800, false),
                     offer("2:0", DeviceKind::gpu, "many slow", 30000, true),
                     offer("2:1", DeviceKind::gpu, "few fast", 34000, true),
                     offer("3:0", DeviceKind::accelerator, "board", 1, true),
                     offer("4:0", DeviceKind::cpu, "cpu-b", 989901, false)};
  const auto index = [&](const char* choice) {
    return offers[cl::choose_device(offers, choice)].index;
  };
  CHECK(index("") == "2:1");
  CHECK(index("GPU") == "2:1");
  CHECK(index("cpu") == "0:0");
  CHECK(index("accelerator") == "3:0");
  CHECK(index("CPU-b") == "4:0");
  CHECK(index("1:0") == "1:0");
  CHECK_SAYS(test::device_error_of([&] { index("cpu-"); }), "fits more than one", "0:0", "4:0");
  CHECK_SAYS(test::device_error_of([&] { index("maker"); }), "fits more than one", "2:1");
  offers = {offers.back()};
  CHECK(index("maker") == "4:0");
  CHECK_SAYS(test::device_error_of([&] { index("gpu"); }), "no such device", "4:0 cpu-b");
}

DEVICE_TEST("a device is found by its kind, and PoCL by the name that its version has") {
  const auto& info = device.info();
  CHECK(cl::find_device(cl::name_of(info.kind)).kind == info.kind);
  if (info.platform == "Portable Computing Language")
    CHECK(cl::find_device("pocl").kind == info.kind);
}

TEST_CASE("RAYWAVE_DEVICE decides when no device is named, and only then") {
  const auto devices = cl::list_devices();
  {
    const Environment variable("RAYWAVE_DEVICE", devices.back().index);
    CHECK(cl::find_device().index == devices.back().index);
  }
  const Environment variable("RAYWAVE_DEVICE", "no such thing");
  CHECK(cl::find_device(devices.front().index).index == devices.front().index);
  CHECK_THROWS_AS(cl::find_device(), cl::DeviceError);
}

DEVICE_TEST("with nothing named, a GPU goes before an accelerator and that before a CPU") {
  const Environment variable("RAYWAVE_DEVICE", "");
  CHECK(cl::find_device().kind <= device.info().kind);
}

DEVICE_TEST("a device that is not there is an error that lists those that are") {
  const auto message = test::device_error_of([] { cl::find_device("abacus"); });
  CHECK_SAYS(message, "\"abacus\"", device.info().index + " " + device.info().name);
}

DEVICE_TEST(
    "a buffer over the device's limit is an error that says what was asked and what is allowed") {
  const auto& info = device.info();
  const auto message = test::device_error_of(
      [&] { cl::Buffer<std::uint8_t>(device, info.largest_buffer_bytes + 1, "WRP field"); });
  CHECK_SAYS(message, "WRP field", info.name,
             "allows " + cl::format_bytes(info.largest_buffer_bytes));
  CHECK(device.allocated_bytes() == 0);
}

TEST_CASE("device memory is counted while it lives") {
  const cl::Device device(cl::list_devices().front());
  {
    cl::Buffer<float> a(device, 1000, "a");
    const cl::Buffer<float> b = std::move(a);
    CHECK(device.allocated_bytes() == 4000);
  }
  CHECK(device.allocated_bytes() == 0);
  CHECK(device.peak_bytes() == 4000);
}

TEST_CASE("a launch with wrong arguments is an error, for kernels from source and from the cache") {
  for (const auto& info : cl::list_devices()) {
    const FreshCache cache;
    const std::int32_t blocks = 1;
    for (const std::string from : {"source", "cache"}) {
      INFO(info.name << ", kernel from " << from);
      const auto device = opened_anew(info);
      cl::Buffer<float> floats(device, 16, "floats");
      cl::Buffer<std::int32_t> ints(device, 16, "ints");
      auto kernel = selfcheck(device).kernel("cos_sin");
      CHECK_NOTHROW(kernel.run({1}, {1}, floats, floats, floats, blocks));
      CHECK_SAYS(test::device_error_of([&] { kernel.run({1}, {1}, floats, floats, blocks); }),
                 "cos_sin takes 4 arguments, 3 given");
      const bool tells = !kernel.argument_types()[0].empty();
      // Intel's runtime does not for a program from a binary
      CHECK((tells || (from == "cache" && info.platform.starts_with("Intel"))));
      if (!tells) continue;
      CHECK_SAYS(test::device_error_of([&] { kernel.run({1}, {1}, ints, floats, floats, blocks); }),
                 "argument 0 is float*, int* given");
      CHECK_SAYS(test::device_error_of([&] { kernel.run({1}, {1}, floats, floats, floats, 1.0f); }),
                 "argument 3 is int, float given");
      device.finish();
    }
  }
}

TEST_CASE("a damaged kernel in the cache is compiled again") {
  for (const auto& info : cl::list_devices()) {
    const FreshCache cache;
    const Environment without_pocls_cache("POCL_KERNEL_CACHE", "0");
    selfcheck(opened_anew(info));
    const auto file = fs::directory_iterator(cache.folder)->path();
    const auto size = fs::file_size(file);
    for (const std::string damage : {"emptied", "cut", "overwritten"}) {
      INFO(info.name << ", " << damage);
      if (damage == "emptied") fs::resize_file(file, 0);
      if (damage == "cut") fs::resize_file(file, size / 2);
      if (damage == "overwritten") std::ofstream(file, std::ios::binary) << std::string(size, 'x');
      const std::vector<float> turns(64, 0.125f);
      CHECK(selftest::cos_sin_error(opened_anew(info), 1, turns) < 1e-6);
      CHECK(load_cached(file.filename()));
    }
  }
}

TEST_CASE("binaries are kept, but of a PoCL that keeps kernels and compiles anew for a binary") {
  for (auto info : cl::list_devices()) {
    for (const auto& driver : {info.driver, std::string("5.0, as a test has it")}) {
      for (const std::string kept_by_pocl : {"0", "1"}) {
        const FreshCache cache;
        const Environment pocls_cache("POCL_KERNEL_CACHE", kept_by_pocl);
        info.driver = driver;
        INFO(info.name << ", " << driver << ", " << kept_by_pocl);
        selfcheck(opened_anew(info));
        const bool keeps_its_own = cl::is_pocl(info) && !cl::needs_single_items(info) &&
                                   !cl::compiles_once(info) && kept_by_pocl == "1";
        REQUIRE(std::distance(fs::directory_iterator(cache.folder), {}) == 1);
        const auto file = fs::directory_iterator(cache.folder)->path().filename();
        CHECK(load_cached(file).value().empty() == keeps_its_own);
      }
    }
  }
}

DEVICE_TEST("host and device lay out shared structs alike") {
  // struct: bytes of the listed members, bytes of the struct
  std::map<std::string, std::pair<std::size_t, std::size_t>> listed;
#define MEMBER(T, member)                        \
  listed[#T].first += sizeof(device::T::member); \
  listed[#T].second = sizeof(device::T);
  RAYWAVE_LAYOUT(MEMBER)
#undef MEMBER
  for (const auto& [name, bytes] : listed) {
    INFO("members of " << name << " missing in kernels/common/shared_layout.h");
    CHECK(bytes.first == bytes.second);
  }
  CHECK(selftest::misplaced_members(device).empty());
}

DEVICE_TEST("cosine and sine of a phase in turns are right to 1.7e-7") {
  for (const int lanes : {1, 4, 8, 16}) {
    INFO(device.info().name << ", " << lanes << " lanes");
    CHECK(selftest::cos_sin_error(device, lanes, selftest::cos_sin_arguments()) <= 1.7e-7);
  }
}

}  // namespace raywave
