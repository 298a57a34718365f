#pragma once
#include <algorithm>

#include "hm/core/time.hpp"

namespace hm {

/// Token bucket: `per_s` messages a second, and twice as many at once after a pause.
class RateLimit {
 public:
  explicit RateLimit(double per_s, Duration now = {}) : per_s_(per_s), tokens_(2 * per_s), last_(now) {}
  /// False if there are too many.
  bool take(Duration now) {
    tokens_ = tokens_at(now);
    last_ = now;
    if (tokens_ < 1) return false;
    tokens_ -= 1;
    return true;
  }
  /// True when as many as ever may come at once.
  [[nodiscard]] bool is_rested(Duration now) const { return tokens_at(now) >= 2 * per_s_; }

 private:
  [[nodiscard]] double tokens_at(Duration now) const {
    return std::min(2 * per_s_, tokens_ + static_cast<double>(now.ns - last_.ns) * 1e-9 * per_s_);
  }

  double per_s_, tokens_;
  Duration last_;
};

}  // namespace hm
