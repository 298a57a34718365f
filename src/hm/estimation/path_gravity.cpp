#include "hm/estimation/path_gravity.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "hm/geometry/solvers/small_solvers.hpp"

namespace hm {
namespace {

constexpr double kStretch_s = 1.5, kLeastStretch_s = 0.9;
constexpr double kMaxGap_s = 0.2;        // between poses, and between readings
constexpr double kVelocitySpan_s = 0.1;  // over which the path's velocity is taken at both ends
constexpr double kVelocitySigma_m_s = 0.1, kForceSigma_m_s2 = 0.05;
constexpr double kBiasSigma_m_s2 = 0.5;
constexpr double kNormTolerance_m_s2 = 0.7;  // bias and scale of consumer devices
constexpr double kAboutWindow_s = 0.25, kAboutNormTolerance_m_s2 = 1.5, kAboutSigma_rad = 0.08;

/// One reading at the pose of its moment.
struct PosedReading {
  Time stamp;
  SE3 T_world_camera;
  Vec3 force_camera;
};

std::vector<PosedReading> readings_on(std::span<const ImuSample> samples, const Trajectory& path) {
  std::vector<PosedReading> readings;
  for (const ImuSample& sample : samples)
    if (const auto pose = pose_at(path, sample.stamp, Duration::from_seconds(kMaxGap_s)))
      if (sample.specific_force_m_s2.allFinite() &&
          (readings.empty() || sample.stamp > readings.back().stamp))
        readings.push_back({sample.stamp, *pose, sample.specific_force_m_s2});
  return readings;
}

double seconds_between(const PosedReading& a, const PosedReading& b) { return (b.stamp - a.stamp).seconds(); }

/// mean = g + rotation b, with this deviation.
struct MeanForce {
  Vec3 mean = Vec3::Zero();
  Mat3 rotation = Mat3::Zero();
  double sigma_m_s2 = 0;
};

Vec3 velocity(const PosedReading& a, const PosedReading& b) {
  return (b.T_world_camera.translation() - a.T_world_camera.translation()) / seconds_between(a, b);
}

/// The difference of the mean velocities at both ends is the integral of the acceleration under a trapezium.
std::optional<MeanForce> mean_force(std::span<const PosedReading> part) {
  if (part.size() < 4 || seconds_between(part.front(), part.back()) < kLeastStretch_s) return std::nullopt;
  const auto at = [&](std::size_t i) { return seconds_between(part.front(), part[i]); };
  const std::size_t last = part.size() - 1;
  std::size_t first_end = 1, last_begin = last - 1;
  while (at(first_end) < kVelocitySpan_s) ++first_end;
  while (at(last) - at(last_begin) < kVelocitySpan_s) --last_begin;
  const double rise_s = at(first_end), fall_s = at(last) - at(last_begin);
  MeanForce out;
  double weights = 0;
  for (std::size_t i = 1; i <= last; ++i) {
    const double middle = 0.5 * (at(i - 1) + at(i));
    const double weight =
        std::min({1.0, middle / rise_s, (at(last) - middle) / fall_s}) * (at(i) - at(i - 1));
    for (const PosedReading& end : {part[i - 1], part[i]}) {
      out.mean += 0.5 * weight * (end.T_world_camera.rotation() * end.force_camera);
      out.rotation += 0.5 * weight * end.T_world_camera.rotation();
    }
    weights += weight;
  }
  out.mean -= velocity(part[last_begin], part[last]) - velocity(part.front(), part[first_end]);
  out.mean /= weights;
  out.rotation /= weights;
  out.sigma_m_s2 = std::hypot(kVelocitySigma_m_s / weights, kForceSigma_m_s2);
  return out;
}

std::vector<MeanForce> mean_forces(std::span<const PosedReading> readings) {
  std::vector<MeanForce> forces;
  std::size_t begin = 0;
  for (std::size_t i = 1; i <= readings.size(); ++i) {
    const bool ends = i == readings.size() || seconds_between(readings[i - 1], readings[i]) > kMaxGap_s;
    if (!ends && seconds_between(readings[begin], readings[i]) < kStretch_s) continue;
    if (const auto force = mean_force(readings.subspan(begin, i - begin))) forces.push_back(*force);
    begin = ends ? i : i - 1;
  }
  return forces;
}

}  // namespace

std::optional<UpDirection> up_along_path(std::span<const ImuSample> samples,
                                         const Trajectory& T_world_camera) {
  const std::vector<PosedReading> readings = readings_on(samples, T_world_camera);
  const std::vector<MeanForce> forces = mean_forces(readings);
  if (forces.empty()) return std::nullopt;
  Mat6 information = Mat6::Zero();
  information.bottomRightCorner<3, 3>() = Mat3::Identity() / (kBiasSigma_m_s2 * kBiasSigma_m_s2);
  Vec6 right = Vec6::Zero();
  for (const MeanForce& force : forces) {
    Eigen::Matrix<double, 3, 6> H;
    H << Mat3::Identity(), force.rotation;
    const double weight = 1 / (force.sigma_m_s2 * force.sigma_m_s2);
    information += weight * H.transpose() * H;
    right += weight * H.transpose() * force.mean;
  }
  const Mat6 covariance = inverse_of(information);
  const Vec3 gravity = (covariance * right).head<3>();
  const double norm = gravity.norm();
  if (!(std::abs(norm - kGravity_m_s2) < kNormTolerance_m_s2)) return std::nullopt;
  const Vec3 variances = symmetric_eigenvalues(Mat3(covariance.topLeftCorner<3, 3>()));
  return UpDirection{gravity / norm, UpSource::kGravity, std::sqrt(variances[2]) / norm};
}

std::optional<UpDirection> up_about(std::span<const ImuSample> samples, Time stamp) {
  Vec3 sum = Vec3::Zero();
  int count = 0;
  for (const ImuSample& sample : samples)
    if (std::abs((sample.stamp - stamp).seconds()) < kAboutWindow_s)
      sum += sample.specific_force_m_s2, ++count;
  if (count == 0) return std::nullopt;
  const double norm = sum.norm() / count;
  if (!(std::abs(norm - kGravity_m_s2) < kAboutNormTolerance_m_s2)) return std::nullopt;
  return UpDirection{sum.normalized(), UpSource::kGravity, kAboutSigma_rad};
}

}  // namespace hm
