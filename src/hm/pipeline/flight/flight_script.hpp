#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/core/time.hpp"
#include "hm/geometry/se3.hpp"
#include "hm/sim/vehicle/fault_script.hpp"

namespace hm {

/// One thing that a pilot does. Positions in the frame `odom`: metres, x forward and y left of the vehicle at
/// the start, z above the floor there.
struct FlightOrder {
  enum class Kind { kTakeOff, kGoTo, kStep, kVelocity, kWait, kHold, kReturn, kLand, kEStop };
  Kind kind = Kind::kHold;
  double height_m = 0;  ///< kTakeOff: above the place; 0: the autopilot's default
  /// kGoTo; kStep: from where the vehicle is, in its level frame (x forward)
  Vec3 position_m = Vec3::Zero();
  std::optional<double> yaw_rad;     ///< kGoTo, kStep (by how much); nothing: keeps the heading
  Vec3 velocity_m_s = Vec3::Zero();  ///< kVelocity, in the level frame of the vehicle (x forward)
  double yaw_rate_rad_s = 0;         ///< kVelocity
  Duration duration;                 ///< kVelocity, kWait
  std::string text;                  ///< the order as it was written
};

/// Orders of a pilot, in order, and faults of the vehicle meanwhile.
struct FlightScript {
  std::vector<FlightOrder> orders;
  std::vector<ScriptedFault> faults;
};

/// Parses one line:
///
///     takeoff [HEIGHT]                              metres above the place
///     goto X Y Z [YAW]                              metres, degrees
///     step FORWARD LEFT UP [YAW]                     metres and degrees from where it is
///     velocity VX VY VZ YAW_RATE for S              m/s, forward, to the left, up; degrees a second
///     wait S
///     hold
///     return                                        back along the path that it has flown; lands there
///     land
///     estop
///     fault NAME at T for D                         seconds since the start of the simulation
///
/// The error (kUsage) names the valid word nearest to a wrong one; `where` is its place, e.g. "script.txt:3".
Result<std::variant<FlightOrder, ScriptedFault>> parse_flight_line(std::string_view line,
                                                                   const std::string& where);

/// Parses a script; empty lines and comments (#) are skipped. All errors are reported at once (kUsage), each
/// with its line, those of order too: what needs a flying vehicle before take-off, a take-off in the air.
/// `name` is the source's name in errors.
Result<FlightScript> parse_flight_script(std::string_view text, const std::string& name);
/// The same of a file. Error: not readable.
Result<FlightScript> read_flight_script(const std::filesystem::path& path);

/// Parses way points, one a line: x y z [yaw_deg]; empty lines and comments (#) are skipped. Gives the script
/// that takes off, visits them and lands. Errors as of parse_flight_script(); no way point at all.
Result<FlightScript> parse_way_points(std::string_view text, const std::string& name);
Result<FlightScript> read_way_points(const std::filesystem::path& path);

/// Take off, hover, land.
FlightScript hover_script(double height_m, Duration duration);
/// Take off to the goal's height, go there, wait for two seconds, land.
FlightScript go_to_script(const Vec3& goal_m);

}  // namespace hm
