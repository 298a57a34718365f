#include "hm/laser/icp_covariance.hpp"

namespace hm {

/// In units of the variance of a range. A sensed range moves its own error by the cosine of its incidence; a
/// reference range moves, by its share, the lines that it took part in.
Mat3 IcpCovariance::compute(const ReferenceLines& reference, const ScanPoints& sensed, const IcpPairs& pairs,
                            const Mat3& inverse, bool weigh) {
  influence_.assign(reference.size() + 1, {});
  PointToLineSums own;
  for (const IcpPairs::Pair& pair : pairs.pairs()) {
    const float nx = reference.nx[pair.line], ny = reference.ny[pair.line];
    const float cosine = (nx * pair.qx + ny * pair.qy) / sensed.range[pair.point];
    const float weight = IcpPairs::weight(reference, pair.line, cosine, weigh);
    own.add({nx, ny, pair.qx, pair.qy, 0, weight * weight * cosine * cosine});
    const std::uint32_t first = reference.begin[pair.line], last = reference.end[pair.line];
    const float share = weight / static_cast<float>(last - first);
    const Influence row{share * nx, share * ny, share * (ny * pair.qx - nx * pair.qy)};
    influence_[first].x += row.x, influence_[first].y += row.y, influence_[first].angle += row.angle;
    influence_[last].x -= row.x, influence_[last].y -= row.y, influence_[last].angle -= row.angle;
  }
  Mat3 middle = own.information();
  Vec3 sum = Vec3::Zero();
  for (std::size_t j = 0; j < reference.size(); ++j) {
    sum += Vec3(influence_[j].x, influence_[j].y, influence_[j].angle);
    const float cosine = reference.nx[j] * reference.ux[j] + reference.ny[j] * reference.uy[j];
    middle += (cosine * cosine / reference.scans[j]) * sum * sum.transpose();
  }
  return inverse * middle * inverse;
}

}  // namespace hm
