#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "hm/core/time.hpp"
#include "hm/flight/flight_state.hpp"

namespace hm {

/// One step of the core, or one input of another kind, as recorded in core.trace, replayed on host and
/// firmware, and sent over the link to an emulated board. 128 bytes, little-endian, at fixed offsets:
///
///     0 u32 magic "HMT1"     4 u32 sequence        8 i64 stamp, ns
///     16 u8 kind             17 u8 state           18 u8 phase         19 u8 flags
///     20 f32[13] input       72 f32[4] output      88 f32[9] state     124 u32 CRC-32 (IEEE) of bytes 0..123
///
/// A file is a sequence of records; one that was cut (power, kill) is readable up to its last whole record.
struct CoreTraceRecord {
  /// Meaning of `input`. Records of other inputs precede the step that takes them (core_recorder.hpp).
  enum class Kind : std::uint8_t {
    kStep,         ///< stamp: now; 0..2 rates rad/s, 3..5 specific force m/s^2, 6 battery, 7 clearance, 8
                   ///< obstacle, 9..10 stamp of the IMU sample (words); and what the step gave: 11 motor
                   ///< demand, refusal, safety action, its reason (bytes), 12 active fail-safes (word)
    kPose,         ///< 0..2 x, y, yaw; 3..11 covariance, row by row, if bit 0 of the flags is set
    kHeight,       ///< 0 height, m; 1 standard deviation, if bit 0 of the flags is set
    kCommand,      ///< a FlightCommand: `state` pilot, `phase` mode, flags are kind and in bit 7 the dead-man
                   ///< switch; 0..8 position, velocity, acceleration, 9 yaw, 10 roll, 11 pitch, 12 yaw rate;
                   ///< output 0 thrust
    kOrientation,  ///< stamp: of the step; 0..8 R_world_imu of its IMU sample, row by row
    kOutputs,  ///< what a step gave, from a board: as kStep, and 0..3 roll, pitch, yaw rate, thrust, 4 tilt
               ///< mismatch, if bit 0 of the flags is set, 5 invalid inputs (word); bits 1 and 2 of
               ///< the flags: position, height are known
  };
  static constexpr std::size_t kKinds = 6, kBytes = 128;

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

/// A record as it goes over a serial port, where bytes are dear: 'H', u8 length, so many bytes of the record
/// from its sequence on, u32 CRC of the record. Zeros at its end are left out.
struct CoreTraceFrame {
  static constexpr std::size_t kOverhead = 6, kMaxLength = CoreTraceRecord::kBytes - 8;
  std::array<std::uint8_t, kMaxLength + kOverhead> bytes{};
  std::size_t size = 0;
};
[[nodiscard]] CoreTraceFrame frame_of(const CoreTraceRecord& record);

/// Finds frames in a stream of bytes. After a damaged one it goes on at the next byte that may begin a frame,
/// so no frame that arrived whole is lost. Call `next` after each byte until it gives nothing.
class CoreTraceParser {
 public:
  void push(std::uint8_t byte) { bytes_[size_++] = byte; }
  std::optional<CoreTraceRecord> next();
  /// Bytes so far that belonged to no frame.
  [[nodiscard]] std::uint32_t skipped() const { return skipped_; }

 private:
  void drop(std::size_t count);
  std::array<std::uint8_t, CoreTraceRecord::kBytes> bytes_{};
  std::size_t size_ = 0;
  std::uint32_t skipped_ = 0;
};

/// CRC-32 (IEEE 802.3, reflected, as of zlib): of "123456789" 0xCBF43926.
[[nodiscard]] std::uint32_t crc32(std::span<const std::uint8_t> bytes);

}  // namespace hm
