#include "hm/io/laser/laser_log.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "hm/core/text/counted.hpp"

namespace hm::detail {

std::string_view NumberReader::next() {
  if (!ok_ || next_ >= columns_.size()) {
    ok_ = false;
    return {};
  }
  return columns_[next_++];
}

double NumberReader::any() {
  const auto value = parse_number(next());
  ok_ = ok_ && value.has_value();
  return value.value_or(0);
}

double NumberReader::number() {
  const double value = any();
  ok_ = ok_ && std::isfinite(value);
  return ok_ ? value : 0;
}

std::size_t NumberReader::count() {
  constexpr double kMost = 1e6;
  const double value = number();
  ok_ = ok_ && value >= 0 && value <= kMost && value == std::floor(value);
  return ok_ ? static_cast<std::size_t>(value) : 0;
}

Time NumberReader::stamp() {
  const auto value = parse_stamp(next());
  ok_ = ok_ && value.has_value();
  return value.value_or(Time{});
}

SE2 NumberReader::pose() {
  const double x_m = number(), y_m = number();
  heading_rad_ = number();
  return {x_m, y_m, heading_rad_};
}

std::vector<float> NumberReader::floats(std::size_t count, double scale) {
  std::vector<float> values;
  ok_ = ok_ && count <= remaining();
  for (std::size_t i = 0; ok_ && i < count; ++i) values.push_back(static_cast<float>(any() * scale));
  return values;
}

void NumberReader::skip(std::size_t count) {
  ok_ = ok_ && count <= remaining();
  if (ok_) next_ += count;
}

LaserLog::LaserLog(const std::filesystem::path& path, LaserRecordingKind kind, RangeSorter sorter)
    : skips_(path), sorter_(sorter) {
  recording_.kind = kind;
  recording_.path = path;
}

void LaserLog::skip(SkippedLines::Reason reason, const TextLine& line) { skips_.add(reason, line.number); }

void LaserLog::skip_malformed(const TextLine& line, std::string why) {
  if (line.ended)
    skips_.add(SkippedLines::Reason::kMalformed, line.number, std::move(why));
  else
    skip(SkippedLines::Reason::kCutOff, line);
}

void LaserLog::add_scan(const std::string& stream, LaserScan scan, const TextLine& line) {
  if (auto problem = problem_of(scan)) {
    skips_.add(problem->reason, line.number, std::move(problem->why));
    return;
  }
  auto& scans = scans_[stream];
  scans.items.push_back(std::move(scan));
  scans.lines.push_back(line.number);
}

void LaserLog::add_odometry(StampedPose pose, const TextLine& line) {
  odometry_.items.push_back(std::move(pose));
  odometry_.lines.push_back(line.number);
}

void LaserLog::add_truth(StampedPose pose, const TextLine& line) {
  truth_.items.push_back(std::move(pose));
  truth_.lines.push_back(line.number);
}

LaserStream LaserLog::stream_of(const std::string& name, Numbered<LaserScan> scans) {
  LaserStream stream{.name = name};
  RangeSorter sorter = sorter_;
  stream.scans = keep_increasing(
      std::move(scans.items), scans.lines, [](const LaserScan& scan) { return scan.stamp; }, skips_);
  for (LaserScan& scan : stream.scans) sorter.sort(scan);
  sorter.report(stream);
  stream.T_base_laser = mountings_[name];
  return stream;
}

void LaserLog::mend_stamps() {
  for (auto& [name, scans] : scans_) {
    std::vector<Time> stamps;
    for (const LaserScan& scan : scans.items) stamps.push_back(scan.stamp);
    const auto corrected = stamps_with_lost_zeros(stamps);
    if (corrected.empty()) continue;
    const auto correct = [&](Time& stamp) {
      const auto found = std::ranges::lower_bound(corrected, stamp, {}, &CorrectedStamp::written);
      if (found != corrected.end() && found->written == stamp) stamp = found->corrected;
    };
    for (LaserScan& scan : scans.items) correct(scan.stamp);
    for (StampedPose& pose : truth_.items) correct(pose.stamp);
    for (StampedPose& pose : odometry_.items) correct(pose.stamp);
    recording_.corrected_stamps.insert(recording_.corrected_stamps.end(), corrected.begin(), corrected.end());
    note(fmt::format("{} of {} ran backwards because zeros after the decimal point were missing; corrected",
                     counted(corrected.size(), "stamp"), name));
  }
  std::ranges::sort(recording_.corrected_stamps, {}, &CorrectedStamp::written);
}

Result<LaserRecording> LaserLog::finish() {
  for (auto& [name, scans] : scans_)
    if (auto stream = stream_of(name, std::move(scans)); !stream.scans.empty())
      recording_.lasers.push_back(std::move(stream));
  std::ranges::stable_sort(recording_.lasers, std::ranges::greater{},
                           [](const LaserStream& stream) { return stream.scans.size(); });
  const auto stamp_of = [](const StampedPose& pose) { return pose.stamp; };
  recording_.odometry = keep_increasing(std::move(odometry_.items), odometry_.lines, stamp_of, skips_);
  recording_.truth = keep_increasing(std::move(truth_.items), truth_.lines, stamp_of, skips_);
  if (recording_.truth.empty()) recording_.truth_source.clear();
  add_skipped(recording_, skips_.take());
  if (recording_.lasers.empty() && recording_.odometry.empty())
    return fail(ErrorCode::kCorrupted, recording_.path, "no line of this {} holds a scan or odometry{}{}",
                to_string(recording_.kind), recording_.notes.empty() ? "" : ": ",
                fmt::join(recording_.notes, "; "));
  return std::move(recording_);
}

}  // namespace hm::detail
