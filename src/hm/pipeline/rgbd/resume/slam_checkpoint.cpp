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
constexpr std::uint32_t kStateFileVersion = 2;

template <class T>
tl::unexpected<Error> with_remedy(const Result<T>& result) {
  return tl::make_unexpected(cannot_continue(result.error()));
}

}  // namespace

Error cannot_continue(Error error) {
  error.message += fmt::format("; the run cannot be continued: {}", kStartAnew);
  return error;
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

Result<std::optional<SavedSlam>> read_saved_slam(const std::filesystem::path& folder) {
  const auto path = folder / kSlamStateName;
  std::error_code code;
  if (!std::filesystem::exists(path, code)) return std::nullopt;
  const auto bytes = read_file_bytes(path);
  if (!bytes) return with_remedy(bytes);
  auto checkpoint = parse_slam_checkpoint(*bytes, path.string());
  if (!checkpoint) return with_remedy(checkpoint);
  auto records = read_slam_journal(folder / kSlamJournalName, checkpoint->journal);
  if (!records) return with_remedy(records);
  return SavedSlam{std::move(*checkpoint), std::move(*records)};
}

}  // namespace hm
