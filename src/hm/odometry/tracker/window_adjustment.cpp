#include "hm/odometry/tracker/window_adjustment.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "hm/core/statistics.hpp"
#include "hm/geometry/solvers/large_solvers.hpp"
#include "hm/odometry/registration/pose_refinement.hpp"

namespace hm {
namespace {

using MatX = Eigen::MatrixXd;
using VecX = Eigen::VectorXd;
using Mat63 = Eigen::Matrix<double, 6, 3>;
constexpr int kFixed = -1;
constexpr double kMinLandmarkSigma_m = 0.001;
constexpr double kLeastSightVarianceScale = 0.04;  // of the sightings, however well they agree

struct View {
  int pose = kFixed;         // row of blocks; kFixed does not move
  std::size_t keyframe = 0;  // index in the map's deque
  const Sighting* sighting = nullptr;
};

struct Point {
  std::size_t landmark = 0;
  std::vector<View> views;
};

/// One landmark's part of the normal equations.
struct PointBlock {
  Mat3 V = Mat3::Zero();
  Vec3 gradient = Vec3::Zero();
  Mat3 inverse = Mat3::Zero();
  std::vector<Mat63> W;  // one per view; of fixed poses unused
};

class Window {
 public:
  Window(LocalMap& map, const PinholeCamera& camera, const WindowAdjustmentParams& params)
      : map_(map), camera_(camera), params_(params) {
    choose_poses();
    collect_points();
  }

  WindowAdjustmentResult run() {
    WindowAdjustmentResult result;
    double lambda = 1e-4;
    variance_scale_ = std::clamp(residual_variance_scale(), kLeastSightVarianceScale, 1.0);
    result.cost_before = linearise();
    double cost = result.cost_before;
    for (int i = 0; i < params_.iterations && pose_count_ > 0; ++i) {
      const auto kept_poses = poses_;
      const auto kept_points = positions_;
      if (!step(lambda)) break;
      const double new_cost = linearise();
      if (new_cost < cost) {
        ++result.accepted_steps;
        lambda = std::max(lambda * 0.1, 1e-7);
        const bool small = cost - new_cost < 1e-4 * cost;
        cost = new_cost;
        if (small) break;
      } else {
        poses_ = kept_poses;
        positions_ = kept_points;
        lambda *= 30;
        linearise();
      }
    }
    result.cost_after = cost;
    write_back();
    return result;
  }

 private:
  void choose_poses() {
    const auto& keyframes = map_.keyframes();
    const std::size_t moved = std::min(params_.keyframes, keyframes.size() - 1);
    first_moved_ = keyframes.size() - moved;
    pose_count_ = static_cast<int>(moved);
    for (const MapKeyframe& keyframe : keyframes) poses_.push_back(keyframe.T_odom_camera);
  }

  [[nodiscard]] int row_of(std::size_t keyframe) const {
    return keyframe < first_moved_ ? kFixed : static_cast<int>(keyframe - first_moved_);
  }

  void collect_points() {
    const auto& keyframes = map_.keyframes();
    std::vector<int> slot;
    for (std::size_t k = first_moved_; k < keyframes.size(); ++k)
      for (const Sighting& sighting : keyframes[k].sightings) {
        if (slot.size() <= sighting.landmark) slot.resize(sighting.landmark + 1, kFixed);
        if (slot[sighting.landmark] != kFixed) continue;
        slot[sighting.landmark] = static_cast<int>(points_.size());
        points_.push_back({sighting.landmark, {}});
      }
    for (std::size_t k = 0; k < keyframes.size(); ++k)
      for (const Sighting& sighting : keyframes[k].sightings)
        if (sighting.landmark < slot.size() && slot[sighting.landmark] != kFixed)
          points_[static_cast<std::size_t>(slot[sighting.landmark])].views.push_back(
              {row_of(k), k, &sighting});
    std::erase_if(points_, [](const Point& p) { return p.views.size() < 2; });
    for (const Point& point : points_) positions_.push_back(map_.landmark(point.landmark).p_odom);
    blocks_.resize(points_.size());
  }

  [[nodiscard]] PointObservation observation(std::size_t point, const View& view) const {
    const Sighting& s = *view.sighting;
    return {positions_[point], Mat3::Zero(), s.pixel, s.pixel_covariance, s.depth_m, s.depth_variance_m2};
  }

  /// Ratio of the squared residuals to the sightings' covariances (median), for scaling the outlier
  /// threshold.
  [[nodiscard]] double residual_variance_scale() const {
    std::vector<double> ratios;
    for (std::size_t i = 0; i < points_.size(); ++i)
      for (const View& view : points_[i].views) {
        const PointObservation seen = observation(i, view);
        if (const auto residual = point_residual(seen, poses_[view.keyframe], camera_))
          ratios.push_back(variance_ratio(*residual, seen));
      }
    return ratios.empty() ? 1 : middle_value(std::span(ratios));
  }

  /// Computes the normal equations at the current poses and points; returns the cost.
  double linearise() {
    const auto n = static_cast<Eigen::Index>(6 * pose_count_);
    H_ = MatX::Zero(n, n);
    g_ = VecX::Zero(n);
    double cost = 0;
    for (std::size_t i = 0; i < points_.size(); ++i) cost += linearise_point(i);
    for (std::size_t k = first_moved_; k < poses_.size(); ++k)
      for (const SurfaceFactor& factor : map_.keyframes()[k].factors) cost += linearise_factor(k, factor);
    return cost;
  }

  double linearise_point(std::size_t i) {
    PointBlock& block = blocks_[i];
    block.V.setZero();
    block.gradient.setZero();
    block.W.assign(points_[i].views.size(), Mat63::Zero());
    double cost = 0;
    for (std::size_t v = 0; v < points_[i].views.size(); ++v) {
      const View& view = points_[i].views[v];
      const auto residual = point_residual(observation(i, view), poses_[view.keyframe], camera_);
      if (!residual) continue;
      const double squared = residual->squared_mahalanobis / variance_scale_;
      cost += variance_scale_ * robust_cost(squared);
      const Mat3 weighted = robust_weight(squared) * residual->information;
      const Mat3 by_point_weighted = residual->by_point.transpose() * weighted;
      block.V.noalias() += by_point_weighted * residual->by_point;
      block.gradient.noalias() += by_point_weighted * residual->value;
      if (view.pose == kFixed) continue;
      const Mat63 by_pose_weighted = residual->by_pose.transpose() * weighted;
      const Eigen::Index row = 6 * view.pose;
      H_.block<6, 6>(row, row).noalias() += by_pose_weighted * residual->by_pose;
      g_.segment<6>(row).noalias() += by_pose_weighted * residual->value;
      block.W[v].noalias() = by_pose_weighted * residual->by_point;
    }
    return cost;
  }

  double linearise_factor(std::size_t key, const SurfaceFactor& factor) {
    std::size_t ref = 0;
    while (ref < poses_.size() && map_.keyframes()[ref].identity != factor.reference) ++ref;
    if (ref == poses_.size()) return 0;
    const SE3 T_ref_key = poses_[ref].inverse() * poses_[key];
    const Vec6 delta = (factor.linearised_at.inverse() * T_ref_key).log();
    const Mat6 information = params_.surface_weight_ratio * factor.information;
    const Vec6 slope = information * delta + params_.surface_weight_ratio * factor.gradient;
    const Eigen::Index key_row = 6 * row_of(key);
    H_.block<6, 6>(key_row, key_row) += information;
    g_.segment<6>(key_row) += slope;
    if (row_of(ref) != kFixed) {
      const Mat6 by_ref = -adjoint(T_ref_key.inverse());
      const Eigen::Index ref_row = 6 * row_of(ref);
      const Mat6 cross = by_ref.transpose() * information;
      H_.block<6, 6>(ref_row, ref_row) += cross * by_ref;
      H_.block<6, 6>(ref_row, key_row) += cross;
      H_.block<6, 6>(key_row, ref_row) += cross.transpose();
      g_.segment<6>(ref_row) += by_ref.transpose() * slope;
    }
    return 0.5 * delta.dot(information * delta) + params_.surface_weight_ratio * factor.gradient.dot(delta);
  }

  /// Solves for a damped step and takes it.
  bool step(double lambda) {
    MatX S = H_;
    VecX rhs = -g_;
    S.diagonal() *= 1 + lambda;
    S.diagonal().array() += 1e-6;
    for (std::size_t i = 0; i < points_.size(); ++i) eliminate(i, lambda, S, rhs);
    const auto [pose_step, is_factorised] = symmetric_solution(S, rhs);
    if (!is_factorised || !pose_step.allFinite() || pose_step.lpNorm<Eigen::Infinity>() > 1) return false;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      Vec3 right = -blocks_[i].gradient;
      for (std::size_t v = 0; v < points_[i].views.size(); ++v)
        if (const int pose = points_[i].views[v].pose; pose != kFixed)
          right.noalias() -= blocks_[i].W[v].transpose() * pose_step.segment<6>(6 * pose);
      positions_[i] += blocks_[i].inverse * right;
    }
    for (std::size_t k = first_moved_; k < poses_.size(); ++k)
      poses_[k] = poses_[k] * SE3::exp(pose_step.segment<6>(6 * row_of(k)));
    return true;
  }

  void eliminate(std::size_t i, double lambda, MatX& S, VecX& rhs) {
    PointBlock& block = blocks_[i];
    Mat3 V = (1 + lambda) * block.V;  // its diagonal alone would depend on the axes of odom
    V.diagonal().array() += 1e-3;
    block.inverse = V.inverse();
    const auto& views = points_[i].views;
    for (std::size_t a = 0; a < views.size(); ++a) {
      if (views[a].pose == kFixed) continue;
      const Mat63 scaled = block.W[a] * block.inverse;
      rhs.segment<6>(6 * views[a].pose).noalias() += scaled * block.gradient;
      for (std::size_t b = 0; b < views.size(); ++b)
        if (views[b].pose != kFixed)
          S.block<6, 6>(6 * views[a].pose, 6 * views[b].pose).noalias() -= scaled * block.W[b].transpose();
    }
  }

  void write_back() {
    auto& keyframes = map_.keyframes();
    for (std::size_t k = first_moved_; k < poses_.size(); ++k) keyframes[k].T_odom_camera = poses_[k];
    for (std::size_t i = 0; i < points_.size(); ++i) {
      MapLandmark& landmark = map_.landmark(points_[i].landmark);
      landmark.p_odom = positions_[i];
      Mat3 V = blocks_[i].V;
      V.diagonal().array() += 1.0;
      landmark.covariance = V.inverse() + Mat3::Identity() * kMinLandmarkSigma_m * kMinLandmarkSigma_m;
    }
  }

  LocalMap& map_;
  const PinholeCamera& camera_;
  const WindowAdjustmentParams& params_;
  std::size_t first_moved_ = 0;
  int pose_count_ = 0;
  double variance_scale_ = 1;
  std::vector<SE3> poses_;
  std::vector<Point> points_;
  std::vector<Vec3> positions_;
  std::vector<PointBlock> blocks_;
  MatX H_;
  VecX g_;
};

}  // namespace

WindowAdjustmentResult adjust_window(LocalMap& map, const PinholeCamera& camera,
                                     const WindowAdjustmentParams& params) {
  if (map.keyframes().size() < 2) return {};
  return Window(map, camera, params).run();
}

}  // namespace hm
