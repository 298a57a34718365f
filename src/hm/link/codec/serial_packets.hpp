#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "hm/core/bytes/little_endian.hpp"
#include "hm/link/codec/wire_fields.hpp"

/// Packets of the dissertation's serial protocol between the computer on board ("up": from it) and the
/// microcontroller of the vehicle ("down": to the computer): packed, little-endian, SI units, thrust in
/// percent. Frames are those of the dissertation: x forward, y left, z up. Numbers, sizes and order of the
/// fields are those of the author's firmware, so that a vehicle with it understands us.
namespace hm {

enum class SerialDirection : std::uint8_t { kUp, kDown, kBoth };

/// Answer to an up packet whose flag asks for it: gives the flag back.
struct SerialAck {
  static constexpr std::uint8_t kType = 0x00;
  static constexpr SerialDirection kDirection = SerialDirection::kDown;
  std::uint8_t flag = 0;
  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("flag", self.flag);
  }
};

/// Control mode of each axis (0 disabled, 1 direct, 2 position, 3 velocity), limits of what is commanded and
/// of its change in a millisecond. Order: roll, pitch, yaw rate, thrust; rad, rad/s, %.
struct SerialControlConfig {
  static constexpr std::uint8_t kType = 0x01;
  static constexpr SerialDirection kDirection = SerialDirection::kUp;
  std::array<std::uint8_t, 4> mode{};
  std::array<float, 4> limit{}, delta_limit{};
  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("mode", self.mode);
    v.field("limit", self.limit);
    v.field("delta_limit", self.delta_limit);
  }
};

/// Gains. x, y: kp ki kd kd2 d_base bias max_i max_err; vx, vy, vz and yaw: kp ki kd bias max_i max_err; z:
/// kp ki kd kd2 bias max_i max_err.
struct SerialPidConfig {
  static constexpr std::uint8_t kType = 0x02;
  static constexpr SerialDirection kDirection = SerialDirection::kUp;
  std::array<float, 8> x{}, y{};
  std::array<float, 6> vx{}, vy{}, vz{};
  std::array<float, 7> z{};
  std::array<float, 6> yaw{};
  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("x", self.x);
    v.field("y", self.y);
    v.field("vx", self.vx);
    v.field("vy", self.vy);
    v.field("vz", self.vz);
    v.field("z", self.z);
    v.field("yaw", self.yaw);
  }
};

/// The four Kalman filters. Bits of `mask`: x 0, y 1, z 2, roll 3, pitch 4, yaw 5, reset 7. Q of x y z roll
/// pitch yaw; R of x vx y vy z vz vz(barometer) roll pitch yaw.
struct SerialFilterConfig {
  static constexpr std::uint8_t kType = 0x03;
  static constexpr SerialDirection kDirection = SerialDirection::kUp;
  std::uint8_t mask = 0;
  std::array<float, 6> q{};
  std::array<float, 10> r{};
  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("mask", self.mask);
    v.field("q", self.q);
    v.field("r", self.r);
  }
};

/// Means nothing; with the flag set it asks whether somebody is there.
struct SerialDummy {
  static constexpr std::uint8_t kType = 0x04;
  static constexpr SerialDirection kDirection = SerialDirection::kUp;
  std::uint8_t dummy = 0;
  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("dummy", self.dummy);
  }
};

/// From the scan matcher, at 30 Hz.
struct SerialPose2d {
  static constexpr std::uint8_t kType = 0x05;
  static constexpr SerialDirection kDirection = SerialDirection::kUp;
  float x = 0, y = 0, vx = 0, vy = 0, yaw = 0;
  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("x", self.x);
    v.field("y", self.y);
    v.field("vx", self.vx);
    v.field("vy", self.vy);
    v.field("yaw", self.yaw);
  }
};

/// From the laser altimeter, at 30 to 40 Hz.
struct SerialHeight {
  static constexpr std::uint8_t kType = 0x06;
  static constexpr SerialDirection kDirection = SerialDirection::kUp;
  float z = 0, vz = 0;
  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("z", self.z);
    v.field("vz", self.vz);
  }
};

/// Fused state: position, velocity, roll pitch yaw.
struct SerialPose {
  static constexpr std::uint8_t kType = 0x07;
  static constexpr SerialDirection kDirection = SerialDirection::kDown;
  std::array<float, 3> position{}, velocity{}, rpy{};
  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("position", self.position);
    v.field("velocity", self.velocity);
    v.field("rpy", self.rpy);
  }
};

/// Actions of the state machine (Fig. 2.6): e-stop 0, advance 1, retreat 2, toggle engage 3, take-off 4,
/// land 5.
struct SerialFlightAction {
  static constexpr std::uint8_t kType = 0x08;
  static constexpr SerialDirection kDirection = SerialDirection::kUp;
  std::uint8_t action = 0;
  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("action", self.action);
  }
};

/// States (Fig. 2.6): off 0, engaging 1, disengaging 2, idle 3, landing 4, flying 5, error 255.
struct SerialFlightState {
  static constexpr std::uint8_t kType = 0x09;
  static constexpr SerialDirection kDirection = SerialDirection::kDown;
  std::uint8_t state = 0;
  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("state", self.state);
  }
};

struct SerialImu {
  static constexpr std::uint8_t kType = 0x0A;
  static constexpr SerialDirection kDirection = SerialDirection::kDown;
  std::array<float, 3> rpy{}, rates{}, acceleration{};
  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("rpy", self.rpy);
    v.field("rates", self.rates);
    v.field("acceleration", self.acceleration);
  }
};

/// The pilot's sticks, 0..4095: pitch, roll, thrust, yaw, serial enable, mode, two spare.
struct SerialRcData {
  static constexpr std::uint8_t kType = 0x0B;
  static constexpr SerialDirection kDirection = SerialDirection::kDown;
  std::int64_t stamp_us = 0;
  std::array<std::uint16_t, 8> channel{};
  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("stamp_us", self.stamp_us);
    v.field("channel", self.channel);
  }
};

/// Exchange of clocks, microseconds: the asker's and the answerer's; every two seconds.
struct SerialTimesync {
  static constexpr std::uint8_t kType = 0x0C;
  static constexpr SerialDirection kDirection = SerialDirection::kBoth;
  std::int64_t tc1_us = 0, ts1_us = 0;
  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("tc1_us", self.tc1_us);
    v.field("ts1_us", self.ts1_us);
  }
};

struct SerialStatus {
  static constexpr std::uint8_t kType = 0x0D;
  static constexpr SerialDirection kDirection = SerialDirection::kDown;
  std::int64_t stamp_us = 0, clock_offset_us = 0;
  float battery_v = 0;  ///< volts on the wire: the sender divides its millivolts, the receiver does not
  float cpu_percent = 0;
  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("stamp_us", self.stamp_us);
    v.field("clock_offset_us", self.clock_offset_us);
    v.field("battery_v", self.battery_v);
    v.field("cpu_percent", self.cpu_percent);
  }
};

/// When the microcontroller sends, ms: IMU, RC, flight state, pose, status, debug. Period 0: never.
struct SerialTransmitConfig {
  static constexpr std::uint8_t kType = 0x0E;
  static constexpr SerialDirection kDirection = SerialDirection::kUp;
  std::array<std::uint16_t, 6> period_ms{10, 100, 50, 10, 50, 100}, phase_ms{0, 7, 13, 5, 31, 0};
  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("period_ms", self.period_ms);
    v.field("phase_ms", self.phase_ms);
  }
};

/// Commands of the direct mode, at 20 Hz: rad, rad/s, %.
struct SerialControlInput {
  static constexpr std::uint8_t kType = 0x0F;
  static constexpr SerialDirection kDirection = SerialDirection::kUp;
  float roll = 0, pitch = 0, yaw_rate = 0, thrust = 0;
  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("roll", self.roll);
    v.field("pitch", self.pitch);
    v.field("yaw_rate", self.yaw_rate);
    v.field("thrust", self.thrust);
  }
};

/// Set-point of the position mode, at 10 Hz.
struct SerialDesiredPose {
  static constexpr std::uint8_t kType = 0x10;
  static constexpr SerialDirection kDirection = SerialDirection::kUp;
  float x = 0, y = 0, z = 0, yaw = 0;
  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("x", self.x);
    v.field("y", self.y);
    v.field("z", self.z);
    v.field("yaw", self.yaw);
  }
};

/// Set-point of the velocity mode, in the horizontal body frame.
struct SerialDesiredVelocity {
  static constexpr std::uint8_t kType = 0x11;
  static constexpr SerialDirection kDirection = SerialDirection::kUp;
  float vx = 0, vy = 0, vz = 0, yaw_rate = 0;
  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("vx", self.vx);
    v.field("vy", self.vy);
    v.field("vz", self.vz);
    v.field("yaw_rate", self.yaw_rate);
  }
};

/// Inside of the controllers: commands in units of the inner loop and in SI, limits, errors (x y z mm, yaw),
/// velocity, velocity error and acceleration in the horizontal body frame, modes, acceleration in the world,
/// integrators (x y yaw z), position error in the body frame.
struct SerialControlDebug {
  static constexpr std::uint8_t kType = 0x12;
  static constexpr SerialDirection kDirection = SerialDirection::kDown;
  std::array<std::int16_t, 4> command_raw{};
  std::array<float, 4> command{};
  std::array<std::int16_t, 4> limit_raw{};
  std::array<std::int32_t, 3> error{};
  std::int16_t error_yaw = 0;
  std::array<float, 2> velocity{}, velocity_error{};
  std::array<float, 3> acceleration{};
  std::array<std::uint8_t, 4> mode{};
  std::array<float, 3> world_acceleration{};
  std::array<float, 4> integrator{};
  std::array<float, 2> position_error{};
  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("command_raw", self.command_raw);
    v.field("command", self.command);
    v.field("limit_raw", self.limit_raw);
    v.field("error", self.error);
    v.field("error_yaw", self.error_yaw);
    v.field("velocity", self.velocity);
    v.field("velocity_error", self.velocity_error);
    v.field("acceleration", self.acceleration);
    v.field("mode", self.mode);
    v.field("world_acceleration", self.world_acceleration);
    v.field("integrator", self.integrator);
    v.field("position_error", self.position_error);
  }
};

namespace detail {
struct SerialSize {
  std::size_t bytes = 0;
  template <class Field>
  constexpr void field(std::string_view, const Field&) {
    constexpr std::size_t kCount = WireType<Field>::kCount ? WireType<Field>::kCount : 1;
    bytes += sizeof(typename WireType<Field>::Element) * kCount;
  }
};
struct SerialStore {
  std::uint8_t* to;
  template <class Field>
  constexpr void field(std::string_view, const Field& value) {
    store_little_endian(to, value);
    to += sizeof(value);
  }
};
struct SerialLoad {
  const std::uint8_t* from;
  template <class Field>
  constexpr void field(std::string_view, Field& value) {
    load_little_endian(from, value);
    from += sizeof(value);
  }
};
template <class Packet>
constexpr std::uint8_t serial_packet_bytes() {
  SerialSize size;
  const Packet packet{};
  Packet::visit(packet, size);
  return static_cast<std::uint8_t>(size.bytes);
}
}  // namespace detail

/// Size of a packet's payload.
template <class Packet>
inline constexpr std::uint8_t kSerialBytes = detail::serial_packet_bytes<Packet>();

template <class... Packets>
struct SerialPacketList {
  static constexpr std::size_t kCount = sizeof...(Packets);
  template <class Visitor>
  static constexpr void for_each(Visitor&& visitor) {
    (visitor.template operator()<Packets>(), ...);
  }
};
/// Every packet, at the place of its number.
using SerialPackets =
    SerialPacketList<SerialAck, SerialControlConfig, SerialPidConfig, SerialFilterConfig, SerialDummy,
                     SerialPose2d, SerialHeight, SerialPose, SerialFlightAction, SerialFlightState, SerialImu,
                     SerialRcData, SerialTimesync, SerialStatus, SerialTransmitConfig, SerialControlInput,
                     SerialDesiredPose, SerialDesiredVelocity, SerialControlDebug>;

struct SerialTableEntry {
  std::uint8_t bytes = 0;
  SerialDirection direction = SerialDirection::kUp;
};

namespace detail {
constexpr std::array<SerialTableEntry, SerialPackets::kCount> make_serial_table() {
  std::array<SerialTableEntry, SerialPackets::kCount> table{};
  SerialPackets::for_each([&]<class Packet>() {
    table[Packet::kType] = {kSerialBytes<Packet>, Packet::kDirection};
  });
  return table;
}
}  // namespace detail
inline constexpr auto kSerialTable = detail::make_serial_table();

// The sizes of the author's firmware.
static_assert(kSerialBytes<SerialControlConfig> == 36 && kSerialBytes<SerialPidConfig> == 188);
static_assert(kSerialBytes<SerialFilterConfig> == 65 && kSerialBytes<SerialPose2d> == 20);
static_assert(kSerialBytes<SerialHeight> == 8 && kSerialBytes<SerialPose> == 36 &&
              kSerialBytes<SerialImu> == 36);
static_assert(kSerialBytes<SerialRcData> == 24 && kSerialBytes<SerialTimesync> == 16);
static_assert(kSerialBytes<SerialStatus> == 24 && kSerialBytes<SerialTransmitConfig> == 24);
static_assert(kSerialBytes<SerialControlInput> == 16 && kSerialBytes<SerialDesiredPose> == 16);
static_assert(kSerialBytes<SerialDesiredVelocity> == 16 && kSerialBytes<SerialControlDebug> == 114);
static_assert(kSerialBytes<SerialAck> == 1 && kSerialBytes<SerialDummy> == 1);
static_assert(kSerialBytes<SerialFlightAction> == 1 && kSerialBytes<SerialFlightState> == 1);

}  // namespace hm
