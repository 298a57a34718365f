#pragma once
#include <optional>
#include <span>

#include "hm/core/params.hpp"
#include "hm/core/time.hpp"

namespace hm {

/// Parameters of the published method, with the values of its original implementation.
struct HistogramHeightParams {
  /// Width of a bin of the histogram.
  static constexpr double kBinSize_m = 0.02;
  int min_values = 5;
  double max_stdev_m = 0.10;
  double max_height_jump_m = 0.25;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"min_values", {1, 1000}, "minimum number of readings in the fullest bin"}, self.min_values);
    v(ParamDoc{"max_stdev_m", {0.001, 1}, "bins with a larger standard deviation are rejected"},
      self.max_stdev_m);
    v(ParamDoc{"max_height_jump_m", {0.01, 5}, "a larger jump between scans is taken as a step of the floor"},
      self.max_height_jump_m);
  }
};

/// Height by the method as published (dissertation 2.2.3): the mean of the fullest bin of a histogram; a jump
/// between two scans is attributed to the floor. Kept as the baseline for `HeightEstimator`: it drifts,
/// because every step adds the vehicle's motion during one scan to the floor level; bin edges split modes;
/// known floors are not recognised.
class HistogramHeight {
 public:
  struct Answer {
    double height_m = 0, climb_m_s = 0, stdev_m = 0, floor_level_m = 0;
  };
  explicit HistogramHeight(const HistogramHeightParams& params = {}) : params_(params) {}
  /// Processes one scan of vertical distances, base to floor; nothing when there are too few or their spread
  /// is too large.
  std::optional<Answer> update(Time time, std::span<const double> distances_m);

 private:
  HistogramHeightParams params_;
  std::optional<Answer> last_;
  Time last_time_;
  double floor_m_ = 0;
};

}  // namespace hm
