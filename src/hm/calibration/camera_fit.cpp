#include "hm/calibration/camera_fit.hpp"

#include <algorithm>
#include <bitset>
#include <cmath>

#include <opencv2/calib3d.hpp>

#include "hm/core/angle.hpp"
#include "hm/core/statistics.hpp"

namespace hm {
namespace {

constexpr int kCellsX = 12, kCellsY = 9;

struct PointSets {
  std::vector<std::vector<cv::Point3f>> board;
  std::vector<std::vector<cv::Point2f>> pixels;
};

void add_view(PointSets& sets, const BoardView& view, const BoardParams& board) {
  std::vector<cv::Point3f> points;
  std::vector<cv::Point2f> pixels;
  for (std::size_t i = 0; i < view.size(); ++i) {
    const Vec3 p = corner_on_board(board, view.corners[i]);
    points.emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()), 0.0F);
    pixels.emplace_back(static_cast<float>(view.pixels[i].x()), static_cast<float>(view.pixels[i].y()));
  }
  sets.board.push_back(std::move(points));
  sets.pixels.push_back(std::move(pixels));
}

cv::Mat matrix_of(const PinholeCamera& c) {
  return (cv::Mat_<double>(3, 3) << c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1);
}

cv::Mat distortion_of(const PinholeCamera& c) {
  const LensDistortion& d = c.distortion;
  return (cv::Mat_<double>(1, 5) << d.k1, d.k2, d.p1, d.p2, d.k3);
}

SE3 pose_of(const cv::Mat& rotation, const cv::Mat& translation) {
  const auto vector = [](const cv::Mat& m) {
    return Vec3(m.at<double>(0), m.at<double>(1), m.at<double>(2));
  };
  return {so3_exp(vector(rotation)), vector(translation)};
}

/// Raw result of one calibration by OpenCV.
struct RawFit {
  PinholeCamera camera;
  std::array<double, 9> sigma{};
  std::vector<SE3> poses;
};

RawFit calibrate(const PointSets& sets, int width, int height, const CameraFitParams& params) {
  cv::Mat matrix, distortion;
  std::vector<cv::Mat> rotations, translations;
  cv::Mat sigma, sigma_of_poses, errors;
  int flags = 0;
  if (!params.fit_k3) flags |= cv::CALIB_FIX_K3;
  if (!params.fit_tangential) flags |= cv::CALIB_ZERO_TANGENT_DIST;
  cv::calibrateCamera(sets.board, sets.pixels, cv::Size(width, height), matrix, distortion, rotations,
                      translations, sigma, sigma_of_poses, errors, flags,
                      cv::TermCriteria(cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 100, 1e-9));
  RawFit fit;
  const auto d = [&](int i) { return distortion.at<double>(i); };
  fit.camera = {width,
                height,
                matrix.at<double>(0, 0),
                matrix.at<double>(1, 1),
                matrix.at<double>(0, 2),
                matrix.at<double>(1, 2),
                {d(0), d(1), d(2), d(3), d(4)}};
  for (int i = 0; i < 9; ++i) fit.sigma[static_cast<std::size_t>(i)] = sigma.at<double>(i);
  for (std::size_t i = 0; i < rotations.size(); ++i)
    fit.poses.push_back(pose_of(rotations[i], translations[i]));
  return fit;
}

ViewFit judge(const BoardView& view, const BoardParams& board, const PinholeCamera& camera,
              const SE3& T_camera_board) {
  ViewFit fit;
  fit.T_camera_board = T_camera_board;
  fit.corners = corner_residuals(view, board, camera, T_camera_board);
  fit.rms_px = rms_px(fit.corners);
  const int last = board.corners_x * board.corners_y - 1;
  const Vec3 middle = T_camera_board * Vec3(0.5 * corner_on_board(board, last));
  fit.distance_m = middle.norm();
  const double cosine = std::abs(T_camera_board.rotation().col(2).dot(middle)) / fit.distance_m;
  fit.tilt_rad = std::acos(std::min(1.0, cosine));
  return fit;
}

double coverage(std::span<const ViewFit> views, int width, int height) {
  std::bitset<kCellsX * kCellsY> seen;
  for (const ViewFit& view : views)
    for (const CornerResidual& corner : view.corners) {
      const int x = std::clamp(static_cast<int>((corner.pixel.x() + 0.5) / width * kCellsX), 0, kCellsX - 1);
      const int y = std::clamp(static_cast<int>((corner.pixel.y() + 0.5) / height * kCellsY), 0, kCellsY - 1);
      if (!view.is_outlier) seen.set(static_cast<std::size_t>(y * kCellsX + x));
    }
  return static_cast<double>(seen.count()) / static_cast<double>(seen.size());
}

void warn(CameraFit& fit) {
  std::vector<double> tilts;
  for (const ViewFit& view : fit.views)
    if (!view.is_outlier) tilts.push_back(view.tilt_rad);
  auto& warnings = fit.warnings;
  if (tilts.size() < 10) warnings.push_back(fmt::format("only {} images: take 15 to 30", tilts.size()));
  if (fit.covered_ratio < 0.6)
    warnings.push_back(
        fmt::format("the boards cover {:.0f} % of the image: show the board in the corners and along "
                    "the edges too, there the lens distorts most",
                    100 * fit.covered_ratio));
  const auto tilted = std::ranges::count_if(tilts, [](double tilt) { return tilt > 15 * kRadiansPerDegree; });
  if (tilted * 3 < static_cast<std::ptrdiff_t>(tilts.size()) || tilted < 4)
    warnings.push_back(
        fmt::format("the board is tilted by more than 15 degrees in {} of {} images only: without "
                    "tilt the focal length and the distance cannot be told apart",
                    tilted, tilts.size()));
  if (fit.sigma[0] > 0.005 * fit.camera.fx || fit.sigma[1] > 0.005 * std::abs(fit.camera.fy))
    warnings.push_back(
        fmt::format("the focal lengths are known to {:.1f} and {:.1f} px only", fit.sigma[0], fit.sigma[1]));
  if (std::max(fit.sigma[2], fit.sigma[3]) > 0.005 * fit.camera.width)
    warnings.push_back(
        fmt::format("the principal point is known to {:.1f} and {:.1f} px only", fit.sigma[2], fit.sigma[3]));
  if (fit.rms_px > 1.0)
    warnings.push_back(
        fmt::format("a reprojection error of {:.2f} px is much: blurred images, a board that is not "
                    "flat, or the wrong board size",
                    fit.rms_px));
}

}  // namespace

std::vector<CornerResidual> corner_residuals(const BoardView& view, const BoardParams& board,
                                             const PinholeCamera& camera, const SE3& T_camera_board) {
  std::vector<CornerResidual> corners;
  for (std::size_t i = 0; i < view.size(); ++i) {
    const Vec2 seen = camera.project(T_camera_board * corner_on_board(board, view.corners[i]));
    corners.push_back({view.pixels[i], view.pixels[i] - seen});
  }
  return corners;
}

double rms_px(std::span<const CornerResidual> corners) {
  double sum = 0;
  for (const CornerResidual& corner : corners) sum += corner.error_px.squaredNorm();
  return corners.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(corners.size()));
}

std::optional<SE3> board_pose(const BoardView& view, const BoardParams& board, const PinholeCamera& camera) {
  if (view.size() < 4) return std::nullopt;
  PointSets sets;
  add_view(sets, view, board);
  cv::Mat rotation, translation;
  try {
    if (!cv::solvePnP(sets.board[0], sets.pixels[0], matrix_of(camera), distortion_of(camera), rotation,
                      translation, false, cv::SOLVEPNP_IPPE))
      return std::nullopt;
    cv::solvePnPRefineLM(sets.board[0], sets.pixels[0], matrix_of(camera), distortion_of(camera), rotation,
                         translation);
  } catch (const cv::Exception&) {
    return std::nullopt;  // corners on one line
  }
  const SE3 pose = pose_of(rotation, translation);
  if (!is_rigid(pose) || pose.translation().z() <= 0) return std::nullopt;
  return pose;
}

namespace {

/// The camera that fits the views `used`, and how well it fits every view.
Result<CameraFit> fit_views(std::span<const BoardView> views, std::span<const std::size_t> used,
                            const BoardParams& board, int width, int height, const CameraFitParams& params) {
  PointSets sets;
  for (const std::size_t i : used) add_view(sets, views[i], board);
  RawFit raw;
  try {
    raw = calibrate(sets, width, height, params);
  } catch (const cv::Exception& error) {
    return fail(ErrorCode::kInvalidValue, "", "the images leave the camera undetermined ({})", error.err);
  }
  if (const auto checked = check_camera(raw.camera); !checked)
    return fail(ErrorCode::kInvalidValue, "", "the images leave the camera undetermined ({})",
                checked.error().message);
  CameraFit fit;
  fit.camera = raw.camera;
  fit.sigma = raw.sigma;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const auto place = std::ranges::find(used, i);
    const bool is_used = place != used.end();
    const auto pose = is_used ? std::optional(raw.poses[static_cast<std::size_t>(place - used.begin())])
                              : board_pose(views[i], board, raw.camera);
    fit.views.push_back(pose ? judge(views[i], board, raw.camera, *pose) : ViewFit{});
    fit.views.back().is_outlier = !is_used;
  }
  return fit;
}

/// Over all corners of the views that the fit used.
double rms_px(const CameraFit& fit) {
  double sum = 0;
  std::size_t count = 0;
  for (const ViewFit& view : fit.views) {
    if (view.is_outlier) continue;
    sum += view.rms_px * view.rms_px * static_cast<double>(view.corners.size());
    count += view.corners.size();
  }
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, count)));
}

}  // namespace

Result<CameraFit> fit_camera(std::span<const BoardView> views, const BoardParams& board, int width,
                             int height, const CameraFitParams& params) {
  constexpr std::size_t kFewestViews = 3;
  std::vector<std::size_t> used;
  for (std::size_t i = 0; i < views.size(); ++i)
    if (views[i].size() >= 6) used.push_back(i);
  if (used.size() < kFewestViews)
    return fail(ErrorCode::kInvalidValue, "",
                "the board was found in {} images; {} are needed at least, 15 to 30 wanted", used.size(),
                kFewestViews);
  auto fit = fit_views(views, used, board, width, height, params);
  if (!fit) return fit;
  // Excludes blurred or misdetected boards once, and refits.
  std::vector<double> errors;
  for (const std::size_t i : used) errors.push_back(fit->views[i].rms_px);
  const double limit = std::max(params.outlier_ratio * quantile(errors, 0.5), 0.2);
  const auto left_out = std::erase_if(used, [&](std::size_t i) { return fit->views[i].rms_px > limit; });
  if (left_out > 0 && used.size() >= kFewestViews) {
    fit = fit_views(views, used, board, width, height, params);
    if (!fit) return fit;
  }
  fit->rms_px = rms_px(*fit);
  fit->covered_ratio = coverage(fit->views, width, height);
  warn(*fit);
  return fit;
}

}  // namespace hm
