#include "hm/calibration/disparity_fit.hpp"

#include <ceres/ceres.h>
#include <ceres/normal_prior.h>
#include <cmath>

#include "hm/calibration/board_motion.hpp"
#include "hm/calibration/least_squares_inl.hpp"
#include "hm/calibration/spline_fit.hpp"

namespace hm {
namespace {

using detail::Intrinsics;
using detail::Motion;

constexpr int kDisparityBlock_px = 16;  // disparity is averaged over such squares
constexpr double kDistortion = 0.5;     // units: error of disparity over the image
constexpr double kCauchy = 2;           // deviations: hands, edges of the board
constexpr int kMostIterations = 100;
constexpr double kSquare_ratio = 0.003;    // of focal lengths, between fx and fy
constexpr double kInfinity_prior = 40;     // units: disparity of what is infinitely far away
constexpr double kGain_prior_ratio = 0.1;  // of disparity by inverse depth

/// Disparity by inverse depth: d = line[0] + line[1] / z.
using Line = std::array<double, 2>;

Line to_line(const DisparityModel& m) { return {-m.offset_per_m / m.slope_per_m, 1 / m.slope_per_m}; }
DisparityModel to_model(const Line& line) { return {-line[0] / line[1], 1 / line[1]}; }

/// Predicted disparity of a board's plane minus the reading, normalised by its standard deviation. Blocks:
/// T_depth_color, intrinsics, line.
struct PlaneDisparity {
  Vec2 pixel;
  double disparity, sigma;
  Vec3 normal_color, origin_color;  ///< of the plane, in the colour camera
  template <class T>
  bool operator()(const T* motion, const T* k, const T* line, T* residual) const {
    const T n_color[3] = {T(normal_color.x()), T(normal_color.y()), T(normal_color.z())};
    const T o_color[3] = {T(origin_color.x()), T(origin_color.y()), T(origin_color.z())};
    T n[3], o[3];
    detail::turn(motion, n_color, n);
    detail::move(motion, o_color, o);
    const T ray_x = (pixel.x() - k[2]) / k[0], ray_y = (pixel.y() - k[3]) / k[1];
    const T inverse_depth = (n[0] * ray_x + n[1] * ray_y + n[2]) / (n[0] * o[0] + n[1] * o[1] + n[2] * o[2]);
    residual[0] = (line[0] + line[1] * inverse_depth - disparity) / sigma;
    return true;
  }
};

/// Least-squares problem and its state.
class Fit {
 public:
  Fit(std::span<const DepthPose> poses, const DisparityCamera& start)
      : start_(start),
        motion_(detail::to_motion(start.T_color_depth.inverse())),
        intrinsics_(detail::intrinsics_of(start.camera)),
        line_(to_line(start.disparity)) {
    for (const DepthPose& pose : poses) add_board(pose);
  }
  void add_priors(const DisparityPrior& prior);
  Result<DisparityFit> solve();

 private:
  void add_board(const DepthPose& pose);
  void add_prior(std::span<double> block, std::span<const double> sigmas);
  [[nodiscard]] double rms();
  bool add_deviations(DisparityFit& fit);

  const DisparityCamera& start_;
  Motion motion_;  ///< T_depth_color
  Intrinsics intrinsics_;
  Line line_;
  ceres::Problem problem_;
  std::vector<ceres::ResidualBlockId> readings_;
  std::vector<double> sigmas_;  ///< of readings_, units
};

void Fit::add_board(const DepthPose& pose) {
  for (const detail::BlockMean& mean : detail::block_means(pose.depth, kDisparityBlock_px)) {
    const double z = mean.measured_m, noise = mean.sigma_m / (z * z * std::abs(start_.disparity.slope_per_m));
    sigmas_.push_back(std::hypot(noise, kDistortion));
    readings_.push_back(problem_.AddResidualBlock(
        new ceres::AutoDiffCostFunction<PlaneDisparity, 1, 6, 4, 2>(
            new PlaneDisparity{mean.pixel, start_.disparity.disparity(z), sigmas_.back(),
                               pose.T_color_board.rotation().col(2), pose.T_color_board.translation()}),
        new ceres::CauchyLoss(kCauchy), motion_.data(), intrinsics_.data(), line_.data()));
  }
}

void Fit::add_prior(std::span<double> block, std::span<const double> sigmas) {
  const auto size = static_cast<Eigen::Index>(block.size());
  ceres::Matrix weights = ceres::Matrix::Zero(size, size);
  for (Eigen::Index i = 0; i < size; ++i) weights(i, i) = 1 / sigmas[static_cast<std::size_t>(i)];
  const ceres::Vector mean = Eigen::Map<const Eigen::VectorXd>(block.data(), size);
  problem_.AddResidualBlock(new ceres::NormalPrior(weights, mean), nullptr, block.data());
}

void Fit::add_priors(const DisparityPrior& prior) {
  const double r = prior.rotation_rad, t = prior.translation_m;
  const std::array<double, 6> of_motion{r, r, r, t, t, t};
  const std::array<double, 4> of_camera{prior.focal_px, prior.focal_px, prior.centre_px, prior.centre_px};
  ceres::Matrix square(1, 4);  // prior on fx / fy, since the sensor's pixels are square
  square << 1, -1, 0, 0;
  square /= kSquare_ratio * intrinsics_[0];
  const std::array<double, 2> of_line{kInfinity_prior, kGain_prior_ratio * std::abs(line_[1])};
  add_prior(motion_, of_motion);
  add_prior(intrinsics_, of_camera);
  problem_.AddResidualBlock(
      new ceres::NormalPrior(square, ceres::Vector(Eigen::Map<const Eigen::Vector4d>(intrinsics_.data()))),
      nullptr, intrinsics_.data());
  add_prior(line_, of_line);
}

double Fit::rms() {
  const std::vector<double> values = detail::residuals_of(problem_, readings_);
  double sum = 0;
  for (std::size_t i = 0; i < values.size(); ++i) sum += std::pow(values[i] * sigmas_[i], 2);
  return std::sqrt(sum / static_cast<double>(values.size()));
}

/// Computes standard deviations from the inverse of the normal equations, scaled by the residuals.
bool Fit::add_deviations(DisparityFit& fit) {
  ceres::Covariance covariance{ceres::Covariance::Options()};
  const std::vector<std::pair<const double*, const double*>> blocks{{motion_.data(), motion_.data()},
                                                                    {intrinsics_.data(), intrinsics_.data()},
                                                                    {line_.data(), line_.data()}};
  if (!covariance.Compute(blocks, &problem_)) return false;
  Eigen::Matrix<double, 6, 6, Eigen::RowMajor> motion;
  Eigen::Matrix<double, 4, 4, Eigen::RowMajor> intrinsics;
  Eigen::Matrix<double, 2, 2, Eigen::RowMajor> line;
  covariance.GetCovarianceBlock(motion_.data(), motion_.data(), motion.data());
  covariance.GetCovarianceBlock(intrinsics_.data(), intrinsics_.data(), intrinsics.data());
  covariance.GetCovarianceBlock(line_.data(), line_.data(), line.data());
  const double scale = std::max(fit.after_rms / kDistortion, 0.1);
  fit.rotation_sigma_rad = scale * motion.diagonal().head<3>().cwiseSqrt();
  fit.translation_sigma_m = scale * motion.diagonal().tail<3>().cwiseSqrt();
  fit.focal_sigma_px = scale * std::sqrt(std::max(intrinsics(0, 0), intrinsics(1, 1)));
  fit.centre_sigma_px = scale * std::sqrt(std::max(intrinsics(2, 2), intrinsics(3, 3)));
  const Vec2 of_offset(-1 / line_[1], line_[0] / (line_[1] * line_[1]));
  fit.offset_sigma_per_m = scale * std::sqrt(of_offset.dot(line * of_offset));
  fit.slope_sigma_per_m = scale * std::sqrt(line(1, 1)) / (line_[1] * line_[1]);
  return true;
}

Result<DisparityFit> Fit::solve() {
  DisparityFit fit;
  fit.blocks = readings_.size();
  fit.before_rms = rms();
  const ceres::Solver::Options options =
      detail::solver_options(ceres::DENSE_NORMAL_CHOLESKY, kMostIterations);
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem_, &summary);
  fit.after_rms = rms();
  fit.found = start_;
  fit.found.T_color_depth = detail::to_se3(motion_).inverse();
  fit.found.disparity = to_model(line_);
  detail::set_intrinsics(fit.found.camera, intrinsics_);
  if (!summary.IsSolutionUsable() || !is_rigid(fit.found.T_color_depth) || !check_camera(fit.found.camera) ||
      !check_disparity(fit.found.disparity) || !add_deviations(fit))
    return fail(ErrorCode::kInvalidValue, "", "the boards leave disparity and depth camera undetermined");
  return fit;
}

}  // namespace

DisparityCamera nominal_kinect() {
  return {{640, 480, 575.8, 575.8, 319.5, 239.5, {}}, SE3(Mat3::Identity(), Vec3(-0.025, 0, 0)), {}};
}

Result<DisparityFit> fit_disparity_camera(std::span<const DepthPose> poses, const DisparityCamera& start,
                                          const DisparityPrior& prior) {
  std::size_t boards = 0;
  for (const DepthPose& pose : poses) boards += pose.depth.samples.empty() ? 0 : 1;
  if (boards < 3)
    return fail(ErrorCode::kInvalidValue, "", "{} boards with readings: at least 3, tilted, are needed",
                boards);
  Fit fit(poses, start);
  fit.add_priors(prior);
  return fit.solve();
}

}  // namespace hm
