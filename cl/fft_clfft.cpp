// SPDX-License-Identifier: Apache-2.0
#include "cl/fft.hpp"

#include <clFFT.h>

#include <array>
#include <cstdlib>
#include <filesystem>

#include "host/common/cache.hpp"
#include "host/common/stage_clock.hpp"

namespace raywave::cl {
namespace {

[[noreturn]] void fail(const Device& device, const std::string& what, clfftStatus status) {
  if (status < 0) throw_device_error(::cl::Error(status, what.c_str()), device.info());
  const char* meaning = status == CLFFT_NOTIMPLEMENTED
                            ? "not implemented: sizes must be products of 2, 3, 5, 7, 11 and 13"
                        : status == CLFFT_DEVICE_MISMATCH  ? "the plan was made for another device"
                        : status == CLFFT_VERSION_MISMATCH ? "library and header differ in version"
                        : status == CLFFT_FILE_CREATE_FAILURE ? "a file cannot be written"
                                                              : "error inside clFFT";
  throw DeviceError(what + ": " + meaning + " (" + std::to_string(status) + ") on " +
                    device.info().name);
}

/// clFFT's process-wide state: set up once, taken down before the OpenCL driver, which was there
/// first.
class Library {
public:
  static void set_up(const Device& device) {
    static const Library library;
    if (library.status_ != CLFFT_SUCCESS) fail(device, "clfftSetup", library.status_);
  }

private:
  Library() {
    // clFFT keeps the binaries of its kernels where this points; PoCL needs 10 to 30 s for a plan
    // without.
    const auto folder = cache_folder() / "clfft";
    std::error_code ignored;
    std::filesystem::create_directories(folder, ignored);
    setenv("CLFFT_CACHE_PATH", folder.c_str(), 0);
    clfftSetupData data;
    clfftInitSetupData(&data);
    status_ = clfftSetup(&data);
  }
  ~Library() { clfftTeardown(); }

  clfftStatus status_;
};

/// While it lives, PoCL's compiler counts no warnings on standard error: clFFT's kernels have
/// attributes that it does not know.
class WithoutWarnings {
public:
  WithoutWarnings() : is_ours_(!std::getenv(flags)) { setenv(flags, "-w", 0); }
  ~WithoutWarnings() {
    if (is_ours_) unsetenv(flags);
  }
  WithoutWarnings(const WithoutWarnings&) = delete;
  WithoutWarnings& operator=(const WithoutWarnings&) = delete;

private:
  static constexpr const char* flags = "POCL_EXTRA_BUILD_FLAGS";
  bool is_ours_;
};

class ClFft final : public Fft {
public:
  ClFft(const Device& device, const FftShape& shape) : device_(device) {
    // clFFT takes no axis of length 1.
    std::array<std::size_t, 2> lengths{};
    std::size_t axes = 0;
    for (const auto n : {shape.nx, shape.ny}) {
      if (n > 1) lengths[axes++] = n;
    }
    if (axes == 0) return;

    Library::set_up(device);
    const std::string size =
        "FFT of " + std::to_string(shape.nx) + " x " + std::to_string(shape.ny) + " by clFFT";
    const auto check = [&](clfftStatus status) {
      if (status != CLFFT_SUCCESS) fail(device, size, status);
    };
    check(clfftCreateDefaultPlan(&plan_, device.context()(), axes == 1 ? CLFFT_1D : CLFFT_2D,
                                 lengths.data()));
    is_planned_ = true;
    try {
      check(clfftSetPlanPrecision(plan_, CLFFT_SINGLE));
      check(clfftSetLayout(plan_, CLFFT_COMPLEX_INTERLEAVED, CLFFT_COMPLEX_INTERLEAVED));
      check(clfftSetResultLocation(plan_, CLFFT_INPLACE));
      check(clfftSetPlanScale(plan_, CLFFT_FORWARD, 1));
      check(clfftSetPlanScale(plan_, CLFFT_BACKWARD, 1));
      const CompileClock clock;
      const WithoutWarnings quiet;
      cl_command_queue queue = device.queue()();
      check(clfftBakePlan(plan_, 1, &queue, nullptr, nullptr));
      std::size_t work_bytes = 0;
      check(clfftGetTmpBufSize(plan_, &work_bytes));
      if (work_bytes) work_ = Memory(device, work_bytes, "work space of the FFT");
    } catch (...) {
      clfftDestroyPlan(&plan_);
      throw;
    }
  }
  ~ClFft() override {
    if (is_planned_) clfftDestroyPlan(&plan_);
  }
  ClFft(const ClFft&) = delete;
  ClFft& operator=(const ClFft&) = delete;

  void forward(ComplexBuffer& plane) override { enqueue(plane, CLFFT_FORWARD); }
  void inverse(ComplexBuffer& plane) override { enqueue(plane, CLFFT_BACKWARD); }

private:
  void enqueue(ComplexBuffer& plane, clfftDirection direction) {
    if (!is_planned_) return;
    cl_command_queue queue = device_.queue()();
    cl_mem memory = plane.handle()();
    const auto status = clfftEnqueueTransform(plan_, direction, 1, &queue, 0, nullptr, nullptr,
                                              &memory, nullptr, work_.handle()());
    if (status != CLFFT_SUCCESS) fail(device_, "FFT by clFFT", status);
  }

  Device device_;
  clfftPlanHandle plan_ = 0;
  bool is_planned_ = false;
  Memory work_;
};

}  // namespace

std::unique_ptr<Fft> make_clfft(const Device& device, const FftShape& shape) {
  return std::make_unique<ClFft>(device, shape);
}

}  // namespace raywave::cl
