#include "hm/laser/odometry/scan_projection.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace hm {

/// T_ortho_laser while one beam was measured.
struct ScanProjector::BeamMotion {
  Mat3 R_ortho_laser = Mat3::Identity();
  Vec3 laser_in_ortho_m = Vec3::Zero();
  double tilt_rad = 0;
};

namespace {

constexpr std::size_t kKnotBeams = 16;  // beams between two interpolated attitudes; linear in between

}  // namespace

/// Motion of the laser over one sweep, relative to `ortho` at the scan's reference time.
class ScanProjector::SweepInterpolation {
 public:
  SweepInterpolation(const LaserScan& scan, const LaserRig& rig, const SweepMotion& motion, Time moment)
      : scan_(scan), rig_(rig), motion_(motion), moment_(moment) {
    const std::optional<Mat3> R_world_base = attitude_at(moment);
    known_ = R_world_base.has_value();
    if (known_) yaw_at_moment_rad_ = roll_pitch_yaw(*R_world_base).z();
  }
  /// False when the attitude at the scan's reference time is unknown.
  [[nodiscard]] bool known() const { return known_; }
  [[nodiscard]] std::optional<BeamMotion> at(Time stamp) const {
    const std::optional<Mat3> R_world_base = attitude_at(stamp);
    if (!R_world_base) return std::nullopt;
    const double dt_s = (stamp - moment_).seconds();
    double yaw_rad = -yaw_at_moment_rad_;
    Vec3 base_in_ortho_m = Vec3::Zero();
    if (motion_.velocity_ortho) {
      base_in_ortho_m.head<2>() = motion_.velocity_ortho->head<2>() * dt_s;
      if (!motion_.attitude) yaw_rad += motion_.velocity_ortho->z() * dt_s;
    }
    const Mat3 R_ortho_base = rotation_from_roll_pitch_yaw({0, 0, yaw_rad}) * *R_world_base;
    BeamMotion beam;
    beam.R_ortho_laser = R_ortho_base * rig_.T_base_laser.rotation();
    beam.laser_in_ortho_m = R_ortho_base * rig_.T_base_laser.translation() + base_in_ortho_m;
    beam.tilt_rad = std::acos(std::clamp(R_ortho_base(2, 2), -1.0, 1.0));
    return beam;
  }
  /// Prepares the beams [first, first + kKnotBeams); false when an attitude is missing.
  bool load(std::size_t first, std::size_t end) {
    first_ = first;
    last_ = std::min(first + kKnotBeams, end - 1);
    if (knot_ && knot_beam_ == first)
      begin_ = *knot_;
    else if (const auto beam = at(scan_.stamp_of(first)))
      begin_ = *beam;
    else
      return false;
    knot_ = at(scan_.stamp_of(last_));
    knot_beam_ = last_;
    if (!knot_) return false;
    end_ = *knot_;
    return true;
  }
  [[nodiscard]] BeamMotion beam(std::size_t index) const {
    const double ratio =
        last_ > first_ ? static_cast<double>(index - first_) / static_cast<double>(last_ - first_) : 0;
    BeamMotion result;
    result.R_ortho_laser = begin_.R_ortho_laser + ratio * (end_.R_ortho_laser - begin_.R_ortho_laser);
    result.laser_in_ortho_m =
        begin_.laser_in_ortho_m + ratio * (end_.laser_in_ortho_m - begin_.laser_in_ortho_m);
    result.tilt_rad = begin_.tilt_rad + ratio * (end_.tilt_rad - begin_.tilt_rad);
    return result;
  }

 private:
  [[nodiscard]] std::optional<Mat3> attitude_at(Time stamp) const {
    return motion_.attitude ? motion_.attitude->at(stamp) : Mat3::Identity();
  }

  const LaserScan& scan_;
  const LaserRig& rig_;
  const SweepMotion& motion_;
  Time moment_;
  bool known_ = false;
  double yaw_at_moment_rad_ = 0;
  std::size_t first_ = 0, last_ = 0, knot_beam_ = 0;
  BeamMotion begin_, end_;
  std::optional<BeamMotion> knot_;
};

namespace {

/// Counts a beam that is not a return; true for a return.
bool is_usable(const LaserScan& scan, std::size_t beam, ProjectionCounts& counts) {
  if (scan.is_return(beam)) return true;
  ++(std::isnan(scan.ranges_m[beam]) ? counts.invalid : counts.out_of_range);
  return false;
}

/// Returns false for an end point on the floor or the ceiling, and counts it.
bool is_wall(double height_above_base_m, const SweepMotion& motion, double margin_m,
             ProjectionCounts& counts) {
  if (motion.height_above_floor_m && height_above_base_m < margin_m - *motion.height_above_floor_m) {
    ++counts.floor;
    return false;
  }
  if (motion.clearance_below_ceiling_m &&
      height_above_base_m > *motion.clearance_below_ceiling_m - margin_m) {
    ++counts.ceiling;
    return false;
  }
  return true;
}

}  // namespace

std::string_view to_string(ProjectionStatus status) {
  switch (status) {
    case ProjectionStatus::kOk:
      return "ok";
    case ProjectionStatus::kNoAttitude:
      return "no attitude at the time of the scan";
    case ProjectionStatus::kTiltTooLarge:
      return "tilt too large";
    case ProjectionStatus::kNoPoints:
      return "no points";
  }
  return "";
}

ScanProjector::ScanProjector(const LaserRig& rig, const ScanProjectionParams& params)
    : rig_(rig), params_(params) {}

/// Directions of the beams in the laser's frame, computed once for all scans of one geometry.
void ScanProjector::prepare_directions(const LaserScan& scan) {
  if (directions_.size() == scan.size() && angle_min_rad_ == scan.angle_min_rad &&
      angle_increment_rad_ == scan.angle_increment_rad)
    return;
  angle_min_rad_ = scan.angle_min_rad;
  angle_increment_rad_ = scan.angle_increment_rad;
  directions_.resize(scan.size());
  for (std::size_t i = 0; i < scan.size(); ++i)
    directions_[i] = {std::cos(scan.angle_rad(i)), std::sin(scan.angle_rad(i))};
}

ProjectedScan ScanProjector::project(const LaserScan& scan, const SweepMotion& motion) {
  ProjectedScan result;
  const BeamRange beams = rig_.horizontal_beams(scan.size());
  result.counts.mirrored = scan.size() - std::min(scan.size(), beams.size());
  if (beams.begin >= beams.end) return result;
  const double moment_beam = static_cast<double>(beams.begin) +
                             params_.kReferenceMomentRatio * static_cast<double>(beams.size() - 1);
  const Time moment = scan.stamp + Duration::from_seconds(moment_beam * scan.time_increment_s);
  result.scan.stamp = moment;
  SweepInterpolation sweep(scan, rig_, motion, moment);
  const std::optional<BeamMotion> at_moment = sweep.known() ? sweep.at(moment) : std::nullopt;
  if (!at_moment) {
    result.status = ProjectionStatus::kNoAttitude;
    result.counts.without_attitude = beams.size();
    return result;
  }
  result.tilt_rad = at_moment->tilt_rad;
  result.scan.origin_m = at_moment->laser_in_ortho_m.head<2>();
  result.scan.points_m.reserve(beams.size());
  prepare_directions(scan);
  for (std::size_t first = beams.begin; first < beams.end; first += kKnotBeams) {
    const std::size_t last = std::min(first + kKnotBeams, beams.end);
    if (!sweep.load(first, beams.end))
      result.counts.without_attitude += last - first;
    else
      for (std::size_t i = first; i < last; ++i) {
        if ((i - beams.begin) % static_cast<std::size_t>(params_.every_nth_beam) != 0)
          ++result.counts.thinned;
        else if (is_usable(scan, i, result.counts))
          project_beam(static_cast<double>(scan.ranges_m[i]) * directions_[i], sweep.beam(i), motion, result);
      }
  }
  conclude(beams.size(), result);
  return result;
}

/// Projects one end point from the laser frame (eqs 2.1 to 2.3).
void ScanProjector::project_beam(const Vec2& end_laser_m, const BeamMotion& beam, const SweepMotion& motion,
                                 ProjectedScan& result) const {
  if (beam.tilt_rad > params_.max_tilt_rad) {
    ++result.counts.tilted;
    return;
  }
  const Vec3 end_m = beam.R_ortho_laser.leftCols<2>() * end_laser_m + beam.laser_in_ortho_m;
  if (!is_wall(end_m.z(), motion, params_.surface_margin_m, result.counts)) return;
  const Vec2 point_m = end_m.head<2>();
  std::vector<Vec2>& points = result.scan.points_m;
  if (!points.empty() && (point_m - points.back()).norm() < params_.min_spacing_m) {
    ++result.counts.thinned;
    return;
  }
  points.push_back(point_m);
}

void ScanProjector::conclude(std::size_t beams, ProjectedScan& result) {
  const std::size_t found = result.scan.size();
  sort_by_bearing(result.scan);
  result.counts.thinned +=
      found - result.scan.size();  // of points with equal bearing only the nearest is kept
  result.status = ProjectionStatus::kOk;
  if (2 * result.counts.without_attitude > beams)
    result.status = ProjectionStatus::kNoAttitude;
  else if (2 * result.counts.tilted > beams)
    result.status = ProjectionStatus::kTiltTooLarge;
  else if (result.scan.size() == 0)
    result.status = ProjectionStatus::kNoPoints;
  if (result.status == ProjectionStatus::kOk) return;
  result.scan.points_m.clear();
  result.scan.bearings_rad.clear();
  result.scan.ranges_m.clear();
}

}  // namespace hm
