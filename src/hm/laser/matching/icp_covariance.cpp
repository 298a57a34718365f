#include "hm/laser/matching/icp_covariance.hpp"

#include <algorithm>
#include <cmath>

namespace hm {
namespace {
constexpr float kLeastAlong2 = 1e-4F;  // of a line, m2: shorter ones do not determine their rotation
}

/// Computed in units of the range variance. A sensed range changes its own error by the cosine of its
/// incidence; a reference range changes the lines fitted to it, by its share and, for pairs off the line's
/// centroid, by the rotation of the line.
Mat3 IcpCovariance::compute(const ReferenceLines& reference, const ScanPoints& sensed, const IcpPairs& pairs,
                            const At& at) {
  influence_.assign(reference.size() + 1, Influence::Zero());
  PointToLineSums own;
  const auto unit = static_cast<float>(1 / at.range_sigma_m);
  for (const IcpPairs::Pair& pair : pairs.pairs()) {
    const std::uint32_t line = pair.line;
    const float nx = reference.nx[line], ny = reference.ny[line];
    const float cosine = (nx * pair.qx + ny * pair.qy) / sensed.range[pair.point];
    const float weight = IcpPairs::weight(reference, line, cosine, at.weigh);
    const float spread = std::max(std::abs(cosine), std::abs(pair.error) * unit);
    own.add({nx, ny, pair.qx, pair.qy, 0, weight * weight * spread * spread});
    const std::uint32_t first = reference.begin[line], last = reference.end[line];
    const float share = weight / static_cast<float>(last - first), centre = reference.centre[line];
    const float off = ny * reference.points.x[line] - nx * reference.points.y[line] - centre;
    const float turn = last - first > 2 ? off / std::max(reference.along2[line], kLeastAlong2) : 0;
    const Eigen::Array3f row(share * nx, share * ny, share * (ny * pair.qx - nx * pair.qy));
    Influence influence;
    influence << row * (1 - turn * centre), row * (turn * ny), row * (-turn * nx);
    influence_[first] += influence;
    influence_[last] -= influence;
  }
  Mat3 middle = own.information();
  Influence sum = Influence::Zero();
  for (std::size_t j = 0; j < reference.size(); ++j) {
    sum += influence_[j];
    const Eigen::Array3f moves =
        sum.col(0) + sum.col(1) * reference.points.x[j] + sum.col(2) * reference.points.y[j];
    const float cosine = reference.nx[j] * reference.ux[j] + reference.ny[j] * reference.uy[j];
    const Vec3 moved = moves.matrix().cast<double>();
    middle += (cosine * cosine / reference.scans[j]) * moved * moved.transpose();
  }
  return at.range_sigma_m * at.range_sigma_m * at.inverse * middle * at.inverse;
}

}  // namespace hm
