#pragma once
#include <filesystem>
#include <span>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/io/bytes/append_file.hpp"
#include "hm/pipeline/rgbd/resume/tracked_record.hpp"

namespace hm {

/// How much of a journal counts: its first `bytes`, with this many frames.
struct JournalMark {
  std::uint64_t bytes = 0;
  std::uint64_t frames = 0;
  std::uint64_t digest = 0;  ///< over the checksums of these frames' records, in order

  template <class Archive>
  void visit_state(Archive& archive) {
    archive(bytes, frames, digest);
  }
  bool operator==(const JournalMark&) const = default;
};

/// Writes `slam_journal.bin`: one record for every frame of a SLAM run, with its keyframe where it became
/// one. It only grows, so that a save costs what is new. Format: docs/file_formats.md.
class SlamJournal {
 public:
  static Result<SlamJournal> create(const std::filesystem::path& path);
  /// Continues after `mark`; what stands behind it is cut off.
  static Result<SlamJournal> continue_at(const std::filesystem::path& path, const JournalMark& mark);

  void add(const TrackedRecord& record);
  /// Everything so far, once flush() has succeeded.
  [[nodiscard]] const JournalMark& mark() const { return mark_; }
  /// AppendFile::written()
  [[nodiscard]] Result<void> written() const { return file_.written(); }
  Result<void> flush() { return file_.flush(); }
  /// AppendFile::sync()
  [[nodiscard]] Result<void> sync() const { return file_.sync(); }

 private:
  SlamJournal(AppendFile file, const JournalMark& mark) : file_(std::move(file)), mark_(mark) {}
  AppendFile file_;
  JournalMark mark_;
};

/// Reads the records up to `mark`. Errors: not found, not such a file, another version, shorter than the mark
/// or changed (kCorrupted), with the record's number. Frames and stamps of the result increase, submaps do
/// not decrease, and each keyframe is of its record's frame.
Result<std::vector<TrackedRecord>> read_slam_journal(const std::filesystem::path& path,
                                                     const JournalMark& mark);

}  // namespace hm
