#pragma once
#include <array>
#include <cstdint>
#include <string_view>

/// MAVLink messages that tell a state, fields in the order of MAVLink's definitions (common.xml).
namespace hm {

/// Sent once a second by everyone: who is there, and in which mode.
struct MavHeartbeat {
  static constexpr std::uint32_t kId = 0;
  static constexpr std::string_view kName = "HEARTBEAT";
  std::uint8_t type = 0;           ///< MavType
  std::uint8_t autopilot = 0;      ///< MavAutopilot
  std::uint8_t base_mode = 0;      ///< bits of MavModeFlag
  std::uint32_t custom_mode = 0;   ///< the autopilot's own number
  std::uint8_t system_status = 0;  ///< MavState
  std::uint8_t mavlink_version = 3;

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("type", self.type);
    v.field("autopilot", self.autopilot);
    v.field("base_mode", self.base_mode);
    v.field("custom_mode", self.custom_mode);
    v.field("system_status", self.system_status);
    v.field("mavlink_version", self.mavlink_version);
  }
};

/// Sensors, load and battery of a vehicle.
struct MavSysStatus {
  static constexpr std::uint32_t kId = 1;
  static constexpr std::string_view kName = "SYS_STATUS";
  std::uint32_t onboard_control_sensors_present = 0;  ///< bits of MavSensor
  std::uint32_t onboard_control_sensors_enabled = 0;
  std::uint32_t onboard_control_sensors_health = 0;
  std::uint16_t load = 0;              ///< of the processor, 0.1 %
  std::uint16_t voltage_battery = 0;   ///< mV; 65535: unknown
  std::int16_t current_battery = -1;   ///< 10 mA; -1: unknown
  std::int8_t battery_remaining = -1;  ///< %; -1: unknown
  std::uint16_t drop_rate_comm = 0;    ///< 0.01 %
  std::uint16_t errors_comm = 0;
  std::uint16_t errors_count1 = 0, errors_count2 = 0, errors_count3 = 0, errors_count4 = 0;
  std::uint32_t onboard_control_sensors_present_extended = 0;
  std::uint32_t onboard_control_sensors_enabled_extended = 0;
  std::uint32_t onboard_control_sensors_health_extended = 0;

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("onboard_control_sensors_present", self.onboard_control_sensors_present);
    v.field("onboard_control_sensors_enabled", self.onboard_control_sensors_enabled);
    v.field("onboard_control_sensors_health", self.onboard_control_sensors_health);
    v.field("load", self.load);
    v.field("voltage_battery", self.voltage_battery);
    v.field("current_battery", self.current_battery);
    v.field("battery_remaining", self.battery_remaining);
    v.field("drop_rate_comm", self.drop_rate_comm);
    v.field("errors_comm", self.errors_comm);
    v.field("errors_count1", self.errors_count1);
    v.field("errors_count2", self.errors_count2);
    v.field("errors_count3", self.errors_count3);
    v.field("errors_count4", self.errors_count4);
    v.extension("onboard_control_sensors_present_extended", self.onboard_control_sensors_present_extended);
    v.extension("onboard_control_sensors_enabled_extended", self.onboard_control_sensors_enabled_extended);
    v.extension("onboard_control_sensors_health_extended", self.onboard_control_sensors_health_extended);
  }
};

/// Roll, pitch, yaw of FRD in NED (rad) and body rates (rad/s).
struct MavAttitude {
  static constexpr std::uint32_t kId = 30;
  static constexpr std::string_view kName = "ATTITUDE";
  std::uint32_t time_boot_ms = 0;
  float roll = 0, pitch = 0, yaw = 0;
  float rollspeed = 0, pitchspeed = 0, yawspeed = 0;

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("time_boot_ms", self.time_boot_ms);
    v.field("roll", self.roll);
    v.field("pitch", self.pitch);
    v.field("yaw", self.yaw);
    v.field("rollspeed", self.rollspeed);
    v.field("pitchspeed", self.pitchspeed);
    v.field("yawspeed", self.yawspeed);
  }
};

/// As ATTITUDE, as a quaternion w x y z.
struct MavAttitudeQuaternion {
  static constexpr std::uint32_t kId = 31;
  static constexpr std::string_view kName = "ATTITUDE_QUATERNION";
  std::uint32_t time_boot_ms = 0;
  float q1 = 1, q2 = 0, q3 = 0, q4 = 0;
  float rollspeed = 0, pitchspeed = 0, yawspeed = 0;
  std::array<float, 4> repr_offset_q{};

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("time_boot_ms", self.time_boot_ms);
    v.field("q1", self.q1);
    v.field("q2", self.q2);
    v.field("q3", self.q3);
    v.field("q4", self.q4);
    v.field("rollspeed", self.rollspeed);
    v.field("pitchspeed", self.pitchspeed);
    v.field("yawspeed", self.yawspeed);
    v.extension("repr_offset_q", self.repr_offset_q);
  }
};

/// Position (m) and velocity (m/s) in NED from the place of start.
struct MavLocalPositionNed {
  static constexpr std::uint32_t kId = 32;
  static constexpr std::string_view kName = "LOCAL_POSITION_NED";
  std::uint32_t time_boot_ms = 0;
  float x = 0, y = 0, z = 0;
  float vx = 0, vy = 0, vz = 0;

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("time_boot_ms", self.time_boot_ms);
    v.field("x", self.x);
    v.field("y", self.y);
    v.field("z", self.z);
    v.field("vx", self.vx);
    v.field("vy", self.vy);
    v.field("vz", self.vz);
  }
};

/// Pose that a camera or laser measured: NED (m), roll pitch yaw (rad).
struct MavVisionPositionEstimate {
  static constexpr std::uint32_t kId = 102;
  static constexpr std::string_view kName = "VISION_POSITION_ESTIMATE";
  std::uint64_t usec = 0;  ///< stamp on the receiver's clock, or on the sender's with TIMESYNC
  float x = 0, y = 0, z = 0;
  float roll = 0, pitch = 0, yaw = 0;
  std::array<float, 21> covariance{};  ///< upper triangle, rows x y z roll pitch yaw; NaN first: unknown
  std::uint8_t reset_counter = 0;      ///< counts up at every jump

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("usec", self.usec);
    v.field("x", self.x);
    v.field("y", self.y);
    v.field("z", self.z);
    v.field("roll", self.roll);
    v.field("pitch", self.pitch);
    v.field("yaw", self.yaw);
    v.extension("covariance", self.covariance);
    v.extension("reset_counter", self.reset_counter);
  }
};

/// One battery. Unknown values: 65535 mV, -1 otherwise, temperature 32767.
struct MavBatteryStatus {
  static constexpr std::uint32_t kId = 147;
  static constexpr std::string_view kName = "BATTERY_STATUS";
  std::uint8_t id = 0;
  std::uint8_t battery_function = 0;
  std::uint8_t type = 0;                     ///< 1: lithium polymer
  std::int16_t temperature = 32767;          ///< 0.01 deg C
  std::array<std::uint16_t, 10> voltages{};  ///< of the cells, mV; 65535: no such cell
  std::int16_t current_battery = -1;         ///< 10 mA
  std::int32_t current_consumed = -1;        ///< mAh
  std::int32_t energy_consumed = -1;         ///< 100 J
  std::int8_t battery_remaining = -1;        ///< %
  std::int32_t time_remaining = 0;           ///< s; 0: unknown
  std::uint8_t charge_state = 0;
  std::array<std::uint16_t, 4> voltages_ext{};
  std::uint8_t mode = 0;
  std::uint32_t fault_bitmask = 0;

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("id", self.id);
    v.field("battery_function", self.battery_function);
    v.field("type", self.type);
    v.field("temperature", self.temperature);
    v.field("voltages", self.voltages);
    v.field("current_battery", self.current_battery);
    v.field("current_consumed", self.current_consumed);
    v.field("energy_consumed", self.energy_consumed);
    v.field("battery_remaining", self.battery_remaining);
    v.extension("time_remaining", self.time_remaining);
    v.extension("charge_state", self.charge_state);
    v.extension("voltages_ext", self.voltages_ext);
    v.extension("mode", self.mode);
    v.extension("fault_bitmask", self.fault_bitmask);
  }
};

/// Capabilities of a vehicle; the first message that a ground station requests.
struct MavAutopilotVersion {
  static constexpr std::uint32_t kId = 148;
  static constexpr std::string_view kName = "AUTOPILOT_VERSION";
  std::uint64_t capabilities = 0;  ///< bits of MavCapability
  std::uint32_t flight_sw_version = 0;
  std::uint32_t middleware_sw_version = 0;
  std::uint32_t os_sw_version = 0;
  std::uint32_t board_version = 0;
  std::array<std::uint8_t, 8> flight_custom_version{};
  std::array<std::uint8_t, 8> middleware_custom_version{};
  std::array<std::uint8_t, 8> os_custom_version{};
  std::uint16_t vendor_id = 0, product_id = 0;
  std::uint64_t uid = 0;
  std::array<std::uint8_t, 18> uid2{};

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("capabilities", self.capabilities);
    v.field("flight_sw_version", self.flight_sw_version);
    v.field("middleware_sw_version", self.middleware_sw_version);
    v.field("os_sw_version", self.os_sw_version);
    v.field("board_version", self.board_version);
    v.field("flight_custom_version", self.flight_custom_version);
    v.field("middleware_custom_version", self.middleware_custom_version);
    v.field("os_custom_version", self.os_custom_version);
    v.field("vendor_id", self.vendor_id);
    v.field("product_id", self.product_id);
    v.field("uid", self.uid);
    v.extension("uid2", self.uid2);
  }
};

/// Whether the vehicle flies.
struct MavExtendedSysState {
  static constexpr std::uint32_t kId = 245;
  static constexpr std::string_view kName = "EXTENDED_SYS_STATE";
  std::uint8_t vtol_state = 0;
  std::uint8_t landed_state = 0;  ///< MavLandedState

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("vtol_state", self.vtol_state);
    v.field("landed_state", self.landed_state);
  }
};

/// Sensors of a simulated vehicle for its autopilot; the frame is BODY_FRD.
struct MavHilSensor {
  static constexpr std::uint32_t kId = 107;
  static constexpr std::string_view kName = "HIL_SENSOR";
  std::uint64_t time_usec = 0;
  float xacc = 0, yacc = 0, zacc = 0;                                            ///< specific force, m/s^2
  float xgyro = 0, ygyro = 0, zgyro = 0;                                         ///< rad/s
  float xmag = 0, ymag = 0, zmag = 0;                                            ///< gauss
  float abs_pressure = 0, diff_pressure = 0, pressure_alt = 0, temperature = 0;  ///< hPa, hPa, m, deg C
  std::uint32_t fields_updated = 0;  ///< bits of the fields above, that of xacc first
  std::uint8_t id = 0;

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("time_usec", self.time_usec);
    v.field("xacc", self.xacc);
    v.field("yacc", self.yacc);
    v.field("zacc", self.zacc);
    v.field("xgyro", self.xgyro);
    v.field("ygyro", self.ygyro);
    v.field("zgyro", self.zgyro);
    v.field("xmag", self.xmag);
    v.field("ymag", self.ymag);
    v.field("zmag", self.zmag);
    v.field("abs_pressure", self.abs_pressure);
    v.field("diff_pressure", self.diff_pressure);
    v.field("pressure_alt", self.pressure_alt);
    v.field("temperature", self.temperature);
    v.field("fields_updated", self.fields_updated);
    v.extension("id", self.id);
  }
};

/// A line for the pilot, at most 50 letters.
struct MavStatusText {
  static constexpr std::uint32_t kId = 253;
  static constexpr std::string_view kName = "STATUSTEXT";
  std::uint8_t severity = 6;  ///< MavSeverity
  std::array<char, 50> text{};
  std::uint16_t id = 0;  ///< not 0: `chunk_seq` numbers the parts of a longer text
  std::uint8_t chunk_seq = 0;

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("severity", self.severity);
    v.field("text", self.text);
    v.extension("id", self.id);
    v.extension("chunk_seq", self.chunk_seq);
  }
};

/// Pose in `frame_id` (m, quaternion w x y z), velocity and rates in `child_frame_id`. Both covariances are
/// upper triangles, rows x y z roll pitch yaw; NaN first: unknown.
struct MavOdometry {
  static constexpr std::uint32_t kId = 331;
  static constexpr std::string_view kName = "ODOMETRY";
  std::uint64_t time_usec = 0;
  std::uint8_t frame_id = 0;  ///< MavFrame
  std::uint8_t child_frame_id = 0;
  float x = 0, y = 0, z = 0;
  std::array<float, 4> q{};
  float vx = 0, vy = 0, vz = 0;
  float rollspeed = 0, pitchspeed = 0, yawspeed = 0;
  std::array<float, 21> pose_covariance{};
  std::array<float, 21> velocity_covariance{};
  std::uint8_t reset_counter = 0;   ///< counts up at every jump of the pose
  std::uint8_t estimator_type = 0;  ///< MavEstimator
  std::int8_t quality = 0;          ///< %, 0: unknown, -1: failed

  template <class Self, class Visitor>
  static constexpr void visit(Self& self, Visitor&& v) {
    v.field("time_usec", self.time_usec);
    v.field("frame_id", self.frame_id);
    v.field("child_frame_id", self.child_frame_id);
    v.field("x", self.x);
    v.field("y", self.y);
    v.field("z", self.z);
    v.field("q", self.q);
    v.field("vx", self.vx);
    v.field("vy", self.vy);
    v.field("vz", self.vz);
    v.field("rollspeed", self.rollspeed);
    v.field("pitchspeed", self.pitchspeed);
    v.field("yawspeed", self.yawspeed);
    v.field("pose_covariance", self.pose_covariance);
    v.field("velocity_covariance", self.velocity_covariance);
    v.extension("reset_counter", self.reset_counter);
    v.extension("estimator_type", self.estimator_type);
    v.extension("quality", self.quality);
  }
};

}  // namespace hm
