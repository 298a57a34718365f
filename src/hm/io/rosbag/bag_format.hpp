#pragma once
#include <cstdint>
#include <string_view>

/// Constants of the bag format, version 2.0 (docs/file_formats.md).
namespace hm::detail {

inline constexpr std::string_view kBagMagic = "#ROSBAG V2.0\n";
/// Size in bytes of the padded bag header record after the magic.
inline constexpr std::uint32_t kBagHeaderRecordBytes = 4096;

/// Type of a record: the field `op` of its header.
enum class BagOp : std::uint8_t {
  kMessage = 2,
  kBagHeader = 3,
  kIndex = 4,
  kChunk = 5,
  kChunkInfo = 6,
  kConnection = 7,
};

/// Message type of a connection: its name and the MD5 sum of its definition.
struct BagMessageType {
  std::string_view name;
  std::string_view md5sum;
};
inline constexpr BagMessageType kLaserScanType{"sensor_msgs/LaserScan", "90c7ef2dc6895d81024acba2ac42f369"};
inline constexpr BagMessageType kImuType{"sensor_msgs/Imu", "6a62c6daae103f4ff57a132d6f95cec2"};
inline constexpr BagMessageType kRangeType{"sensor_msgs/Range", "c005c34273dc426c67a020a87bc24148"};
inline constexpr BagMessageType kOdometryType{"nav_msgs/Odometry", "cd5e73d190d741a2f92e81eda573aca7"};
inline constexpr BagMessageType kPoseType{"geometry_msgs/PoseStamped", "d3812c3cbc69362b77dc0b19b345f8f5"};
inline constexpr BagMessageType kTransformsType{"tf2_msgs/TFMessage", "94810edda583a504dfda3829e70d7eec"};
inline constexpr std::string_view kOldTransformsName = "tf/tfMessage";  // of the same definition

}  // namespace hm::detail
