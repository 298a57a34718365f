#pragma once
#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

#include "hm/core/params.hpp"
#include "hm/laser/matching/planar_scan.hpp"
#include "hm/laser/odometry/attitude_history.hpp"
#include "hm/sensors/laser_rig.hpp"
#include "hm/sensors/laser_scan.hpp"

namespace hm {

struct ScanProjectionParams {
  /// Beams measured while the vehicle is tilted more are dropped.
  double max_tilt_rad = 0.35;
  /// End points closer than this to the floor or the ceiling are dropped.
  double surface_margin_m = 0.15;
  /// Reference time within the sweep: 0 first beam, 1 last.
  static constexpr double kReferenceMomentRatio = 0.5;
  int every_nth_beam = 1;
  /// Points closer than this to the last kept one are dropped; 0: none.
  double min_spacing_m = 0;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"every_nth_beam", {1, 1000}, "use every n-th beam; 1: all"}, self.every_nth_beam);
  }
};

/// Motion of the vehicle during a sweep; every part may be missing.
struct SweepMotion {
  const AttitudeHistory* attitude =
      nullptr;  ///< R_world_base; null: level, with yaw rate from velocity_ortho
  /// Velocity in `ortho` at the scan's reference time: x, y (m/s) and yaw rate (rad/s; used only without
  /// attitude).
  std::optional<Vec3> velocity_ortho;
  std::optional<double> height_above_floor_m;       ///< of the base
  std::optional<double> clearance_below_ceiling_m;  ///< of the base
};

enum class ProjectionStatus {
  kOk,
  kNoAttitude,    ///< the attitude history does not cover the scan
  kTiltTooLarge,  ///< tilted beyond max_tilt_rad for most of the sweep
  kNoPoints,      ///< all beams were dropped; see the counts
};
std::string_view to_string(ProjectionStatus status);

/// Numbers of dropped beams by reason; with the kept points they add up to the beams of the scan.
struct ProjectionCounts {
  std::size_t mirrored = 0;      ///< outside the rig's horizontal range
  std::size_t thinned = 0;       ///< dropped by every_nth_beam and min_spacing_m
  std::size_t invalid = 0;       ///< NaN
  std::size_t out_of_range = 0;  ///< at or below range_min, at or beyond range_max, no return
  std::size_t tilted = 0, floor = 0, ceiling = 0;
  std::size_t without_attitude = 0;
};

struct ProjectedScan {
  ProjectionStatus status = ProjectionStatus::kNoPoints;
  PlanarScan scan;  ///< empty unless the status is kOk
  ProjectionCounts counts;
  double tilt_rad = 0;  ///< at the scan's reference time
};

/// Projects scans into the frame `ortho`: the vehicle's base (not the laser, whose lever arm moves with the
/// tilt) without height, roll and pitch, at one time of the sweep (dissertation 2.2.2, eqs 2.1-2.3). Every
/// beam is rotated by the attitude at its own time, and shifted by the motion since the scan's reference
/// time.
///
/// Not thread safe (caches the beams' sines and cosines). Bearings and ranges of the result are relative to
/// the laser's position in `ortho` at the scan's reference time.
class ScanProjector {
 public:
  explicit ScanProjector(const LaserRig& rig, const ScanProjectionParams& params = {});
  /// Projects one scan. Unusable beams are counted; they are not an error.
  ProjectedScan project(const LaserScan& scan, const SweepMotion& motion = {});

 private:
  struct BeamMotion;
  class SweepInterpolation;
  void prepare_directions(const LaserScan& scan);
  void project_beam(const Vec2& end_laser_m, const BeamMotion& beam, const SweepMotion& motion,
                    ProjectedScan& result) const;
  static void conclude(std::size_t beams, ProjectedScan& result);

  LaserRig rig_;
  ScanProjectionParams params_;
  double angle_min_rad_ = 0, angle_increment_rad_ = 0;  // of directions_
  std::vector<Vec2> directions_;
};

}  // namespace hm
