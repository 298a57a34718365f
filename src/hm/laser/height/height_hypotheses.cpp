#include "hm/laser/height/height_hypotheses.hpp"

#include <cmath>

namespace hm {
namespace {

/// Heights that differ less agree; and a floor that is found anew so near to one is the same, after some
/// drift.
constexpr double kAgree_m = 0.05;
/// So long the accelerometer may disagree; no ramp is longer.
constexpr double kLongest_s = 3;

/// When the level below was first seen; nothing where no floor is confirmed near it.
std::optional<Time> first_seen(const HeightEstimator& estimator) {
  std::optional<Time> first;
  for (const FloorLevel& floor : estimator.profile())
    if (std::abs(floor.level_m - estimator.last().floor_level_m) < kAgree_m &&
        (!first || floor.first_seen < *first))
      first = floor.first_seen;
  return first;
}

}  // namespace

HeightEstimate HeightHypotheses::update(const MirrorDistances& scan,
                                        const std::optional<double>& acceleration_m_s2) {
  if (!acceleration_m_s2 && !disagree_since_) inertial_.reset();
  if (acceleration_m_s2 && !inertial_) inertial_ = flat_;
  const HeightEstimate by_floor = flat_.update(scan);
  if (!inertial_) return by_floor;
  const HeightEstimate by_imu = inertial_->update(scan, acceleration_m_s2);
  if (by_floor.status != HeightStatus::kOk || by_imu.status != HeightStatus::kOk) return by_floor;
  if (std::abs(by_floor.height_m - by_imu.height_m) < kAgree_m) {
    disagree_since_.reset();
    return by_floor;
  }
  if (!disagree_since_) disagree_since_ = scan.stamp;
  const auto of_floor = first_seen(flat_), of_imu = first_seen(*inertial_);
  if (of_imu && (!of_floor || *of_imu < *of_floor)) {
    flat_ = *inertial_;
    disagree_since_.reset();
    return by_imu;
  }
  if ((scan.stamp - *disagree_since_).seconds() > kLongest_s) {
    inertial_ = flat_;
    disagree_since_.reset();
  }
  return by_floor;
}

}  // namespace hm
