#include "hm/io/bytes/append_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "hm/io/bytes/output_file.hpp"

namespace hm {
namespace {

tl::unexpected<Error> cannot_be(const std::string& name, const char* what, int number) {
  return fail(ErrorCode::kUnreadable, name, "cannot be {}: {}", what, std::strerror(number));
}

}  // namespace

Result<AppendFile> AppendFile::create(const std::filesystem::path& path) {
  const int descriptor = create_exclusively(path);
  if (descriptor < 0) return cannot_be(path.string(), "written", errno);
  return AppendFile(path.string(), std::unique_ptr<std::FILE, Closer>(::fdopen(descriptor, "wb")), 0);
}

Result<AppendFile> AppendFile::continue_at(const std::filesystem::path& path, std::uint64_t size) {
  const int descriptor = ::open(path.c_str(), O_WRONLY | O_NOFOLLOW | O_CLOEXEC);
  if (descriptor < 0) return cannot_be(path.string(), "continued", errno);
  std::unique_ptr<std::FILE, Closer> file(::fdopen(descriptor, "wb"));
  struct stat status {};
  if (::fstat(descriptor, &status) != 0 || !S_ISREG(status.st_mode))
    return fail(ErrorCode::kUnreadable, path.string(), "is not a regular file");
  if (static_cast<std::uint64_t>(status.st_size) < size)
    return fail(ErrorCode::kCorrupted, path.string(), "has {} of {} bytes", status.st_size, size);
  if (::ftruncate(descriptor, static_cast<off_t>(size)) != 0 ||
      std::fseek(file.get(), static_cast<long>(size), SEEK_SET) != 0)
    return cannot_be(path.string(), "continued", errno);
  return AppendFile(path.string(), std::move(file), size);
}

void AppendFile::append(std::span<const std::uint8_t> bytes) {
  if (failure_ != 0) return;
  errno = 0;
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) != bytes.size())
    failure_ = errno != 0 ? errno : EIO;
  size_ += bytes.size();
}

Result<void> AppendFile::flush() {
  errno = 0;
  if (failure_ == 0 && std::fflush(file_.get()) != 0) failure_ = errno != 0 ? errno : EIO;
  return written();
}

Result<void> AppendFile::written() const {
  if (failure_ != 0) return cannot_be(name_, "written", failure_);
  return {};
}

Result<void> AppendFile::sync() const {
  if (::fsync(::fileno(file_.get())) != 0 && errno != EINVAL && errno != ENOTSUP)
    return cannot_be(name_, "written", errno);
  return {};
}

}  // namespace hm
