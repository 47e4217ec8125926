// SPDX-License-Identifier: Apache-2.0
/// The knobs of a trade one by one, by the names that they have in the scene file.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "host/evaluate/trade/trade.hpp"

namespace raywave {

struct TradeKnob {
  std::string key;  // "sampling.pitch"; "fft" is no key of the scene
  std::function<nlohmann::ordered_json(const TradeKnobs&)> get;
  // Throws nlohmann's exceptions for what get never gives
  std::function<void(TradeKnobs&, const nlohmann::ordered_json&)> set;
};

const std::vector<TradeKnob>& trade_knobs();

nlohmann::ordered_json json_of(const TradeKnobs& knobs);
TradeKnobs knobs_of(const nlohmann::ordered_json& json);

/// The knobs of a scene; the precision is the plan's.
TradeKnobs knobs_of(const Scene& scene, const Plan& plan, cl::FftBackend fft);

/// Fills in rows, presets, steps and combinations: the configurations to measure.
void plan_rows(Trade& trade, const World& world, const TradeSpec& spec);

/// A row as trade_json writes it, and read again.
nlohmann::ordered_json json_of(const TradeRow& row);
TradeRow row_of(const nlohmann::ordered_json& json);

}  // namespace raywave
