#pragma once
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string_view>
#include <type_traits>
#include <vector>

#include "hm/core/result.hpp"

namespace hm {

/// Makes a folder, and those above it, where it is not there yet. An error (kUsage) names it and says why
/// not.
Result<void> make_folder(const std::filesystem::path& folder);

/// Makes the folder NAME in a folder of results. A link of that name is an error (kUsage): what it points to
/// is not ours to write into.
Result<void> make_folder_in(const std::filesystem::path& folder, std::string_view name);

/// Creates an empty file for writing and returns its descriptor, or -1 with errno set. A regular file that an
/// earlier run left there is removed; a link is not followed, it is an error (EEXIST), as is everything else.
int create_exclusively(const std::filesystem::path& path);

/// Makes a file's contents, or a folder's names, durable. Returns errno of a failure, or 0; 0 also where the
/// file system does not offer it.
int sync_to_disk(const std::filesystem::path& path);

/// When a finished file must lie on the disk.
enum class Durability {
  kBeforeRename,  ///< before it gets its name: a power cut leaves the old file or the new one
  kLater,         ///< one of very many: their owner calls sync_to_disk() before it vouches for them
};

/// A file that appears whole or not at all: bytes go in large chunks to `PATH.partial`, which finish()
/// renames to PATH. Destroyed without finish(), it leaves nothing. After a failed write the rest is ignored,
/// and finish() says what happened. Numbers are written as they lie in memory (little endian on every
/// platform we support).
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
  /// Overwrites bytes that were written before, at `offset` from the beginning; then goes on at the end.
  void rewrite(std::uint64_t offset, std::string_view bytes);
  /// Flushes and gives the file its name.
  Result<void> finish();

 private:
  struct Closer {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  void flush();
  void note_failure();

  std::filesystem::path path_, partial_path_;
  Durability durability_;
  std::unique_ptr<std::FILE, Closer> file_;
  std::vector<char> buffer_;
  int failure_ = 0;  ///< errno of the first failure
};

}  // namespace hm
