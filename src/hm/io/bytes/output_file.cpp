#include "hm/io/bytes/output_file.hpp"

#include <fcntl.h>
#include <unistd.h>

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

Result<void> make_folder_in(const std::filesystem::path& folder, std::string_view name) {
  const std::filesystem::path path = folder / name;
  std::error_code ignored;
  if (std::filesystem::is_symlink(path, ignored))
    return fail(ErrorCode::kUsage, path,
                "is a link, which is not followed: remove it, or choose another folder");
  return make_folder(path);
}

int create_exclusively(const std::filesystem::path& path) {
  std::error_code ignored;
  if (std::filesystem::symlink_status(path, ignored).type() == std::filesystem::file_type::regular)
    std::filesystem::remove(path, ignored);
  return ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
}

int sync_to_disk(const std::filesystem::path& path) {
  const int descriptor = ::open(path.empty() ? "." : path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return errno;
  const int failure = ::fsync(descriptor) != 0 && errno != EINVAL && errno != ENOTSUP ? errno : 0;
  ::close(descriptor);
  return failure;
}

OutputFile::OutputFile(std::filesystem::path path, Durability durability)
    : path_(std::move(path)), partial_path_(path_), durability_(durability) {
  partial_path_ += ".partial";
  const int descriptor = create_exclusively(partial_path_);
  if (descriptor >= 0) file_.reset(::fdopen(descriptor, "wb"));
  if (!file_) {
    note_failure();
    if (descriptor >= 0) ::close(descriptor);
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

void OutputFile::hand_over() {
  if (failure_ != 0) return;
  flush();
  errno = 0;
  if (failure_ == 0 && std::fflush(file_.get()) != 0) note_failure();
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
  const bool is_ours = file_ != nullptr, durable = durability_ == Durability::kBeforeRename;
  if (is_ours) flush();
  errno = 0;
  if (is_ours && durable && failure_ == 0 && ::fsync(::fileno(file_.get())) != 0 && errno != EINVAL)
    note_failure();
  errno = 0;
  if (is_ours && std::fclose(file_.release()) != 0) note_failure();
  std::error_code code(failure_, std::generic_category());
  if (!code) std::filesystem::rename(partial_path_, path_, code);
  if (!code && durable) code.assign(sync_to_disk(path_.parent_path()), std::generic_category());
  std::error_code ignored;
  if (code && is_ours) std::filesystem::remove(partial_path_, ignored);
  return result_of(code);
}

Result<void> OutputFile::written() const {
  return result_of(std::error_code(failure_, std::generic_category()));
}

Result<void> OutputFile::result_of(const std::error_code& code) const {
  if (!code) return {};
  if (code == std::errc::file_exists)
    return fail(ErrorCode::kUnreadable, partial_path_.string(),
                "is in the way and no file of ours (links are not followed): remove it");
  return fail(ErrorCode::kUnreadable, path_.string(), "cannot be written: {}", code.message());
}

}  // namespace hm
