// SPDX-License-Identifier: Apache-2.0
#include "host/display/show.hpp"

#include <algorithm>
#include <cmath>
#include <future>

#include "host/common/error.hpp"
#include "host/common/text.hpp"

namespace raywave {
namespace {

constexpr std::size_t most_latencies = std::size_t{1} << 20;

/// Refreshes of the output to a frame, >= 1; whole where it nearly is.
double refreshes_each(double output_hz, double rate_hz) {
  if (rate_hz == 0 || is_rate(output_hz, rate_hz)) return 1;
  const double ratio = output_hz / rate_hz;
  if (ratio < 1)
    throw InputError(
        format("%.4g frames a second are wanted, and the output shows %.4g", rate_hz, output_hz));
  return std::abs(ratio - std::round(ratio)) < 0.005 * ratio ? std::round(ratio) : ratio;
}

}  // namespace

double ShownFrames::latency_s(double share) const {
  if (latencies_s.empty()) return 0;
  const auto last = static_cast<double>(latencies_s.size() - 1);
  return latencies_s[static_cast<std::size_t>(std::llround(share * last))];
}

ShownFrames show_frames(
    Display& display, double output_hz, double rate_hz, const NextFrame& next,
    const std::atomic<bool>& stop,
    const std::function<void(const LevelFrame&, const Flip&, std::uint64_t missed)>& tell) {
  const double each = refreshes_each(output_hz, rate_hz);
  const auto begins = [&](std::uint64_t frame) {
    return static_cast<std::uint64_t>(static_cast<double>(frame) * each + 1e-6);
  };
  ShownFrames all;
  auto& count = all.count;
  std::uint64_t due = 0;
  Flip first, last;
  auto frame = next();
  const auto size = frame ? frame->size_px : glm::ivec2(0);
  while (frame && !stop) {
    if (frame->size_px != size)
      throw InputError(in_quotes(frame->name) + ": is " + size_text(frame->size_px) +
                       " pixels, the frames before it " + size_text(size));
    auto coming = std::async(std::launch::async, std::cref(next));
    display.flip(*frame, due);
    last = display.event();
    if (count.shown == 0) first = last;
    const auto missed = last.refresh - std::min(due, last.refresh);
    auto holds = begins(count.shown + 1) - begins(count.shown);
    ++count.shown;
    count.missed += missed;
    due = last.refresh + holds;
    const double latency_s = last.time_s - last.asked_s;
    if (all.latencies_s.size() < most_latencies)
      all.latencies_s.push_back(latency_s);
    else
      all.latencies_s[count.shown % most_latencies] = latency_s;
    if (tell) tell(*frame, last, missed);
    frame = coming.get();
    // The display waits for the refresh; here, what is far away does not keep `stop` waiting
    const double end_s = last.time_s + static_cast<double>(holds) / output_hz,
                 rest_s = frame ? 3 / output_hz : 0;
    while (!stop && now_s() < end_s - rest_s) sleep_until(std::min(now_s() + 0.05, end_s - rest_s));
    if (stop) {
      const double held = std::ceil((now_s() - last.time_s) * output_hz);
      holds = static_cast<std::uint64_t>(std::clamp(held, 1.0, static_cast<double>(holds)));
    }
    count.repeated += holds - 1;
    count.refreshes = last.refresh - first.refresh + holds;
  }
  all.seconds = last.time_s - first.time_s;
  std::sort(all.latencies_s.begin(), all.latencies_s.end());
  return all;
}

}  // namespace raywave
