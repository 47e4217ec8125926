// SPDX-License-Identifier: Apache-2.0
#include "cl/choose_device.hpp"

#include <algorithm>
#include <cctype>
#include <tuple>

#include "host/common/error.hpp"

namespace raywave::cl {
namespace {

std::string lower(std::string_view text) {
  std::string result(text);
  std::transform(result.begin(), result.end(), result.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return result;
}

std::string listing(const std::vector<Offer>& offers, const std::vector<std::size_t>& places) {
  std::string text;
  for (const auto i : places)
    text += (text.empty() ? "" : ", ") + offers[i].index + " " + offers[i].name;
  return text;
}

/// Compute units of GPUs that share the host's memory are many and small; those of CPUs stand for
/// one machine, whichever platform counts them.
bool goes_before(const Offer& a, const Offer& b) {
  if (a.kind != b.kind) return a.kind < b.kind;
  return name_of(a.kind) == std::string_view("gpu") &&
         std::tie(a.own_memory, a.units_mhz) > std::tie(b.own_memory, b.units_mhz);
}

}  // namespace

std::size_t choose_device(const std::vector<Offer>& offers, std::string_view choice) {
  std::vector<std::size_t> all, of_kind, fitting;
  for (std::size_t i = 0; i < offers.size(); ++i) {
    const auto& o = offers[i];
    if (o.index == choice) return i;
    all.push_back(i);
    if (choice.empty() || name_of(o.kind) == lower(choice)) of_kind.push_back(i);
    // "pocl" is in PoCL's version alone
    if (lower(o.platform + " " + o.name + " " + o.version).find(lower(choice)) != std::string::npos)
      fitting.push_back(i);
  }
  if (!of_kind.empty())
    return *std::min_element(of_kind.begin(), of_kind.end(), [&](std::size_t a, std::size_t b) {
      return goes_before(offers[a], offers[b]);
    });
  if (fitting.size() == 1) return fitting[0];
  const std::string asked = "device \"" + std::string(choice) + "\"";
  if (fitting.empty())
    throw DeviceError(asked + ": no such device; there are: " + listing(offers, all));
  throw DeviceError(asked + " fits more than one, name its index: " + listing(offers, fitting));
}

}  // namespace raywave::cl
