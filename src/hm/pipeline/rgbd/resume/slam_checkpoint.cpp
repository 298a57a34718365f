#include "hm/pipeline/rgbd/resume/slam_checkpoint.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <string_view>

#include "hm/core/hash.hpp"
#include "hm/io/bytes/byte_cursor.hpp"
#include "hm/io/bytes/file_bytes.hpp"

namespace hm {
namespace {

constexpr std::string_view kStateMagic = "hmslamst";
constexpr std::uint32_t kStateFileVersion = 7;

}  // namespace

Error cannot_continue(Error error) {
  error.message += fmt::format("; the run cannot be continued: {}", kStartAnew);
  return error;
}

MapSession MapSession::of(const std::filesystem::path& recording, const RecordingOptions& options,
                          std::size_t frames) {
  MapSession session;
  session.recording = std::filesystem::absolute(recording).lexically_normal().string();
  session.frames = frames;
  if (options.kind) session.kind = static_cast<int>(*options.kind);
  session.depth_units_per_m = options.depth_units_per_m;
  if (!options.calibration.empty())
    session.calibration = std::filesystem::absolute(options.calibration).lexically_normal().string();
  if (options.camera) {
    const PinholeCamera& c = *options.camera;
    const LensDistortion& d = c.distortion;
    session.camera = {static_cast<double>(c.width),
                      static_cast<double>(c.height),
                      c.fx,
                      c.fy,
                      c.cx,
                      c.cy,
                      d.k1,
                      d.k2,
                      d.p1,
                      d.p2,
                      d.k3};
  }
  return session;
}

RecordingOptions MapSession::options() const {
  RecordingOptions options;
  if (kind) options.kind = static_cast<RecordingKind>(*kind);
  options.depth_units_per_m = depth_units_per_m;
  options.calibration = calibration;
  if (camera) {
    const auto& n = *camera;
    options.camera =
        PinholeCamera{static_cast<int>(n[0]),         static_cast<int>(n[1]), n[2], n[3], n[4], n[5],
                      {n[6], n[7], n[8], n[9], n[10]}};
  }
  return options;
}

std::vector<KeyframePlace> keyframe_places(const CorrectedKeyframes& keyframes) {
  std::vector<KeyframePlace> places;
  for (const CorrectedKeyframe& keyframe : keyframes.keyframes())
    places.push_back({keyframe.frame_index, keyframe.map, keyframe.T_map_camera});
  return places;
}

std::vector<std::uint8_t> to_file_bytes(const SlamCheckpoint& checkpoint) {
  StateWriter body, file;
  body(const_cast<SlamCheckpoint&>(checkpoint));  // a writer changes nothing
  std::array<char, 8> magic{};
  std::copy(kStateMagic.begin(), kStateMagic.end(), magic.begin());
  const std::uint64_t checksum = fnv1a(body.bytes());
  std::vector<std::uint8_t> contents = body.take();
  file(magic, kStateFileVersion, checksum, contents);
  return file.take();
}

Result<SlamCheckpoint> parse_slam_checkpoint(std::span<const std::uint8_t> bytes, const std::string& where) {
  detail::ByteCursor cursor(bytes);
  const auto magic = cursor.take(kStateMagic.size());
  if (!cursor.ok() || std::memcmp(magic.data(), kStateMagic.data(), kStateMagic.size()) != 0)
    return fail(ErrorCode::kCorrupted, where, "is not the state of a SLAM run");
  const auto version = cursor.value<std::uint32_t>();
  if (cursor.ok() && version != kStateFileVersion)
    return fail(ErrorCode::kUnsupported, where, "is of version {}, and this program reads version {}",
                version, kStateFileVersion);
  const auto checksum = cursor.value<std::uint64_t>();
  const auto size = cursor.value<std::uint64_t>();
  if (!cursor.ok() || size != cursor.remaining())
    return fail(ErrorCode::kTruncated, where, "is not complete ({} bytes)", bytes.size());
  const auto body = cursor.take(size);
  if (fnv1a(body) != checksum) return fail(ErrorCode::kCorrupted, where, "is damaged: its checksum is wrong");
  SlamCheckpoint checkpoint;
  StateReader reader(body);
  reader(checkpoint);
  if (!reader.ok() || reader.remaining() > 0)
    return fail(ErrorCode::kCorrupted, where, "is damaged: its contents contradict its format");
  if (const auto checked = check_camera(checkpoint.camera); !checked)
    return fail(ErrorCode::kCorrupted, where, "is damaged: {}", checked.error().message);
  return checkpoint;
}

Result<std::optional<SavedSlam>> read_slam_state(const std::filesystem::path& folder) {
  const auto path = folder / kSlamStateName;
  std::error_code code;
  if (!std::filesystem::exists(path, code)) return std::nullopt;
  const auto bytes = read_file_bytes(path);
  if (!bytes) return forward_error(bytes);
  auto checkpoint = parse_slam_checkpoint(*bytes, path.string());
  if (!checkpoint) return forward_error(checkpoint);
  auto records = read_slam_journal(folder / kSlamJournalName, checkpoint->journal);
  if (!records) return forward_error(records);
  return SavedSlam{std::move(*checkpoint), std::move(*records)};
}

Result<std::optional<SavedSlam>> read_saved_slam(const std::filesystem::path& folder) {
  auto saved = read_slam_state(folder);
  if (!saved) return tl::make_unexpected(cannot_continue(saved.error()));
  return saved;
}

}  // namespace hm
