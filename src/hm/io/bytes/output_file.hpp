#pragma once
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <vector>

#include "hm/core/result.hpp"

namespace hm {

/// Creates a folder and its parents if missing. The error (kUsage) names the folder and the reason.
Result<void> make_folder(const std::filesystem::path& folder);

/// Creates the folder `name` inside a result folder. A symbolic link of that name is an error (kUsage), so
/// that nothing is written outside the result folder.
Result<void> make_folder_in(const std::filesystem::path& folder, std::string_view name);

/// Creates an empty file for writing and returns its descriptor, or -1 with errno set. An existing regular
/// file (left by an earlier run) is removed first; a link or anything else is an error (EEXIST), links are
/// not followed.
int create_exclusively(const std::filesystem::path& path);

/// Syncs a file's contents, or a folder's entries, to disk. Returns errno of a failure, or 0; 0 also where
/// the file system does not support it.
int sync_to_disk(const std::filesystem::path& path);

/// Time at which a finished file is synced to disk.
enum class Durability {
  kBeforeRename,  ///< before the rename: a power failure leaves the old file or the new one
  kLater,         ///< for very many files: the caller runs sync_to_disk() before relying on them
};

/// Atomic file writer: bytes go in large chunks to `PATH.partial`, which finish() renames to PATH. Destroyed
/// without finish(), it leaves nothing. After a failed write later ones are ignored, and finish() returns the
/// error. Numbers are written in native byte order (little endian on every supported platform).
class OutputFile {
 public:
  explicit OutputFile(std::filesystem::path path, Durability durability = Durability::kBeforeRename);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void write(const void* bytes, std::size_t count);
  void write(std::string_view text) { write(text.data(), text.size()); }
  template <class T>
  void write_value(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    write(&value, sizeof value);
  }
  /// Overwrites bytes already written, at `offset` from the beginning; later writes append again.
  void rewrite(std::uint64_t offset, std::string_view bytes);
  /// Hands everything so far to the operating system: a kill of the process then leaves it in `PATH.partial`.
  void hand_over();
  /// The error of the first write that failed, as far as bytes have been handed over by now: of a full disk
  /// at most 1 MB late.
  [[nodiscard]] Result<void> written() const;
  /// Flushes, syncs (kBeforeRename) and renames the file; returns the first error.
  Result<void> finish();

 private:
  struct Closer {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  void flush();
  void note_failure();
  [[nodiscard]] Result<void> result_of(const std::error_code& code) const;

  std::filesystem::path path_, partial_path_;
  Durability durability_;
  std::unique_ptr<std::FILE, Closer> file_;
  std::vector<char> buffer_;
  int failure_ = 0;  ///< errno of the first failure
};

}  // namespace hm
