#pragma once
#include <span>
#include <vector>

#include "hm/odometry/interface/published_params.hpp"
#include "hm/odometry/published/point_index.hpp"

namespace hm {

/// A point with its uncertainty, in whatever frame.
struct UncertainPoint {
  Vec3 mean = Vec3::Zero();
  Mat3 covariance = Mat3::Zero();  ///< m^2
};

/// The dissertation's persistent model (3.2): points with covariances in a fixed frame, at most so many, the
/// oldest of which are overwritten. One thread uses it.
class PointModel {
 public:
  explicit PointModel(const PointModelParams& params);

  /// Counts of the points of a frame by how the model used them.
  struct Update {
    int updated = 0, inserted = 0;
    int ignored = 0;  ///< nearest to a model point that this frame has updated before
  };
  /// Takes in points in the model's frame: each one is fused with the model point nearest by Mahalanobis
  /// distance among its Euclidean neighbours (Kalman filter, H = I), or inserted where none is within the
  /// gate. A model point is updated once a call; what the call inserts is not seen by its own points.
  Update update(std::span<const UncertainPoint> points);

  /// The model point nearest to a place, index -1 beyond max_distance_m.
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
  std::size_t oldest_ = 0;  ///< where the next one goes once the model is full
  PointIndex index_;
};

/// The Kalman update of a point by a measurement of it, in Joseph's form, symmetric, with no direction more
/// certain than `least_sigma_m`. The sum of the covariances must be regular.
UncertainPoint fuse(const UncertainPoint& prior, const UncertainPoint& measured, double least_sigma_m);

}  // namespace hm
