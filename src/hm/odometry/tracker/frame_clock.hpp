#pragma once
#include <deque>

#include "hm/core/time.hpp"

namespace hm {

/// Times of a camera's frames from jittering stamps. A camera exposes its frames at a fixed rate, while
/// stamps are off by the delays of their transmission: the times are a straight line over the frames'
/// numbers, fitted to the latest stamps by least squares. Velocities from such intervals have less noise.
class FrameClock {
 public:
  /// The next frame; stamps increase.
  void add(Time stamp);
  /// Time between two of the latest frames, in seconds: that of the line; the difference of their stamps
  /// while fewer than six are known, if they do not come at a fixed rate (from which some may be missing), or
  /// if one of the frames is not known any more.
  [[nodiscard]] double interval_s(Time from, Time to) const;

  template <class Archive>
  void visit_state(Archive& archive) {
    archive(stamps_);
  }

 private:
  std::deque<Time> stamps_;
};

}  // namespace hm
