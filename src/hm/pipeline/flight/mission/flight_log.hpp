#pragma once
#include <optional>
#include <string>
#include <vector>

#include "hm/core/statistics.hpp"
#include "hm/flight/guidance.hpp"
#include "hm/geometry/trajectory.hpp"
#include "hm/pipeline/common/run_records.hpp"
#include "hm/pipeline/flight/flight_run.hpp"
#include "hm/pipeline/flight/script_pilot.hpp"

namespace hm {

/// A vehicle's motion at a moment, in `odom`.
struct FlightMotion {
  Vec3 position_m = Vec3::Zero(), velocity_m_s = Vec3::Zero();
  double yaw_rad = 0;
};

/// Every 20th millisecond of a flight.
struct FlightSample {
  double time_s = 0;  ///< since the start
  FlightMotion truth, estimate;
  std::optional<Vec3> goal_m;  ///< of the position mode
  std::optional<double> goal_yaw_rad;
  double tilt_rad = 0;  ///< true
  double battery_ratio = 1;
};

struct FlightEvent {
  double time_s = 0;
  std::string text;
};

/// A fail-safe from its beginning to its end.
struct FailSafeEpisode {
  FailSafe which = FailSafe::kEStop;
  SafetyAction action = SafetyAction::kNone;
  double begin_s = 0;
  std::optional<double> end_s;           ///< nothing: it lasted to the end of the flight
  std::optional<double> angle_rad = {};  ///< kTiltMismatch: by which the position sensor seems turned
};

/// Distance of the true position from a goal at which the vehicle waits, from three seconds after it began to
/// wait there.
struct HoverError {
  double max_xy_m = 0, max_z_m = 0, rms_m = 0, duration_s = 0;
};

/// A way point, by the truth.
struct WayPointRecord {
  std::size_t order = 0;  ///< place among the pilot's records
  Vec3 goal_m = Vec3::Zero();
  bool reached = false;  ///< by the estimate
  double nearest_m = 0;  ///< least distance of the true position on the way there
  double begin_s = 0;
  std::optional<double> end_s;
};

/// Follows a flight step by step and keeps what its results need, in bounded memory. Compares with the truth;
/// what it finds goes to no part of the vehicle.
class FlightLog {
 public:
  /// `takeoff_height_m`: of a take-off that names none.
  explicit FlightLog(const FaultSchedule& faults = {},
                     double takeoff_height_m = static_cast<double>(GuidanceParams{}.takeoff_height_m))
      : faults_(faults), takeoff_height_m_(takeoff_height_m) {}
  /// Takes a step of the run, in order, and what the pilot does meanwhile.
  void add(const FlightRun& run, const ScriptPilot& pilot);
  void note(double time_s, std::string text) { events_.push_back({time_s, std::move(text)}); }

  [[nodiscard]] const std::vector<FlightSample>& samples() const { return samples_.items(); }
  [[nodiscard]] const std::vector<FlightEvent>& events() const { return events_; }
  [[nodiscard]] const std::vector<FailSafeEpisode>& fail_safes() const { return fail_safes_; }
  [[nodiscard]] const std::vector<WayPointRecord>& way_points() const { return way_points_; }
  /// Nothing if the vehicle did not wait at a goal for longer than three seconds.
  [[nodiscard]] std::optional<HoverError> hover() const;
  /// Distance of the estimated from the true position while flying.
  [[nodiscard]] Summary estimate_error_m() const { return estimate_error_m_.summary(); }
  [[nodiscard]] double air_s() const { return static_cast<double>(air_steps_) * 1e-3; }
  [[nodiscard]] double path_m() const { return path_m_; }
  [[nodiscard]] double max_speed_m_s() const { return max_speed_m_s_; }
  [[nodiscard]] double max_tilt_rad() const { return max_tilt_rad_; }
  [[nodiscard]] std::size_t refusals() const { return refusals_; }

 private:
  void note_state(const FlightMoment& moment);
  void note_fail_safes(const FlightMoment& moment);
  void note_faults();
  void note_texts(const FlightCore& core);
  void note_collisions(const FlightRun& run);
  void note_orders(const ScriptPilot& pilot);
  void follow_goal(const FlightMoment& moment);
  void measure(const FlightMoment& moment, const ScriptPilot& pilot);
  void measure_hover(const Vec3& true_m, bool waits);

  FaultSchedule faults_;
  EvenlyThinned<FlightSample> samples_{std::size_t{1} << 14U};
  std::vector<FlightEvent> events_;
  std::vector<FailSafeEpisode> fail_safes_;
  std::vector<WayPointRecord> way_points_;
  RunningSummary estimate_error_m_;
  double takeoff_height_m_;
  std::optional<Vec3> goal_m_;
  std::optional<double> goal_yaw_rad_;
  double now_s_ = 0, path_m_ = 0, max_speed_m_s_ = 0, max_tilt_rad_ = 0;
  std::size_t steps_ = 0, air_steps_ = 0, refusals_ = 0, collisions_ = 0, texts_ = 0;
  std::size_t orders_begun_ = 0, orders_ended_ = 0;
  AutopilotState state_ = AutopilotState::kOff;
  FlightPhase phase_ = FlightPhase::kGround;
  std::uint32_t active_ = 0;  // fail-safes
  std::vector<bool> fault_active_;
  std::optional<Vec3> last_m_;
  // Hover: while the vehicle waits at a goal.
  std::size_t wait_steps_ = 0, hover_steps_ = 0;
  double hover_squares_m2_ = 0, hover_xy_m_ = 0, hover_z_m_ = 0;
};

/// Motion of a moment by the truth and by the core's estimate; of the latter, what is not known yet is NaN.
FlightMotion true_motion(const FlightMoment& moment);
FlightMotion estimated_motion(const FlightMoment& moment);
/// View of a pilot (ScriptPilot's identity) at a moment.
PilotView pilot_view(const FlightMoment& moment, std::uint8_t identity = ScriptPilot::kPilot);

}  // namespace hm
