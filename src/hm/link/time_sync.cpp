#include "hm/link/time_sync.hpp"

#include <algorithm>
#include <cmath>

namespace hm {
namespace {

/// What an offset may differ by besides half the round trips: rounding and the scheduler.
constexpr double kStepMargin_s = 1e-3;
/// Round trips closer than this to the least are equally good.
constexpr double kJitterFloor_s = 100e-6;
/// A line through exchanges over less time says more about the delays than about the clocks.
constexpr double kMinLineSpan_s = 5;

}  // namespace

bool TimeSync::is_step(const Exchange& exchange) const {
  if (count_ == 0) return false;
  const Exchange& best = exchanges_[best_];
  const double elapsed_s = std::abs((exchange.local - best.local).seconds());
  const double explained_s = (exchange.round_trip + best.round_trip).seconds() / 2 + kMaxDrift * elapsed_s;
  const double difference_s = exchange.offset.seconds() - best.offset.seconds();
  return std::abs(difference_s) > explained_s + kStepMargin_s;
}

TimeSync::Update TimeSync::add(Time sent, Time remote, Time received) {
  const Duration round_trip = received - sent;
  if (round_trip < Duration{} || round_trip > kMaxRoundTrip) return Update::kRejected;
  const Time middle{sent.ns + round_trip.ns / 2};
  const Exchange exchange{middle, remote - middle, round_trip};
  if (count_ > 0 && exchange.local < exchanges_[(next_ + kWindow - 1) % kWindow].local)
    return Update::kRejected;
  const bool step = is_step(exchange);
  if (step) {
    count_ = next_ = 0;
    ++steps_;
  }
  exchanges_[next_] = exchange;
  next_ = (next_ + 1) % kWindow;
  count_ = std::min(count_ + 1, kWindow);
  fit();
  return step ? Update::kClockStep : Update::kUsed;
}

void TimeSync::fit() {
  best_ = 0;
  Time first = exchanges_[0].local, last = first;
  for (std::size_t i = 0; i < count_; ++i) {
    if (exchanges_[i].round_trip < exchanges_[best_].round_trip) best_ = i;
    first = std::min(first, exchanges_[i].local);
    last = std::max(last, exchanges_[i].local);
  }
  drift_ = 0;
  if ((last - first).seconds() < kMinLineSpan_s) return;
  const Exchange& best = exchanges_[best_];
  double sum_w = 0, sum_t = 0, sum_o = 0, sum_tt = 0, sum_to = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    const double excess_s =
        Duration{exchanges_[i].round_trip.ns - best.round_trip.ns}.seconds() + kJitterFloor_s;
    const double w = 1 / (excess_s * excess_s);  // half the excess is the standard deviation of the offset
    const double t = (exchanges_[i].local - best.local).seconds();
    const double o = static_cast<double>(exchanges_[i].offset.ns - best.offset.ns) * 1e-9;
    sum_w += w;
    sum_t += w * t;
    sum_o += w * o;
    sum_tt += w * t * t;
    sum_to += w * t * o;
  }
  const double spread = sum_w * sum_tt - sum_t * sum_t;
  if (spread > 0) drift_ = std::clamp((sum_w * sum_to - sum_t * sum_o) / spread, -kMaxDrift, kMaxDrift);
}

std::optional<Duration> TimeSync::offset_at(Time local) const {
  if (count_ == 0) return std::nullopt;
  const Exchange& best = exchanges_[best_];
  return best.offset + Duration::from_seconds(drift_ * (local - best.local).seconds());
}

std::optional<Time> TimeSync::to_local(Time remote) const {
  if (count_ == 0) return std::nullopt;
  const Exchange& best = exchanges_[best_];
  const double remote_since_s = static_cast<double>(remote.ns - best.local.ns - best.offset.ns) * 1e-9;
  return best.local + Duration::from_seconds(remote_since_s / (1 + drift_));
}

std::optional<Time> TimeSync::to_remote(Time local) const {
  const auto offset = offset_at(local);
  if (!offset) return std::nullopt;
  return local + *offset;
}

std::optional<Duration> TimeSync::uncertainty() const {
  if (count_ == 0) return std::nullopt;
  return Duration{exchanges_[best_].round_trip.ns / 2};
}

}  // namespace hm
