#include "hm/pipeline/rgbd/resume/slam_journal.hpp"

#include <cstring>
#include <string_view>
#include <utility>

#include "hm/core/hash.hpp"
#include "hm/geometry/state_bytes.hpp"
#include "hm/io/bytes/input_file.hpp"

namespace hm {
namespace {

constexpr std::string_view kJournalMagic = "hmslamjr";
constexpr std::uint32_t kJournalVersion = 1;
constexpr std::size_t kJournalHeaderBytes = 16;
/// A frame's record: a keyframe of many thousand features has a few megabytes.
constexpr std::uint64_t kMostRecordBytes = std::uint64_t{1} << 28;

std::uint64_t next_digest(std::uint64_t digest, std::uint64_t checksum) {
  Fnv1a hash;
  hash.add(digest);
  hash.add(checksum);
  return hash.value();
}

std::vector<std::uint8_t> journal_header() {
  std::vector<std::uint8_t> bytes(kJournalHeaderBytes, 0);
  std::memcpy(bytes.data(), kJournalMagic.data(), kJournalMagic.size());
  std::memcpy(bytes.data() + kJournalMagic.size(), &kJournalVersion, sizeof kJournalVersion);
  return bytes;
}

/// Whether a record may follow the frames before it; `last` and `last_keyframe` are null at the beginning.
bool may_follow(const TrackedRecord& record, const TrackedRecord* last, const TrackedRecord* last_posed,
                const Keyframe* last_keyframe) {
  if (last && record.index <= last->index) return false;
  if (!record.was_read) return !record.T_odom_camera && !record.keyframe && !record.is_mapped;
  if (record.submap < 0 || ((record.keyframe || record.is_mapped) && !record.T_odom_camera)) return false;
  if (record.T_odom_camera && last_posed &&
      (record.stamp <= last_posed->stamp || record.submap < last_posed->submap))
    return false;
  if (!record.keyframe) return true;
  const Keyframe& keyframe = *record.keyframe;
  return keyframe.frame_index == record.index && keyframe.stamp == record.stamp &&
         keyframe.submap == record.submap &&
         (!last_keyframe ||
          (keyframe.stamp > last_keyframe->stamp && keyframe.submap >= last_keyframe->submap));
}

Result<void> read_journal_header(InputFile& file) {
  std::vector<std::uint8_t> bytes(kJournalHeaderBytes);
  if (!file.read(bytes.data(), bytes.size()) ||
      std::memcmp(bytes.data(), kJournalMagic.data(), kJournalMagic.size()) != 0)
    return fail(ErrorCode::kCorrupted, file.name(), "is not the journal of a SLAM run");
  if (bytes != journal_header())
    return fail(ErrorCode::kUnsupported, file.name(), "is of a version that this program cannot read");
  return {};
}

/// The bytes of the next record, whose checksum goes into `digest`.
Result<std::vector<std::uint8_t>> next_journal_record(InputFile& file, std::uint64_t end,
                                                      std::uint64_t& digest) {
  const auto damaged = fail(ErrorCode::kCorrupted, file.at_byte(), "the record of a frame is damaged");
  std::uint64_t size = 0, checksum = 0;
  if (!file.read_value(size) || !file.read_value(checksum) || file.offset() > end ||
      size > std::min(end - file.offset(), kMostRecordBytes))
    return damaged;
  std::vector<std::uint8_t> bytes(size);
  if (!file.read(bytes.data(), bytes.size()) || fnv1a(bytes) != checksum) return damaged;
  digest = next_digest(digest, checksum);
  return bytes;
}

}  // namespace

Result<SlamJournal> SlamJournal::create(const std::filesystem::path& path) {
  auto file = AppendFile::create(path);
  if (!file) return forward_error(file);
  file->append(journal_header());
  return SlamJournal(std::move(*file), {kJournalHeaderBytes, 0, 0});
}

Result<SlamJournal> SlamJournal::continue_at(const std::filesystem::path& path, const JournalMark& mark) {
  auto file = AppendFile::continue_at(path, mark.bytes);
  if (!file) return forward_error(file);
  return SlamJournal(std::move(*file), mark);
}

void SlamJournal::add(const TrackedRecord& record) {
  StateWriter writer;
  auto& fields = const_cast<TrackedRecord&>(record);  // a writer changes nothing
  writer(fields);
  const std::uint64_t size = writer.bytes().size(), checksum = fnv1a(writer.bytes());
  StateWriter head;
  head(size, checksum);
  file_.append(head.bytes());
  file_.append(writer.bytes());
  mark_ = {file_.size(), mark_.frames + 1, next_digest(mark_.digest, checksum)};
}

Result<std::vector<TrackedRecord>> read_slam_journal(const std::filesystem::path& path,
                                                     const JournalMark& mark) {
  auto file = InputFile::open(path);
  if (!file) return forward_error(file);
  if (const auto read = read_journal_header(*file); !read) return forward_error(read);
  if (mark.bytes < kJournalHeaderBytes || mark.bytes > file->size())
    return fail(ErrorCode::kCorrupted, file->name(), "has {} of {} bytes: the end is missing", file->size(),
                mark.bytes);
  std::vector<TrackedRecord> records;
  std::uint64_t digest = 0;
  std::optional<std::size_t> last_posed, last_keyframe;
  while (file->offset() < mark.bytes) {
    const std::string where = file->at_byte();
    const auto bytes = next_journal_record(*file, mark.bytes, digest);
    if (!bytes) return forward_error(bytes);
    StateReader reader(*bytes);
    TrackedRecord record;
    reader(record);
    if (!reader.ok() || reader.remaining() > 0 ||
        !may_follow(record, records.empty() ? nullptr : &records.back(),
                    last_posed ? &records[*last_posed] : nullptr,
                    last_keyframe ? records[*last_keyframe].keyframe.get() : nullptr))
      return fail(ErrorCode::kCorrupted, where, "the record of frame number {} is damaged", records.size());
    if (record.T_odom_camera) last_posed = records.size();
    if (record.keyframe) last_keyframe = records.size();
    records.push_back(std::move(record));
  }
  if (digest != mark.digest || records.size() != mark.frames)
    return fail(ErrorCode::kCorrupted, file->name(),
                "does not belong to the state beside it, or is damaged ({} frames, {} expected)",
                records.size(), mark.frames);
  return records;
}

}  // namespace hm
