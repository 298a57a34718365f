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

/// There is a regular file (or a link to one) that can be looked at.
inline bool is_file(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::is_regular_file(path, ignored);
}

/// A regular file read in large chunks from front to back, with seeking; it knows where it is for error
/// messages.
class InputFile {
 public:
  static Result<InputFile> open(const std::filesystem::path& path);

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] std::uint64_t size() const { return size_; }
  /// The offset of the next byte.
  [[nodiscard]] std::uint64_t offset() const { return buffer_offset_ + next_; }
  [[nodiscard]] std::uint64_t remaining() const { return offset() < size_ ? size_ - offset() : 0; }
  /// Lines read by read_line() so far.
  [[nodiscard]] std::uint64_t line() const { return line_; }

  /// Reads exactly `count` bytes; false (nothing sensible read) when there are fewer.
  bool read(void* bytes, std::size_t count);
  template <class T>
  bool read_value(T& value) {
    return read(&value, sizeof value);
  }
  /// The next line without its end (LF or CRLF), valid until the next call; false at the end of the file.
  /// Lines beyond 1 MiB are cut into several.
  bool read_line(std::string_view& line);
  void seek(std::uint64_t offset);

  /// "name:line" and "name, byte offset", for errors.
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
  /// read() of at least a buffer's worth, when the buffer is used up.
  bool read_past_buffer(char* out, std::size_t count);

  std::string name_;
  std::unique_ptr<std::FILE, Closer> file_;
  std::uint64_t size_ = 0, line_ = 0;
  std::vector<char> buffer_;
  std::uint64_t buffer_offset_ = 0;  ///< of buffer_[0] in the file
  std::size_t next_ = 0, filled_ = 0;
};

}  // namespace hm
