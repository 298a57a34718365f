#pragma once
#include <cstdint>
#include <deque>

#include "hm/core/time.hpp"

namespace hm {

/// Rate at which a viewer takes frames, from its acknowledgements: bytes acknowledged over the time they
/// took, as in BBR (Cardwell et al. 2016). A sample from a time when there was too little to send can only
/// raise it.
class DeliveryRate {
 public:
  void sent(std::uint32_t sequence, std::size_t bytes, bool little_to_send, Duration now);
  /// Everything up to `sequence` has arrived; sequences of frames that were sent never fall.
  void acknowledge(std::uint32_t sequence, Duration now);
  [[nodiscard]] double bytes_per_s() const { return rate_; }
  /// Sent and not acknowledged.
  [[nodiscard]] std::size_t pending_bytes() const { return pending_; }
  [[nodiscard]] std::uint64_t acknowledged_bytes() const { return delivered_; }

 private:
  struct Frame {
    std::uint32_t sequence = 0;
    std::size_t bytes = 0;
    bool little_to_send = false;
    std::uint64_t delivered = 0;  ///< when it was sent
    Duration delivered_at;
  };
  static constexpr double kStartRate = 64 * 1024 / 0.2;

  std::deque<Frame> frames_;
  std::size_t pending_ = 0;
  std::uint64_t delivered_ = 0;
  Duration delivered_at_;
  double rate_ = kStartRate;
};

}  // namespace hm
