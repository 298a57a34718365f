#include "hm/io/bytes/output_file.hpp"

#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

namespace hm {
namespace {
constexpr std::size_t kOutputBufferBytes = std::size_t{1} << 20u;
}

Result<void> make_folder(const std::filesystem::path& folder) {
  std::error_code status;
  std::filesystem::create_directories(folder, status);
  if (status) return fail(ErrorCode::kUsage, folder, "cannot make this folder: {}", status.message());
  return {};
}

OutputFile::OutputFile(std::filesystem::path path) : path_(std::move(path)), partial_path_(path_) {
  partial_path_ += ".partial";
  file_.reset(std::fopen(partial_path_.c_str(), "wb"));
  if (!file_) {
    note_failure();
    return;
  }
  std::setvbuf(file_.get(), nullptr, _IONBF, 0);
  buffer_.reserve(kOutputBufferBytes);
}

OutputFile::~OutputFile() {
  if (!file_) return;
  file_.reset();
  std::error_code ignored;
  std::filesystem::remove(partial_path_, ignored);
}

void OutputFile::note_failure() {
  if (failure_ == 0) failure_ = errno != 0 ? errno : EIO;
}

void OutputFile::write(const void* bytes, std::size_t count) {
  if (failure_ != 0) return;
  if (buffer_.size() + count > kOutputBufferBytes) flush();
  if (count > kOutputBufferBytes) {
    errno = 0;
    if (std::fwrite(bytes, 1, count, file_.get()) != count) note_failure();
    return;
  }
  const char* begin = static_cast<const char*>(bytes);
  buffer_.insert(buffer_.end(), begin, begin + count);
}

void OutputFile::flush() {
  errno = 0;
  if (failure_ == 0 && std::fwrite(buffer_.data(), 1, buffer_.size(), file_.get()) != buffer_.size())
    note_failure();
  buffer_.clear();
}

void OutputFile::rewrite(std::uint64_t offset, std::string_view bytes) {
  if (failure_ != 0) return;
  flush();
  errno = 0;
  const bool done = std::fseek(file_.get(), static_cast<long>(offset), SEEK_SET) == 0 &&
                    std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) == bytes.size() &&
                    std::fseek(file_.get(), 0, SEEK_END) == 0;
  if (!done) note_failure();
}

Result<void> OutputFile::finish() {
  if (file_) flush();
  errno = 0;
  if (file_ && std::fclose(file_.release()) != 0) note_failure();
  std::error_code code(failure_, std::generic_category());
  if (!code) std::filesystem::rename(partial_path_, path_, code);
  if (!code) return {};
  std::error_code ignored;
  std::filesystem::remove(partial_path_, ignored);
  return fail(ErrorCode::kUnreadable, path_.string(), "cannot be written: {}", code.message());
}

}  // namespace hm
