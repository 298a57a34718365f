#include "hm/io/bytes/file_bytes.hpp"

#include "hm/io/bytes/input_file.hpp"

namespace hm {

Result<std::vector<std::uint8_t>> read_file_bytes(const std::filesystem::path& path, std::size_t max_bytes) {
  auto file = InputFile::open(path);
  if (!file) return forward_error(file);
  if (file->size() > max_bytes)
    return fail(ErrorCode::kUnsupported, path, "{} bytes; at most {} are read", file->size(), max_bytes);
  std::vector<std::uint8_t> bytes(file->size());
  if (!file->read(bytes.data(), bytes.size()))
    return fail(ErrorCode::kUnreadable, path, "its {} bytes could not all be read", bytes.size());
  return bytes;
}

Result<void> write_file_bytes(const std::filesystem::path& path, std::span<const std::uint8_t> bytes,
                              Durability durability) {
  OutputFile file(path, durability);
  file.write(bytes.data(), bytes.size());
  return file.finish();
}

Result<void> write_file_text(const std::filesystem::path& path, std::string_view text) {
  return write_file_bytes(path, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

}  // namespace hm
