#pragma once
#include <array>
#include <cstdint>
#include <string_view>

/// MAVLink messages that ask or command, fields in the order of MAVLink's definitions (common.xml).
namespace hm {

/// Asks for one parameter, by name or (name empty) by index.
struct MavParamRequestRead {
  static constexpr std::uint32_t kId = 20;
  static constexpr std::string_view kName = "PARAM_REQUEST_READ";
  std::uint8_t target_system = 0, target_component = 0;
  std::array<char, 16> param_id{};  ///< ends with zero unless 16 letters long
  std::int16_t param_index = -1;    ///< -1: by name

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("target_system", self.target_system);
    v.field("target_component", self.target_component);
    v.field("param_id", self.param_id);
    v.field("param_index", self.param_index);
  }
};

/// Asks for all parameters.
struct MavParamRequestList {
  static constexpr std::uint32_t kId = 21;
  static constexpr std::string_view kName = "PARAM_REQUEST_LIST";
  std::uint8_t target_system = 0, target_component = 0;

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("target_system", self.target_system);
    v.field("target_component", self.target_component);
  }
};

/// One parameter; answers requests and PARAM_SET.
struct MavParamValue {
  static constexpr std::uint32_t kId = 22;
  static constexpr std::string_view kName = "PARAM_VALUE";
  std::array<char, 16> param_id{};
  float param_value = 0;  ///< the number, also of integer types (MavParamType)
  std::uint8_t param_type = 0;
  std::uint16_t param_count = 0;
  std::uint16_t param_index = 0;

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("param_id", self.param_id);
    v.field("param_value", self.param_value);
    v.field("param_type", self.param_type);
    v.field("param_count", self.param_count);
    v.field("param_index", self.param_index);
  }
};

/// Sets one parameter.
struct MavParamSet {
  static constexpr std::uint32_t kId = 23;
  static constexpr std::string_view kName = "PARAM_SET";
  std::uint8_t target_system = 0, target_component = 0;
  std::array<char, 16> param_id{};
  float param_value = 0;
  std::uint8_t param_type = 0;

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("target_system", self.target_system);
    v.field("target_component", self.target_component);
    v.field("param_id", self.param_id);
    v.field("param_value", self.param_value);
    v.field("param_type", self.param_type);
  }
};

/// Asks for the number of way points of a mission.
struct MavMissionRequestList {
  static constexpr std::uint32_t kId = 43;
  static constexpr std::string_view kName = "MISSION_REQUEST_LIST";
  std::uint8_t target_system = 0, target_component = 0;
  std::uint8_t mission_type = 0;

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("target_system", self.target_system);
    v.field("target_component", self.target_component);
    v.extension("mission_type", self.mission_type);
  }
};

/// Number of way points of a mission.
struct MavMissionCount {
  static constexpr std::uint32_t kId = 44;
  static constexpr std::string_view kName = "MISSION_COUNT";
  std::uint8_t target_system = 0, target_component = 0;
  std::uint16_t count = 0;
  std::uint8_t mission_type = 0;
  std::uint32_t opaque_id = 0;

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("target_system", self.target_system);
    v.field("target_component", self.target_component);
    v.field("count", self.count);
    v.extension("mission_type", self.mission_type);
    v.extension("opaque_id", self.opaque_id);
  }
};

/// Place of the local origin; ArduPilot's estimator does not start without one.
struct MavSetGpsGlobalOrigin {
  static constexpr std::uint32_t kId = 48;
  static constexpr std::string_view kName = "SET_GPS_GLOBAL_ORIGIN";
  std::uint8_t target_system = 0;
  std::int32_t latitude = 0, longitude = 0;  ///< 1e-7 degrees
  std::int32_t altitude = 0;                 ///< mm above sea level
  std::uint64_t time_usec = 0;

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("target_system", self.target_system);
    v.field("latitude", self.latitude);
    v.field("longitude", self.longitude);
    v.field("altitude", self.altitude);
    v.extension("time_usec", self.time_usec);
  }
};

/// A gamepad of the ground station: -1000..1000, thrust `z` 0..1000; 32767: no such axis.
struct MavManualControl {
  static constexpr std::uint32_t kId = 69;
  static constexpr std::string_view kName = "MANUAL_CONTROL";
  std::uint8_t target = 0;
  std::int16_t x = 0, y = 0, z = 0, r = 0;  ///< pitch (forward), roll (right), thrust, yaw
  std::uint16_t buttons = 0;                ///< bits
  std::uint16_t buttons2 = 0;
  std::uint8_t enabled_extensions = 0;
  std::int16_t s = 0, t = 0, aux1 = 0, aux2 = 0, aux3 = 0, aux4 = 0, aux5 = 0, aux6 = 0;

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("target", self.target);
    v.field("x", self.x);
    v.field("y", self.y);
    v.field("z", self.z);
    v.field("r", self.r);
    v.field("buttons", self.buttons);
    v.extension("buttons2", self.buttons2);
    v.extension("enabled_extensions", self.enabled_extensions);
    v.extension("s", self.s);
    v.extension("t", self.t);
    v.extension("aux1", self.aux1);
    v.extension("aux2", self.aux2);
    v.extension("aux3", self.aux3);
    v.extension("aux4", self.aux4);
    v.extension("aux5", self.aux5);
    v.extension("aux6", self.aux6);
  }
};

/// A command with the frame of its position; answered by COMMAND_ACK.
struct MavCommandInt {
  static constexpr std::uint32_t kId = 75;
  static constexpr std::string_view kName = "COMMAND_INT";
  std::uint8_t target_system = 0, target_component = 0;
  std::uint8_t frame = 0;     ///< MavFrame, of x, y, z
  std::uint16_t command = 0;  ///< MavCommand
  std::uint8_t current = 0, autocontinue = 0;
  float param1 = 0, param2 = 0, param3 = 0, param4 = 0;
  std::int32_t x = 0, y = 0;  ///< 0.1 mm of a local frame, 1e-7 degrees of a global one
  float z = 0;                ///< m

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("target_system", self.target_system);
    v.field("target_component", self.target_component);
    v.field("frame", self.frame);
    v.field("command", self.command);
    v.field("current", self.current);
    v.field("autocontinue", self.autocontinue);
    v.field("param1", self.param1);
    v.field("param2", self.param2);
    v.field("param3", self.param3);
    v.field("param4", self.param4);
    v.field("x", self.x);
    v.field("y", self.y);
    v.field("z", self.z);
  }
};

/// A command with seven parameters; answered by COMMAND_ACK.
struct MavCommandLong {
  static constexpr std::uint32_t kId = 76;
  static constexpr std::string_view kName = "COMMAND_LONG";
  std::uint8_t target_system = 0, target_component = 0;
  std::uint16_t command = 0;      ///< MavCommand
  std::uint8_t confirmation = 0;  ///< counts the repetitions
  float param1 = 0, param2 = 0, param3 = 0, param4 = 0, param5 = 0, param6 = 0, param7 = 0;

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("target_system", self.target_system);
    v.field("target_component", self.target_component);
    v.field("command", self.command);
    v.field("confirmation", self.confirmation);
    v.field("param1", self.param1);
    v.field("param2", self.param2);
    v.field("param3", self.param3);
    v.field("param4", self.param4);
    v.field("param5", self.param5);
    v.field("param6", self.param6);
    v.field("param7", self.param7);
  }
};

/// Answer to a command.
struct MavCommandAck {
  static constexpr std::uint32_t kId = 77;
  static constexpr std::string_view kName = "COMMAND_ACK";
  std::uint16_t command = 0;
  std::uint8_t result = 0;    ///< MavResult
  std::uint8_t progress = 0;  ///< %, of a command in progress; 255: unknown
  std::int32_t result_param2 = 0;
  std::uint8_t target_system = 0, target_component = 0;

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("command", self.command);
    v.field("result", self.result);
    v.extension("progress", self.progress);
    v.extension("result_param2", self.result_param2);
    v.extension("target_system", self.target_system);
    v.extension("target_component", self.target_component);
  }
};

/// Attitude (FRD in NED, w x y z), rates (rad/s) and thrust (0..1) to keep.
struct MavSetAttitudeTarget {
  static constexpr std::uint32_t kId = 82;
  static constexpr std::string_view kName = "SET_ATTITUDE_TARGET";
  std::uint32_t time_boot_ms = 0;
  std::uint8_t target_system = 0, target_component = 0;
  std::uint8_t type_mask = 0;  ///< 1 2 4: rates roll pitch yaw, 64: thrust, 128: attitude are ignored
  std::array<float, 4> q{};
  float body_roll_rate = 0, body_pitch_rate = 0, body_yaw_rate = 0;
  float thrust = 0;
  std::array<float, 3> thrust_body{};

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("time_boot_ms", self.time_boot_ms);
    v.field("target_system", self.target_system);
    v.field("target_component", self.target_component);
    v.field("type_mask", self.type_mask);
    v.field("q", self.q);
    v.field("body_roll_rate", self.body_roll_rate);
    v.field("body_pitch_rate", self.body_pitch_rate);
    v.field("body_yaw_rate", self.body_yaw_rate);
    v.field("thrust", self.thrust);
    v.extension("thrust_body", self.thrust_body);
  }
};

/// Position (m), velocity (m/s), acceleration (m/s^2), yaw (rad), yaw rate (rad/s) to keep.
struct MavSetPositionTargetLocalNed {
  static constexpr std::uint32_t kId = 84;
  static constexpr std::string_view kName = "SET_POSITION_TARGET_LOCAL_NED";
  std::uint32_t time_boot_ms = 0;
  std::uint8_t target_system = 0, target_component = 0;
  std::uint8_t coordinate_frame = 0;  ///< MavFrame
  std::uint16_t type_mask = 0;        ///< bits of MavTargetMask: ignored values
  float x = 0, y = 0, z = 0;
  float vx = 0, vy = 0, vz = 0;
  float afx = 0, afy = 0, afz = 0;
  float yaw = 0, yaw_rate = 0;

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("time_boot_ms", self.time_boot_ms);
    v.field("target_system", self.target_system);
    v.field("target_component", self.target_component);
    v.field("coordinate_frame", self.coordinate_frame);
    v.field("type_mask", self.type_mask);
    v.field("x", self.x);
    v.field("y", self.y);
    v.field("z", self.z);
    v.field("vx", self.vx);
    v.field("vy", self.vy);
    v.field("vz", self.vz);
    v.field("afx", self.afx);
    v.field("afy", self.afy);
    v.field("afz", self.afz);
    v.field("yaw", self.yaw);
    v.field("yaw_rate", self.yaw_rate);
  }
};

/// Exchange of clocks: `tc1` 0 asks (with the asker's time in `ts1`), otherwise answers.
struct MavTimesync {
  static constexpr std::uint32_t kId = 111;
  static constexpr std::string_view kName = "TIMESYNC";
  std::int64_t tc1 = 0;  ///< the answerer's clock, ns
  std::int64_t ts1 = 0;  ///< the asker's clock, ns, given back
  std::uint8_t target_system = 0, target_component = 0;

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("tc1", self.tc1);
    v.field("ts1", self.ts1);
    v.extension("target_system", self.target_system);
    v.extension("target_component", self.target_component);
  }
};

/// Motor commands of an autopilot to a simulation that flies them (hardware or software in the loop).
struct MavHilActuatorControls {
  static constexpr std::uint32_t kId = 93;
  static constexpr std::string_view kName = "HIL_ACTUATOR_CONTROLS";
  std::uint64_t time_usec = 0;
  std::array<float, 16> controls{};  ///< 0 to 1 for motors
  std::uint8_t mode = 0;             ///< bits of MavModeFlag
  std::uint64_t flags = 0;           ///< 1: in lock-step

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("time_usec", self.time_usec);
    v.field("controls", self.controls);
    v.field("mode", self.mode);
    v.field("flags", self.flags);
  }
};

}  // namespace hm
