#include "hm/odometry/published/point_model.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

namespace hm {

namespace {

/// Raises eigenvalues below `least` to `least`.
Mat3 with_floor(const Mat3& covariance, double least) {
  Eigen::SelfAdjointEigenSolver<Mat3> solver;
  solver.computeDirect(covariance);
  if (solver.eigenvalues()(0) >= least) return covariance;
  const Vec3 values = solver.eigenvalues().cwiseMax(least);
  return solver.eigenvectors() * values.asDiagonal() * solver.eigenvectors().transpose();
}

Mat3 symmetric(const Mat3& m) { return 0.5 * (m + m.transpose()); }

}  // namespace

UncertainPoint fuse(const UncertainPoint& prior, const UncertainPoint& measured, double least_sigma_m) {
  const Mat3 gain = prior.covariance * (prior.covariance + measured.covariance).inverse();
  const Mat3 rest = Mat3::Identity() - gain;
  const Mat3 joseph =
      rest * prior.covariance * rest.transpose() + gain * measured.covariance * gain.transpose();
  return {prior.mean + gain * (measured.mean - prior.mean),
          with_floor(symmetric(joseph), least_sigma_m * least_sigma_m)};
}

PointModel::PointModel(const PointModelParams& params) : params_(params) {}

PointModel::Update PointModel::update(std::span<const UncertainPoint> points) {
  enum class Touched : std::uint8_t { kNo, kYes };
  std::vector<Touched> touched(points_.size(), Touched::kNo);
  std::vector<const UncertainPoint*> fresh;
  std::vector<PointIndex::Neighbour> neighbours;
  Update result;
  const double gate = params_.kAssociationGateRatio * params_.kAssociationGateRatio;
  for (const UncertainPoint& point : points) {
    index_.nearest(point.mean, params_.kAssociationNeighbours, neighbours);
    double best = gate;
    int best_index = -1;
    for (const PointIndex::Neighbour& neighbour : neighbours) {
      const UncertainPoint& known = points_[static_cast<std::size_t>(neighbour.index)];
      const Vec3 difference = point.mean - known.mean;
      const double distance = difference.dot((known.covariance + point.covariance).inverse() * difference);
      if (distance >= best) continue;
      best = distance;
      best_index = neighbour.index;
    }
    if (best_index < 0) {
      fresh.push_back(&point);
      continue;
    }
    const auto at = static_cast<std::size_t>(best_index);
    if (touched[at] == Touched::kYes) {
      ++result.ignored;
      continue;
    }
    touched[at] = Touched::kYes;
    points_[at] = fuse(points_[at], point, params_.kLeastSigma_m);
    ++result.updated;
  }
  // After all updates, since the index still refers to the old points of overwritten slots.
  for (const UncertainPoint* point : fresh) insert(*point);
  result.inserted = static_cast<int>(fresh.size());
  rebuild_index();
  return result;
}

void PointModel::insert(const UncertainPoint& point) {
  const auto limit = static_cast<std::size_t>(params_.max_model_points);
  if (points_.size() < limit) {
    points_.push_back(point);
    return;
  }
  points_[oldest_] = point;
  oldest_ = (oldest_ + 1) % limit;
}

void PointModel::rebuild_index() {
  std::vector<Vec3> means;
  means.reserve(points_.size());
  for (const UncertainPoint& point : points_) means.push_back(point.mean);
  index_ = PointIndex(means);
}

void PointModel::clear() {
  points_.clear();
  oldest_ = 0;
  index_ = PointIndex();
}

std::size_t PointModel::memory_bytes() const {
  return points_.capacity() * sizeof(UncertainPoint) + index_.memory_bytes();
}

}  // namespace hm
