#pragma once
#include <cstddef>
#include <map>
#include <optional>
#include <string>

#include "hm/io/bytes/skipped_lines.hpp"
#include "hm/io/laser/laser_recording.hpp"

namespace hm::detail {

/// What makes a reading useless: SkippedLines::reason and why.
struct ReadingProblem {
  SkippedLines::Reason reason;
  std::string why;
};
/// The problem of a scan's angles and limits, if they are not those of a range finder.
std::optional<ReadingProblem> problem_of(const LaserScan& scan);

/// Converts the raw ranges of one stream's scans to the conventions of LaserScan, and counts the values that
/// are not returns.
class RangeSorter {
 public:
  /// Meaning of negative ranges in a format.
  enum class Negative { kInvalid, kNoReturn };
  explicit RangeSorter(Negative negative = Negative::kInvalid) : negative_(negative) {}

  /// Converts 0, infinity, values at or beyond the scan's limit, and the error codes of SICK scanners (81.83
  /// to 81.91) to LaserScan::kNoReturn; NaN, negative numbers (see Negative) and values below the near limit
  /// to kInvalid.
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
