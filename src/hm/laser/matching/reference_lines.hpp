#pragma once
#include <cstdint>
#include <vector>

#include "hm/laser/matching/line_moments.hpp"
#include "hm/laser/matching/planar_scan.hpp"

namespace hm {

/// Points of a scan in single precision, seen from its origin, in order of bearing.
struct ScanPoints {
  std::vector<float> x, y, range;
  [[nodiscard]] std::size_t size() const { return x.size(); }
  /// Takes the finite points over; sorts if the scan is not in order of bearing.
  void assign(const PlanarScan& scan);
  void clear();
};

/// The standard deviation of a range, from the second differences of neighbouring ranges (median absolute
/// deviation): walls are nearly straight over three beams, noise is not. Metres; at least 0.5 mm.
double estimate_range_sigma(const ScanPoints& points, std::vector<float>& scratch);

struct LineFitParams {
  double half_length_m = 0.3;  ///< 0: the line through a point and its next neighbour
  double range_sigma_m = 0.01;
};

/// The reference of a match: a line of the surface at each of its points, and an index from bearing to point.
///
/// With a half length, each line is fitted to the points within it on both sides, but not across corners and
/// steps, which are found where two lines explain the points much better than one (Chow's test), and shorter
/// where nothing longer is straight.
class ReferenceLines {
 public:
  /// A point and its unit direction, side by side for the search.
  struct Ray {
    float x, y, ux, uy;
  };
  // One entry per point, all seen from the scan's origin.
  ScanPoints points;
  std::vector<float> ux, uy;              ///< unit direction towards the point
  std::vector<Ray> rays;                  ///< points and directions once more
  std::vector<float> nx, ny, d;           ///< line: nx * x + ny * y = d
  std::vector<float> angle_sigma2;        ///< variance of the normal's angle, rad2
  std::vector<float> centre, along2;      ///< of the points that it was fitted to: see FittedLine
  std::vector<float> scans;               ///< how many scans were averaged here
  std::vector<std::uint32_t> begin, end;  ///< points that the line was fitted to
  std::vector<std::uint8_t> smooth;       ///< the fit is as good as the noise allows
  /// The scan goes all around: its first point is the neighbour of its last one.
  bool closed = false;

  [[nodiscard]] std::size_t size() const { return points.size(); }
  /// Lines for `points` and `scans`, which the caller has filled.
  void fit(const LineFitParams& params);
  /// The point to begin a search at for something seen in direction (x, y).
  [[nodiscard]] std::uint32_t start_index(float x, float y) const;
  /// Moves a point along its own ray until it is `offset_m` beyond where it was, measured along its normal.
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
