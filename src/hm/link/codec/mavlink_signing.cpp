#include "hm/link/codec/mavlink_signing.hpp"

#include "hm/link/codec/sha256.hpp"

namespace hm {
namespace {

constexpr std::size_t kStampAt = 1, kStampBytes = 6, kDigestAt = 7, kDigestBytes = 6;
constexpr std::size_t kSystemAt = 5, kComponentAt = 6;  // in the frame

Sha256::Digest signature_digest(const MavlinkKey& key, std::span<const std::uint8_t> frame,
                                std::span<const std::uint8_t> link_and_stamp) {
  Sha256 hash;
  hash.add(key);
  hash.add(frame);
  hash.add(link_and_stamp);
  return hash.finish();
}

}  // namespace

void MavlinkSigner::sign(std::span<const std::uint8_t> frame,
                         std::span<std::uint8_t, kMavlinkSignatureBytes> signature) {
  signature[0] = link_;
  for (std::size_t i = 0; i < kStampBytes; ++i)
    signature[kStampAt + i] = static_cast<std::uint8_t>(ticks_ >> (8 * i));
  ++ticks_;
  const auto digest = signature_digest(key_, frame, signature.first(kDigestAt));
  for (std::size_t i = 0; i < kDigestBytes; ++i) signature[kDigestAt + i] = digest[i];
}

MavlinkSignatureCheck MavlinkVerifier::check(
    std::span<const std::uint8_t> frame, std::span<const std::uint8_t, kMavlinkSignatureBytes> signature) {
  if (frame.size() <= kComponentAt) return MavlinkSignatureCheck::kWrong;
  const auto digest = signature_digest(key_, frame, signature.first(kDigestAt));
  std::uint8_t difference = 0;  // all bytes are compared, so that the time tells nothing of the digest
  for (std::size_t i = 0; i < kDigestBytes; ++i)
    difference = static_cast<std::uint8_t>(difference | (digest[i] ^ signature[kDigestAt + i]));
  if (difference != 0) return MavlinkSignatureCheck::kWrong;
  Stream stream{frame[kSystemAt], frame[kComponentAt], signature[0], 0};
  for (std::size_t i = 0; i < kStampBytes; ++i)
    stream.ticks |= static_cast<std::uint64_t>(signature[kStampAt + i]) << (8 * i);
  return remember(stream);
}

MavlinkSignatureCheck MavlinkVerifier::remember(const Stream& stream) {
  for (std::size_t i = 0; i < stream_count_; ++i) {
    Stream& known = streams_[i];
    if (known.system != stream.system || known.component != stream.component || known.link != stream.link)
      continue;
    if (stream.ticks <= known.ticks) return MavlinkSignatureCheck::kReplayed;
    known.ticks = stream.ticks;
    set_ticks(stream.ticks);
    return MavlinkSignatureCheck::kGood;
  }
  if (stream.ticks + kMaxAgeTicks < newest_) return MavlinkSignatureCheck::kReplayed;
  if (stream_count_ == streams_.size()) return MavlinkSignatureCheck::kTooManyStreams;
  streams_[stream_count_++] = stream;
  set_ticks(stream.ticks);
  return MavlinkSignatureCheck::kGood;
}

}  // namespace hm
