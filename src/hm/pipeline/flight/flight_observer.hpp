#pragma once
#include <span>

#include "hm/flight/trace/core_trace.hpp"
#include "hm/pipeline/flight/flight_messages.hpp"
#include "hm/pipeline/laser/laser_pipeline.hpp"
#include "hm/sim/recording/laser_simulation.hpp"

namespace hm {

/// Sees the messages of a flight, for recordings and displays. All functions do nothing by default.
class FlightObserver {
 public:
  virtual ~FlightObserver() = default;
  /// A scan or a sample of the IMU (200 Hz, stamped with the computer's clock) reached the on-board computer.
  virtual void on_scan(const Received<LaserScan>& /*scan*/) {}
  virtual void on_imu(const Received<ImuSample>& /*sample*/) {}
  /// Called with the result of perception for a scan.
  virtual void on_laser_step(const LaserStep& /*step*/) {}
  /// A pose or a height reached the board.
  virtual void on_pose(const Received<PoseMessage>& /*pose*/) {}
  virtual void on_height(const Received<HeightMessage>& /*height*/) {}
  /// Distances of obstacles reached the board.
  virtual void on_obstacles(const Received<ObstacleMessage>& /*obstacles*/) {}
  /// The records of a step of the core, in the order in which a replay feeds them.
  virtual void on_core_step(std::span<const CoreTraceRecord> /*records*/) {}
};

}  // namespace hm
