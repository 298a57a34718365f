#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/core/time.hpp"

namespace hm {

/// Faults of a simulated vehicle, each for a given time.
enum class FaultKind {
  kLaserOff,      ///< no laser scans
  kCameraBlack,   ///< camera frames without light
  kSensorTurned,  ///< laser and camera turned by 90 degrees about the vertical axis of the vehicle
  kImuGap,        ///< no IMU samples
  kImuStuck,      ///< IMU samples repeat the last values with new stamps
  kMotorLost,     ///< the front motor is not driven
  kLinkCut,       ///< messages of the link are lost
  kLinkNoise,     ///< bits of the link are inverted
  kClockStep,     ///< the vehicle's clock is half a second ahead
  kCellLost,      ///< one cell of the battery gives no voltage
  kGust,          ///< a strong gust
};
/// Names in scripts, in the order of FaultKind.
inline constexpr std::string_view kFaultNames[] = {
    "laser_off", "camera_black", "sensor_turned", "imu_gap",   "imu_stuck", "motor_lost",
    "link_cut",  "link_noise",   "clock_step",    "cell_lost", "gust"};

/// One fault of a script, active in [at, at + duration).
struct ScriptedFault {
  FaultKind kind = FaultKind::kLaserOff;
  Duration at;  ///< since the start of the simulation
  Duration duration;
};

/// Parses a line `fault NAME at T for D`, T and D in seconds (T >= 0, D > 0, at most a day). An error names
/// the valid word nearest to a wrong one; `where` is its place, e.g. "script.txt:3".
Result<ScriptedFault> parse_fault(std::string_view line, const std::string& where);

/// Faults over the time of a simulation.
class FaultSchedule {
 public:
  FaultSchedule() = default;
  explicit FaultSchedule(std::vector<ScriptedFault> faults);
  /// Parses a text of fault lines; empty lines and comments (#) are skipped. All errors are reported at once,
  /// each with its line; `name` is the source's name in errors.
  static Result<FaultSchedule> parse(std::string_view text, const std::string& name);

  /// The fault of this kind that is active at a time since the start, the one listed first of several; null:
  /// none.
  [[nodiscard]] const ScriptedFault* active(FaultKind kind, Duration elapsed) const;
  [[nodiscard]] bool is_active(FaultKind kind, Duration elapsed) const {
    return active(kind, elapsed) != nullptr;
  }
  [[nodiscard]] const std::vector<ScriptedFault>& all() const { return faults_; }

 private:
  std::vector<ScriptedFault> faults_;
};

}  // namespace hm
