#pragma once
#include <optional>
#include <vector>

#include "hm/laser/height/height_estimator.hpp"

namespace hm {

/// Height where an IMU measures the vertical acceleration: two estimators of the same scans, one that
/// believes the surface below to be flat, and one that believes the accelerometer. They disagree over a ramp
/// (the first climbs with it, and takes the edge behind it for a step) and after a knock (the second believes
/// to have flown away). What they see tells which is right: the one that is over the older floor, as it has
/// come back to it or never left it. Until that is known the first counts.
///
/// Without an acceleration it is a HeightEstimator. Not thread safe.
class HeightHypotheses {
 public:
  explicit HeightHypotheses(const HeightParams& params = {}, SurfaceSide side = SurfaceSide::kFloor)
      : flat_(params, side) {}

  /// As HeightEstimator::update(). The height may jump back to the truth where a ramp has ended.
  HeightEstimate update(const MirrorDistances& scan, const std::optional<double>& acceleration_m_s2);

  [[nodiscard]] std::vector<FloorLevel> profile() const { return flat_.profile(); }
  [[nodiscard]] const HeightEstimate& last() const { return flat_.last(); }
  [[nodiscard]] SurfaceSide side() const { return flat_.side(); }

 private:
  HeightEstimator flat_;
  std::optional<HeightEstimator> inertial_;  ///< where an acceleration was measured, or the two disagree
  std::optional<Time> disagree_since_;
};

}  // namespace hm
