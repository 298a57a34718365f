#include "hm/calibration/stereo_problem.hpp"
#include "hm/calibration/least_squares_inl.hpp"

#include <ceres/ceres.h>
#include <Eigen/Cholesky>

#include "hm/calibration/board_motion.hpp"

namespace hm::detail {
namespace {

struct DepthCorner {
  Vec3 point;
  Vec2 seen;
  LensDistortion distortion;
  /// `motion` is T_depth_color.
  template <class T>
  bool operator()(const T* board, const T* motion, const T* intrinsics, T* residual) const {
    const T on_board[3] = {T(point.x()), T(point.y()), T(point.z())};
    T p_color[3], p[3];
    move(board, on_board, p_color);
    move(motion, p_color, p);
    residual_px(intrinsics, distortion, seen, p, residual);
    return true;
  }
};

struct Blocks {
  Motion motion{};  ///< T_depth_color
  Intrinsics depth{}, color{};
  std::vector<Motion> boards;
};

void add_view(ceres::Problem& problem, const StereoView& from, const BoardParams& board,
              const StereoState& state, Blocks& blocks) {
  for (std::size_t i = 0; i < from.view->size(); ++i) {
    const Vec3 point = corner_on_board(board, from.view->corners[i]);
    auto* loss = new ceres::HuberLoss(1.0);
    double* pose = blocks.boards[from.board].data();
    if (from.in_depth_camera) {
      problem.AddResidualBlock(new ceres::AutoDiffCostFunction<DepthCorner, 2, 6, 6, 4>(new DepthCorner{
                                   point, from.view->pixels[i], state.depth_camera.distortion}),
                               loss, pose, blocks.motion.data(), blocks.depth.data());
    } else {
      problem.AddResidualBlock(new ceres::AutoDiffCostFunction<CornerInCamera, 2, 6, 4>(new CornerInCamera{
                                   point, from.view->pixels[i], state.color_camera.distortion}),
                               loss, pose, blocks.color.data());
    }
  }
}

/// Standard deviations of T_depth_color's six parameters, from the Jacobian at the solution.
std::optional<Vec6> deviations(ceres::Problem& problem, Blocks& blocks, double variance_px2) {
  std::vector<double*> order{blocks.motion.data()};
  for (Motion& board : blocks.boards) order.push_back(board.data());
  for (Intrinsics* block : {&blocks.depth, &blocks.color})
    if (problem.HasParameterBlock(block->data()) && !problem.IsParameterBlockConstant(block->data()))
      order.push_back(block->data());
  std::erase_if(order, [&](double* block) { return !problem.HasParameterBlock(block); });
  ceres::Problem::EvaluateOptions options;
  options.parameter_blocks = order;
  ceres::CRSMatrix jacobian;
  problem.Evaluate(options, nullptr, nullptr, nullptr, &jacobian);
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(jacobian.num_cols, jacobian.num_cols);
  for (int row = 0; row < jacobian.num_rows; ++row) {
    const auto begin = static_cast<std::size_t>(jacobian.rows[static_cast<std::size_t>(row)]);
    const auto end = static_cast<std::size_t>(jacobian.rows[static_cast<std::size_t>(row) + 1]);
    for (std::size_t a = begin; a < end; ++a)
      for (std::size_t b = begin; b < end; ++b)
        information(jacobian.cols[a], jacobian.cols[b]) += jacobian.values[a] * jacobian.values[b];
  }
  const Eigen::LDLT<Eigen::MatrixXd> factors(information);
  if (factors.info() != Eigen::Success || factors.vectorD().minCoeff() <= 0) return std::nullopt;
  Vec6 sigma;
  for (int i = 0; i < 6; ++i) {
    const double variance = factors.solve(Eigen::VectorXd::Unit(information.rows(), i))(i) * variance_px2;
    if (!(variance > 0)) return std::nullopt;
    sigma[i] = std::sqrt(variance);
  }
  return sigma;
}

}  // namespace

StereoSolution solve_stereo(std::span<const StereoView> views, const BoardParams& board, bool with_intrinsics,
                            StereoState& state) {
  Blocks blocks;
  blocks.motion = to_motion(state.T_color_depth.inverse());
  blocks.depth = intrinsics_of(state.depth_camera);
  blocks.color = intrinsics_of(state.color_camera);
  for (const SE3& T : state.T_color_board) blocks.boards.push_back(to_motion(T));
  ceres::Problem problem;
  for (const StereoView& view : views) add_view(problem, view, board, state, blocks);
  for (Intrinsics* block : {&blocks.depth, &blocks.color})
    if (!with_intrinsics && problem.HasParameterBlock(block->data()))
      problem.SetParameterBlockConstant(block->data());
  ceres::Solver::Options options = solver_options(ceres::DENSE_SCHUR, 100);
  options.function_tolerance = options.parameter_tolerance = 1e-12;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  StereoSolution solution;
  solution.converged = summary.IsSolutionUsable();
  solution.rms_px = std::sqrt(2 * summary.final_cost / std::max(1, summary.num_residuals / 2));
  state.T_color_depth = to_se3(blocks.motion).inverse();
  for (std::size_t i = 0; i < blocks.boards.size(); ++i) state.T_color_board[i] = to_se3(blocks.boards[i]);
  set_intrinsics(state.depth_camera, blocks.depth);
  set_intrinsics(state.color_camera, blocks.color);
  if (!solution.converged) return solution;
  const auto sigma = deviations(problem, blocks, 0.5 * solution.rms_px * solution.rms_px);
  if (!sigma) {
    solution.converged = false;
    return solution;
  }
  solution.rotation_sigma_rad = sigma->head<3>();
  solution.translation_sigma_m = sigma->tail<3>();
  return solution;
}

}  // namespace hm::detail
