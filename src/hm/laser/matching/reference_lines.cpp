#include "hm/laser/matching/reference_lines.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hm/core/statistics.hpp"

namespace hm {
namespace {

constexpr std::size_t kIndexBins = 2048;
constexpr std::uint32_t kUnset = 0xffffffffU;
constexpr std::uint32_t kMaxReach = 60;   // points on one side of a line
constexpr std::uint32_t kMinReach = 4;    // points on one side that a line has where points are sparse
constexpr float kSparseReach = 3;         // maximum distance of these, in half lengths
constexpr double kMaxAngleSigma2 = 0.25;  // beyond this a normal is unreliable
constexpr double kMinIncidenceCosine2 = 0.05;
constexpr double kMaxExcess = 2.5;       // largest excess of a straight segment, standard deviations
constexpr double kSuspiciousExcess = 2;  // standard deviations: test for a corner
constexpr double kCornerEvidence = 25;   // chi-square with two degrees of freedom
constexpr std::uint32_t kMinSide = 4;    // points that a line on one side needs
constexpr double kMaxSeamSteps = 3, kMaxSeam_rad = 0.2;  // between the ends of a scan that goes all around

/// Monotonic function of the angle in [0, 4), without trigonometry.
float diamond_angle(float x, float y) {
  const float t = y / (std::abs(x) + std::abs(y) + 1e-30F);
  if (x < 0) return 2.0F - t;
  return t < 0 ? 4.0F + t : t;
}

std::size_t bin_of(float x, float y) {
  return std::min(kIndexBins - 1, static_cast<std::size_t>(diamond_angle(x, y) * (kIndexBins / 4.0F)));
}

}  // namespace

void ScanPoints::clear() {
  x.clear();
  y.clear();
  range.clear();
}

void ScanPoints::assign(const PlanarScan& scan) {
  clear();
  float last_bearing = 0;
  bool sorted = scan.bearings_rad.size() == scan.size();
  for (std::size_t i = 0; i < scan.size() && sorted; ++i) {
    const Vec2 ray = scan.points_m[i] - scan.origin_m;
    const float rx = static_cast<float>(ray.x()), ry = static_cast<float>(ray.y());
    const float range2 = rx * rx + ry * ry;
    if (!(range2 > 0) || !std::isfinite(range2)) continue;
    sorted = x.empty() || scan.bearings_rad[i] >= last_bearing;
    last_bearing = scan.bearings_rad[i];
    x.push_back(rx);
    y.push_back(ry);
    range.push_back(std::sqrt(range2));
  }
  if (sorted) return;
  PlanarScan copy = scan;
  sort_by_bearing(copy);
  assign(copy);
}

double estimate_range_sigma(const ScanPoints& points, std::vector<float>& scratch) {
  scratch.clear();
  for (std::size_t i = 1; i + 1 < points.size(); ++i)
    scratch.push_back(std::abs(points.range[i - 1] - 2 * points.range[i] + points.range[i + 1]));
  if (scratch.empty()) return 5e-4;
  return std::max(5e-4, static_cast<double>(middle_value(std::span(scratch))) / (0.6745 * std::sqrt(6.0)));
}

void ReferenceLines::fit(const LineFitParams& params) {
  const std::size_t n = size();
  for (auto* values : {&ux, &uy, &nx, &ny, &d, &angle_sigma2, &centre, &along2}) values->resize(n);
  begin.resize(n);
  end.resize(n);
  smooth.resize(n);
  find_directions();
  closed = goes_all_around();
  moments_.assign(points.x, points.y);
  if (params.half_length_m > 0) {
    const double range_variance_m2 = params.range_sigma_m * params.range_sigma_m;
    find_windows(params);
    find_corners(range_variance_m2);
    cut_windows_at_corners();
    for (std::uint32_t i = 0; i < n; ++i) fit_point(i, range_variance_m2);
  } else {
    fit_published();
  }
  fill_index();
}

void ReferenceLines::find_directions() {
  rays.resize(size());
  for (std::size_t i = 0; i < size(); ++i) {
    const float inverse = 1.0F / points.range[i];
    ux[i] = points.x[i] * inverse;
    uy[i] = points.y[i] * inverse;
    rays[i] = {points.x[i], points.y[i], ux[i], uy[i]};
  }
}

/// True when the gap between the last and the first point is about as wide as those between other neighbours.
bool ReferenceLines::goes_all_around() const {
  if (size() < 3) return false;
  const double sine = ux.back() * uy.front() - uy.back() * ux.front();
  const double cosine = ux.back() * ux.front() + uy.back() * uy.front();
  const double turn_rad = std::atan2(sine, cosine);
  const double seam_rad = turn_rad < 0 ? turn_rad + 2 * std::numbers::pi : turn_rad;
  const double step_rad = (2 * std::numbers::pi - seam_rad) / static_cast<double>(size() - 1);
  return seam_rad < std::min(kMaxSeam_rad, kMaxSeamSteps * step_rad);
}

/// Finds the neighbours of each point on the same surface, at most half_length_m away.
void ReferenceLines::find_windows(const LineFitParams& params) {
  const auto n = static_cast<std::uint32_t>(size());
  windows_.resize(n);
  const auto squared_distance = [&](std::uint32_t a, std::uint32_t b) {
    const float dx = points.x[a] - points.x[b], dy = points.y[a] - points.y[b];
    return dx * dx + dy * dy;
  };
  const auto reach2 = static_cast<float>(params.half_length_m * params.half_length_m);
  const float far2 = kSparseReach * kSparseReach * reach2;
  const auto noise_m = static_cast<float>(6 * params.range_sigma_m);
  for (std::uint32_t piece = 0; piece < n;) {
    std::uint32_t last = piece + 1;
    for (; last < n; ++last) {
      // Points on a grazing wall are far apart; a range step is larger than either gap.
      const float turn = std::abs(ux[last - 1] * uy[last] - uy[last - 1] * ux[last]);
      const float limit = 0.1F + noise_m + 10 * points.range[last - 1] * std::min(turn, 0.02F);
      if (squared_distance(last, last - 1) > limit * limit) break;
    }
    std::uint32_t low = piece, high = piece;
    for (std::uint32_t i = piece; i < last; ++i) {
      while (low < i && (squared_distance(low, i) > reach2 || i - low > kMaxReach)) ++low;
      high = std::max(high, i + 1);
      while (high < last && squared_distance(high, i) <= reach2 && high - i < kMaxReach) ++high;
      // If points are sparse, includes a few more within a limit.
      std::uint32_t first = low, end_of_window = high;
      while (first > piece && i - first < kMinReach && squared_distance(first - 1, i) <= far2) --first;
      while (end_of_window < last && end_of_window - i <= kMinReach &&
             squared_distance(end_of_window, i) <= far2)
        ++end_of_window;
      windows_[i] = {first, end_of_window};
    }
    piece = last;
  }
}

/// Variance of the points across a line, from the noise along the ray of point i.
double ReferenceLines::variance_across(const FittedLine& line, std::size_t i,
                                       double range_variance_m2) const {
  const double cosine = line.nx * ux[i] + line.ny * uy[i];
  return range_variance_m2 * std::max(cosine * cosine, kMinIncidenceCosine2);
}

/// Residuals in excess of the expected noise, in standard deviations.
double ReferenceLines::excess(const FittedLine& line, std::size_t i, double range_variance_m2) const {
  return (line.variance() / variance_across(line, i, range_variance_m2) - 1) * std::sqrt(0.5 * line.count);
}

/// Finds corners and steps: points where two lines, one on each side, fit much better than a single line; of
/// neighbouring candidates the strongest.
void ReferenceLines::find_corners(double range_variance_m2) {
  corner_evidence_.assign(size(), 0);
  corners_.clear();
  for (std::uint32_t i = 0; i < size(); ++i) {
    const auto [first, last] = windows_[i];
    if (i - first + 1 < kMinSide || last - i < kMinSide) continue;
    const FittedLine across = moments_.line(first, last);
    if (excess(across, i, range_variance_m2) < kSuspiciousExcess) continue;
    const FittedLine left = moments_.line(first, i + 1), right = moments_.line(i, last);
    const double noise =
        std::max(variance_across(left, i, range_variance_m2), variance_across(right, i, range_variance_m2));
    const double gain = (across.squares - left.squares - right.squares) / noise;
    if (gain > kCornerEvidence) corner_evidence_[i] = static_cast<float>(gain);
  }
  for (std::uint32_t i = 0; i < size(); ++i) {
    if (corner_evidence_[i] <= 0) continue;
    const std::uint32_t first = i - (i - windows_[i].first) / 2, last = i + (windows_[i].last - i) / 2;
    bool strongest = true;
    for (std::uint32_t k = first; k < last && strongest; ++k)
      strongest =
          corner_evidence_[k] < corner_evidence_[i] || (corner_evidence_[k] == corner_evidence_[i] && k >= i);
    if (strongest) corners_.push_back(i);
  }
}

/// Ends each window at the adjacent corners; a corner itself keeps the side with more points.
void ReferenceLines::cut_windows_at_corners() {
  for (const std::uint32_t corner : corners_) {
    const auto [first, last] = windows_[corner];
    for (std::uint32_t i = first; i < last; ++i) {
      const bool left = i < corner || (i == corner && corner - first > last - corner);
      if (left) windows_[i].last = std::min(windows_[i].last, std::max(corner, i + 1));
      if (!left) windows_[i].first = std::max(windows_[i].first, std::min(corner + 1, i));
    }
    // Windows can extend beyond the corner's own, where points become denser towards it.
    for (std::uint32_t i = first; i-- > 0 && windows_[i].last > corner;) windows_[i].last = corner;
    for (std::uint32_t i = last; i < size() && windows_[i].first <= corner; ++i)
      windows_[i].first = corner + 1;
  }
}

/// Fits the longest segment around the point that is straight within the noise; if there is none, the
/// shortest.
void ReferenceLines::fit_point(std::uint32_t i, double range_variance_m2) {
  std::uint32_t before = i - windows_[i].first, after = windows_[i].last - i - 1;
  while (true) {
    const Window windows[] = {{i - before, i + after + 1}, {i - before, i + 1}, {i, i + after + 1}};
    const Window* best = nullptr;
    FittedLine best_line;
    double best_excess = kMaxExcess;
    for (const Window& window : windows) {
      if (window.size() < kMinSide) continue;
      const FittedLine line = moments_.line(window.first, window.last);
      const double excess_of_line = excess(line, i, range_variance_m2);
      if (excess_of_line > best_excess) continue;
      best = &window, best_line = line, best_excess = excess_of_line;
      if (best == windows) break;  // both sides: nothing better
    }
    if (best) {
      take(i, *best, best_line, variance_across(best_line, i, range_variance_m2) / scans[i]);
      smooth[i] = 1;
      return;
    }
    if (before <= 2 && after <= 2) break;
    before = std::min(before, std::max(2U, before / 2));
    after = std::min(after, std::max(2U, after / 2));
  }
  const Window window{i - before, i + after + 1};
  FittedLine line = moments_.line(window.first, window.last);
  if (window.size() < 2) line.nx = ux[i], line.ny = uy[i], line.d = points.range[i];
  take(i, window, line, std::max(line.variance(), range_variance_m2));
  smooth[i] = 0;
}

/// As published: through each point and its next neighbour (the last one of a scan that does not go all
/// around: its previous neighbour).
void ReferenceLines::fit_published() {
  const auto n = static_cast<std::uint32_t>(size());
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t first = i + 1 < n || i == 0 ? i : i - 1;
    const Window window{first, std::min(n, first + 2)};
    take(i, window, moments_.line(window.first, window.last), 0);
    smooth[i] = 1;
  }
  if (!closed) return;
  LineMoments across_the_seam;
  across_the_seam.assign({points.x[n - 1], points.x[0]}, {points.y[n - 1], points.y[0]});
  take(n - 1, {n - 1, n}, across_the_seam.line(0, 2), 0);
}

void ReferenceLines::take(std::uint32_t i, const Window& window, const FittedLine& line, double variance_m2) {
  nx[i] = static_cast<float>(line.nx);
  ny[i] = static_cast<float>(line.ny);
  d[i] = static_cast<float>(line.d);
  const double angle_variance = variance_m2 / std::max(line.count * line.along2, 1e-12);
  angle_sigma2[i] = static_cast<float>(std::min(kMaxAngleSigma2, angle_variance));
  centre[i] = static_cast<float>(line.centre);
  along2[i] = static_cast<float>(line.along2);
  begin[i] = window.first;
  end[i] = window.last;
}

void ReferenceLines::fill_index() {
  index_.assign(kIndexBins, kUnset);
  if (size() == 0) return;
  for (std::size_t i = 0; i < size(); ++i) {
    std::uint32_t& entry = index_[bin_of(ux[i], uy[i])];
    if (entry == kUnset) entry = static_cast<std::uint32_t>(i);
  }
  const auto last = static_cast<std::uint32_t>(size() - 1);
  const std::size_t first_bin = bin_of(ux[0], uy[0]), last_bin = bin_of(ux[last], uy[last]);
  std::uint32_t current = 0;
  for (std::size_t k = 0, b = first_bin; k < kIndexBins; ++k, b = (b + 1) % kIndexBins) {
    if (index_[b] == kUnset) index_[b] = current;
    current = index_[b];
  }
  // Unobserved sector: its first half belongs to the last point, the rest to the first.
  const std::size_t unseen = (first_bin + kIndexBins - last_bin - 1) % kIndexBins;
  if (last_bin == first_bin) return;
  for (std::size_t k = 0; k < unseen; ++k)
    index_[(last_bin + 1 + k) % kIndexBins] = k < unseen / 2 ? last : 0;
}

std::uint32_t ReferenceLines::start_index(float x, float y) const { return index_[bin_of(x, y)]; }

void ReferenceLines::shift_point(std::size_t index, float offset_m) {
  const float cosine = nx[index] * ux[index] + ny[index] * uy[index];
  if (std::abs(cosine) < 0.05F) return;
  const float along = offset_m / cosine;
  const float range = points.range[index] + along;
  if (!(range > 0)) return;
  points.range[index] = range;
  points.x[index] = ux[index] * range;
  points.y[index] = uy[index] * range;
}

}  // namespace hm
