#include "hm/io/file_bytes.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

namespace hm {
namespace {

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using FileHandle = std::unique_ptr<std::FILE, CloseFile>;

}  // namespace

Result<std::vector<std::uint8_t>> read_file_bytes(const std::filesystem::path& path, std::size_t max_bytes) {
  std::error_code status;
  if (!std::filesystem::exists(path, status))
    return fail(ErrorCode::kNotFound, path, "there is no such file");
  if (!std::filesystem::is_regular_file(path, status))
    return fail(ErrorCode::kUnreadable, path, "this is not a file");
  const FileHandle file(std::fopen(path.c_str(), "rb"));
  if (!file) return fail(ErrorCode::kUnreadable, path, "cannot be opened: {}", std::strerror(errno));
  const std::uintmax_t size = std::filesystem::file_size(path, status);
  if (status) return fail(ErrorCode::kUnreadable, path, "{}", status.message());
  if (size > max_bytes)
    return fail(ErrorCode::kUnsupported, path, "{} bytes; at most {} are read", size, max_bytes);
  std::vector<std::uint8_t> bytes(size);
  const std::size_t got = size == 0 ? 0 : std::fread(bytes.data(), 1, bytes.size(), file.get());
  if (got != bytes.size())
    return fail(ErrorCode::kUnreadable, path, "only {} of {} bytes could be read", got, size);
  return bytes;
}

Result<void> write_file_bytes(const std::filesystem::path& path, std::span<const std::uint8_t> bytes) {
  FileHandle file(std::fopen(path.c_str(), "wb"));
  if (!file) return fail(ErrorCode::kUnreadable, path, "cannot be written: {}", std::strerror(errno));
  const std::size_t put = bytes.empty() ? 0 : std::fwrite(bytes.data(), 1, bytes.size(), file.get());
  const bool closed = std::fclose(file.release()) == 0;
  if (put != bytes.size() || !closed)
    return fail(ErrorCode::kUnreadable, path, "only {} of {} bytes could be written: {}", put, bytes.size(),
                std::strerror(errno));
  return {};
}

Result<void> write_file_text(const std::filesystem::path& path, std::string_view text) {
  return write_file_bytes(path, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

}  // namespace hm
