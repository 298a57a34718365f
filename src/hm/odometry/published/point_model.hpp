#pragma once
#include <span>
#include <vector>

#include "hm/odometry/interface/published_params.hpp"
#include "hm/odometry/published/point_index.hpp"

namespace hm {

/// Point with its covariance, in any frame.
struct UncertainPoint {
  Vec3 mean = Vec3::Zero();
  Mat3 covariance = Mat3::Zero();  ///< m^2
};

/// Persistent model of dissertation 3.2: points with covariances in a fixed frame; at capacity the oldest are
/// overwritten. Not thread safe.
class PointModel {
 public:
  explicit PointModel(const PointModelParams& params);

  /// Counts of the points of a frame by how the model used them.
  struct Update {
    int updated = 0, inserted = 0;
    int ignored = 0;  ///< their nearest model point was already updated by this frame
  };
  /// Adds points in the model's frame: each is fused with the nearest model point by Mahalanobis distance
  /// among its Euclidean neighbours (Kalman filter, H = I), or inserted if none is within the gate. A model
  /// point is updated at most once per call, and points inserted by a call are not considered in it.
  Update update(std::span<const UncertainPoint> points);

  /// Nearest model point; index -1 beyond max_distance_m.
  [[nodiscard]] PointIndex::Neighbour nearest(const Vec3& query, double max_distance_m) const {
    return index_.nearest(query, max_distance_m);
  }
  [[nodiscard]] std::span<const UncertainPoint> points() const { return points_; }
  void clear();
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  void insert(const UncertainPoint& point);
  void rebuild_index();

  PointModelParams params_;
  std::vector<UncertainPoint> points_;
  std::size_t oldest_ = 0;  ///< next slot to overwrite when the model is full
  PointIndex index_;
};

/// Kalman update of a point by a measurement, in Joseph form, symmetric, with standard deviations of at least
/// `least_sigma_m` in every direction. The sum of the covariances must be regular.
UncertainPoint fuse(const UncertainPoint& prior, const UncertainPoint& measured, double least_sigma_m);

}  // namespace hm
