#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "hm/core/time.hpp"
#include "hm/flight/flight_state.hpp"

namespace hm {

/// One step of the core, or one input of another kind, as recorded in core.trace and replayed on host and
/// firmware. 128 bytes, little-endian, at fixed offsets:
///
///     0 u32 magic "HMT1"     4 u32 sequence        8 i64 stamp, ns
///     16 u8 kind             17 u8 state           18 u8 phase         19 u8 flags
///     20 f32[13] input       72 f32[4] output      88 f32[9] state     124 u32 CRC-32 (IEEE) of bytes 0..123
///
/// A file is a sequence of records; one that was cut (power, kill) is readable up to its last whole record.
struct CoreTraceRecord {
  /// What `input` holds.
  enum class Kind : std::uint8_t {
    kStep,     ///< an IMU sample and what the step gave: input 0..2 rates rad/s, 3..5 specific force m/s^2, 6
               ///< battery, 7 clearance, 8 obstacle; flags
    kPose,     ///< 0..2 x, y, yaw; 3..8 covariance xx, xy, xyaw, yy, yyaw, yawyaw
    kHeight,   ///< 0 height, 1 standard deviation, m
    kCommand,  ///< a FlightCommand: flags are kind, `state` pilot, `phase` mode
  };
  static constexpr std::size_t kBytes = 128;

  std::uint32_t sequence = 0;
  Time stamp;
  Kind kind = Kind::kStep;
  std::uint8_t state = 0, phase = 0, flags = 0;
  std::array<float, 13> input{};
  std::array<float, 4> output{};    ///< rotor speeds, rad/s
  std::array<float, 9> estimate{};  ///< position, velocity, angles
};

/// Writes a record.
[[nodiscard]] std::array<std::uint8_t, CoreTraceRecord::kBytes> encode(const CoreTraceRecord& record);

/// Reads one; nothing if magic, kind or checksum are wrong. Numbers come back bit by bit, NaN too.
[[nodiscard]] std::optional<CoreTraceRecord> decode_core_trace(
    std::span<const std::uint8_t, CoreTraceRecord::kBytes> bytes);

/// Walks through the bytes of a trace up to the first record that is damaged or incomplete.
class CoreTraceReader {
 public:
  explicit CoreTraceReader(std::span<const std::uint8_t> bytes) : rest_(bytes) {}
  std::optional<CoreTraceRecord> next();
  [[nodiscard]] std::size_t bytes_left() const { return rest_.size(); }

 private:
  std::span<const std::uint8_t> rest_;
};

/// CRC-32 (IEEE 802.3, reflected, as of zlib): of "123456789" 0xCBF43926.
[[nodiscard]] std::uint32_t crc32(std::span<const std::uint8_t> bytes);

}  // namespace hm
