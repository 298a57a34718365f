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

/// Reads the numbers of a line in order; a missing or invalid number makes ok() false.
class NumberReader {
 public:
  NumberReader(const std::vector<std::string_view>& columns, std::size_t first)
      : columns_(columns), next_(first) {}
  [[nodiscard]] bool ok() const { return ok_; }
  [[nodiscard]] std::size_t remaining() const { return ok_ ? columns_.size() - next_ : 0; }
  /// Any number, including NaN.
  double any();
  /// A finite number.
  double number();
  /// Integer from 0 to a million; anything else makes ok() false.
  std::size_t count();
  Time stamp();
  SE2 pose();
  /// Of the last pose, as written: not wrapped.
  [[nodiscard]] double heading_rad() const { return heading_rad_; }
  std::vector<float> floats(std::size_t count, double scale);
  void skip(std::size_t count);

 private:
  std::string_view next();
  const std::vector<std::string_view>& columns_;
  std::size_t next_;
  double heading_rad_ = 0;
  bool ok_ = true;
};

/// Collects the contents of a text log line by line and builds a recording.
class LaserLog {
 public:
  LaserLog(const std::filesystem::path& path, LaserRecordingKind kind, RangeSorter sorter = RangeSorter());

  /// Counts a line as skipped.
  void skip(SkippedLines::Reason reason, const TextLine& line);
  /// Counts an unreadable line as malformed, or as truncated if it is the last one and has no line end.
  void skip_malformed(const TextLine& line, std::string why = {});
  /// Adds a scan; one with a problem_of() is skipped and counted.
  void add_scan(const std::string& stream, LaserScan scan, const TextLine& line);
  void add_odometry(StampedPose pose, const TextLine& line);
  void add_heading(const WrittenHeading& heading) { recording_.written_headings.push_back(heading); }
  void add_truth(StampedPose pose, const TextLine& line);
  void note(std::string text) { recording_.notes.push_back(std::move(text)); }
  void set_mounting(const std::string& stream, const SE3& T_base_laser) { mountings_[stream] = T_base_laser; }
  void set_truth_source(std::string source) { recording_.truth_source = std::move(source); }

  /// Corrects scan stamps whose microseconds lack leading zeros (CARMEN's loggers wrote them as `%d.%d`)
  /// where that restores the order of the file. Truth and odometry with the same stamps are corrected
  /// likewise.
  void mend_stamps();
  /// Returns the recording, streams with the most scans first. Error when there is neither scan nor odometry.
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

/// Pairs of a written and a corrected stamp such that `stamps`, in file order, increase with as few changes
/// as possible; empty when missing zeros do not explain the disorder.
std::vector<CorrectedStamp> stamps_with_lost_zeros(const std::vector<Time>& stamps);

}  // namespace hm::detail
