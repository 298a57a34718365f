#pragma once
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "hm/geometry/se2.hpp"
#include "hm/io/bytes/skip_counter.hpp"
#include "hm/io/laser/laser_ranges.hpp"
#include "hm/io/laser/laser_readers.hpp"

namespace hm::detail {

/// The numbers of a line, read from front to back: what is missing or no number makes ok() false.
class NumberReader {
 public:
  NumberReader(const std::vector<std::string_view>& columns, std::size_t first)
      : columns_(columns), next_(first) {}
  [[nodiscard]] bool ok() const { return ok_; }
  [[nodiscard]] std::size_t remaining() const { return ok_ ? columns_.size() - next_ : 0; }
  /// Any number, NaN too.
  double any();
  /// A finite number.
  double number();
  /// A whole number, 0 to a million; anything else fails.
  std::size_t count();
  Time stamp();
  SE2 pose();
  std::vector<float> floats(std::size_t count, double scale);
  void skip(std::size_t count);

 private:
  std::string_view next();
  const std::vector<std::string_view>& columns_;
  std::size_t next_;
  bool ok_ = true;
};

/// True for angles that a range finder can have.
bool is_plausible(const LaserScan& scan);

/// Gathers what the lines of a text log hold, and makes a recording of it.
class LaserLog {
 public:
  LaserLog(const std::filesystem::path& path, LaserRecordingKind kind, RangeSorter sorter = RangeSorter());

  /// Leaves a line out.
  void skip(SkippedLines::Reason reason, const TextLine& line);
  /// Leaves out a line that cannot be understood: cut off, when it is the last one and has no end.
  void skip_malformed(const TextLine& line);
  /// Adds a scan; one that no range finder can make is left out instead.
  void add_scan(const std::string& stream, LaserScan scan, const TextLine& line);
  void add_odometry(StampedPose pose, const TextLine& line);
  void add_truth(StampedPose pose, const TextLine& line);
  void note(std::string text) { recording_.notes.push_back(std::move(text)); }
  void set_mounting(const std::string& stream, const SE3& T_base_laser) { mountings_[stream] = T_base_laser; }
  void set_truth_source(std::string source) { recording_.truth_source = std::move(source); }

  /// Scan stamps whose microseconds lost their leading zeros get them back where that restores the order of
  /// the file (CARMEN's loggers wrote them as `%d.%d`); truth and odometry with the same stamps follow.
  void mend_stamps();
  /// The streams with the most scans first. An error when there is neither scan nor odometry.
  Result<LaserRecording> finish();

 private:
  template <class Item>
  struct Numbered {
    std::vector<Item> items;
    std::vector<std::size_t> lines;
  };
  LaserStream stream_of(const std::string& name, Numbered<LaserScan> scans);

  LaserRecording recording_;
  SkipCounter skips_;
  RangeSorter sorter_;
  std::map<std::string, Numbered<LaserScan>> scans_;
  std::map<std::string, SE3> mountings_;
  Numbered<StampedPose> odometry_, truth_;
};

/// Pairs of a stamp as written and as it must have been, so that `stamps` in the order of their file increase
/// with as few changes as possible; empty when zeros that were left out do not explain their disorder.
std::vector<MendedStamp> stamps_with_lost_zeros(const std::vector<Time>& stamps);

}  // namespace hm::detail
