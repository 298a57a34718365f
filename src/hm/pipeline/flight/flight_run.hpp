#pragma once
#include <memory>
#include <optional>
#include <vector>

#include "hm/pipeline/flight/flight_core.hpp"
#include "hm/pipeline/flight/flight_messages.hpp"
#include "hm/pipeline/flight/flight_observer.hpp"
#include "hm/pipeline/flight/flight_run_params.hpp"
#include "hm/pipeline/flight/flight_statistics.hpp"
#include "hm/pipeline/laser/laser_pipeline.hpp"
#include "hm/sim/vehicle/vehicle.hpp"

namespace hm {

/// Surroundings of a flight. Several flights may share one.
struct FlightSite {
  explicit FlightSite(World generated);
  FlightSite(WorldKind kind, int seed);
  FlightSite(const FlightSite&) = delete;
  FlightSite& operator=(const FlightSite&) = delete;

  World world;
  Renderer renderer;  ///< of `world`
};

/// A moment of a flight, at the end of a step.
struct FlightMoment {
  Time stamp;  ///< true time, and the core's
  AutopilotOutputs autopilot;
  BasicVehicleState<float> estimate;    ///< of the core, in `odom`
  SE2 T_map_odom;                       ///< by the loops that the computer has closed so far
  std::optional<CommandAnswer> answer;  ///< to a command that reached the core in this step
  double battery_ratio = 1;             ///< as the board measures it
  // For the log only; nothing of it reaches perception or core.
  FlightState truth;           ///< in the world
  SE3 T_odom_base;             ///< true pose in `odom`
  std::size_t collisions = 0;  ///< so far
  int feet_down = 0;           ///< feet that touch something
};

/// The core's estimate in `map`, where pilots give their goals.
[[nodiscard]] BasicVehicleState<float> estimate_in_map(const FlightMoment& moment);

/// A flight in closed loop (dissertation Fig. 2.2) on a virtual clock: vehicle and sensors -> links ->
/// laser perception (projection, scan matching, height) on the on-board computer -> serial link -> core at
/// 1 kHz on the board -> link -> motors.
///
/// Perception and core see messages only. The pose and the height that the computer sends have the stamps of
/// their measurement; the board's IMU is read directly. The faults `link_cut` and `link_noise` act on the
/// serial link, in both directions. The same parameters, faults and commands give the same bits, whatever
/// the number of threads. Not thread safe.
class FlightRun {
 public:
  /// `site` and `observer` must outlive it; null: nobody looks, and the core of this host flies.
  FlightRun(const FlightSite& site, const FlightRunParams& params, const FaultSchedule& faults = {},
            FlightObserver* observer = nullptr, std::unique_ptr<FlightCore> core = nullptr);
  ~FlightRun();
  FlightRun(FlightRun&&) noexcept;
  FlightRun& operator=(FlightRun&&) noexcept;

  /// Advances by 1 ms. A command is given to the on-board computer, which sends it to the core; its stamp
  /// should be now(). Valid until the next call.
  const FlightMoment& step(const std::optional<FlightCommand>& command = std::nullopt);
  [[nodiscard]] const FlightMoment& moment() const;
  /// Time of the last moment, and the time since the start.
  [[nodiscard]] Time now() const;
  [[nodiscard]] Duration elapsed() const;

  /// No more steps: perception finishes what waits. The maps stay readable.
  void finish();
  [[nodiscard]] const LaserPipeline& perception() const;
  /// Pose of `odom` in the world: that of the start, on the floor. For the log, and for way points that are
  /// given in the world.
  [[nodiscard]] const SE3& T_world_odom() const;
  [[nodiscard]] const LaserRig& rig() const;
  [[nodiscard]] const FlightCore& core() const;
  [[nodiscard]] const std::vector<VehicleCollision>& collisions() const;

  /// Messages in, out and dropped, and the latencies, of every stage.
  [[nodiscard]] std::vector<StageCounts> counts() const;
  [[nodiscard]] std::vector<StageLatency> latencies() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
