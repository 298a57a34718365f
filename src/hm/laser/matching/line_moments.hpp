#pragma once
#include <cmath>
#include <cstdint>
#include <vector>

namespace hm {

/// A line nx * x + ny * y = d through points, by total least squares.
struct FittedLine {
  double nx = 1, ny = 0, d = 0;
  double squares = 0;  ///< sum of squared distances of the points, m2
  double count = 0;    ///< points
  double along2 = 0;   ///< mean squared distance from their centre along the line, m2
  double centre = 0;   ///< where that is along the line: ny * x - nx * y, m
  /// Variance across the line, from the residuals.
  [[nodiscard]] double variance() const { return count > 2 ? squares / (count - 2) : 0; }
};

/// Running sums over points, so that a line through any stretch of them takes constant time.
class LineMoments {
 public:
  void assign(const std::vector<float>& x, const std::vector<float>& y);
  /// The line through points [first, last), which are at least one.
  [[nodiscard]] FittedLine line(std::uint32_t first, std::uint32_t last) const;

 private:
  struct Sums {
    double x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  };
  std::vector<Sums> before_;
};

}  // namespace hm
