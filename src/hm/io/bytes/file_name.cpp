#include "hm/io/bytes/file_name.hpp"

#include <algorithm>
#include <cctype>

namespace hm {

std::string lower_extension(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

bool is_mesh_name(const std::filesystem::path& path) {
  const std::string extension = lower_extension(path);
  return extension == ".ply" || extension == ".obj" || extension == ".glb";
}

}  // namespace hm
