#include "hm/link/time_sync.hpp"

#include <algorithm>
#include <cmath>

namespace hm {
namespace {

/// Allowed difference of offsets besides half the round trips: rounding and the scheduler.
constexpr double kStepMargin_s = 1e-3;
/// Round trips closer than this to the least are equally good.
constexpr double kJitterFloor_s = 100e-6;
/// Deviation of the difference of two quartz clocks before anything is known of it.
constexpr double kDriftPrior = 50e-6;
/// Random walk of the drift per root of a second: 0.15 ppm in a minute, as quartz does while it warms.
constexpr double kDriftWalk = 0.02e-6;

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
  best_ = 0;
  for (std::size_t i = 1; i < count_; ++i)
    if (exchanges_[i].round_trip < exchanges_[best_].round_trip) best_ = i;
  if (count_ == 1) {
    start(exchange);
  } else {
    predict(exchange.local);
    correct(exchange);
  }
  return step ? Update::kClockStep : Update::kUsed;
}

/// The first exchange: nothing is known of its delays but that both are within its round trip.
void TimeSync::start(const Exchange& exchange) {
  at_ = exchange.local;
  start_ = exchange.offset;
  offset_s_ = drift_ = cov_s_ = 0;
  const double deviation_s = exchange.round_trip.seconds() / 2 + kJitterFloor_s;
  var_offset_s2_ = deviation_s * deviation_s;
  var_drift_ = kDriftPrior * kDriftPrior;
}

void TimeSync::predict(Time local) {
  const double dt_s = (local - at_).seconds();
  const double walk = kDriftWalk * kDriftWalk;
  offset_s_ += drift_ * dt_s;
  var_offset_s2_ += dt_s * (2 * cov_s_ + dt_s * var_drift_) + walk * dt_s * dt_s * dt_s / 3;
  cov_s_ += dt_s * var_drift_ + walk * dt_s * dt_s / 2;
  var_drift_ += walk * dt_s;
  at_ = local;
}

void TimeSync::correct(const Exchange& exchange) {
  const Duration least = exchanges_[best_].round_trip;
  const double excess_s = Duration{exchange.round_trip.ns - least.ns}.seconds();
  // The least of n round trips is taken to exceed what is possible by an n-th of itself: without that, two
  // slow exchanges at the start would count as exact.
  const double unseen_s = least.seconds() / static_cast<double>(count_);
  const double deviation_s = (excess_s + unseen_s + kJitterFloor_s) / 2;
  const double innovation_s = Duration{exchange.offset.ns - start_.ns}.seconds() - offset_s_;
  const double variance_s2 = var_offset_s2_ + deviation_s * deviation_s;
  const double gain = var_offset_s2_ / variance_s2, drift_gain = cov_s_ / variance_s2;
  offset_s_ += gain * innovation_s;
  drift_ += drift_gain * innovation_s;
  var_drift_ -= drift_gain * cov_s_;
  cov_s_ *= 1 - gain;
  var_offset_s2_ *= 1 - gain;
}

double TimeSync::drift() const { return std::clamp(drift_, -kMaxDrift, kMaxDrift); }

std::optional<Duration> TimeSync::offset_at(Time local) const {
  if (count_ == 0) return std::nullopt;
  return start_ + Duration::from_seconds(offset_s_ + drift() * (local - at_).seconds());
}

std::optional<Time> TimeSync::to_local(Time remote) const {
  if (count_ == 0) return std::nullopt;
  const double remote_since_s = (remote - (at_ + start_)).seconds() - offset_s_;
  return at_ + Duration::from_seconds(remote_since_s / (1 + drift()));
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
