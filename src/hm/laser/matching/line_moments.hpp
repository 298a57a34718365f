#pragma once
#include <cmath>
#include <cstdint>
#include <vector>

namespace hm {

/// Line nx * x + ny * y = d fitted to points by total least squares, metres.
struct FittedLine {
  double nx = 1, ny = 0, d = 0;
  double squares = 0;  ///< sum of squared distances of the points, m2
  double count = 0;    ///< number of points
  double along2 = 0;   ///< variance of the points along the line, m2
  double centre = 0;   ///< position of their centroid along the line: ny * x - nx * y, m
  /// Variance across the line from the residuals, m2.
  [[nodiscard]] double variance() const { return count > 2 ? squares / (count - 2) : 0; }
};

/// Prefix sums over points: fits a line to any range of consecutive points in constant time.
class LineMoments {
 public:
  void assign(const std::vector<float>& x, const std::vector<float>& y);
  /// Line through points [first, last), at least one.
  [[nodiscard]] FittedLine line(std::uint32_t first, std::uint32_t last) const;

 private:
  struct Sums {
    double x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  };
  std::vector<Sums> before_;
};

}  // namespace hm
