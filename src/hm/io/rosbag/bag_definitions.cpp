#include "hm/io/rosbag/bag_definitions.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include "hm/core/check.hpp"
#include "hm/io/rosbag/bag_format.hpp"

namespace hm::detail {
namespace {

/// Message type with its fields and their types. The digest of a definition depends on its fields only.
struct Definition {
  std::string_view name;
  std::string_view fields;
  std::vector<std::string_view> parts;
};

const std::vector<Definition>& definitions() {
  static const std::vector<Definition> kDefinitions{
      {kLaserScanType.name,
       "Header header\n"
       "float32 angle_min\nfloat32 angle_max\nfloat32 angle_increment\n"
       "float32 time_increment\nfloat32 scan_time\n"
       "float32 range_min\nfloat32 range_max\n"
       "float32[] ranges\nfloat32[] intensities\n",
       {"std_msgs/Header"}},
      {kImuType.name,
       "Header header\n"
       "geometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n"
       "geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n"
       "geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n",
       {"std_msgs/Header", "geometry_msgs/Quaternion", "geometry_msgs/Vector3"}},
      {kRangeType.name,
       "Header header\n"
       "uint8 ULTRASOUND=0\nuint8 INFRARED=1\nuint8 radiation_type\n"
       "float32 field_of_view\nfloat32 min_range\nfloat32 max_range\nfloat32 range\n",
       {"std_msgs/Header"}},
      {kOdometryType.name,
       "Header header\nstring child_frame_id\n"
       "geometry_msgs/PoseWithCovariance pose\ngeometry_msgs/TwistWithCovariance twist\n",
       {"std_msgs/Header", "geometry_msgs/PoseWithCovariance", "geometry_msgs/TwistWithCovariance"}},
      {kPoseType.name, "Header header\nPose pose\n", {"std_msgs/Header", "geometry_msgs/Pose"}},
      {kTransformsType.name,
       "geometry_msgs/TransformStamped[] transforms\n",
       {"geometry_msgs/TransformStamped"}},
      {"geometry_msgs/TransformStamped",
       "Header header\nstring child_frame_id\nTransform transform\n",
       {"std_msgs/Header", "geometry_msgs/Transform"}},
      {"geometry_msgs/Transform",
       "Vector3 translation\nQuaternion rotation\n",
       {"geometry_msgs/Vector3", "geometry_msgs/Quaternion"}},
      {"std_msgs/Header", "uint32 seq\ntime stamp\nstring frame_id\n", {}},
      {"geometry_msgs/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n", {}},
      {"geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n", {}},
      {"geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n", {}},
      {"geometry_msgs/Pose",
       "Point position\nQuaternion orientation\n",
       {"geometry_msgs/Point", "geometry_msgs/Quaternion"}},
      {"geometry_msgs/PoseWithCovariance", "Pose pose\nfloat64[36] covariance\n", {"geometry_msgs/Pose"}},
      {"geometry_msgs/Twist", "Vector3  linear\nVector3  angular\n", {"geometry_msgs/Vector3"}},
      {"geometry_msgs/TwistWithCovariance", "Twist twist\nfloat64[36] covariance\n", {"geometry_msgs/Twist"}},
  };
  return kDefinitions;
}

const Definition& definition_of(std::string_view name) {
  const auto found = std::ranges::find(definitions(), name, &Definition::name);
  HM_CHECK(found != definitions().end(), "no definition of {}", name);
  return *found;
}

/// Appends all nested types of a type, each once, before their own nested types.
void add_parts(const Definition& definition, std::vector<std::string_view>& parts) {
  for (const std::string_view part : definition.parts) {
    if (std::ranges::find(parts, part) == parts.end()) parts.push_back(part);
    add_parts(definition_of(part), parts);
  }
}

}  // namespace

std::string bag_message_definition(std::string_view type) {
  const Definition& definition = definition_of(type);
  std::string text(definition.fields);
  std::vector<std::string_view> parts;
  add_parts(definition, parts);
  for (const std::string_view part : parts) {
    text += "\n" + std::string(80, '=') + "\nMSG: ";
    text += part;
    text += "\n";
    text += definition_of(part).fields;
  }
  return text;
}

}  // namespace hm::detail
