// SPDX-License-Identifier: Apache-2.0
// Propagation on the device: whole padded planes, transformed by one of its FFT back ends.
#include <string>

#include "cl/program.hpp"
#include "host/geometry/kernel_options.hpp"
#include "host/propagate/propagator_engine.hpp"

namespace raywave {
namespace {

std::size_t size(int n) { return static_cast<std::size_t>(n); }

class DeviceEngine final : public PropagationEngine {
public:
  DeviceEngine(const cl::Device& device, const PropagationPlan& plan)
      : device_(device),
        plan_(plan),
        spectrum_(device, size(plan.x.padded) * size(plan.y.padded), "padded plane"),
        sum_(device, size(plan.x.padded) * size(plan.y.padded), "sum of spectra"),
        fft_(cl::make_fft(device, plan.spec.backend,
                          {size(plan.x.padded), size(plan.y.padded), size(plan.spec.size.x),
                           size(plan.spec.size.y)})),
        program_(device, "kernels/propagate/propagate.cl", options(false)),
        phase_x_(device, size(plan.x.padded), "phases"),
        phase_y_(device, size(plan.y.padded), "phases"),
        power_x_(device, plan.power_x, "frequencies"),
        power_y_(device, plan.power_y, "frequencies"),
        band_x_(device, 2 * size(plan.x.padded), "band"),
        band_y_(device, 2 * size(plan.y.padded), "band") {}

  void load(const cl::ComplexBuffer& field, int frame, const Band&, bool) override {
    const auto n = plan_.spec.size;
    run_rows(device_, program_.kernel("pad"), plan_.x.padded, plan_.y.padded, field, spectrum_,
             frame, n.x, n.y, plan_.x.padded, plan_.y.padded);
    fft_->forward(spectrum_);
  }

  void add(const std::shared_ptr<const Transfer>& transfer) override {
    const auto& t = *transfer;
    if (t.two_floats && !has_two_floats_) {
      program_two_floats_ = {device_, "kernels/propagate/propagate.cl", options(true)};
      has_two_floats_ = true;
    }
    phase_x_.write(t.phase_x);
    phase_y_.write(t.phase_y);
    band_x_.write(t.band_x);
    band_y_.write(t.band_y);
    run_rows(device_, (t.two_floats ? program_two_floats_ : program_).kernel("multiply_add"),
             plan_.x.padded, plan_.y.padded, spectrum_, sum_, phase_x_, phase_y_, power_x_,
             power_y_, band_x_, band_y_, t.depth_hi, t.depth_lo, t.fades.left, t.fades.right,
             t.fades.first, t.fades.last, static_cast<float>(plan_.scale), plan_.x.padded,
             plan_.y.padded, static_cast<std::int32_t>(sum_holds_spectra_));
    sum_holds_spectra_ = true;
  }

  void collect(cl::ComplexBuffer& field) override {
    if (!sum_holds_spectra_) return field.fill_zero();
    const auto n = plan_.spec.size;
    fft_->inverse(sum_);
    run_rows(device_, program_.kernel("crop"), n.x, n.y, sum_, field, n.x, n.y, plan_.x.padded);
    sum_holds_spectra_ = false;
  }

private:
  cl::Options options(bool two_floats) const {
    return {{option::lanes, std::to_string(device_.info().float_lanes)},
            {option::two_floats, two_floats ? "1" : "0"}};
  }

  cl::Device device_;
  PropagationPlan plan_;
  cl::ComplexBuffer spectrum_, sum_;
  bool sum_holds_spectra_ = false;
  std::unique_ptr<cl::Fft> fft_;
  cl::Program program_, program_two_floats_;
  bool has_two_floats_ = false;
  cl::Buffer<float> phase_x_, phase_y_, power_x_, power_y_;
  cl::Buffer<std::int32_t> band_x_, band_y_;
};

}  // namespace

std::unique_ptr<PropagationEngine> make_device_engine(const cl::Device& device,
                                                      const PropagationPlan& plan) {
  return std::make_unique<DeviceEngine>(device, plan);
}

}  // namespace raywave
