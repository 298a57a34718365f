#pragma once
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "hm/geometry/se2.hpp"
#include "hm/laser/odometry/attitude_history.hpp"
#include "hm/mvog/beam_scan.hpp"
#include "hm/sensors/laser_rig.hpp"
#include "hm/sensors/laser_scan.hpp"

namespace hm {

/// T_odom_base at a moment of a sweep; nothing where it is not known.
using SweepPose = std::function<std::optional<SE3>(Time stamp)>;

/// The vehicle's pose when a beam of a sweep was measured.
struct SweepKnot {
  std::size_t beam = 0;
  SE3 T_odom_base;

  template <class Archive>
  void visit_state(Archive& archive) {
    archive(beam, T_odom_base);
  }
};

/// The end points of a scan's beams in `odom`, every one from the vehicle's pose at its own time. Beams in
/// the scan plane and those that mirrors turn; what the rig calls hidden is left out.
class SweepPoints {
 public:
  /// `clear_without_return_m` > 0: a beam without return ends there, freely.
  explicit SweepPoints(double clear_without_return_m = 0) : clear_without_return_m_(clear_without_return_m) {}

  /// False when a pose is missing; the points are empty then.
  bool compute(const LaserScan& scan, const LaserRig& rig, const SweepPose& T_odom_base);
  /// Computes the points from poses that an earlier compute() of this scan gave (knots()), each moved by
  /// `T_map_odom`.
  void compute_again(const LaserScan& scan, const LaserRig& rig, std::span<const SweepKnot> knots,
                     const SE3& T_map_odom);
  /// The poses between which the last compute() placed the beams.
  [[nodiscard]] const std::vector<SweepKnot>& knots() const { return knots_; }
  /// Valid until the next compute(). The origin is the laser's place in the middle of the sweep.
  [[nodiscard]] BeamScan beam_scan() const { return {origin_m_, returns_m_, no_returns_m_}; }

 private:
  bool prepare_knots(const LaserScan& scan, const SweepPose& T_odom_base);
  void add_all_beams(const LaserScan& scan, const LaserRig& rig);
  void add_beams(const LaserScan& scan, const BeamRange& beams, const SE3& T_base_laser,
                 double clear_without_return_m);

  double clear_without_return_m_;
  std::vector<SweepKnot> knots_;
  Vec3 origin_m_ = Vec3::Zero();
  std::vector<Eigen::Vector3f> returns_m_, no_returns_m_;
};

/// The pose of a sweep from scan matching: position and yaw of one moment, moved by the velocity, turned by
/// the attitude of each moment.
struct MatchedSweep {
  Time stamp;
  Vec3 p_odom = Vec3::Zero(), v_odom_m_s = Vec3::Zero();
  double yaw_rad = 0, yaw_rate_rad_s = 0;
  const AttitudeHistory* attitude = nullptr;
  double attitude_yaw_rad = 0;  // of the attitude at `stamp`

  [[nodiscard]] std::optional<SE3> at(Time time) const {
    const double dt_s = (time - stamp).seconds();
    const Vec3 position = p_odom + v_odom_m_s * dt_s;
    if (!attitude)
      return SE3(rotation_from_roll_pitch_yaw({0, 0, yaw_rad + yaw_rate_rad_s * dt_s}), position);
    const auto R_world_base = attitude->at(time);
    if (!R_world_base) return std::nullopt;
    return SE3(rotation_from_roll_pitch_yaw({0, 0, yaw_rad - attitude_yaw_rad}) * *R_world_base, position);
  }
};

}  // namespace hm
