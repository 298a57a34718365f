#pragma once
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "hm/core/result.hpp"

namespace hm {

/// True when `path` is an accessible regular file or a link to one.
inline bool is_file(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::is_regular_file(path, ignored);
}

/// Buffered reader of a regular file, with seeking; tracks line and byte offset for error messages.
class InputFile {
 public:
  static Result<InputFile> open(const std::filesystem::path& path);

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] std::uint64_t size() const { return size_; }
  /// Offset of the next byte.
  [[nodiscard]] std::uint64_t offset() const { return buffer_offset_ + next_; }
  [[nodiscard]] std::uint64_t remaining() const { return offset() < size_ ? size_ - offset() : 0; }
  /// Number of lines read by read_line() so far.
  [[nodiscard]] std::uint64_t line() const { return line_; }

  /// Reads exactly `count` bytes; false (contents of `bytes` undefined) when fewer remain.
  bool read(void* bytes, std::size_t count);
  template <class T>
  bool read_value(T& value) {
    return read(&value, sizeof value);
  }
  /// Reads the next line without its end (LF or CRLF), valid until the next call; false at the end of the
  /// file. Lines longer than 1 MiB are split.
  bool read_line(std::string_view& line);
  void seek(std::uint64_t offset);

  /// Position for error messages: "name:line" or "name, byte offset".
  [[nodiscard]] std::string at_line() const { return name_ + ":" + std::to_string(line_); }
  [[nodiscard]] std::string at_byte(std::uint64_t byte) const {
    return name_ + ", byte " + std::to_string(byte);
  }
  [[nodiscard]] std::string at_byte() const { return at_byte(offset()); }

 private:
  struct Closer {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  InputFile() = default;
  bool refill();
  /// Reads at least one buffer's worth when the buffer is exhausted.
  bool read_past_buffer(char* out, std::size_t count);

  std::string name_;
  std::unique_ptr<std::FILE, Closer> file_;
  std::uint64_t size_ = 0, line_ = 0;
  std::vector<char> buffer_;
  std::uint64_t buffer_offset_ = 0;  ///< of buffer_[0] in the file
  std::size_t next_ = 0, filled_ = 0;
};

}  // namespace hm
