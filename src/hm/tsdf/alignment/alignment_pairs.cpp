#include "hm/tsdf/alignment/alignment_pairs.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace hm {
namespace {

/// Index distance of neighbours in the list, so that they share none of the eight voxels.
constexpr std::size_t kLag = 2;

/// Jacobian and weight of a reading; weight 0 for outliers.
struct Reading {
  Vec6 jacobian = Vec6::Zero();
  double weight = 0;
};

Reading reading_of(const AlignmentView& view, const AlignmentPoints& points, std::size_t i) {
  std::array<double, 8> corners{};
  for (std::size_t c = 0; c < 8; ++c) {
    if (points.corners[c][i] == kUnknownDistance) return {};
    corners[c] = points.corners[c][i];
  }
  const Eigen::Map<const Eigen::Matrix<float, 3, 3, Eigen::RowMajor>> R(view.R);
  const Eigen::Map<const Eigen::Vector3f> t(view.t_centre_m), centre(view.centre_voxel);
  const Eigen::Vector3f ray = R * Eigen::Vector3f(points.x_m[i], points.y_m[i], points.z_m[i]), arm = ray + t;
  const Eigen::Vector3f place = arm / view.voxel_size_m + centre;
  const Eigen::Vector3i cell(points.cell_x[i] - view.first_voxel[0], points.cell_y[i] - view.first_voxel[1],
                             points.cell_z[i] - view.first_voxel[2]);
  const Vec3 fraction = (place - cell.cast<float>()).cast<double>();
  const VolumeGrid::Sample sample = VolumeGrid::blend(corners, fraction, 1.0);  // units, units a voxel
  const double slope2 = sample.gradient.squaredNorm();
  if (std::abs(sample.distance_m) >= static_cast<double>(view.near_surface_units) ||
      slope2 <= static_cast<double>(view.min_slope2_units) || sample.gradient.dot(ray.cast<double>()) >= 0)
    return {};
  const double slope = std::sqrt(slope2), inverse_width = static_cast<double>(points.inverse_width[i]);
  const double r = sample.distance_m / slope * static_cast<double>(view.voxel_size_m) * inverse_width;
  if (r * r >= 1) return {};
  const Vec3 normal = sample.gradient / slope;
  Reading reading;
  reading.jacobian << normal, arm.cast<double>().cross(normal);
  reading.weight = static_cast<double>(points.share[i]) * std::pow((1 - r * r) * inverse_width, 2);
  return reading;
}

/// True when two readings may lie on the same surface; at grazing angles they are far apart.
bool are_neighbours(const AlignmentView& view, const AlignmentPoints& points, std::size_t i, std::size_t k) {
  const Eigen::Vector3f apart(points.x_m[i] - points.x_m[k], points.y_m[i] - points.y_m[k],
                              points.z_m[i] - points.z_m[k]);
  const float reach_m = 4 * view.voxel_size_m + 0.2f * points.z_m[i];
  return apart.squaredNorm() < reach_m * reach_m;
}

}  // namespace

PairTerms sum_pair_terms(const AlignmentView& view, std::size_t count, const AlignmentPoints& points) {
  PairTerms terms;
  std::array<Reading, kLag> before;
  for (std::size_t i = 0; i < count; ++i) {
    const Reading reading = reading_of(view, points, i);
    Reading& other = before[i % kLag];
    if (reading.weight > 0 && other.weight > 0 && are_neighbours(view, points, i, i - kLag) &&
        reading.jacobian.head<3>().dot(other.jacobian.head<3>()) > 0.7) {
      const double weight = std::sqrt(reading.weight * other.weight);
      terms.H.noalias() += weight * reading.jacobian * other.jacobian.transpose();
      terms.weight += weight;
    }
    other = reading;
  }
  terms.H = (0.5 * (terms.H + terms.H.transpose())).eval();
  return terms;
}

}  // namespace hm
