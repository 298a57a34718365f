#include "hm/pipeline/serve/replay.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "hm/core/stopwatch.hpp"

namespace hm {

void Replay::request(const ReplayRequest& request) {
  {
    const std::lock_guard lock(mutex_);
    if (request.paused) request_.paused = request.paused;
    if (request.speed && std::isfinite(*request.speed)) request_.speed = request.speed;
    if (request.seek_s && std::isfinite(*request.seek_s)) request_.seek_s = request.seek_s;
    is_requested_ = true;
  }
  requested_.notify_all();
}

double Replay::time_s(std::size_t moment) const {
  return (subject_.stamp(moment) - subject_.stamp(0)).seconds();
}

void Replay::take_request() {
  ReplayRequest request;
  {
    const std::lock_guard lock(mutex_);
    if (!is_requested_) return;
    std::swap(request, request_);
    is_requested_ = false;
  }
  paused_ = request.paused.value_or(paused_);
  if (request.speed) {
    const double speed = std::clamp(*request.speed, kLowestSpeed, kHighestSpeed);
    ahead_s_ *= speed_ / speed;
    speed_ = speed;
  }
  if (!request.seek_s || subject_.count() == 0) return;
  std::size_t target = 0;
  while (target < subject_.count() && time_s(target) < *request.seek_s) ++target;
  if (target < next_) {
    subject_.restart();
    next_ = 0;
  }
  hurry_to_ = target;
  ahead_s_ = 0;
}

bool Replay::at_end() const { return next_ >= subject_.count(); }

bool Replay::step(double most_s) {
  take_request();
  const bool hurries = next_ < hurry_to_;
  const auto wait = [this](double seconds) {
    const Stopwatch watch;
    std::unique_lock lock(mutex_);
    requested_.wait_for(lock, std::chrono::duration<double>(seconds), [this] { return is_requested_; });
    return watch.seconds();
  };
  if (at_end() || (paused_ && !hurries)) {
    if (!std::exchange(rests_, true)) subject_.settle();
    wait(most_s);
    return false;
  }
  if (!hurries && ahead_s_ > 0) {
    ahead_s_ -= wait(std::min(ahead_s_, most_s));
    if (ahead_s_ > 1e-4) return false;
  }
  const Stopwatch watch;
  rests_ = false;
  subject_.show(next_);
  const double took_s = watch.seconds();
  const double step_s = next_ + 1 < subject_.count() ? time_s(next_ + 1) - time_s(next_) : 0;
  ++next_;
  // A slow machine does not make up for lost time.
  ahead_s_ = hurries ? 0 : std::max(0.0, std::min(ahead_s_, 0.0) + std::max(step_s, 0.0) / speed_ - took_s);
  return true;
}

JsonValue Replay::state() const {
  const std::size_t count = subject_.count();
  const double now_s = count == 0 ? 0 : time_s(std::min(next_ == 0 ? 0 : next_ - 1, count - 1));
  return JsonValue::object({{"time_s", now_s},
                            {"begin_s", 0.0},
                            {"end_s", count == 0 ? 0.0 : time_s(count - 1)},
                            {"speed", speed_},
                            {"paused", paused_}});
}

}  // namespace hm
