#pragma once
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "hm/core/parallel.hpp"
#include "hm/core/params.hpp"
#include "hm/sensors/rgbd_frame.hpp"
#include "hm/sim/recording/flaws.hpp"
#include "hm/sim/sensor/carried_imu.hpp"
#include "hm/sim/sensor/depth_sensor.hpp"
#include "hm/sim/sensor/renderer.hpp"
#include "hm/sim/sensor/visibility.hpp"
#include "hm/sim/world/world.hpp"

namespace hm {

/// Parameters of a simulated RGB-D recording; the same values give the same bytes.
struct SimulationParams {
  WorldKind world = WorldKind::kHouse;
  SensorPreset sensor = SensorPreset::kTangoTablet;
  int seed = 1;
  int frame_limit = 0;                ///< 0: the whole walk
  int frame_stride = 1;               ///< keep every n-th frame of the sensor
  double duration_scale_ratio = 1.0;  ///< below 1: the same walk, but faster
  SensorEffects effects;
  std::string flaws;                ///< names of flaws of real recordings (Flaws::parse())
  bool pose_drift = false;          ///< report poses with the drift of a visual-inertial odometry
  double drift_ratio = 0.005;       ///< standard deviation of the velocity error, as a share of the speed
  double drift_yaw_rad_m = 0.0005;  ///< standard deviation of the yaw error gained per metre
  bool imu = true;                  ///< simulate an IMU mounted to the camera
  ImuSensorParams imu_sensor;
  double truth_spacing_m = 0.04;  ///< spacing of the samples of the visible truth
  double truth_far_m = 0;         ///< maximum depth at which they are visible (0: the sensor's range)

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"world", {}, "world of the walk", ParamLevel::kBasic}, self.world, kWorldKindNames);
    v(ParamDoc{"sensor", {}, "simulated depth camera", ParamLevel::kBasic}, self.sensor, kSensorPresetNames);
    v(ParamDoc{"seed", {0, 2147483647}, "seed of all random numbers", ParamLevel::kBasic}, self.seed);
    v(ParamDoc{"frame_limit", {0, 1e9}, "maximum number of frames; 0: the whole walk", ParamLevel::kBasic},
      self.frame_limit);
    v(ParamDoc{"frame_stride", {1, 1e6}, "keep every n-th frame", ParamLevel::kBasic}, self.frame_stride);
    SensorEffects::visit(self.effects, v);
    v(
        ParamDoc{
            "flaws",
            {},
            "what real recordings suffer from, separated by commas: blur, rolling_shutter, exposure, "
            "intrinsics, registration, depth_bend, time_offset, wheel_slip, glass, people, or all; besides, "
            "unregistered, short_depth, depth_grain",
            ParamLevel::kBasic},
        self.flaws);
    v(ParamDoc{"pose_drift", {}, "poses drift like those of a visual-inertial odometry", ParamLevel::kBasic},
      self.pose_drift);
    v(ParamDoc{"drift_ratio", {0, 1}, "velocity error as a share of the speed"}, self.drift_ratio);
    v(ParamDoc{"drift_yaw_rad_m", {0, 1}, "yaw error gained per metre"}, self.drift_yaw_rad_m);
    v(ParamDoc{"imu", {}, "simulate an IMU mounted to the camera (imu.csv)", ParamLevel::kBasic}, self.imu);
    ImuSensorParams::visit(self.imu_sensor, v);
    v(ParamDoc{"truth_spacing_m", {0.002, 1}, "spacing of the samples of the visible truth"},
      self.truth_spacing_m);
    v(ParamDoc{"truth_far_m",
               {0, 200},
               "maximum depth at which these samples count as visible; 0: the sensor's range"},
      self.truth_far_m);
  }
};

/// Simulates a depth camera carried through a generated world. The names of flaws must be valid (checked).
/// Frames may be requested in any order and from
/// several threads; a frame depends only on the parameters and its index.
class Simulation {
 public:
  explicit Simulation(const SimulationParams& params);
  ~Simulation();
  Simulation(Simulation&&) noexcept;
  Simulation& operator=(Simulation&&) noexcept;

  [[nodiscard]] std::size_t frame_count() const;
  /// Renders a frame with the reported pose (the true one unless has_reported_poses()), in parallel over
  /// image rows.
  [[nodiscard]] RgbdFrame frame(std::size_t index, const ParallelLoop& loop = ParallelLoop()) const;
  [[nodiscard]] Time stamp(std::size_t index) const;
  [[nodiscard]] SE3 true_pose(std::size_t index) const;
  [[nodiscard]] SE3 reported_pose(std::size_t index) const;
  /// Reported poses are not the true ones: they drift (pose_drift) or come from wheels (Flaw::kWheelSlip).
  [[nodiscard]] bool has_reported_poses() const;
  /// IMU samples from the first frame to the last (carried_imu.hpp); empty without IMU.
  [[nodiscard]] std::vector<ImuSample> imu() const;
  /// Camera of depth and colour, without distortion, as the recording states it (Flaw::kIntrinsics).
  [[nodiscard]] const PinholeCamera& camera() const;
  [[nodiscard]] const SensorModel& sensor() const;
  [[nodiscard]] const FlawSizes& flaws() const;
  [[nodiscard]] const World& world() const;
  [[nodiscard]] const SimulationParams& params() const;
  /// Part of the true surface visible in the frames (all, or 2000 evenly chosen ones) within the sensor's
  /// range and params().truth_far_m.
  [[nodiscard]] SurfacePoints visible_truth(const ParallelLoop& loop) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
