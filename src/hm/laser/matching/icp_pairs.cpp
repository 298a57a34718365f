#include "hm/laser/matching/icp_pairs.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "hm/core/hash.hpp"

namespace hm {
namespace {

constexpr float kDuplicateFactor2 = 9;  // within three times the nearest one's distance

// Errors by the bits of their single-precision number: eight of exponent from 2^-20 m on, five of mantissa.
constexpr std::uint32_t kErrorShift = 18, kErrorBins = 25 * 32;
constexpr std::uint32_t kSmallestError = (127U - 20U) << (23 - kErrorShift);

std::uint32_t error_bin(float error) {
  const std::uint32_t code = std::bit_cast<std::uint32_t>(error) >> kErrorShift;
  return code < kSmallestError ? 0 : std::min(code - kSmallestError, kErrorBins - 1);
}

/// Upper end of a bin.
float error_of_bin(std::uint32_t bin) {
  return std::bit_cast<float>((bin + 1 + kSmallestError) << kErrorShift);
}

struct Nearest {
  std::uint32_t index = 0;
  float distance2 = 0;
};

/// Finds the reference point nearest to (x, y), within the distance given in `nearest`; if none, the distance
/// is unchanged. Searches in both directions from `start` by bearing, across the seam of a full-circle scan,
/// and stops where the next ray is farther away than the best point so far.
bool find_nearest(const ReferenceLines& reference, float x, float y, Nearest& nearest) {
  const ReferenceLines::Ray* rays = reference.rays.data();
  const std::uint32_t n = static_cast<std::uint32_t>(reference.size()), start = nearest.index;
  bool found = false;
  const auto walk_on = [&](std::uint32_t first, std::uint32_t last) {
    for (std::uint32_t j = first; j < last; ++j) {
      const ReferenceLines::Ray& ray = rays[j];
      const float dx = ray.x - x, dy = ray.y - y, distance2 = dx * dx + dy * dy;
      if (distance2 < nearest.distance2) nearest = {j, distance2}, found = true;
      const float beyond = x * ray.uy - y * ray.ux;
      if (beyond > 0 && beyond * beyond > nearest.distance2) return false;
    }
    return true;
  };
  const auto walk_back = [&](std::uint32_t last, std::uint32_t first) {
    for (std::uint32_t j = last; j-- > first;) {
      const ReferenceLines::Ray& ray = rays[j];
      const float dx = ray.x - x, dy = ray.y - y, distance2 = dx * dx + dy * dy;
      if (distance2 < nearest.distance2) nearest = {j, distance2}, found = true;
      const float beyond = x * ray.uy - y * ray.ux;
      if (beyond < 0 && beyond * beyond > nearest.distance2) return false;
    }
    return true;
  };
  if (walk_on(start, n) && reference.closed) walk_on(0, start);
  if (walk_back(start, 0) && reference.closed) walk_back(n, start);
  return found;
}

/// As published: the line through the nearest point and the nearer of its two neighbours.
std::uint32_t published_line(const ReferenceLines& reference, std::uint32_t nearest, float x, float y) {
  const auto distance2 = [&](std::uint32_t j) {
    const float dx = reference.points.x[j] - x, dy = reference.points.y[j] - y;
    return dx * dx + dy * dy;
  };
  const auto n = static_cast<std::uint32_t>(reference.size());
  const std::uint32_t before = nearest == 0 ? n - 1 : nearest - 1, after = nearest + 1 == n ? 0 : nearest + 1;
  return distance2(before) < distance2(after) ? before : nearest;
}

/// True when the ray to the sensed point (qx, qy) meets the line on the other side than the reference's ray
/// did: the two faces of a wall between rooms are less than kMaxCorrespondenceDistance_m apart.
bool is_seen_from_behind(const ReferenceLines& reference, std::uint32_t line, float qx, float qy) {
  const float nx = reference.nx[line], ny = reference.ny[line];
  return (nx * reference.ux[line] + ny * reference.uy[line]) * (nx * qx + ny * qy) < 0;
}

}  // namespace

void IcpPairs::begin(std::size_t sensed_points, std::size_t reference_points) {
  partner_.assign(sensed_points, kUnpaired);
  nearest2_.resize(reference_points);
  pairs_.clear();
}

std::size_t IcpPairs::find(const ReferenceLines& reference, const ScanPoints& sensed, const SE2& X,
                           std::size_t stride, const PlIcpParams& params) {
  const auto c = static_cast<float>(X.cosine()), s = static_cast<float>(X.sine());
  const auto tx = static_cast<float>(X.x()), ty = static_cast<float>(X.y());
  const auto limit2 =
      static_cast<float>(params.kMaxCorrespondenceDistance_m * params.kMaxCorrespondenceDistance_m);
  const bool published = !(params.line_half_length_m > 0);
  const auto n = static_cast<std::uint32_t>(reference.size());
  pairs_.clear();
  for (std::size_t i = 0; i < sensed.size(); i += stride) {
    const float qx = c * sensed.x[i] - s * sensed.y[i], qy = s * sensed.x[i] + c * sensed.y[i];
    const float x = qx + tx, y = qy + ty;
    Nearest nearest{partner_[i] >= 0 ? static_cast<std::uint32_t>(partner_[i]) : reference.start_index(x, y),
                    limit2};
    if (!find_nearest(reference, x, y, nearest)) {
      partner_[i] = kUnpaired;
      continue;
    }
    partner_[i] = static_cast<std::int32_t>(nearest.index);
    // The end of a scan need not be the end of the surface.
    if (!reference.closed && (nearest.index == 0 || nearest.index + 1 == n)) continue;
    const std::uint32_t line = published ? published_line(reference, nearest.index, x, y) : nearest.index;
    if (!published && is_seen_from_behind(reference, line, qx, qy)) continue;
    const float error = reference.d[line] - reference.nx[line] * x - reference.ny[line] * y;
    pairs_.push_back({static_cast<std::uint32_t>(i), line, qx, qy, error, nearest.distance2});
  }
  return pairs_.size();
}

std::size_t IcpPairs::trim(const PlIcpParams& params, double range_sigma_m, double floor_m) {
  if (params.remove_duplicates) {
    std::fill(nearest2_.begin(), nearest2_.end(), std::numeric_limits<float>::max());
    for (const Pair& pair : pairs_) nearest2_[pair.line] = std::min(nearest2_[pair.line], pair.distance2);
    // Distances of a few standard deviations always pass, since the nearest of noisy points is ambiguous.
    const bool published = !(params.line_half_length_m > 0);
    const float floor2 = published ? 0 : static_cast<float>(9 * range_sigma_m * range_sigma_m);
    std::erase_if(pairs_, [&](const Pair& pair) {
      return pair.distance2 > kDuplicateFactor2 * nearest2_[pair.line] + floor2;
    });
  }
  if (pairs_.empty()) return 0;
  const float limit = std::max(trimming_limit(params), static_cast<float>(floor_m));
  std::erase_if(pairs_, [&](const Pair& pair) { return std::abs(pair.error) > limit; });
  return pairs_.size();
}

/// Smaller of the percentile and the adaptive limit, from a histogram with 32 bins per octave (accurate to 2
/// %).
float IcpPairs::trimming_limit(const PlIcpParams& params) {
  histogram_.assign(kErrorBins, 0);
  for (const Pair& pair : pairs_) ++histogram_[error_bin(std::abs(pair.error))];
  const auto last = static_cast<double>(pairs_.size() - 1);
  const auto quantile = [&](double ratio) {
    auto wanted = static_cast<std::int64_t>(ratio * last);
    std::uint32_t bin = 0;
    while (bin + 1 < kErrorBins && (wanted -= histogram_[bin]) >= 0) ++bin;
    return error_of_bin(bin);
  };
  const float adaptive = static_cast<float>(params.adaptive_multiple) * quantile(params.kAdaptiveOrderRatio);
  if (params.keep_percentile_ratio >= 1) return adaptive;
  return std::min(adaptive, quantile(params.keep_percentile_ratio));
}

PointToLineSums IcpPairs::sums(const ReferenceLines& reference, const ScanPoints& sensed, bool weigh) const {
  PointToLineSums result;
  for (const Pair& pair : pairs_) {
    const float nx = reference.nx[pair.line], ny = reference.ny[pair.line];
    const float cosine = (nx * pair.qx + ny * pair.qy) / sensed.range[pair.point];
    result.add({nx, ny, pair.qx, pair.qy, pair.error, weight(reference, pair.line, cosine, weigh)});
  }
  return result;
}

Mat3 IcpPairs::noise_information(const ReferenceLines& reference, const ScanPoints& sensed,
                                 bool weigh) const {
  PointToLineSums result;  // rows along the lines instead of across
  for (const Pair& pair : pairs_) {
    const float nx = reference.nx[pair.line], ny = reference.ny[pair.line];
    const float cosine = (nx * pair.qx + ny * pair.qy) / sensed.range[pair.point];
    result.add({-ny, nx, pair.qx, pair.qy, 0,
                weight(reference, pair.line, cosine, weigh) * reference.angle_sigma2[pair.line]});
  }
  return result.information();
}

std::uint64_t IcpPairs::fingerprint() const {
  Fnv1a hash;
  for (const Pair& pair : pairs_) hash.add(static_cast<std::uint64_t>(pair.point) << 32 | pair.line);
  return hash.value();
}

std::size_t IcpPairs::count_within(double error_m) const {
  const auto limit = static_cast<float>(error_m);
  return static_cast<std::size_t>(std::count_if(
      pairs_.begin(), pairs_.end(), [&](const Pair& pair) { return std::abs(pair.error) <= limit; }));
}

double IcpPairs::mean_error_m() const {
  double sum = 0;
  for (const Pair& pair : pairs_) sum += std::abs(static_cast<double>(pair.error));
  return pairs_.empty() ? 0 : sum / static_cast<double>(pairs_.size());
}

}  // namespace hm
