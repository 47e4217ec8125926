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
  std::function<Json(const TradeKnobs&)> get;
  // Throws InputError or nlohmann's exceptions for what get never gives
  std::function<void(TradeKnobs&, const Json&)> set;
};

/// At most `most` of the values, evenly spaced, including the first and the last.
template <class T>
std::vector<T> thinned(std::vector<T> values, std::size_t most) {
  if (values.size() <= most || most < 2) return values;
  std::vector<T> some;
  for (std::size_t i = 0; i < most; ++i)
    some.push_back(values[i * (values.size() - 1) / (most - 1)]);
  return some;
}

const std::vector<TradeKnob>& trade_knobs();

Json json_of(const TradeKnobs& knobs);
TradeKnobs knobs_of(const Json& json);

/// The knobs of a scene; the precision is the plan's.
TradeKnobs knobs_of(const Scene& scene, const Plan& plan, cl::FftBackend fft);

/// Fills in rows, presets, steps and combinations: the configurations to measure.
void plan_rows(Trade& trade, const World& world, const TradeSpec& spec);

/// A row as trade_json writes it, and read again.
Json json_of(const TradeRow& row);
TradeRow row_of(const Json& json);

}  // namespace raywave
