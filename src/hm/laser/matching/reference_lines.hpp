#pragma once
#include <cstdint>
#include <vector>

#include "hm/laser/matching/line_moments.hpp"
#include "hm/laser/matching/planar_scan.hpp"

namespace hm {

/// Points of a scan in single precision, relative to its origin, sorted by bearing.
struct ScanPoints {
  std::vector<float> x, y, range;
  [[nodiscard]] std::size_t size() const { return x.size(); }
  /// Copies the finite points; sorts them by bearing if necessary.
  void assign(const PlanarScan& scan);
  void clear();
};

/// Estimates the standard deviation of a range in metres from second differences of neighbouring ranges
/// (median absolute deviation), since walls are nearly straight over three beams. At least 0.5 mm.
double estimate_range_sigma(const ScanPoints& points, std::vector<float>& scratch);

struct LineFitParams {
  double half_length_m = 0.3;  ///< 0: line through a point and its next neighbour
  double range_sigma_m = 0.01;
};

/// Reference of a match: a surface line at each point, and an index from bearing to point.
///
/// With a half length, each line is fitted to the points within it on both sides, but not across corners and
/// steps, which are detected where two lines fit the points much better than one (Chow's test); it is
/// shortened where the surface is curved.
class ReferenceLines {
 public:
  /// Point and its unit direction, interleaved for the search.
  struct Ray {
    float x, y, ux, uy;
  };
  // One entry per point, all relative to the scan's origin.
  ScanPoints points;
  std::vector<float> ux, uy;              ///< unit direction towards the point
  std::vector<Ray> rays;                  ///< copy of points and directions
  std::vector<float> nx, ny, d;           ///< line: nx * x + ny * y = d
  std::vector<float> angle_sigma2;        ///< variance of the normal's angle, rad2
  std::vector<float> centre, along2;      ///< of the fitted points: see FittedLine
  std::vector<float> scans;               ///< number of averaged scans
  std::vector<std::uint32_t> begin, end;  ///< range of fitted points
  std::vector<std::uint8_t> smooth;       ///< residuals agree with the noise
  /// True for a full-circle scan, whose first and last points are neighbours.
  bool closed = false;

  [[nodiscard]] std::size_t size() const { return points.size(); }
  /// Fits lines to `points` and `scans`, filled by the caller.
  void fit(const LineFitParams& params);
  /// Start point of a search in direction (x, y).
  [[nodiscard]] std::uint32_t start_index(float x, float y) const;
  /// Moves a point along its own ray by `offset_m` measured along its normal.
  void shift_point(std::size_t index, float offset_m);

 private:
  struct Window {
    std::uint32_t first = 0, last = 0;
    [[nodiscard]] std::uint32_t size() const { return last - first; }
  };
  void find_directions();
  [[nodiscard]] bool goes_all_around() const;
  void find_windows(const LineFitParams& params);
  void find_corners(double range_variance_m2);
  void cut_windows_at_corners();
  [[nodiscard]] double variance_across(const FittedLine& line, std::size_t i, double range_variance_m2) const;
  [[nodiscard]] double excess(const FittedLine& line, std::size_t i, double range_variance_m2) const;
  void fit_point(std::uint32_t i, double range_variance_m2);
  void fit_published();
  void take(std::uint32_t i, const Window& window, const FittedLine& line, double variance_m2);
  void fill_index();

  std::vector<Window> windows_;
  std::vector<float> corner_evidence_;
  std::vector<std::uint32_t> corners_;
  LineMoments moments_;
  std::vector<std::uint32_t> index_;
};

}  // namespace hm
