#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "hm/pipeline/flight/ground_station.hpp"
#include "hm/pipeline/flight/mission/flight_log.hpp"
#include "hm/pipeline/flight/mission/flight_recorder.hpp"
#include "hm/pipeline/laser/run/laser_summary.hpp"
#include "hm/report/summary_tree.hpp"

namespace hm {

/// Everything that decides what `hm fly` does.
struct FlightParameters {
  FlightRunParams flight;
  PilotParams pilot;
  GroundStationParams ground_station;
  LaserRunParameters perception;  ///< replaces FlightRunParams::perception

  FlightParameters() { perception.laser = flight.perception; }
};
/// Its sections: those of list_flight(), pilot, ground_station, those of list_laser().
ParamList list_flight_mission(FlightParameters& parameters);
Result<void> check_parameters(const FlightParameters& parameters);

/// Result of a flight.
struct FlightSummary {
  std::string mission;  ///< "hover", "waypoints tour.txt"
  FlightParameters parameters;
  bool interrupted = false;
  double flight_s = 0;  ///< simulated
  double run_s = 0;     ///< what it took
  std::size_t collisions = 0;
  std::string end_state;                    ///< "landed", "flying", "error", "fallen"
  std::optional<std::string> core_failure;  ///< why the autopilot did not work to the end
  std::size_t scans = 0;
  FlightLog log;
  std::vector<OrderRecord> orders;
  std::vector<MeasuredHeight> heights;
  std::vector<StageCounts> counts;
  std::vector<StageLatency> latencies;
  Trajectory truth;       ///< T_world_base at 50 Hz, of more than 20 minutes an even thinning
  Trajectory trajectory;  ///< T_odom_base by the core's estimate, the same
  SE3 T_world_odom;
  Time start;
  MvogSize map;
  std::vector<std::string> warnings;
  std::vector<std::filesystem::path> outputs;
};

/// Reason why the flight is a failure, in words: an autopilot that failed, collisions, or an end in the air
/// or not on the feet; empty for one without.
[[nodiscard]] std::string mishap_of(const FlightSummary& summary);

/// The true path as T_odom_base.
[[nodiscard]] Trajectory truth_in_odom(const FlightSummary& summary);

/// collisions, hover{max_xy_m,max_z_m,rms_m}, waypoints{reached,missed}, failsafes[], realtime_ratio,
/// end_state ... (the keys of `hm fly --json`).
void visit(const FlightSummary& summary, SummaryTree& v);
/// A few lines for a terminal.
std::string to_text(const FlightSummary& summary);

}  // namespace hm
