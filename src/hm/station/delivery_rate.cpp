#include "hm/station/delivery_rate.hpp"

#include <algorithm>
#include <cmath>

namespace hm {
namespace {

double since(Duration then, Duration now) { return static_cast<double>(now.ns - then.ns) * 1e-9; }

}  // namespace

void DeliveryRate::sent(std::uint32_t sequence, std::size_t bytes, bool little_to_send, Duration now) {
  if (frames_.empty()) delivered_at_ = now;
  frames_.push_back({sequence, bytes, little_to_send, delivered_, delivered_at_});
  pending_ += bytes;
}

void DeliveryRate::acknowledge(std::uint32_t sequence, Duration now) {
  if (frames_.empty() || frames_.front().sequence > sequence) return;  // known before
  Frame last;
  while (!frames_.empty() && frames_.front().sequence <= sequence) {
    last = frames_.front();
    frames_.pop_front();
    pending_ -= last.bytes;
    delivered_ += last.bytes;
  }
  const double sample =
      static_cast<double>(delivered_ - last.delivered) / std::max(since(last.delivered_at, now), 1e-3);
  // A faster time than now is forgotten with a constant of 1 s.
  if (sample >= rate_)
    rate_ = sample;
  else if (!last.little_to_send)
    rate_ = sample + (rate_ - sample) * std::exp(-since(delivered_at_, now));
  delivered_at_ = now;
}

}  // namespace hm
