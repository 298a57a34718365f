#pragma once
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "hm/core/run_context.hpp"
#include "hm/link/codec/mavlink_signing.hpp"
#include "hm/link/transport/transport.hpp"
#include "hm/pipeline/common/result_folder.hpp"
#include "hm/pipeline/flight/flight_core.hpp"
#include "hm/pipeline/flight/flight_script.hpp"
#include "hm/pipeline/flight/mission/flight_summary.hpp"
#include "hm/pipeline/flight/mission/live_lines.hpp"
#include "hm/pipeline/flight/page/page_pilot.hpp"

namespace hm {

struct FlightMissionOptions {
  std::string mission;  ///< name, for people
  FlightScript script;
  /// More orders, from somebody who flies live; lines as in a script. A line that begins with `now` takes the
  /// place of all that runs and waits. Null: none.
  LiveLines* live = nullptr;
  FlightParameters parameters;
  /// The autopilot; called with the parameters in effect. Empty: the core of this library on this host.
  std::function<Result<std::unique_ptr<FlightCore>>(const FlightRunParams&)> make_core;
  /// A way to a MAVLink ground station, which sees the vehicle and may fly it (GroundStation). Null: none.
  Transport* ground_station = nullptr;
  std::optional<MavlinkKey> mavlink_key;  ///< of that way; nothing: unsigned
  /// Somebody at a page who may fly; with `live`, the flight then goes on until it is stopped. Null: none.
  PagePilot* page = nullptr;
  /// Where it flies; null: the world of the parameters. It must outlive the flight.
  const FlightSite* site = nullptr;
  bool realtime = false;  ///< not faster than the clock on the wall
  std::filesystem::path output;
  ExistingResult existing = ExistingResult::kRefuse;
  RunContext run;  ///< stopped early, the vehicle lands, and the files are complete
};

/// Flies a simulated vehicle by a script (dissertation 2.3, Fig. 2.2) and writes:
///   recording.bag, rig.toml, groundtruth.txt   what `hm laser` reads, with the truth beside it (world)
///   core.trace                                 inputs and outputs of the core, for replay
///   trajectory.tum                             poses by the core's estimate, in `odom`
///   map.mvog, map.bt, map.ply, map.yaml, map.pgm   of the laser, in `odom`
///   flight.svg                                 the flight over the floor plan, moving
///   report.json, report.html, pictures/, parameters.toml
/// A collision is no error: see FlightSummary::collisions.
/// Errors: parameters or output folder unusable, the core cannot be made, a file cannot be written.
Result<FlightSummary> fly_mission(const FlightMissionOptions& options);

}  // namespace hm
