#include <fmt/format.h>
#include <algorithm>
#include <map>
#include <set>

#include "hm/core/text/counted.hpp"
#include "hm/io/bytes/skip_counter.hpp"
#include "hm/io/laser/laser_bag_frames.hpp"
#include "hm/io/laser/laser_ranges.hpp"
#include "hm/io/laser/laser_readers.hpp"
#include "hm/io/rosbag/bag_format.hpp"
#include "hm/io/rosbag/bag_messages.hpp"
#include "hm/io/rosbag/bag_records.hpp"

namespace hm::detail {
namespace {

/// Messages of one topic, with their numbers (from 1) and times of arrival.
template <class Message>
struct Topic {
  struct Arrived {
    Message message;
    Time received;
  };
  std::vector<Arrived> arrived;
  std::vector<std::size_t> numbers;
  std::size_t seen = 0;
  SkipCounter skips = SkipCounter::of_messages({});
};

/// Reason for skipping a message, if any.
using Verdict = std::optional<ReadingProblem>;

Verdict judge(const ScanMessage& message) { return problem_of(message.scan); }

Verdict judge(const ImuMessage& message) {
  const bool finite =
      message.sample.angular_velocity_rad_s.allFinite() && message.sample.specific_force_m_s2.allFinite();
  return finite ? Verdict{} : ReadingProblem{SkippedLines::Reason::kNotFinite, {}};
}

Verdict judge(const RangeMessage& message) {
  return message.reading.range_m >= 0 ? Verdict{} : ReadingProblem{SkippedLines::Reason::kNotFinite, {}};
}

Verdict judge(const PoseMessage& message) {
  if (!message.position_m.allFinite() || !message.quaternion.allFinite())
    return ReadingProblem{SkippedLines::Reason::kNotFinite, {}};
  return rotation_of(message.quaternion) ? Verdict{} : ReadingProblem{SkippedLines::Reason::kNotRigid, {}};
}

/// All topics of one message type.
template <class Message>
class Topics {
 public:
  using Parser = std::optional<Message> (*)(MessageBytes);
  Topics(const BagMessageType& type, Parser parse, std::string wanted)
      : type_(type), parse_(parse), wanted_(std::move(wanted)) {}

  void add(const BagMessage& bag_message) {
    const BagConnection& connection = bag_message.connection;
    if (connection.type != type_.name || (!wanted_.empty() && connection.topic != wanted_)) return;
    if (connection.md5sum != type_.md5sum && connection.md5sum != "*") {
      other_versions_.insert(connection.topic);
      return;
    }
    auto& topic = topics_.try_emplace(connection.topic).first->second;
    if (++topic.seen == 1) topic.skips = SkipCounter::of_messages(connection.topic);
    auto message = parse_(bag_message.data);
    Verdict problem = message ? judge(*message) : ReadingProblem{SkippedLines::Reason::kMalformed, {}};
    if (problem) {
      topic.skips.add(problem->reason, topic.seen, std::move(problem->why));
      return;
    }
    // Drivers without stamps write zero: the time of arrival is used instead.
    if (message->header.stamp.ns == 0) message->header.stamp = bag_message.received;
    topic.arrived.push_back({std::move(*message), bag_message.received});
    topic.numbers.push_back(topic.seen);
  }

  /// Topics with at least one message, most messages first.
  std::vector<std::pair<std::string, Topic<Message>>> by_size() {
    std::vector<std::pair<std::string, Topic<Message>>> sorted;
    for (auto& [name, topic] : topics_) sorted.emplace_back(name, std::move(topic));
    std::ranges::stable_sort(sorted, std::ranges::greater{},
                             [](const auto& entry) { return entry.second.arrived.size(); });
    return sorted;
  }

  /// Error when the user's topic does not exist, with the topics of the bag (`topics`, in words); adds a note
  /// about unreadable message versions.
  Result<void> check(LaserRecording& recording, const std::string& topics) const {
    for (const std::string& topic : other_versions_)
      recording.notes.push_back(
          fmt::format("{} has another version of {}, which cannot be read", topic, type_.name));
    if (wanted_.empty() || topics_.contains(wanted_)) return {};
    return fail(ErrorCode::kNotFound, recording.path, "no topic `{}` of type {}; {}", wanted_, type_.name,
                topics);
  }

 private:
  BagMessageType type_;
  Parser parse_;
  std::string wanted_;
  std::map<std::string, Topic<Message>> topics_;
  std::set<std::string> other_versions_;
};

/// Messages of a topic sorted by stamp; skipped ones are counted.
template <class Message>
std::vector<typename Topic<Message>::Arrived> in_order(Topic<Message>& topic, LaserRecording& recording) {
  auto kept = keep_increasing(
      std::move(topic.arrived), topic.numbers,
      [](const auto& arrived) { return arrived.message.header.stamp; }, topic.skips);
  add_skipped(recording, topic.skips.take());
  return kept;
}

/// Topic with most messages, sorted by stamp; a note lists the others.
template <class Message>
std::vector<typename Topic<Message>::Arrived> busiest(Topics<Message>& topics, LaserRecording& recording,
                                                      std::string* name = nullptr) {
  auto sorted = topics.by_size();
  if (sorted.empty()) return {};
  for (std::size_t i = 1; i < sorted.size(); ++i)
    recording.notes.push_back(fmt::format("{} ({}) is not used: {} has more", sorted[i].first,
                                          counted(sorted[i].second.seen, "message"), sorted[0].first));
  if (name != nullptr) *name = sorted[0].first;
  return in_order(sorted[0].second, recording);
}

Trajectory trajectory_of(std::vector<typename Topic<PoseMessage>::Arrived> arrived) {
  Trajectory trajectory;
  for (const auto& [message, received] : arrived)
    trajectory.push_back({message.header.stamp, SE3(*rotation_of(message.quaternion), message.position_m)});
  return trajectory;
}

LaserStream stream_of(const std::string& name, std::vector<typename Topic<ScanMessage>::Arrived> arrived) {
  LaserStream stream{.name = name, .frame_id = arrived.front().message.header.frame_id};
  RangeSorter sorter;
  for (auto& [message, received] : arrived) {
    message.scan.stamp = message.header.stamp;
    sorter.sort(message.scan);
    stream.scans.push_back(std::move(message.scan));
    stream.received.push_back(received);
  }
  sorter.report(stream);
  return stream;
}

/// All topics of a bag, read or not.
class TopicCounts {
 public:
  void add(const BagMessage& message) {
    Seen& seen = by_name_[message.connection.topic];
    if (seen.messages++ == 0) seen.type = message.connection.type;
  }
  /// "topics of the bag: /scan (sensor_msgs/LaserScan, 20), ..."
  [[nodiscard]] std::string words() const {
    constexpr std::size_t kMost = 20;
    std::vector<std::string> names;
    for (const auto& [name, seen] : by_name_) {
      if (names.size() == kMost) break;
      names.push_back(fmt::format("{} ({}, {})", name, seen.type, seen.messages));
    }
    if (names.empty()) return "the bag holds no messages";
    return fmt::format("topics of the bag (type, messages): {}{}", fmt::join(names, ", "),
                       by_name_.size() > kMost ? fmt::format(" and {} more", by_name_.size() - kMost) : "");
  }

 private:
  struct Seen {
    std::string type;
    std::size_t messages = 0;
  };
  std::map<std::string, Seen> by_name_;
};

/// Relevant contents of a bag.
struct BagContents {
  explicit BagContents(const LaserRecordingOptions& options)
      : scans(kLaserScanType, parse_laser_scan, options.scan_topic),
        imu(kImuType, parse_imu, options.imu_topic),
        ranges(kRangeType, parse_range, options.range_topic),
        odometry(kOdometryType, parse_odometry, options.odometry_topic),
        poses(kPoseType, parse_pose, options.pose_topic) {}
  void add(const BagMessage& message) {
    scans.add(message);
    imu.add(message);
    ranges.add(message);
    odometry.add(message);
    poses.add(message);
    frames.add(message);
  }
  Topics<ScanMessage> scans;
  Topics<ImuMessage> imu;
  Topics<RangeMessage> ranges;
  Topics<PoseMessage> odometry, poses;
  BagFrames frames;
};

void fill(BagContents& contents, LaserRecording& recording) {
  for (auto& [name, topic] : contents.scans.by_size())
    if (auto arrived = in_order(topic, recording); !arrived.empty())
      recording.lasers.push_back(stream_of(name, std::move(arrived)));
  for (const auto& [message, received] : busiest(contents.imu, recording)) {
    recording.imu.push_back(message.sample);
    recording.imu.back().stamp = message.header.stamp;
  }
  for (const auto& [message, received] : busiest(contents.ranges, recording, &recording.range.name)) {
    if (recording.range.readings.empty()) recording.range.frame_id = message.header.frame_id;
    RangeReading& reading = recording.range.readings.emplace_back(message.reading);
    reading.stamp = message.header.stamp;
    if (reading.range_m >= reading.range_max_m) reading.range_m = std::numeric_limits<double>::infinity();
  }
  std::string odometry_topic, odometry_child;
  auto odometry = busiest(contents.odometry, recording, &odometry_topic);
  if (!odometry.empty()) {
    recording.odometry_source = fmt::format("{} ({})", odometry_topic, kOdometryType.name);
    odometry_child = odometry.front().message.child_frame_id;
  }
  recording.odometry = trajectory_of(std::move(odometry));
  contents.frames.apply(odometry_child, recording);
  std::string pose_topic;
  recording.truth = trajectory_of(busiest(contents.poses, recording, &pose_topic));
  if (!recording.truth.empty())
    recording.truth_source = fmt::format("topic {} ({})", pose_topic, kPoseType.name);
}

void tell_damage(const BagSummary& summary, LaserRecording& recording) {
  constexpr std::size_t kMostProblems = 5;
  if (!summary.indexed)
    recording.notes.push_back("the bag was never closed (no index): read from its chunks");
  for (std::size_t i = 0; i < std::min(kMostProblems, summary.problems.size()); ++i)
    recording.damage.push_back(summary.problems[i]);
  if (summary.problems.size() > kMostProblems)
    recording.damage.push_back(
        fmt::format("and {} more damaged places", summary.problems.size() - kMostProblems));
  recording.notes.insert(recording.notes.end(), recording.damage.begin(), recording.damage.end());
  if (!summary.problems.empty() || !summary.indexed)
    recording.notes.push_back(fmt::format("{} in {} could be read", counted(summary.messages, "message"),
                                          counted(summary.chunks, "chunk")));
  if (summary.lost_messages > 0)
    recording.notes.push_back(fmt::format("{} left out: the file does not describe their connections",
                                          counted(summary.lost_messages, "message")));
  // The notes list the places; `skipped` has their number.
  const std::string file = recording.path.filename().string();
  if (!summary.problems.empty())
    recording.skipped.push_back(
        {SkippedLines::Reason::kDamaged, file, summary.problems.size(), 0, "part", summary.problems.front()});
  if (summary.lost_messages > 0)
    recording.skipped.push_back({SkippedLines::Reason::kMalformed, file, summary.lost_messages, 0, "message",
                                 "of a connection that the file does not describe"});
}

}  // namespace

Result<LaserRecording> read_laser_bag(const std::filesystem::path& path,
                                      const LaserRecordingOptions& options) {
  LaserRecording recording{.kind = LaserRecordingKind::kRosBag, .path = path};
  BagContents contents(options);
  TopicCounts topics;
  const auto summary = read_bag(path, [&](const BagMessage& message) {
    topics.add(message);
    contents.add(message);
  });
  if (!summary) return forward_error(summary);
  tell_damage(*summary, recording);
  for (const auto& checked :
       {contents.scans.check(recording, topics.words()), contents.imu.check(recording, topics.words()),
        contents.ranges.check(recording, topics.words()), contents.odometry.check(recording, topics.words()),
        contents.poses.check(recording, topics.words())})
    if (!checked) return forward_error(checked);
  fill(contents, recording);
  if (recording.lasers.empty() && recording.imu.empty() && recording.odometry.empty() &&
      recording.range.readings.empty())
    return fail(ErrorCode::kNotFound, path, "{} messages, but none of {}, {}, {} or {}; {}{}{}",
                summary->messages, kLaserScanType.name, kImuType.name, kOdometryType.name, kRangeType.name,
                topics.words(), recording.notes.empty() ? "" : "; ", fmt::join(recording.notes, "; "));
  return recording;
}

}  // namespace hm::detail
