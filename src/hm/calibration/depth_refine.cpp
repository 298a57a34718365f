#include "hm/calibration/depth_refine.hpp"

#include <ceres/ceres.h>
#include <ceres/normal_prior.h>
#include <algorithm>
#include <cmath>

#include "hm/calibration/board_motion.hpp"
#include "hm/calibration/least_squares_inl.hpp"
#include "hm/calibration/spline_fit.hpp"
#include "hm/depth_camera/spline_basis.hpp"

namespace hm {
namespace {

using detail::Intrinsics;
using detail::Motion;

constexpr int kRefineBlock_px = 16;  // depth is averaged over such squares
constexpr double kCorner_px = 0.1;   // standard deviation of a corner
constexpr double kHuber = 3;         // deviations
constexpr double kLargestCorrection_m = 0.3;
constexpr int kMostRefineIterations = 30;

/// Corrected depth of a block minus that of the board's plane, normalised by its standard deviation.
/// Parameter blocks: T_color_board, T_depth_color, intrinsics of the depth camera, 16 control points.
struct BoardDepth {
  Vec2 pixel;
  double measured_m, sigma_m, s;
  int terms;
  std::array<double, 16> weights;
  template <class T>
  bool operator()(T const* const* blocks, T* residual) const {
    const T up[3] = {T(0), T(0), T(1)}, zero[3] = {T(0), T(0), T(0)};
    T normal_color[3], normal[3], origin_color[3], origin[3];
    detail::turn(blocks[0], up, normal_color);
    detail::turn(blocks[1], normal_color, normal);
    detail::move(blocks[0], zero, origin_color);
    detail::move(blocks[1], origin_color, origin);
    const T* k = blocks[2];
    const T ray_x = (pixel.x() - k[2]) / k[0], ray_y = (pixel.y() - k[3]) / k[1];
    const T z = (normal[0] * origin[0] + normal[1] * origin[1] + normal[2] * origin[2]) /
                (normal[0] * ray_x + normal[1] * ray_y + normal[2]);
    T corrected = T(measured_m);
    for (std::size_t i = 0; i < 16; ++i) {
      double power = weights[i];
      for (int term = 0; term < terms; ++term, power *= s) corrected += power * blocks[3 + i][term];
    }
    residual[0] = (corrected - z) / sigma_m;
    return true;
  }
};

/// Prior on a weighted sum of control points, for every term: expected to be 0.
class ControlPrior final : public ceres::CostFunction {
 public:
  ControlPrior(std::vector<double> weights, int terms) : weights_(std::move(weights)) {
    set_num_residuals(terms);
    for (std::size_t i = 0; i < weights_.size(); ++i) mutable_parameter_block_sizes()->push_back(terms);
  }
  bool Evaluate(double const* const* blocks, double* residuals, double** jacobians) const override {
    const int terms = num_residuals();
    for (int k = 0; k < terms; ++k) {
      residuals[k] = 0;
      for (std::size_t i = 0; i < weights_.size(); ++i) residuals[k] += weights_[i] * blocks[i][k];
    }
    for (std::size_t i = 0; jacobians != nullptr && i < weights_.size(); ++i) {
      if (jacobians[i] == nullptr) continue;
      for (int j = 0; j < terms * terms; ++j) jacobians[i][j] = j / terms == j % terms ? weights_[i] : 0.0;
    }
    return true;
  }

 private:
  std::vector<double> weights_;
};

/// Least-squares problem and its state.
class Adjustment {
 public:
  Adjustment(std::span<const DepthPose> poses, const BoardParams& board, const DepthGeometry& start,
             const DepthCorrectionModel& model)
      : board_(board), start_(start), model_(model) {
    motion_ = detail::to_motion(start.T_color_depth.inverse());
    depth_ = detail::intrinsics_of(start.depth_camera);
    color_ = detail::intrinsics_of(start.color_camera);
    const auto plane = static_cast<std::size_t>(model.columns * model.rows);
    const auto terms = static_cast<std::size_t>(model.terms);
    points_.resize(plane * terms);
    for (std::size_t k = 0; k < terms; ++k)
      for (std::size_t i = 0; i < plane; ++i)
        points_[i * terms + k] = static_cast<double>(model.coefficients[k * plane + i]);
    for (const DepthPose& pose : poses) boards_.push_back(detail::to_motion(pose.T_color_board));
    for (std::size_t i = 0; i < poses.size(); ++i) {
      add_corners(poses[i], boards_[i]);
      add_depth(poses[i], boards_[i]);
    }
  }
  void add_priors(const DepthFitParams& params);
  Result<DepthRefinement> solve();

 private:
  double* point(int column, int row) {
    return points_.data() + static_cast<std::ptrdiff_t>(row * model_.columns + column) * model_.terms;
  }
  void add_corners(const DepthPose& pose, Motion& board);
  void add_depth(const DepthPose& pose, Motion& board);
  void add_camera_prior(double* block, int size, std::span<const double> sigmas);
  double rms(const std::vector<ceres::ResidualBlockId>& residuals);

  const BoardParams& board_;
  const DepthGeometry& start_;
  const DepthCorrectionModel& model_;
  Motion motion_{};  ///< T_depth_color
  Intrinsics depth_{}, color_{};
  std::vector<Motion> boards_;
  std::vector<double> points_;  ///< [control point][term]
  ceres::Problem problem_;
  std::vector<ceres::ResidualBlockId> corners_, depths_;
};

void Adjustment::add_corners(const DepthPose& pose, Motion& board) {
  for (std::size_t i = 0; i < pose.view.size(); ++i)
    corners_.push_back(problem_.AddResidualBlock(
        new ceres::AutoDiffCostFunction<detail::CornerInCamera, 2, 6, 4>(
            new detail::CornerInCamera{corner_on_board(board_, pose.view.corners[i]), pose.view.pixels[i],
                                       start_.color_camera.distortion, kCorner_px}),
        new ceres::HuberLoss(kHuber), board.data(), color_.data()));
}

void Adjustment::add_depth(const DepthPose& pose, Motion& board) {
  for (const detail::BlockMean& mean : detail::block_means(pose.depth, kRefineBlock_px)) {
    const auto u = detail::spline_place(mean.pixel.x(), model_.width, model_.columns);
    const auto v = detail::spline_place(mean.pixel.y(), model_.height, model_.rows);
    const auto across = detail::spline_weights(u.t), down = detail::spline_weights(v.t);
    const double s = std::clamp((2 * mean.measured_m - model_.min_depth_m - model_.max_depth_m) /
                                    (model_.max_depth_m - model_.min_depth_m),
                                -1.0, 1.0);
    auto* residual = new BoardDepth{mean.pixel, mean.measured_m, mean.sigma_m, s, model_.terms, {}};
    std::vector<double*> blocks{board.data(), motion_.data(), depth_.data()};
    for (std::size_t i = 0; i < 16; ++i) {
      residual->weights[i] = across[i % 4] * down[i / 4];
      blocks.push_back(point(u.span + static_cast<int>(i % 4), v.span + static_cast<int>(i / 4)));
    }
    auto* cost = new ceres::DynamicAutoDiffCostFunction<BoardDepth, 8>(residual);
    for (const int size : {6, 6, 4}) cost->AddParameterBlock(size);
    for (int i = 0; i < 16; ++i) cost->AddParameterBlock(model_.terms);
    cost->SetNumResiduals(1);
    depths_.push_back(problem_.AddResidualBlock(cost, new ceres::HuberLoss(kHuber), blocks));
  }
}

void Adjustment::add_camera_prior(double* block, int size, std::span<const double> sigmas) {
  ceres::Matrix weights = ceres::Matrix::Zero(size, size);
  for (int i = 0; i < size; ++i) weights(i, i) = 1 / sigmas[static_cast<std::size_t>(i)];
  problem_.AddResidualBlock(
      new ceres::NormalPrior(weights, ceres::Vector(Eigen::Map<const Eigen::VectorXd>(block, size))), nullptr,
      block);
}

/// Priors: the cameras stay near their calibration; control points as in the fit of the spline alone.
void Adjustment::add_priors(const DepthFitParams& params) {
  const double px = params.prior_intrinsics_px, r = params.prior_rotation_rad, t = params.prior_translation_m;
  const std::array<double, 4> of_camera{px, px, px, px};
  const std::array<double, 6> of_motion{r, r, r, t, t, t};
  add_camera_prior(depth_.data(), 4, of_camera);
  add_camera_prior(color_.data(), 4, of_camera);
  add_camera_prior(motion_.data(), 6, of_motion);
  const double smooth = 1 / params.smoothness_m, size = 1 / kLargestCorrection_m;
  const auto add = [&](std::vector<double> weights, const std::vector<double*>& blocks) {
    problem_.AddResidualBlock(new ControlPrior(std::move(weights), model_.terms), nullptr, blocks);
  };
  for (int j = 0; j < model_.rows; ++j)
    for (int i = 0; i < model_.columns; ++i) {
      add({size}, {point(i, j)});
      const std::vector<double> straight{smooth, -2 * smooth, smooth};
      if (i + 2 < model_.columns) add(straight, {point(i, j), point(i + 1, j), point(i + 2, j)});
      if (j + 2 < model_.rows) add(straight, {point(i, j), point(i, j + 1), point(i, j + 2)});
    }
}

double Adjustment::rms(const std::vector<ceres::ResidualBlockId>& residuals) {
  const std::vector<double> values = detail::residuals_of(problem_, residuals);
  double sum = 0;
  for (const double value : values) sum += value * value;
  return values.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(values.size()));
}

Result<DepthRefinement> Adjustment::solve() {
  DepthRefinement refined;
  refined.corners_before = rms(corners_), refined.depth_before = rms(depths_);
  const ceres::Solver::Options options =
      detail::solver_options(ceres::SPARSE_NORMAL_CHOLESKY, kMostRefineIterations);
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem_, &summary);
  refined.geometry = start_;
  refined.geometry.T_color_depth = detail::to_se3(motion_).inverse();
  detail::set_intrinsics(refined.geometry.depth_camera, depth_);
  detail::set_intrinsics(refined.geometry.color_camera, color_);
  if (!summary.IsSolutionUsable() || !is_rigid(refined.geometry.T_color_depth) ||
      !check_camera(refined.geometry.depth_camera) || !check_camera(refined.geometry.color_camera))
    return fail(ErrorCode::kInvalidValue, "", "the poses leave the cameras undetermined");
  refined.corners_after = rms(corners_), refined.depth_after = rms(depths_);
  return refined;
}

}  // namespace

Result<DepthRefinement> refine_geometry(std::span<const DepthPose> poses, const BoardParams& board,
                                        const DepthGeometry& start, const DepthCorrectionModel& model,
                                        const DepthFitParams& params) {
  if (model.mode != DepthFitMode::kSpline)
    return fail(ErrorCode::kUsage, "depth_fit.refine", "cameras are adjusted with `mode = \"spline\"` only");
  Adjustment adjustment(poses, board, start, model);
  adjustment.add_priors(params);
  return adjustment.solve();
}

}  // namespace hm
