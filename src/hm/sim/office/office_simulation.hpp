#pragma once
#include <memory>
#include <vector>

#include "hm/geometry/trajectory.hpp"
#include "hm/sensors/laser_scan.hpp"

namespace hm {

/// A simulated drive through an office floor; the same values give the same bytes.
struct OfficeSimulationOptions {
  int seed = 1;
  double width_m = 60, depth_m = 40;
  double range_max_m = 30;  ///< 8 m: the ranges of a small scanner
  double scan_every_m = 1;  ///< way between two scans, 0.01 to 1; on the spot half as many radians
  bool people = true;
  bool perfect = false;  ///< no noise, no glass that reflects, no people, wheels that do not err
  int scan_limit = 0;    ///< 0: the whole drive
};

/// Simulates a wheeled robot with a laser of 180 degrees and 181 beams, level, at its base, in an office
/// floor (make_office_floor(), make_office_drive()). Its wheels err as WheelErrors. Ranges have a noise of 1
/// cm, which grows by a thousandth of the range, and steps of 1 cm. A pane of glass reflects beams that hit
/// it at a right angle more often than not, others seldom; the rest goes through it. People stand in the way
/// of some scans. Const members may be called from several threads.
class OfficeSimulation {
 public:
  explicit OfficeSimulation(const OfficeSimulationOptions& options);
  ~OfficeSimulation();
  OfficeSimulation(OfficeSimulation&&) noexcept;
  OfficeSimulation& operator=(OfficeSimulation&&) noexcept;

  [[nodiscard]] std::size_t scan_count() const;
  /// All beams are measured at once.
  [[nodiscard]] LaserScan scan(std::size_t index) const;
  /// T_odom_base as the wheels say, at every scan; the first is the identity.
  [[nodiscard]] const Trajectory& odometry() const;
  /// T_world_base, every pose of the drive until the last scan.
  [[nodiscard]] const Trajectory& truth() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
