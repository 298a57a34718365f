#include "hm/laser/matching/line_moments.hpp"

#include <algorithm>

namespace hm {

void LineMoments::assign(const std::vector<float>& x, const std::vector<float>& y) {
  before_.resize(x.size() + 1);
  Sums sum;
  before_[0] = sum;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double px = x[i], py = y[i];
    sum.x += px, sum.y += py, sum.xx += px * px, sum.xy += px * py, sum.yy += py * py;
    before_[i + 1] = sum;
  }
}

FittedLine LineMoments::line(std::uint32_t first, std::uint32_t last) const {
  const Sums &a = before_[first], &b = before_[last];
  const double count = last - first, inverse = 1 / count;
  const double cx = (b.x - a.x) * inverse, cy = (b.y - a.y) * inverse;
  const double sxx = std::max(0.0, (b.xx - a.xx) * inverse - cx * cx);
  const double syy = std::max(0.0, (b.yy - a.yy) * inverse - cy * cy);
  const double sxy = (b.xy - a.xy) * inverse - cx * cy;
  const double half_difference = 0.5 * (sxx - syy), middle = 0.5 * (sxx + syy);
  const double root = std::sqrt(half_difference * half_difference + sxy * sxy);
  double tx = half_difference + root, ty = sxy;
  if (half_difference < 0) tx = sxy, ty = root - half_difference;
  const double length = std::sqrt(tx * tx + ty * ty);
  FittedLine line;
  if (length > 0) line.nx = -ty / length, line.ny = tx / length;
  line.d = line.nx * cx + line.ny * cy;
  line.centre = line.ny * cx - line.nx * cy;
  line.squares = std::max(0.0, middle - root) * count;
  line.count = count;
  line.along2 = middle + root;
  return line;
}

}  // namespace hm
