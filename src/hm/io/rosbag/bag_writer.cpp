#include "hm/io/rosbag/bag_writer.hpp"

#include <algorithm>
#include <cstring>
#include <limits>
#include <map>
#include <string_view>
#include <vector>

#include "hm/core/check.hpp"
#include "hm/io/bytes/output_file.hpp"
#include "hm/io/rosbag/bag_definitions.hpp"
#include "hm/io/rosbag/bag_format.hpp"

namespace hm {
namespace {

using detail::BagMessageType;
using detail::BagOp;

/// Bytes of a record, appended as little-endian values.
class RecordBytes {
 public:
  template <class T>
  RecordBytes& value(T number) {
    static_assert(std::is_arithmetic_v<T>);
    char raw[sizeof(T)];
    std::memcpy(raw, &number, sizeof(T));
    text_.append(raw, sizeof(T));
    return *this;
  }
  RecordBytes& floats(std::initializer_list<double> numbers) {
    for (const double number : numbers) value(static_cast<float>(number));
    return *this;
  }
  RecordBytes& vector(const Vec3& v) { return value(v.x()).value(v.y()).value(v.z()); }
  RecordBytes& covariance(std::size_t count, double first = 0) {
    value(first);
    for (std::size_t i = 1; i < count; ++i) value(0.0);
    return *this;
  }
  RecordBytes& text(std::string_view characters) {
    value(static_cast<std::uint32_t>(characters.size()));
    text_ += characters;
    return *this;
  }
  RecordBytes& raw(std::string_view bytes) {
    text_ += bytes;
    return *this;
  }
  RecordBytes& time(Time time) {
    constexpr std::int64_t kSecond_ns = 1'000'000'000;
    HM_CHECK(time.ns > 0 && time.ns / kSecond_ns <= std::numeric_limits<std::uint32_t>::max(),
             "a bag cannot hold the time {} ns", time.ns);
    value(static_cast<std::uint32_t>(time.ns / kSecond_ns));
    return value(static_cast<std::uint32_t>(time.ns % kSecond_ns));
  }
  RecordBytes& pose(const SE3& pose) {
    const Eigen::Quaterniond q = pose.quaternion();
    return vector(pose.translation()).value(q.x()).value(q.y()).value(q.z()).value(q.w());
  }
  [[nodiscard]] const std::string& str() const { return text_; }
  [[nodiscard]] std::size_t size() const { return text_.size(); }

 private:
  std::string text_;
};

/// Record: fields of its header, then data.
class BagRecord {
 public:
  explicit BagRecord(BagOp op) { field("op", RecordBytes().value(static_cast<std::uint8_t>(op))); }
  BagRecord& field(std::string_view name, const RecordBytes& bytes) { return field(name, bytes.str()); }
  BagRecord& field(std::string_view name, std::string_view bytes) {
    header_.text(std::string(name) + "=" + std::string(bytes));
    return *this;
  }
  [[nodiscard]] std::string with(std::string_view data) const {
    return RecordBytes().text(header_.str()).text(data).str();
  }
  [[nodiscard]] std::size_t header_size() const { return header_.size(); }

 private:
  RecordBytes header_;
};

struct Connection {
  std::uint32_t id = 0;
  BagMessageType type;
  std::string topic;
  std::uint32_t next_sequence = 0;
};

std::string connection_record(const Connection& connection) {
  const RecordBytes about =
      RecordBytes()
          .text("topic=" + connection.topic)
          .text("type=" + std::string(connection.type.name))
          .text("md5sum=" + std::string(connection.type.md5sum))
          .text("message_definition=" + detail::bag_message_definition(connection.type.name));
  return BagRecord(BagOp::kConnection)
      .field("conn", RecordBytes().value(connection.id))
      .field("topic", connection.topic)
      .with(about.str());
}

/// Position of a message in its chunk.
struct IndexEntry {
  Time received;
  std::uint32_t offset = 0;
};
using ChunkIndex = std::map<std::uint32_t, std::vector<IndexEntry>>;  // by connection

}  // namespace

struct BagWriter::Impl {
  explicit Impl(std::filesystem::path path) : file(std::move(path)) {
    put(detail::kBagMagic);
    put(bag_header(0));  // space for the real one
  }

  void put(std::string_view bytes) {
    file.write(bytes);
    position += bytes.size();
  }
  [[nodiscard]] std::string bag_header(std::uint64_t index_position) const;
  Connection& connection(const BagTopic& topic, const BagMessageType& type);
  RecordBytes message_header(const BagTopic& topic, const BagMessageType& type, Time stamp);
  void add(const BagTopic& topic, Time received, const RecordBytes& message);
  void close_chunk();

  OutputFile file;
  std::uint64_t position = 0;
  std::map<std::string, Connection> connections;  // by topic
  std::string chunk;
  ChunkIndex index;
  std::vector<std::string> chunk_infos;
};

std::string BagWriter::Impl::bag_header(std::uint64_t index_position) const {
  const BagRecord record =
      BagRecord(BagOp::kBagHeader)
          .field("index_pos", RecordBytes().value(index_position))
          .field("conn_count", RecordBytes().value(static_cast<std::uint32_t>(connections.size())))
          .field("chunk_count", RecordBytes().value(static_cast<std::uint32_t>(chunk_infos.size())));
  return record.with(std::string(detail::kBagHeaderRecordBytes - record.header_size(), ' '));
}

Connection& BagWriter::Impl::connection(const BagTopic& topic, const BagMessageType& type) {
  const auto [place, is_new] = connections.try_emplace(topic.name);
  Connection& connection = place->second;
  if (is_new) {
    connection = {static_cast<std::uint32_t>(connections.size() - 1), type, topic.name, 0};
    chunk += connection_record(connection);
  }
  HM_CHECK(connection.type.name == type.name, "topic {} holds {}, not {}", topic.name, connection.type.name,
           type.name);
  return connection;
}

RecordBytes BagWriter::Impl::message_header(const BagTopic& topic, const BagMessageType& type, Time stamp) {
  RecordBytes bytes;
  bytes.value(connection(topic, type).next_sequence++).time(stamp).text(topic.frame_id);
  return bytes;
}

void BagWriter::Impl::add(const BagTopic& topic, Time received, const RecordBytes& message) {
  constexpr std::size_t kChunkBytes = 768 * 1024;
  const std::uint32_t id = connections.at(topic.name).id;
  index[id].push_back({received, static_cast<std::uint32_t>(chunk.size())});
  chunk += BagRecord(BagOp::kMessage)
               .field("conn", RecordBytes().value(id))
               .field("time", RecordBytes().time(received))
               .with(message.str());
  if (chunk.size() >= kChunkBytes) close_chunk();
}

void BagWriter::Impl::close_chunk() {
  if (index.empty()) return;
  const std::uint64_t chunk_position = position;
  put(BagRecord(BagOp::kChunk)
          .field("compression", "none")
          .field("size", RecordBytes().value(static_cast<std::uint32_t>(chunk.size())))
          .with(chunk));
  Time first = index.begin()->second.front().received, last = first;
  RecordBytes counts;
  for (auto& [id, entries] : index) {
    std::ranges::stable_sort(entries, {}, &IndexEntry::received);
    first = std::min(first, entries.front().received);
    last = std::max(last, entries.back().received);
    counts.value(id).value(static_cast<std::uint32_t>(entries.size()));
    RecordBytes places;
    for (const IndexEntry& entry : entries) places.time(entry.received).value(entry.offset);
    put(BagRecord(BagOp::kIndex)
            .field("ver", RecordBytes().value(std::uint32_t{1}))
            .field("conn", RecordBytes().value(id))
            .field("count", RecordBytes().value(static_cast<std::uint32_t>(entries.size())))
            .with(places.str()));
  }
  chunk_infos.push_back(BagRecord(BagOp::kChunkInfo)
                            .field("ver", RecordBytes().value(std::uint32_t{1}))
                            .field("chunk_pos", RecordBytes().value(chunk_position))
                            .field("start_time", RecordBytes().time(first))
                            .field("end_time", RecordBytes().time(last))
                            .field("count", RecordBytes().value(static_cast<std::uint32_t>(index.size())))
                            .with(counts.str()));
  chunk.clear();
  index.clear();
}

BagWriter::BagWriter(std::filesystem::path path) : impl_(std::make_unique<Impl>(std::move(path))) {}
BagWriter::~BagWriter() = default;
BagWriter::BagWriter(BagWriter&&) noexcept = default;
BagWriter& BagWriter::operator=(BagWriter&&) noexcept = default;

void BagWriter::write_scan(const BagTopic& topic, Time received, const LaserScan& scan) {
  HM_CHECK(scan.size() > 0);
  RecordBytes message = impl_->message_header(topic, detail::kLaserScanType, scan.stamp);
  const auto beams = static_cast<double>(scan.size());
  message.floats({scan.angle_min_rad, scan.angle_rad(scan.size() - 1), scan.angle_increment_rad,
                  scan.time_increment_s, beams * scan.time_increment_s, scan.range_min_m, scan.range_max_m});
  message.value(static_cast<std::uint32_t>(scan.size()));
  for (const float range : scan.ranges_m) message.value(range);
  message.value(std::uint32_t{0});  // no intensities
  impl_->add(topic, received, message);
}

void BagWriter::write_imu(const BagTopic& topic, Time received, const ImuSample& sample) {
  constexpr std::size_t kCovariance = 9;
  RecordBytes message = impl_->message_header(topic, detail::kImuType, sample.stamp);
  const Eigen::Quaterniond q =
      sample.R_world_imu ? Eigen::Quaterniond(*sample.R_world_imu) : Eigen::Quaterniond(0, 0, 0, 0);
  message.value(q.x()).value(q.y()).value(q.z()).value(q.w());
  message.covariance(kCovariance, sample.R_world_imu ? 0 : -1);
  message.vector(sample.angular_velocity_rad_s).covariance(kCovariance);
  message.vector(sample.specific_force_m_s2).covariance(kCovariance);
  impl_->add(topic, received, message);
}

void BagWriter::write_range(const BagTopic& topic, Time received, const RangeReading& reading) {
  constexpr std::uint8_t kInfrared = 1;
  RecordBytes message = impl_->message_header(topic, detail::kRangeType, reading.stamp);
  message.value(kInfrared).floats({0, reading.range_min_m, reading.range_max_m, reading.range_m});
  impl_->add(topic, received, message);
}

void BagWriter::write_odometry(const BagTopic& topic, Time received, const OdometryReading& reading) {
  constexpr std::size_t kCovariance = 36;
  RecordBytes message = impl_->message_header(topic, detail::kOdometryType, reading.pose.stamp);
  message.text(topic.child_frame_id).pose(reading.pose.T_world_base).covariance(kCovariance);
  message.vector(reading.linear_velocity_base_m_s).vector(reading.angular_velocity_base_rad_s);
  message.covariance(kCovariance);
  impl_->add(topic, received, message);
}

void BagWriter::write_pose(const BagTopic& topic, Time received, const StampedPose& pose) {
  RecordBytes message = impl_->message_header(topic, detail::kPoseType, pose.stamp);
  impl_->add(topic, received, message.pose(pose.T_world_base));
}

void BagWriter::write_transforms(const std::string& topic, Time received,
                                 std::span<const FrameTransform> transforms) {
  impl_->connection({topic, {}}, detail::kTransformsType);
  RecordBytes message;
  message.value(static_cast<std::uint32_t>(transforms.size()));
  for (const FrameTransform& transform : transforms)
    message.value(std::uint32_t{0})
        .time(transform.stamp)
        .text(transform.parent)
        .text(transform.child)
        .pose(transform.T_parent_child);
  impl_->add({topic, {}}, received, message);
}

void BagWriter::flush() {
  impl_->close_chunk();
  impl_->file.hand_over();
}

Result<void> BagWriter::finish() {
  impl_->close_chunk();
  const std::uint64_t index_position = impl_->position;
  for (const auto& [topic, connection] : impl_->connections) impl_->put(connection_record(connection));
  for (const std::string& info : impl_->chunk_infos) impl_->put(info);
  impl_->file.rewrite(detail::kBagMagic.size(), impl_->bag_header(index_position));
  return impl_->file.finish();
}

}  // namespace hm
