#include "hm/odometry/tracker/color_time_estimator.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "hm/geometry/solvers/small_solvers.hpp"
#include "hm/odometry/feature/depth_uncertainty.hpp"

namespace hm {
namespace {

constexpr double kSharedLandmarkErrors = 20;  // landmarks keep their errors from frame to frame
constexpr double kPriorSigma_s = 0.02, kPriorDelaySigma_s = 0.01;
constexpr double kLeastSigma_s = 0.0012;  // of the readout: older frames are forgotten
constexpr double kSignificance = 3;       // standard deviations
constexpr double kLeastReadout_s = 0.004, kLeastDelay_s = 0.004;  // shorter ones are not worth it
constexpr double kColorTimeDamping = 1e-3;
constexpr double kColorTimeReadingWeight = 0.1;  // readings of one surface are correlated
constexpr double kReferenceSigma_px = 0.3;
constexpr double kLeastIncidence = 0.2;  // cosine between a ray and the surface's normal
constexpr std::size_t kMinPairs = 20;
constexpr int kColorTimeIterations = 3;
using Mat62 = Eigen::Matrix<double, 6, 2>;

/// Derivative of a row's time by [readout; delay].
Vec2 time_derivative(double row, const PinholeCamera& camera) { return {row / (camera.height - 1) - 0.5, 1}; }

/// Velocity of the point where a ray, moved to a later time by the motion of the camera, meets the plane of
/// its point with this normal: what an error of its row's time does to it, m/s.
Vec3 shift_in_plane(const Vec3& p_camera, const Vec3& normal, const Vec6& twist_s) {
  const Vec3 velocity = twist_s.tail<3>().cross(p_camera) + twist_s.head<3>();
  return velocity - normal.dot(velocity) / normal.dot(p_camera) * p_camera;
}

/// Point of a surface on a ray.
struct RayHit {
  Vec3 p_camera = Vec3::Zero(), normal = Vec3::UnitZ();
  double variance_m2 = 0;  ///< of the depth
};

std::optional<RayHit> hit(const SurfaceGrid& surface, const Vec2& pixel, const PinholeCamera& camera) {
  const Vec2 cell = pixel_in_level(pixel, 2);
  const int x = static_cast<int>(std::lround(cell.x())), y = static_cast<int>(std::lround(cell.y()));
  if (!surface.elements.contains(x, y) || !(surface.elements(x, y).sigma_m > 0)) return std::nullopt;
  const SurfaceElement& element = surface.elements(x, y);
  const Vec3 normal = element.normal.cast<double>(), ray = camera.unproject(pixel, 1);
  const double along_ray = normal.dot(ray);
  if (along_ray > -kLeastIncidence * ray.norm()) return std::nullopt;
  const double depth_m = normal.dot(element.point.cast<double>()) / along_ray;
  const double sigma_m = static_cast<double>(element.sigma_m) / along_ray;
  return RayHit{depth_m * ray, normal, sigma_m * sigma_m};
}

/// A landmark seen in the reference keyframe and in the frame, by its pixels in both colour images.
struct Pair {
  const Sighting* reference = nullptr;
  const LandmarkMatch* match = nullptr;
};

std::vector<Pair> pairs_of(const MapKeyframe& reference, std::span<const LandmarkMatch> matches) {
  std::vector<std::pair<std::size_t, const LandmarkMatch*>> by_landmark;
  for (const LandmarkMatch& match : matches)
    if (match.inlier) by_landmark.emplace_back(match.landmark, &match);
  std::sort(by_landmark.begin(), by_landmark.end());
  std::vector<Pair> pairs;
  for (const Sighting& sighting : reference.sightings) {
    if (!(sighting.depth_m > 0)) continue;
    const auto at =
        std::lower_bound(by_landmark.begin(), by_landmark.end(),
                         std::pair(sighting.landmark, static_cast<const LandmarkMatch*>(nullptr)));
    if (at != by_landmark.end() && at->first == sighting.landmark) pairs.push_back({&sighting, at->second});
  }
  return pairs;
}

/// Normal equations of the motion T_ref_cur and the times [readout; delay].
struct TimeEquations {
  PoseEquations pose;
  Mat62 cross = Mat62::Zero();
  Mat2 information = Mat2::Zero();
  Vec2 gradient = Vec2::Zero();
};

/// The two frames and what is assumed of them.
struct TwoViews {
  const PinholeCamera& camera;
  const SurfaceGrid& surface;  ///< of the reference
  RowMotion ref_rows, cur_rows;
  Vec6 ref_twist_s, cur_twist_s;
};

Vec2 at_depth_time(const RowMotion& rows, const Vec2& image_pixel, double depth_m) {
  return rows.in_depth_image(rows.at_middle_row(image_pixel, depth_m), depth_m);
}

/// The landmark's point is that of the reference's surface on its ray, which moves with the times; the depth
/// image of the frame is compared with that surface as a whole (surface_equations).
void add_pair(const TwoViews& views, const Pair& pair, const SE3& T_ref_cur, TimeEquations& equations) {
  const PinholeCamera& camera = views.camera;
  const Sighting& sighting = *pair.reference;
  const Vec2 ref_pixel = at_depth_time(views.ref_rows, sighting.image_pixel, sighting.depth_m);
  const auto seen = hit(views.surface, ref_pixel, camera);
  if (!seen) return;
  PointObservation observation = pair.match->observation;
  observation.depth_m = 0;
  observation.p_odom = seen->p_camera;
  observation.covariance =
      feature_covariance(camera, ref_pixel, {seen->p_camera.z(), seen->variance_m2}, kReferenceSigma_px);
  const Vec3 p_cur = T_ref_cur.inverse() * observation.p_odom;
  observation.pixel = at_depth_time(views.cur_rows, pair.match->image_pixel, p_cur.z());
  observation.pose_gain = 1;
  const auto residual = point_residual(observation, T_ref_cur, camera);
  if (!residual) return;
  const Eigen::Matrix<double, 3, 2> by_times =
      residual->by_point * shift_in_plane(observation.p_odom, seen->normal, views.ref_twist_s) *
          time_derivative(sighting.image_pixel.y(), camera).transpose() -
      residual->by_point * (T_ref_cur.rotation() * shift_in_plane(p_cur, Vec3::UnitZ(), views.cur_twist_s)) *
          time_derivative(pair.match->image_pixel.y(), camera).transpose();
  const Mat3 weighted = robust_weight(residual->squared_mahalanobis) * residual->information;
  equations.pose.information += residual->by_pose.transpose() * weighted * residual->by_pose;
  equations.pose.gradient += residual->by_pose.transpose() * weighted * residual->value;
  equations.cross += residual->by_pose.transpose() * weighted * by_times;
  equations.information += by_times.transpose() * weighted * by_times;
  equations.gradient += by_times.transpose() * weighted * residual->value;
}

}  // namespace

ColorTimeEstimator::ColorTimeEstimator(const ColorTimes& prior, bool estimates)
    : prior_(prior), estimates_(estimates) {
  prior_information_ =
      Vec2(1 / (kPriorSigma_s * kPriorSigma_s), 1 / (kPriorDelaySigma_s * kPriorDelaySigma_s)).asDiagonal();
  prior_vector_ = prior_information_ * Vec2(prior.readout_s, prior.delay_s);
}

bool ColorTimeEstimator::differs_from_zero() const {
  const ColorTimes estimate = times(), deviation = sigma();
  return std::abs(estimate.readout_s) > std::max(kLeastReadout_s, kSignificance * deviation.readout_s) ||
         std::abs(estimate.delay_s) > std::max(kLeastDelay_s, kSignificance * deviation.delay_s);
}

ColorTimes ColorTimeEstimator::in_use() const {
  if (!estimates_) return prior_;
  return significant_ || !prior_.is_zero() ? times() : ColorTimes{};
}

void ColorTimeEstimator::add(const MapKeyframe& reference, const TimedFrame& frame, const DepthGrid& grid,
                             const InstantMotion& motion, const PinholeCamera& camera,
                             const DepthNoise& noise) {
  if (!estimates_ || !reference.motion || reference.surface.elements.empty()) return;
  const std::vector<Pair> pairs = pairs_of(reference, frame.matches);
  if (pairs.size() < kMinPairs) return;
  const ColorTimes now = in_use();
  const TwoViews views{camera,
                       reference.surface,
                       {camera, now, *reference.motion},
                       {camera, now, motion},
                       reference.motion->twist_s,
                       motion.twist_s};
  SE3 T_ref_cur = (reference.T_odom_camera * views.ref_rows.T_camera_depth()).inverse() *
                  frame.T_odom_camera * views.cur_rows.T_camera_depth();
  TimeEquations equations;
  Mat62 by_times;
  for (int iteration = 0; iteration < kColorTimeIterations; ++iteration) {
    equations = {};
    equations.pose = surface_equations(reference.surface, grid, T_ref_cur, {noise, 2, 4, 0.0});
    equations.pose.information *= kColorTimeReadingWeight;
    equations.pose.gradient *= kColorTimeReadingWeight;
    for (const Pair& pair : pairs) add_pair(views, pair, T_ref_cur, equations);
    equations.pose.information.diagonal().array() += kColorTimeDamping;
    const Mat6 covariance = inverse_of(equations.pose.information);
    by_times = covariance * equations.cross;
    const Vec6 step = -covariance * equations.pose.gradient;
    if (!step.allFinite() || step.norm() > 0.2) return;
    if (iteration + 1 < kColorTimeIterations) T_ref_cur = T_ref_cur * SE3::exp(step);
  }
  const Mat2 information =
      (equations.information - equations.cross.transpose() * by_times) / kSharedLandmarkErrors;
  const Vec2 gradient =
      (equations.gradient - by_times.transpose() * equations.pose.gradient) / kSharedLandmarkErrors;
  information_ += information;
  vector_ += information * Vec2(now.readout_s, now.delay_s) - gradient;
  const double kept = std::min(1.0, 1 / (kLeastSigma_s * kLeastSigma_s * information_(0, 0)));
  information_ *= kept;
  vector_ *= kept;
  significant_ = significant_ || differs_from_zero();
}

ColorTimes ColorTimeEstimator::times() const {
  const Vec2 estimate = (information_ + prior_information_).inverse() * (vector_ + prior_vector_);
  return {estimate.x(), estimate.y()};
}

ColorTimes ColorTimeEstimator::sigma() const {
  const Mat2 covariance = (information_ + prior_information_).inverse();
  return {std::sqrt(covariance(0, 0)), std::sqrt(covariance(1, 1))};
}

}  // namespace hm
