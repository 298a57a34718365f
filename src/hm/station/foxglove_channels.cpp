#include "hm/station/foxglove_channels.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <utility>
#include <variant>
#include <vector>

#include "hm/core/bytes/little_endian.hpp"
#include "hm/core/check.hpp"
#include "hm/io/bytes/json.hpp"
#include "hm/station/live_frames.hpp"

namespace hm {
namespace {

constexpr const char* kMap = "map";
// Directions of a LaserScan that is made from the points of a scan: half a degree each.
constexpr std::size_t kRays = 720;
constexpr int kFloat32 = 7;  // foxglove.NumericType

struct Description {
  const char* topic;
  const char* schema_name;
  LiveKind source;
};

Description description_of(FoxgloveChannel channel) {
  switch (channel) {
    case FoxgloveChannel::kTransforms:
      return {"/tf", "foxglove.FrameTransforms", LiveKind::kPose};
    case FoxgloveChannel::kCameraPose:
      return {"/camera/pose", "foxglove.PoseInFrame", LiveKind::kPose};
    case FoxgloveChannel::kVehiclePose:
      return {"/vehicle/pose", "foxglove.PoseInFrame", LiveKind::kPose};
    case FoxgloveChannel::kTrajectory:
      return {"/trajectory", "foxglove.PosesInFrame", LiveKind::kPath};
    case FoxgloveChannel::kKeyframes:
      return {"/keyframes", "foxglove.PosesInFrame", LiveKind::kPath};
    case FoxgloveChannel::kWayPoints:
      return {"/way_points", "foxglove.PosesInFrame", LiveKind::kPath};
    case FoxgloveChannel::kLaserScan:
      return {"/laser/scan", "foxglove.LaserScan", LiveKind::kScan};
    case FoxgloveChannel::kLaserPoints:
      return {"/laser/points", "foxglove.PointCloud", LiveKind::kScan};
    case FoxgloveChannel::kObstacles:
      return {"/obstacles", "foxglove.PointCloud", LiveKind::kScan};
    case FoxgloveChannel::kLog:
      return {"/log", "foxglove.Log", LiveKind::kEvent};
  }
  HM_CHECK(false, "channel {}", static_cast<int>(channel));
}

// Schemas: JSON Schema of the messages, put together from their parts.
JsonValue type(const char* name) { return JsonValue::object({{"type", name}}); }
JsonValue object(std::initializer_list<std::pair<std::string, JsonValue>> members) {
  return JsonValue::object({{"type", "object"}, {"properties", JsonValue::object(members)}});
}
JsonValue list_of(JsonValue items) {
  return JsonValue::object({{"type", "array"}, {"items", std::move(items)}});
}
JsonValue numbers(std::initializer_list<const char*> names) {
  auto members = JsonValue::object();
  for (const char* name : names) members[name] = type("number");
  return JsonValue::object({{"type", "object"}, {"properties", members}});
}

JsonValue schema_of(std::string_view name) {
  const JsonValue time = object({{"sec", type("integer")}, {"nsec", type("integer")}});
  const JsonValue vector = numbers({"x", "y", "z"}), quaternion = numbers({"x", "y", "z", "w"});
  const JsonValue pose = object({{"position", vector}, {"orientation", quaternion}});
  const JsonValue text = type("string");
  if (name == "foxglove.FrameTransforms")
    return object({{"transforms", list_of(object({{"timestamp", time},
                                                  {"parent_frame_id", text},
                                                  {"child_frame_id", text},
                                                  {"translation", vector},
                                                  {"rotation", quaternion}}))}});
  if (name == "foxglove.PoseInFrame")
    return object({{"timestamp", time}, {"frame_id", text}, {"pose", pose}});
  if (name == "foxglove.PosesInFrame")
    return object({{"timestamp", time}, {"frame_id", text}, {"poses", list_of(pose)}});
  if (name == "foxglove.LaserScan")
    return object({{"timestamp", time},
                   {"frame_id", text},
                   {"pose", pose},
                   {"start_angle", type("number")},
                   {"end_angle", type("number")},
                   {"ranges", list_of(type("number"))},
                   {"intensities", list_of(type("number"))}});
  if (name == "foxglove.PointCloud")
    return object({{"timestamp", time},
                   {"frame_id", text},
                   {"pose", pose},
                   {"point_stride", type("integer")},
                   {"fields", list_of(object(
                                  {{"name", text}, {"offset", type("integer")}, {"type", type("integer")}}))},
                   {"data", JsonValue::object({{"type", "string"}, {"contentEncoding", "base64"}})}});
  return object({{"timestamp", time},
                 {"level", type("integer")},
                 {"message", text},
                 {"name", text},
                 {"file", text},
                 {"line", type("integer")}});
}

JsonValue time_json(Time stamp) {
  return JsonValue::object({{"sec", stamp.ns / 1'000'000'000}, {"nsec", stamp.ns % 1'000'000'000}});
}
JsonValue vector_json(const Vec3& v) { return JsonValue::object({{"x", v.x()}, {"y", v.y()}, {"z", v.z()}}); }
JsonValue quaternion_json(const Eigen::Quaterniond& q) {
  return JsonValue::object({{"x", q.x()}, {"y", q.y()}, {"z", q.z()}, {"w", q.w()}});
}
JsonValue pose_json(const Vec3& position, const Eigen::Quaterniond& orientation) {
  return JsonValue::object(
      {{"position", vector_json(position)}, {"orientation", quaternion_json(orientation)}});
}

std::string base64(const std::vector<std::uint8_t>& bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k) bits = bits << 8 | (k < count ? bytes[i + k] : 0u);
    for (std::size_t k = 0; k < 4; ++k) text += k <= count ? kDigits[bits >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

template <class Frame>
struct Stamped {
  Time stamp;
  Frame frame;
};

/// Frames of a kind that show `which`.
template <class Frame, class Which>
std::vector<Stamped<Frame>> frames_of(const LiveStore& store, LiveKind kind, Which which) {
  std::vector<Stamped<Frame>> result;
  for (const LiveItem& item : store.items(kind)) {
    auto decoded = decode_live_payload(kind, *item.payload);
    if (!decoded) continue;  // a producer's fault: viewers of the page count it
    auto* frame = std::get_if<Frame>(&*decoded);
    if (frame && frame->which == which) result.push_back({item.stamp, std::move(*frame)});
  }
  return result;
}

std::optional<Stamped<PoseFrame>> pose_of(const LiveStore& store, PoseFrame::Which which) {
  auto frames = frames_of<PoseFrame>(store, LiveKind::kPose, which);
  if (frames.empty()) return std::nullopt;
  return std::move(frames.front());
}

std::optional<FoxgloveMessage> transforms(const LiveStore& store) {
  auto list = JsonValue::array();
  Time newest;
  for (const auto& [which, name] :
       {std::pair{PoseFrame::Which::kCamera, "camera"}, std::pair{PoseFrame::Which::kVehicle, "base"}}) {
    const auto pose = pose_of(store, which);
    if (!pose) continue;
    newest = std::max(newest, pose->stamp);
    list.push_back(
        JsonValue::object({{"timestamp", time_json(pose->stamp)},
                           {"parent_frame_id", kMap},
                           {"child_frame_id", name},
                           {"translation", vector_json(pose->frame.position_m)},
                           {"rotation", quaternion_json(pose->frame.orientation.cast<double>())}}));
  }
  if (list.as_array()->empty()) return std::nullopt;
  return FoxgloveMessage{newest, JsonValue::object({{"transforms", list}})};
}

std::optional<FoxgloveMessage> pose_message(const LiveStore& store, PoseFrame::Which which) {
  const auto pose = pose_of(store, which);
  if (!pose) return std::nullopt;
  return FoxgloveMessage{pose->stamp,
                         JsonValue::object({{"timestamp", time_json(pose->stamp)},
                                            {"frame_id", kMap},
                                            {"pose", pose_json(pose->frame.position_m,
                                                               pose->frame.orientation.cast<double>())}})};
}

/// The pieces of a path joined; their order is that of the points, and what lies beyond the newest total is
/// dropped.
std::optional<FoxgloveMessage> path_message(const LiveStore& store, PathFrame::Which which) {
  auto pieces = frames_of<PathFrame>(store, LiveKind::kPath, which);
  if (pieces.empty()) return std::nullopt;
  const auto newest = std::max_element(pieces.begin(), pieces.end(),
                                       [](const auto& a, const auto& b) { return a.stamp < b.stamp; });
  const Time stamp = newest->stamp;
  const std::uint32_t total = newest->frame.total;
  std::stable_sort(pieces.begin(), pieces.end(),
                   [](const auto& a, const auto& b) { return a.frame.first < b.frame.first; });
  auto poses = JsonValue::array();
  for (const auto& piece : pieces)
    for (std::size_t i = 0; i < piece.frame.points_m.size() && piece.frame.first + i < total; ++i)
      poses.push_back(pose_json(piece.frame.points_m[i].cast<double>(), Eigen::Quaterniond::Identity()));
  return FoxgloveMessage{
      stamp, JsonValue::object({{"timestamp", time_json(stamp)}, {"frame_id", kMap}, {"poses", poses}})};
}

std::optional<FoxgloveMessage> cloud_message(const LiveStore& store, ScanFrame::Which which) {
  const auto scans = frames_of<ScanFrame>(store, LiveKind::kScan, which);
  if (scans.empty()) return std::nullopt;
  const auto& [stamp, scan] = scans.front();
  constexpr std::size_t kStride = 12;
  std::vector<std::uint8_t> bytes(scan.points_m.size() * kStride);
  for (std::size_t i = 0; i < scan.points_m.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k)
      store_little_endian(bytes.data() + i * kStride + 4 * k, scan.points_m[i][static_cast<Eigen::Index>(k)]);
  auto fields = JsonValue::array();
  for (const auto& [name, offset] : {std::pair{"x", 0}, std::pair{"y", 4}, std::pair{"z", 8}})
    fields.push_back(JsonValue::object({{"name", name}, {"offset", offset}, {"type", kFloat32}}));
  return FoxgloveMessage{stamp,
                         JsonValue::object({{"timestamp", time_json(stamp)},
                                            {"frame_id", kMap},
                                            {"pose", pose_json(Vec3::Zero(), Eigen::Quaterniond::Identity())},
                                            {"point_stride", static_cast<std::int64_t>(kStride)},
                                            {"fields", fields},
                                            {"data", base64(bytes)}})};
}

/// The scan as ranges about the vehicle, or the camera where there is none: the nearest point in each
/// direction of the plane, 0 where there is no point.
std::optional<FoxgloveMessage> scan_message(const LiveStore& store) {
  const auto scans = frames_of<ScanFrame>(store, LiveKind::kScan, ScanFrame::Which::kLaser);
  auto pose = pose_of(store, PoseFrame::Which::kVehicle);
  if (!pose) pose = pose_of(store, PoseFrame::Which::kCamera);
  if (scans.empty() || !pose) return std::nullopt;
  const auto& [stamp, scan] = scans.front();
  const Vec3 origin = pose->frame.position_m;
  const Vec3 ahead = pose->frame.orientation.cast<double>() * Vec3::UnitX();
  const double yaw = std::atan2(ahead.y(), ahead.x());
  std::vector<double> ranges(kRays, 0.0);
  constexpr double kStep = 2 * std::numbers::pi / kRays;
  for (const auto& point : scan.points_m) {
    const double x = point.x() - origin.x(), y = point.y() - origin.y();
    const double range = std::hypot(x, y);
    if (!(range > 0) || !std::isfinite(range)) continue;
    const double turns = (std::atan2(y, x) - yaw) / (2 * std::numbers::pi) + 0.5;
    const double share = turns - std::floor(turns);
    double& nearest = ranges[static_cast<std::size_t>(share * kRays) % kRays];
    if (nearest == 0 || range < nearest) nearest = range;
  }
  const Eigen::Quaterniond level(Eigen::AngleAxisd(yaw, Vec3::UnitZ()));
  return FoxgloveMessage{stamp, JsonValue::object({{"timestamp", time_json(stamp)},
                                                   {"frame_id", kMap},
                                                   {"pose", pose_json(origin, level)},
                                                   {"start_angle", -std::numbers::pi + kStep / 2},
                                                   {"end_angle", std::numbers::pi - kStep / 2},
                                                   {"ranges", JsonValue::array_of(ranges)},
                                                   {"intensities", JsonValue::array()}})};
}

}  // namespace

JsonValue foxglove_advertisement(FoxgloveChannel channel) {
  const Description description = description_of(channel);
  return JsonValue::object(
      {{"id", static_cast<std::int64_t>(channel)},
       {"topic", description.topic},
       {"encoding", "json"},
       {"schemaName", description.schema_name},
       {"schemaEncoding", "jsonschema"},
       {"schema", to_json_text(schema_of(description.schema_name), JsonStyle::kCompact)}});
}

LiveKind foxglove_source(FoxgloveChannel channel) { return description_of(channel).source; }

std::optional<FoxgloveMessage> foxglove_message(const LiveStore& store, FoxgloveChannel channel) {
  switch (channel) {
    case FoxgloveChannel::kTransforms:
      return transforms(store);
    case FoxgloveChannel::kCameraPose:
      return pose_message(store, PoseFrame::Which::kCamera);
    case FoxgloveChannel::kVehiclePose:
      return pose_message(store, PoseFrame::Which::kVehicle);
    case FoxgloveChannel::kTrajectory:
      return path_message(store, PathFrame::Which::kTrajectory);
    case FoxgloveChannel::kKeyframes:
      return path_message(store, PathFrame::Which::kKeyframes);
    case FoxgloveChannel::kWayPoints:
      return path_message(store, PathFrame::Which::kWayPoints);
    case FoxgloveChannel::kLaserScan:
      return scan_message(store);
    case FoxgloveChannel::kLaserPoints:
      return cloud_message(store, ScanFrame::Which::kLaser);
    case FoxgloveChannel::kObstacles:
      return cloud_message(store, ScanFrame::Which::kObstacles);
    case FoxgloveChannel::kLog:
      break;
  }
  return std::nullopt;
}

std::optional<FoxgloveMessage> foxglove_log(const LiveItem& event) {
  const auto json = parse_json(bytes_text(*event.payload), "event");
  const JsonValue* level = json ? json->find("level") : nullptr;
  const JsonValue* text = json ? json->find("text") : nullptr;
  if (!level || !level->as_string() || !text) return std::nullopt;
  const int severity = *level->as_string() == "error" ? 4 : *level->as_string() == "warning" ? 3 : 2;
  return FoxgloveMessage{event.stamp, JsonValue::object({{"timestamp", time_json(event.stamp)},
                                                         {"level", severity},
                                                         {"message", *text},
                                                         {"name", "housemartin"},
                                                         {"file", ""},
                                                         {"line", 0}})};
}

}  // namespace hm
