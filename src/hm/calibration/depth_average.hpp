#pragma once
#include <cstdint>

#include "hm/sensors/rgbd_frame.hpp"

namespace hm {

/// Mean and standard deviation of each pixel over depth images of a static scene (Welford 1962). Missing
/// readings (0) are ignored.
class DepthAverage {
 public:
  DepthAverage() = default;
  DepthAverage(int width, int height);
  /// Adds an image of the same size; its unit may differ.
  void add(const DepthImage& depth);

  [[nodiscard]] int width() const { return mean_m_.width(); }
  [[nodiscard]] int height() const { return mean_m_.height(); }
  [[nodiscard]] int images() const { return images_; }
  [[nodiscard]] int count(int x, int y) const { return count_(x, y); }
  /// Mean in metres; 0 without readings.
  [[nodiscard]] double mean_m(int x, int y) const { return mean_m_(x, y); }
  /// Sample standard deviation, metres; 0 for fewer than two readings.
  [[nodiscard]] double sigma_m(int x, int y) const;

 private:
  Image<double> mean_m_, squares_;
  Image<std::int32_t> count_;
  int images_ = 0;
};

}  // namespace hm
