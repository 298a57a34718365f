#pragma once
#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "hm/core/run_context.hpp"
#include "hm/geometry/se2.hpp"
#include "hm/geometry/trajectory.hpp"
#include "hm/mesh/incremental_mesher.hpp"
#include "hm/sensors/rgbd_frame.hpp"

namespace hm {

class MultiVolumeGrid;
struct RunVerdict;

/// A frame of a depth camera, as a run has just processed it.
struct LiveCamera {
  Time stamp;
  const RgbdFrame* frame = nullptr;  ///< null: it could not be read
  PinholeCamera camera;
  std::optional<SE3> T_map_camera;
  std::string trouble;  ///< why there is no pose, or why the frame is not in the map; empty: all is well
  double sigma_m = 0;   ///< of the position; 0: unknown
};

/// Numbers of a run at a moment, with names for people.
struct LiveNumbers {
  using Named = std::vector<std::pair<std::string_view, double>>;
  std::string_view stage;
  std::size_t done = 0, total = 0;  ///< total 0: unknown
  Named stages_ms, counts, memory;  ///< milliseconds of the last frame; numbers; bytes
  Named rates_hz = {};              ///< besides that of the frames
};

/// A vehicle at a moment.
struct LiveVehicle {
  Time stamp;
  SE3 T_map_base;
  double sigma_m = 0;                        ///< of the position; 0: unknown
  std::optional<Vec3> true_position_m = {};  ///< where a simulation knows it
  Vec3 velocity_m_s = Vec3::Zero();          ///< in the level frame of the vehicle
  std::optional<double> height_m, floor_m;   ///< by the laser; level of the floor in `odom`
  std::string state, phase;                  ///< of the autopilot; empty: nothing is controlled
  bool armed = false;
  std::optional<double> battery_ratio;
  LiveNumbers::Named links_s;  ///< age of the last message of each link
  std::vector<std::string> fail_safes;
  std::string pilot;  ///< who flies; empty: nobody
};

/// A path besides that of the run.
enum class LivePath { kTrajectory, kKeyframes, kTruth, kWayPoints };
enum class LiveScan { kLaser, kObstacles };
enum class LivePlan { kNone, kValid, kRefused };

/// Is shown a run while it goes on, for displays (RunContext::view). Called on the thread of the run, which
/// it holds up as little as it can; everything that is referred to is valid during the call only.
class LiveView : public MeshObserver {
 public:
  /// Everything begins anew: nothing of what was shown is true any more.
  virtual void on_restart() = 0;
  virtual void on_camera(const LiveCamera& camera) = 0;
  virtual void on_vehicle(const LiveVehicle& vehicle) = 0;
  /// Replaces a path, which a loop has corrected. That of the camera or vehicle grows by itself.
  virtual void on_path(LivePath which, std::span<const Vec3> points_map_m) = 0;
  virtual void on_scan(LiveScan which, Time stamp, std::span<const Eigen::Vector3f> points_map_m) = 0;
  virtual void on_plan(LivePlan state, std::span<const Vec3> points_map_m, const std::string& reason) = 0;
  /// The occupancy grid, in a frame that lies in `map` at T_map_grid, and the slice of it that is shown.
  virtual void on_grid(const MultiVolumeGrid& grid, const SE2& T_map_grid, double bottom_m, double top_m) = 0;
  virtual void on_numbers(const LiveNumbers& numbers) = 0;
  /// A number that the next on_numbers() has besides.
  virtual void on_count(std::string_view name, double value) = 0;
  virtual void on_event(LogLevel level, const std::string& text) = 0;
  virtual void on_parameters(const std::string& toml) = 0;
  /// The run has ended, with what its result is worth.
  virtual void on_end(const RunVerdict& verdict) = 0;
};

}  // namespace hm
