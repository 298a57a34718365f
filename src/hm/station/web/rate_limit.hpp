#pragma once
#include <algorithm>

#include "hm/core/time.hpp"

namespace hm {

/// Token bucket: `per_s` messages a second, and twice as many at once after a pause.
class RateLimit {
 public:
  explicit RateLimit(double per_s) : per_s_(per_s), tokens_(2 * per_s) {}
  /// False if there are too many.
  bool take(Duration now) {
    tokens_ = std::min(2 * per_s_, tokens_ + static_cast<double>(now.ns - last_.ns) * 1e-9 * per_s_);
    last_ = now;
    if (tokens_ < 1) return false;
    tokens_ -= 1;
    return true;
  }

 private:
  double per_s_, tokens_;
  Duration last_;
};

}  // namespace hm
