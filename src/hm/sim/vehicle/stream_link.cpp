#include "hm/sim/vehicle/stream_link.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hm {
namespace {

constexpr std::uint64_t kJitterStream = 0x6a6974, kBitErrorStream = 0x626974;
constexpr double kBitsPerByte = 8;

}  // namespace

LinkChannel::LinkChannel(const StreamLinkParams& params, std::uint64_t seed)
    : params_(params), rng_(seed, kJitterStream), error_rng_(seed, kBitErrorStream) {}

void LinkChannel::set_faults(bool is_cut, bool is_noisy) {
  is_cut_ = is_cut;
  is_noisy_ = is_noisy;
}

std::optional<Time> LinkChannel::send(Time now, std::size_t bytes) {
  ++counts_.sent;
  const double jitter_s = params_.jitter_s * rng_.uniform();  // drawn for lost messages, too
  if (is_cut_) {
    ++counts_.cut;
    return std::nullopt;
  }
  double sent_s = now.seconds();
  if (params_.bytes_per_s > 0) {
    const double begin_s = std::max(sent_s, busy_until_s_);
    if (begin_s - sent_s > params_.max_queue_s) {
      ++counts_.overflown;
      return std::nullopt;
    }
    sent_s = busy_until_s_ = begin_s + static_cast<double>(bytes) / params_.bytes_per_s;
  }
  last_arrival_ = std::max(last_arrival_, Time::from_seconds(sent_s + params_.latency_s + jitter_s));
  return last_arrival_;
}

double LinkChannel::bit_error_ratio() const {
  return is_noisy_ ? std::max(kFaultBitErrorRatio, params_.bit_error_ratio) : params_.bit_error_ratio;
}

double LinkChannel::sound_bits() {
  const double ratio = bit_error_ratio();
  if (ratio <= 0) return std::numeric_limits<double>::infinity();
  return std::floor(std::log(1 - error_rng_.uniform()) / std::log1p(-ratio));
}

std::size_t LinkChannel::damage(std::span<std::uint8_t> bytes) {
  const double bits = kBitsPerByte * static_cast<double>(bytes.size());
  std::size_t inverted = 0;
  for (double at = sound_bits(); at < bits; at += 1 + sound_bits(), ++inverted) {
    const auto bit = static_cast<std::size_t>(at);
    bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] ^ (1U << (bit % 8)));
  }
  if (inverted > 0) ++counts_.damaged;
  return inverted;
}

bool LinkChannel::is_damaged(std::size_t bytes) {
  const bool damaged = sound_bits() < kBitsPerByte * static_cast<double>(bytes);
  if (damaged) ++counts_.damaged;
  return damaged;
}

}  // namespace hm
