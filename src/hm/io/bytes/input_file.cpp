#include "hm/io/bytes/input_file.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <system_error>

namespace hm {
namespace {
constexpr std::size_t kInputBufferBytes = std::size_t{1} << 20u;
}

Result<InputFile> InputFile::open(const std::filesystem::path& path) {
  InputFile file;
  file.name_ = path.string();
  std::error_code code;
  const auto status = std::filesystem::status(path, code);
  if (!std::filesystem::exists(status)) return fail(ErrorCode::kNotFound, file.name_, "no such file");
  if (!std::filesystem::is_regular_file(status))
    return fail(ErrorCode::kUnreadable, file.name_, "not a regular file");
  file.size_ = std::filesystem::file_size(path, code);
  errno = 0;
  if (!code) file.file_.reset(std::fopen(path.c_str(), "rb"));
  if (!file.file_)
    return fail(ErrorCode::kUnreadable, file.name_, "cannot be opened: {}",
                code ? code.message() : std::strerror(errno));
  std::setvbuf(file.file_.get(), nullptr, _IONBF, 0);
  file.buffer_.resize(static_cast<std::size_t>(std::clamp<std::uint64_t>(file.size_, 1, kInputBufferBytes)));
  return file;
}

bool InputFile::refill() {
  const std::size_t kept = filled_ - next_;
  std::memmove(buffer_.data(), buffer_.data() + next_, kept);
  buffer_offset_ += next_;
  next_ = 0;
  const std::size_t count = std::fread(buffer_.data() + kept, 1, buffer_.size() - kept, file_.get());
  filled_ = kept + count;
  return count > 0;
}

bool InputFile::read(void* bytes, std::size_t count) {
  char* out = static_cast<char*>(bytes);
  while (count > 0) {
    if (next_ == filled_ && count >= buffer_.size()) return read_past_buffer(out, count);
    if (next_ == filled_ && !refill()) return false;
    const std::size_t part = std::min(count, filled_ - next_);
    std::memcpy(out, buffer_.data() + next_, part);
    next_ += part;
    out += part;
    count -= part;
  }
  return true;
}

bool InputFile::read_past_buffer(char* out, std::size_t count) {
  const std::size_t got = std::fread(out, 1, count, file_.get());
  buffer_offset_ += next_ + got;
  next_ = filled_ = 0;
  return got == count;
}

bool InputFile::read_line(std::string_view& line) {
  std::size_t searched = 0;
  const char* newline = nullptr;
  while (true) {
    const std::size_t available = filled_ - next_;
    const char* begin = buffer_.data() + next_;
    newline = static_cast<const char*>(std::memchr(begin + searched, '\n', available - searched));
    searched = available;
    if (newline || available == buffer_.size() || !refill()) break;
  }
  if (!newline && filled_ == next_) return false;
  const char* begin = buffer_.data() + next_;
  const std::size_t length = newline ? static_cast<std::size_t>(newline - begin) : filled_ - next_;
  next_ += length + (newline ? 1 : 0);
  line = std::string_view(begin, length);
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  ++line_;
  return true;
}

void InputFile::seek(std::uint64_t offset) {
  // A failed seek leaves reads short, which their callers report.
  std::fseek(file_.get(), static_cast<long>(std::min(offset, size_)), SEEK_SET);
  buffer_offset_ = std::min(offset, size_);
  next_ = filled_ = 0;
}

}  // namespace hm
