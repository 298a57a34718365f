#pragma once
#include <vector>

#include "hm/core/rng.hpp"
#include "hm/laser/height/height_estimator.hpp"
#include "hm/sensors/laser_rig.hpp"

namespace hm {

/// Box on the floor, infinite across the direction of flight.
struct FloorBox {
  double begin_m, end_m, top_m;
};

/// Simulated flight along x over boxes, back and forth, with vertical oscillation and tilt, and the down
/// mirror of the dissertation's vehicle (20 beams of a 40 Hz laser). Ranges are exact ray-box intersections;
/// a beam has a finite spot, and the range is a mixture where the spot covers an edge (Fig. 2.4).
struct FloorFlightParams {
  std::vector<FloorBox> boxes;
  double length_m = 10, speed_m_s = 1, duration_s = 20;
  double altitude_m = 1.5, bob_m = 0.15;
  double tilt_rad = 0.08;
  double reading_std_m = 0.01, spot_rad = 0.02;
  double outlier_ratio = 0;  ///< share of beams with a random range above the floor
  std::uint64_t seed = 1;
};

class FloorFlight {
 public:
  struct Frame {
    LaserScan scan;
    SweepAttitude attitude;
    double height_m = 0, acceleration_m_s2 = 0, floor_level_m = 0;  ///< truth, at the mirror's time
  };
  explicit FloorFlight(const FloorFlightParams& params);
  /// Simulates the next scan.
  Frame next();
  [[nodiscard]] std::size_t frame_count() const;
  [[nodiscard]] const LaserRig::Mirror& mirror() const { return mirror_; }
  [[nodiscard]] const FloorFlightParams& params() const { return params_; }
  /// Boxes of 0.10 to 0.80 m height with gaps, and a small staircase.
  static std::vector<FloorBox> steps_from_10_to_80_cm();

 private:
  [[nodiscard]] SE3 T_world_base(double time_s) const;
  [[nodiscard]] double height_m(double time_s) const;
  [[nodiscard]] double distance_to_surface_m(const Vec3& origin, const Vec3& direction) const;
  double range_m(const SE3& T_world_virtual, double angle_rad);

  FloorFlightParams params_;
  LaserRig::Mirror mirror_;
  Rng rng_;
  double phases_[4];
  std::size_t next_ = 0;
};

/// Errors of the height estimate over a flight.
struct HeightScore {
  double rmse_m = 0, max_error_m = 0, end_error_m = 0;
  double worst_floor_m = 0;  ///< largest distance of a true level from the nearest estimated one
  int false_floors = 0;      ///< estimated levels without a true one within 2 cm
  int events = 0, answers = 0;
};
HeightScore score_height(const FloorFlightParams& flight, const HeightParams& params,
                         bool with_acceleration = false);
/// Scores the published method on the same flight; a floor is false when it is not within 2 cm of a true one
/// at that time.
HeightScore score_histogram_height(const FloorFlightParams& flight);

}  // namespace hm
