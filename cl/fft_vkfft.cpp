// SPDX-License-Identifier: Apache-2.0
#define VKFFT_BACKEND 3  // OpenCL
#include "cl/fft.hpp"

#include <vkFFT.h>

#include "host/common/stage_clock.hpp"

namespace raywave::cl {
namespace {

class VkFft final : public Fft {
public:
  VkFft(const Device& device, const FftShape& shape)
      : device_(device), size_(std::to_string(shape.nx) + " x " + std::to_string(shape.ny)) {
    // An axis of length 1 is no axis for VkFFT.
    for (const auto n : {shape.nx, shape.ny}) {
      if (n > 1) configuration_.size[configuration_.FFTdim++] = n;
    }
    if (configuration_.FFTdim == 0) return;
    device_id_ = device.handle()();
    context_ = device.context()();
    bytes_ = shape.nx * shape.ny * sizeof(std::complex<float>);
    configuration_.device = &device_id_;
    configuration_.context = &context_;
    configuration_.bufferSize = &bytes_;
    // Sines from tables that the host computes in double. The default on most devices is
    // native_sin, whose error is the driver's: 1e-4 on Intel's FPGA emulator.
    configuration_.useLUT = 1;

    // Its binaries are not kept: VkFFT 1.2 reads beyond them when it takes them back, and Mesa's
    // rusticl aborts where it asks for them. Drivers keep their own.
    const CompileClock clock;
    if (const auto result = initializeVkFFT(application_.get(), configuration_);
        result != VKFFT_SUCCESS)
      fail(result);
    is_planned_ = true;
  }
  ~VkFft() override {
    if (is_planned_) deleteVkFFT(application_.get());
  }
  VkFft(const VkFft&) = delete;
  VkFft& operator=(const VkFft&) = delete;

  void forward(ComplexBuffer& plane) override { enqueue(plane, -1); }
  void inverse(ComplexBuffer& plane) override { enqueue(plane, 1); }

private:
  [[noreturn]] void fail(VkFFTResult result) const {
    throw DeviceError("FFT of " + size_ + " by VkFFT: error " + std::to_string(result) + " on " +
                      device_.info().name + "; --fft host or clfft may serve it");
  }

  void enqueue(ComplexBuffer& plane, int sign) {
    if (!is_planned_) return;
    cl_command_queue queue = device_.queue()();
    cl_mem memory = plane.handle()();
    VkFFTLaunchParams launch{};
    launch.commandQueue = &queue;
    launch.buffer = &memory;
    if (const auto result = VkFFTAppend(application_.get(), sign, &launch); result != VKFFT_SUCCESS)
      fail(result);
  }

  Device device_;
  std::string size_;
  cl_device_id device_id_ = nullptr;
  cl_context context_ = nullptr;
  std::uint64_t bytes_ = 0;
  VkFFTConfiguration configuration_{};
  std::unique_ptr<VkFFTApplication> application_ = std::make_unique<VkFFTApplication>();
  bool is_planned_ = false;
};

}  // namespace

std::unique_ptr<Fft> make_vkfft(const Device& device, const FftShape& shape) {
  return std::make_unique<VkFft>(device, shape);
}

}  // namespace raywave::cl
