#pragma once
#include <cstddef>
#include <map>

#include "hm/io/laser/laser_recording.hpp"

namespace hm::detail {

/// Brings the raw ranges of one stream's scans into the form that LaserScan promises, and counts what they
/// held besides returns.
class RangeSorter {
 public:
  /// What negative numbers mean in a format.
  enum class Negative { kInvalid, kNoReturn };
  explicit RangeSorter(Negative negative = Negative::kInvalid) : negative_(negative) {}

  /// 0, infinity, the scan's limit and beyond, and the error codes of SICK scanners (81.83 to 81.91) become
  /// LaserScan::kNoReturn; NaN, negative numbers and what is nearer than the near limit kInvalid.
  void sort(LaserScan& scan);
  /// Writes the counts into the stream, the most frequent markers first (at most eight).
  void report(LaserStream& stream) const;

 private:
  float no_return(float marker);
  float sorted(float range, const LaserScan& scan);
  Negative negative_;
  std::size_t no_returns_ = 0, invalid_ = 0;
  std::map<float, std::size_t> markers_;
};

}  // namespace hm::detail
