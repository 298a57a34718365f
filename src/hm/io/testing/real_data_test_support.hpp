#pragma once
#include <cstdlib>
#include <filesystem>

namespace hm {

/// Folder of real recordings, if available: $HM_DATA, else ../shared/data beside the sources.
inline std::filesystem::path real_data_folder() {
  const char* given = std::getenv("HM_DATA");
  return given != nullptr ? std::filesystem::path(given)
                          : std::filesystem::path(HM_SOURCE_DIR) / ".." / "shared" / "data";
}

}  // namespace hm
