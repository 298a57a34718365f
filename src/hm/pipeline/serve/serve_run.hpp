#pragma once
#include <filesystem>
#include <functional>
#include <string>

#include "hm/core/run_context.hpp"
#include "hm/io/laser/laser_recording.hpp"
#include "hm/io/rgbd/recording.hpp"
#include "hm/pipeline/dense/dense_parameter_list.hpp"
#include "hm/pipeline/laser/run/laser_summary.hpp"
#include "hm/pipeline/live/live_station.hpp"
#include "hm/pipeline/rgbd/rgbd_parameter_list.hpp"

namespace hm {

/// Input of a station: what it shows.
struct ServeOptions {
  std::filesystem::path path;  ///< result, map, mesh, occupancy map, or recording
  std::string listen;          ///< LiveStationOptions::listen
  RecordingOptions recording_options;
  LaserRecordingOptions laser_options;
  RgbdParameters rgbd;       ///< of replays of RGB-D recordings
  LaserRunParameters laser;  ///< of replays of laser recordings
  RunContext run;            ///< the station is open until it is stopped
  /// Called when everything is in place, with what to say to people.
  std::function<void(const LiveStation&)> on_open;
};

/// Summary of what was shown.
struct ServeSummary {
  std::string what;  ///< "result", "map", "mesh", "occupancy map", "recording"
  double seconds = 0;
};

/// Opens a station that shows a finished result, a map or a mesh, or plays a recording (dissertation 4.4.2:
/// pause, speed and place as viewers ask), until it is stopped. Errors: the path is nothing that can be
/// shown, is damaged, or the address cannot be used.
Result<ServeSummary> serve(const ServeOptions& options);

}  // namespace hm
