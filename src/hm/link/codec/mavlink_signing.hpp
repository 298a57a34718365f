#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace hm {

/// MAVLink 2 message signing (mavlink.io, "Message Signing"): link number, stamp (10 us since 2015, 48 bits)
/// and the first 48 bits of SHA-256 over key, frame, link number and stamp stand behind the frame. It proves
/// who sent a frame and that it is not a repetition; nothing is secret.
using MavlinkKey = std::array<std::uint8_t, 32>;
inline constexpr std::size_t kMavlinkSignatureBytes = 13;
/// Ticks of a stamp in a second, and seconds from 1970 to 2015.
inline constexpr std::uint64_t kMavlinkTicksPerSecond = 100'000;
inline constexpr std::uint64_t kMavlinkEpochUnixSeconds = 1'420'070'400;

/// Signs what one link sends.
class MavlinkSigner {
 public:
  MavlinkSigner(const MavlinkKey& key, std::uint8_t link) : key_(key), link_(link) {}
  /// Raises the stamp of the next frame to this time; a clock that goes back changes nothing.
  void set_ticks(std::uint64_t ticks) {
    if (ticks > ticks_) ticks_ = ticks;
  }
  /// Last stamp given; kept over a restart, it prevents that what was sent before is accepted again.
  [[nodiscard]] std::uint64_t ticks() const { return ticks_; }
  /// Writes the signature of `frame` (from the start byte to the checksum); every stamp is used once.
  void sign(std::span<const std::uint8_t> frame, std::span<std::uint8_t, kMavlinkSignatureBytes> signature);

 private:
  MavlinkKey key_;
  std::uint8_t link_;
  std::uint64_t ticks_ = 0;
};

enum class MavlinkSignatureCheck : std::uint8_t { kGood, kWrong, kReplayed, kTooManyStreams };

/// Checks what is received: the signature, and that the stamps of each sender and link increase. The first
/// stamp of a new sender may be at most a minute older than the newest stamp of all.
class MavlinkVerifier {
 public:
  static constexpr std::size_t kMaxStreams = 16;
  static constexpr std::uint64_t kMaxAgeTicks = 60 * kMavlinkTicksPerSecond;
  explicit MavlinkVerifier(const MavlinkKey& key) : key_(key) {}
  /// Raises the newest stamp to our own clock.
  void set_ticks(std::uint64_t ticks) {
    if (ticks > newest_) newest_ = ticks;
  }
  /// Also remembers the stamp of what is good. `frame` ends before the signature.
  MavlinkSignatureCheck check(std::span<const std::uint8_t> frame,
                              std::span<const std::uint8_t, kMavlinkSignatureBytes> signature);

 private:
  struct Stream {
    std::uint8_t system = 0, component = 0, link = 0;
    std::uint64_t ticks = 0;
  };
  MavlinkSignatureCheck remember(const Stream& stream);

  MavlinkKey key_;
  std::array<Stream, kMaxStreams> streams_{};
  std::size_t stream_count_ = 0;
  std::uint64_t newest_ = 0;
};

}  // namespace hm
