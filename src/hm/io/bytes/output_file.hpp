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

/// A file that appears whole or not at all: bytes go in large chunks to `PATH.partial`, which finish()
/// renames to PATH. Destroyed without finish(), it leaves nothing. After a failed write the rest is ignored,
/// and finish() says what happened. Numbers are written as they lie in memory (little endian on every
/// platform we support).
class OutputFile {
 public:
  explicit OutputFile(std::filesystem::path path);
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
  std::unique_ptr<std::FILE, Closer> file_;
  std::vector<char> buffer_;
  int failure_ = 0;  ///< errno of the first failure
};

}  // namespace hm
