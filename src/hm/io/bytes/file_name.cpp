#include "hm/io/bytes/file_name.hpp"

#include <algorithm>
#include <cctype>
#include <string_view>

namespace hm {

std::string lower_extension(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

namespace {

bool is_one_of(const std::string& extension, std::string_view list) {
  while (!list.empty()) {
    const std::size_t end = std::min(list.find(' '), list.size());
    if (!extension.empty() && list.substr(0, end) == extension) return true;
    list.remove_prefix(std::min(end + 1, list.size()));
  }
  return false;
}

}  // namespace

bool is_written_mesh_name(const std::filesystem::path& path) {
  return is_one_of(lower_extension(path), kWrittenMeshNames);
}

bool is_mesh_name(const std::filesystem::path& path) { return is_one_of(lower_extension(path), kMeshNames); }

}  // namespace hm
