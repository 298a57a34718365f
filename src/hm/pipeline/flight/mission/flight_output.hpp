#pragma once
#include "hm/pipeline/flight/mission/flight_mission.hpp"

namespace hm {

/// A flight that is over, and the folder for its results.
struct FlownMission {
  const FlightMissionOptions& options;
  const FlightSite& site;
  const FlightRun& run;
  std::filesystem::path folder;
};

/// Writes everything that a flight leaves besides what FlightRecorder wrote, and completes the summary's
/// outputs and warnings. An error is one of writing.
Result<void> write_flight_results(const FlownMission& flown, FlightSummary& summary);

}  // namespace hm
