// SPDX-License-Identifier: Apache-2.0
/// What all carriers share: planes that are filled with light, those of several frames at once.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <tuple>
#include <vector>

#include "cl/program.hpp"
#include "host/carriers/carrier.hpp"
#include "host/common/plane_fft.hpp"
#include "host/trace/gatherer.hpp"

namespace raywave {

/// A filled plane: number `plane` of a stack in device memory.
struct FilledPlane {
  cl::ComplexBuffer& stack;
  int plane = 0;
  PlanePart lit{};  // of a virtual plane: the only part that is filled, unless all was asked for
};

class PlaneCarrier : public Carrier {
public:
  /// device         has the scene and its samples
  /// planes_device  has the planes and the hologram: another for virtual planes alone
  PlaneCarrier(const cl::Device& device, const cl::Device& planes_device, CarrierOptions options,
               StageTimes& times);

  void prepare(const DeviceScene& scene, std::shared_ptr<const SampleTable> table) final;
  void release() final;
  TileField carry(std::size_t tile, int frame) final;

protected:
  /// Makes what fills the planes of `frames` frames at once; `drop_source` frees it.
  virtual void make_source(const DeviceScene& scene, const SampleTable* table, int frames) = 0;
  virtual void drop_source() = 0;
  /// Starts the frames of seed, seed + 1, ...
  virtual void start(std::uint32_t seed) = 0;
  /// Fills the stack's planes with the light on a plane of the plan.
  ///
  /// is_whole  virtual planes are filled beyond their lit part, too
  virtual PlanePart fill(const Wrp& wrp, cl::ComplexBuffer& stack, bool is_whole) = 0;
  /// Adds a plane's light to that of the tile. What the plane then holds is not defined.
  virtual void add(const Wrp& wrp, bool is_first, const FilledPlane& plane) = 0;
  /// The light of the tile.
  virtual TileField sum() = 0;

  /// Memory for the pixels of a tile.
  void make_field();
  /// throws  InputError for rays from the hologram where surfaces cross it
  void require_far_hits() const;

  cl::Device samples_device_, device_;
  CarrierOptions options_;
  StageTimes& times_;
  const Plan* plan_ = nullptr;
  cl::ComplexBuffer field_;  // of a tile, at the hologram

private:
  /// Plans with equal keys share kernels.
  using KernelKey = std::tuple<bool, bool, int, bool, Precision, int, cl::Options>;

  FilledPlane filled(std::size_t wrp, int frame);
  void make_stacks();

  std::shared_ptr<const SampleTable> table_;  // of the kernels, also when there is a newer
  KernelKey built_for_;
  bool has_source_ = false;
  int frames_together_ = 1;
  // Of one plane after the other; where frames are filled together, one for each plane of a tile
  std::vector<cl::ComplexBuffer> stacks_;
  std::vector<PlanePart> lit_;  // as many
};

/// A carrier over planes in space, whose light is gathered from surface samples, or traced along
/// the rays of fans.
class SourceCarrier : public PlaneCarrier {
protected:
  using PlaneCarrier::PlaneCarrier;

  void make_source(const DeviceScene& scene, const SampleTable* table, int frames) final {
    if (table)
      gatherer_.emplace(device_, *plan_, scene, *table, frames);
    else
      fans_.emplace(device_, *plan_, scene);
  }
  void drop_source() final {
    gatherer_.reset();
    fans_.reset();
  }
  void start(std::uint32_t seed) final {
    seed_ = seed;
    if (gatherer_) gatherer_->draw_phases(seed);
  }
  PlanePart fill(const Wrp& wrp, cl::ComplexBuffer& stack, bool) final {
    if (gatherer_)
      gatherer_->gather(wrp, stack);
    else
      fans_->trace(wrp, seed_, stack);
    return {};
  }

private:
  std::optional<Gatherer> gatherer_;
  std::optional<FanTracer> fans_;
  std::uint32_t seed_ = 0;
};

}  // namespace raywave
