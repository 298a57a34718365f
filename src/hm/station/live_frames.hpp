#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/station/live_store.hpp"

namespace hm {

// Frames of `/live` as structs: docs/file_formats.md, Live view, has the layout of each. Lengths in metres,
// in `map`.

inline constexpr std::uint8_t kLiveVersion = 1;
inline constexpr std::size_t kLiveHeaderBytes = 16;

/// Kind 2. Vertices (12 bytes each) and indices as meshoptimizer encoded them.
struct MeshPageFrame {
  PageKey key;
  std::uint32_t version = 0;
  std::uint8_t level = 0;
  bool has_colors = false;
  std::uint32_t vertices = 0, indices = 0;
  Eigen::Vector3f origin_m = Eigen::Vector3f::Zero();
  float quantum_m = 0;
  float age_s = 0;  ///< when the page was put; the server adds the time until it is sent
  std::vector<std::byte> vertex_bytes, index_bytes;
};
/// Where the age stands in a mesh page's payload.
inline constexpr std::size_t kMeshPageAgeOffset = 52;

/// Kind 3.
struct PageGoneFrame {
  PageKey key;
  std::uint32_t version = 0;
};

/// Kind 4.
struct PoseFrame {
  enum class Which : std::uint8_t { kCamera, kVehicle, kEnd };
  enum class State : std::uint8_t { kTracked, kLost, kEstimated, kEnd };
  Which which = Which::kCamera;
  State state = State::kTracked;
  float deviation_m = std::numeric_limits<float>::quiet_NaN();  ///< 1 sigma of the position; NaN: unknown
  Vec3 position_m = Vec3::Zero();
  Eigen::Quaternionf orientation = Eigen::Quaternionf::Identity();  ///< of the body in `map`
  float half_width_rad = 0, half_height_rad = 0;                    ///< of the field of view; 0: none
};

/// Kind 5: a piece of a path.
struct PathFrame {
  enum class Which : std::uint8_t { kTrajectory, kKeyframes, kTruth, kWayPoints, kEnd };
  Which which = Which::kTrajectory;
  std::uint32_t first = 0;  ///< index of the first point
  std::uint32_t total = 0;  ///< points of the whole path now
  std::vector<Eigen::Vector3f> points_m;
};

/// Kind 6.
struct ScanFrame {
  enum class Which : std::uint8_t { kLaser, kObstacles, kEnd };
  Which which = Which::kLaser;
  std::vector<Eigen::Vector3f> points_m;
};

/// Kind 7.
struct PlanFrame {
  enum class State : std::uint8_t { kNone, kValid, kRefused, kEnd };
  State state = State::kNone;
  std::string reason;  ///< why it was refused
  std::vector<Eigen::Vector3f> points_m;
};

/// Kind 8: a square of an occupancy slice.
struct GridTileFrame {
  std::int32_t x = 0, y = 0;
  std::uint32_t version = 0;
  float cell_m = 0, height_m = 0;
  std::uint16_t side = 0;           ///< cells
  std::vector<std::uint8_t> cells;  ///< side * side, x fastest: 0 unknown, 1 free ... 255 occupied
};

/// Kind 11: an encoded picture.
struct PictureFrame {
  enum class Which : std::uint8_t { kColor, kDepth, kEnd };
  enum class Format : std::uint8_t { kJpeg, kPng, kEnd };
  Which which = Which::kColor;
  Format format = Format::kJpeg;
  std::uint16_t width = 0, height = 0;
  std::vector<std::byte> file;
};

/// Kinds 1, 9, 10 and 12: JSON.
struct JsonFrame {
  std::string text;
};

using LiveFrame = std::variant<MeshPageFrame, PageGoneFrame, PoseFrame, PathFrame, ScanFrame, PlanFrame,
                               GridTileFrame, PictureFrame, JsonFrame>;

/// The payload of a frame, without its header.
std::vector<std::byte> to_payload(const LiveFrame& frame);

/// The 16 bytes before a payload.
std::vector<std::byte> live_header(LiveKind kind, std::uint32_t sequence, Time stamp);

/// A frame as a viewer receives it.
struct LiveMessage {
  LiveKind kind = LiveKind::kHello;
  std::uint32_t sequence = 0;
  Time stamp;
  LiveFrame frame;
};

/// Decodes a payload. Errors: kTruncated, kCorrupted (bytes left over, an enumerator that is none, counts
/// that contradict the size), kUnsupported (the kind). JSON is not looked into.
Result<LiveFrame> decode_live_payload(LiveKind kind, std::span<const std::byte> payload);
/// Decodes header and payload; other versions are kUnsupported.
Result<LiveMessage> decode_live_message(std::span<const std::byte> bytes);

/// Bytes of a text.
std::vector<std::byte> text_bytes(std::string_view text);
std::string_view bytes_text(std::span<const std::byte> bytes);

}  // namespace hm
