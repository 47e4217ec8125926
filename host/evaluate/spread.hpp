// SPDX-License-Identifier: Apache-2.0
/// Median and quartiles of repeated measurements.
#pragma once

#include <vector>

namespace raywave {

/// Median and quartiles, in the unit of the values.
struct Spread {
  double median = 0, low = 0, high = 0;
};

/// Quantiles are linear between neighbouring values; all are zero when there is no value.
Spread spread_of(std::vector<double> values);

}  // namespace raywave
