#include "hm/calibration/stereo_fit.hpp"

#include <algorithm>
#include <cmath>

#include "hm/calibration/stereo_problem.hpp"
#include "hm/core/statistics.hpp"

namespace hm {
namespace {

/// Pair of consistently numbered views with initial board poses.
struct UsablePair {
  std::size_t index = 0;  ///< index in the input
  BoardView depth_view, color_view;
  SE3 T_depth_board, T_color_board;
};

/// True when the corners run in the opposite direction in the second image, so that it was numbered from the
/// other end (both cameras look the same way).
bool runs_backwards(const BoardView& a, const BoardView& b) {
  return (a.pixels.back() - a.pixels.front()).dot(b.pixels.back() - b.pixels.front()) < 0;
}

std::vector<UsablePair> usable_pairs(std::span<const BoardPair> pairs, const BoardParams& board,
                                     const PinholeCamera& depth_camera, const PinholeCamera& color_camera) {
  std::vector<UsablePair> usable;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    UsablePair pair;
    pair.index = i;
    pair.depth_view = pairs[i].depth_camera;
    pair.color_view = pairs[i].color_camera;
    if (pair.depth_view.size() < 6 || pair.color_view.size() < 6) continue;
    if (board.kind == BoardKind::kCheckerboard && runs_backwards(pair.depth_view, pair.color_view))
      pair.color_view = turned_by_half(pair.color_view, board);
    const auto in_depth = board_pose(pair.depth_view, board, depth_camera);
    const auto in_color = board_pose(pair.color_view, board, color_camera);
    if (!in_depth || !in_color) continue;
    pair.T_depth_board = *in_depth;
    pair.T_color_board = *in_color;
    usable.push_back(std::move(pair));
  }
  return usable;
}

/// Initial transform: that of the pair closest to all others (medoid).
SE3 middle_motion(const std::vector<UsablePair>& pairs) {
  std::vector<SE3> motions;
  for (const UsablePair& pair : pairs) motions.push_back(pair.T_color_board * pair.T_depth_board.inverse());
  const auto distance = [&](const SE3& a) {
    double sum = 0;
    for (const SE3& b : motions) sum += (a.inverse() * b).log().norm();
    return sum;
  };
  return *std::ranges::min_element(motions, {}, distance);
}

detail::StereoSolution solve(const std::vector<UsablePair>& pairs, const BoardParams& board,
                             bool with_intrinsics, detail::StereoState& state) {
  std::vector<detail::StereoView> views;
  state.T_color_board.clear();
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    views.push_back({&pairs[i].depth_view, true, i});
    views.push_back({&pairs[i].color_view, false, i});
    state.T_color_board.push_back(pairs[i].T_color_board);
  }
  return detail::solve_stereo(views, board, with_intrinsics, state);
}

PairFit judge(const UsablePair& pair, const BoardParams& board, const detail::StereoState& state,
              const SE3& T_color_board) {
  PairFit fit;
  fit.T_color_board = T_color_board;
  fit.color_corners = corner_residuals(pair.color_view, board, state.color_camera, T_color_board);
  fit.depth_corners = corner_residuals(pair.depth_view, board, state.depth_camera,
                                       state.T_color_depth.inverse() * T_color_board);
  fit.color_rms_px = rms_px(fit.color_corners), fit.depth_rms_px = rms_px(fit.depth_corners);
  return fit;
}

void warn(StereoFit& fit, std::size_t used) {
  if (used < 5) fit.warnings.push_back(fmt::format("only {} pairs of images: take 10 to 20", used));
  if (fit.rms_px > 1.0)
    fit.warnings.push_back(
        fmt::format("a reprojection error of {:.2f} px is much: did the board move between the two "
                    "images, or do the intrinsics belong to another camera?",
                    fit.rms_px));
  if (fit.translation_sigma_m.maxCoeff() > 0.002)
    fit.warnings.push_back(
        fmt::format("the distance between the cameras is known to {:.1f} mm only: hold the board "
                    "nearer, and tilt it",
                    1e3 * fit.translation_sigma_m.maxCoeff()));
}

}  // namespace

Result<StereoFit> fit_stereo(std::span<const BoardPair> pairs, const BoardParams& board,
                             const PinholeCamera& depth_camera, const PinholeCamera& color_camera,
                             const StereoFitParams& params) {
  std::vector<UsablePair> usable = usable_pairs(pairs, board, depth_camera, color_camera);
  if (usable.empty())
    return fail(ErrorCode::kInvalidValue, "", "in none of {} pairs both cameras see the board", pairs.size());
  const bool with_intrinsics = params.refine == StereoRefine::kIntrinsicsToo;
  detail::StereoState state{middle_motion(usable), depth_camera, color_camera, {}};
  detail::StereoSolution solution = solve(usable, board, with_intrinsics, state);
  StereoFit fit;
  fit.pairs.resize(pairs.size());
  for (PairFit& pair : fit.pairs) pair.is_outlier = true;
  const auto judge_all = [&] {
    std::vector<double> errors;
    for (std::size_t i = 0; i < usable.size(); ++i) {
      PairFit& pair = fit.pairs[usable[i].index];
      pair = judge(usable[i], board, state, state.T_color_board[i]);
      errors.push_back(std::max(pair.depth_rms_px, pair.color_rms_px));
    }
    return errors;
  };
  const double limit = std::max(params.outlier_ratio * quantile(judge_all(), 0.5), 0.3);
  const auto is_off = [&](const UsablePair& pair) {
    const PairFit& of = fit.pairs[pair.index];
    return std::max(of.depth_rms_px, of.color_rms_px) > limit;
  };
  for (const UsablePair& pair : usable) fit.pairs[pair.index].is_outlier = is_off(pair);
  if (std::erase_if(usable, is_off) > 0) {
    solution = solve(usable, board, with_intrinsics, state);
    judge_all();
  }
  if (!solution.converged || !is_rigid(state.T_color_depth))
    return fail(ErrorCode::kInvalidValue, "", "{} pairs leave the motion between the cameras undetermined",
                usable.size());
  fit.T_color_depth = state.T_color_depth;
  fit.depth_camera = state.depth_camera, fit.color_camera = state.color_camera;
  fit.rotation_sigma_rad = solution.rotation_sigma_rad;
  fit.translation_sigma_m = solution.translation_sigma_m;
  fit.rms_px = solution.rms_px;
  warn(fit, usable.size());
  return fit;
}

}  // namespace hm
